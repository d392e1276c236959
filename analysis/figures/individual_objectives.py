"""Carbon and thaw apart, in training and in evaluation."""

import numpy as np

from analysis import metrics
from analysis.figures.common import OF_SITES, SEEDS_95, STEPS, band, finish, learners, learning_curve, legend, panels
from cleanrl_style.protocol.fronts import evaluation_weights

SIZE = (7, 5.2)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = (
    f"Returns are sums over 50 years; {SEEDS_95}. (a, b) {OF_SITES}. (c, d) greedy, means over the episodes; bands are "
    "of these sites: on others a change by weight is less sure."
)
OBJECTIVES = {"carbon_return": "carbon return", "thaw_return": "thaw return"}


def draw(figure, results) -> None:
    """Learning curves of both, then both by weight."""
    axes = panels(figure, 2, 2, ["carbon, training", "thaw, training", "carbon, evaluation", "thaw, evaluation"])
    for ax, (column, label) in zip(axes[:2], OBJECTIVES.items(), strict=True):
        for method in learners(ax, results):
            learning_curve(ax, results.of("main", method.script), column, method.colour, method.title)
        finish(ax, ylabel=label, **STEPS)
    for ax, (column, label) in zip(axes[2:], OBJECTIVES.items(), strict=True):
        for method in learners(ax, results):
            fronts = [metrics.mean_returns(one.evaluation)[column] for one in results.of("main", method.script)]
            band(ax, fronts[0].index, np.array(fronts), method.colour, method.title, marker=method.marker)
        finish(ax, xlabel="weight of carbon", ylabel=label)
        if ax.has_data():
            ax.set_xticks(evaluation_weights(2))
    legend(figure, axes)
