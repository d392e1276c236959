"""Speed: every figure the median of repeats that take turns, so that what else the machine does hits all alike.

    python analysis/benchmark.py [--quick] [--only episode threads ...]

Prints the machine and a table, and writes results/benchmark.csv and .md. A row's ratio is to the first row of its
section and unit, taken repeat by repeat: ratios carry from machine to machine, times do not. `analysis/
profile_kernel.py` splits a step of the physics into its phases.
"""

import io
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis.machine import machine
from analysis.paths import make_writable, results
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts
from cleanrl_style.protocol.workers import split_among_workers
from sim.block import KERNELS
from sim.stands import available_cores
from sim.state import DAYS

COLUMNS = ("section", "what", "unit", "median", "low", "high", "ratio", "repeats", "paper")

ROOT = Path(__file__).parents[1]
ROLLOUT = 2048  # steps of a training between two updates

#: Our figure -> the paper's, a row of its table of running times.
PAPER = {
    "50-year episode, 1 stand": "episode_50_years_numba",
    "50-year episode, python backend": "episode_50_years_pure_python",
    "async worker": "memory_per_env",
    "async, 300,000 steps with evaluation": "training_generalist_300k_steps",
}

#: A measurement gives its figures, (what, unit) -> value, anew each time it is called.
Measurement = Callable[[], dict[tuple[str, str], float]]


@dataclass
class Args:
    """Measures the speed of the simulator, of the environment and of its start."""

    only: tuple[str, ...] = ()
    """sections to measure: episode, stands, steps, threads, environment, memory, start, training (all by default); the
    others keep the figures that benchmark.csv has"""
    quick: bool = False
    """smaller sizes and fewer repeats, without the compilation: half a minute"""
    repeats: int | None = None
    """repeats of every figure (7; 3 with --quick)"""
    output_dir: Path | None = None
    """folder for benchmark.csv (None: results, with --quick results/quick)"""


# ------------------------------------------------------------------------------------------------ what is measured


def seconds(work: Callable, *args, clock=time.perf_counter, **kwargs) -> float:
    """Time of a call [s] by a clock; by `time.process_time` on one core, which other programs do not slow down."""
    start = clock()
    work(*args, **kwargs)
    return clock() - start


def start(stands: sim.Stands) -> None:
    """Put stands on sampled sites, seeds 0, 1, .., and spin them up."""
    numbers = np.arange(stands.number)
    stands.start(numbers, [sim.sample_site(k) for k in numbers], [sim.episode_seeds(k) for k in numbers])


def simulate(stands: sim.Stands, years: int) -> None:
    """Let stands grow for some years."""
    nothing = np.full(stands.number, boreal_env.NO_CHANGE)
    for _ in range(years):
        stands.step(nothing)


def started(number: int, **kwargs) -> sim.Stands:
    """Stands that are ready to be stepped."""
    stands = sim.Stands(number, **kwargs)
    start(stands)
    return stands


def counted(number: int, noun: str) -> str:
    """1 stand, 2 stands."""
    return f"{number} {noun}{'s' * (number > 1)}"


def episode(args: Args, stack: ExitStack) -> list[Measurement]:
    """An episode with its spin-up, per stand, on one core (processor time); of the interpreted source only the
    year's first days, times the number that the years have."""
    years = 10 if args.quick else 50
    days = 2 if args.quick else 5
    interpreted = sim.Stands(1, backend="python")
    interpreted.set_state(started(1).get_state())

    def measure(stands):
        work = seconds(lambda: (start(stands), simulate(stands, years)), clock=time.process_time)
        each = "" if stands.number == 1 else " in lockstep, each"
        return {(f"{years}-year episode, {counted(stands.number, 'stand')}{each}", "s"): work / stands.number}

    def measure_interpreted():
        nothing = np.full(1, boreal_env.NO_CHANGE)
        work = seconds(interpreted.step, nothing, days=days, clock=time.process_time)
        return {(f"{years}-year episode, python backend", "s"): work * years * DAYS / days}

    numbers = (1, 16, 32, 64)[: 2 if args.quick else None]
    return [*(partial(measure, sim.Stands(n, threads=1)) for n in numbers), measure_interpreted]


def per_step(stands: sim.Stands) -> float:
    """Processor time of a step of a stand [ns], over whole years of at least sixteen stand-years."""
    years = max(1, 16 // stands.number)
    steps = stands.number * years * DAYS * stands.steps_per_day
    return 1e9 * seconds(simulate, stands, years, clock=time.process_time) / steps


def stands(args: Args, stack: ExitStack) -> list[Measurement]:
    """Cost of a step against the number of stands, on one core (processor time)."""

    def measure(stands):
        return {(f"a step, {counted(stands.number, 'stand')}", "ns per stand"): per_step(stands)}

    numbers = (1, 4, 16, 32) if args.quick else (1, 2, 4, 8, 16, 32, 64, 128)
    return [partial(measure, started(n, threads=1)) for n in numbers]


def steps(args: Args, stack: ExitStack) -> list[Measurement]:
    """Cost against the length of the step, sixteen stands on one core (processor time)."""

    def measure(minutes, stands):
        step = per_step(stands)
        year = 1e-6 * step * DAYS * stands.steps_per_day
        return {
            (f"a year of {minutes}-minute steps", "ms per stand"): year,
            (f"a {minutes}-minute step", "ns per stand"): step,
        }

    lengths = (30, 60) if args.quick else (30, 5, 10, 15, 60, 120)
    return [partial(measure, m, started(16, threads=1, time_step_minutes=m)) for m in lengths]


def threads(args: Args, stack: ExitStack) -> list[Measurement]:
    """Stand-years a second against the number of threads, two blocks of sixteen stands a core, over ten years: the
    first finds the other cores asleep."""
    years = 2 if args.quick else 10

    def measure(stands):
        name = f"{counted(stands.threads, 'thread')}, {stands.number} stands"
        return {(name, "stand-years per s"): years * stands.number / seconds(simulate, stands, years)}

    number = 32 * available_cores()
    counts = sorted({1, available_cores()} if args.quick else {*range(1, min(available_cores(), 16) + 1)})
    return [partial(measure, started(number, threads=count)) for count in counts]


def physics_alone(groups: list[sim.Stands], pool: ThreadPoolExecutor) -> float:
    """Time of a year of the physics and nothing else [s]: a call for each group of stands, on all cores."""
    draws = [group._draw(group.streams.copy()) for group in groups]

    def year(group, draw):
        group._run(np.arange(group.number), draw, np.full(group.number, boreal_env.NO_CHANGE))

    return seconds(lambda: list(pool.map(year, groups, draws)))


def environment(args: Args, stack: ExitStack) -> list[Measurement]:
    """Years a second of the environments without resets, and the share of the time that is not physics.

    That share is 1 - (a year of the physics of as many stands on the same cores, alone) / (the environment's step).
    """
    years = 3 if args.quick else 10
    pool = stack.enter_context(ThreadPoolExecutor(available_cores()))
    make = partial(gym.make, "boreal-generalist-v0", disable_env_checker=True, years=1000)
    asynchronous = partial(gym.vector.AsyncVectorEnv, autoreset_mode=gym.vector.AutoresetMode.SAME_STEP)
    sizes = (1, 2, 32) if args.quick else (1, 2, 4, 8, 16, 32, 64)
    processes = (2,) if args.quick else sizes
    kinds = [("plain loop", n, lambda n=n: [make() for _ in range(n)]) for n in sizes]
    kinds += [("async", n, lambda n=n: [asynchronous([make] * n)]) for n in processes]
    kinds += [("lockstep", n, lambda n=n: [boreal_env.BorealVectorEnv(n, years=1000)]) for n in sizes]

    def measure(name, number, envs, groups):
        action = boreal_env.NO_CHANGE if name == "plain loop" else np.full(number, boreal_env.NO_CHANGE)
        step = seconds(lambda: [env.step(action) for _ in range(years) for env in envs]) / years
        one_by_one = [[group] for group in groups] if name == "plain loop" else [groups]
        physics = sum(physics_alone(these, pool) for _ in range(years) for these in one_by_one) / years
        what = f"{name}, {counted(number, 'stand')}"
        return {(what, "years per s"): number / step, (what, "% not physics"): 100.0 * (1.0 - physics / step)}

    measurements = []
    for name, number, factory in kinds:
        envs = factory()
        for env in envs:
            stack.callback(env.close)
            env.reset(seed=0)
        groups = [started(number)] if name == "lockstep" else [started(1) for _ in range(number)]
        measurements.append(partial(measure, name, number, envs, groups))
    return measurements


def own_memory(process: int) -> float:
    """Memory that a process shares with no other [MB] (its unique set size)."""
    lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith(("Private_Clean", "Private_Dirty"))) / 1024.0


def memory(args: Args, stack: ExitStack) -> list[Measurement]:
    """Memory of a worker of AsyncVectorEnv after a year; nothing where the system does not tell (Linux does)."""
    if not Path("/proc/self/smaps_rollup").exists():
        return []
    make = partial(gym.make, "boreal-generalist-v0", disable_env_checker=True)
    env = gym.vector.AsyncVectorEnv([make] * 2, autoreset_mode=gym.vector.AutoresetMode.SAME_STEP)
    stack.callback(env.close)
    env.reset(seed=0)
    env.step(np.full(2, boreal_env.NO_CHANGE))

    def measure():
        workers = [own_memory(process.pid) for process in env.processes]
        return {
            ("async worker", "MB of its own"): statistics.mean(workers),
            ("this process", "MB of its own"): own_memory(os.getpid()),
        }

    return [measure]


STARTS = {
    "import boreal_env": "import boreal_env",
    "1 stand": "import boreal_env; boreal_env.warm_up(1)",
    "16 stands": "import boreal_env; boreal_env.warm_up(16)",
}


def start_up(args: Args, stack: ExitStack) -> list[Measurement]:
    """A new process until the physics is ready: compiled into an empty cache (once), and loaded from it."""
    cache = os.environ | ({} if args.quick else {"NUMBA_CACHE_DIR": stack.enter_context(tempfile.TemporaryDirectory())})

    def launch(name):
        return seconds(subprocess.run, [sys.executable, "-c", STARTS[name]], check=True, env=cache)

    first = [] if args.quick else [{(f"first start, {name}", "s"): launch(name) for name in ("1 stand", "16 stands")}]

    def measure():
        once = first.pop() if first else {}
        return once | {(f"later start, {name}", "s"): launch(name) for name in STARTS}

    return [measure]


def training(args: Args, stack: ExitStack) -> list[Measurement]:
    """Where the time of a step goes in a training of Curriculum PPO: short runs of the script, and the physics alone.

    plumbing : the environment's time but for a year's physics of as many stands on the same cores, so that starts of
    episodes are in it; policy : what a rollout takes beside the environment, mostly the forward pass. The whole run
    is put together from these.
    """
    steps = ROLLOUT if args.quick else 3 * ROLLOUT
    pool = stack.enter_context(ThreadPoolExecutor(available_cores()))

    def measure(kind, number, groups):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, ROOT / "cleanrl_style" / "ppo_curriculum.py", "--vectorization", kind]
            command += ["--total-timesteps", steps, "--eval-episodes", 2 if args.quick else 32]
            command += ["--eval-weights", 0, 1, "--run-dir", folder]
            subprocess.run([str(word) for word in command], check=True, capture_output=True)
            timing = pd.read_csv(Path(folder) / "timing.csv")
            played = boreal_env.DEFAULT_YEARS * len(pd.read_csv(Path(folder) / "evaluation.csv"))
        took = {phase: 1e3 * total for phase, total in timing.groupby("phase").seconds.sum().items()}
        physics = 1e3 * statistics.median(physics_alone(groups, pool) for _ in range(5)) / number
        environment, rollout, update = (took[phase] / steps for phase in ("environment", "rollout", "update"))
        step = {
            "physics": physics,
            "plumbing": environment - physics,
            "policy": rollout - environment,
            "update": update,
        }
        year = took["evaluation"] / played
        evaluated = 200 * len(protocol.POLICIES) * len(fronts.evaluation_weights(2)) * boreal_env.DEFAULT_YEARS
        whole = (300_000 * sum(step.values()) + evaluated * year) / 60_000.0
        return {
            (f"{kind}, 300,000 steps with evaluation", "min"): whole,
            **{(f"{kind}, {number} stands: {part}", "ms per step"): value for part, value in step.items()},
            (f"{kind}: evaluation", "ms per year"): year,
        }

    kinds = {"lockstep": (32, [started(32)])}
    if not args.quick:
        kinds = {
            "async": (8, [started(len(indices), threads=1) for indices in split_among_workers(8, available_cores())])
        } | kinds
    return [partial(measure, kind, *stands) for kind, stands in kinds.items()]


SECTIONS = {
    "episode": episode,
    "stands": stands,
    "steps": steps,
    "threads": threads,
    "environment": environment,
    "memory": memory,
    "start": start_up,
    "training": training,
}
FORKING = ("memory", "environment")  # have worker processes, which have to be there before the first thread

# ------------------------------------------------------------------------------------------------ what is reported


def run(args: Args) -> pd.DataFrame:
    """Measure the sections wanted; a row a figure, columns `COLUMNS`."""
    repeats = args.repeats or (3 if args.quick else 7)
    wanted = [name for name in SECTIONS if name in args.only or not args.only]
    samples = {}
    with ExitStack() as stack:
        measurements = []
        for name in sorted(wanted, key=lambda name: name not in FORKING):
            measurements += [(name, measurement) for measurement in SECTIONS[name](args, stack)]
        progress = protocol.Progress("benchmark", repeats * len(measurements), "measurements")
        for repeat in range(repeats):
            for k, (name, measurement) in enumerate(measurements):
                for (what, unit), value in measurement().items():
                    samples.setdefault((name, what, unit), []).append(value)
                progress.show(repeat * len(measurements) + k + 1)
    paper = pd.read_csv(Path(__file__).parent / "paper_tables" / "runtime.csv", index_col="quantity")
    rows, first = [], {}
    for (name, what, unit), values in sorted(samples.items(), key=lambda item: wanted.index(item[0][0])):
        base = first.setdefault((name, unit), values)
        base = base * len(values) if len(base) == 1 else base  # the first start is measured once
        ratio = statistics.median(value / other for value, other in zip(values, base, strict=True))
        theirs = "{low:g}-{high:g} {unit}".format(**paper.loc[PAPER[what]]) if what in PAPER else ""
        rows.append(
            (
                name,
                what,
                unit,
                statistics.median(values),
                min(values),
                max(values),
                np.nan if unit.startswith("%") else ratio,
                len(values),
                theirs,
            )
        )
    return pd.DataFrame(rows, columns=COLUMNS)


def with_earlier(table: pd.DataFrame, path: Path) -> pd.DataFrame:
    """The table, and the rows that a file has of sections which were not measured."""
    if not path.exists():
        return table
    earlier = pd.read_csv(path, keep_default_na=False, na_values={"ratio": [""]})
    both = pd.concat([table, earlier[~earlier.section.isin(table.section)]])
    return both.sort_values("section", key=lambda names: names.map(list(SECTIONS).index), kind="stable")


def short(value: float) -> str:
    """Three digits, without an exponent."""
    return f"{value:,.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def markdown(facts: dict[str, str], table: pd.DataFrame) -> str:
    """The machine and the table, as Markdown that also reads well on a terminal."""
    text = io.StringIO()
    text.write(", ".join(f"{name} {value}" for name, value in facts.items()) + "\n\n")
    cells = [["", "median", "low - high", "", "ratio", "paper"], ["-" * 48, "-:", "-:", "-", "-:", "-"]]
    for row in table.itertuples():
        spread = f"{short(row.low)} - {short(row.high)}" if row.repeats > 1 else ""
        ratio = "" if np.isnan(row.ratio) else f"{row.ratio:.2f}"
        cells.append([row.what, short(row.median), spread, row.unit, ratio, row.paper])
    widths = [max(len(line[k]) for line in cells) for k in range(len(cells[0]))]
    for line in cells:
        padded = (f"{cell:{'<' if k in (0, 3, 5) else '>'}{widths[k]}}" for k, cell in enumerate(line))
        text.write("| " + " | ".join(padded) + " |\n")
    return text.getvalue()


def main(args: Args) -> None:
    """Measure, print and write."""
    unknown = [name for name in args.only if name not in SECTIONS]
    if unknown:
        protocol.fail(f"--only {unknown[0]}: allowed are {', '.join(SECTIONS)}")
    folder = args.output_dir or results(args.quick)
    make_writable("--output-dir", folder)
    facts = machine()
    protocol.compile_physics(KERNELS)
    path = folder / "benchmark.csv"
    table = with_earlier(run(args), path)
    with protocol.replacing(path) as file:
        table.to_csv(file, index=False, float_format=protocol.FLOAT_FORMAT, lineterminator="\n")
    print(markdown(facts, table) + f"\nwrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
