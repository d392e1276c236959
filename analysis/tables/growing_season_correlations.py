"""Growing season against thaw return, latent heat and shortwave on the ground: correlations, and pairs of stands.

The correlations are over evaluation episodes and weights, as the paper's: sites differ in everything at once. The
season is that of leaves, as the paper defines it for the observation (day of fall less day of growth), and beside it
that of days above 5 degC. The pairs (analysis/studies/mechanism_pairs.py) differ in the season alone.
"""

from functools import cache

import pandas as pd

import sim
from analysis import metrics
from analysis.methods import LEARNERS
from analysis.studies.mechanism_pairs import effects
from analysis.tables.common import ROW_COLUMNS, over_seeds, paper, row_of

MADE_BY = "python analysis/reproduce.py --only main"
VARIABLES = {
    "thaw_return": "thaw_reward",
    "latent_heat_mj_m2": "latent_heat",
    "ground_shortwave_mj_m2": "ground_radiation",
}
SEASON_PAIRS = {
    "leaves": "growing season of leaves, 40 days longer",
    "climate": "growing season by a climate 1 K warmer",
}
COLUMNS = ROW_COLUMNS | {
    "variable": "variable",
    "r": "r, days between leaf dates",
    "paper_r": "r (paper, all methods)",
    "r_warm": "r, days above 5 °C",
    "r_gain": "r of the gain",
    "leaves_effect": "pairs: leaves 40 days longer",
    "climate_effect": "pairs: climate 1 K warmer",
}


@cache
def season_of_leaves(site_seed: int) -> float:
    """Days between the first leaves and their fall at a sampled site."""
    site = sim.sample_site(site_seed)
    return site["fall_start_day"] - site["growth_start_day"]


def correlations(one) -> dict:
    """r of the season of leaves, and of days above 5 degC ("warm_"), with each variable and the gain in thaw."""
    leaves, warm = one.evaluation.site_seed.map(season_of_leaves), one.evaluation.growing_season_days
    row = {name: leaves.corr(one.evaluation[name]) for name in VARIABLES}
    row |= {f"warm_{name}": warm.corr(one.evaluation[name]) for name in VARIABLES}
    gain = None if one.gains is None else leaves.corr(one.gains.thaw_return)
    return row | {"r_gain": gain}


def pair_effects(pairs: pd.DataFrame | None, variable: str) -> dict:
    """Mean effect of a longer season over the sites, upper less lower, with its 95 % interval."""
    row = {}
    for name, pair in SEASON_PAIRS.items() if pairs is not None else ():
        row |= metrics.with_interval(f"{name}_effect", effects(pairs, pair, variable))
    return row


def make(results) -> pd.DataFrame:
    """One row per method and variable, the methods of one's own last."""
    published = paper("growing_season_correlations", index_col="variable").r
    pairs = results.study("mechanism_pairs")
    rows = []
    for key, replicates in results.of_main_and_others(("zero_change", *LEARNERS)).items():
        columns = [*VARIABLES, *(f"warm_{name}" for name in VARIABLES), "r_gain"]
        table = pd.DataFrame([correlations(one) for one in replicates], columns=columns).astype(float)
        for variable, its_name in VARIABLES.items():
            chosen = table[[variable, f"warm_{variable}"]].set_axis(["r", "r_warm"], axis=1)
            if variable == "thaw_return" and key[0] != "zero_change":
                chosen = chosen.assign(r_gain=table.r_gain)
            row = row_of(key, len(table)) | {"variable": variable, "paper_r": published[its_name]}
            rows.append(row | over_seeds(chosen) | pair_effects(pairs, variable))
    return pd.DataFrame(rows)
