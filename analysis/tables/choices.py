"""What each choice of a script is worth: its runs with one thing changed less those without, paired by training seed.

How far the preference is followed is the change of a return from weight 0 to 1. Differences are over the same sites,
and their 95 % intervals over seeds and sites together; `_told` says that 0 is neither in them nor in the t interval of
the seeds.
"""

import numpy as np
import pandas as pd

from analysis import metrics
from analysis.experiments import BALANCED, GENERALIST
from analysis.tables.common import row_of
from analysis.tables.main_results import named
from cleanrl_style import protocol

EXPERIMENTS = ("group", "budgets", "controls", "variants")
MADE_BY = f"python analysis/reproduce.py --only main balanced {' '.join(EXPERIMENTS)}"
CHANGES = ("carbon_change", "thaw_change")
COLUMNS = {
    "method": "method",
    "environment": "environment",
    "setting": "changed",
    "seeds": "seeds",
    "score_greedy": "score, greedy",
    "score_sampled": "score, sampled",
    "carbon_change": "more of carbon, weight 1 less 0",
    "thaw_change": "more of thaw, weight 1 less 0",
}


def by_seed(replicates: list) -> dict[int, object]:
    """Replicates by their training seed, those whose gains and plans are known."""
    known = [one for one in replicates if one.gains is not None and one.plans is not None]
    return {one.runs[0].arguments["seed"]: one for one in known}


def is_told(changes: np.ndarray, low: float, high: float) -> bool:
    """Whether neither an interval nor, of the differences (seeds, sites), the t interval over seeds has 0 in it."""
    low, high = metrics.both_ends(low, high, *metrics.mean_interval(np.asarray(changes).mean(axis=1)))
    return bool(low > 0.0 or high < 0.0)


def difference(name: str, changes: np.ndarray, plans: np.ndarray | None) -> dict:
    """Differences (seeds, sites): value with its interval, as a score where there are plans, and whether it is told."""
    value, low, high = metrics.score_interval(changes, plans)
    return named(name, value, low, high) | {f"{name}_told": is_told(changes, low, high)}


def score_difference(name: str, pairs: list[tuple], policy: str) -> dict:
    """Score of the first of each pair less that of the second."""
    sites = [
        metrics.of_sites(one.by_policy[policy]) - metrics.of_sites(other.by_policy[policy]) for one, other in pairs
    ]
    weights = np.unique(metrics.weights_of(pairs[0][0].gains), axis=0)
    return difference(name, pd.DataFrame(sites).to_numpy(), metrics.plans_of_sites(pairs[0][0].plans, weights))


def make(results, only: str | None = None) -> pd.DataFrame:
    """One row per changed choice; only : of one script."""
    rows = []
    wanted = [job for job in results.jobs if job.experiment in EXPERIMENTS and only in (None, job.script)]
    for key in dict.fromkeys(job.row for job in wanted):
        script, env_id, _ = key
        changed = by_seed(results.rows[key])
        default = by_seed(results.of({GENERALIST: "main", BALANCED: "balanced"}[env_id], script))
        pairs = [(changed[seed], default[seed]) for seed in sorted(changed.keys() & default.keys())]
        row = row_of(key, len(pairs))
        if pairs:
            for policy in protocol.POLICIES:
                row |= score_difference(f"score_{policy}", pairs, policy)
            sites = [
                metrics.response_of_sites(one.evaluation) - metrics.response_of_sites(other.evaluation)
                for one, other in pairs
            ]
            for name, change in zip(CHANGES, np.stack(sites, axis=1), strict=True):
                row |= difference(name, change, None)
        rows.append(row)
    return pd.DataFrame(rows)
