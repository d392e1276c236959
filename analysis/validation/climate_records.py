"""Daily weather of the towers that the weather generator was calibrated on, in one form."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.validation import poker_flat, towers
from sim import radiation
from sim.io import disaggregation
from sim.jit import uncompiled
from sim.physical_constants import FREEZING_POINT_K
from sim.weather import sky_emissivity

black_body = uncompiled(radiation.black_body)
emissivity = uncompiled(sky_emissivity)

MEASURED_SHARE = 0.5
SEASONS = {"winter": (12, 1, 2), "spring": (3, 4, 5), "summer": (6, 7, 8), "autumn": (9, 10, 11)}


@dataclass(frozen=True)
class Climate:
    """A record: days with air_temperature_c, vapour_pressure_hpa, shortwave_w_m2, longwave_w_m2, precipitation_mm; NaN
    where not measured. `halves` splits it in two by even and odd years, or days where it has one year only."""

    name: str
    latitude_deg: float
    days: pd.DataFrame

    def halves(self) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Days of even and of odd years; of even and odd days of the year if there are not two whole years."""
        index = self.days.index
        turn = index.day_of_year if len(index) < 2 * 365 else index.year
        return self.days[turn % 2 == 0], self.days[turn % 2 == 1]


def records() -> dict[str, Climate]:
    """Climates by name: US-Prr 2011-14, its ERA-Interim 1989-2014 (no longwave), SE-Svb 2019, FI-Sod 2013-14."""
    return {climate.name: climate for climate in (_poker_flat(), _era_interim(), _svartberget(), _sodankyla())}


def _poker_flat() -> Climate:
    daily = poker_flat.record()
    days = pd.DataFrame(
        {
            "air_temperature_c": daily["TA_F"].where(daily["TA_F_QC"] >= MEASURED_SHARE),
            "vapour_pressure_hpa": (saturation(daily["TA_F"]) - daily["VPD_F"]).where(
                daily["VPD_F_QC"] >= MEASURED_SHARE
            ),
            "shortwave_w_m2": daily["SW_IN_F"].where(daily["SW_IN_F_QC"] >= MEASURED_SHARE),
            "longwave_w_m2": daily["LW_IN_F"].where(daily["LW_IN_F_QC"] >= MEASURED_SHARE),
            "precipitation_mm": daily["P_F"].where(daily["P_F_QC"] >= MEASURED_SHARE),
        }
    )
    return Climate("US-Prr", poker_flat.LATITUDE_DEG, days)


def _era_interim() -> Climate:
    daily = poker_flat.era_interim()
    days = pd.DataFrame(
        {
            "air_temperature_c": daily["TA_ERA"],
            "vapour_pressure_hpa": saturation(daily["TA_ERA"]) - daily["VPD_ERA"],
            "shortwave_w_m2": daily["SW_IN_ERA"],
            "longwave_w_m2": float("nan"),
            "precipitation_mm": daily["P_ERA"],
        }
    )
    return Climate("ERA-Interim", poker_flat.LATITUDE_DEG, days)


def _svartberget() -> Climate:
    tower = towers.SE_SVB
    weather = towers.forcing(towers.read(tower), tower)
    vapour = weather["relative_humidity"] * saturation(weather["air_temperature_c"])
    days = weather.assign(vapour_pressure_hpa=vapour).resample("D").mean()
    days["precipitation_mm"] = weather["precipitation_mm"].resample("D").sum()
    return Climate("SE-Svb", tower.latitude_deg, days)


def _sodankyla() -> Climate:
    table = towers.read_table("FI-Sod_2013-2014_daily.csv.gz")
    return Climate("FI-Sod", 67.362, table.set_index(pd.to_datetime(table.pop("date"))))


def saturation(temperature: pd.Series) -> pd.Series:
    """Saturation vapour pressure over water [hPa] at temperatures in degC."""
    return temperature.map(disaggregation.saturation_water, na_action="ignore")


def season_of(index: pd.DatetimeIndex) -> np.ndarray:
    """Name of each day's season."""
    names = {month: name for name, months in SEASONS.items() for month in months}
    return np.array([names[month] for month in index.month])


def cloud_term(days: pd.DataFrame) -> pd.Series:
    """Share of the clear sky's missing emissivity that clouds close, from measured longwave (`sim.weather`)."""
    clear = clear_emissivity(days)
    return (days["longwave_w_m2"] / black_body(days["air_temperature_c"] + FREEZING_POINT_K) - clear) / (1.0 - clear)


def clear_emissivity(days: pd.DataFrame) -> pd.Series:
    """Emissivity of a clear sky by the simulator's own formula; NaN where temperature or vapour was not measured."""
    air = days[["air_temperature_c", "vapour_pressure_hpa"]].dropna()
    values = [emissivity(temperature, vapour, 0.0) for temperature, vapour in air.to_numpy()]
    return pd.Series(values, index=air.index).reindex(days.index)


def harmonic_anomaly(days: np.ndarray) -> np.ndarray:
    """Departure of daily temperatures, shape (years, 365), from their mean and first two harmonics of the year."""
    angle = 2.0 * math.pi * (np.arange(days.shape[1]) + 0.5) / days.shape[1]
    waves = np.stack([np.ones_like(angle), *(f(k * angle) for k in (1, 2) for f in (np.cos, np.sin))], axis=1)
    coefficients = np.linalg.lstsq(waves, np.nanmean(days, axis=0), rcond=None)[0]
    return days - waves @ coefficients
