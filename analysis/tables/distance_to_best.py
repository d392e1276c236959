"""How near agents and fixed strategies come to the best known plans of the sites of the fronts.

From analysis/studies/distance_to_best.py; docs/learning.md says how to read it.
"""

import pandas as pd

from analysis import stored
from analysis.experiments import WEIGHTS
from analysis.studies.distance_to_best import TEXT
from analysis.tables.common import ROW_COLUMNS, over_seeds

TITLE = "Distance to the best known plans"
MADE_BY = "python analysis/reproduce.py --only difficulty"
ALL, SINGLE = "all", "with agents of their own"
ROW = ["method", "environment", "setting", "policy"]
COLUMNS = ROW_COLUMNS | {
    "policy": "policy",
    "sites": "sites",
    **{f"share_{weight:g}": f"% of the best gain, weight {weight:g}" for weight in WEIGHTS},
    "hypervolume": "% of the hypervolume",
}


def shares(rows: pd.DataFrame) -> dict:
    """One agent's share of the best known gain at each weight, mean over the sites of both, and hypervolume's [%]."""
    sums = rows.groupby("weight")[["scalarized_gain", "best_scalarized_gain"]].sum()
    ratio = 100 * sums.scalarized_gain / sums.best_scalarized_gain
    return {f"share_{weight:g}": value for weight, value in ratio.items()} | {
        "hypervolume": 100 * rows.groupby("site").hypervolume_share.first().mean()
    }


def make(results) -> pd.DataFrame:
    """A row a method, setting and kind of policy; on all sites, and on those that have agents of their own.

    Agents of one weight, and of one site, are one replicate together.
    """
    path = results.studies_dir / "distance_to_best.csv"
    columns = [*ROW, "seeds", "sites", *(name for name in COLUMNS if name.startswith(("share", "hyper")))]
    if not path.exists():
        return pd.DataFrame([{"method": "not run yet", "seeds": 0}], columns=columns)
    table = stored.read(path, text=TEXT)
    alone = table[table.trained_on != ""]
    some = table[table.site.isin(set(alone.site))]
    rows = []
    for sites, part in ((ALL, table[table.trained_on == ""]), (SINGLE, some)):
        for key, one in part.groupby(ROW, sort=True):
            replicates = ["seed"] if sites == ALL or not (one.trained_on != "").any() else ["policy"]
            found = pd.DataFrame([shares(its) for _, its in one.groupby(replicates, sort=True)])
            row = dict(zip(ROW, key, strict=True)) | {"seeds": len(found), "sites": f"{one.site.nunique()}, {sites}"}
            rows.append(row | over_seeds(found))
    return pd.DataFrame(rows).reindex(
        columns=[*columns, *(f"{name}{end}" for name in columns[6:] for end in ("_low", "_high"))]
    )
