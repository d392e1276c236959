"""Agents of one objective alone on single sites, where all episodes are one: with a baseline, without, and the plans.

Gains are of 50-year returns over zero change in the evaluation, in the objective that the agent was trained for.
"""

import numpy as np
import pandas as pd

import boreal_env
from analysis.studies import constant_plans

MADE_BY = "python analysis/reproduce.py --only main site"
OBJECTIVES = {0.0: "thaw", 1.0: "carbon"}  # weight of carbon -> what it leaves alone
VARIANTS = {"eupg": {}, "baseline": {"baseline": "others"}, "total": {"utility": "total"}}
COLUMNS = {
    "site_seed": "site seed",
    "thaw_eupg": "thaw gain, EUPG",
    "thaw_baseline": "baseline (others)",
    "thaw_total": "utility (total)",
    "thaw_plan": "best constant plan",
    "thaw_unchanged": "thaw return of doing nothing",
    "carbon_eupg": "carbon gain, EUPG",
    "carbon_baseline": "baseline (others)",
    "carbon_plan": "best constant plan",
}


def own_gains(replicates, weight: float) -> pd.Series:
    """Gain over zero change of the agents of one weight, 0 or 1, in that objective, by the site of their training."""
    objective = f"{OBJECTIVES[weight]}_return"
    tables = {one.runs[0].arguments["site_seed"]: one.gains for one in replicates if one.gains is not None}
    gains = {site: table[table.preference == weight][objective].mean() for site, table in tables.items()}
    return pd.Series(gains, dtype=float).dropna()


def make(results) -> pd.DataFrame:
    """One row per site, and their mean."""
    plans, columns = results.study("constant_plans_of_sites"), {}
    for weight, name in OBJECTIVES.items():
        for variant, flags in VARIANTS.items():
            columns[f"{name}_{variant}"] = own_gains(results.of("site", "eupg_fixed_lambda", **flags), weight)
        columns[f"{name}_plan"] = constant_plans.best_gains(plans, f"{name}_return") if plans is not None else np.nan
    if plans is not None:
        columns["thaw_unchanged"] = plans[plans.action == boreal_env.NO_CHANGE].set_index("site_seed").thaw_return
    table = pd.DataFrame(
        columns,
        index=sorted(set().union(*(column.index for column in columns.values() if isinstance(column, pd.Series)))),
    )
    table = table[[name for name in COLUMNS if name in table]]
    mean = table.mean().to_frame("mean").T
    return pd.concat([table, mean]).rename_axis("site_seed").reset_index().astype({"site_seed": str})
