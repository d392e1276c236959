"""Runs every experiment of the paper (analysis/experiments.py), archives the runs, makes tables, figures, documents.

    python analysis/reproduce.py                     everything, the main table first; the same command goes on
    python analysis/reproduce.py --only main thaw    some of analysis/experiments.py's groups
    python analysis/reproduce.py --only main balanced --untrained    the fixed strategies and constant plans alone
    python analysis/reproduce.py --quick             every kind of experiment in small, in a few minutes
    python analysis/reproduce.py --list              the commands, without running them

One process a core. A job whose run is finished is not started; an interrupted one goes on where it stopped.
"""

import importlib.util
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from analysis import (
    archive,
    claims,
    commands,
    document_results,
    experiments,
    make_figures,
    make_tables,
    methods,
    paths,
    runs,
)
from cleanrl_style import protocol
from sim.block import KERNELS
from sim.executor import HERE, NoCluster, check_address

Experiment = Literal[tuple(experiments.EXPERIMENTS)]


@dataclass
class Args:
    """Runs every experiment of the paper; the same command goes on where it was stopped."""

    only: tuple[Experiment, ...] = tuple(experiments.EXPERIMENTS)
    """which experiments"""
    untrained: bool = False
    """only what trains nothing and reads no training: fixed strategies, constant plans, studies of the simulator"""
    seeds: tuple[int, ...] | None = None
    """which training seeds (None: all that an experiment has)"""
    quick: bool = False
    """every kind of experiment in small, into runs/quick and results/quick"""
    list: bool = False
    """print the commands and stop"""
    skip_archived: bool = False
    """count the runs of results/runs as finished"""
    address: str = HERE
    """where: "none", processes of this machine; "local", Ray on it; or the address of a Ray cluster"""


def log_name(job: experiments.Job) -> str:
    """File name of a job's output."""
    words = [job.script, *(f"{k}={v}" for k, v in job.flags.items() if k not in ("run_dir", "eval_weights"))]
    return "_".join(word.replace("/", "-") for word in words) + ".log"


def command(job: experiments.Job, logs: Path) -> commands.Command:
    """What runs a job."""
    words = (str(experiments.ROOT / job.path), *job.arguments)
    return commands.Command(words, logs / log_name(job), job.steps, job.waits)


def finished_configs(*roots: Path) -> list[dict]:
    """Configurations of the finished runs below the folders."""
    configs = []
    for folder in (folder for root in roots for folder in runs.run_folders(root)):
        try:
            configs.append(runs.read_config(folder) if runs.is_finished(folder) else None)
        except ValueError as error:
            print(f"{folder}: {error}", file=sys.stderr)
    return [config for config in configs if config]


def main(args: Args) -> None:
    """Run what is not finished, archive it, and make tables, figures and the documents that show results."""
    seeds = None if args.seeds is None else list(args.seeds)
    if args.quick and seeds is not None:
        protocol.fail("--seeds is not for --quick, whose runs have seed 1")
    known = {job.flags["seed"] for job in experiments.jobs() if "seed" in job.flags}
    for seed in sorted(set(seeds or ()) - known):
        protocol.fail(f"--seeds {seed}: allowed are {', '.join(map(str, sorted(known)))}")
    jobs = experiments.quick_jobs(args.only) if args.quick else experiments.jobs(args.only, seeds)
    if args.untrained:
        jobs = [job for job in jobs if not job.trains and not job.waits]
    if args.list:
        print("\n".join(job.command for job in jobs))
        return
    libraries = [name for name in ("morl_baselines", "sb3_contrib") if importlib.util.find_spec(name) is None]
    if libraries and any(job.script in methods.OUTSIDE for job in jobs):
        jobs = [job for job in jobs if job.script not in methods.OUTSIDE]
        print(
            f'not installed: {", ".join(libraries)} (pip install -e ".[outside]"); algorithms of other libraries are '
            "left out",
            file=sys.stderr,
        )
    runs_dir, archive_dir = paths.runs(args.quick), paths.archive(args.quick)
    roots = (runs_dir, archive_dir) if args.skip_archived else (runs_dir,)
    configs = finished_configs(*roots)

    def finished(job):
        return not job.is_study and any(job.made(config) for config in configs)

    try:
        check_address(args.address)
    except ValueError as error:
        protocol.fail(f"--{error}")
    paths.make_writable("runs in", runs_dir)
    protocol.compile_physics(KERNELS)
    waiting = [command(job, runs_dir / "logs") for job in jobs if not finished(job)]
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        failed = commands.run_all(waiting, len(jobs), address=args.address)
    except KeyboardInterrupt:
        sys.exit("\nstopped; the same command goes on from here")
    except NoCluster as error:
        protocol.fail(f"--{error}")
    archive.archive(runs_dir, archive_dir)
    results = paths.results(args.quick)
    make_tables.main(make_tables.Args(quick=args.quick, tables_dir=results / "tables"))
    make_figures.main(make_figures.Args(quick=args.quick, figures_dir=results / "figures"))
    claims.main(claims.Args(quick=args.quick))
    if not args.quick:
        document_results.main(document_results.Args())
    if failed:
        sys.exit("failed, try the same command again:\n" + "\n".join(f"  {one}" for one in failed))


if __name__ == "__main__":
    main(protocol.parse(Args))
