"""The arguments that all the commands have. It loads nothing slow, so that a bad flag is answered at once."""

from dataclasses import dataclass
from typing import ClassVar, Literal


@dataclass
class Args:
    """What every command is asked."""

    seed: int = 1
    """seed of the run: networks, sampling and training episodes"""
    env_id: str | None = None
    """a boreal environment of two or more objectives (None: the mode's)"""
    mode: Literal["generalist", "site-specific"] | None = None
    """a new site and weather in every episode, or one fixed site (None: the environment's)"""
    site_seed: int | None = None
    """another fixed site in site-specific mode; in generalist mode one site, under new weather in every episode"""
    thaw_formulation: Literal["asymmetric", "contrast", "raw_degree_days"] | None = None
    """formula of the thaw reward (None: the environment's, asymmetric)"""
    total_timesteps: int | None = None
    """steps of training (None: 300000, in site-specific mode 100000)"""
    eval_episodes: int = 200
    """evaluation episodes per weight, each on another site (of one site: in another weather)"""
    eval_weights: tuple[float, ...] | None = None
    """carbon weights of the evaluation (None: 0 0.25 .. 1); of three and more objectives, as many numbers a weight"""
    run_dir: str | None = None
    """folder of the run (None: runs/<script>/<env-id>[-<what is not default>]/seed<seed>)"""
    overwrite: bool = False
    """start over in a folder that already holds a run"""

    num_envs: ClassVar[int] = 1  # morl-baselines steps one
    trial: ClassVar = (2000, "half an hour to eight hours")  # what `--help` says
    left: ClassVar = """A stopped run starts over.
The folder gets config.json, episodes.csv, cost.csv, evaluation.csv and summary.png, which docs/outside.md explains"""
