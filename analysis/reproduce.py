"""Runs every experiment of the paper (analysis/experiments.py), archives the runs, makes tables, figures, documents.

    python analysis/reproduce.py                     everything, the main table first; the same command goes on
    python analysis/reproduce.py --only main thaw    some of analysis/experiments.py's groups
    python analysis/reproduce.py --quick             every kind of experiment in small, in a few minutes
    python analysis/reproduce.py --list              the commands, without running them

One process a core. A job whose run is finished is not started; an interrupted one goes on where it stopped.
"""

import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from analysis import archive, claims, document_results, experiments, make_figures, make_tables, paths, runs
from cleanrl_style import protocol
from sim.block import KERNELS
from sim.stands import available_cores

Experiment = Literal[tuple(experiments.EXPERIMENTS)]
POLL_SECONDS, REPORT_SECONDS = 0.5, 30.0
STOP_SECONDS = 30.0  # that a job has to end by itself
LAST_LINES = 8  # of a failed job's output
TAIL_BYTES = 4000


@dataclass
class Args:
    """Runs every experiment of the paper; the same command goes on where it was stopped."""

    only: tuple[Experiment, ...] = tuple(experiments.EXPERIMENTS)
    """which experiments"""
    seeds: tuple[int, ...] | None = None
    """which training seeds (None: all that an experiment has)"""
    quick: bool = False
    """every kind of experiment in small, into runs/quick and results/quick"""
    list: bool = False
    """print the commands and stop"""
    skip_archived: bool = False
    """count the runs of results/runs as finished"""


@dataclass
class Running:
    """A job under way: its process, its core, where its output goes and when it started."""

    job: experiments.Job
    process: subprocess.Popen
    core: int
    log: Path

    def tail(self) -> str:
        """The end of its output."""
        with self.log.open("rb") as file:
            file.seek(max(0, self.log.stat().st_size - TAIL_BYTES))
            return file.read().decode(errors="replace")

    def steps(self) -> int:
        """Environment steps of training done so far, by its last progress line."""
        done = re.findall(r"training ([\d,]+)/", self.tail())
        return int(done[-1].replace(",", "")) if done else 0


def start(job: experiments.Job, core: int, log: Path) -> Running:
    """Start a job on one core, in a process group of its own, so that Ctrl-C reaches it through `stop` alone."""
    log.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, str(experiments.ROOT / job.path), *job.arguments]
    pinned = hasattr(os, "sched_setaffinity")
    before = os.sched_getaffinity(0) if pinned else None
    with log.open("wb") as output:
        if pinned:  # a child inherits it
            os.sched_setaffinity(0, {core})
        try:
            process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
        finally:
            if pinned:
                os.sched_setaffinity(0, before)
    return Running(job, process, core, log)


def stop(running: list[Running]) -> None:
    """End the jobs under way."""
    for one in running:
        one.process.terminate()
    for one in running:
        try:
            one.process.wait(STOP_SECONDS)
        except subprocess.TimeoutExpired:
            one.process.kill()
            one.process.wait()


def log_name(job: experiments.Job) -> str:
    """File name of a job's output."""
    words = [job.script, *(f"{k}={v}" for k, v in job.flags.items() if k not in ("run_dir", "eval_weights"))]
    return "_".join(word.replace("/", "-") for word in words) + ".log"


def report(done: int, total: int, steps: int, all_steps: int, begun: float, earlier: int, running) -> str:
    """The progress line; `earlier` steps were done before this command began."""
    rate = (steps - earlier) / (time.monotonic() - begun)
    left = f"{(all_steps - steps) / rate / 3600:.1f} h left" if rate > 0 else "time left not known yet"
    names = "; ".join(log_name(one.job).removesuffix(".log") for one in running)
    return f"{done}/{total} jobs, {steps:,} of {all_steps:,} steps, {rate:,.0f} steps/s, {left} | {names}"


def run_jobs(jobs: list, log_dir: Path, cores: list[int], finished, poll=POLL_SECONDS) -> list:
    """Run the jobs in order, one a core at once; returns the failed ones.

    finished : job -> whether it need not be run; poll : seconds between looks at the processes.
    """
    waiting = [job for job in jobs if not finished(job)]
    done, failed, running = len(jobs) - len(waiting), [], []
    all_steps = sum(job.steps for job in jobs)
    steps = earlier = all_steps - sum(job.steps for job in waiting)
    begun, reported = time.monotonic(), -REPORT_SECONDS
    try:
        while waiting or running:
            free = [core for core in cores if core not in {one.core for one in running}]
            while waiting and free and not (waiting[0].waits and running):
                job = waiting.pop(0)
                running.append(start(job, free.pop(0), log_dir / log_name(job)))
            time.sleep(poll)
            for one in [one for one in running if one.process.poll() is not None]:
                running.remove(one)
                if one.process.returncode:
                    failed.append(one.job)
                    all_steps -= one.job.steps
                    last = "\n    ".join(one.tail().splitlines()[-LAST_LINES:])
                    print(f"FAILED: {one.job.command}\n    {last}\n    (all of it: {one.log})", flush=True)
                else:
                    done += 1
                    steps += one.job.steps
            if time.monotonic() - reported >= REPORT_SECONDS or not (waiting or running):
                reported = time.monotonic()
                under_way = sum(one.steps() for one in running)
                print(report(done, len(jobs), steps + under_way, all_steps, begun, earlier, running), flush=True)
    finally:
        stop(running)
    return failed


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
    jobs = experiments.quick_jobs(args.only) if args.quick else experiments.jobs(args.only, seeds)
    if args.list:
        print("\n".join(job.command for job in jobs))
        return
    for script in dict.fromkeys(job.script for job in jobs if not job.exists):
        print(f"no script yet: {script}.py; its jobs are left out", file=sys.stderr)
    jobs = [job for job in jobs if job.exists]
    runs_dir, archive_dir = paths.runs(args.quick), paths.archive(args.quick)
    roots = (runs_dir, archive_dir) if args.skip_archived else (runs_dir,)
    configs = finished_configs(*roots)

    def finished(job):
        return not job.is_study and any(job.made(config) for config in configs)

    protocol.compile_physics(KERNELS)
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else list(range(available_cores()))
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        failed = run_jobs(jobs, runs_dir / "logs", cores, finished)
    except KeyboardInterrupt:
        sys.exit("\nstopped; the same command goes on from here")
    archive.archive(runs_dir, archive_dir)
    results = paths.results(args.quick)
    make_tables.main(make_tables.Args(quick=args.quick, tables_dir=results / "tables"))
    make_figures.main(make_figures.Args(quick=args.quick, figures_dir=results / "figures"))
    claims.main(claims.Args(quick=args.quick))
    if not args.quick:
        document_results.main(document_results.Args())
    if failed:
        sys.exit("failed, try the same command again:\n" + "\n".join(f"  {job.command}" for job in failed))


if __name__ == "__main__":
    main(protocol.parse(Args))
