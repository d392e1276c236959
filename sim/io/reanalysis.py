"""ERA5-Land by the hour: values at a time, and sums since midnight UTC, as means and sums of the hours between."""

import numpy as np
import pandas as pd

ACCUMULATED = ("shortwave", "longwave", "precipitation")
FALL = {"shortwave": 10.0, "longwave": 10.0, "precipitation": 1e-3}  # of a sum that only grows: more is no round-off
MOST_FALLS = 0.02  # share of a sum's steps: more are no errors, but sums of each hour


def since_midnight(times: pd.DatetimeIndex, sums: dict[str, np.ndarray], seconds: float) -> bool:
    """Whether sums are since midnight (ERA5-Land) or of each hour (ERA5): within a day the former do not fall.

    times : that each value is up to; sums : by quantity, of radiation as W m-2 over an interval of so many seconds.
    """
    first = _first_of_day(times, seconds)
    return all((np.diff(values)[~first[1:]] < -FALL[name]).mean() < MOST_FALLS for name, values in sums.items())


def of_intervals(times: pd.DatetimeIndex, values: np.ndarray, seconds: float) -> np.ndarray:
    """What each interval adds to sums since midnight, (intervals + 1,) to (intervals,)."""
    return np.where(_first_of_day(times, seconds)[1:], values[1:], np.diff(values))


def between(values: np.ndarray) -> np.ndarray:
    """Means of intervals from values at their ends."""
    return 0.5 * (values[1:] + values[:-1])


def _first_of_day(times: pd.DatetimeIndex, seconds: float) -> np.ndarray:
    """Whether the interval that ends at a time is the first of its day."""
    start = times - pd.Timedelta(seconds=seconds)
    return np.asarray(start == start.normalize())
