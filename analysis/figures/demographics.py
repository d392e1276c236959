"""Stems by age class through the 50 years, and the conifer fractions of training and evaluation."""

import numpy as np
import pandas as pd

from analysis.figures.common import SEEDS_95, finish, learners, legend, letter, year_curve
from analysis.reduction import BINS

SIZE = (7, 7)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = (
    f"(a-e) evaluation, mean over the weights 0, 0.5 and 1; solid: conifers, dashed: deciduous; {SEEDS_95}. "
    "(f) last fifth of the training episodes of all seeds. (g) last year: median and 80 % of the episodes, a "
    "line a weight and seed."
)
CLASSES = {
    "seedling": "seedlings, 0-5 years",
    "sapling": "saplings, 6-20",
    "young": "young, 21-40",
    "mature": "mature, 41-100",
    "old": "old, 101+",
}


def draw(figure, results) -> None:
    """Five panels of ages, two of conifer fractions."""
    upper, lower = figure.subfigures(2, 1, height_ratios=(2, 1))
    axes = list(upper.subplots(2, 3).flat)
    free = axes.pop()
    free.axis("off")
    axes += list(lower.subplots(1, 2).flat)
    letter(axes, [*CLASSES.values(), "conifer fraction, training", "conifer fraction, evaluation"])
    for ax, age in zip(axes[:5], CLASSES, strict=True):
        for method in learners(ax, results):
            for species, style in (("conifer", "-"), ("deciduous", "--")):
                label = method.title if species == "conifer" else None
                year_curve(
                    ax, results.of("main", method.script), f"{species}_{age}_stems_ha", method.colour, label, style
                )
        finish(ax, xlabel="year", ylabel="stems/ha", ylim=(0, None))

    training, evaluation = axes[5:]
    for method in learners(training, results):
        stands = pd.concat([one.runs[0].tables["composition"] for one in results.of("main", method.script)])
        edges = np.linspace(0, 1, BINS + 1)
        middles = stands.conifer_fraction + edges[1] / 2
        number = {"weights": stands.episodes, "density": True}
        training.hist(middles, edges, **number, histtype="step", color=method.colour)
    finish(training, xlabel="conifer fraction after 50 years", ylabel="density of episodes")
    height = 0
    for method in learners(evaluation, results):
        for one in results.of("main", method.script):
            last = one.last_year[one.last_year.variable == "conifer_fraction"]
            for row in last.sort_values("preference").itertuples():
                evaluation.plot([row.p10, row.p90], [height, height], color=method.colour, linewidth=1)
                evaluation.plot(row.p50, height, "|", color=method.colour, markersize=4)
                height -= 1
        height -= 2
    finish(evaluation, xlabel="conifer fraction after 50 years", xlim=(0, 1))
    evaluation.set_yticks([])
    legend(free, axes[:1], "center", 1)
