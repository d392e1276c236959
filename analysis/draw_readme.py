"""Draws the pictures of README.md and docs/start.md: a stand after 35 years, and fifty years of a trained policy.

    python analysis/draw_readme.py [--policy ppo_group-balanced]

The stand is planted for twelve years and then left alone; the policy plays the same site and weather.
"""

from pathlib import Path

import gymnasium as gym
import numpy as np
import tyro
from PIL import Image

import boreal_env
from analysis.experiments import BALANCED
from cleanrl_style import protocol
from cleanrl_style.protocol import command_line

SEED, YEARS, PLANTING_YEARS = 7, 35, 12
PLANT_100_HALF_CONIFER = 22


def stand() -> Image.Image:
    """A stand 35 years after the first trees were planted."""
    env = gym.make(BALANCED, render_mode="rgb_array")
    env.reset(seed=SEED, options={"preference": 0.5})
    for year in range(YEARS):
        env.step(PLANT_100_HALF_CONIFER if year < PLANTING_YEARS else boreal_env.NO_CHANGE)
    return Image.fromarray(env.render())


def main(policy: str = "ppo_group-balanced", preference: float = 0.5, images: Path = Path("docs/images")) -> None:
    """Draw stand.png and trained_policy.gif.

    Args:
        policy: name of one that ships, or folder of a training run
        preference: weight of carbon in the animation
        images: folder of the pictures
    """
    try:
        trained = protocol.load_policy(policy)
    except (FileNotFoundError, ValueError) as error:
        protocol.fail(f"--policy {error}")
    images.mkdir(parents=True, exist_ok=True)
    with protocol.replacing(images / "stand.png") as file:
        stand().save(file, format="png")
    generator = np.random.default_rng(SEED)

    def act(observation, mask, accrued_returns):
        return trained.act(observation, mask, accrued_returns, generator)

    env = trained.task().make(render_mode="rgb_array")
    frames, _ = command_line.play(env, act, SEED, np.array([preference, 1 - preference]))
    command_line.save_animation(images / "trained_policy.gif", frames)


if __name__ == "__main__":
    tyro.cli(main)
