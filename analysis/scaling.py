"""How speed grows with stands and with cores, on a GPU where there is one, and what a region costs at that speed.

    python analysis/scaling.py [--quick] [--stands 16 4096 ...] [--threads 1 2 ...]

Writes results/scaling.csv and prints it. A figure is the median of repeats that take turns. Stands are 64 spun-up ones,
repeated under different weather, each a year older at every repeat. Efficiency is of a thread of many, compared with
one thread and as many stands. The machine is to be idle: times are a clock's, not the processor's.
"""

import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numba.cuda
import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis.benchmark import started
from analysis.machine import machine
from analysis.paths import make_writable, results
from cleanrl_style import protocol
from sim.draws import streams_of
from sim.spin_up import SPIN_UP_STEPS_PER_DAY, SPIN_UP_YEARS
from sim.stands import available_cores

SITES = 64
COLUMNS = ("backend", "what", "threads", "stands", "unit", "median", "low", "high", "efficiency", "repeats", "machine")
REGION_STANDS, REGION_YEARS = 1_000_000, 50
STEPS_PER_DAY = 48


@dataclass
class Args:
    """Measures how speed grows with stands and cores, and what a region costs."""

    stands: tuple[int, ...] = (16, 64, 256, 1024, 4096, 16384, 65536)
    """numbers of stands"""
    gpu_stands: tuple[int, ...] = (1024, 4096, 16384, 32768, 65536)
    """numbers of stands on a GPU"""
    threads: tuple[int, ...] = ()
    """numbers of threads (1, 2, 4, 8 and so on, and as many as there are cores)"""
    environments: int = 4096
    """stands of the environment that is stepped"""
    gpu_environments: int = 16384
    """the same on a GPU"""
    repeats: int = 3
    """repeats of every figure"""
    dollars_per_core_hour: float = 0.0425
    """price of a virtual core: an eighth of an EC2 c5.2xlarge's on demand, 0.34 $ (EC2 Auto Scaling, User Guide)"""
    dollars_per_gpu_hour: float = 4.92
    """price of an H100: of an EC2 Capacity Block of p5.48xlarge (Amazon EC2 Capacity Blocks, pricing of 2024)"""
    quick: bool = False
    """16 and 64 stands, an environment of 64, one repeat; of 1024 on a GPU"""
    output_dir: Path | None = None
    """folder for scaling.csv (None: results, with --quick results/quick)"""


def repeated(first: sim.Stands, number: int, **kwargs) -> sim.Stands:
    """So many stands in the states of the first ones, in turn, each with weather of its own: of stands that are alike
    in all, one alone would be simulated."""
    which = np.arange(number) % first.number
    stands = sim.Stands(number, **kwargs)
    saved = first.get_state().items()
    state = {k: v[which] if isinstance(v, np.ndarray) else [v[i] for i in which] for k, v in saved}
    state["streams"] = np.array([streams_of(sim.episode_seeds(k)) for k in range(number)])
    stands.set_state(state)
    return stands


def backends() -> list[str]:
    """The compiled one, and the GPU's where there is a GPU."""
    try:
        sim.Stands(1, backend="cuda")
    except ValueError as error:
        print(error)
        return ["numba"]
    return ["numba", "cuda"]


def year(stands: sim.Stands) -> float:
    """Stand-years a second of a year, its draws and checks included."""
    start = time.perf_counter()
    stands.step(np.full(stands.number, boreal_env.NO_CHANGE))
    return stands.number / (time.perf_counter() - start)


def physics(stands: sim.Stands) -> float:
    """Stand-years a second of a year whose random numbers are drawn already."""
    which = np.arange(stands.number)
    draws = stands._draw(stands.streams.copy())
    start = time.perf_counter()
    stands._run(which, draws, np.full(stands.number, boreal_env.NO_CHANGE))
    return stands.number / (time.perf_counter() - start)


def environment_step(env: boreal_env.BorealVectorEnv) -> float:
    """Steps a second of a vector environment, observations and rewards included."""
    start = time.perf_counter()
    env.step(np.full(env.num_envs, boreal_env.NO_CHANGE))
    return env.num_envs / (time.perf_counter() - start)


def measurements(args: Args) -> Iterator[tuple[tuple, list[float]]]:
    """(backend, what, threads, stands, unit) and its repeats; the first call of each compiles, and is dropped."""
    unit = "stand-years per s"
    cores = tuple(sorted({2**k for k in range(available_cores().bit_length())} | {available_cores()}))
    on_cores = args.threads or cores, args.stands, args.environments
    plans = {"numba": on_cores, "cuda": ((available_cores(),), args.gpu_stands, args.gpu_environments)}
    first = started(min(SITES, max(args.stands)))
    for backend in backends():
        counts, numbers, environments = plans[backend]
        for number in numbers:
            groups = {count: repeated(first, number, backend=backend, threads=count) for count in counts}
            rates: dict[int, list[float]] = {count: [] for count in counts}
            for _ in range(args.repeats + 1):
                for count, stands in groups.items():
                    rates[count].append(year(stands))
            print(f"{number:,} stands: {max(map(max, rates.values())):,.0f} stand-years a second", file=sys.stderr)
            for count in counts:
                yield (backend, "a year", count, number, unit), rates[count][1:]
            if backend == "cuda":
                alone = [physics(stands) for _ in range(args.repeats) for stands in groups.values()]
                yield (backend, "a year, drawn before", *counts, number, unit), alone
        env = boreal_env.BorealVectorEnv(environments, threads=max(counts), backend=backend, years=1000)
        env.reset(seed=0)
        steps = [environment_step(env) for _ in range(args.repeats + 1)][1:]
        yield (backend, "an environment's step", max(counts), environments, unit), steps


def region(table: pd.DataFrame, args: Args) -> pd.DataFrame:
    """Hours and money of `REGION_STANDS` for `REGION_YEARS`, spin-up included, at each backend's best speed."""
    rows = []
    spin_up = SPIN_UP_YEARS * SPIN_UP_STEPS_PER_DAY / STEPS_PER_DAY
    prices = {"numba": args.dollars_per_core_hour, "cuda": args.dollars_per_gpu_hour}
    for backend, of_backend in table[table.what == "a year"].groupby("backend", sort=False):
        best = of_backend.loc[of_backend["median"].idxmax()]
        units = best.threads if backend == "numba" else 1
        speeds = best[["median", "high", "low"]]
        hours = [REGION_STANDS * (REGION_YEARS + spin_up) * units / speed / 3600.0 for speed in speeds]
        what = f"{REGION_STANDS} stands, {REGION_YEARS} years"
        unit = "core-hours" if backend == "numba" else "GPU-hours"
        rows.append((backend, what, units, REGION_STANDS, unit, *hours))
        rows.append((backend, what, units, REGION_STANDS, "dollars", *(hour * prices[backend] for hour in hours)))
    return pd.DataFrame(rows, columns=COLUMNS[:8])


def run(args: Args) -> pd.DataFrame:
    """All figures, a row each, columns `COLUMNS`."""
    facts = machine()
    rows = [(*key, statistics.median(rates), min(rates), max(rates), len(rates)) for key, rates in measurements(args)]
    table = pd.DataFrame(rows, columns=[*COLUMNS[:8], "repeats"])
    alone = table[(table.threads == 1) & (table.backend == "numba")].set_index(["what", "stands"])["median"]
    base = [alone.get(key, np.nan) for key in zip(table.what, table.stands, strict=True)]
    table["efficiency"] = np.where(table.backend == "numba", table["median"] / (table.threads * np.array(base)), np.nan)
    both = pd.concat([table, region(table, args)], ignore_index=True)
    names = {"numba": f"{facts['processor']}, {facts['cores']} cores"}
    if "cuda" in set(table.backend):
        names["cuda"] = numba.cuda.get_current_device().name
    both["machine"], both["repeats"] = both.backend.map(names), both.repeats.astype("Int64")
    return both[list(COLUMNS)]


def main(args: Args) -> None:
    """Measure, print and write."""
    if any(number > available_cores() for number in args.threads):
        protocol.fail(
            f"--threads {max(args.threads)}: at most {available_cores()}, the cores that are there, is allowed"
        )
    if args.quick:
        args.stands, args.environments, args.repeats = (16, 64), 64, 1
        args.gpu_stands, args.gpu_environments = (1024,), 1024
    for flag in ("stands", "gpu_stands", "threads"):
        given = getattr(args, flag)
        if len(set(given)) < len(given):
            protocol.fail(f"--{flag.replace('_', '-')} {' '.join(map(str, given))}: each once is allowed")
    folder = args.output_dir or results(args.quick)
    make_writable("--output-dir", folder)
    table = run(args)
    with protocol.replacing(folder / "scaling.csv") as file:
        table.to_csv(file, index=False, float_format=protocol.FLOAT_FORMAT, lineterminator="\n")
    print(table.drop(columns="machine").to_string(index=False))


if __name__ == "__main__":
    main(protocol.parse(Args))
