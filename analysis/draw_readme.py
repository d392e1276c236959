"""Draws the pictures of README.md and docs/start.md: a stand after 35 years, and fifty years of a trained policy.

    python analysis/draw_readme.py [--policy ppo_group-balanced]

The stand is planted for twelve years and then left alone; the policy plays the same site and weather.
"""

from dataclasses import dataclass
from pathlib import Path

import gymnasium as gym
import numpy as np
from PIL import Image

import boreal_env
from analysis import paths
from analysis.experiments import BALANCED
from cleanrl_style import protocol
from cleanrl_style.protocol import command_line

SEED, YEARS, PLANTING_YEARS = 7, 35, 12
PLANT_100_HALF_CONIFER = 22


@dataclass
class Args:
    """Draws stand.png and trained_policy.gif."""

    policy: str = "ppo_group-balanced"
    """name of one that ships, or folder of a training run"""
    preference: float = 0.5
    """weight of carbon in the animation"""
    images: Path = Path("docs/images")
    """folder of the pictures"""


def stand() -> Image.Image:
    """A stand 35 years after the first trees were planted."""
    env = gym.make(BALANCED, render_mode="rgb_array")
    env.reset(seed=SEED, options={"preference": 0.5})
    for year in range(YEARS):
        env.step(PLANT_100_HALF_CONIFER if year < PLANTING_YEARS else boreal_env.NO_CHANGE)
    return Image.fromarray(env.render())


def main(args: Args) -> None:
    """Draw both."""
    images = args.images
    paths.make_writable("--images", images)
    try:
        trained = protocol.load_policy(args.policy)
    except (FileNotFoundError, ValueError) as error:
        protocol.fail(f"--policy {error}")
    with protocol.replacing(images / "stand.png") as file:
        stand().save(file, format="png")
    generator = np.random.default_rng(SEED)

    def act(observation, mask, accrued_returns):
        return trained.act(observation, mask, accrued_returns, generator)

    env = trained.task().make(render_mode="rgb_array")
    frames, _ = command_line.play(env, act, SEED, np.array([args.preference, 1 - args.preference]))
    command_line.save_animation(images / "trained_policy.gif", frames)


if __name__ == "__main__":
    main(protocol.parse(Args))
