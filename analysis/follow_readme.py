"""Does what the README's first commands say, in a fresh clone and a fresh virtual environment, and times it.

    python analysis/follow_readme.py     # a quarter of an hour on two idle cores, and the packages are downloaded

Writes results/first_run.txt, the end of what the training printed, and results/readme.csv, what each command took;
`python analysis/document_results.py` puts both into the README. What is not committed is not in the clone.
"""

import os
import re
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from analysis.machine import machine
from analysis.paths import make_writable
from cleanrl_style import protocol

ROOT = Path(__file__).parents[1]
CLONE = "git clone --depth 1 <URL of this repository>"
QUICK = "pytest -m quick"  # named below that block


@dataclass
class Args:
    """Follows the README."""

    results: Path = Path("results")
    """folder that first_run.txt and readme.csv are written into"""


def commands(page: str) -> list[str]:
    """The lines of the README's first block of commands."""
    return re.findall(r"```bash\n(.*?)```", page, re.DOTALL)[0].splitlines()


def steps(lines: list[str]) -> list[str]:
    """Single commands that take time: without the clone, `cd` and the virtual environment, which are prepared."""
    single = [command.strip() for line in lines for command in line.split("&&")]
    return [command for command in single if command.startswith(("pip ", "python ", "pytest"))]


def prepare(folder: Path) -> dict[str, str]:
    """A clone and a virtual environment, which all commands then run in; what has to be in their environment."""
    subprocess.run(["git", "clone", "--quiet", "--depth", "1", ROOT.as_uri(), folder], check=True)
    subprocess.run(["python3", "-m", "venv", folder / ".venv"], check=True)
    path = f"{folder / '.venv' / 'bin'}{os.pathsep}{os.environ['PATH']}"
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    return kept | {"PATH": path, "NUMBA_CACHE_DIR": str(folder / ".cache")}


def follow(wanted: list[str], folder: Path, environment: dict[str, str]) -> tuple[pd.DataFrame, dict[str, str]]:
    """Seconds of each command, and what it printed. Ends the program where one fails."""
    rows, printed = [], {}
    for command in wanted:
        start = time.perf_counter()
        done = subprocess.run(command, shell=True, cwd=folder, env=environment, text=True, capture_output=True)
        if done.returncode:
            protocol.fail(f"{command}: exit {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        rows.append((command, round(time.perf_counter() - start)))
        printed[command] = done.stdout
    facts = machine()
    return pd.DataFrame(rows, columns=["command", "seconds"]).assign(
        machine=f"{facts['cores']} cores of {facts['processor']}"
    ), printed


def main(args: Args) -> None:
    """Clone, run, write."""
    make_writable("--results", args.results)
    wanted = [*steps(commands((ROOT / "README.md").read_text(encoding="utf-8"))), QUICK]
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work, "borearl")
        table, printed = follow(wanted, folder, prepare(folder))
    (told,) = [text for text in printed.values() if "SCORE" in text]
    with protocol.replacing(args.results / "first_run.txt") as file:
        file.write(told[told.index("SCORE") :].encode())
    with protocol.replacing(args.results / "readme.csv") as file:
        file.write(table.to_csv(index=False, lineterminator="\n").encode())
    print(table.to_string(index=False))


if __name__ == "__main__":
    main(protocol.parse(Args))
