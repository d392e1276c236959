"""How long the algorithms of other libraries take: processor hours of 300,000 steps, from two short trainings.

    pip install -c constraints.txt -e ".[outside]"
    python analysis/studies/outside_speed.py [--script pcn ...]

Each command of analysis/outside/ trains for a few thousand steps and for three times as many, on one thread, in a
process of its own. What the longer one takes more of the processor is the cost of a step, and the rest the cost of a
start. Waiting for other programs costs none of that time. An algorithm that gets slower as it goes takes longer than
the table says. Each is measured in torch's arithmetic that is the same on every processor, as the command runs, and in
the processor's own. Leaves results/studies/outside_speed.csv, which docs/outside.md shows.
"""

import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import pandas as pd

from analysis import methods, paths, stored
from cleanrl_style import protocol
from sim.block import KERNELS, kernel

ROOT = Path(__file__).parents[2]
BUDGET = 300_000  # steps
LONGER = 3
STEPS = {"pcn": 5_000, "gpi_ls": 1_000, "envelope": 1_000, "morld": 1_000, "maskable_ppo": 10_000}
ARITHMETIC = {"any": "COMPATIBLE", "own": "AUTO"}  # of whose processor -> MKL_CBWR
FLAGS = {"morld": ("--learning-starts", "500")}  # or it would learn nothing in so few steps
EVALUATION = ("--eval-episodes", "2", "--eval-weights", "0.5")
assert set(STEPS) == set(methods.OUTSIDE)


@dataclass
class Args:
    """Measures the time that algorithms of other libraries take."""

    script: tuple[str, ...] = tuple(STEPS)
    """the commands that are measured, by name; the others keep their rows"""


def processor_seconds(script: str, steps: int, arithmetic: str) -> float:
    """Of a training with next to no evaluation. Raises CalledProcessError if it fails."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, str(ROOT / "analysis/outside" / f"{script}.py"), "--total-timesteps", str(steps)]
        command += [*FLAGS.get(script, ()), *EVALUATION, "--run-dir", folder + "/run"]
        settings = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        settings["MKL_CBWR"] = ARITHMETIC[arithmetic]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, env={**os.environ, **settings}, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(script: str, arithmetic: str) -> dict:
    """A row of the table."""
    steps = STEPS[script]
    short, long = (processor_seconds(script, budget, arithmetic) for budget in (steps, LONGER * steps))
    step = (long - short) / ((LONGER - 1) * steps)
    return {
        "script": script,
        "arithmetic": arithmetic,
        "steps": steps,
        "seconds": short,
        "seconds_longer": long,
        "milliseconds_a_step": 1e3 * step,
        "hours": (short + (BUDGET - steps) * step) / 3600,
    }


def main(args: Args) -> None:
    """Measure one command after another; each row is kept as soon as it is there."""
    if unknown := set(args.script) - set(STEPS):
        protocol.fail(f"--script {' '.join(sorted(unknown))}: {', '.join(STEPS)} are allowed")
    path = paths.studies() / "outside_speed.csv"
    settings = {"longer": LONGER, "budget": BUDGET}
    for lanes in KERNELS:
        kernel(lanes)  # or the first training would compile it
    keys = ["script", "arithmetic"]
    rows = stored.read(path, keys).set_index(keys, drop=False).to_dict("index") if path.exists() else {}
    for script in args.script:
        for arithmetic in ARITHMETIC:
            row = rows[script, arithmetic] = measure(script, arithmetic)
            print(f"{script:13s} {arithmetic:4s} {row['milliseconds_a_step']:7.2f} ms a step, {row['hours']:5.1f} h")
            table = pd.DataFrame([rows[key] for key in product(STEPS, ARITHMETIC) if key in rows])
            stored.write(path, table, settings)
    print(f"\nwrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
