"""How much a plan that is chosen anew every ten years gains over one that is chosen at the start, and over one for all.

    python analysis/studies/replanning.py      # more than an hour of one core

The chooser has what no agent has: the simulator itself. Every ten years it plays each of the constant plans of
`site_choice.py` from the stand as it is to the end of the episode, under weathers and dice that are not the episode's,
and takes the one that is best for the preference on average. So what it gains over its own first choice is what looking
at the stand is worth, fires and insects included, to one who knows site and physics and chooses between these plans.
Leaves results/studies/replanning/<task>.csv, a row a weight, and weight "all", in which gains are scores: 100 is one
plan for all sites, its own for each weight.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import paths, stored
from analysis.studies import open_loop, signal_to_noise
from analysis.studies.site_choice import ALL, PLANS, REPETITIONS, TASKS, YEARS, check_tasks
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts

FIRST_FUTURE = 100_000  # weathers from here on are no other study's
WAYS = ("all_sites", "once", "every_ten_years")


class Design(NamedTuple):
    """Sites, episodes on each, and the futures that every choice is made by, every so many years."""

    sites: int
    dice: int
    futures: int
    every: int
    years: int


@dataclass
class Args:
    """Measures what choosing a plan anew is worth."""

    sites: int = 64
    """sampled sites, those of site_choice.py"""
    dice: int = 1
    """weathers and disturbances of each, which the choices are judged on"""
    futures: int = 8
    """weathers and disturbances that every choice is made by"""
    tasks: tuple[str, ...] = tuple(TASKS)
    """ids of the environments"""
    quick: bool = False
    """2 sites, 2 futures, 3 years, a choice every year: to see that it runs, into results/quick/studies"""


def step(stands: sim.Stands, plans: np.ndarray, reward: boreal_env.Reward) -> np.ndarray:
    """A year of each stand's plan, where it can be carried out; rewards (n, 2)."""
    actions = boreal_env.where_valid(plans, open_loop.valid_actions(stands.stocks(np.arange(stands.number))))
    return open_loop.rewards_of_year(stands.step(actions), actions, reward)


def to_go(state: dict, rows: np.ndarray, seeds: list[sim.Seeds], years: int, arguments, reward) -> np.ndarray:
    """Mean over the futures of what each plan returns from rows of a state on, (rows, plans, 2)."""
    shape = (len(rows), len(PLANS), len(seeds))
    row, plan, future = (index.ravel() for index in np.indices(shape))
    stands = signal_to_noise.branch(state, rows[row], [seeds[k] for k in future], **arguments)
    returns = sum(step(stands, np.array(PLANS)[plan], reward) for _ in range(years))
    return returns.reshape(*shape, 2).mean(axis=2)


def play_site(task: str, site: int, design: Design) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gains over doing nothing on a site, of every plan (dice, plans, 2), and of the plans that are chosen anew (dice,
    weights, 2); and which plans were chosen, numbers of PLANS (choices, dice, weights)."""
    arguments, carbon_scale = TASKS[task]
    reward, weights = boreal_env.Reward(carbon_scale=carbon_scale), np.array(fronts.evaluation_weights(2))
    number = open_loop.FIRST_SITE_SEED + site
    columns = len(PLANS) + len(weights)  # of each die: every plan, then what each weight chooses
    dice = [open_loop.seeds(number, site * design.dice + die) for die in range(design.dice)]
    stands = sim.Stands(design.dice * columns, **arguments)
    stands.start(
        np.arange(stands.number),
        [sim.sample_site(number)] * stands.number,
        [die for die in dice for _ in range(columns)],
    )
    plans = np.tile(np.array([*PLANS, *[PLANS[0]] * len(weights)]), (design.dice, 1))
    choosing = np.arange(stands.number).reshape(plans.shape)[:, len(PLANS) :]
    returns, choices = np.zeros((stands.number, 2)), []
    for year in range(design.years):
        if year % design.every == 0:
            first = FIRST_FUTURE + (site * design.years + year) * design.futures
            futures = [open_loop.seeds(number, first + k) for k in range(design.futures)]
            left = design.years - year
            found = to_go(stands.get_state(), choosing.ravel(), futures, left, arguments, reward)
            found = found.reshape(*choosing.shape, len(PLANS), 2)
            choices.append((weights[:, None] * found[..., 0] + (1 - weights[:, None]) * found[..., 1]).argmax(axis=2))
            plans[:, len(PLANS) :] = np.array(PLANS)[choices[-1]]
        returns += step(stands, plans.ravel(), reward)
    gains = returns.reshape(*plans.shape, 2)
    gains = gains - gains[:, :1]
    return gains[:, : len(PLANS)], gains[:, len(PLANS) :], np.array(choices)


def chosen_gains(plans: np.ndarray, anew: np.ndarray, first: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Scalarised gain of each site by each of WAYS, (weights, 3, sites).

    plans (sites, dice, plans, 2), anew (sites, dice, weights, 2), first: the choices of the start (sites, weights).
    """
    pairs = np.column_stack([weights, 1 - weights])
    of_plans = np.einsum("sdpm,wm->wsdp", plans, pairs).mean(axis=2)  # (weights, sites, plans)
    best = of_plans.mean(axis=1).argmax(axis=1)
    one = np.take_along_axis(of_plans, best[:, None, None], axis=2)[..., 0]
    once = np.take_along_axis(of_plans, first.T[..., None], axis=2)[..., 0]
    return np.stack([one, once, np.einsum("sdwm,wm->wsd", anew, pairs).mean(axis=2)], axis=1)


def summarise(by_weight: np.ndarray, weights: np.ndarray, changed: np.ndarray) -> list[dict]:
    """A row a weight, with 95 % intervals over sites; changed : share of the later choices that change the plan."""
    sites = by_weight.shape[2]
    drawn = np.random.default_rng(0).integers(sites, size=(REPETITIONS, sites))
    rows = []
    for weight, share, table in [
        *zip(weights, changed, by_weight, strict=True),
        (ALL, changed.mean(), by_weight.mean(axis=0)),
    ]:
        means, draws = table.mean(axis=1), table[:, drawn].mean(axis=2)
        if weight == ALL:
            means, draws = 100 * means / means[0], 100 * draws / draws[0]
        values = dict(zip(WAYS, zip(means, draws, strict=True), strict=True))
        values["anew_less_once"] = means[2] - means[1], draws[2] - draws[1]
        row = {"weight": weight}
        for name, (mean, draw) in values.items():
            low, high = np.percentile(draw, [2.5, 97.5])
            row |= {name: mean, f"{name}_low": low, f"{name}_high": high}
        rows.append(row | {"plan_changed": share})
    return rows


def study(task: str, design: Design) -> list[dict]:
    """Play a task's sites; its rows."""
    weights, found = np.array(fronts.evaluation_weights(2)), []
    progress = protocol.Progress(task, design.sites, "sites")
    for site in range(design.sites):
        found.append(play_site(task, site, design))
        progress.show(site + 1)
    plans, anew, choices = (np.stack(each) for each in zip(*found, strict=True))
    changed = (np.diff(choices, axis=1) != 0).mean(axis=(0, 1, 2))
    return summarise(chosen_gains(plans, anew, choices[:, 0, 0], weights), weights, changed)


def path(task: str, quick: bool = False) -> Path:
    """The table of a task."""
    return paths.studies(quick) / "replanning" / f"{task}.csv"


def main(args: Args) -> None:
    """Play the tasks and write a table of each."""
    check_tasks(args.tasks)
    design = Design(args.sites, args.dice, args.futures, every=10, years=YEARS)
    if args.quick:
        design = Design(sites=2, dice=1, futures=2, every=1, years=3)
    if min(design.sites - 1, design.dice, design.futures) < 1:
        protocol.fail(
            f"--sites {args.sites} --dice {args.dice} --futures {args.futures}: 2 sites, 1 of the others and more are "
            "allowed"
        )
    made_by = design._asdict()
    for task in args.tasks:
        if stored.is_finished(path(task, args.quick), made_by):
            print(f"{path(task, args.quick)} is finished")
            continue
        table = pd.DataFrame(study(task, design))
        stored.write(path(task, args.quick), table, made_by)
        print(table[["weight", *WAYS]].round(2).to_string(index=False) + f"\nwrote {path(task, args.quick)}")


if __name__ == "__main__":
    main(protocol.parse(Args))
