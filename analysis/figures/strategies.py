"""What each method does with the stands of the evaluation."""

import numpy as np
import pandas as pd
from matplotlib.colors import to_rgba

from analysis.figures.common import SEEDS_95, finish, learners, legend, panels, season_curves, year_curve

SIZE = (7, 5.2)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = (
    f"Evaluation, greedy: means over the episodes and the weights 0, 0.5 and 1; {SEEDS_95}. (c) last year: median, and "
    "80 % of the episodes, medians over training seeds, larger with the weight of carbon; small: each seed. "
    "(d) all weights; eighths of the episodes by days above 5 °C."
)


def draw(figure, results) -> None:
    """Species, density, both in the last year, growing season against thaw."""
    species, density, composition, season = panels(
        figure, 2, 2, ["species", "stem density", "composition after 50 years", "growing season and thaw"]
    )
    for ax, variable, label in (
        (species, "conifer_fraction", "conifer fraction"),
        (density, "density_stems_ha", "stems/ha"),
    ):
        for method in learners(ax, results):
            year_curve(ax, results.of("main", method.script), variable, method.colour, method.title)
        finish(ax, xlabel="year", ylabel=label)
    for method in learners(composition, results):
        runs = [
            one.last_year.pivot(index="preference", columns="variable", values=["p10", "p50", "p90"])
            for one in results.of("main", method.script)
        ]
        for seed in runs:
            x, y = seed["p50"].density_stems_ha, seed["p50"].conifer_fraction
            composition.scatter(x, y, s=4, marker=method.marker, color=method.colour, alpha=0.4, linewidth=0)
        if runs:
            whiskers(composition, pd.concat(runs).groupby("preference").median(), method)
    finish(composition, xlabel="stems/ha", ylabel="conifer fraction", ylim=(0, 1))
    season_curves(season, results)
    legend(figure, [species, season])


def whiskers(ax, of_weights: pd.DataFrame, method) -> None:
    """A method's density and species at each weight, the larger the more carbon counts, in the order of weights."""
    x, y = (of_weights.xs(name, axis=1, level=1) for name in ("density_stems_ha", "conifer_fraction"))
    ax.plot(x.p50, y.p50, color=method.colour, linewidth=1)
    for size, weight in zip(np.linspace(3, 8, len(of_weights)), of_weights.index, strict=True):
        low, median, high = ([x[q][weight], y[q][weight]] for q in ("p10", "p50", "p90"))
        xerr, yerr = ([[m - a], [b - m]] for a, m, b in zip(low, median, high, strict=True))
        pale = to_rgba(method.colour, 0.3)  # most of it overlaps
        style = {"fmt": method.marker, "color": method.colour, "ecolor": pale, "linewidth": 0.8, "markersize": size}
        ax.errorbar(*median, xerr=xerr, yerr=yerr, **style)
