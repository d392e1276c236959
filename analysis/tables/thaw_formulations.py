"""Gated PPO trained on each formulation of the thaw reward, under its own reward and under the asymmetric one."""

import pandas as pd

from analysis import metrics
from analysis.tables.common import over_seeds, paper
from analysis.tables.main_results import front_metrics

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
    "hypervolume": "hypervolume",
    "paper_hypervolume": "hypervolume (paper)",
    "sparsity": "sparsity",
    "paper_sparsity": "sparsity (paper)",
    "gain_scalarized": "gain",
    "asymmetric_scalarized": "scalarised, asymmetric reward",
    "asymmetric_thaw": "thaw, asymmetric reward",
}
# Column of the evaluation of a run trained on another formulation: its thaw return under the asymmetric reward.
ASYMMETRIC = "asymmetric_thaw_return"
SPREADS = ["scalarized_sd", "carbon_sd", "thaw_sd"]


def replicates_of(results, formulation: str) -> list:
    """Runs of gated PPO trained on a formulation."""
    flags = {} if formulation == "asymmetric" else {"thaw_formulation": formulation}
    if not any(
        job.flags.get("thaw_formulation", "asymmetric") == formulation
        for job in results.jobs
        if job.script == "ppo_gated"
    ):
        return []  # `reproduce.py --quick` trains on one formulation alone
    return results.of(FORMULATIONS[formulation], "ppo_gated", **flags)


def run_numbers(one) -> dict:
    """Numbers of one run; those under the asymmetric reward if the evaluation has it."""
    evaluation = one.evaluation
    row = front_metrics(evaluation) | {
        "carbon": evaluation.carbon_return.mean(),
        "carbon_sd": evaluation.carbon_return.std(),
        "thaw": evaluation.thaw_return.mean(),
        "thaw_sd": evaluation.thaw_return.std(),
        "scalarized_sd": evaluation.scalarized_return.std(),
    }
    if one.gains is not None:
        row["gain_scalarized"] = metrics.mean_scalarized(one.gains)
    if one.runs[0].arguments["thaw_formulation"] == "asymmetric":
        judged = evaluation
    elif ASYMMETRIC in evaluation:
        judged = evaluation.assign(thaw_return=evaluation[ASYMMETRIC])
    else:
        return row
    row["asymmetric_scalarized"] = metrics.mean_scalarized(judged)
    row["asymmetric_thaw"] = judged.thaw_return.mean()
    return row


def make(results) -> pd.DataFrame:
    """One row per formulation."""
    published = paper("thaw_formulations", index_col="formulation").add_prefix("paper_")
    numbers = [name for name in COLUMNS if name not in ("formulation", "seeds") and not name.startswith("paper_")]
    rows = []
    for formulation in FORMULATIONS:
        table = pd.DataFrame([run_numbers(one) for one in replicates_of(results, formulation)], columns=numbers)
        row = {"formulation": formulation, "seeds": len(table)} | over_seeds(table.drop(columns=SPREADS))
        rows.append(row | table[SPREADS].mean().to_dict() | published.loc[formulation].to_dict())
    return pd.DataFrame(rows)
