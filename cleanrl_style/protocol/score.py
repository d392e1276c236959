"""Gains over doing nothing, and the score: what share of the best constant plans' gain a policy has.

A table of episodes has the columns of `evaluation.csv`: weights, seed, a return for each objective. One of plans
(`reference.py`) has the column plan in place of weights.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from cleanrl_style.protocol.fronts import (
    hypervolume,
    objectives_of,
    return_columns,
    returns_of,
    scalarize,
    weight_columns,
    weights_of,
)
from cleanrl_style.protocol.reference import NOTHING, PLUS_100, constant
from cleanrl_style.protocol.utility import LINEAR, Utility


def mean_scalarized(evaluation: pd.DataFrame) -> float:
    """Scalarised return, averaged over weights and episodes."""
    return float(scalarize(returns_of(evaluation), weights_of(evaluation)).mean())


def by_weight(evaluation: pd.DataFrame):
    """The evaluation grouped by weight: by one column of two objectives, else by one an objective."""
    weights = weight_columns(objectives_of(evaluation.columns))
    return evaluation.groupby(weights[0] if len(weights) == 1 else weights)


def gains(evaluation: pd.DataFrame, nothing: pd.DataFrame, utility: Utility = LINEAR) -> pd.DataFrame:
    """The evaluation less the returns of doing nothing on the same site and weather; of utilities likewise.

    Raises ValueError if doing nothing was not played on every one of the evaluation's seeds.
    """
    columns = return_columns(objectives_of(evaluation.columns))
    reference = nothing.drop_duplicates("seed").set_index("seed")[columns]
    missing = sorted(set(evaluation.seed) - set(reference.index))
    if missing:
        raise ValueError(
            f"zero change was not evaluated on {len(missing)} of the episodes, the first with seed {missing[0]}; "
            "evaluate both with the same --eval-episodes"
        )
    difference = evaluation.copy()
    theirs = reference.loc[evaluation.seed].to_numpy()
    difference[columns] -= theirs
    difference["scalarized_return"] = utility.gain(theirs, returns_of(difference), weights_of(difference))
    return difference


def at_weights(episodes: pd.DataFrame, weights: np.ndarray, utility: Utility = LINEAR) -> pd.DataFrame:
    """Episodes of what does not look at the preference as an evaluation: once for each of the weights (k, m)."""
    objectives, tables = objectives_of(episodes.columns), []
    for one in weights:
        columns = dict(zip(weight_columns(objectives), one, strict=len(objectives) != 2))
        table = episodes.assign(**columns)
        table["scalarized_return"] = utility(returns_of(table), one)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def best_constant_plans(plans: pd.DataFrame, weights: np.ndarray, utility: Utility = LINEAR) -> pd.DataFrame:
    """At each of the weights (k, m) the constant plan with the highest mean utility, as an evaluation.

    The best is chosen on the very episodes that it is reported on, which flatters it a little.
    """
    names, returns = zip(*((plan, returns_of(rows)) for plan, rows in constant(plans).groupby("plan")), strict=True)
    best = [names[int(np.argmax([utility(values, one).mean() for values in returns]))] for one in weights]
    tables = [at_weights(plans[plans.plan == plan], [one], utility) for plan, one in zip(best, weights, strict=True)]
    return pd.concat(tables, ignore_index=True)


def score(gained: pd.DataFrame, best: pd.DataFrame) -> float:
    """100 x the mean gain over that of the best constant plans; NaN where no constant plan gains anything.

    gained, best : gains of a policy and of `best_constant_plans`, at the same weights. Both are averaged over the
    weights first: at a single weight the best plan may be doing nothing.
    """
    ours, theirs = (np.unique(weights_of(table), axis=0) for table in (gained, best))
    if not np.array_equal(ours, theirs):
        raise ValueError(f"score: the same weights are allowed, policy {ours.tolist()}, plans {theirs.tolist()}")
    return percent(gained.scalarized_return.mean(), best.scalarized_return.mean())


def percent(gain: float, best: float) -> float:
    """The score of a mean gain, where the best constant plans' is `best`."""
    return 100 * gain / best if best > 0 else np.nan


def front(gained: pd.DataFrame) -> np.ndarray:
    """Mean gains of each weight, (k, m)."""
    return by_weight(gained)[return_columns(objectives_of(gained.columns))].mean().to_numpy()


def gain_hypervolume(gained: pd.DataFrame) -> float:
    """Hypervolume of the mean gains above doing nothing."""
    return hypervolume(front(gained), 0.0)


def change(gained: pd.DataFrame) -> np.ndarray:
    """How far each mean return goes from its lowest to its highest weight, (m,); of two, from the first's."""
    weights, points = np.array([weights_of(table)[0] for _, table in by_weight(gained)]), front(gained)
    changes = []
    for k in range(points.shape[1]):
        own = weights[:, 0 if points.shape[1] == 2 else k]
        changes.append(points[own == own.max(), k].mean() - points[own == own.min(), k].mean())
    return np.array(changes)


@dataclass(frozen=True)
class Comparison:
    """A policy's evaluation beside what one can do without looking; each as gains, under its name."""

    evaluation: pd.DataFrame
    plans: pd.DataFrame
    utility: Utility = LINEAR

    @cached_property
    def weights(self) -> np.ndarray:
        """Of the evaluation, (k, m), ascending."""
        return np.unique(weights_of(self.evaluation), axis=0)

    @cached_property
    def gains(self) -> dict[str, pd.DataFrame]:
        """Gains by name: each policy of the evaluation, `plus_100`, `best`."""
        zero = self.plans[self.plans.plan == NOTHING]
        tables = dict(tuple(self.evaluation.groupby("policy")))
        tables["plus_100"] = at_weights(self.plans[self.plans.plan == PLUS_100], self.weights, self.utility)
        tables["best"] = best_constant_plans(self.plans, self.weights, self.utility)
        return {name: gains(table, zero, self.utility) for name, table in tables.items()}

    @cached_property
    def by_weight(self) -> pd.DataFrame:
        """Mean scalarised gain, a row a weight, a column a name."""
        return pd.DataFrame({name: by_weight(table).scalarized_return.mean() for name, table in self.gains.items()})

    @cached_property
    def best_plans(self) -> list[str]:
        """The best constant plan of each weight."""
        return by_weight(self.gains["best"]).plan.first().tolist()

    def score(self, name: str) -> float:
        """The score of one of the names."""
        return score(self.gains[name], self.gains["best"])
