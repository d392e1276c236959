"""By which code a run is made: commit, script, packages, and the hash of its physics."""

import ast
import csv
import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import platform
import re
import subprocess
from importlib.resources import files
from pathlib import Path

from llvmlite.binding import get_host_cpu_name

import boreal_env

#: Of config.json, what says by which code beside the packages: the checkout's commit, the script's file.
CODE = ("commit", "source")
# Of the simulator, what reads, draws, sends or plays, and makes no number of a year.
NO_PHYSICS = ("executor.py", "io", "region", "task/fronts.py", "task/picture.py")
#: Sources that were compared with an earlier one and make its numbers to the bit: analysis/same_physics.py.
SAME_PHYSICS = Path(str(files("cleanrl_style.protocol"))) / "same_physics.csv"
# A string of Python, or a comment. It goes through all source in 10 ms; the tokenizer took 200 ms of every start.
TEXT_OR_COMMENT = re.compile(
    r"""
    (?P<text> ["]{3} (\\.|[^\\])*? ["]{3} | '{3} (\\.|[^\\])*? '{3} | " (\\.|[^"\\\n])* " | ' (\\.|[^'\\\n])* ')
    | \#[^\n]*
    """,
    re.DOTALL | re.VERBOSE,
)


def versions() -> dict:
    """What numbers depend on beside the code: versions of Python and packages, and how torch calculates.

    The processor, by LLVM's name, is for those on which torch cannot be told how (`cleanrl_style/__init__.py`).
    """
    packages = ("numpy", "numba", "gymnasium", "torch", "pandas", "matplotlib", "moocore")
    there = [name for name in packages if importlib.util.find_spec(name)]  # fixed strategies do without torch
    found = {name: importlib.metadata.version(name) for name in there}
    arithmetic = {name: os.environ.get(name) for name in ("MKL_CBWR", "ATEN_CPU_CAPABILITY")}
    return {"python": platform.python_version(), **found, "processor": get_host_cpu_name(), **arithmetic}


def commit() -> str | None:
    """The git commit of this checkout; None outside a checkout."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return None
    try:
        command = ["git", "-C", root, "rev-parse", "HEAD"]
        head = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    except FileNotFoundError:
        return None
    return head.stdout.strip() if head.returncode == 0 else None


def place_of(script: Path) -> str | None:
    """The script's file, relative to the project where it lies in it; None of a name alone."""
    if not script.is_file():
        return None
    file, root = script.resolve(), Path(__file__).resolve().parents[2]
    return file.relative_to(root).as_posix() if file.is_relative_to(root) else str(file)


def physics_name() -> str:
    """Name of this checkout's simulator and environment, that a run's config.json has."""
    return physics_hash()[:16]


def physics_hash() -> str:
    """Hash of the first source that makes the same numbers as this one (`SAME_PHYSICS`): its own, if none is noted."""
    with SAME_PHYSICS.open(newline="") as file:
        noted = {row["source"]: row["stands_for"] for row in csv.DictReader(file)}
    return noted.get(own_hash(), own_hash())


@functools.cache
def own_hash() -> str:
    """Hash of source and tables of simulator and environment, but for `NO_PHYSICS`."""
    simulator, digest = Path(str(files("sim"))), hashlib.sha256()
    apart = [simulator / name for name in NO_PHYSICS]
    sources = [path for path in sorted(simulator.rglob("*.py")) if not {path, *path.parents} & set(apart)]
    for path in [Path(boreal_env.__file__), *sources]:
        digest.update(bare(path.read_text(encoding="utf-8")).encode())
    for path in sorted(simulator.rglob("*.csv")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def bare(text: str) -> str:
    """Python source without comments, docstrings and empty lines."""
    lines = TEXT_OR_COMMENT.sub(lambda found: found["text"] or "", text).splitlines()
    scopes: list = [ast.parse(text)]
    for scope in scopes:  # which grows by those inside
        scopes += [node for node in scope.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))]
        if ast.get_docstring(scope, clean=False) is not None:
            first, last = scope.body[0].lineno, scope.body[0].end_lineno
            lines[first - 1 : last] = [""] * (last - first + 1)
    return "\n".join(line.rstrip() for line in lines if line.strip())
