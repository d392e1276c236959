"""Copies what tables and figures read of every finished run into results/runs, compressed, the same bytes every time.

    python analysis/archive.py [--runs-dir runs] [--archive-dir results/runs]

Kept of a run: config.json as it is; the evaluation, updates and timing, every row; of the training episodes every
k-th, with the least k that leaves at most 6000 (all of 300,000 steps); of the annual record the sampled policy at the
weights 0, 0.5 and 1. Numbers have six significant digits, seeds all of theirs.
"""

import gzip
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from analysis import runs
from cleanrl_style import protocol

MOST_EPISODES = 6000
FLOAT_FORMAT = "%.6g"
# The evaluation is written last: it declares the run finished.
TABLES = ("episodes", "updates", "timing", "evaluation_years", "evaluation")


@dataclass
class Args:
    """Archives the finished runs."""

    runs_dir: Path = runs.RUNS_DIR
    """folder that holds the runs, at any depth"""
    archive_dir: Path = runs.ARCHIVE_DIR
    """folder of the archive"""


def thin(name: str, table: pd.DataFrame) -> pd.DataFrame:
    """The rows of a run's table that are kept."""
    if name == "episodes":
        return table.iloc[:: -(-len(table) // MOST_EPISODES) or 1]
    if name == "evaluation_years":
        return table[(table.policy == "sampled") & table.preference.isin(runs.KEPT_WEIGHTS)]
    return table


def write_compressed(path: Path, table: pd.DataFrame) -> None:
    """A table as gzip without time or name in its header, whole or not at all."""
    text = table.to_csv(index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
    with protocol.replacing(path) as file, gzip.GzipFile("", "wb", compresslevel=9, fileobj=file, mtime=0) as packed:
        packed.write(text.encode())


def folder_of(config: dict, archive_dir: Path) -> Path:
    """Where a run is archived: as `runs/` has it by default, wherever the run itself lies."""
    arguments, changed = config["arguments"], config["not_default"]
    name = "-".join(
        [
            arguments["env_id"].split(":")[-1].replace("/", "-"),
            *(f"{name}={runs.as_text(value)}" for name, value in changed.items()),
        ]
    )
    return archive_dir / config["script"] / name / f"seed{arguments['seed']}"


def archive_run(run: runs.Run, archive_dir: Path) -> bool:
    """Archive a run; False if the archive has it, made by the same commit."""
    folder, config = folder_of(run.config, archive_dir), (run.folder / "config.json")
    copy = folder / "config.json"
    if copy.exists() and copy.read_bytes() == config.read_bytes() and runs.table_path(folder, "evaluation"):
        return False
    tables = {name: runs.read_table(run.folder, name) for name in TABLES}
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    with protocol.replacing(copy) as file:
        file.write(config.read_bytes())
    for name, table in tables.items():
        if table is not None:
            write_compressed(folder / f"{name}.csv.gz", thin(name, table))
    return True


def archive(runs_dir: Path, archive_dir: Path) -> None:
    """Archive every finished run of a folder; says what it left out, and how large the archive is."""
    found, left_out = runs.read_runs(runs_dir)
    for line in left_out:
        print(f"not archived: {line}", file=sys.stderr)
    new = sum(archive_run(run, archive_dir) for run in found)
    size = sum(path.stat().st_size for path in archive_dir.rglob("*") if path.is_file())
    print(f"{archive_dir}: {new} runs new of {len(found)}, {size / 1e6:.1f} MB in all")


if __name__ == "__main__":
    args = protocol.parse(Args)
    archive(args.runs_dir, args.archive_dir)
