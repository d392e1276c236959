"""The course of a training: what the greedy policy gains on a few validation sites, at fixed shares of the training.

A training episode's return is mostly its site's and its weather's. Here every point is of the same episodes, which no
training has, less what doing nothing returns on them.
"""

import contextlib
from functools import cached_property

import numpy as np
import pandas as pd

from cleanrl_style.protocol.compilation import compile_physics
from cleanrl_style.protocol.evaluation import lanes_of, make_envs, play
from cleanrl_style.protocol.fronts import return_columns, weight_columns
from cleanrl_style.protocol.reference import NOTHING, PLUS_100, reference_returns
from cleanrl_style.protocol.score import at_weights, best_constant_plans, by_weight, gains, percent
from cleanrl_style.protocol.sites import evaluation_seeds
from cleanrl_style.protocol.task import Task

SHARES = (0.05, 0.1, 0.2, 0.4, 0.7)  # of the training's steps, and at its end: all in all 9,000 years of stands
FEW_SHARES = (0.2, 0.7)  # of a training too short for these: 4,500 years
LONGEST = 0.2  # share of a training's steps that its course may take in years of stands; the shortest have none
STANDS = 30  # that are played: of two objectives 10 sites at 3 weights. They fill two blocks of the evaluation's kernel


def gain_columns(objectives) -> list[str]:
    """Columns of the gains in validation.csv."""
    return [f"{name}_gain" for name in (*objectives, "scalarized")]


class Course:
    """When the policy is played in the course of a training, on what, and what it gains there."""

    def __init__(self, task: Task, steps: int, episodes: int, done: int):
        """steps: of the training; episodes: at most so many sites; done: steps of an earlier process."""
        self.task, self.steps, self.done = task, steps, done
        number = task.num_objectives
        spread = np.vstack([np.eye(number), np.full(number, 1 / number)])
        self.weights = np.unique(spread if task.preference is None else task.preference[None], axis=0)
        one = task.mode == "site-specific"  # where all greedy episodes of a weight are the same
        sites = 1 if one else min(STANDS // len(self.weights), episodes)
        self.seeds = evaluation_seeds(task, sites, "validation")
        self.columns = ("global_step", *weight_columns(task.objectives), *gain_columns(task.objectives))
        self.shares = SHARES if self._fits(SHARES) else FEW_SHARES

    @property
    def fits(self) -> bool:
        """Whether the training is long enough to be worth its course."""
        return self._fits(self.shares)

    @property
    def where(self) -> str:
        """What it is played on, in words."""
        if self.task.mode == "site-specific":
            return "its site"
        number = len(self.seeds)
        what = "validation site" if self.task.draws_sites else "weather"
        return f"{number} {what}{'s'[: number > 1]}"

    @property
    def years(self) -> int:
        """Years of stands that it takes to play it once."""
        return len(self.seeds) * len(self.weights) * self.task.years

    def _fits(self, shares) -> bool:
        return (len(shares) + 1) * self.years <= LONGEST * self.steps

    @property
    def lanes(self) -> set[int]:
        """Lanes of the kernels that it needs."""
        return lanes_of(self.task, len(self.seeds) * len(self.weights))

    @cached_property
    def plans(self) -> pd.DataFrame:
        """Returns of the constant plans on its episodes."""
        return reference_returns(self.task, self.seeds)

    def reach(self, global_step: int, last: bool) -> bool:
        """Note how far the training is; returns whether it has passed one of the shares since, or is at its end."""
        before, self.done = self.done, global_step
        return last or any(before < share * self.steps <= global_step for share in self.shares)

    def play(self, policy) -> pd.DataFrame:
        """Mean gains of the greedy policy, a row a weight: the columns of validation.csv but the first."""
        seeds = np.repeat(self.seeds, len(self.weights)).tolist()
        weights = np.tile(self.weights, (len(self.seeds), 1))
        compile_physics(self.lanes)
        with contextlib.closing(make_envs(self.task, len(seeds))) as envs:
            returns, _ = play(self.task, envs, policy, weights, seeds, np.ones(len(seeds), dtype=bool))
        rows = [
            {"seed": seed, **self.task.returns_row(*one)} for seed, *one in zip(seeds, weights, returns, strict=True)
        ]
        return self.means(pd.DataFrame(rows))

    def means(self, episodes: pd.DataFrame) -> pd.DataFrame:
        """Mean gains of episodes, a row a weight."""
        objectives = self.task.objectives
        gained = gains(episodes, self.plans[self.plans.plan == NOTHING], self.task.utility)
        table = by_weight(gained)[[*return_columns(objectives), "scalarized_return"]].mean()
        return table.set_axis(gain_columns(objectives), axis=1).reset_index()

    @cached_property
    def marks(self) -> dict[str, pd.DataFrame]:
        """Mean gains of what does not look: of 100 stems a year, and of the best constant plan of each weight."""
        utility, plus_100 = self.task.utility, self.plans[self.plans.plan == PLUS_100]
        return {
            "plus_100": self.means(at_weights(plus_100, self.weights, utility)),
            "best": self.means(best_constant_plans(self.plans, self.weights, utility)),
        }

    def score(self, gained: pd.DataFrame) -> float:
        """The score of mean gains, a row a weight; NaN where no constant plan gains anything."""
        return percent(gained.scalarized_gain.mean(), self.marks["best"].scalarized_gain.mean())
