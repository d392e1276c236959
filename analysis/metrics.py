"""Metrics of multi-objective policies, for any number of objectives m, and statistics over training seeds.

An *evaluation* is the DataFrame of a run's `evaluation.csv`, restricted to one policy (greedy or sampled):
one row per episode, with the columns of the weights (see `fronts.weight_columns`; of two objectives `preference`, the
first's), `seed` (of the episode: the same seed is the same site and weather under every weight and method), and
`<objective>_return` of each objective. All are maximised; a set of points is an array (n, m).
"""

import bisect
import copy
import functools

import numpy as np
import pandas as pd
import scipy  # loads scipy.stats when it is first used

from cleanrl_style.protocol.fronts import (  # noqa: F401
    REFERENCE_POINT,
    cardinality,
    expected_utility,
    hypervolume,
    is_nondominated,
    objectives_of,
    return_columns,
    returns_of,
    scalarize,
    sparsity,
    weight_columns,
    weights_of,
)
from cleanrl_style.protocol.score import (  # noqa: F401
    best_constant_plans,
    by_weight,
    gains,
    mean_scalarized,
    score,
)


def pair(preference) -> np.ndarray:
    """Weights (..., 2) of two objectives, by the first's (...)."""
    preference = np.asarray(preference)
    return np.stack([preference, 1 - preference], axis=-1)


def mean_returns(evaluation: pd.DataFrame) -> pd.DataFrame:
    """Mean returns over the episodes of each weight, a column an objective; index: the weights, ascending."""
    objectives = objectives_of(evaluation.columns)
    return by_weight(evaluation)[return_columns(objectives)].mean().sort_index()


# ----------------------------------------------------------------------------- paired over the same episodes


def mean_interval(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean over the first axis, NaN of no values; half the width of its 95 % t interval, NaN of fewer than two."""
    values = np.asarray(values, dtype=float)
    n = len(values)
    if n < 2:
        unknown = np.full(values.shape[1:], np.nan)
        return values[0] if n else unknown, unknown
    return values.mean(axis=0), scipy.stats.t.ppf(0.975, n - 1) * values.std(axis=0, ddof=1) / np.sqrt(n)


def welch_interval(first, second) -> tuple[float, float]:
    """Ends of the 95 % interval of one mean less another, by Welch's t, of values (n,) and (k,).

    Of a single value, which has no spread, the other side's counts alone; of two single values both ends are NaN.
    """
    # not scipy's: it takes no single value, and warns of equal ones, as trainings have that learned to do nothing
    sides = [np.asarray(values, dtype=float) for values in (first, second)]
    difference = sides[0].mean() - sides[1].mean()
    variances = [(side.var(ddof=1) / len(side), len(side)) for side in sides if len(side) > 1]
    if not variances:
        return np.nan, np.nan
    variance = sum(one for one, _ in variances)
    if variance == 0.0:
        return difference, difference
    freedom = variance**2 / sum(one**2 / (n - 1) for one, n in variances)
    half_width = scipy.stats.t.ppf(0.975, freedom) * np.sqrt(variance)
    return float(difference - half_width), float(difference + half_width)


def both_ends(low: float, high: float, mean: float, half_width: float) -> tuple[float, float]:
    """Ends of two 95 % intervals together, a bootstrap's and t's: what is told is told by both."""
    return min(low, mean - half_width), max(high, mean + half_width)


def with_interval(name: str, values: np.ndarray) -> dict[str, float]:
    """A mean under its name, and the ends of its 95 % t interval under <name>_low and <name>_high."""
    mean, half_width = mean_interval(values)
    return {name: mean, f"{name}_low": mean - half_width, f"{name}_high": mean + half_width}


def paired_returns(evaluation: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Weights (k, m) in ascending order, and the returns of every episode under every weight, (episodes, k, m).

    Raises ValueError if the weights were not evaluated on the same episodes.
    """
    objectives = objectives_of(evaluation.columns)
    weights = weight_columns(objectives)
    tables = [evaluation.pivot(index="seed", columns=weights, values=name) for name in return_columns(objectives)]
    if any(table.isna().to_numpy().any() for table in tables):
        raise ValueError("the weights were not evaluated on the same episodes: they cannot be paired")
    levels = tables[0].columns.to_frame().to_numpy(dtype=float)
    return pair(levels[:, 0]) if len(weights) == 1 else levels, np.stack([table.to_numpy() for table in tables], axis=2)


# Of two objectives alone: weights on a line have neighbours, those of more do not.


def _violates(changes: np.ndarray, margin: np.ndarray | float = 0.0) -> np.ndarray:
    """Whether carbon fell or thaw rose by more than the margin between adjacent weights; changes (k, 2)."""
    return ((changes * [-1, 1]) > margin).any(axis=-1)


def violations_percent(returns: np.ndarray) -> float:
    """Share of adjacent pairs of weights that violate lambda-monotonicity [%].

    returns: (k, 2) mean returns, in ascending order of the carbon weight. As that weight rises, carbon must
    not fall and thaw must not rise. NaN for fewer than two weights.
    """
    changes = np.diff(np.asarray(returns, dtype=float), axis=0)
    return 100 * float(_violates(changes).mean()) if len(changes) else np.nan


def violations_or_ties_percent(returns: np.ndarray) -> float:
    """The same, of pairs where carbon fails to rise or thaw fails to fall, ties included, as the paper words it [%]."""
    changes = np.diff(np.asarray(returns, dtype=float), axis=0)
    return 100 * float((changes * [-1, 1] >= 0).any(axis=-1).mean()) if len(changes) else np.nan


def significant_violations_percent(evaluation: pd.DataFrame) -> float:
    """The same, counting only changes larger than their paired 95 % interval [%]; of one episode NaN."""
    _, returns = paired_returns(evaluation)
    if min(returns.shape[:2]) < 2:
        return np.nan
    change, half_width = mean_interval(np.diff(returns, axis=1))
    return 100 * float(_violates(change, half_width).mean())


def expected_violations_percent(returns: np.ndarray) -> float:
    """What `violations_percent` is on average over all orders of the points [%]: of a policy that ignores the
    preference and differs between weights by chance alone. Neighbours in a random order are any pair, either way round.
    """
    returns = np.asarray(returns, dtype=float)
    changes = (returns[None] - returns[:, None])[~np.eye(len(returns), dtype=bool)]
    return 100 * float(_violates(changes).mean()) if len(returns) > 1 else np.nan


def preference_response(evaluation: pd.DataFrame) -> pd.DataFrame:
    """How the returns follow the preference, over the paired episodes, with 95 % intervals.

    A row a return. Columns: `change` from the lowest to the highest weight, `slope` of the return against the weight
    (least squares within each episode), each with `_low` and `_high`. The weight is the objective's own; of two
    objectives the first's for both, so that a policy that follows has a change above and one below 0.
    """
    weights, returns = paired_returns(evaluation)
    if len(weights) < 2:
        raise ValueError(f"a response to the preference needs two weights or more, not {len(weights)}")
    rows = {}
    for k, name in enumerate(return_columns(objectives_of(evaluation.columns))):
        weight = weights[:, 0 if weights.shape[1] == 2 else k]
        ends = [returns[:, weight == end, k].mean(axis=1) for end in (weight.min(), weight.max())]
        centred = weight - weight.mean()
        slopes = returns[:, :, k] @ centred / (centred**2).sum()
        rows[name] = with_interval("change", ends[1] - ends[0]) | with_interval("slope", slopes)
    return pd.DataFrame.from_dict(rows, orient="index")


def response_of_sites(evaluation: pd.DataFrame) -> np.ndarray:
    """Change of both returns from the lowest carbon weight to the highest, (2, sites), by ascending seed."""
    weights, returns = paired_returns(evaluation)
    if weights.shape[1] != 2:
        raise ValueError(f"a change from one weight to another is of two objectives, not of {weights.shape[1]}")
    return (returns[:, -1] - returns[:, 0]).T


# ------------------------------------------------------------------------------------ over training seeds


def iqm(values: np.ndarray) -> float:
    """Interquartile mean: the mean of the middle half (Agarwal et al. 2021)."""
    return float(scipy.stats.trim_mean(np.asarray(values, dtype=float), 0.25))


def bootstrap_interval(values: np.ndarray, repetitions: int = 50_000) -> tuple[float, float]:
    """95 % percentile bootstrap interval of the IQM over training seeds (NaN for fewer than two seeds).

    values: (seeds,), one number per training run, already averaged over its episodes. Deterministic.
    """
    values = np.asarray(values, dtype=float)
    if len(values) < 2:
        return np.nan, np.nan
    resampled = np.random.default_rng(0).choice(values, (repetitions, len(values)))
    low, high = np.percentile(scipy.stats.trim_mean(resampled, 0.25, axis=1), [2.5, 97.5])
    return float(low), float(high)


def bootstrap_band(curves: np.ndarray, repetitions: int = 2000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """IQM of curves (seeds, points) over the seeds, and its 95 % percentile bootstrap interval at each point.

    Whole curves are resampled; the interval is NaN for fewer than two seeds. Deterministic.
    """
    curves = np.asarray(curves, dtype=float)
    middle = scipy.stats.trim_mean(curves, 0.25, axis=0)
    if len(curves) < 2:
        return middle, np.full_like(middle, np.nan), np.full_like(middle, np.nan)
    chosen = np.random.default_rng(0).integers(len(curves), size=(repetitions, len(curves)))
    low, high = np.percentile(scipy.stats.trim_mean(curves[chosen], 0.25, axis=1), [2.5, 97.5], axis=0)
    return middle, low, high


# ---------------------------------------------------------------------- over training seeds and sites together


def of_sites(gained: pd.DataFrame) -> pd.Series:
    """Scalarised gain of each site (the episode's seed), averaged over the weights; ascending."""
    return gained.groupby("seed").scalarized_return.mean().sort_index()


def plans_of_sites(plans: pd.DataFrame, weights: np.ndarray) -> np.ndarray:
    """Scalarised gains of constant plans (a) at each of the weights (k, m), (a, k, sites); sites by ascending seed.

    plans : gains, of `reference.py`'s form
    """
    columns = return_columns(objectives_of(plans.columns))
    cube = [plans.pivot(index="plan", columns="seed", values=name).to_numpy() for name in columns]
    return np.einsum("mas,km->aks", np.array(cube), weights)


def sets_of_sites(sites: int, repetitions: int) -> tuple[np.ndarray, np.random.Generator]:
    """Shares of the sites in sets of as many that are drawn anew, (sets, sites), and a generator to draw seeds by."""
    shares, generator = _sets_of_sites(sites, repetitions)
    return shares, copy.deepcopy(generator)


@functools.lru_cache(maxsize=4)  # drawing takes longer than all that is done with them
def _sets_of_sites(sites: int, repetitions: int) -> tuple[np.ndarray, np.random.Generator]:
    generator = np.random.default_rng(0)
    shares = generator.multinomial(sites, np.full(sites, 1 / sites), repetitions) / sites
    shares.flags.writeable = False
    return shares, generator


def score_interval(
    gained: np.ndarray, plans: np.ndarray | None, repetitions: int = 20_000
) -> tuple[float, float, float]:
    """IQM of the score over training seeds, and its 95 % bootstrap interval over seeds and sites, both drawn anew.

    gained : (seeds, sites), of `of_sites`; plans : (plans, weights, sites) on the same sites, whose best is chosen
    anew on every drawn set of sites; None: the gain itself, not the score. The interval is NaN for fewer than two
    seeds. Deterministic. Sites are drawn as if they had been chosen by chance: as they are stratified, their part of
    the interval is rather too wide.
    """
    gained = np.asarray(gained, dtype=float)
    seeds, sites = gained.shape

    def of(shares):
        """Score of each seed, (sets, seeds), by the sites' shares in a set, (sets, sites)."""
        means = shares @ gained.T
        if plans is None:
            return means
        best = (plans.reshape(-1, sites) @ shares.T).reshape(*plans.shape[:2], -1).max(axis=0).mean(axis=0)
        return 100 * means / np.where(best > 0, best, np.nan)[:, None]

    middle = iqm(of(np.full((1, sites), 1 / sites))[0])
    if seeds < 2:
        return middle, np.nan, np.nan
    shares, generator = sets_of_sites(sites, repetitions)
    scores = of(shares)
    drawn = generator.integers(seeds, size=(repetitions, seeds))
    values = scipy.stats.trim_mean(np.take_along_axis(scores, drawn, axis=1), 0.25, axis=1)
    low, high = np.nanpercentile(values, [2.5, 97.5])
    return middle, float(low), float(high)


def difference_interval(first, second, repetitions: int = 20_000) -> tuple[float, float, float]:
    """IQM over training seeds of one method's gain less another's, and its 95 % bootstrap interval.

    first, second : (seeds, sites), of `of_sites`. Sites are drawn anew for both at once, seeds for each by itself. One
    row is a fixed plan, or a single training, whose part of the interval is lacking. Deterministic.
    """
    first, second = (np.asarray(gained, dtype=float) for gained in (first, second))
    shares, generator = sets_of_sites(first.shape[1], repetitions)

    def drawn(gained):
        seeds = generator.integers(len(gained), size=(repetitions, len(gained)))
        return scipy.stats.trim_mean(np.take_along_axis(shares @ gained.T, seeds, axis=1), 0.25, axis=1)

    low, high = np.percentile(drawn(first) - drawn(second), [2.5, 97.5])
    return iqm(first.mean(axis=1)) - iqm(second.mean(axis=1)), float(low), float(high)


def seeds_to_tell(values: np.ndarray, difference: float = 0.1, power: float = 0.8) -> float:
    """Training seeds a method that tell two methods apart, which differ so much, on the same sites.

    NaN of fewer than two values, infinity for 10,000 seeds and more.

    By a two-sided t test at 5 %; both vary between seeds as the values do. That deviation is itself uncertain: of three
    values the true one is half to six times as large (95 %).
    """
    values = np.asarray(values, dtype=float)
    if len(values) < 2:
        return np.nan
    deviation = values.std(ddof=1)
    if deviation == 0:
        return 2

    def is_enough(seeds):
        freedom, shift = 2 * seeds - 2, difference / deviation * np.sqrt(seeds / 2)
        return scipy.stats.nct.sf(scipy.stats.t.ppf(0.975, freedom), freedom, shift) >= power

    candidates = range(2, 10_000)
    found = bisect.bisect_left(candidates, True, key=is_enough)  # power grows with seeds
    return candidates[found] if found < len(candidates) else np.inf
