"""Where the time of a step goes: each phase of `sim.step.simulate_step`, alone and in turn.

    python analysis/profile_kernel.py [--lanes 16] [--output-dir results]

A block of stands is stepped to four moments of the year. There each phase is called many times on the block as the
phases before it leave it, and beside them the whole step. The phases' sum need not be the whole: alone, a phase finds
its fields in the nearest cache, and what the compiler shares between phases is done twice. The physics is compiled
phase by phase, which takes half a minute.
"""

import statistics
import time
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
import pandas as pd

from analysis.benchmark import per_step, started
from analysis.machine import machine
from cleanrl_style import protocol
from sim import arrival, solve, step, transfer
from sim.block import LANES
from sim.day import begin_day, end_day
from sim.draws import draw_year
from sim.jit import OPTIONS
from sim.state import DAILY, DRAWS_SIZE, STATE_SIZE, block_dtype
from sim.year import begin_year, hour_angles

STEPS_PER_DAY = 48
SECONDS = 86400.0 / STEPS_PER_DAY
MOMENTS = {  # name -> (day, step of the day)
    "winter night": (30, 2),
    "winter noon": (30, 24),
    "summer night": (190, 2),
    "summer noon": (190, 24),
}
COPIES = 4  # of the block, taken in turn, so that the compiler cannot do once what is to be done every time
CALLS = 400

#: The phases of a step in their order: name -> (function, arguments after the block). The canopy is solved together
#: with the conductances it starts from, which are taken off again.
PHASES = {
    "step_weather": (step.step_weather, "t, hours, SECONDS, observed"),
    "stores_before": (step.stores_before, "SECONDS"),
    "any_sun": (arrival.any_sun, ""),
    "sunlight": (arrival.sunlight, ""),
    "darkness": (arrival.darkness, ""),
    "any_snow": (arrival.any_snow, ""),
    "snowfall": (arrival.snowfall, "SECONDS"),
    "no_snow": (arrival.no_snow, ""),
    "rainfall": (arrival.rainfall, ""),
    "ground_exchange": (solve.ground_exchange, ""),
    "snow_vapour": (solve.snow_vapour, "SECONDS"),
    "conductances": (solve.conductances, "SECONDS"),
    "solve_canopy": (solve.solve_canopy, ""),
    "move_energy_and_water": (transfer.move_energy_and_water, "SECONDS"),
    "move_carbon": (transfer.move_carbon, "SECONDS"),
    "balance": (step.balance, "SECONDS"),
}
WHOLE = [PHASES["step_weather"], (step.simulate_step, "SECONDS")]
DAYS = {"begin_day": (begin_day, "day, observed"), "end_day": (end_day, "day, 48, daily")}  # once a day


@dataclass
class Args:
    """Splits the time of a step of the physics into its phases."""

    lanes: int = LANES
    """stands in lockstep: 16 or 1"""
    repeats: int = 15
    """repeats of every figure, of which the median counts"""
    output_dir: Path = Path("results")
    """folder for profile_kernel.csv"""


def repeated(*calls: tuple):
    """A compiled function (blocks, number, day, t, hours, observed, daily) that makes the calls."""
    names = {f"phase_{k}": function for k, (function, _) in enumerate(calls)}
    lines = [f"        phase_{k}({', '.join(filter(None, ['block', given]))})" for k, (_, given) in enumerate(calls)]
    source = "def run(blocks, number, day, t, hours, observed, daily):\n"
    source += "    for k in range(number):\n        block = blocks[k % len(blocks)]\n" + "\n".join(lines)
    namespace = {**names, "SECONDS": SECONDS}
    exec(source, namespace)
    return numba.njit(**OPTIONS)(namespace["run"])


def nothing(lanes: int) -> tuple[np.ndarray, np.ndarray]:
    """No observed forcing, no daily output."""
    return np.zeros((0, 6, lanes)), np.zeros((0, len(DAILY), lanes))


def blocks_at(moments: dict, lanes: int) -> dict[str, tuple]:
    """Sampled stands at the start of a step: name of the moment -> (block, day, t, hours)."""
    stands = started(lanes, threads=1)
    generator = np.random.default_rng(0)
    draws = np.array([draw_year(generator, generator) for _ in range(lanes)])
    blocks = np.zeros(1, block_dtype(lanes))
    rows = blocks.view("f8").reshape(-1, lanes)
    first = stands.parameters.shape[1]
    rows[:first] = stands.parameters.T
    rows[first : first + STATE_SIZE] = stands.state.T
    rows[first + STATE_SIZE : first + STATE_SIZE + DRAWS_SIZE] = draws.T
    block, (observed, daily) = blocks[0], nothing(lanes)
    hours = hour_angles(STEPS_PER_DAY)
    begin_year(block)
    found = {}
    for day in range(1 + max(day for day, _ in moments.values())):
        begin_day(block, day, observed)
        for t in range(STEPS_PER_DAY):
            now = blocks.copy(), day, t, hours
            found |= {name: now for name, moment in moments.items() if moment == (day, t)}
            step.step_weather(block, t, hours, SECONDS, observed)
            step.simulate_step(block, SECONDS)
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
    its part of a step; a column a moment."""
    functions = {name: repeated(phase) for name, phase in {**PHASES, **DAYS}.items()}
    functions["whole step"] = repeated(*WHOLE)
    functions["solve_canopy"] = repeated(PHASES["conductances"], PHASES["solve_canopy"])
    table = pd.DataFrame(0.0, index=[*PHASES, "sum", "whole step", *DAYS], columns=list(MOMENTS))
    for moment, (blocks, *now) in blocks_at(MOMENTS, lanes).items():
        table.loc["whole step", moment] = time_calls(functions["whole step"], blocks, now, repeats)
        for name in DAYS:
            table.loc[name, moment] = time_calls(functions[name], blocks, now, repeats) / STEPS_PER_DAY
        observed, daily = nothing(lanes)
        left_out = []
        for name in PHASES:
            if name in left_out:
                continue
            table.loc[name, moment] = time_calls(functions[name], blocks, now, repeats)
            functions[name](blocks, 1, *now, observed, daily)
            if name == "any_sun":
                left_out.append("darkness" if arrival.any_sun(blocks[0]) else "sunlight")
            if name == "any_snow":
                left_out += ["no_snow"] if arrival.any_snow(blocks[0]) else ["snowfall", "snow_vapour"]
        table.loc["solve_canopy", moment] -= table.loc["conductances", moment]
        table.loc["sum", moment] = table.loc[list(PHASES), moment].sum()
    return table


def main(args: Args) -> None:
    """Measure, print and write."""
    if args.lanes not in (1, LANES) or args.repeats < 1:
        protocol.fail(
            f"--lanes {args.lanes} --repeats {args.repeats}: 1 or {LANES} lanes, from 1 repeat on are allowed"
        )
    try:
        args.output_dir.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        protocol.fail(f"--output-dir {args.output_dir}: cannot write there ({error.strerror})")
    print(", ".join(f"{name} {value}" for name, value in machine().items()))
    print("compiling the phases one by one, half a minute", flush=True)
    table = where_time_goes(args.lanes, args.repeats)
    print(f"ns per step and stand, {args.lanes} in lockstep\n" + table.to_string(float_format="%.1f"))
    stands = started(args.lanes, threads=1)
    year = statistics.median(per_step(stands) for _ in range(args.repeats))
    print(f"a whole year, all that is done in it: {year:.1f}")
    with protocol.replacing(args.output_dir / "profile_kernel.csv") as file:
        table.to_csv(file, index_label="phase", float_format="%.4g", lineterminator="\n")


if __name__ == "__main__":
    main(protocol.parse(Args))
