"""What a plan gains that is chosen for a site by its parameters, as a regression over many sites knows them.

    python analysis/studies/site_regression.py      # a quarter of an hour on two idle cores

`site_choice.py` asks what there is to gain by knowing a site; this study, how much of it the site's parameters tell one
who has tried its plans on thousands of sites. They are played on other sampled sites, one episode each, with weather
and dice of the site's own, the same for all plans (of dice that all sites share a regression would learn the luck). A
ridge regression from the parameters to each plan's gain is fitted on seven eighths of the sites and chooses for the
last, in turn, among all plans and among the constant ones. Leaves results/studies/site_regression.csv, a row a task and
weight, and weight "all": scores, where 100 is one constant plan for all sites, its own for each weight.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import sim
from analysis import paths, stored
from analysis.studies import open_loop, site_choice
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts

SITES = 2048
FOLDS = 8
RIDGE = 100.0  # added to the diagonal; between 10 and 1000 the score differs by less than one


@dataclass
class Args:
    """Measures what a site's parameters tell of its best plan."""

    sites: int = SITES
    """sampled sites"""
    quick: bool = False
    """16 sites, 2 years: to see that it runs, into results/quick/studies"""


def predicted(parameters: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """Gain of every plan on every site (sites, plans), as a regression on sites of the other folds predicts it.

    parameters (sites, k); gains (sites, plans) of one episode each. What a site gives to all plans is taken off first.
    """
    deviation = parameters.std(axis=0)
    varied = deviation > 1e-9
    standardised = (parameters[:, varied] - parameters[:, varied].mean(axis=0)) / deviation[varied]
    inputs = np.column_stack([np.ones(len(gains)), standardised])
    penalty = RIDGE * np.eye(inputs.shape[1])
    penalty[0, 0] = 0.0  # the plan's own mean is not shrunk
    apart = gains - gains.mean(axis=1, keepdims=True)
    fold = np.random.default_rng(0).permutation(len(gains)) % FOLDS
    answer = np.empty_like(gains)
    for k in range(FOLDS):
        known, asked = inputs[fold != k], inputs[fold == k]
        slopes = np.linalg.solve(known.T @ known + penalty, known.T @ apart[fold != k])
        answer[fold == k] = asked @ slopes
    return answer


def summarise(task: str, parameters: np.ndarray, gains: np.ndarray) -> list[dict]:
    """Rows of a task with 95 % intervals over sites; gains over doing nothing, of PLANS first, (plans, sites, 2)."""
    gained = []  # (weights, 3, sites): one plan for all, chosen among all, and among the constant ones
    weights = fronts.evaluation_weights(2)
    for weight in weights:
        scalarised = (weight * gains[..., 0] + (1 - weight) * gains[..., 1]).T
        constant = scalarised[:, : len(site_choice.PLANS)]
        chosen = [of[np.arange(len(of)), predicted(parameters, of).argmax(axis=1)] for of in (scalarised, constant)]
        gained.append([constant[:, constant.mean(axis=0).argmax()], *chosen])
    gained = np.array(gained)
    sites = gains.shape[1]
    resampled = np.random.default_rng(0).integers(sites, size=(site_choice.REPETITIONS, sites))
    rows = []
    for weight, (base, *mine) in [*zip(weights, gained, strict=True), (site_choice.ALL, gained.mean(axis=0))]:
        row = {"task": task, "weight": weight}
        for name, of in zip(("score", "score_constant"), mine, strict=True):
            drawn = 100.0 * of[resampled].mean(axis=1) / base[resampled].mean(axis=1)
            low, high = np.percentile(drawn, [2.5, 97.5])
            row |= {name: 100.0 * of.mean() / base.mean(), f"{name}_low": low, f"{name}_high": high}
        rows.append(row)
    return rows


def path(quick: bool = False) -> Path:
    """The table."""
    return paths.studies(quick) / "site_regression.csv"


def main(args: Args) -> None:
    """Play both tasks, fit, and write the table."""
    sites, years = (16, 2) if args.quick else (args.sites, site_choice.YEARS)
    if sites < 2 * FOLDS:
        protocol.fail(f"--sites {sites}: {2 * FOLDS} or more are allowed")
    made_by = {"first_site": site_choice.SITES, "sites": sites, "years": years}
    if stored.is_finished(path(args.quick), made_by):
        print(f"{path(args.quick)} is finished")
        return
    others = site_choice.SITES * site_choice.DICE  # dice that site_choice.py has
    dice = {site: [others + site] for site in range(site_choice.SITES, site_choice.SITES + sites)}
    parameters = [list(sim.sample_site(open_loop.FIRST_SITE_SEED + site).values()) for site in dice]
    plans = site_choice.all_plans(years)
    chunks = -(-sites * len(plans) // site_choice.CHUNK) * len(site_choice.TASKS)
    progress = protocol.Progress("site_regression", chunks, "chunks")
    rows = []
    for task in site_choice.TASKS:
        returns = site_choice.play(task, dice, plans, progress.add)[:, :, 0]
        rows += summarise(task, np.array(parameters), returns - returns[:1])
    table = pd.DataFrame(rows)
    stored.write(path(args.quick), table, made_by)
    print(table.round(2).to_string(index=False) + f"\nwrote {path(args.quick)}")


if __name__ == "__main__":
    main(protocol.parse(Args))
