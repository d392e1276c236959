"""Draws the README's pictures: a stand after 35 years, and fifty years of a policy as an animation.

    python analysis/draw_readme.py [--run-dir runs/ppo_group/boreal-balanced-v0-vectorization=lockstep/seed1]

The stand is planted for twelve years and then left alone. The animation is of conifer restoration, or of the trained
policy of a run, which plays the same site and weather.
"""

from pathlib import Path

import gymnasium as gym
import numpy as np
import tyro
from PIL import Image

import boreal_env
from analysis.experiments import GENERALIST
from baselines_heuristic import conifer_restoration
from cleanrl_style import protocol
from cleanrl_style.protocol import command_line

SEED, YEARS, PLANTING_YEARS = 11, 35, 12
PLANT_100_HALF_CONIFER = 22


def stand() -> Image.Image:
    """A stand 35 years after the first trees were planted."""
    env = gym.make(GENERALIST, render_mode="rgb_array")
    env.reset(seed=SEED, options={"preference": 0.5})
    for year in range(YEARS):
        env.step(PLANT_100_HALF_CONIFER if year < PLANTING_YEARS else boreal_env.NO_CHANGE)
    return Image.fromarray(env.render())


def main(run_dir: Path | None = None, preference: float = 0.5, images: Path = Path("docs/images")) -> None:
    """Draw stand.png and conifer_restoration.gif; with a run, its policy as trained_policy.gif instead.

    Args:
        run_dir: folder of a training run, whose agent is played
        preference: weight of carbon in the animation
        images: folder of the pictures
    """
    images.mkdir(parents=True, exist_ok=True)
    if run_dir is None:
        with protocol.replacing(images / "stand.png") as file:
            stand().save(file, format="png")

        def act(observation, mask, accrued_returns):
            return int(conifer_restoration.policy(observation[None], mask[None])[0])

        env, name = gym.make(GENERALIST, render_mode="rgb_array"), "conifer_restoration"
    else:
        policy, generator = trained_policy(run_dir), np.random.default_rng(SEED)

        def act(observation, mask, accrued_returns):
            return policy.act(observation, mask, accrued_returns, generator)

        env, name = policy.task().make(render_mode="rgb_array"), "trained_policy"
    frames, _ = command_line.play(env, act, SEED, np.array([preference, 1 - preference]))
    command_line.save_animation(images / f"{name}.gif", frames)


def trained_policy(run_dir: Path) -> protocol.Policy:
    """The policy of a run."""
    try:
        return protocol.load_policy(run_dir)
    except FileNotFoundError as error:
        protocol.fail(f"--run-dir {run_dir}: {error}")


if __name__ == "__main__":
    tyro.cli(main)
