"""Finished runs on disk: those of `runs/`, and the archive in `results/runs/`, whose tables are compressed.

A run is recognised by its config.json, never by the name of its folder, and is finished when its evaluation is there.
"""

import json
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import metrics
from cleanrl_style.protocol.evaluation import EVALUATION_COLUMNS, MODES

RUNS_DIR, ARCHIVE_DIR = Path("runs"), Path("results/runs")
QUICK = "quick"  # folder of runs/ with the runs of `reproduce.py --quick`, which are no results

# Weights whose annual record tables and figures read; the archive has no other.
KEPT_WEIGHTS = (0.0, 0.5, 1.0)

# Arguments that do not make another row: what tells its runs apart, what the row has a column for, and the output.
NOT_A_SETTING = ("seed", "site_seed", "preference", "mode", "env_id", "run_dir", "overwrite")


@dataclass(frozen=True)
class Run:
    """A finished run: its configuration, the evaluation of its sampled policy, and its other tables."""

    folder: Path
    config: dict
    evaluation: pd.DataFrame
    episodes: pd.DataFrame | None  # of the training; None for a fixed strategy
    timing: pd.DataFrame  # seconds by phase
    years: pd.DataFrame | None  # annual record of the sampled policy at KEPT_WEIGHTS: statistics over the episodes

    @property
    def script(self) -> str:
        """Name of the script, without .py."""
        return self.config["script"]

    @property
    def arguments(self) -> dict:
        """Every argument of the script."""
        return self.config["arguments"]

    @property
    def setting(self) -> str:
        """What is not default in the run, but for what tells replicates apart: runs that agree in it are one row."""
        return setting(self.config["not_default"], self.arguments["env_id"])


def setting(not_default: dict, env_id: str) -> str:
    """name=value of the arguments that make a row, "default" if there are none; which single site, makes none."""
    items = {name: value for name, value in not_default.items() if name not in NOT_A_SETTING}
    if not_default.get("site_seed") is not None and MODES.get(env_id) != "site-specific":
        items["site_seed"] = "one"
    return ", ".join(f"{name}={as_text(value)}" for name, value in sorted(items.items())) or "default"


def as_text(value) -> str:
    """An argument as rows and folders name it."""
    return ",".join(f"{v:g}" for v in value) if isinstance(value, (list, tuple)) else str(value)


def identity(config: dict) -> str:
    """The same for two folders exactly if they hold the same run."""
    return json.dumps([config["script"], config["arguments"]], sort_keys=True)


def table_path(folder: Path, name: str) -> Path | None:
    """A run's table, plain or compressed; None if it has none of that name."""
    candidates = (folder / f"{name}.csv", folder / f"{name}.csv.gz")
    return next((path for path in candidates if path.exists()), None)


def read_table(folder: Path, name: str) -> pd.DataFrame | None:
    """A run's table, None if it has none; ValueError if it cannot be read."""
    path = table_path(folder, name)
    if path is None:
        return None
    try:
        return pd.read_csv(path)
    except (ValueError, OSError, EOFError, zlib.error) as error:
        raise ValueError(f"damaged: {path.name} ({error})") from error


def read_config(folder: Path) -> dict:
    """A run's configuration; ValueError if it cannot be used."""
    try:
        config = json.loads((folder / "config.json").read_text(encoding="utf-8"))
        config["script"], config["not_default"]
        for name in ("env_id", "seed", "eval_weights", "eval_episodes", "thaw_formulation", "site_seed"):
            config["arguments"][name]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"damaged: config.json ({error!r})") from error
    return config


def read_run(folder: Path) -> Run:
    """A run; ValueError says why it cannot be used."""
    config = read_config(folder)
    evaluation = read_table(folder, "evaluation")
    if evaluation is None:
        raise ValueError("unfinished: it has no evaluation.csv")
    missing = set(EVALUATION_COLUMNS) - set(evaluation.columns)
    if missing:
        raise ValueError(f"damaged: evaluation.csv lacks the column {sorted(missing)[0]}")
    evaluation = evaluation[evaluation.policy == "sampled"]
    arguments = config["arguments"]
    # a fixed-weight agent is evaluated at its own weight alone
    weights = [arguments["preference"]] if "preference" in arguments else arguments["eval_weights"]
    expected = len(weights) * arguments["eval_episodes"]
    if len(evaluation) != expected:
        raise ValueError(
            f"damaged: evaluation.csv has {len(evaluation)} episodes of the sampled policy, not {expected}"
        )
    if not np.isfinite(evaluation[metrics.OBJECTIVES].to_numpy(dtype=float)).all():
        raise ValueError("damaged: evaluation.csv has returns that are not finite numbers")
    episodes = required_table(folder, "episodes") if "total_timesteps" in arguments else None
    timing = required_table(folder, "timing")
    years = required_table(folder, "evaluation_years") if arguments["env_id"] in MODES else None
    if years is not None:
        years = years[(years.policy == "sampled") & years.preference.isin(KEPT_WEIGHTS)]
    return Run(folder, config, evaluation, episodes, timing, years)


def required_table(folder: Path, name: str) -> pd.DataFrame:
    """A table that a finished run has; ValueError if it is missing or cannot be read."""
    table = read_table(folder, name)
    if table is None:
        raise ValueError(f"partial: it has no {name}.csv")
    return table


def run_folders(root: Path) -> list[Path]:
    """Folders below `root` that hold a config.json, in order; those of `reproduce.py --quick` only if asked for."""
    folders = sorted(path.parent for path in root.rglob("config.json"))
    return [folder for folder in folders if folder.relative_to(root).parts[:1] != (QUICK,)]


def read_runs(*roots: Path) -> tuple[list[Run], list[str]]:
    """All usable runs below the folders, and one line for each that was left out.

    The same run below two of the folders counts once, the first; twice below one folder it is reported.
    """
    runs, left_out, seen = [], [], {}
    for root in roots:
        for folder in run_folders(root):
            try:
                run = read_run(folder)
            except ValueError as error:
                left_out.append(f"{folder}: {error}")
                continue
            first_root, first_folder = seen.setdefault(identity(run.config), (root, folder))
            if first_folder == folder:
                runs.append(run)
            elif first_root == root:
                left_out.append(f"{folder}: the same run as {first_folder}")
    return runs, left_out
