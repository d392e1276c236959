"""How long the algorithms of other libraries take: processor hours of 300,000 steps, from two short trainings.

    pip install -c constraints.txt -e ".[outside]"
    python analysis/studies/outside_speed.py [--script pcn ...]

Each command of analysis/outside/ trains for a few thousand steps and for three times as many, on one thread, in a
process of its own. What the longer one takes more of the processor is the cost of a step, and the rest the cost of a
start. Waiting for other programs costs none of that time. An algorithm that gets slower as it goes takes longer than
the table says. Leaves results/studies/outside_speed.csv, which docs/outside.md shows.
"""

import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from analysis import methods, paths, stored
from cleanrl_style import protocol

ROOT = Path(__file__).parents[2]
BUDGET = 300_000  # steps
LONGER = 3
STEPS = {"pcn": 10_000, "gpi_ls": 2_500, "envelope": 2_500, "morld": 2_500, "maskable_ppo": 10_000}
FLAGS = {"morld": ("--learning-starts", "500")}  # or it would learn nothing in so few steps
EVALUATION = ("--eval-episodes", "2", "--eval-weights", "0.5")
assert set(STEPS) == set(methods.OUTSIDE)


@dataclass
class Args:
    """Measures the time that algorithms of other libraries take."""

    script: tuple[str, ...] = tuple(STEPS)
    """the commands that are measured, by name; the others keep their rows"""


def processor_seconds(script: str, steps: int) -> float:
    """Of a training with next to no evaluation. Raises CalledProcessError if it fails."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, str(ROOT / "analysis/outside" / f"{script}.py"), "--total-timesteps", str(steps)]
        command += [*FLAGS.get(script, ()), *EVALUATION, "--run-dir", folder + "/run"]
        threads = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, env={**os.environ, **threads}, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(script: str) -> dict:
    """A row of the table."""
    steps = STEPS[script]
    short, long = processor_seconds(script, steps), processor_seconds(script, LONGER * steps)
    step = (long - short) / ((LONGER - 1) * steps)
    return {
        "script": script,
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
    rows = {row["script"]: row for row in stored.read(path, ("script",)).to_dict("records")} if path.exists() else {}
    for script in args.script:
        rows[script] = measure(script)
        print(f"{script:13s} {rows[script]['milliseconds_a_step']:7.2f} ms a step, {rows[script]['hours']:5.1f} hours")
        table = pd.DataFrame([rows[name] for name in STEPS if name in rows])
        stored.write(path, table, settings)
    print(f"\nwrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
