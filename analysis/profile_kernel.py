"""Where the time of a step goes: each phase of `sim.step.simulate_step`, alone and in turn.

    python analysis/profile_kernel.py [--lanes 16] [--output-dir results]

A block of stands is stepped to four moments of the year. There a step is taken phase by phase, and each phase that it
calls is called many times on the block as the phases before it left it; beside them the whole step. The phases' sum
need not be the whole: alone, a phase finds its fields in the nearest cache, and what the compiler shares between phases
is done twice. The physics is compiled phase by phase, which takes half a minute.
"""

import statistics
import time
import types
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
import pandas as pd
from numba.core.dispatcher import Dispatcher

from analysis.benchmark import per_step, started
from analysis.machine import machine
from analysis.paths import make_writable
from boreal_env import NO_CHANGE
from cleanrl_style import protocol
from sim.account import clear_day, end_day
from sim.block import LANES, filled_block
from sim.canopy import solve_canopy
from sim.day import begin_day
from sim.forcing import hour_angles, step_weather
from sim.jit import OPTIONS, loops_kept
from sim.physical_constants import SECONDS_PER_DAY
from sim.response import answer_to_canopy
from sim.state import daily_dtype
from sim.step import simulate_step
from sim.year import begin_year

STEPS_PER_DAY = 48
SECONDS = SECONDS_PER_DAY / STEPS_PER_DAY
MOMENTS = {  # name -> (day, step of the day)
    "winter night": (30, 2),
    "winter noon": (30, 24),
    "summer night": (190, 2),
    "summer noon": (190, 24),
}
COPIES = 4  # of the block, taken in turn, so that the compiler cannot do once what is to be done every time
CALLS = 400
DAYS = (begin_day, clear_day, end_day)  # once a day


@dataclass
class Args:
    """Splits the time of a step of the physics into its phases."""

    lanes: int = LANES
    """stands in lockstep: 16 or 1"""
    repeats: int = 15
    """repeats of every figure, of which the median counts"""
    output_dir: Path = Path("results")
    """folder for profile_kernel.csv"""


def phases() -> dict[str, Dispatcher]:
    """The functions that a step calls, in the order of its source."""
    names, found = simulate_step.py_func.__code__.co_names, simulate_step.py_func.__globals__
    return {name: found[name] for name in names if isinstance(found.get(name), Dispatcher)}


def calls_of_step(blocks: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """The phases that a step of this block calls, in turn, each with the block as it finds it; advances the block."""
    calls = []

    def noted(name, function):
        def call(b, *arguments):
            calls.append((name, blocks.copy()))
            return function(b, *arguments)

        return call

    source = simulate_step.py_func
    namespace = source.__globals__ | {name: noted(name, function) for name, function in phases().items()}
    types.FunctionType(source.__code__, namespace)(blocks[0], SECONDS)
    return calls


def repeated(*functions: Dispatcher):
    """A compiled function (blocks, number, day, t, hours, observed, daily) that calls the functions, in turn, with what
    each asks for by name."""
    given = {"b": "block", "seconds": "SECONDS", "steps": "STEPS_PER_DAY"}
    lines = []
    for k, function in enumerate(functions):
        code = function.py_func.__code__
        names = code.co_varnames[: code.co_argcount]
        lines.append(f"        phase_{k}({', '.join(given.get(name, name) for name in names)})")
    source = "def run(blocks, number, day, t, hours, observed, daily):\n"
    source += "    for k in range(number):\n        block = blocks[k % len(blocks)]\n" + "\n".join(lines)
    namespace = {f"phase_{k}": function for k, function in enumerate(functions)}
    namespace |= {"SECONDS": SECONDS, "STEPS_PER_DAY": STEPS_PER_DAY}
    exec(source, namespace)
    return numba.njit(**OPTIONS)(namespace["run"])


def nothing(lanes: int) -> tuple[np.ndarray, np.ndarray]:
    """No observed forcing, no daily output."""
    return np.zeros((0, 6, lanes)), np.zeros(0, daily_dtype(lanes))


def blocks_at(moments: dict, lanes: int) -> dict[str, tuple]:
    """Sampled stands at the start of a step: name of the moment -> (block, day, t, hours)."""
    stands = started(lanes, threads=1)
    blocks, _ = filled_block(
        lanes,
        stands.parameters,
        stands.state,
        stands._draw(stands.streams.copy()),
        np.full(lanes, NO_CHANGE),
        first_cut_age=stands.first_cut_age,
        products_decay=stands.products_decay,
    )
    block, (observed, daily) = blocks[0], nothing(lanes)
    hours = hour_angles(STEPS_PER_DAY)
    begin_year(block)
    found = {}
    for day in range(1 + max(day for day, _ in moments.values())):
        begin_day(block, day, hours, observed)
        clear_day(block, day, daily)
        for t in range(STEPS_PER_DAY):
            now = blocks.copy(), day, t, hours
            found |= {name: now for name, moment in moments.items() if moment == (day, t)}
            step_weather(block, t, hours, SECONDS, observed)
            simulate_step(block, SECONDS)
        end_day(block, day, STEPS_PER_DAY, daily)
    return found


def time_calls(function, blocks: np.ndarray, now: tuple, repeats: int) -> float:
    """Processor time of a call [ns per stand], the median of the repeats, each on fresh copies of the block."""
    lanes = blocks["s"]["swe"].shape[1]
    observed, daily = nothing(lanes)
    times = []
    for _ in range(repeats):
        fresh = np.repeat(blocks, COPIES)
        function(fresh, COPIES, *now, observed, daily)
        start = time.thread_time()
        function(fresh, CALLS, *now, observed, daily)
        times.append(time.thread_time() - start)
    return 1e9 * statistics.median(times) / (CALLS * lanes)


def where_time_goes(lanes: int = LANES, repeats: int = 15) -> pd.DataFrame:
    """Time of a step [ns per stand]: a row a phase, then their sum, the whole step, and what is done once a day, as
    its part of a step; a column a moment. The canopy is solved together with the answer of the other nodes, from which
    it starts, and which is taken off again."""
    steps = {"step_weather": step_weather, **phases()}
    days = {function.__name__: function for function in DAYS}
    functions = {name: repeated(function) for name, function in (steps | days).items()}
    functions["solve_canopy"] = repeated(answer_to_canopy, solve_canopy)
    whole = repeated(step_weather, simulate_step)
    table = pd.DataFrame(0.0, index=[*steps, "sum", "whole step", *days], columns=list(MOMENTS))
    for moment, (blocks, *now) in blocks_at(MOMENTS, lanes).items():
        table.loc["whole step", moment] = time_calls(whole, blocks, now, repeats)
        for name in days:
            table.loc[name, moment] = time_calls(functions[name], blocks, now, repeats) / STEPS_PER_DAY
        table.loc["step_weather", moment] = time_calls(functions["step_weather"], blocks, now, repeats)
        step_weather(blocks[0], *now[1:], SECONDS, nothing(lanes)[0])
        for name, found in calls_of_step(blocks):
            table.loc[name, moment] = time_calls(functions[name], found, now, repeats)
        table.loc["solve_canopy", moment] -= table.loc["answer_to_canopy", moment]
        table.loc["sum", moment] = table.loc[list(steps), moment].sum()
    return table


def main(args: Args) -> None:
    """Measure, print and write."""
    if args.lanes not in (1, LANES):
        protocol.fail(f"--lanes {args.lanes}: 1 and {LANES} are allowed")
    make_writable("--output-dir", args.output_dir)
    print(", ".join(f"{name} {value}" for name, value in machine().items()))
    print("compiling the phases one by one, half a minute", flush=True)
    with loops_kept():
        table = where_time_goes(args.lanes, args.repeats)
    print(f"ns per step and stand, {args.lanes} in lockstep\n" + table.to_string(float_format="%.1f"))
    stands = started(args.lanes, threads=1)
    year = statistics.median(per_step(stands) for _ in range(args.repeats))
    print(f"a whole year, all that is done in it: {year:.1f}")
    with protocol.replacing(args.output_dir / "profile_kernel.csv") as file:
        table.to_csv(file, index_label="phase", float_format="%.4g", lineterminator="\n")


if __name__ == "__main__":
    main(protocol.parse(Args))
