"""How much a plan that is chosen for a site gains over one for all sites, and how much of that is luck of the dice.

    python analysis/studies/site_choice.py      # half an hour on two idle cores

The constant plans that are best anywhere, and the plans by decade that `decade_plans.py` found, are played on sampled
sites, each with one first stand under several weathers and dice of its own, the same for all plans. Four ways to
choose: one constant plan for all sites; for each site and die the best plan on that very die, which no agent can know;
and for each site the plan that is best on average on the other dice, or on all. The last two have between them what an
agent gains that knows the site to perfection: on other dice it takes a lesser plan now and then, on all it counts some
luck as skill. Leaves results/studies/site_choice.csv, a row a task and weight, and weight "all", in which gains are
scores: 100 is one plan for all sites, its own for each weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import paths, stored
from analysis.studies import open_loop
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts

YEARS = 50
SITES, DICE = 256, 16
CHUNK = 512  # episodes in lockstep
REPETITIONS = 1000  # of the bootstrap over sites
PLANS = (boreal_env.NO_CHANGE, 20, 21, 22, 23, 24)  # nothing, and 100 stems a year of 0 to 100 % conifers
#: Conifers first, deciduous trees later, an action for each ten years: what `decade_plans.py` found.
CHANGING = ((24, 24, 20, 20, 20), (24, 24, 21, 20, 20), (24, 21, 20, 20, 20))
ALL = "all"
WAYS = ("all_sites", "same_dice", "other_dice", "all_dice")
#: Task -> the simulator's arguments and the scale of its carbon reward.
TASKS = {
    "boreal-generalist-v0": ({}, boreal_env.Reward().carbon_scale),
    "boreal-balanced-v0": (boreal_env.BALANCED_WORLD, boreal_env.BALANCED_CARBON_SCALE),
}


@dataclass
class Args:
    """Measures what knowing a site is worth."""

    sites: int = SITES
    """sampled sites"""
    dice: int = DICE
    """weathers and disturbances of each"""
    quick: bool = False
    """2 sites, 2 dice, 3 years: to see that it runs, into results/quick/studies"""


def check_tasks(tasks: Sequence[str]) -> None:
    """A flag's ids of environments; one that is none of TASKS ends the script with one line."""
    unknown = [task for task in tasks if task not in TASKS]
    if unknown:
        protocol.fail(f"--tasks {unknown[0]}: allowed are {', '.join(TASKS)}")


def all_plans(years: int) -> np.ndarray:
    """Actions of PLANS, then of CHANGING, (plans, years)."""
    return np.repeat([*([plan] * 5 for plan in PLANS), *CHANGING], YEARS // 5, axis=1)[:, :years]


def play(task: str, dice_of_site: dict[int, Sequence[int]], plans: np.ndarray, progress) -> np.ndarray:
    """Returns of every plan, (plans, sites, dice, 2).

    dice_of_site : number of a site -> numbers of its dice, as many for each; plans : an action a year, (plans, years);
    progress : called after every `CHUNK` episodes.
    """
    arguments, carbon_scale = TASKS[task]
    design = [(site, die, plan) for site, dice in dice_of_site.items() for die in dice for plan in plans]
    returns = []
    for first in range(0, len(design), CHUNK):
        part = design[first : first + CHUNK]
        numbers = [open_loop.FIRST_SITE_SEED + site for site, _, _ in part]
        episodes = open_loop.play(
            [sim.sample_site(number) for number in numbers],
            [open_loop.seeds(number, die) for number, (_, die, _) in zip(numbers, part, strict=True)],
            np.array([plan for *_, plan in part]),
            **arguments,
        )
        reward = boreal_env.Reward(carbon_scale=carbon_scale)
        rewards = (
            open_loop.rewards_of_year(episodes.record[:, year], episodes.actions[:, year], reward)
            for year in range(plans.shape[1])
        )
        returns.append(sum(rewards))
        progress()
    return np.concatenate(returns).reshape(len(dice_of_site), -1, len(plans), 2).transpose(2, 0, 1, 3)


def chosen_gains(gains: np.ndarray, weight: float) -> np.ndarray:
    """Scalarised gain of each site by each of WAYS, (4, sites); gains (plans, sites, dice, 2), of PLANS first."""
    scalarised = weight * gains[..., 0] + (1 - weight) * gains[..., 1]
    dice = scalarised.shape[2]
    others = (scalarised.sum(axis=2, keepdims=True) - scalarised) / (dice - 1)
    by_others = np.take_along_axis(scalarised, others.argmax(axis=0)[None], axis=0)[0]
    of_plans = scalarised.mean(axis=2)
    for_all = of_plans[of_plans[: len(PLANS)].mean(axis=1).argmax()]
    return np.stack([for_all, scalarised.max(axis=0).mean(axis=1), by_others.mean(axis=1), of_plans.max(axis=0)])


def summarise(task: str, gains: np.ndarray) -> list[dict]:
    """Rows of a task: what each way of choosing gains, with 95 % intervals over sites."""
    weights = fronts.evaluation_weights(2)
    by_weight = np.stack([chosen_gains(gains, weight) for weight in weights])  # (weights, ways, sites)
    resampled = np.random.default_rng(0).integers(gains.shape[1], size=(REPETITIONS, gains.shape[1]))
    rows = []
    for weight, table in [*zip(weights, by_weight, strict=True), (ALL, by_weight.mean(axis=0))]:
        means, draws = table.mean(axis=1), table[:, resampled].mean(axis=2)
        if weight == ALL:
            means, draws = 100 * means / means[0], 100 * draws / draws[0]
        row = {"task": task, "weight": weight}
        for way, mean, drawn in zip(WAYS, means, draws, strict=True):
            low, high = np.percentile(drawn, [2.5, 97.5])
            row |= {way: mean, f"{way}_low": low, f"{way}_high": high}
        # conifers less deciduous trees: what differs between sites, and between dice of a site
        apart = gains[PLANS.index(24)] - gains[PLANS.index(20)]
        apart = apart.mean(axis=2) if weight == ALL else weight * apart[..., 0] + (1 - weight) * apart[..., 1]
        within = apart.var(axis=1, ddof=1).mean()
        between = apart.mean(axis=1).var(ddof=1) - within / apart.shape[1]
        row |= {"conifers_less_deciduous": apart.mean(), "sd_dice": np.sqrt(within), "sd_sites": max(between, 0) ** 0.5}
        rows.append(row)
    return rows


def path(quick: bool = False) -> Path:
    """The table."""
    return paths.studies(quick) / "site_choice.csv"


def main(args: Args) -> None:
    """Play both tasks and write the table."""
    sites, dice, years = (2, 2, 3) if args.quick else (args.sites, args.dice, YEARS)
    if sites < 2 or dice < 2:
        protocol.fail(f"--sites {sites} --dice {dice}: 2 or more of both are allowed")
    made_by = {"sites": sites, "dice": dice, "years": years}
    if stored.is_finished(path(args.quick), made_by):
        print(f"{path(args.quick)} is finished")
        return
    plans = all_plans(years)
    chunks = -(-sites * dice * len(plans) // CHUNK) * len(TASKS)
    progress = protocol.Progress("site_choice", chunks, "chunks")
    every = {site: range(site * dice, (site + 1) * dice) for site in range(sites)}
    rows = []
    for task in TASKS:
        returns = play(task, every, plans, progress.add)
        rows += summarise(task, returns - returns[:1])
    table = pd.DataFrame(rows)
    stored.write(path(args.quick), table, made_by)
    print(table[["task", "weight", *WAYS]].round(2).to_string(index=False) + f"\nwrote {path(args.quick)}")


if __name__ == "__main__":
    main(protocol.parse(Args))
