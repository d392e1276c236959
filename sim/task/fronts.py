"""Best known fronts of published sites: plans that ship with the code, played when they are asked for.

A plan is an action for each block of years, carried out where it can be in full. `analysis/best_plans.py` finds those
that ship. Only plans are kept: what they return comes of playing them, so it is of the physics that is here.
"""

import csv
import functools
import gzip
from importlib.resources import files
from numbers import Real

import numpy as np

from sim.task.actions import where_valid

FOLDER = "best_plans"
FREE = ("observation_groups", "record_years", "record_steps", "fixed_preference")  # arguments that no return hangs on


def shipped(env_id: str):
    """The file of an environment's plans; it need not exist."""
    return files("sim.task") / FOLDER / f"{env_id}.csv.gz"


@functools.cache
def published_plans(env_id: str) -> dict[int, np.ndarray]:
    """Seed of a published site's episode -> its plans (plans, blocks); empty if none ship."""
    file = shipped(env_id)
    if not file.is_file():
        return {}
    plans: dict[int, list] = {}
    for row in csv.DictReader(gzip.decompress(file.read_bytes()).decode().splitlines()):
        plans.setdefault(int(row["seed"]), []).append([int(action) for action in row["plan"].split()])
    return {seed: np.array(its_plans) for seed, its_plans in plans.items()}


def plans_of(arguments: dict, seed: int | None, registered: dict[str, dict]) -> np.ndarray:
    """The plans of the episode that began with reset(seed=), (plans, blocks); ValueError says what has any.

    arguments : of the environment; registered : id -> arguments.
    """
    known = [env_id for env_id in registered if published_plans(env_id)]
    given = {name: value for name, value in arguments.items() if name not in FREE}
    env_id = next((env_id for env_id in known if registered[env_id] == given), None)
    if env_id is None:
        raise ValueError(
            f"pareto_front: published fronts are those of {', '.join(known) or 'no environment yet'}, with no argument "
            "changed"
        )
    plans = published_plans(env_id)
    if seed not in plans:
        raise ValueError(
            f"pareto_front: the episode has to begin with reset(seed=) of a published site, not {seed}; "
            f"{len(plans)} have a front, such as {min(plans)}"
        )
    return plans[seed]


def play_plans(envs, seed: int | None, plans: np.ndarray, years: int) -> np.ndarray:
    """Rewards (plans, years, m) of plans (plans, blocks) on the episode of a seed, which all of them share.

    envs : a vector environment with a stand a plan.
    """
    plans = np.asarray(plans)
    block = -(-years // plans.shape[1])
    envs.reset(seed=[seed] * len(plans))
    rewards = []
    for year in range(years):
        rewards.append(envs.step(where_valid(plans[:, year // block], envs.action_masks()))[1])
    return np.stack(rewards, axis=1).astype(float)


def discounts(gamma: float, years: int) -> np.ndarray:
    """Factors of the rewards of so many years."""
    if isinstance(gamma, bool) or not isinstance(gamma, Real) or not 0.0 <= gamma <= 1.0:
        raise ValueError(f"gamma: a number in [0, 1] is allowed, got {gamma!r}")
    return float(gamma) ** np.arange(years)


def undominated(returns: np.ndarray) -> np.ndarray:
    """Those of returns (n, m) that no other one dominates, the first of equal ones, by rising first return."""
    better = (returns[:, None] >= returns).all(axis=2) & (returns[:, None] > returns).any(axis=2)
    return np.unique(returns[~better.any(axis=0)], axis=0)
