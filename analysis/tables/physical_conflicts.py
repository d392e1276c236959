"""What one change of a stand does to both objectives, all else equal (analysis/studies/mechanism_pairs.py).

And with a mechanism switched off: the effect on thaw without interception and without moss, on carbon without fire.
"""

import numpy as np
import pandas as pd

from analysis import metrics
from analysis.studies.mechanism_pairs import ALL_ON, PAIRS, effects
from analysis.tables.common import paper

MADE_BY = "python analysis/reproduce.py --only mechanisms"
EFFECTS = (
    "carbon_return",
    "thaw_return",
    "net_carbon_change_kgc_m2",
    "boundary_warming_mj_m2",
    "ground_shortwave_mj_m2",
    "latent_heat_mj_m2",
    "active_layer_depth_m",
    "peak_swe_mm",
    "winter_albedo",
)
WITHOUT = {
    "thaw_without_interception": ("thaw_return", "interception"),
    "thaw_without_moss": ("thaw_return", "moss"),
    "carbon_without_fire": ("carbon_return", "fire"),
}
COLUMNS = {
    "change": "change",
    "sites": "sites",
    "carbon_return": "carbon return",
    "thaw_return": "thaw return",
    "conflict": "conflict",
    "share_of_sites_in_conflict": "sites in conflict %",
    "clipped_sites": "sites whose thaw reward is clipped in a year",
    "thaw_without_interception": "thaw return without interception",
    "thaw_without_moss": "thaw return without moss and organic layer",
    "carbon_without_fire": "carbon return without fire",
    "paper_carbon": "carbon (paper)",
    "paper_permafrost": "permafrost (paper)",
    "paper_conflict": "conflict (paper)",
    "boundary_warming_mj_m2": "heat down at 12 m (MJ/m2/yr)",
    "ground_shortwave_mj_m2": "shortwave on ground (MJ/m2/yr)",
    "latent_heat_mj_m2": "latent heat (MJ/m2/yr)",
    "active_layer_depth_m": "active layer (m)",
    "peak_swe_mm": "peak snow (mm)",
    "winter_albedo": "winter albedo",
}


def verdict(carbon: tuple[float, float], thaw: tuple[float, float]) -> str:
    """yes if one objective gains and the other loses, beyond their intervals (mean, half width); else no or unclear."""
    signs = [0 if not abs(mean) > half_width else np.sign(mean) for mean, half_width in (carbon, thaw)]
    return "unclear" if 0 in signs else "yes" if signs[0] != signs[1] else "no"


def make(results) -> pd.DataFrame:
    """One row per pair: the mean over the sites of upper less lower, with its 95 % interval."""
    published = paper("physical_conflicts", index_col="variable").add_prefix("paper_")
    pairs, rows = results.study("mechanism_pairs"), []
    for pair in PAIRS:
        row = {"change": pair, "conflict": "not run yet"}
        row |= next((published.loc[name].to_dict() for name in published.index if pair.startswith(name)), {})
        if pairs is not None:
            apart = {name: effects(pairs, pair, name) for name in EFFECTS}
            apart |= {name: effects(pairs, pair, variable, off) for name, (variable, off) in WITHOUT.items()}
            sites = pairs[(pairs.pair == pair) & (pairs.off == ALL_ON)]
            clipped = sites[["lower_thaw_clipped_years", "upper_thaw_clipped_years"]].max(axis=1) > 0
            for name, values in apart.items():
                row |= metrics.with_interval(name, values)
            opposed = np.sign(apart["carbon_return"]) * np.sign(apart["thaw_return"]) < 0
            row |= {
                "sites": len(sites),
                "clipped_sites": clipped.sum(),
                "conflict": verdict(*(metrics.mean_interval(apart[name]) for name in ("carbon_return", "thaw_return"))),
                "share_of_sites_in_conflict": 100 * opposed.mean(),
            }
        rows.append(row)
    return pd.DataFrame(rows)
