"""Adjacent pairs of weights where carbon falls or thaw rises as the carbon weight rises.

Of two objectives: the weights of more have no neighbours. Beside them what a policy that ignores the preference would
show: the same points in an order drawn at random.
"""

import numpy as np
import pandas as pd

from analysis import metrics
from analysis.tables.common import ROW_COLUMNS, over_seeds, paper, paper_name, row_of

MADE_BY = "python analysis/reproduce.py --only main"
COLUMNS = ROW_COLUMNS | {
    "responding": "of them respond",
    "pairs": "pairs of weights",
    "violations_percent": "violations %",
    "violations_or_ties_percent": "violations and ties %",
    "paper_violations_percent": "violations % (paper)",
    "paper_detail_violations_percent": "violations % (paper's details)",
    "significant_violations_percent": "beyond their 95 % interval %",
    "noise_violations_percent": "in random order %",
}


def violations(one) -> dict:
    """Of one run; empty for a policy that does not look at the preference, which has nothing to violate."""
    front = metrics.mean_returns(one.evaluation).to_numpy()
    if len(front) < 2 or not np.ptp(front, axis=0).any():
        return {}
    row = {
        "pairs": len(front) - 1,
        "violations_percent": metrics.violations_percent(front),
        "violations_or_ties_percent": metrics.violations_or_ties_percent(front),
        "noise_violations_percent": metrics.expected_violations_percent(front),
    }
    return row | {"significant_violations_percent": metrics.significant_violations_percent(one.evaluation)}


def make(results) -> pd.DataFrame:
    """One row per trained method, environment and setting."""
    published = paper("monotonicity_violations", index_col="method").violations_percent
    details = paper("detailed_objectives").groupby("method")[["carbon_mean", "thaw_mean"]]
    details = details.apply(metrics.violations_percent)
    kinds = ("violations", "violations_or_ties", "significant_violations", "noise_violations")
    names = ["pairs", *(f"{kind}_percent" for kind in kinds)]
    rows = []
    for key, replicates in results.rows_of_two_objectives().items():
        if not results.is_trained(key):
            continue
        table = pd.DataFrame([violations(one) for one in replicates], columns=names).astype(float)
        row = row_of(key, len(table)) | over_seeds(table.drop(columns="pairs")) | {"pairs": table.pairs.mean()}
        row["responding"] = int(table.pairs.notna().sum())  # to the preference at all; the percentages are of these
        name = paper_name(*key)
        if name in published.index:
            row["paper_violations_percent"] = published[name]
            row["paper_detail_violations_percent"] = details.get(name, np.nan)
        rows.append(row)
    return pd.DataFrame(rows)
