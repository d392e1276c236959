"""Evaluates constant plans under the protocol: what a method that looks at nothing already has.

    python analysis/studies/constant_plans.py

Planting 50 or 100 stems/ha a year at each of the five mixes wherever there is room, on the evaluation's episodes.
Leaves results/studies/constant_plans.csv, one row an episode.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pandas as pd

import sim
from analysis import protocol, results
from analysis.studies import open_loop, stored
from analysis.studies.measure_balance import where_valid

ENVIRONMENTS = ("boreal-generalist-v0", "boreal-balanced-v0")
PLANTING = tuple(range(15, 25))  # +50 and +100, five mixes each
DENSE_CONIFER = 24


@dataclass
class Args:
    """Evaluates constant planting under the protocol."""

    eval_episodes: int = 100
    """evaluation episodes"""
    quick: bool = False
    """2 episodes, into results/quick/studies"""


def study(env_id: str, episodes: int) -> pd.DataFrame:
    """Returns of every planting action on the episodes of the evaluation."""
    args = SimpleNamespace(env_id=env_id, mode="generalist", thaw_formulation="asymmetric", eval_episodes=episodes)
    tables = []
    for action in PLANTING:
        def probabilities(observations, masks, accrued_returns, action=action):
            return np.eye(sim.management.NUM_ACTIONS)[where_valid(masks, action)]

        table, _ = protocol.evaluate(args, {}, probabilities, (0.0,), ("sampled",))
        tables.append(table.assign(env_id=env_id, action=action))
    return pd.concat(tables)[["env_id", "action", "episode", "seed", "carbon_return", "thaw_return"]]


def as_evaluation(plans: pd.DataFrame, weights, best: bool) -> pd.DataFrame:
    """The study's rows of one environment as an evaluation: dense conifer, or at each weight the best plan.

    The best is chosen on the very episodes that it is reported on, which flatters it a little.
    """
    rows = []
    for weight in weights:
        scalarized = protocol.scalarize(plans.carbon_return, plans.thaw_return, weight)
        action = scalarized.groupby(plans.action).mean().idxmax() if best else DENSE_CONIFER
        chosen = plans.action == action
        rows.append(plans[chosen].assign(preference=weight, scalarized_return=scalarized[chosen]))
    return pd.concat(rows, ignore_index=True)


def main(args: Args) -> None:
    """Evaluate the plans in both environments, unless the table is there."""
    args = replace(args, eval_episodes=2) if args.quick else args
    folder = results.QUICK_STUDIES_DIR if args.quick else results.STUDIES_DIR
    path = folder / "constant_plans.csv"
    settings = {"episodes": args.eval_episodes, "actions": PLANTING, "physics": open_loop.fingerprint()}
    if stored.is_finished(path, settings):
        print(f"{path} is finished")
        return
    stored.write(path, pd.concat([study(env_id, args.eval_episodes) for env_id in ENVIRONMENTS]), settings)
    print(f"wrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
