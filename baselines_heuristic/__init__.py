"""Fixed strategies of the paper, each a function of the observations, and the command line they share."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from cleanrl_style import protocol


@dataclass
class Args:
    """Evaluates a strategy that does not learn under the protocol of the trained agents and leaves a run folder."""

    seed: int = 1
    """names the run's folder: the strategy has nothing random, and its episodes are always the same"""
    env_id: str | None = None
    """boreal-generalist-v0, boreal-balanced-v0 or boreal-site-specific-v0 (None: the mode's)"""
    mode: Literal["generalist", "site-specific"] | None = None
    """a new site and weather in every episode, or one fixed site (None: the environment's)"""
    site_seed: int | None = None
    """another fixed site in site-specific mode; in generalist mode one site, under new weather in every episode"""
    thaw_formulation: Literal["asymmetric", "contrast", "raw_degree_days"] = "asymmetric"
    """formula of the thaw reward"""
    eval_episodes: int = 100
    """evaluation episodes per weight"""
    eval_weights: tuple[float, ...] = protocol.EVAL_WEIGHTS
    """carbon weights of the evaluation"""
    run_dir: str | None = None
    """folder of the run (None: runs/<script>/<env-id>[-<what is not default>]/seed<seed>)"""
    overwrite: bool = False
    """start over in a folder that already holds a run"""


def main(script: str, policy) -> None:
    """Evaluate `policy`, a function of observations (n, d) and masks (n, 25), as the script of that name.

    It gives actions (n,), or probabilities of actions (n, 25), and does not look at the preference: its episodes
    are the same under every weight, and are simulated once. None has another policy when greedy: random actions
    stay random.
    """
    args = protocol.parse(Args)
    env_kwargs = protocol.prepare(args)
    if args.env_id not in protocol.MODES:
        protocol.fail(f"--env-id must be one of {', '.join(protocol.MODES)}, not {args.env_id}")

    def action_probabilities(observations, masks, accrued_returns):
        chosen = policy(observations, masks)
        return np.eye(25)[chosen] if chosen.ndim == 1 else chosen

    with protocol.Run(args, Path(script).stem) as run:
        start = time.perf_counter()
        episodes, years = protocol.evaluate(args, env_kwargs, action_probabilities, (0.0,), ("sampled",))
        run.time("evaluation", 0, time.perf_counter() - start)
        run.finish(repeat(episodes, args.eval_weights), repeat(years, args.eval_weights))


def repeat(table: pd.DataFrame, weights) -> pd.DataFrame:
    """The table once for every policy and weight, scalarised anew."""
    copies = [table.assign(policy=policy, preference=weight) for policy in protocol.POLICIES for weight in weights]
    repeated = pd.concat(copies, ignore_index=True)
    if "scalarized_return" in repeated:
        repeated["scalarized_return"] = protocol.scalarize(
            repeated.carbon_return, repeated.thaw_return, repeated.preference
        )
    return repeated
