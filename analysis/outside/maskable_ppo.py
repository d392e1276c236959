"""MaskablePPO of sb3-contrib (Huang and Ontanon 2022): an agent for each weight, which share the budget equally.

    python analysis/outside/maskable_ppo.py --seed 1 --env-id boreal-balanced-v0

Settings are the library's own.
"""

from dataclasses import dataclass

from cleanrl_style.flags import require

require("sb3_contrib", extra="outside")

import gymnasium as gym
import numpy as np
import torch
from sb3_contrib import MaskablePPO

from analysis.outside.common import Args, Session, main
from cleanrl_style import protocol


@dataclass
class MaskablePPOArgs(Args):
    """MaskablePPO of sb3-contrib on a boreal environment, an agent a weight: trains, evaluates, leaves a run folder."""

    learning_rate: float = 3e-4
    """of Adam"""
    n_steps: int = 2048
    """steps of a rollout"""
    batch_size: int = 64
    """steps of a minibatch"""
    n_epochs: int = 10
    """passes over the rollout in an update"""
    gamma: float = 0.99
    """discount factor"""
    gae_lambda: float = 0.95
    """lambda of generalised advantage estimation"""
    ent_coef: float = 0.0
    """weight of the entropy bonus"""


class Scalarised(gym.Wrapper):
    """The environment with the weighed sum of its rewards."""

    def __init__(self, env: gym.Env, weights: np.ndarray):
        super().__init__(env)
        self.weights = weights

    def step(self, action):
        """A year."""
        observation, reward, *rest = self.env.step(action)
        return observation, float(reward @ self.weights), *rest

    def action_masks(self) -> np.ndarray:
        """Valid actions, bool (25,)."""
        return self.env.action_masks()


def learn(session: Session):
    """Train an agent for each weight of the evaluation, one after the other."""
    args, task, agents = session.args, session.task, {}
    share = args.total_timesteps // len(args.eval_weights)
    if share < 2:
        protocol.fail(f"--total-timesteps {args.total_timesteps}: two or more for each of the weights are allowed")
    n_steps = min(args.n_steps, share)
    for number, given in enumerate(args.eval_weights):
        weights = task.check_weights(given)
        agent = MaskablePPO(
            "MlpPolicy",
            Scalarised(session.env(weights), weights),
            learning_rate=args.learning_rate,
            n_steps=n_steps,
            batch_size=min(args.batch_size, n_steps),
            n_epochs=args.n_epochs,
            gamma=args.gamma,
            gae_lambda=args.gae_lambda,
            ent_coef=args.ent_coef,
            seed=args.seed * len(args.eval_weights) + number,
            device="cpu",
        )
        agent.learn(share // n_steps * n_steps)  # whole rollouts
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
    main(__file__, MaskablePPOArgs, learn, samples=True)
