"""MORL/D (Felten et al. 2024) of morl-baselines: soft actor-critics of several weights that share what they have seen.

    python analysis/outside/morld.py --seed 1 --env-id boreal-balanced-v0

Settings are those of the library's example of discrete actions (lunar lander), but fewer episodes an
evaluation. At a weight the policy is the best of its archive by its own evaluation, of discounted returns, which counts
in no budget; cost.csv says how many steps it was.
"""

from dataclasses import dataclass
from typing import ClassVar

from analysis.outside.arguments import Args
from cleanrl_style.flags import fail, parse, require

require("morl_baselines", extra="outside")


@dataclass
class MORLDArgs(Args):
    """MORL/D of morl-baselines on a boreal environment: trains, evaluates, leaves a run folder."""

    pop_size: int = 6
    """policies, of weights that are spread evenly at the start"""
    exchange_every: int = 5000
    """steps of one policy before the next; an evaluation of all follows"""
    gamma: float = 0.99
    """discount factor"""
    batch_size: int = 128
    """transitions of an update"""
    learning_starts: int = 20_000
    """steps before the first update, by random actions"""
    target_entropy_scale: float = 0.3
    """aim of the policies' entropy, in that of 25 equal actions"""

    limits: ClassVar = {
        "batch_size": (2, 10**6),
        "exchange_every": (1, 10**9),
        "learning_starts": (1, 10**9),
        "pop_size": (2, 1000),
        "target_entropy_scale": (0, 1),
    }


if __name__ == "__main__":
    args = parse(MORLDArgs)  # a bad flag is answered before the libraries are loaded

import numpy as np
import torch
from morl_baselines.common.buffer import ReplayBuffer
from morl_baselines.multi_policy.morld.morld import MORLD

from analysis.outside.common import Session, main, masked

OWN_EPISODES = 5  # of each of its own evaluations: the library takes no other number


class SharedBuffer(ReplayBuffer):
    """One for all policies. The archive copies policies, with which go copies of the buffer, hundreds of megabytes."""

    def __deepcopy__(self, memo):
        return self


def learn(session: Session):
    """Train; the policy at a weight is the one of the archive with the highest scalarised return."""
    args, task, env = session.args, session.task, session.env()
    agent = MORLD(
        env,
        policy_name="MOSACDiscrete",
        policy_args={
            "target_net_freq": 200,
            "batch_size": args.batch_size,
            "buffer_size": 1,  # replaced below
            "net_arch": [256, 256, 256, 256],
            "update_frequency": 1,
            "target_entropy_scale": args.target_entropy_scale,
            "learning_starts": args.learning_starts,
            "device": "cpu",
        },
        gamma=args.gamma,
        pop_size=args.pop_size,
        seed=args.seed,
        exchange_every=min(args.exchange_every, args.total_timesteps),
        shared_buffer=True,
        weight_adaptation_method="PSA",
        log=False,
        device="cpu",
    )
    buffer = SharedBuffer(env.observation_space.shape, 1, task.num_objectives, args.total_timesteps)
    for one in agent.population:
        one.wrapped.set_buffer(buffer)
        masked(task, one.wrapped.actor)
    agent.close_wandb = lambda: None
    agent.train(
        args.total_timesteps,
        session.own_evaluation(OWN_EPISODES),
        ref_point=np.full(task.num_objectives, -100.0),
        num_eval_episodes_for_front=1,
        checkpoints=False,
    )
    values = np.array(agent.archive.evaluations)
    actors = [one.wrapped.actor for one in agent.archive.individuals]

    def policy(weights, observations, masks, accrued_returns):
        chosen = (weights @ values.T).argmax(axis=1)
        probabilities = np.empty((len(observations), 25))
        for k in np.unique(chosen):
            with torch.no_grad():
                logits = actors[k](torch.from_numpy(observations[chosen == k]))
            probabilities[chosen == k] = logits.softmax(dim=1).numpy()
        return probabilities

    return policy


def check(args: MORLDArgs, task) -> None:
    """Refuse a budget that the last of its rounds would exceed."""
    if args.total_timesteps % min(args.exchange_every, args.total_timesteps):
        fail(
            f"--total-timesteps {args.total_timesteps}: a multiple of --exchange-every {args.exchange_every} is allowed"
        )


if __name__ == "__main__":
    main(__file__, args, learn, samples=True, check=check)
