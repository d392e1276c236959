"""The sites that the curriculum accepted and rejected: latitude, and heat into the ground if nothing were done."""

import numpy as np
import pandas as pd

from analysis.tables.common import over_seeds, paper

MADE_BY = "python analysis/reproduce.py --only main mechanisms"
CATEGORIES = {"accepted": 1, "rejected": 0}
NUMBERS = {"latitude_deg": "latitude", "warming_mj_m2": "warming", "cooling_mj_m2": "cooling", "thaw_return": "thaw"}
COLUMNS = {
    "category": "sites",
    "seeds": "seeds",
    "share_percent": "of all episodes %",
    "latitude": "latitude (deg N)",
    "paper_latitude": "latitude (paper)",
    "warming": "potential heat down at 12 m (MJ/m2/yr)",
    "paper_warming": "potential heat down (MJ, paper)",
    "cooling": "potential heat up at 12 m (MJ/m2/yr)",
    "thaw": "thaw return of zero change",
}


def make(results) -> pd.DataFrame:
    """Accepted, rejected, and their difference within a run."""
    published = paper("curriculum_selection", index_col="site_category")
    curricula = results.of("main", "ppo_curriculum")
    shares = [100 * one.runs[0].share_selected for one in curricula]
    share = pd.DataFrame({"share_percent": shares}).astype(float)
    sites, rows = results.study("site_warming"), []
    means = {}
    for category, selected in CATEGORIES.items():
        row = {"category": category, "seeds": len(curricula)}
        row |= over_seeds(share if selected else 100 - share)
        if sites is not None:
            chosen = sites[sites.selected == selected]
            means[category] = chosen.groupby("seed")[list(NUMBERS)].mean().rename(columns=NUMBERS)
            row |= over_seeds(means[category])
        row |= {
            "paper_latitude": published.latitude[category],
            "paper_warming": published.potential_warming_flux_mj[category],
        }
        rows.append(row)
    difference = {"category": "accepted less rejected", "seeds": len(curricula), "share_percent": np.nan}
    if sites is not None:
        difference |= over_seeds(means["accepted"] - means["rejected"])
    return pd.DataFrame([*rows, difference])
