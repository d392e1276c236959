"""Evaluates constant plans under the protocol: what a method that looks at nothing already has.

    python analysis/studies/constant_plans.py

Every action every year, wherever it can be carried out: on the evaluation's episodes, where the score is measured by
them (cleanrl_style/protocol/reference.py), of environments with two objectives and with more; and on the single sites
of the experiments, where all episodes are one.
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
from cleanrl_style import protocol
from cleanrl_style.protocol import score
from cleanrl_style.protocol.reference import constant, reference_returns
from sim.task.preference import check_weights

ENVIRONMENTS = (experiments.GENERALIST, experiments.BALANCED)
CONIFERS, DECIDUOUS = 24, 20  # actions that plant 100 trees of one kind


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
    table = constant(reference_returns(task, protocol.evaluation_seeds(task, episodes)))
    table = table.assign(env_id=env_id, action=table.plan.astype(int))
    return table[["env_id", "action", "seed", *metrics.return_columns(task.objectives)]]


def study_of_sites(seeds) -> pd.DataFrame:
    """Returns of every action every year where it can be carried out, on single sites."""
    actions, tables = np.arange(sim.management.NUM_ACTIONS), []
    for seed in seeds:
        with contextlib.closing(gym.make_vec(experiments.ONE_SITE, num_envs=len(actions), site_seed=seed)) as envs:
            envs.reset(seed=0)  # the preference alone comes of it
            returns = np.zeros((len(actions), 2))
            for _ in range(boreal_env.DEFAULT_YEARS):
                _, rewards, *_ = envs.step(boreal_env.where_valid(actions, envs.action_masks()))
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


def of_environment(plans: pd.DataFrame, env_id: str) -> pd.DataFrame:
    """The study's rows of one environment, with the returns of its objectives alone."""
    return plans[plans.env_id == env_id].dropna(axis="columns", how="all")


def as_evaluation(plans: pd.DataFrame, weights, action: int | None = None) -> pd.DataFrame:
    """Rows `of_environment` as an evaluation: of an action every year, or of the best plan at each weight.

    weights : as flags have them; action : None for the best, which is chosen on the very episodes that it is reported
    on: that flatters it a little.
    """
    objectives = metrics.objectives_of(plans.columns)
    weights = np.array([check_weights(value, len(objectives)) for value in weights])
    if action is None:
        return score.best_constant_plans(plans.assign(plan=plans.action.astype(str)), weights)
    return score.at_weights(plans[plans.action == action], weights)


def main(args: Args) -> None:
    """Evaluate the plans, but for what is there."""
    args = replace(args, eval_episodes=2) if args.quick else args
    folder = paths.studies(args.quick)
    sites = experiments.SITE_SEEDS[: 1 if args.quick else None]
    environments = (*ENVIRONMENTS, *experiments.OTHER_WORLDS[: 1 if args.quick else None])
    tables = {
        "constant_plans": (
            {"episodes": args.eval_episodes, "environments": environments},
            lambda: pd.concat([study(env_id, args.eval_episodes) for env_id in environments]),
        ),
        "constant_plans_of_sites": ({"sites": sites}, lambda: study_of_sites(sites)),
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
