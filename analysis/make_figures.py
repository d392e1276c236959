"""Draws the paper's figures from the runs that exist, yours and those of the project: runs/figures/*.png and *.pdf.

    python analysis/make_figures.py [--runs-dir runs results/runs] [--figures-dir runs/figures]

Those of results/figures are of the project's runs alone; `reproduce.py` makes them.

A panel without runs says which command makes them. A figure without any is not drawn, and what an earlier call left of
it is removed.
"""

import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from analysis import paths
from analysis.experiments import GENERALIST
from analysis.figures import (
    algorithm_comparison,
    demographics,
    individual_objectives,
    learning_asymmetry,
    learning_curves,
    learning_difficulty,
    many_objectives,
    performance_panel,
    site_influence,
    strategies,
    trade_off_coverage,
    training_dynamics,
)
from analysis.figures.common import STYLE, remove, save
from analysis.make_tables import name_of, say_what_was_not_run
from analysis.results import Results
from cleanrl_style import protocol

FIGURES = (
    learning_curves,
    learning_asymmetry,
    algorithm_comparison,
    strategies,
    site_influence,
    trade_off_coverage,
    training_dynamics,
    performance_panel,
    individual_objectives,
    demographics,
    learning_difficulty,
)


@dataclass
class Args:
    """Draws the figures from the runs that exist."""

    runs_dir: tuple[Path, ...] | None = None
    """folders that hold the runs, at any depth (None: results/runs and runs)"""
    figures_dir: Path | None = None
    """folder for the figures (None: runs/figures, or runs/quick/figures)"""
    quick: bool = False
    """from the runs of `reproduce.py --quick`"""


def draw(module, results: Results) -> Figure:
    """One figure, its caption below."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=module.SIZE, layout="constrained")
        module.draw(figure, results)
        figure.supxlabel(textwrap.fill(f"{GENERALIST}. {module.CAPTION}", 140), fontsize=6)
    return figure


def main(args: Args) -> None:
    """Draw every figure; name what was left out."""
    results = Results.load(args.quick, args.runs_dir)
    if not any(results.rows.values()):
        where, first = ", ".join(map(str, results.roots)), results.jobs[0].command
        protocol.fail(f"no finished run under {where}; `{first}` makes the first, `python analysis/reproduce.py` all")
    for line in results.left_out:
        print(f"left out: {line}", file=sys.stderr)
    folder = args.figures_dir or paths.runs(args.quick) / "figures"
    paths.make_writable("--figures-dir", folder)
    not_run = []
    for module in FIGURES:
        figure = draw(module, results)
        if not any(ax.has_data() for ax in figure.get_axes()):
            remove(folder / name_of(module))
            not_run.append(f"{name_of(module)}: {module.MADE_BY}")
            continue
        with matplotlib.rc_context(STYLE):
            save(figure, folder / name_of(module))
    others = many_objectives.figures(results)
    for path in set(folder.glob(f"{many_objectives.STEM}_*.png")) - {folder / f"{name}.png" for name in others}:
        remove(path)
    for name, (size, drawing, caption) in others.items():
        with matplotlib.rc_context(STYLE):
            figure = Figure(figsize=size, layout="constrained")
            drawing(figure)
            world = name.removeprefix(f"{many_objectives.STEM}_")
            figure.supxlabel(textwrap.fill(f"{world}. {caption}", int(18 * size[0])), fontsize=6)
            save(figure, folder / name)
    say_what_was_not_run("figures", not_run)
    number = len(FIGURES) - len(not_run) + len(others)
    print(f"{number} figure{'s'[: number != 1]}: {folder}/*.png, *.pdf")


if __name__ == "__main__":
    main(protocol.parse(Args))
