"""Gated PPO trained on each formulation of the thaw reward, under its own reward and under the asymmetric one.

A formulation changes the unit of the thaw return, so that gains compare under one reward alone, the asymmetric one.
"""

import pandas as pd

from analysis import metrics
from analysis.tables.common import over_seeds, paper
from analysis.tables.main_results import front_metrics
from cleanrl_style import protocol
from cleanrl_style.protocol.evaluation import ASYMMETRIC

MADE_BY = "python analysis/reproduce.py --only main thaw"
FORMULATIONS = {"asymmetric": "main", "contrast": "thaw", "raw_degree_days": "thaw"}  # -> experiment
COLUMNS = {
    "formulation": "formulation",
    "seeds": "seeds",
    "scalarized": "scalarised",
    "scalarized_sd": "sd over episodes",
    "paper_scalarized_mean": "scalarised (paper)",
    "paper_scalarized_std": "sd (paper)",
    "carbon": "carbon",
    "carbon_sd": "sd over episodes, carbon",
    "paper_carbon_mean": "carbon (paper)",
    "thaw": "thaw",
    "thaw_sd": "sd over episodes, thaw",
    "paper_thaw_mean": "thaw (paper)",
    "hypervolume": "hypervolume of returns",
    "paper_hypervolume": "hypervolume (paper)",
    "sparsity": "sparsity",
    "paper_sparsity": "sparsity (paper)",
    "asymmetric_scalarized": "scalarised, asymmetric reward",
    "asymmetric_thaw": "thaw, asymmetric reward",
    "asymmetric_gain": "gain, asymmetric reward",
}
SPREADS = ["scalarized_sd", "carbon_sd", "thaw_sd"]


def replicates_of(results, formulation: str) -> list:
    """Runs of gated PPO trained on a formulation."""
    flags = {} if formulation == "asymmetric" else {"thaw_formulation": formulation}
    return results.of(FORMULATIONS[formulation], "ppo_gated", **flags)


def under_asymmetric(results, one):
    """A replicate whose episodes are judged by the asymmetric reward; ValueError if its evaluation lacks that."""
    arguments = one.runs[0].arguments
    if arguments["thaw_formulation"] == "asymmetric":
        return one
    by_policy = {}
    for policy in protocol.POLICIES:
        table = pd.concat([run.of_policy(policy) for run in one.runs], ignore_index=True)
        if ASYMMETRIC not in table:
            raise ValueError(f"{one.runs[0].folder}: evaluation.csv lacks the column {ASYMMETRIC}")
        table = table.assign(thaw_return=table[ASYMMETRIC]).drop(columns=ASYMMETRIC)
        scalarized = metrics.scalarize(metrics.returns_of(table), metrics.weights_of(table))
        by_policy[policy] = table.assign(scalarized_return=scalarized)
    return results.replicate(one.runs, by_policy, arguments["env_id"])


def run_numbers(one) -> dict:
    """Numbers of one run under its own reward."""
    evaluation = one.evaluation
    return front_metrics(evaluation) | {
        "carbon": evaluation.carbon_return.mean(),
        "carbon_sd": evaluation.carbon_return.std(),
        "thaw": evaluation.thaw_return.mean(),
        "thaw_sd": evaluation.thaw_return.std(),
        "scalarized_sd": evaluation.scalarized_return.std(),
    }


def asymmetric_numbers(results, one) -> dict:
    """Its numbers under the asymmetric reward."""
    judged = under_asymmetric(results, one)
    row = {
        "asymmetric_scalarized": metrics.mean_scalarized(judged.evaluation),
        "asymmetric_thaw": judged.evaluation.thaw_return.mean(),
    }
    return row if judged.gains is None else row | {"asymmetric_gain": metrics.mean_scalarized(judged.gains)}


def make(results) -> pd.DataFrame:
    """One row per formulation."""
    published = paper("thaw_formulations", index_col="formulation").add_prefix("paper_")
    numbers = [name for name in COLUMNS if name not in ("formulation", "seeds") and not name.startswith("paper_")]
    rows = []
    for formulation in FORMULATIONS:
        found = [run_numbers(one) | asymmetric_numbers(results, one) for one in replicates_of(results, formulation)]
        table = pd.DataFrame(found, columns=numbers)
        row = {"formulation": formulation, "seeds": len(table)} | over_seeds(table.drop(columns=SPREADS))
        rows.append(row | table[SPREADS].mean().to_dict() | published.loc[formulation].to_dict())
    return pd.DataFrame(rows)
