"""Pairs of stands that differ in one thing, on the same sites and weathers: what it does to both objectives.

    python analysis/studies/mechanism_pairs.py

Where the paper correlates across sites, which differ in everything at once, here one thing is changed. Stands begin
with 1000 stems/ha, half of them conifers, and are left alone for 50 years, except in the pairs of planting; each
stand's ground is first brought into balance with it, and its organic layer is that of its species. So the pairs that
plant nothing compare two stands of long standing, and only those of planting say what management does in 50 years.
Every pair is played again with each mechanism of OFF switched off, which tells what its effect comes by. Leaves
results/studies/mechanism_pairs.csv, one row a pair, mechanism and site.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import paths, stored
from analysis.studies import open_loop
from cleanrl_style import protocol

YEARS = 50
STAND = {
    "density_stems_ha": 1000.0,
    "conifer_fraction": 0.5,
    "biomass_kgc_m2": 5.0,
    "soil_kgc_m2": 6.0,
    "oldest_age_years": 80.0,
}
SPARSE = {"density_stems_ha": 300.0, "biomass_kgc_m2": 1.5}
PLANT_DECIDUOUS, PLANT_HALF, PLANT_CONIFER = 20, 22, 24
ALL_ON = "all on"
OFF = (ALL_ON, "interception", "fire", "moss")  # see `sim.MECHANISMS`

#: Name -> (lower, upper): each a change of the site (name -> function of its value), the first stand, and the action.
PAIRS = {
    "growing season of leaves, 40 days longer": (
        ({"growth_start_day": lambda day: day + 10, "fall_start_day": lambda day: day - 10}, {}, boreal_env.NO_CHANGE),
        ({"growth_start_day": lambda day: day - 10, "fall_start_day": lambda day: day + 10}, {}, boreal_env.NO_CHANGE),
    ),
    "growing season by a climate 1 K warmer": (
        ({"mean_annual_temperature_c": lambda t: t - 0.5}, {}, boreal_env.NO_CHANGE),
        ({"mean_annual_temperature_c": lambda t: t + 0.5}, {}, boreal_env.NO_CHANGE),
    ),
    "stem density, 500 to 1500 stems/ha": (
        ({}, {"density_stems_ha": 500.0, "biomass_kgc_m2": 2.5}, boreal_env.NO_CHANGE),
        ({}, {"density_stems_ha": 1500.0, "biomass_kgc_m2": 7.5}, boreal_env.NO_CHANGE),
    ),
    "conifer fraction, 0.2 to 0.8": (
        ({}, {"conifer_fraction": 0.2}, boreal_env.NO_CHANGE),
        ({}, {"conifer_fraction": 0.8}, boreal_env.NO_CHANGE),
    ),
    "LAI, 20 % less to 20 % more": (
        (
            {"max_lai_conifer": lambda lai: 0.8 * lai, "max_lai_deciduous": lambda lai: 0.8 * lai},
            {},
            boreal_env.NO_CHANGE,
        ),
        (
            {"max_lai_conifer": lambda lai: 1.2 * lai, "max_lai_deciduous": lambda lai: 1.2 * lai},
            {},
            boreal_env.NO_CHANGE,
        ),
    ),
    "planting, none to 100 a year of 300 stems/ha": (({}, SPARSE, boreal_env.NO_CHANGE), ({}, SPARSE, PLANT_HALF)),
    "planting 100 a year of 300 stems/ha, deciduous to conifers": (
        ({}, SPARSE, PLANT_DECIDUOUS),
        ({}, SPARSE, PLANT_CONIFER),
    ),
    "leaves 20 days earlier in spring": (
        ({"growth_start_day": lambda day: day + 10}, {}, boreal_env.NO_CHANGE),
        ({"growth_start_day": lambda day: day - 10}, {}, boreal_env.NO_CHANGE),
    ),
    "leaves 20 days longer in autumn": (
        ({"fall_start_day": lambda day: day - 10}, {}, boreal_env.NO_CHANGE),
        ({"fall_start_day": lambda day: day + 10}, {}, boreal_env.NO_CHANGE),
    ),
    "conifers 0.2 to 0.8 of the stems, on one first organic layer": (
        ({}, {"conifer_fraction": 0.2, "organic_layer_m": 0.1}, boreal_env.NO_CHANGE),
        ({}, {"conifer_fraction": 0.8, "organic_layer_m": 0.1}, boreal_env.NO_CHANGE),
    ),
    "in wind of 1 m/s, planting none to 100 a year": (
        ({"wind_speed_m_s": lambda wind: 1.0}, SPARSE, boreal_env.NO_CHANGE),
        ({"wind_speed_m_s": lambda wind: 1.0}, SPARSE, PLANT_HALF),
    ),
    "in wind of 5 m/s, planting none to 100 a year": (
        ({"wind_speed_m_s": lambda wind: 5.0}, SPARSE, boreal_env.NO_CHANGE),
        ({"wind_speed_m_s": lambda wind: 5.0}, SPARSE, PLANT_HALF),
    ),
}
MEANS = (
    "growing_season_days",
    "max_lai",
    "latent_heat_mj_m2",
    "transpiration_mm",
    "ground_shortwave_mj_m2",
    "boundary_warming_mj_m2",
    "boundary_cooling_mj_m2",
    "active_layer_depth_m",
    "peak_swe_mm",
    "winter_albedo",
    "gpp_kgc_m2",
    "autotrophic_respiration_kgc_m2",
    "net_carbon_change_kgc_m2",
)


@dataclass
class Args:
    """Plays pairs of stands that differ in one thing."""

    sites: int = 48
    """sampled sites, each with one weather"""
    quick: bool = False
    """2 sites and 1 year, into results/quick/studies"""


def play(change: dict, stand: dict, action: int, off: str, sites: int, years: int) -> pd.DataFrame:
    """One side of a pair on every site: both returns, years of a clipped thaw reward, means over the years of MEANS."""
    numbers = range(sites)
    seeds = [open_loop.seeds(open_loop.FIRST_SITE_SEED + k, k) for k in numbers]
    sampled = [sim.sample_site(open_loop.FIRST_SITE_SEED + k) for k in numbers]
    changed = [site | {name: function(site[name]) for name, function in change.items()} for site in sampled]
    plans = np.full((sites, years), action)
    episodes = open_loop.play(
        changed,
        seeds,
        plans,
        initial={k: STAND | stand for k in numbers},
        mechanisms=None if off == ALL_ON else {off: False},
    )
    table = pd.DataFrame(episodes.returns(), columns=["carbon_return", "thaw_return"])
    table["thaw_clipped_years"] = episodes.clipped_years()[:, 1]
    return table.assign(**{name: episodes.total(name) / years for name in MEANS})


def study(sites: int, years: int) -> pd.DataFrame:
    """One row a pair, mechanism that is off and site: values of the lower and the upper side."""
    tables = []
    cases = [(pair, off) for off in OFF for pair in PAIRS]
    progress = protocol.Progress("pairs", 2 * len(cases) * sites, "episodes")
    for number, (pair, off) in enumerate(cases):
        lower, upper = (play(*side, off, sites, years) for side in PAIRS[pair])
        table = lower.add_prefix("lower_").join(upper.add_prefix("upper_"))
        table.insert(0, "pair", pair)
        table.insert(1, "off", off)
        table.insert(2, "site_seed", open_loop.FIRST_SITE_SEED + np.arange(sites))
        tables.append(table)
        progress.show(2 * (number + 1) * sites)
    return pd.concat(tables, ignore_index=True)


def effects(pairs: pd.DataFrame, pair: str, variable: str, off: str = ALL_ON) -> np.ndarray:
    """Upper less lower side on each site, of the study's table."""
    sites = pairs[(pairs.pair == pair) & (pairs.off == off)]
    return (sites[f"upper_{variable}"] - sites[f"lower_{variable}"]).to_numpy()


def main(args: Args) -> None:
    """Play all pairs, unless the table is there."""
    sites, years = (2, 1) if args.quick else (args.sites, YEARS)
    folder = paths.studies(args.quick)
    path = folder / "mechanism_pairs.csv"
    settings = {"sites": sites, "years": years, "pairs": list(PAIRS), "off": OFF, "means": MEANS}
    if stored.is_finished(path, settings):
        print(f"{path} is finished")
        return
    stored.write(path, study(sites, years), settings)
    print(f"wrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
