"""Draws the README's picture of a stand: docs/images/stand.png.

    python analysis/draw_readme.py [--path docs/images/stand.png]

A mixed stand is planted for twelve years and then left alone.
"""

from pathlib import Path

import gymnasium as gym
import tyro
from PIL import Image

import boreal_env

SEED, YEARS, PLANTING_YEARS = 11, 35, 12
PLANT_100_HALF_CONIFER = 22


def main(path: Path = Path("docs/images/stand.png")) -> None:
    """Draw a stand after 35 years.

    Args:
        path: file of the picture
    """
    env = gym.make("boreal-generalist-v0", render_mode="rgb_array")
    env.reset(seed=SEED, options={"preference": 0.5})
    for year in range(YEARS):
        env.step(PLANT_100_HALF_CONIFER if year < PLANTING_YEARS else boreal_env.NO_CHANGE)
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(env.render()).save(path)


if __name__ == "__main__":
    tyro.cli(main)
