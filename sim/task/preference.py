"""The preference: a weight for each of the m objectives, none negative, that sum to 1.

Two objectives need one number, the weight of the first, and outside of this package that is what they have: in
options, in the observation and in the last step's info.
"""

from collections.abc import Iterator
from numbers import Real

import numpy as np
import pandas as pd

ROUND_OFF = 1e-6  # by which given weights may miss the sum of 1


def check_weights(value, objectives: int, what: str = "preference") -> np.ndarray:
    """Weights (objectives,) from what a user gives: that many numbers, or for two objectives the first alone.

    Weights are kept as given. Raises ValueError that names `what`, the value and what is allowed.
    """
    _refuse_labels(value, what)
    value = value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if objectives == 2 and not _is_sequence(value):
        if not _is_number(value) or not 0.0 <= value <= 1.0:
            raise ValueError(f"{what}: a number in [0, 1] is allowed, got {value!r}")
        first = abs(float(value))  # 0.0 for -0.0
        return np.array([first, 1.0 - first])
    weights = list(value) if _is_sequence(value) else []
    right = len(weights) == objectives and all(_is_number(weight) and weight >= 0.0 for weight in weights)
    if not right or abs(sum(weights) - 1.0) > ROUND_OFF:
        raise ValueError(
            f"{what}: a weight for each of {objectives} objectives, none negative, 1 in sum, is allowed, got {value!r}"
        )
    return np.abs(np.array(weights, dtype=float))


def spread_weights(value, number: int, objectives: int) -> list:
    """Weights for each of `number` episodes, or None for each, from one preference for all or a sequence of them.

    Of two objectives a flat sequence has a number for each episode; of others it is the weights of all.
    """
    if value is None:
        return [None] * number
    _refuse_labels(value, "preference")
    value = value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value
    several = _is_sequence(value)
    for_all = not several or (objectives != 2 and all(_is_number(weight) for weight in value))
    if for_all:
        return [check_weights(value, objectives)] * number
    if len(value) != number:
        raise ValueError(f"preference: one value or {number} are allowed, got {len(value)}")
    return [None if one is None else check_weights(one, objectives) for one in value]


def draw_weights(generator: np.random.Generator, objectives: int) -> np.ndarray:
    """Weights (objectives,), uniform on the simplex: the gaps that objectives - 1 uniform draws leave in [0, 1]."""
    if not isinstance(generator, np.random.Generator):
        raise ValueError(f"generator: numpy.random.default_rng(seed) is allowed, got {generator!r}")
    _check_number(objectives)
    cuts = np.sort(generator.random(objectives - 1))
    return np.diff(cuts, prepend=0.0, append=1.0)


def observed_weights(observations: np.ndarray, objectives: int) -> np.ndarray:
    """Weights (n, objectives), float64, of whole observations (n, entries), which have all but the last at their front.

    Raises ValueError for another shape.
    """
    _check_number(objectives)
    observations = np.asarray(observations)
    if observations.ndim != 2 or observations.shape[1] < objectives - 1:
        raise ValueError(
            f"observations: shape (n, {objectives - 1} or more) is allowed, got {observations.shape}; "
            "observation[None] makes one of one"
        )
    first = observations[:, : objectives - 1].astype(float)
    return np.column_stack([first, 1.0 - first.sum(axis=1)])


def shown(weights: np.ndarray):
    """Weights as users meet them: of two objectives the weight of the first, a float; else a copy of all."""
    return float(weights[0]) if len(weights) == 2 else weights.copy()


def _check_number(objectives) -> None:
    if isinstance(objectives, bool) or not isinstance(objectives, (int, np.integer)) or objectives < 1:
        raise ValueError(f"objectives: a positive integer is allowed, got {objectives!r}")


def _is_number(value) -> bool:
    return isinstance(value, Real) and not isinstance(value, (bool, np.bool_, np.timedelta64))


def _refuse_labels(value, what: str) -> None:
    """Refuse a Series whose labels say another order than its numbers have, for all that we know."""
    if isinstance(value, pd.Series) and value.index.tolist() != list(range(len(value))):
        raise ValueError(
            f"{what}: a Series labelled {value.index.tolist()}, which are not read; its .tolist() is allowed"
        )


def _is_sequence(value) -> bool:
    return np.iterable(value) and not isinstance(value, (str, dict, set, Iterator))
