"""Stems by age class through the 50 years, and the conifer fractions of training and evaluation."""

import numpy as np
import pandas as pd

from analysis.figures.common import SEEDS_95, finish, learners, legend, letter, year_curve
from analysis.methods import LEARNERS
from analysis.reduction import BINS

SIZE = (7, 7)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = (
    "(a-e, g) greedy policies in evaluation. (a-e) mean over the weights 0, 0.5 and 1; solid: conifers, dashed: "
    f"deciduous; {SEEDS_95}. "
    "(f) last fifth of the training episodes of all seeds. (g) last year: median and 80 % of the episodes, "
    "medians over training seeds; small: each seed's median."
)
CLASSES = {
    "seedling": "seedlings, 0-5 years",
    "sapling": "saplings, 6-20",
    "young": "young, 21-40",
    "mature": "mature, 41-100",
    "old": "old, 101+",
}
GROUP = 0.7  # height of a weight's lines, of the distance between two weights


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
    for species, style in (("conifers", "-"), ("deciduous trees", "--")):
        axes[0].plot([], [], style, color="black", label=species)

    training, evaluation = axes[5:]
    for method in learners(training, results):
        stands = pd.concat([one.runs[0].tables["composition"] for one in results.of("main", method.script)])
        edges = np.linspace(0, 1, BINS + 1)
        middles = stands.conifer_fraction + edges[1] / 2
        number = {"weights": stands.episodes, "density": True}
        if not stands.episodes.any():  # nothing has no density
            continue
        training.hist(middles, edges, **number, histtype="step", color=method.colour)
    finish(training, xlabel="conifer fraction after 50 years", ylabel="density of episodes")
    for k, method in enumerate(learners(evaluation, results)):
        rows = pd.concat([one.last_year for one in results.of("main", method.script)])
        rows = rows[rows.variable == "conifer_fraction"]
        of_weights = list(rows.groupby("preference"))
        for place, (_, of_seeds) in enumerate(of_weights):
            height = place + GROUP * ((len(LEARNERS) - 1) / 2 - k) / len(LEARNERS)
            evaluation.plot(of_seeds.p50, [height] * len(of_seeds), "o", color=method.colour, markersize=2, alpha=0.5)
            low, median, high = of_seeds[["p10", "p50", "p90"]].median()
            evaluation.plot([low, high], [height, height], color=method.colour, linewidth=1.3)
            evaluation.plot(median, height, "|", color=method.colour, markersize=7, markeredgewidth=1.5)
        evaluation.set_yticks(range(len(of_weights)), [f"{weight:g}" for weight, _ in of_weights])
    finish(evaluation, xlabel="conifer fraction after 50 years", ylabel="weight of carbon", xlim=(0, 1))
    legend(free, axes[:1], "center", 1)
