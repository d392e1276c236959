"""Returns of doing nothing on the episodes that agents train on, so that learning curves can show gains.

    python analysis/studies/training_gains.py

A training episode's return is mostly its site's and weather's; less that of zero change on the same site and weather
it is the policy's. Runs with the same seed and number of environments train on the same episodes; of these every
EVERY-th round (an episode in each environment) is played again without management. Leaves
results/studies/training_gains.csv, one row an episode; a stream of episodes that is there is not played again.
"""

import contextlib
import sys
from dataclasses import dataclass

import gymnasium as gym
import numpy as np
import pandas as pd

import boreal_env
from analysis import metrics, results, stored
from analysis.experiments import GENERALIST
from analysis.methods import LEARNERS
from analysis.reduction import EVERY
from analysis.studies import open_loop
from cleanrl_style import protocol

STREAM = ["num_envs", "seed"]  # what fixes the episodes of a training in generalist mode
EPISODE = [*STREAM, "env", "global_step"]


@dataclass
class Args:
    """Plays zero change on the training episodes of the main experiment's runs."""

    quick: bool = False
    """of the runs of `reproduce.py --quick`, into results/quick/studies"""


def streams(found: results.Results) -> dict[tuple[int, int], int]:
    """(number of environments, training seed) of the main experiment's runs -> steps; groups, whose stands share their
    episodes, are left out."""
    runs = [one.runs[0] for script in LEARNERS for one in found.of("main", script)]
    runs = [run for run in runs if run.arguments.get("group_size", 1) == 1]
    return {tuple(run.arguments[name] for name in STREAM): run.arguments["total_timesteps"] for run in runs}


def play(num_envs: int, seed: int, steps: int, every: int = EVERY) -> pd.DataFrame:
    """Both returns of zero change on every `every`-th round of a training's episodes."""
    tables = []
    years = boreal_env.DEFAULT_YEARS
    rounds = steps // (years * num_envs)
    progress = protocol.Progress(f"{num_envs} environments, seed {seed}", rounds, "rounds")
    nothing = np.full(num_envs, boreal_env.NO_CHANGE)
    with contextlib.closing(gym.make_vec(GENERALIST, num_envs=num_envs)) as envs:
        first = seed * protocol.MAX_ENVS
        envs.reset(seed=[first + i for i in range(num_envs)])
        for number in range(1, rounds + 1):
            if number % every:
                envs.reset()  # the next episode of each stream, as at an episode's end
                continue
            returns = sum(envs.step(nothing)[1].astype(float) for _ in range(years))
            tables.append(
                pd.DataFrame(
                    {
                        "num_envs": num_envs,
                        "seed": seed,
                        "env": np.arange(num_envs),
                        "global_step": number * years * num_envs,
                        "carbon_return": returns[:, 0],
                        "thaw_return": returns[:, 1],
                    }
                )
            )
            progress.show(number, number == rounds)
    return pd.concat(tables, ignore_index=True)


def gains(run, nothing: pd.DataFrame) -> pd.DataFrame | None:
    """A run's training episodes that were played without management too, less these; None if none was.

    nothing : the study's table. Columns: global_step, carbon_gain, thaw_gain, scalarized_gain.
    """
    keys = {name: run.arguments[name] for name in STREAM}
    both = run.tables["sample"].assign(**keys).merge(nothing, on=EPISODE, suffixes=("", "_nothing"))
    if both.empty:
        return None
    names = ("carbon", "thaw")
    gained = np.column_stack([both[f"{name}_return"] - both[f"{name}_return_nothing"] for name in names])
    table = pd.DataFrame(gained, columns=[f"{name}_gain" for name in names])
    scalarized = protocol.scalarize(gained, metrics.pair(both.preference))
    return table.assign(global_step=both.global_step, scalarized_gain=scalarized)


def main(args: Args) -> None:
    """Play the streams of episodes that the table lacks."""
    found = results.Results.load(args.quick)
    wanted = streams(found)
    if not wanted:
        sys.exit(f"error: no finished run; {found.first_job('main', LEARNERS[0]).command} makes the first")
    every = 1 if args.quick else EVERY
    path = found.studies_dir / "training_gains.csv"
    settings = {"every": every, "physics": open_loop.fingerprint()}
    table = stored.read(path) if stored.is_finished(path, settings) else pd.DataFrame(columns=EPISODE)
    known = set(zip(table.num_envs, table.seed, strict=True))
    for (num_envs, seed), steps in sorted(wanted.items()):
        if (num_envs, seed) not in known:
            new = play(num_envs, seed, steps, every)
            table = (pd.concat([table, new]) if len(table) else new).sort_values(EPISODE)
            stored.write(path, table, settings)
    print(f"{path}: {len(wanted)} streams of training episodes")


if __name__ == "__main__":
    main(protocol.parse(Args))
