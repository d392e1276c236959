"""Records in the formats of the field, made of the half-hourly year 2019 of Svartberget and the days of Poker Flat."""

import functools

import numpy as np
import pandas as pd
from scripts import ROOT

from analysis.validation import towers
from sim.io.forcing import saturation

SWEDEN = {"latitude_deg": 64.256, "longitude_deg": 19.774, "utc_offset_h": 1.0}
ALASKA = {"latitude_deg": 65.124}
POKER_FLAT = ROOT / "analysis" / "observations" / "US-Prr_2011-2014_daily.csv.gz"


@functools.cache
def measured() -> pd.DataFrame:
    """Svartberget's weather as the validation reads it, by local solar time."""
    tower = towers.SE_SVB
    return towers.forcing(towers.read(tower), tower)


def remembered(make):
    """The same record again as a copy, which a test may change; making one takes as long as reading it."""
    made = functools.cache(make)

    @functools.wraps(make)
    def copied(*args, **more):
        return made(*args, **more).copy()

    return copied


def _clock(days: int | None) -> tuple[pd.DataFrame, pd.DatetimeIndex]:
    """The weather of the first days of the year, and the starts of its intervals by the clock."""
    weather = measured() if days is None else measured().iloc[: 48 * days]
    return weather, weather.index - pd.Timedelta(minutes=30)


def _stamps(times) -> np.ndarray:
    return times.strftime("%Y%m%d%H%M").astype(np.int64).to_numpy()


@remembered
def fluxnet(days: int | None = None) -> pd.DataFrame:
    """FULLSET, half-hourly: consolidated variables with their quality, and some that are not used."""
    weather, start = _clock(days)
    air = weather["air_temperature_c"]
    deficit = (1.0 - weather["relative_humidity"]) * saturation(air)
    values = {
        "TA_F": air,
        "SW_IN_F": weather["shortwave_w_m2"],
        "LW_IN_F": weather["longwave_w_m2"],
        "VPD_F": deficit,
        "PA_F": 97.3,
        "P_F": weather["precipitation_mm"],
        "WS_F": weather["wind_speed_m_s"],
    }
    table = pd.DataFrame(
        {"TIMESTAMP_START": _stamps(start), "TIMESTAMP_END": _stamps(start + pd.Timedelta(minutes=30))}
    )
    for name, column in values.items():
        table[name] = np.asarray(column)
        table[f"{name}_QC"] = 0
    table.loc[100:147, "TA_F_QC"] = 2
    return table.assign(WD=180.0, RH=-9999, NEE_VUT_REF=-9999, TA_ERA=np.asarray(air) + 1.0)


@remembered
def ameriflux(days: int | None = None) -> pd.DataFrame:
    """BASE, half-hourly: sensors at positions, no longwave, -9999 where nothing was measured."""
    weather, start = _clock(days)
    table = pd.DataFrame(
        {
            "TIMESTAMP_START": _stamps(start),
            "TIMESTAMP_END": _stamps(start + pd.Timedelta(minutes=30)),
            "TA_1_1_1": weather["air_temperature_c"].to_numpy(),
            "TA_1_2_1": weather["air_temperature_c"].to_numpy() - 1.0,
            "RH_1_1_1": 100.0 * weather["relative_humidity"].to_numpy(),
            "WS_1_1_1": weather["wind_speed_m_s"].to_numpy(),
            "SW_IN_1_1_1": weather["shortwave_w_m2"].to_numpy() - 2.0,
            "P_1_1_1": weather["precipitation_mm"].to_numpy(),
            "CO2": -9999,
        }
    )
    return table


def with_gaps(table: pd.DataFrame) -> pd.DataFrame:
    """AmeriFlux' record with an hour, a day and a row missing."""
    table = table.copy()
    table.loc[1000:1001, "TA_1_1_1"] = -9999
    table.loc[2000:2047, ["RH_1_1_1", "SW_IN_1_1_1"]] = -9999
    return table.drop(index=3000)


@remembered
def icos(days: int | None = None) -> pd.DataFrame:
    """ICOS ETC, level 2, half-hourly."""
    weather, start = _clock(days)
    return pd.DataFrame(
        {
            "TIMESTAMP_START": _stamps(start),
            "TIMESTAMP_END": _stamps(start + pd.Timedelta(minutes=30)),
            "TA": weather["air_temperature_c"].to_numpy(),
            "RH": 100.0 * weather["relative_humidity"].to_numpy(),
            "WS": weather["wind_speed_m_s"].to_numpy(),
            "SW_IN": weather["shortwave_w_m2"].to_numpy(),
            "LW_IN": weather["longwave_w_m2"].to_numpy(),
            "P": weather["precipitation_mm"].to_numpy(),
            "PA": 97.3,
        }
    )


@remembered
def era5_land(days: int | None = None, since_midnight: bool = True) -> pd.DataFrame:
    """ERA5-Land, hourly by UTC: values at the hour, and sums since midnight (or, as ERA5, of the hour) up to it."""
    weather, start = _clock(days)
    hourly = weather.set_axis(start).resample("h").mean()
    rain = weather["precipitation_mm"].set_axis(start).resample("h").sum()
    ends = hourly.index  # UTC is an hour behind the clock, and the sums end an hour on
    sums = pd.DataFrame(
        {
            "ssrd": 3600.0 * hourly["shortwave_w_m2"].to_numpy(),
            "strd": 3600.0 * hourly["longwave_w_m2"].to_numpy(),
            "tp": rain.to_numpy() / 1000.0,
        },
        index=ends,
    )
    if since_midnight:
        sums = sums.groupby((ends - pd.Timedelta(hours=1)).normalize()).cumsum()
    air = hourly["air_temperature_c"].to_numpy()
    vapour = hourly["relative_humidity"].to_numpy() * saturation(air) / 6.1094
    table = pd.DataFrame(
        {
            "t2m": air + 273.15,
            "d2m": 243.04 * np.log(vapour) / (17.625 - np.log(vapour)) + 273.15,
            "u10": 0.6 * hourly["wind_speed_m_s"].to_numpy(),
            "v10": -0.8 * hourly["wind_speed_m_s"].to_numpy(),
            "sp": 97300.0,
        },
        index=ends,
    )
    return pd.concat([table, sums], axis=1).rename_axis("valid_time").reset_index()


@remembered
def era5_daily() -> pd.DataFrame:
    """ERA5-Land, daily means and sums."""
    days = measured().groupby(measured().index.normalize())
    mean, total = days.mean(), days.sum()
    air = mean["air_temperature_c"]
    vapour = mean["relative_humidity"] * saturation(air) / 6.1094
    return pd.DataFrame(
        {
            "valid_time": mean.index,
            "t2m": air + 273.15,
            "d2m": 243.04 * np.log(vapour) / (17.625 - np.log(vapour)) + 273.15,
            "ssrd": 86400.0 * mean["shortwave_w_m2"],
            "strd": 86400.0 * mean["longwave_w_m2"],
            "tp": total["precipitation_mm"] / 1000.0,
            "u10": mean["wind_speed_m_s"],
            "v10": 0.0,
            "sp": 97300.0,
        }
    ).reset_index(drop=True)
