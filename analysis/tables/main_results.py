"""Main comparison: the score of every method, its other metrics, whether it follows the preference; constant plans.

The score is 100 x the gain over doing nothing, over that of the best constant plan of each weight. Score and gain have
intervals over training seeds and test sites together, the rest over training seeds. `seeds to tell 0.1` is how
many a method it takes to tell another apart whose gain differs by so much. All but the sampled score is of the
greedy policy.
"""

import numpy as np
import pandas as pd

from analysis import metrics
from analysis.studies.constant_plans import CONIFERS, DECIDUOUS, ENVIRONMENTS, as_evaluation
from analysis.tables.common import ROW_COLUMNS, over_seeds, paper, paper_name, row_of
from cleanrl_style import protocol
from cleanrl_style.protocol.fronts import evaluation_weights

MADE_BY = "python analysis/reproduce.py --only main"
#: Rows of plans that look at nothing: name -> title, and the action every year; None: the best of each weight.
CONSTANT_PLANS = {
    "dense_conifer": ("100 conifers a year", CONIFERS),
    "dense_deciduous": ("100 deciduous trees a year", DECIDUOUS),
    "best_constant_mix": ("best constant plan of each weight", None),
}
COLUMNS = ROW_COLUMNS | {
    "score_greedy": "score, greedy",
    "score_sampled": "score, sampled",
    "gain_scalarized": "gain",
    "seeds_to_tell": "seeds to tell 0.1",
    "gain_hypervolume": "gain hypervolume",
    "scalarized": "scalarised",
    "paper_scalarized": "scalarised (paper)",
    "sd_over_episodes": "sd over episodes",
    "paper_sd_over_episodes": "sd over episodes (paper)",
    "hypervolume": "hypervolume of returns",
    "paper_hypervolume": "hypervolume (paper)",
    "paper_detail_hypervolume": "hypervolume (paper's details)",
    "sparsity": "sparsity",
    "paper_sparsity": "sparsity (paper)",
    "paper_detail_sparsity": "sparsity (paper's details)",
    "expected_utility": "expected utility",
    "cardinality": "cardinality",
    "gain_sparsity": "gain sparsity",
    "carbon_change": "carbon, weight 1 less 0",
    "thaw_change": "thaw, weight 1 less 0",
    "carbon_slope": "slope of carbon",
    "thaw_slope": "slope of thaw",
}
TERMINAL = tuple(COLUMNS.values())[:9]


def front_metrics(evaluation: pd.DataFrame, prefix: str = "", reference: float = metrics.REFERENCE_POINT) -> dict:
    """Mean scalarised return, hypervolume and sparsity of one run; one point has no sparsity."""
    front = metrics.mean_returns(evaluation).to_numpy()
    return {
        f"{prefix}scalarized": metrics.mean_scalarized(evaluation),
        f"{prefix}hypervolume": metrics.hypervolume(front, reference),
        f"{prefix}sparsity": metrics.sparsity(front) if np.ptp(front, axis=0).any() else np.nan,
    }


def gain_metrics(gains: pd.DataFrame) -> dict:
    """The same of gains, whose hypervolume is above doing nothing."""
    return front_metrics(gains, "gain_", 0.0)


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
    return row if gains is None else row | gain_metrics(gains)


def scores(replicates: list) -> dict:
    """Score of both policies and gain of the primary one, each with its interval over seeds and sites together."""
    row = {name: np.nan for name in ("gain_scalarized", "score_greedy", "score_sampled")}
    known = [one for one in replicates if one.gains is not None]
    if not known or len(known) < len(replicates):
        return row
    row |= named("gain_scalarized", *joint([one.gains for one in known], None))
    row["seeds_to_tell"] = metrics.seeds_to_tell([metrics.mean_scalarized(one.gains) for one in known])
    for policy in protocol.POLICIES:
        tables = [one.by_policy.get(policy) for one in known]
        if known[0].plans is not None and all(table is not None for table in tables):
            row |= named(f"score_{policy}", *joint(tables, known[0].plans))
    return row


def joint(tables: list[pd.DataFrame], plans: pd.DataFrame | None) -> tuple[float, float, float]:
    """Score, or without plans the gain, over training seeds, with its interval; tables : of the seeds' gains."""
    weights = np.unique(metrics.weights_of(tables[0]), axis=0)
    by_site = pd.DataFrame([metrics.of_sites(table) for table in tables])
    if by_site.isna().any(axis=None):
        raise ValueError("score: the seeds of a row were evaluated on different sites")
    return metrics.score_interval(by_site, None if plans is None else metrics.plans_of_sites(plans, weights))


def named(name: str, value: float, low: float, high: float) -> dict[str, float]:
    """A value and its interval under the names that tables give them."""
    return {name: value, f"{name}_low": low, f"{name}_high": high}


FRONT = ("scalarized", "hypervolume", "sparsity", "expected_utility", "cardinality")
GAINS = ("gain_scalarized", "gain_hypervolume", "gain_sparsity")


def numbers(objectives) -> list[str]:
    """What `run_metrics` gives of runs with these objectives."""
    responses = [f"{name}_{kind}" for kind in ("change", "slope") for name in objectives]
    return [*FRONT, *GAINS, *responses, "sd_over_episodes"]


def row_of_runs(key: tuple, replicates: list, objectives=("carbon", "thaw")) -> dict:
    """A row: statistics over training seeds, of the evaluation and the gains of each."""
    rows = [run_metrics(one.evaluation, one.gains) for one in replicates]
    table = pd.DataFrame(rows, columns=numbers(objectives))
    responses = table.columns[table.columns.str.endswith(("_change", "_slope"))]
    if table[responses].notna().any(axis=None):  # what does the same at every weight is one that does not respond
        table[responses] = table[responses].fillna(0.0)
    row = row_of(key, len(table)) | over_seeds(table.drop(columns=["gain_scalarized", "sd_over_episodes"]))
    return row | scores(replicates) | {"sd_over_episodes": table.sd_over_episodes.mean()}


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


def constant_plans(results, env_ids=ENVIRONMENTS) -> dict[tuple, list]:
    """Rows of the constant plans: (name, environment, setting) -> its evaluation, as a replicate without a run."""
    rows = {}
    for env_id in env_ids:
        for name, (_, action) in CONSTANT_PLANS.items():
            key = name, env_id, "default"
            rows[key] = []
            plans = results.constant_plans_in(env_id, "asymmetric", None)
            if plans is not None and (action is None or (plans.action == action).any()):
                number = len(metrics.objectives_of(plans.columns))
                evaluation = as_evaluation(plans, evaluation_weights(number), action)
                rows[key] = [results.replicate([], dict.fromkeys(protocol.POLICIES, evaluation), env_id)]
    return rows


def make(results) -> pd.DataFrame:
    """One row per script, environment and setting, those trained on the asymmetric reward in generalist mode."""
    replicates = {
        key: its_replicates
        for key, its_replicates in results.rows.items()
        if key[1] in ENVIRONMENTS and "thaw_formulation" not in key[2]
    }
    replicates |= constant_plans(results)
    published, rows = paper_rows(), []
    for key in sorted(replicates, key=lambda key: ENVIRONMENTS.index(key[1])):
        row = row_of_runs(key, replicates[key])
        if paper_name(*key) in published.index:
            row |= published.loc[paper_name(*key)].to_dict()
        rows.append(row)
    return pd.DataFrame(rows)
