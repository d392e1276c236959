"""Envelope Q-learning (Yang et al. 2019) of morl-baselines: values of each action in each objective, for all weights.

    python analysis/outside/envelope.py --seed 1 --env-id boreal-balanced-v0

Settings are those of the library's example of discrete actions (minecart), but gamma.
"""

from dataclasses import dataclass
from typing import ClassVar

from analysis.outside.arguments import Args
from cleanrl_style.flags import parse, require

require("morl_baselines", extra="outside")


@dataclass
class EnvelopeArgs(Args):
    """Envelope Q-learning of morl-baselines on a boreal environment: trains, evaluates, leaves a run folder."""

    learning_rate: float = 3e-4
    """of Adam"""
    gamma: float = 0.99
    """discount factor"""
    batch_size: int = 64
    """transitions of an update, each for four weights"""
    gradient_updates: int = 1
    """updates a step"""
    epsilon_decay_steps: int = 50_000
    """steps in which the share of random actions falls from 1 to 0.05"""
    target_net_update_freq: int = 1000
    """steps between copies of the network to its target"""
    homotopy_decay_steps: int = 10_000
    """steps in which the loss goes from the vector's to the scalarised"""

    limits: ClassVar = {
        "batch_size": (2, 10**6),
        "epsilon_decay_steps": (1, 10**9),
        "gradient_updates": (1, 10**6),
        "homotopy_decay_steps": (1, 10**9),
        "target_net_update_freq": (1, 10**9),
    }


if __name__ == "__main__":
    args = parse(EnvelopeArgs)  # a bad flag is answered before the libraries are loaded

import torch
from morl_baselines.multi_policy.envelope.envelope import Envelope

from analysis.outside.common import Session, best_actions, main, masked


def learn(session: Session):
    """Train; the policy takes the action of the highest scalarised value."""
    args, task = session.args, session.task
    agent = Envelope(
        session.env(),
        learning_rate=args.learning_rate,
        initial_epsilon=1.0,
        final_epsilon=0.05,
        epsilon_decay_steps=args.epsilon_decay_steps,
        target_net_update_freq=args.target_net_update_freq,
        buffer_size=args.total_timesteps,
        batch_size=args.batch_size,
        gradient_updates=args.gradient_updates,
        gamma=args.gamma,
        max_grad_norm=0.1,
        homotopy_decay_steps=args.homotopy_decay_steps,
        seed=args.seed,
        device="cpu",
        log=False,
    )
    for network in (agent.q_net, agent.target_q_net):
        masked(task, network)
    agent.train(args.total_timesteps)

    def policy(weights, observations, masks, accrued_returns):
        w = torch.from_numpy(weights).float()
        with torch.no_grad():
            values = agent.q_net(torch.from_numpy(observations), w)
        return best_actions(torch.einsum("nr,nar->na", w, values).numpy())

    return policy


if __name__ == "__main__":
    main(__file__, args, learn, samples=False)
