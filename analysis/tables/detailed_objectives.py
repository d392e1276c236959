"""Both objectives at every weight, and their gains over zero change on the same episodes."""

import pandas as pd

from analysis import metrics
from analysis.tables.common import ROW_COLUMNS, over_seeds, paper, paper_name, row_of

MADE_BY = "python analysis/reproduce.py --only main"
COLUMNS = ROW_COLUMNS | {
    "weight": "weight",
    "carbon_return": "carbon",
    "carbon_sd_over_episodes": "sd over episodes, carbon",
    "paper_carbon_mean": "carbon (paper)",
    "paper_carbon_std": "sd (paper), carbon",
    "thaw_return": "thaw",
    "thaw_sd_over_episodes": "sd over episodes, thaw",
    "paper_thaw_mean": "thaw (paper)",
    "paper_thaw_std": "sd (paper), thaw",
    "carbon_gain": "carbon gain",
    "thaw_gain": "thaw gain",
}


def by_weight(one) -> pd.DataFrame:
    """Means of one run, a row per weight."""
    table = metrics.mean_returns(one.evaluation)
    spread = metrics.by_weight(one.evaluation)[list(table)].std()
    table = table.join(spread.rename(columns=lambda name: name.replace("return", "sd_over_episodes")))
    if one.gains is not None:
        gains = metrics.mean_returns(one.gains)
        table = table.join(gains.rename(columns=lambda name: name.replace("return", "gain")))
    return table


def row_at(key: tuple, weights: dict, at_weight: pd.DataFrame) -> dict:
    """A row: statistics over training seeds of the rows of `by_weight` at one weight."""
    row = row_of(key, len(at_weight)) | weights
    if at_weight.empty:
        return row
    spreads = [column for column in at_weight if "sd_over" in column]
    return row | over_seeds(at_weight.drop(columns=spreads)) | at_weight[spreads].mean().to_dict()


def make(results) -> pd.DataFrame:
    """One row per script, environment, setting and weight; the paper's weights too where ours are others."""
    published = paper("detailed_objectives", index_col=["method", "lambda_carbon"]).add_prefix("paper_")
    rows = []
    for key, replicates in results.rows_of_two_objectives().items():
        tables = [by_weight(one) for one in replicates]
        name = paper_name(*key)
        theirs = published.loc[name] if (name, 0.0) in published.index else published.iloc[:0]
        ours = pd.concat(tables) if tables else pd.DataFrame()
        for weight in sorted({*ours.index, *(theirs.index if tables else ())}):
            at_weight = ours[ours.index == weight]
            row = row_at(key, {"weight": weight}, at_weight)
            rows.append(row | (theirs.loc[weight].to_dict() if weight in theirs.index else {}))
    return pd.DataFrame(rows, columns=None if rows else list(COLUMNS))
