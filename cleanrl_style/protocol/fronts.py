"""Fronts of a multi-objective policy: scalarised returns, hypervolume, sparsity, expected utility.

Every objective is maximised; a set of points is an array (n, 2) of [carbon, thaw].
"""

import moocore
import numpy as np
import pandas as pd

OBJECTIVES = ["carbon_return", "thaw_return"]
REFERENCE_POINT = (-2.0, -2.0)


def scalarize(carbon, thaw, preference):
    """Scalarised return w_C carbon + (1 - w_C) thaw [-]; scalars or arrays of one shape."""
    return preference * carbon + (1 - preference) * thaw


def mean_returns(evaluation: pd.DataFrame) -> pd.DataFrame:
    """Mean of both returns over the episodes of each weight; index: the weights in ascending order."""
    return evaluation.groupby("preference")[OBJECTIVES].mean().sort_index()


def nondominated(points: np.ndarray) -> np.ndarray:
    """The points that no other point dominates, (k, 2), without duplicates."""
    return moocore.filter_dominated(np.asarray(points, dtype=float), maximise=True)


def hypervolume(points: np.ndarray, reference: tuple[float, float] = REFERENCE_POINT) -> float:
    """Area dominated by the points above the reference point (points not above it in both add nothing)."""
    return float(moocore.hypervolume(np.asarray(points, dtype=float), ref=list(reference), maximise=True))


def sparsity(points: np.ndarray) -> float:
    """Mean squared gap between neighbours on the front, summed over objectives; 0 for fewer than two points.

    As in morl-baselines (Xu et al. 2020, eq. 8): each objective is sorted by itself, nothing is normalised.
    """
    front = nondominated(points)
    if len(front) < 2:
        return 0.0
    gaps = np.diff(np.sort(front, axis=0), axis=0)
    return float((gaps**2).sum() / (len(front) - 1))


def expected_utility(points: np.ndarray, n_weights: int = 50) -> float:
    """Mean over equally spaced weights of the best scalarised point (Zintgraf et al. 2015)."""
    weights = np.linspace(0, 1, n_weights)
    utilities = np.stack([weights, 1 - weights], axis=1) @ np.asarray(points, dtype=float).T
    return float(utilities.max(axis=1).mean())


def cardinality(points: np.ndarray) -> int:
    """Number of different points on the front."""
    return len(nondominated(points))
