"""Puts what tables, figures and claims read of every finished run into results/runs, the same bytes every time.

    python analysis/archive.py [--runs-dir runs] [--archive-dir results/runs]

A run's folder there has its config.json as it is, tables.zip with the tables that `analysis/reduction.py` names, and,
of the runs of the main table, on either task, and of plan regression, policy.pt: the agent, which
`cleanrl_style.protocol.load_policy` loads.
"""

import io
import shutil
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

from analysis import experiments, paths, reduction, runs
from cleanrl_style import protocol
from cleanrl_style.protocol.run_folder import folder_name

POLICY = "policy.pt"
WITH_POLICY = ("main", "balanced", "bandit")


@dataclass
class Args:
    """Archives the finished runs."""

    runs_dir: Path = paths.runs()
    """folder that holds the runs, at any depth"""
    archive_dir: Path = paths.archive()
    """folder of the archive"""


def tables_of(run: runs.Run) -> bytes:
    """A run's tables as a zip without times in it."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as packed:
        for name, table in run.tables.items():
            member = zipfile.ZipInfo(f"{name}.csv")  # of 1980, wherever and whenever it is written
            member.create_system = 0
            packed.writestr(member, reduction.as_text(name, table), zipfile.ZIP_DEFLATED, compresslevel=9)
    return file.getvalue()


def folder_of(config: dict, archive_dir: Path) -> Path:
    """Where a run is archived: as `runs/` has it by default, wherever the run itself lies."""
    arguments = config["arguments"]
    changed = {name: tuple(v) if isinstance(v, list) else v for name, v in config["not_default"].items()}
    return archive_dir / config["script"] / folder_name(arguments["env_id"], changed) / f"seed{arguments['seed']}"


def archive_run(run: runs.Run, archive_dir: Path, jobs: list[experiments.Job]) -> bool:
    """Archive a run, its policy if a job of `WITH_POLICY` made it; False if the archive has the same bytes."""
    folder, policy = folder_of(run.config, archive_dir), run.folder / POLICY
    keeps_policy = policy.exists() and any(job.experiment in WITH_POLICY and job.made(run.config) for job in jobs)
    kept = {"config.json": (run.folder / "config.json").read_bytes()}
    kept |= {POLICY: policy.read_bytes()} if keeps_policy else {}
    kept[runs.ARCHIVED] = tables_of(run)  # last: it declares the run finished
    if kept == {name: (folder / name).read_bytes() for name in kept if (folder / name).exists()}:
        return False
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    for name, content in kept.items():
        with protocol.replacing(folder / name) as file:
            file.write(content)
    return True


def archive(runs_dir: Path, archive_dir: Path) -> None:
    """Archive every finished run of a folder; says what it left out, and how large the archive is."""
    if not runs_dir.is_dir():
        protocol.fail(f"--runs-dir {runs_dir}: no such folder")
    inside = archive_dir.resolve().is_relative_to(runs_dir.resolve())
    if inside or runs_dir.resolve().is_relative_to(archive_dir.resolve()):
        protocol.fail(f"--archive-dir {archive_dir}: a folder that is neither in --runs-dir {runs_dir} nor around it")
    paths.make_writable("--archive-dir", archive_dir)
    found, left_out = runs.read_runs(runs_dir)
    for line in left_out:
        print(f"not archived: {line}", file=sys.stderr)
    jobs = [*experiments.jobs(), *experiments.quick_jobs()]
    new = sum(archive_run(run, archive_dir, jobs) for run in found)
    size = sum(path.stat().st_size for path in archive_dir.rglob("*") if path.is_file())
    print(f"{archive_dir}: {new} runs new of {len(found)}, {size / 1e6:.1f} MB in all")


if __name__ == "__main__":
    args = protocol.parse(Args)
    archive(args.runs_dir, args.archive_dir)
