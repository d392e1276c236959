"""How many episodes the gradient of EUPG needs before it points anywhere: its noise against its signal.

    python analysis/studies/gradient_noise.py

An untrained policy of cleanrl_style/eupg_var_lambda.py plays sampled sites, several episodes on each with the same
first stand, weather and dice, and the gradient of every episode is taken as the script takes it, then with baselines
that the script does not have. The mean over n independent episodes is the gradient's signal plus noise whose square is
1 / n of one episode's; at n = `episodes` both are equal. Leaves results/studies/gradient_noise.csv, one row a utility,
baseline and objective; docs/learning.md says how to read it.
"""

import contextlib
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import gymnasium as gym
import numpy as np
import pandas as pd
import torch

import boreal_env
from analysis import metrics, paths, stored
from analysis.experiments import GENERALIST
from analysis.studies import open_loop
from cleanrl_style import eupg_var_lambda as eupg
from cleanrl_style import protocol

ENV_ID = GENERALIST
AGENT_SEED = 1
FIRST_SEED = 1_000_000  # of the episodes: no training's and no evaluation's
UTILITIES = ("total", "future")  # of the script's --utility
NONE, MEAN, SITE = "none", "mean of all sites", "mean of the site"
BASELINES = (NONE, MEAN, SITE)
OBJECTIVES = (*open_loop.OBJECTIVES, "preference")  # the last is what the script uses: each episode's own preference
Z = 1.96  # of a 95 % interval


class Design(NamedTuple):
    """Sites, episodes on each, and years of an episode."""

    sites: int
    episodes: int
    years: int


FULL = Design(sites=512, episodes=8, years=boreal_env.DEFAULT_YEARS)
QUICK = Design(sites=8, episodes=2, years=12)


@dataclass
class Args:
    """Measures the noise in EUPG's gradient at the beginning of its training."""

    quick: bool = False
    """8 sites and 12 years, into results/quick/studies"""


class Episodes(NamedTuple):
    """Episodes of all sites, an array (sites, episodes, years, ...) each."""

    inputs: np.ndarray  # of the policy, (..., observation + 2)
    masks: np.ndarray  # (..., 25)
    actions: np.ndarray
    rewards: np.ndarray  # (..., 2)
    preferences: np.ndarray  # (sites, episodes)


def play(agent, envs, design: Design) -> Episodes:
    """Episodes of a policy that samples its actions, a row of envs' stands a site."""
    progress = protocol.Progress("episodes", design.sites, "sites")
    at_once = envs.num_envs // design.episodes
    parts = []
    for first in range(0, design.sites, at_once):
        observations, _ = envs.reset(seed=[FIRST_SEED + first * design.episodes + k for k in range(envs.num_envs)])
        preferences = observations[:, 0].astype(np.float64)
        returns, years = np.zeros((envs.num_envs, 2)), []
        for _ in range(design.years):
            x = eupg.policy_input(observations, returns)
            mask = torch.from_numpy(boreal_env.action_masks(observations))
            with torch.no_grad():
                action, *_ = agent.get_action(x, mask)
            observations, rewards, *_ = envs.step(action.numpy())
            returns += rewards
            years.append((x.numpy(), mask.numpy(), action.numpy(), rewards.astype(np.float64)))
        stacked = [np.stack(column, axis=1) for column in zip(*years, strict=True)]
        parts.append([a.reshape(at_once, design.episodes, *a.shape[1:]) for a in (*stacked, preferences)])
        progress.show(first + at_once)
    return Episodes(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def advantages(rewards: np.ndarray, utility: str, baseline: str) -> np.ndarray:
    """What weights each step's gradient in either objective, of rewards (sites, episodes, years, 2); the same shape.

    The baseline of a year is the mean of all other episodes, or of the site's other ones: neither biases the gradient.
    """
    to_go = np.flip(np.cumsum(np.flip(rewards, axis=2), axis=2), axis=2)
    values = to_go if utility == "future" else np.broadcast_to(to_go[:, :, :1], to_go.shape)
    if baseline == NONE:
        return values
    axes = (0, 1) if baseline == MEAN else (1,)
    number = np.prod([values.shape[axis] for axis in axes])
    others = (values.sum(axis=axes, keepdims=True) - values) / (number - 1)
    return values - others


def gradients(agent, inputs, masks, actions, weights) -> np.ndarray:
    """Gradients (k, parameters) of an episode's mean log-probability, weighted by each row of weights (k, years)."""
    log_probability = agent.get_action(torch.from_numpy(inputs), torch.from_numpy(masks), torch.from_numpy(actions))[1]
    outputs = torch.from_numpy((weights / weights.shape[1]).astype(np.float32))
    parts = torch.autograd.grad(log_probability, list(agent.parameters()), outputs, is_grads_batched=True)
    return torch.cat([part.flatten(start_dim=1) for part in parts], dim=1).numpy()


def signal_and_noise(means: np.ndarray, squares: np.ndarray) -> dict[str, float]:
    """Squares of the gradient's signal and of one episode's noise.

    means : (sites, parameters), the mean gradient of each site, independent of one another; squares : of the norms of
    all episodes' gradients. The signal's is the mean product of two sites' gradients, without bias, its interval of the
    jackknife over sites; it may come out negative where it is too small for the number of sites.
    """
    number = len(means)
    total = means.sum(axis=0, dtype=np.float64)
    own, all_products = (means.astype(np.float64) ** 2).sum(axis=1), total @ total
    signal = (all_products - own.sum()) / (number * (number - 1))
    without = (all_products - 2 * (means @ total) + own - (own.sum() - own)) / ((number - 1) * (number - 2))
    error = ((number - 1) / number * ((without - without.mean()) ** 2).sum()) ** 0.5
    return {
        "signal": signal,
        "signal_low": signal - Z * error,
        "signal_high": signal + Z * error,
        "noise": squares.mean() - signal,
    }


def with_episodes(table: pd.DataFrame) -> pd.DataFrame:
    """The table with `episodes`, each row's noise over the objective's signal, and its interval.

    No baseline and neither utility changes what the gradient is on average, so there is one signal an objective: that
    of the row with the least noise, which knows it best. (The others' intervals contain it, if nothing is wrong.)
    """
    best = table.loc[table.groupby("objective").noise.idxmin()].set_index("objective")
    needed = {}
    for end, of in (("", "signal"), ("_low", "signal_high"), ("_high", "signal_low")):
        signal = table.objective.map(best[of])
        needed[f"episodes{end}"] = (table.noise / signal).where(signal > 0, np.inf)
    return table.assign(**needed)


def study(design: Design) -> pd.DataFrame:
    """The table of a design."""
    torch.manual_seed(AGENT_SEED)
    torch.set_num_threads(1)
    stands = min(design.sites * design.episodes, 64)
    with contextlib.closing(gym.make_vec(ENV_ID, num_envs=stands, group_size=design.episodes)) as envs:
        agent = eupg.Agent(envs)
        episodes = play(agent, envs, design)
    cases = list(product(UTILITIES, BASELINES))
    of_case = np.stack([advantages(episodes.rewards, *case) for case in cases], axis=2)  # (s, e, cases, years, 2)
    parameters = sum(parameter.numel() for parameter in agent.parameters())
    means = np.zeros((len(cases), len(OBJECTIVES), design.sites, parameters), np.float32)
    squares = np.zeros((len(cases), len(OBJECTIVES), design.sites, design.episodes))
    progress = protocol.Progress("gradients", design.sites, "sites")
    for site in range(design.sites):
        for k in range(design.episodes):
            weights = np.moveaxis(of_case[site, k], -1, 0)  # (2, cases, years)
            both = gradients(
                agent,
                episodes.inputs[site, k],
                episodes.masks[site, k],
                episodes.actions[site, k],
                weights.reshape(-1, design.years),
            ).reshape(2, len(cases), -1)
            weight = metrics.pair(episodes.preferences[site, k].astype(np.float32))
            own = protocol.scalarize(np.moveaxis(both, 0, -1), weight)
            gradient = np.stack([*both, own], axis=1)
            means[:, :, site] += gradient / design.episodes
            squares[:, :, site, k] = (gradient.astype(np.float64) ** 2).sum(axis=-1)
        progress.show(site + 1)
    return with_episodes(
        pd.DataFrame(
            [
                {
                    "utility": utility,
                    "baseline": baseline,
                    "objective": objective,
                    **signal_and_noise(means[case, which], squares[case, which]),
                }
                for case, (utility, baseline) in enumerate(cases)
                for which, objective in enumerate(OBJECTIVES)
            ]
        )
    )


def report(table: pd.DataFrame) -> None:
    """Print the episodes at which signal and noise are equal."""
    print("\nEpisodes whose mean gradient has as much signal as noise (95 % interval over sites)")
    for row in table.itertuples():
        print(
            f"{row.utility:7s} {row.baseline:18s} {row.objective:11s} {row.episodes:10,.0f} "
            f"[{row.episodes_low:,.0f}, {row.episodes_high:,.0f}]"
        )


def main(args: Args) -> None:
    """Play and analyse, unless the table is there."""
    design = QUICK if args.quick else FULL
    path = paths.studies(args.quick) / "gradient_noise.csv"
    settings = {**design._asdict(), "agent_seed": AGENT_SEED, "first_seed": FIRST_SEED}
    if stored.is_finished(path, settings):
        print(f"{path} is finished")
        report(stored.read(path))
        return
    table = study(design)
    stored.write(path, table, settings)
    report(table)
    print(f"\nwrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
