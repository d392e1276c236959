"""Weights, returns and fronts, for any number of objectives m: what a run's tables call them, and what they are worth.

Objectives are maximised. Weights lie on the simplex: m numbers that sum to 1. Of two objectives, tables and flags name
one weight, the first objective's, as `preference`; of more, one an objective.
"""

import itertools
from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

REFERENCE_POINT = -2.0  # of every objective, in hypervolumes
UTILITY_WEIGHTS = 50  # of two objectives, in expected utilities; of more, the lattice with no fewer

# ------------------------------------------------------------------------------------- names of a table's columns


def weight_columns(objectives: Sequence[str]) -> list[str]:
    """Columns of the weights: `preference` of two objectives, else weight_<objective> of each."""
    return ["preference"] if len(objectives) == 2 else [f"weight_{name}" for name in objectives]


def return_columns(objectives: Sequence[str]) -> list[str]:
    """Columns of the returns, in order."""
    return [f"{name}_return" for name in objectives]


def objectives_of(columns: Iterable[str]) -> list[str]:
    """Objectives of a table of episodes, from its columns: those of returns, before `scalarized_return`."""
    own = itertools.takewhile(lambda name: name != "scalarized_return", columns)
    return [name.removesuffix("_return") for name in own if name.endswith("_return")]


def weights_of(table: pd.DataFrame) -> np.ndarray:
    """Weights of a table of episodes, (n, m)."""
    weights = table[weight_columns(objectives_of(table.columns))].to_numpy(dtype=float)
    return np.hstack([weights, 1 - weights]) if weights.shape[1] == 1 else weights


def returns_of(table: pd.DataFrame) -> np.ndarray:
    """Returns of a table of episodes, (n, m)."""
    return table[return_columns(objectives_of(table.columns))].to_numpy(dtype=float)


# ------------------------------------------------------------------------------------------------------- weights


def scalarize(returns, weights):
    """Scalarised returns (...), the dot product of returns (..., m) and weights (..., m); arrays or tensors."""
    return (weights * returns).sum(-1)


def simplex_lattice(number: int, divisions: int) -> np.ndarray:
    """All weights of `number` objectives that are multiples of 1 / divisions; the first objective's ascends."""
    steps = [c for c in itertools.product(range(divisions + 1), repeat=number) if sum(c) == divisions]
    return np.array(steps) / divisions


def evaluation_weights(number: int) -> tuple:
    """Weights of an evaluation: 5 for two objectives, as their first; 15 for three, 20 for four, each as a tuple."""
    if number == 2:
        return (0.0, 0.25, 0.5, 0.75, 1.0)
    return tuple(map(tuple, simplex_lattice(number, {3: 4, 4: 3}.get(number, 2)).tolist()))


# -------------------------------------------------------------------------------------------------------- fronts


def is_nondominated(points: np.ndarray) -> np.ndarray:
    """Whether no other point dominates each of the points (n, m), bool (n,); of equal ones the first alone."""
    import moocore

    return moocore.is_nondominated(np.asarray(points, dtype=float), maximise=True)


def nondominated(points: np.ndarray) -> np.ndarray:
    """The points that no other point dominates, (k, m), without duplicates."""
    return np.asarray(points, dtype=float)[is_nondominated(points)]


def hypervolume(points: np.ndarray, reference: float | Sequence[float] = REFERENCE_POINT) -> float:
    """Volume that points (n, m) dominate above the reference point (one not above it in every objective adds none)."""
    import moocore

    points = np.asarray(points, dtype=float)
    return float(moocore.hypervolume(points, ref=np.broadcast_to(reference, points.shape[1]).tolist(), maximise=True))


def sparsity(points: np.ndarray) -> float:
    """Mean squared gap between neighbours on the front, summed over objectives; 0 for fewer than two points.

    As in morl-baselines (Xu et al. 2020, eq. 8): each objective is sorted by itself, nothing is normalised.
    """
    front = nondominated(points)
    if len(front) < 2:
        return 0.0
    gaps = np.diff(np.sort(front, axis=0), axis=0)
    return float((gaps**2).sum() / (len(front) - 1))


def expected_utility(points: np.ndarray, n_weights: int = UTILITY_WEIGHTS) -> float:
    """Mean over evenly spread weights of the best scalarised point (Zintgraf et al. 2015).

    n_weights : of two objectives; of more, the coarsest lattice with at least as many.
    """
    points = np.asarray(points, dtype=float)
    if points.shape[1] == 2:
        first = np.linspace(0, 1, n_weights)
        weights = np.stack([first, 1 - first], axis=1)
    else:
        lattices = (simplex_lattice(points.shape[1], divisions) for divisions in itertools.count(1))
        weights = next(lattice for lattice in lattices if len(lattice) >= n_weights)
    return float((weights @ points.T).max(axis=1).mean())


def cardinality(points: np.ndarray) -> int:
    """Number of different points on the front."""
    return len(nondominated(points))
