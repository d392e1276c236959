"""Gaps of a record: found, and filled where that is asked for."""

import numpy as np
import pandas as pd

SHORT_HOURS = 3.0
WINDOWS_DAYS = (7, 14)  # either side
FEWEST = 3  # values of a mean


def interpolated(values: pd.Series, interval: int) -> pd.Series:
    """Gaps of up to `SHORT_HOURS`, of a daily record of a day, on a straight line; longer ones stay."""
    gap = values.isna()
    length = gap.groupby((gap != gap.shift()).cumsum()).transform("sum")
    most = max(1, int(SHORT_HOURS * 60 // interval))
    line = values.interpolate(method="linear", limit_area="inside")
    return values.where(~gap | (length > most), line)


def mean_course(values: pd.Series, per_day: int) -> pd.Series:
    """Gaps as the mean of the same time of day, a week either side or else two (Falge et al. 2001, mean diurnal
    variation); what has fewer than `FEWEST` values there stays a gap. Whole days."""
    days = pd.DataFrame(values.to_numpy().reshape(-1, per_day))
    filled = days
    for window in WINDOWS_DAYS:
        mean = days.rolling(2 * window + 1, center=True, min_periods=FEWEST).mean()
        filled = filled.where(filled.notna(), mean)
    return pd.Series(filled.to_numpy().ravel(), index=values.index)


def longest(gap: np.ndarray) -> tuple[int, int]:
    """First place and length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], gap.astype(int), [0]])))
    if not len(edges):
        return 0, 0
    starts, lengths = edges[::2], edges[1::2] - edges[::2]
    k = int(np.argmax(lengths))
    return int(starts[k]), int(lengths[k])
