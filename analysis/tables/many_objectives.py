"""Two tables for each environment that has other objectives than carbon and thaw, of the paper's main ones.

main_results_<environment> has the metrics of every method there, and of constant plans if
analysis/studies/constant_plans.py has played them; detailed_objectives_<environment> the returns, and the gains over
zero change, at each weight. The paper has neither.
"""

import pandas as pd

from analysis.results import PAIR
from analysis.tables import detailed_objectives, main_results
from analysis.tables.common import ROW_COLUMNS

STEMS = ("main_results", "detailed_objectives")
RESPONSES = {"change": "{}, own weight lowest to highest", "slope": "slope of {} against own weight"}
DETAILS = {"return": "{}", "sd_over_episodes": "sd over episodes, {}", "gain": "{} gain"}


def columns_of(headings: dict[str, str], objectives) -> dict[str, str]:
    """Columns of each kind for each objective; headings : kind -> text with the objective's place."""
    return {f"{name}_{kind}": text.format(name) for kind, text in headings.items() for name in objectives}


def main_table(rows: dict, objectives) -> tuple[pd.DataFrame, dict]:
    """The metrics, a row a script and setting, and its columns."""
    table = pd.DataFrame([main_results.row_of_runs(key, replicates, objectives) for key, replicates in rows.items()])
    shared = (
        "score_greedy",
        "score_sampled",
        "seeds_to_tell",
        "sd_over_episodes",
        *main_results.FRONT,
        *main_results.GAINS,
    )
    columns = {name: text for name, text in main_results.COLUMNS.items() if name in shared}
    return table, ROW_COLUMNS | columns | columns_of(RESPONSES, objectives)


def detailed_table(rows: dict, objectives) -> tuple[pd.DataFrame, dict]:
    """The returns, a row a script, setting and weight, and its columns."""
    found, weights = [], [f"weight_{name}" for name in objectives]
    for key, replicates in rows.items():
        ours = pd.concat([detailed_objectives.by_weight(one) for one in replicates])
        for weight, at_weight in ours.groupby(level=weights):
            found.append(detailed_objectives.row_at(key, dict(zip(weights, weight, strict=True)), at_weight))
    columns = ROW_COLUMNS | {name: name.replace("_", " ") for name in weights} | columns_of(DETAILS, objectives)
    return pd.DataFrame(found), columns


def file_stem(env_id: str) -> str:
    """An environment's id as part of a file's name, without what ends one."""
    return env_id.split(":")[-1].replace("/", "-").replace(".", "-")


def make(results) -> dict[str, tuple[pd.DataFrame, dict]]:
    """File name -> table and columns."""
    tables = {}
    for env_id in dict.fromkeys(key[1] for key in results.rows):
        rows = {key: one for key, one in results.rows.items() if key[1] == env_id and one}
        objectives = results.objectives(env_id)
        if objectives != PAIR:
            rows |= {key: one for key, one in main_results.constant_plans(results, [env_id]).items() if one}
            name = file_stem(env_id)
            for stem, table in zip(STEMS, (main_table, detailed_table), strict=True):
                tables[f"{stem}_{name}"] = table(rows, objectives)
    return tables
