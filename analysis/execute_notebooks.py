"""Runs the notebooks of docs/notebooks/ and writes what they show into them.

    python analysis/execute_notebooks.py [--check]     # half a minute

With --check nothing is written, and a notebook that would show other text, or lacks a picture, is named; what pictures
show is not compared, since another version of a library draws them otherwise. The same notebook gives the same bytes.
"""

import difflib
import os
from dataclasses import dataclass
from pathlib import Path

from cleanrl_style.flags import require

require("nbformat", "nbclient", extra="docs")

import nbformat
from nbclient import NotebookClient

from cleanrl_style import protocol
from sim.block import KERNELS

FOLDER = Path(__file__).parents[1] / "docs" / "notebooks"
LANGUAGE = {"name": "python"}
INLINE = "module://matplotlib_inline.backend_inline"  # a backend of the shell's would leave no pictures
KERNEL = {"name": "python3", "display_name": "Python 3", "language": "python"}


@dataclass
class Args:
    """Runs the notebooks of the documentation."""

    notebooks: tuple[Path, ...] = tuple(sorted(FOLDER.glob("*.ipynb")))
    """notebooks to run"""
    check: bool = False
    """say which are not current, and write nothing"""


def executed(path: Path) -> nbformat.NotebookNode:
    """A notebook as it is when it has just been run from top to bottom in the repository."""
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=3600, kernel_name="python3", record_timing=False)
    client.execute(cwd=str(FOLDER.parents[1]), env=os.environ | {"MPLBACKEND": INLINE})
    notebook.metadata = {"kernelspec": KERNEL, "language_info": LANGUAGE}
    for cell in notebook.cells:
        cell.metadata = {}
    return notebook


def shown(notebook: nbformat.NotebookNode) -> list[str]:
    """The lines of text that a notebook's code shows, and one for each picture."""
    lines = []
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            text = output.get("text") or output.get("data", {}).get("text/plain", "")
            lines += ["<Figure>" if line.startswith("<Figure") else line for line in text.splitlines()]
    return lines


def main(args: Args) -> None:
    """Run them; write them, or compare."""
    for path in args.notebooks:
        if not path.is_file() or path.suffix != ".ipynb":
            protocol.fail(f"--notebooks {path}: a file that ends in .ipynb, and is there, is allowed")
    protocol.compile_physics(KERNELS)  # so that no notebook shows that it compiles
    stale = []
    for path in args.notebooks:
        new = executed(path)
        if not args.check:
            with protocol.replacing(path) as file:
                file.write((nbformat.writes(new) + "\n").encode())
            print(f"wrote {path}")
            continue
        difference = list(difflib.unified_diff(shown(nbformat.read(path, as_version=4)), shown(new), lineterm="", n=0))
        stale += [f"{path}:", *difference] if difference else []
    if stale:
        protocol.fail("\n".join([*stale, "python analysis/execute_notebooks.py writes them anew"]))


if __name__ == "__main__":
    main(protocol.parse(Args))
