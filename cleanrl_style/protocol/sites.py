"""The episodes of an evaluation: published sites, the same for every method (docs/planners.md has all splits)."""

import csv
import functools
from importlib.resources import files

import numpy as np

from cleanrl_style.flags import FIRST_EVALUATION_SEED
from cleanrl_style.protocol.task import Task

SPLITS = ("test", "validation")  # results are of the first; variants are chosen on the second
#: First seed of each, where the task draws no sites.
FIRST_OF = {"test": FIRST_EVALUATION_SEED, "validation": 2 * FIRST_EVALUATION_SEED}
TABLE = "evaluation_sites.csv"  # written by analysis/choose_sites.py


@functools.cache
def published_seeds(split: str) -> tuple[int, ...]:
    """Seeds of a split's episodes, of which every beginning is balanced."""
    rows = csv.DictReader((files("cleanrl_style.protocol") / TABLE).read_text(encoding="utf-8").splitlines())
    return tuple(int(row["seed"]) for row in rows if row["split"] == split)


def of_split(task: Task, episodes: int, split: str) -> tuple[Task, list[int]]:
    """The task of a split's episodes, and what its environments are reset with.

    A split is one of `SPLITS`, or one of the task's `shifts`: the test sites, one property of which is moved out of the
    range that sites are drawn from. Raises ValueError as `evaluation_seeds`.
    """
    if split in task.shifts:
        return task.shifted(split), evaluation_seeds(task, episodes)
    return task, evaluation_seeds(task, episodes, split)


def evaluation_seeds(task: Task, episodes: int, split: str = "test") -> list[int]:
    """What the environments of an evaluation are reset with, a seed an episode.

    The first published sites where the task draws sites, else new weathers of its own site, other ones for each split
    (site-specific there is but one). Raises ValueError for an unknown split, for no episode, and for more than a split
    has sites.
    """
    if isinstance(episodes, bool) or not isinstance(episodes, (int, np.integer)) or episodes < 1:
        raise ValueError(f"{episodes} episodes: a whole number, 1 or more, is allowed")
    if split not in SPLITS:
        raise ValueError(f"split {split!r}: allowed are {', '.join((*SPLITS, *task.shifts))}")
    if not task.draws_sites:
        return [FIRST_OF[split] + episode for episode in range(episodes)]
    seeds = published_seeds(split)
    if episodes > len(seeds):
        raise ValueError(f"{episodes} episodes: the {split} split has {len(seeds)} sites")
    return list(seeds[:episodes])
