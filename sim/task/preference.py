"""A preference: the weights of m objectives, on the simplex; of two, one number says it, the first's weight."""

from numbers import Real

import numpy as np


def check_weights(value, m: int, what: str = "preference") -> np.ndarray:
    """Weights (m,) from a number in [0, 1] (the first's, for two objectives) or m numbers >= 0 that sum to 1.

    Raises ValueError naming the value and what is allowed.
    """
    one = isinstance(value, (Real, np.number)) and not isinstance(value, (bool, np.bool_))
    if m == 2 and one and 0.0 <= value <= 1.0:
        return np.array([abs(float(value)), 1.0 - float(value)])  # 0.0 for -0.0
    sequence = isinstance(value, (list, tuple, np.ndarray)) and np.shape(value) == (m,)
    if sequence and np.issubdtype(np.asarray(value).dtype, np.number):
        weights = np.asarray(value, dtype=float)
        if (weights >= 0.0).all() and abs(weights.sum() - 1.0) <= 1e-6:
            return weights + 0.0  # 0.0 for -0.0
    number = "a number in [0, 1]" if m == 2 else f"{m} numbers >= 0 that sum to 1"
    raise ValueError(f"{what}: {number} is allowed, got {value!r}")


def observed_weights(observations: np.ndarray, m: int) -> np.ndarray:
    """Weights (n, m), float64, of observations (n, d), whose first m - 1 entries they are."""
    first = np.asarray(observations[:, : m - 1], dtype=np.float64)
    return np.hstack([first, 1.0 - first.sum(axis=1, keepdims=True)])
