"""Runs the project's scripts inside the test's process, as the command line would, and compares two of them."""

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


def without_blocks(source: str, mark: str) -> str:
    """The source without its blocks marked by a comment that begins with `mark`.

    A block is a paragraph, or what is defined in it: it ends at the first blank line after which the indentation
    is not deeper than the comment's. Blank lines on both of its sides leave those before it.
    """
    lines, kept, i = source.split("\n"), [], 0

    def indentation(line):
        return len(line) - len(line.lstrip())

    while i < len(lines):
        if not lines[i].lstrip().startswith(f"# {mark}"):
            kept.append(lines[i])
            i += 1
            continue
        depth, end = indentation(lines[i]), i
        while True:
            while lines[end]:
                end += 1
            after = end
            while not lines[after]:
                after += 1
            if indentation(lines[after]) <= depth:
                break
            end = after
        i = end if kept[-1] else after
    return "\n".join(kept)
