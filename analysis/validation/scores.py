"""How well two series agree, and whether a value lies in an observed band."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

IN = "in"


@dataclass(frozen=True)
class Band:
    """Range of a quantity in the literature, both ends included. Raises ValueError if reversed."""

    low: float
    high: float

    def __post_init__(self):
        if not self.low <= self.high:
            raise ValueError(f"band reversed: {self.low:g} > {self.high:g}")

    def verdict(self, value: float) -> str:
        """ "in", or "MISS, low" or "MISS, high". Raises ValueError for NaN, which no band can judge."""
        if math.isnan(value):
            raise ValueError("a band judges numbers, got NaN")
        if value < self.low:
            return "MISS, low"
        return "MISS, high" if value > self.high else IN

    def digits(self, value: float, fewest: int) -> int:
        """Digits, at least `fewest`, with which value and band have to be printed for the verdict to be seen."""
        for digits in itertools.count(fewest):
            printed = Band(round(self.low, digits), round(self.high, digits))
            if printed.verdict(round(value, digits)) == self.verdict(value):
                return digits

    def share_within(self, values: np.ndarray) -> float:
        """Share of values in the band."""
        values = np.asarray(values)
        return float(np.mean((values >= self.low) & (values <= self.high)))


@dataclass(frozen=True)
class Skill:
    """Agreement of pairs: bias (modelled less measured), RMSE, Pearson correlation, number of pairs."""

    bias: float
    rmse: float
    r: float
    pairs: int


def skill(modelled, measured) -> Skill:
    """Agreement of two series of equal length over the pairs without NaN. All NaN if there is none."""
    modelled, measured = np.asarray(modelled, float), np.asarray(measured, float)
    complete = np.isfinite(modelled) & np.isfinite(measured)
    if not complete.any():
        return Skill(math.nan, math.nan, math.nan, 0)
    error = modelled[complete] - measured[complete]
    correlation = pd.Series(modelled[complete]).corr(pd.Series(measured[complete]))
    return Skill(float(error.mean()), float(np.sqrt((error**2).mean())), float(correlation), int(complete.sum()))


def poisson_interval(events: int) -> tuple[float, float]:
    """Exact 95 % interval of the expected number of events (Garwood 1936)."""
    low = stats.chi2.ppf(0.025, 2 * events) / 2.0 if events else 0.0
    return float(low), float(stats.chi2.ppf(0.975, 2 * events + 2) / 2.0)
