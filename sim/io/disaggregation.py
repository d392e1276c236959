"""Half-hourly weather from daily means, for a record that is daily.

Temperature is the day's mean and a cosine whose half-range is in proportion to the day's mean shortwave, shortwave
follows the sun's height, vapour pressure, longwave, wind and precipitation hold for the day. Daily means, and the
precipitation's sum, are those of the record. The simulator's own functions place the sun.
"""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sim.io.columns import LIMITS
from sim.jit import uncompiled
from sim.parameters import SITE_PARAMETERS
from sim.state import DAYS, FORCING
from sim.weather import saturation_pressure_water, solar_declination

saturation_water = uncompiled(saturation_pressure_water)
declination = uncompiled(solar_declination)

#: What a daily record may have its humidity as; the first that is there is taken.
HUMIDITY = ("vapour_pressure_hpa", "vapour_pressure_deficit_hpa", "relative_humidity")
STEPS_PER_DAY = 48
MOST_HALF_RANGE = 0.1  # K per W m-2 of the day's mean light: 30 K on a clear day
NUMBER = (int, float, np.number)
#: Column -> kind of `LIMITS`, between which its values lie; light and rain from 0 on, as the simulator takes them.
KINDS = {
    "air_temperature_c": "air_temperature",
    "vapour_pressure_deficit_hpa": "deficit",
    "relative_humidity": "relative_humidity",
    "wind_speed_m_s": "wind_speed",
    "shortwave_w_m2": "shortwave",
    "longwave_w_m2": "longwave",
    "precipitation_mm": "precipitation",
}
FROM_ZERO = ("shortwave_w_m2", "precipitation_mm")
#: Most vapour pressure of a day, relative to saturation at its mean temperature: humidity of 1.1 (`LIMITS`) throughout
#: a day of -30 degC that is 15 K warmer at noon and colder at night. The records here have at most 1.09.
MOST_VAPOUR = 1.6
HOURS = (np.arange(STEPS_PER_DAY) + 0.5) * 24.0 / STEPS_PER_DAY  # local solar time at the middle of each step


@dataclass(frozen=True)
class DiurnalCycle:
    """The solar cycle of air temperature: half-range per mean shortwave of the day [K (W m-2)-1], hour of its peak.

    Raises ValueError for a half-range outside [0, 0.1), an hour outside [0, 24), and what is no number.
    """

    half_range_per_shortwave: float
    peak_hour: float

    def __post_init__(self):
        for name, high in (("half_range_per_shortwave", MOST_HALF_RANGE), ("peak_hour", 24.0)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, NUMBER) or not 0.0 <= value < high:
                raise ValueError(f"{name} = {value!r}: a number in [0, {high:g}) is allowed")


#: Of a boreal forest: the whole year 2019 at Svartberget (`diurnal_cycle` of its record), to three digits.
FOREST_CYCLE = DiurnalCycle(half_range_per_shortwave=0.0152, peak_hour=15.3)


def diurnal_cycle(air: pd.Series, shortwave: pd.Series) -> DiurnalCycle:
    """The cycle of a half-hourly record of whole days [degC, W m-2], indexed by local solar time.

    The first harmonic of every day is regressed on the day's mean shortwave, through the origin. Raises ValueError,
    naming the argument, for what is no such record, a gap, a value beyond its limits, and days without light.
    """
    _check_half_hours(air, shortwave)
    days = air.to_numpy().reshape(-1, STEPS_PER_DAY)
    sun = shortwave.to_numpy().reshape(-1, STEPS_PER_DAY).mean(axis=1)
    angle = 2.0 * math.pi * HOURS / 24.0
    anomaly = days - days.mean(axis=1, keepdims=True)
    cosine, sine = ((anomaly * wave).mean(axis=1) * 2.0 for wave in (np.cos(angle), np.sin(angle)))
    slopes = [float((part * sun).sum() / (sun**2).sum()) for part in (cosine, sine)]
    peak = math.atan2(slopes[1], slopes[0]) % (2.0 * math.pi)
    return DiurnalCycle(math.hypot(*slopes), 24.0 * peak / (2.0 * math.pi) % 24.0)


def half_hours(daily: pd.DataFrame, latitude_deg: float, diurnal_cycle: DiurnalCycle = FOREST_CYCLE) -> pd.DataFrame:
    """Half-hourly forcing of the simulator (`sim.state.FORCING`) from daily means, indexed by solar time.

    daily : a row a day, indexed by date, with air_temperature_c, one of vapour_pressure_hpa,
    vapour_pressure_deficit_hpa (mean over the day) and relative_humidity (at the day's mean temperature), the first of
    them that is there, wind_speed_m_s, shortwave_w_m2, longwave_w_m2, precipitation_mm (sum). 29 February is dropped.

    Shortwave of a day whose sun does not rise is spread evenly, so that the mean stays. Relative humidity is over
    water and at most 1: vapour beyond that, on cold nights, is dew. Raises ValueError, naming column and day, for a
    gap, a value beyond its limits, vapour far above the day's saturation pressure, and a deficit larger than it; and
    for what is no daily table of a place. `attrs["site"]` has what the days tell of the site, for `sim.simulate`.
    """
    if not isinstance(diurnal_cycle, DiurnalCycle):
        raise ValueError(f"diurnal_cycle: a sim.DiurnalCycle is allowed, got {diurnal_cycle!r}")
    columns = _check_daily(daily, latitude_deg)
    daily = daily.loc[~leap_day(daily.index), columns]
    for name in daily:
        _check_values(f"daily record: {name}", daily[name], name, "on {:%Y-%m-%d}")
    mean = {name: daily[name].to_numpy()[:, None] for name in daily}
    even = np.ones((len(daily), STEPS_PER_DAY))

    swing = diurnal_cycle.half_range_per_shortwave * mean["shortwave_w_m2"]
    air = mean["air_temperature_c"] + swing * np.cos(2.0 * math.pi * (HOURS - diurnal_cycle.peak_hour) / 24.0)
    saturation = np.vectorize(saturation_water)(air)
    if "vapour_pressure_hpa" in mean:
        vapour = mean["vapour_pressure_hpa"]
        _check_vapour(daily["vapour_pressure_hpa"], daily["air_temperature_c"])
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
    forcing = pd.DataFrame({name: one.ravel() for name, one in values.items()}, index=_times_of(daily.index))
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
    low, high = latitude.physical_low, latitude.physical_high
    if isinstance(latitude_deg, bool) or not isinstance(latitude_deg, NUMBER) or not low <= latitude_deg <= high:
        raise ValueError(f"latitude_deg = {latitude_deg!r}: a number in [{low:g}, {high:g}] is allowed")
    index = daily.index
    if leap_day(index).all():
        raise ValueError("daily record: 0 rows, 29 February apart; one row a day is allowed")
    if index.tz is not None:
        raise ValueError(f"daily record: its dates have the time zone {index.tz}; dates without one are allowed")
    wrong = index.isna() | (index != index.normalize())
    wrong[1:] |= index[1:] <= index[:-1]
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ValueError(
            f"daily record: zero-based row {row} is of {index[row]}; one row a day, at 00:00 and in order, is allowed"
        )
    gone = pd.date_range(index[0], index[-1]).difference(index)
    gone = gone[~leap_day(gone)]  # which is dropped anyway
    if len(gone):
        raise ValueError(f"daily record: no row for {gone[0]:%Y-%m-%d} ({len(gone)} days in all)")
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
    return columns


def _check_half_hours(air, shortwave) -> None:
    for name, values in (("air", air), ("shortwave", shortwave)):
        if not isinstance(values, pd.Series) or not isinstance(values.index, pd.DatetimeIndex):
            raise ValueError(f"{name}: a Series with a DatetimeIndex is allowed")
        if values.dtype.kind not in "iuf":
            raise ValueError(f"{name} has type {values.dtype}; numbers are allowed")
        index = values.index
        if index.tz is not None:
            raise ValueError(f"{name}: its times have the time zone {index.tz}; solar time without one is allowed")
        days = index[::STEPS_PER_DAY].normalize()
        if not len(index) or len(index) % STEPS_PER_DAY or (index != _times_of(days)).any():
            since = f" from {index[0]} on" if len(index) else ""
            raise ValueError(f"{name}: {len(index)} rows{since}; half-hours of whole days, from 00:00 on, are allowed")
    if len(air) != len(shortwave) or (air.index != shortwave.index).any():
        raise ValueError(f"shortwave: {len(shortwave)} rows; the {len(air)} times of air are allowed")
    _check_values("air", air, "air_temperature_c", "at {:%Y-%m-%d %H:%M}")
    _check_values("shortwave", shortwave, "shortwave_w_m2", "at {:%Y-%m-%d %H:%M}")
    if not shortwave.any():
        raise ValueError(f"shortwave: it is 0 in all of {len(shortwave)} rows; days with light are allowed")


def _check_values(what: str, values: pd.Series, name: str, when: str) -> None:
    """Refuse a gap, and a value beyond the limits of a column. what, when : the values and a time, as an error names
    them."""
    missing = values.index[values.isna()]
    if len(missing):
        raise ValueError(f"{what} is missing {when.format(missing[0])} ({len(missing)} of {len(values)} in all)")
    if name not in KINDS:
        return
    unit, low, high = LIMITS[KINDS[name]]
    low = max(low, 0.0) if name in FROM_ZERO else low
    beyond = ~values.between(low, high)
    if beyond.any():
        value, at = values[beyond].iloc[0], when.format(values.index[beyond][0])
        unit, hint = ("", " (is it in percent?)") if unit == "1" else (f" {unit}", "")
        raise ValueError(f"{what} is {value:g} {at}; [{low:g}, {high:g}]{unit} is allowed{hint}")


def _check_vapour(vapour: pd.Series, air: pd.Series) -> None:
    most = MOST_VAPOUR * air.map(saturation_water)
    beyond = ~((vapour > 0.0) & (vapour <= most))
    if beyond.any():
        day = vapour.index[beyond][0]
        raise ValueError(
            f"daily record: vapour_pressure_hpa is {vapour[day]:g} on {day:%Y-%m-%d}; (0, {most[day]:.3g}] hPa is "
            f"allowed at {air[day]:g} degC"
        )


def leap_day(times: pd.DatetimeIndex) -> np.ndarray:
    """Whether a time is of 29 February."""
    return np.asarray((times.month == 2) & (times.day == 29))


def _times_of(days: pd.DatetimeIndex) -> pd.DatetimeIndex:
    """The half-hours of days."""
    steps = pd.to_timedelta(np.arange(STEPS_PER_DAY) * 24.0 / STEPS_PER_DAY, unit="h")
    return pd.DatetimeIndex(np.concatenate([day + steps for day in days]), name="time")


def sun_height(days: pd.DatetimeIndex, latitude_deg: float) -> np.ndarray:
    """Sine of the sun's height in each half-hour, 0 below the horizon, (days, 48)."""
    latitude = math.radians(latitude_deg)
    tilt = np.array([declination(day - 1) for day in days.day_of_year])[:, None]
    angle = 2.0 * math.pi * (HOURS - 12.0) / 24.0
    return np.maximum(math.sin(latitude) * np.sin(tilt) + math.cos(latitude) * np.cos(tilt) * np.cos(angle), 0.0)


def sun_shape(days: pd.DatetimeIndex, latitude_deg: float) -> np.ndarray:
    """Shortwave of each half-hour relative to the day's mean, (days, 48): the sine of the sun's height."""
    height = sun_height(days, latitude_deg)
    mean = height.mean(axis=1, keepdims=True)
    return np.where(mean > 0.0, height / np.where(mean > 0.0, mean, 1.0), 1.0)
