"""How much plans gain that change every ten years, to one who knows neither site nor dice.

    python analysis/studies/decade_plans.py      # twenty minutes on two idle cores

At each weight a search begins with the constant plan that is best on average over sampled sites. Block by block, from
the last ten years to the first, it takes the action that is best there, all else held, and ends after a round that
changes nothing. Every site has its own weather and dice, the same for all plans. What is found is then held against the
constant plan on other sites. Leaves results/studies/decade_plans/<task>.csv, a row a weight, and weight "all", in which
gains are scores: 100 is the constant plan of each weight.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

import boreal_env
from analysis import paths, stored
from analysis.studies import genes, site_choice
from analysis.studies.site_choice import ALL, REPETITIONS, TASKS, YEARS
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts

BLOCK_YEARS = 10
FIRST_SITE, FIRST_DIE = 10_000, 1_000_000  # no other study has these sites, nor these dice
#: Actions that differ: to do nothing, and four changes of density with five conifer shares each.
ACTIONS = tuple(int(action) for action in genes.plans(genes.constant_genes(1), 1, 1)[:, 0])

Plan = tuple[int, ...]  # an action for each block of years


class Design(NamedTuple):
    """Sites that are searched on and others that judge, and the length of an episode and of a block."""

    sites: int
    judging: int
    years: int
    block_years: int


@dataclass
class Args:
    """Measures what changing the plan every ten years is worth without looking."""

    sites: int = 128
    """sampled sites that the search plays on"""
    judging: int = 512
    """other sites, that what it finds is judged on"""
    tasks: tuple[str, ...] = tuple(TASKS)
    """ids of the environments"""
    quick: bool = False
    """2 sites, 2 others, 2 years, a plan that changes every year: to see that it runs, into results/quick/studies"""


class Played:
    """Returns of plans on `sites` sites from number `first` on, each plan played once."""

    def __init__(self, task: str, first: int, sites: int, design: Design):
        self.task, self.block_years = task, design.block_years
        self.dice = {site: [FIRST_DIE + site] for site in range(FIRST_SITE + first, FIRST_SITE + first + sites)}
        self.returns: dict[Plan, np.ndarray] = {}
        self.nothing = (boreal_env.NO_CHANGE,) * (design.years // design.block_years)

    def gains(self, plans: list[Plan], weight: float) -> np.ndarray:
        """Scalarised gains over doing nothing, (plans, sites)."""
        new = [plan for plan in dict.fromkeys([self.nothing, *plans]) if plan not in self.returns]
        if new:
            actions = np.repeat(new, self.block_years, axis=1)
            played = site_choice.play(self.task, self.dice, actions, lambda: None)
            self.returns |= dict(zip(new, played[:, :, 0], strict=True))
        gains = np.array([self.returns[plan] for plan in plans]) - self.returns[self.nothing]
        return weight * gains[..., 0] + (1 - weight) * gains[..., 1]


def best(played: Played, plans: list[Plan], weight: float) -> Plan:
    """The plan with the largest mean gain, the first of equal ones."""
    return plans[int(played.gains(plans, weight).mean(axis=1).argmax())]


def search(played: Played, weight: float, say=lambda text: None) -> tuple[Plan, Plan]:
    """The best constant plan at a weight, and the plan that no other action in any one block betters."""
    blocks = len(played.nothing)
    constant = plan = best(played, [(action,) * blocks for action in ACTIONS], weight)
    before = None
    while plan != before:
        before = plan
        for block in reversed(range(blocks)):
            say(f"weight {weight:g}, years {block * played.block_years}-: {' '.join(map(str, plan))}")
            plan = best(played, [plan, *(plan[:block] + (action,) + plan[block + 1 :] for action in ACTIONS)], weight)
    return constant, plan


def summarise(found: list[tuple[float, Plan, Plan]], gains: np.ndarray) -> list[dict]:
    """A row a weight and one of scores, with 95 % intervals over sites.

    found : weight, constant plan and plan by blocks; gains : scalarised, of both on other sites, (weights, 2, sites).
    """
    sites = gains.shape[2]
    drawn = np.random.default_rng(0).integers(sites, size=(REPETITIONS, sites))
    rows = []
    for (weight, constant, plan), table in zip(found, gains, strict=True):
        more = table[1] - table[0]
        low, high = np.percentile(more[drawn].mean(axis=1), [2.5, 97.5])
        row = {"weight": weight, "constant": " ".join(map(str, constant)), "plan": " ".join(map(str, plan))}
        row |= {"constant_gain": table[0].mean(), "plan_gain": table[1].mean()}
        rows.append(row | {"more": more.mean(), "more_low": low, "more_high": high})
    constant, plan = gains.mean(axis=0)
    low, high = np.percentile(100 * plan[drawn].mean(axis=1) / constant[drawn].mean(axis=1) - 100, [2.5, 97.5])
    score = 100 * plan.mean() / constant.mean()
    row = {"weight": ALL, "constant": "", "plan": "", "constant_gain": 100.0, "plan_gain": score}
    return [*rows, row | {"more": score - 100, "more_low": low, "more_high": high}]


def study(task: str, design: Design) -> list[dict]:
    """Search at every weight, and judge on other sites; the task's rows."""
    searched = Played(task, 0, design.sites, design)
    weights = fronts.evaluation_weights(2)
    found = [
        (weight, *search(searched, weight, lambda text: print(f"{task}, {text}", flush=True))) for weight in weights
    ]
    judged = Played(task, design.sites, design.judging, design)
    gains = np.array([judged.gains([constant, plan], weight) for weight, constant, plan in found])
    return summarise(found, gains)


def path(task: str, quick: bool = False) -> Path:
    """The table of a task."""
    return paths.studies(quick) / "decade_plans" / f"{task}.csv"


def main(args: Args) -> None:
    """Search in the tasks and write a table of each."""
    site_choice.check_tasks(args.tasks)
    design = Design(args.sites, args.judging, YEARS, BLOCK_YEARS)
    if args.quick:
        design = Design(sites=2, judging=2, years=2, block_years=1)
    if min(design.sites, design.judging) < 2:
        protocol.fail(f"--sites {args.sites} --judging {args.judging}: 2 or more of both are allowed")
    for task in args.tasks:
        if stored.is_finished(path(task, args.quick), design._asdict()):
            print(f"{path(task, args.quick)} is finished")
            continue
        table = pd.DataFrame(study(task, design))
        stored.write(path(task, args.quick), table, design._asdict())
        print(table[["weight", "constant", "plan", "more"]].round(3).to_string(index=False))
        print(f"wrote {path(task, args.quick)}")


if __name__ == "__main__":
    main(protocol.parse(Args))
