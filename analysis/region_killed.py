"""A region of stands under a policy that ships, killed at random moments and gone on with, against one left alone.

    python analysis/region_killed.py [--quick] [--stands 12] [--kills 3] ...

Each life of it is a process of its own; the kernel kills it where it is when it has had its share of processor time.
Writes results/region_killed.csv, one row: whether the stores are the same, byte by byte, and the largest memory of a
process.
"""

import filecmp
import multiprocessing
import random
import resource
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import sim
from analysis import paths
from boreal_env import BALANCED_WORLD
from cleanrl_style import protocol
from sim.block import lanes_for
from sim.region import many
from sim.stands import LONGEST_STEP_MINUTES, available_cores

POLICY = "ppo_group-balanced"
COLUMNS = ("policy", "stands", "years", "step_minutes", "kills", "same_bytes", "peak_mb")
IN_TIME = 0.8  # share of the time that is left in which it is killed: it may be faster than when it was left alone
KIB = 1 if sys.platform == "darwin" else 1024  # bytes of getrusage's unit


@dataclass
class Args:
    """Kills a region at random moments, goes on with it, and compares it with one that was left alone."""

    stands: int = 20_000
    """number of stands"""
    years: int = 2
    """length of the simulation"""
    step_minutes: int = 120
    """time step of the physics"""
    kills: int = 2
    """how often it is killed"""
    quick: bool = False
    """12 stands, into results/quick"""


def lanes(args: Args) -> list[int]:
    """Of the kernel that is needed."""
    return [lanes_for(many.chunk_size(args.stands, args.years), available_cores())]


def simulate(args: Args, path: Path, seconds: float, tells) -> None:
    """One life: from where the store is to its end, or to its death after so many seconds of processor time (0: none).

    tells : a pipe that is told, at the end, how many seconds it took, and its memory [MB].
    """
    policy = protocol.load_policy(POLICY)
    protocol.compile_physics(lanes(args))
    latitude = sim.SITE_PARAMETERS["latitude_deg"]
    sites = pd.DataFrame({"latitude_deg": np.linspace(latitude.low, latitude.high, args.stands)})
    world = {**BALANCED_WORLD, "time_step_minutes": args.step_minutes}
    begun = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, seconds)  # nobody handles its signal, so that it kills
    sim.simulate_many(sites, policy, path=path, years=args.years, others="sampled", **world)
    tells.send((time.process_time() - begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * KIB / 1e6))


def process_of(work, *arguments) -> multiprocessing.Process:
    """A new process, started."""
    process = multiprocessing.get_context("spawn").Process(target=work, args=arguments)
    process.start()
    return process


def life(args: Args, path: Path, seconds: float = 0.0) -> tuple[float, float] | None:
    """A process that simulates: its seconds and its memory [MB], None if it was killed."""
    hears, tells = multiprocessing.Pipe(duplex=False)
    process = process_of(simulate, args, path, seconds, tells)
    process.join()
    if process.exitcode == -signal.SIGPROF:
        return None
    if process.exitcode:
        sys.exit(f"the process of a region ended with status {process.exitcode}")
    return hears.recv()


def files_of(folder: Path) -> list[Path]:
    """Every file below a folder, by name."""
    return sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())


def run(args: Args, folder: Path) -> pd.DataFrame:
    """The row."""
    alone, killed = folder / "alone.zarr", folder / "killed.zarr"
    process_of(protocol.compile_physics, lanes(args)).join()  # apart, since a compiler needs more memory
    left, peak = life(args, alone)
    for _ in range(args.kills):
        moment = random.uniform(0.0, IN_TIME * left)
        if life(args, killed, moment) is not None:
            sys.exit("the region was finished before it could be killed; the same command tries again")
        left -= moment
    peak = max(peak, life(args, killed)[1])
    files = files_of(alone)
    _, other, missing = filecmp.cmpfiles(alone, killed, files, shallow=False)
    same = files == files_of(killed) and not other and not missing
    row = (POLICY, args.stands, args.years, args.step_minutes, args.kills, same, round(peak))
    return pd.DataFrame([row], columns=list(COLUMNS))


def main(args: Args) -> None:
    """Simulate, kill, compare and write."""
    if not 1 <= args.step_minutes <= LONGEST_STEP_MINUTES or 1440 % args.step_minutes:
        protocol.fail(
            f"--step-minutes {args.step_minutes}: a divisor of 1440 of at most {LONGEST_STEP_MINUTES} is allowed"
        )
    if args.quick:
        args.stands = 12
    path = paths.results(args.quick) / "region_killed.csv"
    paths.make_writable("results", path.parent)
    with tempfile.TemporaryDirectory() as folder:
        table = run(args, Path(folder))
    with protocol.replacing(path) as file:
        table.to_csv(file, index=False, lineterminator="\n")
    print(table.to_string(index=False))
    if not table.same_bytes.all():
        sys.exit("OTHER BYTES than of the region that was left alone")


if __name__ == "__main__":
    main(protocol.parse(Args))
