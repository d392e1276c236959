"""Time and memory: training from the runs' timing.csv, the rest from results/benchmark.csv, beside the paper's."""

import numpy as np
import pandas as pd

from analysis import paths
from analysis.tables.common import over_seeds, paper

MADE_BY = "python analysis/reproduce.py --only main site"
COLUMNS = {"quantity": "quantity", "unit": "unit", "seeds": "runs", "ours": "ours", "paper": "paper", "source": "from"}
TRAINED = {  # our row -> experiment, script, the paper's row
    "EUPG, generalist": ("main", "eupg_var_lambda", "training_generalist_300k_steps"),
    "PPO Gated, generalist": ("main", "ppo_gated", "training_generalist_300k_steps"),
    "Curriculum PPO, generalist": ("main", "ppo_curriculum", "training_generalist_300k_steps"),
    "EUPG, site-specific": ("site", "eupg_fixed_lambda", "training_site_specific_100k_steps"),
}
PHASES = ("rollout", "update", "evaluation")


def hours(run) -> dict:
    """Hours of a run by phase; `training` is rollouts and updates."""
    by_phase = run.tables["timing"].set_index("phase").seconds.reindex([*PHASES, "environment"]) / 3600
    training = by_phase["rollout"] + by_phase["update"]
    return {
        "training": training,
        "evaluation": by_phase["evaluation"],
        "environment": 100 * by_phase["environment"] / training,
    }


def published(name: str) -> str:
    """A row of the paper's running times as low - high."""
    row = paper("runtime", index_col="quantity").loc[name]
    return f"{row.low:g} - {row.high:g} {row.unit}" if row.low != row.high else f"{row.low:g} {row.unit}"


def make(results) -> pd.DataFrame:
    """Training by method, then what the benchmark measured."""
    rows, quoted = [], set()
    for what, (experiment, script, name) in TRAINED.items():
        what = f"{what}, {results.first_job(experiment, script).steps:,} steps on one core"
        runs = [run for one in results.of(experiment, script) for run in one.runs]
        columns = ["training", "evaluation", "environment"]
        table = pd.DataFrame([hours(run) for run in runs], columns=columns).astype(float)
        quoted.add(name)
        for column, unit, theirs in (
            ("training", "h", published(name)),
            ("evaluation", "h", ""),
            ("environment", "% of training", ""),
        ):
            row = over_seeds(table[[column]].set_axis(["ours"], axis=1))
            rows.append(
                {
                    "quantity": f"{what}: {column}",
                    "unit": unit,
                    "seeds": table[column].count() or (np.nan if runs else 0),  # those that were timed
                    "paper": theirs,
                    "source": "timing.csv",
                    **row,
                }
            )
    benchmark = paths.results() / "benchmark.csv"
    if benchmark.exists():
        for row in pd.read_csv(benchmark).itertuples():
            rows.append(
                {
                    "quantity": row.what,
                    "unit": row.unit,
                    "ours": row.median,
                    "ours_low": row.low,
                    "ours_high": row.high,
                    "paper": "" if pd.isna(row.paper) else row.paper,
                    "source": "benchmark.py (lowest, highest)",
                }
            )
    for name in paper("runtime").quantity:
        if name not in quoted:
            ours = 365 * 48 if name == "physics_steps_per_year" else np.nan
            rows.append(
                {
                    "quantity": name,
                    "ours": ours,
                    "paper": published(name),
                    "source": "365 days of 48" if ours == ours else "analysis/benchmark.py, profile_kernel.py",
                }
            )
    return pd.DataFrame(rows)
