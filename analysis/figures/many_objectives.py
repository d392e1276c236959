"""A figure for each environment with other objectives than carbon and thaw: what each method reaches at each weight.

Parallel coordinates have an axis an objective and a line a weight. With three objectives there is a ternary diagram of
each return besides: a corner is all weight on one objective, a point a weight of the lattice.
"""

import itertools
import textwrap

import numpy as np
from matplotlib.lines import Line2D

from analysis import methods, metrics
from analysis.figures.common import WEIGHT_COLOURS, letter
from analysis.results import PAIR
from analysis.tables.many_objectives import file_stem

COLOURS = ("#009e73", "#0072b2", "#d55e00", "#cc79a7", "#e69f00")  # of the objectives
EQUAL, REFERENCE = "#999999", "black"
CAPTION = (
    "Evaluation, greedy: mean returns over episodes and training seeds (one seed: its own) at each weight. A line has "
    "the colour of the largest weight's objective, grey where several share it; widths only keep lines "
    "apart."
)

OF_TRIANGLES = " Triangles: a corner is all weight on one, the colour is the return."
STEM = "many_objectives"
MADE_BY = "python analysis/reproduce.py --only worlds"


def figures(results) -> dict:
    """File name -> its size in inches, the function that draws it into a figure, and its caption."""
    found = {}
    for env_id in dict.fromkeys(key[1] for key in results.rows):
        objectives = results.objectives(env_id)
        rows = {key: one for key, one in results.rows.items() if key[1] == env_id and one}
        followers = {key: one for key, one in rows.items() if results.is_trained(key)}
        if objectives != PAIR and len(objectives) > 1 and followers:
            fixed = {key: one for key, one in rows.items() if key not in followers}
            columns = 4 if len(objectives) == 3 else 1
            size = (2.8 + 1.9 * (columns - 1) if columns > 1 else 5.0, 0.7 + 2.1 * len(followers))
            caption = CAPTION + (OF_TRIANGLES if columns > 1 else "")
            found[f"{STEM}_{file_stem(env_id)}"] = (size, drawn(objectives, followers, fixed), caption)
    return found


def drawn(objectives, followers, fixed):
    """The function that draws rows (key -> replicates) that follow weights, and those that do not."""

    def draw(figure) -> None:
        tables = {key: mean_table(one) for key, one in followers.items()}
        references = [mean_table(one).to_numpy().mean(axis=0) for one in fixed.values()]
        points = np.concatenate([*(table.to_numpy() for table in tables.values()), *(p[None] for p in references)])
        low, high = points.min(axis=0), points.max(axis=0)
        ternary = len(objectives) == 3
        ratios = [1.6, 1, 1, 1] if ternary else [1]
        axes = figure.subplots(len(tables), len(ratios), squeeze=False, width_ratios=ratios)
        letter(axes[:, 0], [textwrap.fill(title_of(key), 120 if ternary else 65) for key in tables])
        for row, table in zip(axes, tables.values(), strict=True):
            parallel(row[0], table, references, objectives, low, high)
            for k, ax in enumerate(row[1:]):
                triangle = ternary_diagram(ax, table, objectives, k, (low[k], high[k]))
                figure.colorbar(triangle, ax=ax, shrink=0.7, label=f"{objectives[k]} return")
        names = [*objectives, "shared", *(["fixed strategy, which does not look at the weight"] if references else [])]
        colours = itertools.islice(itertools.cycle(COLOURS), len(objectives))
        looks = [(colour, "-") for colour in colours] + [(EQUAL, "-"), (REFERENCE, "--")]
        handles = [Line2D([], [], color=colour, linestyle=style) for colour, style in looks[: len(names)]]
        figure.legend(handles, names, loc="outside upper center", ncols=3)

    return draw


def title_of(key) -> str:
    """A method's title, with its flags if it has any."""
    return ", ".join(filter(None, (methods.title(key[0]), methods.flags(key[2]))))


def mean_table(replicates):
    """Mean returns at each weight over episodes and seeds: index the weights, columns the objectives."""
    tables = [metrics.mean_returns(one.evaluation) for one in replicates]
    return sum(tables[1:], tables[0]) / len(tables)


def colour_of(weights) -> str:
    """Colour of the objective with the largest weight; none where two have it."""
    first, second = np.sort(weights)[::-1][:2]
    return COLOURS[int(np.argmax(weights)) % len(COLOURS)] if first > second + 1e-9 else EQUAL


def parallel(ax, table, references, objectives, low, high) -> None:
    """An axis an objective, from its lowest to its highest return of any method; a line a weight.

    Lines of later objectives are thinner and on top, so that those below them are seen too.
    """
    span = np.where(high > low, high - low, 1.0)
    x = np.arange(len(objectives))
    for weights, returns in zip(table.index, table.to_numpy(), strict=True):
        place = COLOURS.index(colour_of(weights)) if colour_of(weights) != EQUAL else 0
        look = {"linewidth": max(2.4 - 0.6 * place, 0.6), "zorder": 2 + 0.1 * place}
        ax.plot(x, (returns - low) / span, color=colour_of(weights), **look)
    for returns in references:
        ax.plot(x, (returns - low) / span, "--", color=REFERENCE, linewidth=0.9)
    for k in x:
        ax.axvline(k, color="#bbbbbb", linewidth=0.6, zorder=0)
        for height, value in ((-0.04, low[k]), (1.04, high[k])):
            ax.text(k, height, f"{value:.2f}", ha="center", va="top" if height < 0 else "bottom", fontsize=6)
    ax.set_xticks(x, objectives)
    ax.tick_params(axis="x", length=0, pad=9)
    ax.set_yticks([])
    ax.set_ylim(-0.02, 1.14)
    for side in ("left", "bottom"):
        ax.spines[side].set_visible(False)


def ternary_diagram(ax, table, objectives, k: int, limits):
    """The weights in a triangle, coloured by the return of objective `k` between `limits`."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])
    ax.plot(*corners[[0, 1, 2, 0]].T, color="#bbbbbb", linewidth=0.6, zorder=0)
    weights = np.array(table.index.to_list())
    points = ax.scatter(
        *(weights @ corners).T,
        c=table.to_numpy()[:, k],
        cmap=WEIGHT_COLOURS,
        vmin=limits[0],
        vmax=limits[1],
        s=55,
        marker="h",
        linewidths=0,
        clip_on=False,
    )
    places = ((-0.1, -0.1, "left", "top"), (1.1, -0.1, "right", "top"), (0.5, np.sqrt(0.75) + 0.08, "center", "bottom"))
    for name, (x, y, across, up) in zip(objectives, places, strict=True):
        ax.text(x, y, name, ha=across, va=up, fontsize=6)
    ax.set_aspect("equal")
    ax.set_axis_off()
    return points
