"""MaskablePPO of sb3-contrib (Huang and Ontanon 2022): an agent for each weight, which share the budget equally.

    python analysis/outside/maskable_ppo.py --seed 1 --env-id boreal-balanced-v0

Settings are the library's own, but for the stands: 16 in lockstep, which the library steps as its VecEnv.
"""

from dataclasses import dataclass
from typing import ClassVar

from analysis.outside.arguments import Args
from cleanrl_style.flags import parse, require

require("sb3_contrib", extra="outside")


@dataclass
class MaskablePPOArgs(Args):
    """MaskablePPO of sb3-contrib on a boreal environment, an agent a weight: trains, evaluates, leaves a run folder."""

    learning_rate: float = 3e-4
    """of Adam"""
    num_envs: int = 16
    """stands in lockstep"""
    n_steps: int = 2048
    """steps of a rollout, summed over all stands; fewer where a weight's share of the training is smaller"""
    batch_size: int = 64
    """steps of a minibatch, at most those of a rollout"""
    n_epochs: int = 10
    """passes over the rollout in an update"""
    gamma: float = 0.99
    """discount factor"""
    gae_lambda: float = 0.95
    """lambda of generalised advantage estimation"""
    ent_coef: float = 0.0
    """weight of the entropy bonus"""

    limits: ClassVar = {"batch_size": (2, 10**6), "n_epochs": (1, 10**6), "n_steps": (2, 10**9)}


if __name__ == "__main__":
    args = parse(MaskablePPOArgs)  # a bad flag is answered before the libraries are loaded

import time

import gymnasium as gym
import numpy as np
import torch
from sb3_contrib import MaskablePPO
from stable_baselines3.common.vec_env import VecEnvWrapper

from analysis.outside.common import Session, main
from cleanrl_style import protocol
from cleanrl_style.protocol import training_envs


class Stands(VecEnvWrapper):
    """Stands in lockstep, seeded by the run whatever the library asks for, without the preference in what they observe.

    number : of the agent that trains on them, at these weights.
    """

    def __init__(self, session: Session, number: int, weights: np.ndarray):
        args, task = session.args, session.task.with_preference(weights)
        envs = training_envs.make_training_envs(task, args.num_envs, "lockstep").stable_baselines3()
        self.first, self.hidden = number * args.num_envs, task.num_objectives - 1
        envs.seed(args.seed * protocol.MAX_ENVS + self.first)
        space = envs.observation_space
        space = gym.spaces.Box(space.low[self.hidden :], space.high[self.hidden :], dtype=space.dtype)
        super().__init__(envs, observation_space=space)
        self.session, self.weights, self.objectives = session, weights, task.objectives
        self.steps, self.episodes, self.seconds = 0, 0, 0.0
        session.envs.append(self)

    def seed(self, seed=None):
        """The library's seed is for its own draws."""
        return [None] * self.num_envs

    def reset(self) -> np.ndarray:
        """The first episodes."""
        start = time.perf_counter()
        observations = self.venv.reset()
        self.seconds += time.perf_counter() - start
        return observations[:, self.hidden :]

    def step_wait(self):
        """A year of every stand, and the next episode of those that ended."""
        start = time.perf_counter()
        observations, rewards, ended, infos = self.venv.step_wait()
        self.seconds += time.perf_counter() - start
        self.steps += self.num_envs
        for i in np.flatnonzero(ended):
            self.episodes += 1
            infos[i]["terminal_observation"] = infos[i]["terminal_observation"][self.hidden :]
            returns = np.array([infos[i][f"{name}_return"] for name in self.objectives])
            self.session.finished(self.first + i, self.weights, returns, infos[i])
        return observations[:, self.hidden :], rewards, ended, infos


def rollout(args) -> tuple[int, int]:
    """Steps of a rollout, in whole years of all stands, and the number of rollouts that a weight's share has."""
    share = args.total_timesteps // len(args.eval_weights)
    steps = min(args.n_steps, share) // args.num_envs * args.num_envs
    return steps, share // steps if steps else 0


def check(args, task) -> None:
    """Refuse what does not go together."""
    weights = len(args.eval_weights)
    if weights * args.num_envs > protocol.MAX_ENVS:
        protocol.fail(f"--num-envs {args.num_envs}: times {weights} weights at most {protocol.MAX_ENVS} is allowed")
    if args.n_steps % args.num_envs:
        protocol.fail(f"--n-steps {args.n_steps}: a multiple of --num-envs {args.num_envs} is allowed")
    if args.batch_size > args.n_steps:
        protocol.fail(f"--batch-size {args.batch_size}: at most --n-steps {args.n_steps} is allowed")
    if rollout(args)[0] < 2:
        least = max(2, args.num_envs) * weights
        protocol.fail(
            f"--total-timesteps {args.total_timesteps}: at least {least}, a year of every stand for each weight"
        )


def learn(session: Session):
    """Train an agent for each weight of the evaluation, one after the other."""
    args, task, agents = session.args, session.task, {}
    n_steps, rollouts = rollout(args)
    whole = n_steps * rollouts * len(args.eval_weights)
    print(
        f"{rollouts} rollouts of {n_steps} steps for each weight: {whole:,} of {args.total_timesteps:,} steps",
        flush=True,
    )
    for number, given in enumerate(args.eval_weights):
        weights = task.check_weights(given)
        agent = MaskablePPO(
            "MlpPolicy",
            Stands(session, number, weights),
            learning_rate=args.learning_rate,
            n_steps=n_steps // args.num_envs,
            batch_size=min(args.batch_size, n_steps),
            n_epochs=args.n_epochs,
            gamma=args.gamma,
            gae_lambda=args.gae_lambda,
            ent_coef=args.ent_coef,
            seed=args.seed * len(args.eval_weights) + number,
            device="cpu",
        )
        agent.learn(rollouts * n_steps)
        agents[tuple(np.round(weights, 6))] = agent

    def policy(weights, observations, masks, accrued_returns):
        known = np.array(list(agents))
        chosen = np.abs(weights[:, None] - known).sum(axis=2).argmin(axis=1)
        probabilities = np.empty((len(observations), 25))
        for k, agent in enumerate(agents.values()):
            rows = chosen == k
            if rows.any():
                with torch.no_grad():
                    x = torch.from_numpy(observations[rows])
                    probabilities[rows] = agent.policy.get_distribution(x, masks[rows]).distribution.probs.numpy()
        return probabilities

    return policy


if __name__ == "__main__":
    main(__file__, args, learn, samples=True, check=check)
