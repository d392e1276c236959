"""What all figures share: letters, curves with bands, panels without data, files with the same bytes."""

import itertools
import textwrap
from pathlib import Path
from string import ascii_lowercase

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from analysis import metrics
from analysis.methods import LEARNERS, METHODS
from analysis.results import by_year
from cleanrl_style import protocol

STYLE = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "pdf.fonttype": 42,
}
WEIGHT_COLOURS = "viridis"
OF_SITES = "Group PPO meets an eighth of the sites of the others, so its training returns swing more"
SEEDS_95 = "curves and bands: interquartile mean over training seeds and its 95 % interval (none with one seed)"


def save(figure: Figure, stem: Path) -> None:
    """stem.png and stem.pdf, without dates or versions: the same bytes from the same runs."""
    with protocol.replacing(stem.with_suffix(".png")) as file:
        figure.savefig(file, format="png", dpi=200, metadata={"Software": None})
    with protocol.replacing(stem.with_suffix(".pdf")) as file:
        figure.savefig(file, format="pdf", metadata={"Creator": None, "Producer": None, "CreationDate": None})


def remove(stem: Path) -> None:
    """Remove what an earlier `save` left."""
    for suffix in (".png", ".pdf"):
        stem.with_suffix(suffix).unlink(missing_ok=True)


def panels(figure: Figure, rows: int, columns: int, titles: list[str]) -> list:
    """Axes with letters and titles, row by row, one a title."""
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for ax in axes[len(titles) :]:
        ax.remove()
    letter(axes[: len(titles)], titles)
    return axes[: len(titles)]


def letter(axes, titles) -> None:
    """Title each panel with its letter: a to z, then aa, ab, .."""
    letters = [*ascii_lowercase, *map("".join, itertools.product(ascii_lowercase, repeat=2))]
    for ax, title, name in zip(axes, titles, letters[: len(titles)], strict=True):
        ax.set_title(f"({name}) {title}", loc="left")


def no_data(ax, *commands: str) -> None:
    """Say in an empty panel which command makes its data."""
    lines = [line for command in commands for line in textwrap.wrap(command, 42, subsequent_indent="    ")]
    ax.text(
        0.5,
        0.5,
        "\n".join(["not run yet:", *lines]),
        transform=ax.transAxes,
        ha="center",
        va="center",
        fontsize=5,
        family="monospace",
        wrap=True,
    )
    ax.set_xticks([])
    ax.set_yticks([])


def wanting(ax, results, experiment: str, script: str) -> bool:
    """Whether a script has no finished run; then the panel, if still empty, says which command makes it."""
    if results.of(experiment, script):
        return False
    job = results.first_job(experiment, script)
    ax.wanted = [*getattr(ax, "wanted", []), job]
    return True


def finish(ax, **labels) -> None:
    """Labels of a panel; one that has drawn nothing names its commands, one that lacks some too."""
    wanted = getattr(ax, "wanted", [])
    if not ax.has_data() and getattr(ax, "too_short", False):
        ax.text(0.5, 0.5, "too short a training to be followed", transform=ax.transAxes, ha="center", fontsize=5)
        return
    if not ax.has_data():
        no_data(ax, *(job.command for job in wanted))
        return
    ax.set(**labels)
    for axis, most in ((ax.xaxis, 4), (ax.yaxis, 5)):
        if isinstance(axis.get_major_formatter(), ScalarFormatter):
            axis.set_major_locator(MaxNLocator(most, steps=(1, 2, 5, 10)))
            axis.get_major_formatter().set_useOffset(False)
    if wanted:
        experiments = " ".join(dict.fromkeys(job.experiment for job in wanted))
        note = [
            *textwrap.wrap("not run yet: " + ", ".join(job.script for job in wanted), 60),
            f"(python analysis/reproduce.py --only {experiments})",
        ]
        ax.text(0.99, 0.01, "\n".join(note), transform=ax.transAxes, ha="right", va="bottom", fontsize=5)


def legend(where, axes, loc="outside upper center", ncols: int = 5) -> None:
    """One legend for all panels, off their data; a label takes the look that it has in the last of the axes.

    where : the figure, or axes that show nothing else
    """
    handles = {label: handle for ax in axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    if handles:
        where.legend(handles.values(), handles.keys(), loc=loc, ncols=ncols)


# ------------------------------------------------------------------------------------------------- curves


def band(ax, x, curves, colour, label, style="-", marker=None) -> None:
    """Interquartile mean of curves (seeds, points) and its 95 % bootstrap interval over the seeds."""
    middle, low, high = metrics.bootstrap_band(curves)
    ax.plot(x, middle, style, color=colour, label=label, marker=marker, markersize=3)
    if len(curves) > 1:
        ax.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0)


def training_curve(ax, curves, steps: int, colour, label, **kwargs) -> None:
    """Curves (replicates, parts of the training) against steps, but for parts in which one has no episodes."""
    curves = np.asarray(curves)
    known = ~np.isnan(curves).any(axis=0)
    x = (np.arange(curves.shape[1]) + 0.5) * steps / curves.shape[1] / 1000
    band(ax, x[known], curves[:, known], colour, label, **kwargs)


def steps_of(runs) -> int:
    """Environment steps of the longest training."""
    return max(run.arguments["total_timesteps"] for run in runs)


def learning_curve(ax, replicates, column: str, colour, label: str, statistic: str = "mean") -> None:
    """A column of the training episodes of replicates of one run each."""
    runs = [one.runs[0] for one in replicates]
    training_curve(ax, [run.course(column, statistic) for run in runs], steps_of(runs), colour, label)


def validation_curve(ax, replicates, column: str, colour) -> None:
    """A column of the courses on validation sites, in the mean of the weights; none until every seed has one."""
    courses = [one.runs[0].tables.get("validation", pd.DataFrame()) for one in replicates]
    if any(course.empty for course in courses):
        ax.too_short = True
        return
    curves = pd.concat([course.groupby("global_step")[column].mean() for course in courses], axis=1)
    band(ax, curves.index / 1000, curves.to_numpy().T, colour, None, marker="o")


def year_curve(ax, replicates, variable: str, colour, label: str, style="-") -> None:
    """A column of the annual record against the year."""
    curves = by_year(replicates, variable)
    band(ax, np.arange(1, curves.shape[1] + 1), curves, colour, label, style)


def by_season(replicates) -> tuple[np.ndarray, np.ndarray]:
    """Thaw return against growing season: means in bins with equally many episodes, (points), (replicates, points)."""

    def of_one(one):
        groups = pd.qcut(one.evaluation.growing_season_days, 8, labels=False, duplicates="drop")
        return one.evaluation.groupby(groups)[["growing_season_days", "thaw_return"]].mean()

    tables = [of_one(one) for one in replicates]
    return tables[0].growing_season_days.to_numpy(), np.array([table.thaw_return for table in tables])


def season_curves(ax, results) -> None:
    """Growing season against thaw return for every method."""
    for method in learners(ax, results):
        band(ax, *by_season(results.of("main", method.script)), method.colour, method.title, marker=method.marker)
    curves = [line.get_ydata() for line in ax.lines]
    if len(curves) > 1 and len({len(curve) for curve in curves}) == 1:
        note = f"methods differ by at most {np.ptp(curves, axis=0).max():.1f}"
        ax.text(0.98, 0.98, note, transform=ax.transAxes, ha="right", va="top", fontsize=7)
    finish(ax, xlabel="days a year with a mean above 5 °C", ylabel="thaw return (50 years)")


# ---------------------------------------------------------------------------------------------- trade-offs


def learners(ax, results):
    """The preference-conditioned methods that have runs; the others' commands are noted."""
    for script in LEARNERS:
        if not wanting(ax, results, "main", script):
            yield METHODS[script]


def mean_front(replicates) -> pd.DataFrame:
    """Mean returns by weight, averaged over replicates."""
    tables = [metrics.mean_returns(one.evaluation) for one in replicates]
    return pd.concat(tables).groupby(level=0).mean()


def weight_points(ax, replicates):
    """Every seed's mean returns at each weight, small, and their mean, large, coloured by the weight."""
    for one in replicates if len(replicates) > 1 else ():
        front = metrics.mean_returns(one.evaluation)
        ax.scatter(
            front.thaw_return,
            front.carbon_return,
            c=front.index,
            cmap=WEIGHT_COLOURS,
            vmin=0,
            vmax=1,
            s=5,
            alpha=0.5,
            linewidths=0,
        )
    front = mean_front(replicates)
    best = front[metrics.is_nondominated(front)].sort_values("thaw_return")
    ax.plot(best.thaw_return, best.carbon_return, color="#888888", linewidth=0.8, zorder=1)
    points = ax.scatter(
        front.thaw_return,
        front.carbon_return,
        c=front.index,
        cmap=WEIGHT_COLOURS,
        vmin=0,
        vmax=1,
        s=28,
        edgecolors="black",
        linewidths=0.5,
    )
    for weight, offset in ((front.index[0], (-7, -8)), (front.index[-1], (4, 4))):  # apart where both are one point
        ax.annotate(
            f"{weight:g}",
            front.loc[weight, ["thaw_return", "carbon_return"]],
            xytext=offset,
            textcoords="offset points",
            fontsize=6,
        )
    return points


RETURNS = {"xlabel": "thaw return (50 years)", "ylabel": "carbon return (50 years)"}
STEPS = {"xlabel": "environment steps (thousands)"}
