"""Exponential, the power 2/3 and interpolation in plain arithmetic.

libm's functions are calls that stop the compiler from treating eight stands at a time; plain arithmetic does not, and
it gives the same bits for one stand as for sixteen.
"""

import numpy as np

from sim.jit import compiled


@compiled
def exponential(x: float) -> float:
    """e to the x, to a relative error of 4e-16 for x in [-700, 700]; beyond, the value at the limit.

    Cody and Waite's argument reduction (x = n ln 2 + r, |r| <= ln 2 / 2) and the Taylor series of degree 12, in
    Estrin's order: terms that do not wait for each other.
    """
    x = min(max(x, -700.0), 700.0)
    n = np.floor(x * 1.4426950408889634 + 0.5)
    r = (x - n * 0.693147180369123816490) - n * 1.90821492927058770002e-10
    r2 = r * r
    r4 = r2 * r2
    first = (1.0 + r) + r2 * (0.5 + r * (1.0 / 6.0))
    second = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0))
    third = (1.0 / 40320.0 + r * (1.0 / 362880.0)) + r2 * (1.0 / 3628800.0 + r * (1.0 / 39916800.0))
    series = first + r4 * (second + r4 * (third + r4 * (1.0 / 479001600.0)))
    power_of_two = np.int64((np.int64(n) + 1023) << 52).view(np.float64)
    return series * power_of_two


@compiled
def two_thirds_power(x: float) -> float:
    """x to the power 2/3, to a relative error of 1e-15, for x >= 0: x times its inverse cube root, which takes no
    division: a third of the exponent for a start (Kahan), then twice the binomial series of (1 - e)^(-1/3).
    """
    bits = np.float64(np.float64(x).view(np.int64))
    inverse = np.int64(6142909891733356544.0 - bits * (1.0 / 3.0)).view(np.float64)
    for _ in range(2):
        e = 1.0 - x * inverse * inverse * inverse
        inverse += inverse * e * (1.0 / 3.0 + e * (2.0 / 9.0 + e * (14.0 / 81.0 + e * (35.0 / 243.0))))
    return x * inverse


@compiled
def between(low, high, share) -> float:
    """The value at a share of the way from `low` to `high`."""
    return low + (high - low) * share
