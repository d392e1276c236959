"""Runs the project's scripts inside the test's process, as the command line would."""

import runpy
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def run_script(path: str, *arguments) -> None:
    """Run a script as __main__; a refusal raises SystemExit with its message."""
    argv, sys.argv = sys.argv, [path, *map(str, arguments)]
    try:
        runpy.run_path(str(ROOT / path), run_name="__main__")
    finally:
        sys.argv = argv
