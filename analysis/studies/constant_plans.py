"""Evaluates constant plans under the protocol: what a method that looks at nothing already has.

    python analysis/studies/constant_plans.py

Every action every year, wherever it can be carried out: on the evaluation's episodes, where the score is measured by
them (cleanrl_style/protocol/reference.py), and on the single sites of the experiments, where all episodes are one.
Leaves results/studies/constant_plans.csv and constant_plans_of_sites.csv, one row an episode.
"""

import contextlib
from dataclasses import dataclass, replace

import gymnasium as gym
import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import experiments, metrics, paths, stored
from analysis.studies import open_loop
from cleanrl_style import protocol
from cleanrl_style.protocol.reference import reference_returns

ENVIRONMENTS = (experiments.GENERALIST, experiments.BALANCED)
DENSE_CONIFER = 24


@dataclass
class Args:
    """Evaluates constant plans under the protocol."""

    eval_episodes: int = 200
    """evaluation episodes"""
    quick: bool = False
    """2 episodes, into results/quick/studies"""


def study(env_id: str, episodes: int) -> pd.DataFrame:
    """Returns of every constant plan on the episodes of the evaluation."""
    task = protocol.Task.of(env_id)
    table = reference_returns(task, protocol.evaluation_seeds(task, episodes))
    table = table[table.plan.str.isdigit()]
    table = table.assign(env_id=env_id, action=table.plan.astype(int))
    return table[["env_id", "action", "seed", "carbon_return", "thaw_return"]]


def study_of_sites(seeds) -> pd.DataFrame:
    """Returns of every action every year where it can be carried out, on single sites."""
    actions, tables = np.arange(sim.management.NUM_ACTIONS), []
    for seed in seeds:
        with contextlib.closing(gym.make_vec(experiments.ONE_SITE, num_envs=len(actions), site_seed=seed)) as envs:
            envs.reset(seed=0)  # the preference alone comes of it
            returns = np.zeros((len(actions), 2))
            for _ in range(boreal_env.DEFAULT_YEARS):
                valid = envs.action_masks()[actions, actions]
                _, rewards, *_ = envs.step(np.where(valid, actions, boreal_env.NO_CHANGE))
                returns += rewards
        tables.append(
            pd.DataFrame(
                {"site_seed": seed, "action": actions, "carbon_return": returns[:, 0], "thaw_return": returns[:, 1]}
            )
        )
    return pd.concat(tables, ignore_index=True)


def best_gains(plans: pd.DataFrame, objective: str) -> pd.Series:
    """By site, what the best plan for an objective has over no change; plans : of `study_of_sites`."""
    returns = plans.pivot(index="action", columns="site_seed", values=objective)
    return returns.max() - returns.loc[boreal_env.NO_CHANGE]


def as_evaluation(plans: pd.DataFrame, weights, best: bool) -> pd.DataFrame:
    """The study's rows of one environment as an evaluation: dense conifer, or at each weight the best plan.

    The best is chosen on the very episodes that it is reported on, which flatters it a little.
    """
    rows = []
    for weight in weights:
        returns = plans[["carbon_return", "thaw_return"]].to_numpy()
        scalarized = pd.Series(protocol.scalarize(returns, metrics.pair(weight)), plans.index)
        action = scalarized.groupby(plans.action).mean().idxmax() if best else DENSE_CONIFER
        chosen = plans.action == action
        rows.append(plans[chosen].assign(preference=weight, scalarized_return=scalarized[chosen]))
    return pd.concat(rows, ignore_index=True)


def main(args: Args) -> None:
    """Evaluate the plans, but for what is there."""
    args = replace(args, eval_episodes=2) if args.quick else args
    folder = paths.studies(args.quick)
    sites = experiments.SITE_SEEDS[: 1 if args.quick else None]
    physics = open_loop.fingerprint()
    tables = {
        "constant_plans": (
            {"episodes": args.eval_episodes, "physics": physics},
            lambda: pd.concat([study(env_id, args.eval_episodes) for env_id in ENVIRONMENTS]),
        ),
        "constant_plans_of_sites": ({"sites": sites, "physics": physics}, lambda: study_of_sites(sites)),
    }
    for name, (settings, make) in tables.items():
        path = folder / f"{name}.csv"
        if stored.is_finished(path, settings):
            print(f"{path} is finished")
        else:
            stored.write(path, make(), settings)
            print(f"wrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
