"""Pareto Conditioned Networks (Reymond et al. 2022) of morl-baselines: a policy that is told the return to reach.

    python analysis/outside/pcn.py --seed 1 --env-id boreal-balanced-v0

At a weight it is told the return of the best episode for that weight that it remembers.
"""

from dataclasses import dataclass
from typing import ClassVar

from analysis.outside.arguments import Args
from cleanrl_style.flags import parse, require

require("morl_baselines", extra="outside")


@dataclass
class PCNArgs(Args):
    """Pareto Conditioned Networks of morl-baselines on a boreal environment: trains, evaluates, leaves a run folder."""

    learning_rate: float = 1e-3
    """of Adam"""
    batch_size: int = 256
    """transitions of an update"""
    hidden_dim: int = 64
    """width of the networks"""
    return_scale: float = 0.1
    """factor of returns to come in the network's input; that of the years left is 1/50"""
    buffer_episodes: int = 100
    """episodes that are remembered"""
    num_er_episodes: int = 20
    """random episodes at the start"""
    num_step_episodes: int = 10
    """episodes between updates"""
    num_model_updates: int = 50
    """updates between episodes"""

    limits: ClassVar = {
        "batch_size": (2, 10**6),
        "buffer_episodes": (1, 10**6),
        "hidden_dim": (1, 10**5),
        "num_er_episodes": (1, 10**6),
        "num_model_updates": (1, 10**6),
        "num_step_episodes": (1, 10**6),
        "return_scale": (1e-6, 10**6),
    }


if __name__ == "__main__":
    args = parse(PCNArgs)  # a bad flag is answered before the libraries are loaded

import numpy as np
import torch
from morl_baselines.common.pareto import get_non_dominated_inds
from morl_baselines.multi_policy.pcn.pcn import PCN, DiscreteActionsDefaultModel

from analysis.outside.common import INVALID, NoEnv, Session, main, valid_actions
from cleanrl_style import protocol


def check(args, task) -> None:
    """Refuse a training of fewer steps than its first two rounds have."""
    least = (args.num_er_episodes + args.num_step_episodes) * task.years
    if args.total_timesteps < least:
        protocol.fail(f"--total-timesteps {args.total_timesteps}: at least {least}, the first two rounds of episodes")


def learn(session: Session):
    """Train; the policy is given the command that the library gives its own."""
    args, task, env = session.args, session.task, session.env()

    class Masked(DiscreteActionsDefaultModel):
        """The library's network without the probability of invalid actions."""

        def forward(self, state, desired_return, desired_horizon):
            logprobs = super().forward(state, desired_return, desired_horizon)
            mask = torch.from_numpy(valid_actions(task, state.float().numpy()))
            return torch.where(mask, logprobs, INVALID).log_softmax(dim=1)

    scaling = np.array([args.return_scale] * task.num_objectives + [1 / 50])
    agent = PCN(
        env,
        scaling_factor=scaling,
        learning_rate=args.learning_rate,
        batch_size=args.batch_size,
        hidden_dim=args.hidden_dim,
        seed=args.seed,
        device="cpu",
        log=False,
        model_class=Masked,
    )
    agent.save = lambda *_, **__: None  # it would write into the working folder
    agent.train(
        # it plays whole rounds of episodes
        args.total_timesteps - args.num_step_episodes * task.years + 1,
        NoEnv(env),
        ref_point=np.full(task.num_objectives, -100.0),
        num_er_episodes=args.num_er_episodes,
        num_step_episodes=args.num_step_episodes,
        num_model_updates=args.num_model_updates,
        max_buffer_size=args.buffer_episodes,
        num_points_pf=1,
    )
    episodes = [episode for _, _, episode in agent.experience_replay]
    returns = np.array([episode[0].reward for episode in episodes])
    returns = returns[get_non_dominated_inds(returns)]
    year = env.unwrapped.observation_names.index("year") - env.hidden

    def policy(weights, observations, masks, accrued_returns):
        wanted = returns[(weights @ returns.T).argmax(axis=1)] - accrued_returns
        left = np.maximum(task.years - np.round(50 * observations[:, [year]]), 1)
        with torch.no_grad():
            x = (torch.from_numpy(part.astype(np.float32)) for part in (observations, wanted, left))
            return agent.model(*x).exp().numpy()

    return policy


if __name__ == "__main__":
    main(__file__, args, learn, samples=True, check=check)
