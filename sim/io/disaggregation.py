"""Half-hourly weather from daily means, for a record that is daily.

Temperature is the day's mean and a cosine whose half-range is in proportion to the day's mean shortwave, shortwave
follows the sun's height, vapour pressure, longwave, wind and precipitation hold for the day. Daily means, and the
precipitation's sum, are those of the record. The simulator's own functions place the sun.
"""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sim.jit import uncompiled
from sim.parameters import SITE_PARAMETERS
from sim.state import DAYS, FORCING
from sim.weather import saturation_pressure_water, solar_declination

saturation_water = uncompiled(saturation_pressure_water)
declination = uncompiled(solar_declination)

#: What a daily record may have its humidity as; the first that is there is taken.
HUMIDITY = ("vapour_pressure_hpa", "vapour_pressure_deficit_hpa", "relative_humidity")
STEPS_PER_DAY = 48
HOURS = (np.arange(STEPS_PER_DAY) + 0.5) * 24.0 / STEPS_PER_DAY  # local solar time at the middle of each step


@dataclass(frozen=True)
class DiurnalCycle:
    """The solar cycle of air temperature: half-range per mean shortwave of the day [K (W m-2)-1], hour of its peak."""

    half_range_per_shortwave: float
    peak_hour: float


#: Of a boreal forest: the whole year 2019 at Svartberget (`diurnal_cycle` of its record), to three digits.
FOREST_CYCLE = DiurnalCycle(half_range_per_shortwave=0.0152, peak_hour=15.3)


def diurnal_cycle(air: pd.Series, shortwave: pd.Series) -> DiurnalCycle:
    """The cycle of a half-hourly record of whole days [degC, W m-2], indexed by local solar time.

    The first harmonic of every day is regressed on the day's mean shortwave, through the origin.
    """
    days = air.to_numpy().reshape(-1, STEPS_PER_DAY)
    sun = shortwave.to_numpy().reshape(-1, STEPS_PER_DAY).mean(axis=1)
    angle = 2.0 * math.pi * HOURS / 24.0
    anomaly = days - days.mean(axis=1, keepdims=True)
    cosine, sine = ((anomaly * wave).mean(axis=1) * 2.0 for wave in (np.cos(angle), np.sin(angle)))
    slopes = [float((part * sun).sum() / (sun**2).sum()) for part in (cosine, sine)]
    peak = math.atan2(slopes[1], slopes[0]) % (2.0 * math.pi)
    return DiurnalCycle(math.hypot(*slopes), 24.0 * peak / (2.0 * math.pi))


def half_hours(daily: pd.DataFrame, latitude_deg: float, cycle: DiurnalCycle = FOREST_CYCLE) -> pd.DataFrame:
    """Half-hourly forcing of the simulator (`sim.state.FORCING`) from daily means, indexed by solar time.

    daily : a row a day, indexed by date, with air_temperature_c, one of vapour_pressure_hpa,
    vapour_pressure_deficit_hpa (mean over the day) and relative_humidity (at the day's mean temperature), the first of
    them that is there, wind_speed_m_s, shortwave_w_m2, longwave_w_m2, precipitation_mm (sum). 29 February is dropped.

    Shortwave of a day whose sun does not rise is spread evenly, so that the mean stays. Relative humidity is over
    water and at most 1: vapour beyond that, on cold nights, is dew. Raises ValueError, naming column and day, for a
    gap, and for a deficit larger than the day's saturation pressure; and for what is no daily table of a place.
    `attrs["site"]` has what the days tell of the site, for `sim.simulate`.
    """
    columns = _check_daily(daily, latitude_deg)
    daily = daily[columns]
    daily = daily[~((daily.index.month == 2) & (daily.index.day == 29))]
    for name in daily:
        missing = daily.index[daily[name].isna()]
        if len(missing):
            raise ValueError(f"daily record: {name} is missing on {missing[0]:%Y-%m-%d} ({len(missing)} days in all)")
    mean = {name: daily[name].to_numpy()[:, None] for name in daily}
    even = np.ones((len(daily), STEPS_PER_DAY))

    swing = cycle.half_range_per_shortwave * mean["shortwave_w_m2"]
    air = mean["air_temperature_c"] + swing * np.cos(2.0 * math.pi * (HOURS - cycle.peak_hour) / 24.0)
    saturation = np.vectorize(saturation_water)(air)
    if "vapour_pressure_hpa" in mean:
        vapour = mean["vapour_pressure_hpa"]
    elif "relative_humidity" in mean:
        vapour = mean["relative_humidity"] * np.vectorize(saturation_water)(mean["air_temperature_c"])
    else:
        vapour = saturation.mean(axis=1, keepdims=True) - mean["vapour_pressure_deficit_hpa"]
        if (vapour <= 0.0).any():
            day = daily.index[(vapour <= 0.0).ravel()][0]
            deficit = daily.loc[day, "vapour_pressure_deficit_hpa"]
            raise ValueError(
                f"daily record: a vapour pressure deficit of {deficit:g} hPa on {day:%Y-%m-%d} is too large"
            )
    shape = sun_shape(daily.index, latitude_deg)
    values = {
        "air_temperature_c": air,
        "relative_humidity": np.minimum(vapour / saturation, 1.0),
        "wind_speed_m_s": mean["wind_speed_m_s"] * even,
        "shortwave_w_m2": mean["shortwave_w_m2"] * shape,
        "longwave_w_m2": mean["longwave_w_m2"] * even,
        "precipitation_mm": mean["precipitation_mm"] * even / STEPS_PER_DAY,
    }
    steps = pd.to_timedelta(np.arange(STEPS_PER_DAY) * 24.0 / STEPS_PER_DAY, unit="h")
    index = pd.DatetimeIndex(np.concatenate([day + steps for day in daily.index]), name="time")
    forcing = pd.DataFrame({name: one.ravel() for name, one in values.items()}, index=index)
    forcing.attrs["site"] = {"latitude_deg": float(latitude_deg), **climate_of(daily["air_temperature_c"])}
    return forcing


def climate_of(air_temperature_c: pd.Series) -> dict[str, float]:
    """Site parameters of a record [degC], indexed by time: its mean and first harmonic; none of less than a year."""
    days = air_temperature_c.groupby(air_temperature_c.index.normalize()).mean().dropna()  # it may lack 29 February
    if len(days) < DAYS:
        return {}
    angle = 2.0 * math.pi * (pd.DatetimeIndex(days.index).day_of_year.to_numpy() - 0.5) / 365.25
    wave = [2.0 * ((days - days.mean()).to_numpy() * shape(angle)).mean() for shape in (np.cos, np.sin)]
    return {"mean_annual_temperature_c": float(days.mean()), "seasonal_amplitude_c": float(math.hypot(*wave))}


def _check_daily(daily, latitude_deg) -> list[str]:
    """The columns of a daily table that are used; ValueError for what is none, or for a latitude that is none."""
    if not isinstance(daily, pd.DataFrame) or not isinstance(daily.index, pd.DatetimeIndex):
        raise ValueError("daily record: a DataFrame with a DatetimeIndex is allowed")
    latitude = SITE_PARAMETERS["latitude_deg"]
    low, high, number = latitude.physical_low, latitude.physical_high, (int, float, np.number)
    if isinstance(latitude_deg, bool) or not isinstance(latitude_deg, number) or not low <= latitude_deg <= high:
        raise ValueError(f"latitude_deg = {latitude_deg!r}: a number in [{low:g}, {high:g}] is allowed")
    index = daily.index
    wrong = index.isna() | (index != index.normalize())
    wrong[1:] |= index[1:] <= index[:-1]
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ValueError(
            f"daily record: zero-based row {row} is of {index[row]}; one row a day, at 00:00 and in order, is allowed"
        )
    humidity = [name for name in HUMIDITY if name in daily][:1]
    columns = [name for name in FORCING if name != "relative_humidity"] + (humidity or [HUMIDITY[-1]])
    for name in columns:
        if name not in daily:
            either = f"; of the last, {' or '.join(HUMIDITY[:-1])} does too" if name in HUMIDITY else ""
            raise ValueError(f"daily record: column {name} is missing; needed: {', '.join(columns)}{either}")
        if list(daily.columns).count(name) > 1:
            raise ValueError(f"daily record: column {name} is there twice")
        if daily[name].dtype.kind not in "iuf":
            raise ValueError(f"daily record: {name} has type {daily[name].dtype}; numbers are allowed")
    if "relative_humidity" in columns and not (beyond := daily["relative_humidity"]).dropna().between(0.0, 1.1).all():
        day = daily.index[(beyond < 0.0) | (beyond > 1.1)][0]
        raise ValueError(
            f"daily record: relative_humidity is {beyond[day]:g} on {day:%Y-%m-%d}; [0, 1.1] is allowed (is it in "
            "percent?)"
        )
    return columns


def sun_shape(days: pd.DatetimeIndex, latitude_deg: float) -> np.ndarray:
    """Shortwave of each half-hour relative to the day's mean, (days, 48): the sine of the sun's height."""
    latitude = math.radians(latitude_deg)
    tilt = np.array([declination(day - 1) for day in days.day_of_year])[:, None]
    angle = 2.0 * math.pi * (HOURS - 12.0) / 24.0
    height = np.maximum(math.sin(latitude) * np.sin(tilt) + math.cos(latitude) * np.cos(tilt) * np.cos(angle), 0.0)
    mean = height.mean(axis=1, keepdims=True)
    return np.where(mean > 0.0, height / np.where(mean > 0.0, mean, 1.0), 1.0)
