"""What a forcing has to be before the simulator takes it."""

import numpy as np
import pandas as pd

from sim.io.clock import DAY, hours_apart, noon_of
from sim.io.columns import MM_A_YEAR
from sim.io.plausible import DAYS_OF_A_YEAR, LEAST_HUMIDITY
from sim.state import DAYS, FORCING

#: Allowed values of an observed forcing: column -> (low, high, unit, hint).
FORCING_LIMITS = {
    "air_temperature_c": (-75.0, 50.0, "degC", "is it in kelvin?"),
    "relative_humidity": (0.0, 1.1, "share of 1", "is it in percent?"),
    "wind_speed_m_s": (0.0, 60.0, "m s-1", ""),
    "shortwave_w_m2": (0.0, 1500.0, "W m-2", "negative night offsets have to be set to 0"),
    "longwave_w_m2": (50.0, 600.0, "W m-2", ""),
    "precipitation_mm": (0.0, 200.0, "mm per interval", ""),
}
FAR_FROM_NOON_H = 3.0
CLEAR_DAY_W_M2 = 50.0  # at least, on the ground on the brightest days of a year


def interval_of(forcing) -> int:
    """Minutes from row to row. Raises ValueError for what has no regular local solar times, and for daily weather."""
    if not isinstance(forcing, pd.DataFrame) or not isinstance(forcing.index, pd.DatetimeIndex):
        raise ValueError(
            "forcing: a DataFrame with a DatetimeIndex is allowed, which sim.read_forcing makes of a file or a table"
        )
    index = forcing.index
    if index.tz is not None:
        raise ValueError(
            f"forcing: its times have the time zone {index.tz}; local solar time without one is allowed, which "
            "sim.read_forcing makes of it"
        )
    if len(index) < 2:
        raise ValueError(f"forcing: {len(index)} rows; whole days at a regular interval are allowed")
    if index.hasnans:
        raise ValueError(f"forcing: the time of zero-based row {int(np.argmax(index.isna()))} is missing")
    if not (index.is_monotonic_increasing and index.is_unique):
        row = int(np.argmax(index[1:] <= index[:-1])) + 1
        which = f"{index[row]} of zero-based row {row} follows {index[row - 1]}"
        raise ValueError(f"forcing: its times are not sorted, or twice: {which}")
    minutes = (index[1] - index[0]) / pd.Timedelta(minutes=1)
    if minutes == DAY:
        raise ValueError(
            "forcing: it is daily; sim.half_hours(forcing, latitude_deg) makes half-hours of it, and sim.read_forcing "
            "of a daily record"
        )
    if minutes % 1:
        raise ValueError(f"forcing: it comes every {minutes:g} minutes; whole minutes are allowed")
    return int(minutes)


def check_forcing(forcing: pd.DataFrame, time_step_minutes: int, years: int) -> tuple[list[np.ndarray], int]:
    """Observed weather as one array (days x steps a day, 6) a year, and the days a year.

    Raises ValueError that names the column, the time and what is allowed.
    """
    minutes = interval_of(forcing)
    missing = [name for name in FORCING if name not in forcing]
    if missing:
        raise ValueError(
            f"forcing: column {missing[0]} is missing; needed: {', '.join(FORCING)}; sim.read_forcing makes them of a "
            "tower's file"
        )
    twice = [name for name in FORCING if list(forcing.columns).count(name) > 1]
    if twice:
        raise ValueError(f"forcing: column {twice[0]} is there twice")
    index = forcing.index
    if (index[0].month, index[0].day, index[0].hour, index[0].minute) != (1, 1, 0, 0):
        raise ValueError(f"forcing starts at {index[0]}; it has to start at 00:00 of 1 January")
    interval = index[1] - index[0]
    late = index[1:][np.diff(index.to_numpy()) != interval.to_timedelta64()]
    for time in late:
        leap_day_dropped = (time.month, time.day, time.hour, time.minute) == (3, 1, 0, 0) and time.is_leap_year
        if not leap_day_dropped or time - interval - pd.Timedelta(days=1) not in index:
            raise ValueError(f"forcing: times are not regular at {time}; fill the gap or drop the year")
    if time_step_minutes % minutes:
        raise ValueError(
            f"time_step_minutes = {time_step_minutes}: the forcing comes every {minutes:g} minutes; "
            "the same or a multiple is allowed"
        )
    kept = forcing.loc[~((index.month == 2) & (index.day == 29)), list(FORCING)]
    for name, (low, high, unit, hint) in FORCING_LIMITS.items():
        if kept[name].dtype.kind not in "iuf":
            raise ValueError(f"forcing: {name} has type {kept[name].dtype}; numbers are allowed")
        values = kept[name].to_numpy(float)
        wrong = ~((values >= low) & (values <= high))
        if wrong.any():
            at = kept.index[wrong][0]
            value = values[wrong][0]
            what = "a gap" if np.isnan(value) else f"{value:g}"
            why = f" ({hint})" if hint and not np.isnan(value) else ""
            raise ValueError(f"forcing: {name} is {what} at {at}; [{low:g}, {high:g}] {unit} is allowed{why}")
    per_day = DAY / minutes
    days = len(kept) / per_day
    if days % 1 or (days > DAYS and days % DAYS) or (days < DAYS and years > 1):
        raise ValueError(f"forcing of {days:g} days: whole years of 365 days, or whole days with years=1, are allowed")
    _check_noon(kept, minutes)
    taken = forcing.attrs.get("unusual")  # the caller of read_forcing has said that it is right
    for _, year in kept.groupby(kept.index.year):
        if not taken and len(year) >= DAYS_OF_A_YEAR * per_day:
            _check_units(year, minutes)
    group = int(time_step_minutes // minutes)
    values = kept.to_numpy(float).reshape(-1, group, len(FORCING))
    steps = values.mean(axis=1)
    steps[:, FORCING.index("precipitation_mm")] *= group
    days = int(min(days, DAYS))
    by_year = steps.reshape(-1, days * DAY // time_step_minutes, len(FORCING))
    return [np.ascontiguousarray(year) for year in by_year], days


def _check_units(year: pd.DataFrame, minutes: int) -> None:
    """Refuse a year within the limits that must be of another unit, as `unusual_lines` does of a place."""
    when = f"in {year.index[0].year}"
    days = year["shortwave_w_m2"].groupby(year.index.normalize()).mean()
    brightest = float(days.quantile(0.98))
    if brightest < CLEAR_DAY_W_M2:
        raise ValueError(
            f"forcing: shortwave_w_m2 is {brightest:.3g} W m-2 on a clear summer day {when}; at least "
            f"{CLEAR_DAY_W_M2:g} is allowed (is it in MJ m-2?)"
        )
    humidity = float(year["relative_humidity"].median())
    if humidity < LEAST_HUMIDITY:
        raise ValueError(
            f"forcing: relative_humidity is {humidity:.2g} in half of all intervals {when}; more than "
            f"{LEAST_HUMIDITY:g} is allowed"
        )
    yearly, (least, most) = float(year["precipitation_mm"].mean() * DAY / minutes * DAYS), MM_A_YEAR
    if not least <= yearly <= most:
        raise ValueError(
            f"forcing: precipitation_mm is {yearly:.3g} mm a year {when}; [{least:g}, {most:g}] is allowed (each row "
            f"has the mm of its {minutes} minutes)"
        )


def _check_noon(forcing: pd.DataFrame, minutes: int) -> None:
    noon = noon_of(forcing.index, minutes, forcing["shortwave_w_m2"].to_numpy(float))
    if noon is not None and abs(hours_apart(noon, 12.0)) > FAR_FROM_NOON_H:
        clock = f"{int(noon):02d}:{int(noon % 1 * 60):02d}"
        raise ValueError(
            f"forcing: its sun is highest at {clock}; times of local solar time, highest at 12:00, are allowed, which "
            "sim.read_forcing makes of a record"
        )
