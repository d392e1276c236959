"""Main comparison: the metrics of every method, whether it follows the preference, and what constant plans reach."""

import numpy as np
import pandas as pd

from analysis import metrics
from analysis.studies.constant_plans import ENVIRONMENTS, as_evaluation
from analysis.tables.common import ROW_COLUMNS, over_seeds, paper, row_of
from cleanrl_style.protocol.fronts import evaluation_weights

TITLE = "Main results"
#: Rows of plans that look at nothing: name -> title, and whether it is the best plan of each weight.
CONSTANT_PLANS = {
    "dense_conifer": ("100 conifers a year", False),
    "best_constant_mix": ("best constant plan of each weight", True),
}
COLUMNS = ROW_COLUMNS | {
    "scalarized": "scalarised",
    "paper_scalarized": "scalarised (paper)",
    "sd_over_episodes": "sd over episodes",
    "paper_sd_over_episodes": "sd over episodes (paper)",
    "hypervolume": "hypervolume",
    "paper_hypervolume": "hypervolume (paper)",
    "paper_detail_hypervolume": "hypervolume (paper's details)",
    "sparsity": "sparsity",
    "paper_sparsity": "sparsity (paper)",
    "paper_detail_sparsity": "sparsity (paper's details)",
    "expected_utility": "expected utility",
    "cardinality": "cardinality",
    "gain_scalarized": "gain",
    "gain_hypervolume": "gain hypervolume",
    "gain_sparsity": "gain sparsity",
    "carbon_change": "carbon, weight 0 to 1",
    "thaw_change": "thaw, weight 0 to 1",
    "carbon_slope": "slope of carbon",
    "thaw_slope": "slope of thaw",
}
TERMINAL = (
    "method",
    "environment",
    "setting",
    "seeds",
    "scalarised",
    "scalarised (paper)",
    "hypervolume",
    "hypervolume (paper)",
    "gain hypervolume",
)


def front_metrics(evaluation: pd.DataFrame, prefix: str = "") -> dict:
    """Mean scalarised return, hypervolume and sparsity of one run; one point has no sparsity."""
    front = metrics.mean_returns(evaluation).to_numpy()
    return {
        f"{prefix}scalarized": metrics.mean_scalarized(evaluation),
        f"{prefix}hypervolume": metrics.hypervolume(front),
        f"{prefix}sparsity": metrics.sparsity(front) if np.ptp(front, axis=0).any() else np.nan,
    }


def run_metrics(evaluation: pd.DataFrame, gains: pd.DataFrame | None) -> dict:
    """The metrics of one run; the response to the preference only of a policy that has one."""
    front = metrics.mean_returns(evaluation)
    row = front_metrics(evaluation) | {
        "sd_over_episodes": evaluation.scalarized_return.std(),
        "expected_utility": metrics.expected_utility(front.to_numpy()),
        "cardinality": metrics.cardinality(front.to_numpy()),
    }
    if np.ptp(front.to_numpy(), axis=0).any():
        response = metrics.preference_response(evaluation)
        for name in response.index:
            for kind in ("change", "slope"):
                row[name.replace("return", kind)] = response.loc[name, kind]
    return row if gains is None else row | front_metrics(gains, "gain_")


FRONT = ("scalarized", "hypervolume", "sparsity", "expected_utility", "cardinality")
GAINS = ("gain_scalarized", "gain_hypervolume", "gain_sparsity")


def numbers(objectives) -> list[str]:
    """What `run_metrics` gives of runs with these objectives."""
    responses = [f"{name}_{kind}" for kind in ("change", "slope") for name in objectives]
    return [*FRONT, *GAINS, *responses, "sd_over_episodes"]


def row_of_runs(key: tuple, evaluations: list, objectives=("carbon", "thaw")) -> dict:
    """A row: statistics over training seeds, of the evaluation and the gains of each."""
    table = pd.DataFrame([run_metrics(*one) for one in evaluations], columns=numbers(objectives))
    row = row_of(key, len(table)) | over_seeds(table.drop(columns="sd_over_episodes"))
    return row | {"sd_over_episodes": table.sd_over_episodes.mean()}


def paper_rows() -> pd.DataFrame:
    """The paper's main table, and what its own table of details gives for the same."""
    table = paper("main_results", index_col="method")
    fronts = paper("detailed_objectives").groupby("method")[["carbon_mean", "thaw_mean"]]
    return pd.DataFrame(
        {
            "paper_scalarized": table.scalarized_mean,
            "paper_sd_over_episodes": table.scalarized_std,
            "paper_hypervolume": table.hypervolume,
            "paper_sparsity": table.sparsity,
            "paper_detail_hypervolume": fronts.apply(metrics.hypervolume),
            "paper_detail_sparsity": fronts.apply(metrics.sparsity),
        }
    )


def constant_plans(results) -> dict[tuple, list]:
    """Rows of the constant plans: (name, environment, setting) -> its evaluation and gains."""
    plans = results.study("constant_plans")
    rows = {}
    for env_id in ENVIRONMENTS:
        for name, (_, best) in CONSTANT_PLANS.items():
            key = name, env_id, "default"
            rows[key] = []
            if plans is not None:
                evaluation = as_evaluation(plans[plans.env_id == env_id], evaluation_weights(2), best)
                rows[key] = [(evaluation, results.gains(evaluation, env_id))]
    return rows


def make(results) -> pd.DataFrame:
    """One row per script, environment and setting, those trained on the asymmetric reward in generalist mode."""
    evaluations = {
        key: [(one.evaluation, one.gains) for one in replicates]
        for key, replicates in results.rows.items()
        if key[1] in ENVIRONMENTS and "thaw_formulation" not in key[2]
    }
    evaluations |= constant_plans(results)
    published, rows = paper_rows(), []
    for key in sorted(evaluations, key=lambda key: ENVIRONMENTS.index(key[1])):
        row = row_of_runs(key, evaluations[key])
        if results.paper_name(key) in published.index:
            row |= published.loc[results.paper_name(key)].to_dict()
        rows.append(row)
    return pd.DataFrame(rows)
