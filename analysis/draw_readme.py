"""Draws the README's pictures: a stand after 35 years, and fifty years of a policy as an animation.

    python analysis/draw_readme.py [--run-dir runs/ppo_curriculum/boreal-generalist-v0/seed1]

The stand is planted for twelve years and then left alone. The animation is of conifer restoration, or of the trained
policy of a run, which plays the same site and weather.
"""

import json
from collections.abc import Callable
from pathlib import Path

import gymnasium as gym
import numpy as np
import tyro
from PIL import Image

import boreal_env
from analysis.experiments import GENERALIST
from baselines_heuristic import conifer_restoration
from cleanrl_style import protocol
from cleanrl_style.protocol.evaluation import choose_actions

SEED, YEARS, PLANTING_YEARS = 11, 35, 12
PLANT_100_HALF_CONIFER = 22
FRAME_MS, LAST_FRAME_MS = 200, 3000
FRAME_SIZE = (640, 400)  # pixels

#: Actions (n,) of observations (n, d), masks (n, 25) and accrued returns (n, 2).
Policy = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def stand() -> Image.Image:
    """A stand 35 years after the first trees were planted."""
    env = gym.make(GENERALIST, render_mode="rgb_array")
    env.reset(seed=SEED, options={"preference": 0.5})
    for year in range(YEARS):
        env.step(PLANT_100_HALF_CONIFER if year < PLANTING_YEARS else boreal_env.NO_CHANGE)
    return Image.fromarray(env.render())


def frames(policy: Policy, env_id: str, preference: float) -> list[Image.Image]:
    """An episode of a policy, a frame a year."""
    env = gym.make(env_id, render_mode="rgb_array")
    observation, _ = env.reset(seed=SEED, options={"preference": preference})
    pictures, accrued, terminated = [env.render()], np.zeros(2, np.float32), False
    while not terminated:
        masks = env.unwrapped.action_masks()
        action = policy(observation[None], masks[None], accrued[None])[0]
        observation, reward, terminated, _, _ = env.step(action)
        accrued += reward
        pictures.append(env.render())
    return [Image.fromarray(picture).resize(FRAME_SIZE, Image.Resampling.LANCZOS) for picture in pictures]


def trained_policy(run_dir: Path) -> tuple[Policy, str]:
    """The sampled policy of a run, and the id of its environment."""
    try:
        probabilities = protocol.load_agent(run_dir)
    except FileNotFoundError as error:
        protocol.fail(f"--run-dir {run_dir}: {error}")
    config = json.loads((run_dir / "config.json").read_text(encoding="utf-8"))
    generator = np.random.default_rng(SEED)

    def policy(observations, masks, accrued_returns):
        return choose_actions(probabilities(observations, masks, accrued_returns), generator.random(len(masks)))

    return policy, config["arguments"]["env_id"]


def save_animation(path: Path, pictures: list[Image.Image]) -> None:
    """An animated GIF that stays on its last picture for a while; the colours are those of its first and last."""
    colours = Image.fromarray(np.concatenate([pictures[0], pictures[-1]])).quantize(256)
    indexed = [picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in pictures]
    durations = [FRAME_MS] * (len(indexed) - 1) + [LAST_FRAME_MS]
    frames = {"save_all": True, "append_images": indexed[1:], "duration": durations, "loop": 0}
    with protocol.replacing(path) as file:
        indexed[0].save(file, format="gif", **frames, optimize=True)


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

        def heuristic(observations, masks, accrued_returns):
            return conifer_restoration.policy(observations, masks)

        pictures = frames(heuristic, GENERALIST, preference)
        save_animation(images / "conifer_restoration.gif", pictures)
    else:
        save_animation(images / "trained_policy.gif", frames(*trained_policy(run_dir), preference))


if __name__ == "__main__":
    tyro.cli(main)
