"""Measures what the scales of timber and biodiversity rest on: yearly revenue, and how returns vary between plans.

    python analysis/studies/objective_scales.py      # half a minute on two idle cores

Every constant plan is played on the same sampled sites, each with one first stand, weather and dice. The spread of a
return is its standard deviation between the plans of a site, pooled over sites. Prices change no tree, so that the same
years are sold at those of every country. Leaves results/studies/objective_scales.csv, a row an objective, and of timber
one a country, with the largest and smallest discounted net revenue of a year.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

import boreal_env
from analysis import paths, stored
from analysis.studies.measure_balance import FIRST_SEED
from cleanrl_style import protocol
from cleanrl_style.protocol import final_info, reference
from sim.task.timber import DISCOUNT_RATE, Timber, countries, timber_reward

TASK = "boreal-four-v0"


@dataclass
class Args:
    """Measures the largest yearly revenue and how returns vary between constant plans."""

    sites: int = 32
    """sampled sites"""
    quick: bool = False
    """2 sites, 3 years: to see that it runs, into results/quick/studies"""


def play(sites: int, years: int) -> dict[str, np.ndarray]:
    """Annual records of every constant plan by column, each (plans, sites, years)."""
    envs = protocol.Task.of(TASK).make_lockstep(sites, years=years, record_years=True)
    progress, records = protocol.Progress("objective_scales", len(reference.PLANS), "plans"), []
    for plan in reference.PLANS:
        envs.reset(seed=[FIRST_SEED + site for site in range(sites)])
        for _ in range(years):
            *_, infos = envs.step(boreal_env.where_valid(np.full(sites, int(plan)), envs.action_masks()))
        records.append([final_info(infos, site, ["years"])["years"] for site in range(sites)])
        progress.show(len(records))
    return {name: np.array([[site[name] for site in plan] for plan in records]) for name in records[0][0]}


def spread(rewards: np.ndarray) -> float:
    """Standard deviation of the return between the plans of a site, pooled over sites; rewards as `play` has them."""
    return np.sqrt(rewards.sum(axis=2).var(axis=0).mean())


def summarise(record: dict[str, np.ndarray]) -> pd.DataFrame:
    """The study's rows of what `play` gave."""
    names = ("carbon", "thaw", "biodiversity")
    rows = [{"objective": name, "spread": spread(record[f"{name}_reward"])} for name in names]
    for country in countries():
        sold = Timber(country, DISCOUNT_RATE).columns(record, np.arange(record["carbon_reward"].shape[2]))
        revenue = sold["discounted_revenue_eur_ha"]
        row = {"objective": "timber", "prices": country, "spread": spread(timber_reward(sold))}
        rows.append(row | {"largest_eur_ha": revenue.max(), "smallest_eur_ha": revenue.min()})
    return pd.DataFrame(rows)


def main(args: Args) -> None:
    """Play and write the table, unless it is there."""
    sites, years = (2, 3) if args.quick else (args.sites, 50)
    path = paths.studies(args.quick) / "objective_scales.csv"
    settings = {"sites": sites, "years": years}
    if not stored.is_finished(path, settings):
        stored.write(path, summarise(play(sites, years)), settings)
    print(f"{stored.read(path).round(2).to_string(index=False)}\n{path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
