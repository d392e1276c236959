"""Times of a record: read, regular, and turned into local mean solar time, in which the simulator's sun is highest at
noon."""

import re

import numpy as np
import pandas as pd

from sim.io.columns import Choice
from sim.io.table import Table

DAY = 1440  # minutes
MOST_MINUTES = 120
_FORMATS = {8: "%Y%m%d", 12: "%Y%m%d%H%M", 14: "%Y%m%d%H%M%S"}
_DAY_END = re.compile(r"(^\d{8}|[ T])24(:?00(?::?00)?)$", re.MULTILINE)  # 24:00
_DAY_FIRST = re.compile(r"\d{1,2}[./-]\d{1,2}[./-]\d{2,4}\b")
_SERIAL = re.compile(r"[1-9]\d{4}(\.\d+)?$|1\d{9}(\.\d+)?$")  # days of a spreadsheet, seconds since 1970
_WITH_ZONE = re.compile(r"(:\d\d(?:\.\d+)?)\s?(?:Z|[+-]\d\d(?::?\d\d)?)$", re.MULTILINE)
_WHOLE = re.compile(r"\.0$", re.MULTILINE)  # a number read as one with decimals


def read_times(table: Table, texts: pd.Series, name: str, *, zone: bool = True) -> pd.DatetimeIndex:
    """The times of a column, one a row; without their time zone, as they are written, where `zone` is False. Raises
    ValueError naming the first row that has none."""
    if pd.api.types.is_datetime64_any_dtype(texts):
        times = pd.Series(texts) if zone else pd.Series(texts).dt.tz_localize(None)
    else:
        given = _replaced(texts.astype("string").str.strip(), _WHOLE, "")
        text = _replaced(given, _DAY_END, r"\g<1>00\g<2>")
        day_end = (text != given).fillna(False)
        known = text.dropna()
        first = known.iloc[0] if len(known) else ""
        written = _replaced(text, _WITH_ZONE, r"\g<1>")
        if first.isdigit():
            # of fewer digits pandas would take the hour's second digit for the minute
            length = len(first) if len(first) in _FORMATS else 0
            whole = text.where((text.str.len() == length).fillna(False))
            times = pd.to_datetime(whole, format=_FORMATS.get(length), errors="coerce")
        elif zone and _WITH_ZONE.search(first):
            times = pd.to_datetime(text, format="ISO8601", errors="coerce", utc=True)
        else:
            alike = text.where((text == written).fillna(False)) if zone else written
            times = pd.to_datetime(alike, format="ISO8601", errors="coerce")  # no guess of day and month
        times = times + pd.to_timedelta(day_end.astype(int), unit="D")
    wrong = times.isna().to_numpy()
    if wrong.any():
        row = int(np.argmax(wrong))
        value = texts.iloc[row]
        value = value.item() if isinstance(value, np.generic) else value
        hint = ""
        if row == 0 and not any(letter.isdigit() for letter in str(value)):
            hint = "; rows of units below the names have to be removed"
        elif _DAY_FIRST.match(str(value)):
            hint = "; of days or months first: read it by pandas, its times by pd.to_datetime(.., format=..)"
        elif _SERIAL.match(str(value)):
            of = "unit='s')" if re.match(r"\d{10}", str(value)) else "unit='D', origin='1899-12-30')"
            hint = f"; a count: read it by pandas, its times by pd.to_datetime(.., {of}.dt.round('min')"
        raise ValueError(
            f"{table.where(row)}: {name} is {value!r}; a time as 201906031230 or 2019-06-03 12:30 is allowed{hint}"
        )
    return pd.DatetimeIndex(times)


def _replaced(text: pd.Series, pattern: re.Pattern, by: str) -> pd.Series:
    """Texts with a pattern of a line replaced. Most columns have none, and to look at all of them at once is quick."""
    return text.str.replace(pattern, by, regex=True) if pattern.search("\n".join(text.dropna().to_numpy())) else text


def check_ends(table: Table, starts: pd.DatetimeIndex, ends: pd.DatetimeIndex) -> None:
    """Refuse an interval that ends before it begins: its columns may be each other's."""
    wrong = ends.tz_localize(None) <= starts
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ValueError(
            f"{table.where(row)}: TIMESTAMP_END {_text(ends[row])} is not after TIMESTAMP_START {_text(starts[row])}"
        )


def is_daily(times: pd.DatetimeIndex) -> bool:
    """Whether a row follows the other after a day, for the most part."""
    return bool(times.to_series().diff().median() == pd.Timedelta(minutes=DAY))


def interval_of(table: Table, times: pd.DatetimeIndex) -> int:
    """Minutes from a row to the next. Raises ValueError for times that are twice, out of order or off the grid, and for
    an interval that is neither a day nor at most two hours."""
    if len(times) < 2:
        raise ValueError(f"{table.name}: {len(times)} rows; whole days at a regular interval are allowed")
    minutes = np.diff(times.to_numpy()) / np.timedelta64(1, "m")
    back = np.flatnonzero(minutes <= 0.0)
    if len(back):
        row = int(back[0]) + 1
        first = int(np.argmax(times == times[row]))
        if first < row:
            autumn = times[row].month in (9, 10, 11) and minutes[row - 1] > -60.0
            hint = "; a clock of summer time has an hour twice: standard time all year is allowed" if autumn else ""
            if (times == times.normalize()).all():
                hint = "; if the time of day is in a column of its own, join the two"
            raise ValueError(
                f"{table.where(row)}: {_text(times[row])} is there twice, first in {table.where(first)}{hint}"
            )
        raise ValueError(
            f"{table.where(row)}: {_text(times[row])} follows {_text(times[row - 1])}; times have to increase"
        )
    steps, counts = np.unique(minutes, return_counts=True)
    interval = steps[np.argmax(counts)]
    if interval != DAY and (interval > MOST_MINUTES or DAY % interval or interval % 1):
        each = f"{interval / DAY:g} days" if interval >= DAY else f"{interval:g} minutes"
        raise ValueError(
            f"{table.name}: a row every {each}; a day, or a divisor of it of at most 120 minutes, is allowed"
        )
    off = np.flatnonzero(((times - times[0]) / pd.Timedelta(minutes=interval) % 1).to_numpy())
    if len(off):
        row = int(off[0])
        raise ValueError(f"{table.where(row)}: {_text(times[row])} is not on the record's grid of {interval:g} minutes")
    return int(interval)


def kind_of_times(table: Table, choice: Choice, interval: int, texts: pd.Series) -> str:
    """What the times are, once the interval is known: "start", "end", "middle", "instant" or "day"; of days only "end"
    or "day". texts : the times as they are written."""
    if interval == DAY:
        first = str(texts.iloc[0]).strip().removesuffix(".0")
        return "end" if choice.time_kind == "end" or _DAY_END.search(first) else "day"  # 24:00 is of the day it ends
    if choice.time_kind == "day":
        raise ValueError(
            f"{table.name}: whether {choice.time} is an interval's start or its end is not clear; "
            f"say columns={{'time_start': {choice.time!r}}} or {{'time_end': {choice.time!r}}}"
        )
    return choice.time_kind


def minutes_ahead(longitude_deg: float, utc_offset_h: float) -> float:
    """Minutes that local mean solar time is ahead of a clock that is so many hours ahead of UTC."""
    return 60.0 * (longitude_deg / 15.0 - utc_offset_h)


def noon_of(starts: pd.DatetimeIndex, interval: int, shortwave: np.ndarray) -> float | None:
    """Hour of the record's clock at which its sun is highest: the mean hour of the sunlight, on a circle. None where
    there is too little light, or no course of the day in it."""
    hour = (starts.hour * 60 + starts.minute + 0.5 * interval).to_numpy() / 60.0
    light = np.where(np.isnan(shortwave), 0.0, np.maximum(shortwave, 0.0))
    total = light.sum()
    if total <= 0.0:
        return None
    mean = (light * np.exp(2j * np.pi * hour / 24.0)).sum() / total
    return float(np.angle(mean) * 24.0 / (2.0 * np.pi) % 24.0) if abs(mean) > 0.2 else None


def hours_apart(one: float, other: float) -> float:
    """From the other hour to the one, by the shorter way round the clock, -12 to 12."""
    return (one - other + 12.0) % 24.0 - 12.0


def _text(time) -> str:
    return f"{time:%Y-%m-%d %H:%M}"
