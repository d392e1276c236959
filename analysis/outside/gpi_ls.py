"""GPI-LS (Alegre et al. 2023) of morl-baselines: values for weights that are chosen one by one where most is missing.

    python analysis/outside/gpi_ls.py --seed 1 --env-id boreal-balanced-v0

Settings are those of the library's example of discrete actions (minecart), but gamma, one update a step, prioritised
replay and a buffer of the whole training. It chooses weights by episodes of its own evaluation, which count in no
budget; cost.csv says how many steps they were.
"""

from dataclasses import dataclass
from typing import ClassVar

from analysis.outside.arguments import Args
from cleanrl_style.flags import parse, require

require("morl_baselines", extra="outside")


@dataclass
class GPILSArgs(Args):
    """GPI-LS of morl-baselines on a boreal environment: trains, evaluates, leaves a run folder."""

    learning_rate: float = 3e-4
    """of Adam"""
    gamma: float = 0.99
    """discount factor"""
    batch_size: int = 128
    """transitions of an update"""
    gradient_updates: int = 1
    """updates a step, from step 5000 on"""
    epsilon_decay_steps: int = 50_000
    """steps in which the share of random actions falls from 1 to 0.05"""
    target_net_update_freq: int = 200
    """steps between copies of the networks to their targets"""
    timesteps_per_iter: int = 10_000
    """steps for each chosen weight"""
    own_episodes: int = 5
    """episodes of each of its own evaluations"""

    limits: ClassVar = {
        "batch_size": (2, 10**6),
        "epsilon_decay_steps": (1, 10**9),
        "gradient_updates": (1, 10**6),
        "own_episodes": (1, 10**6),
        "target_net_update_freq": (1, 10**9),
        "timesteps_per_iter": (1, 10**9),
    }


if __name__ == "__main__":
    args = parse(GPILSArgs)  # a bad flag is answered before the libraries are loaded

import numpy as np
import torch
from morl_baselines.multi_policy.gpi_pd.gpi_pd import GPILS

from analysis.outside.common import Session, best_actions, main, masked


def learn(session: Session):
    """Train; the policy takes the action of the highest scalarised value under any of the weights it has learnt."""
    args, task = session.args, session.task
    agent = GPILS(
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
        seed=args.seed,
        device="cpu",
        log=False,
    )
    for network in (*agent.q_nets, *agent.target_q_nets):
        masked(task, network)
    agent.train(
        args.total_timesteps,
        session.own_evaluation(args.own_episodes),
        ref_point=np.full(task.num_objectives, -100.0),
        timesteps_per_iter=min(args.timesteps_per_iter, args.total_timesteps),
        num_eval_episodes_for_front=args.own_episodes,
        checkpoints=False,
    )
    network = agent.q_nets[0].eval()

    def policy(weights, observations, masks, accrued_returns):
        w, x = torch.from_numpy(weights).float(), torch.from_numpy(observations)
        with torch.no_grad():
            values = [network(x, support.expand_as(w)) for support in agent.weight_support]
        return best_actions(torch.stack([torch.einsum("nr,nar->na", w, one) for one in values]).amax(dim=0).numpy())

    return policy


if __name__ == "__main__":
    main(__file__, args, learn, samples=False)
