"""The trade-offs that each method covers, a point a weight."""

from analysis.figures.common import RETURNS, finish, panels, wanting, weight_points
from analysis.methods import FIXED_WEIGHT, LEARNERS, METHODS, scripts

SIZE = (7, 5.4)
MADE_BY = "python analysis/reproduce.py --only main fixed"
CAPTION = (
    "Evaluation, greedy: means over the episodes, sums over 50 years. Large: mean over seeds; small: seeds; line: the "
    "points that none dominates."
)
PANELS = dict.fromkeys(scripts(FIXED_WEIGHT), "fixed") | dict.fromkeys(LEARNERS, "main")  # script -> experiment


def draw(figure, results) -> None:
    """A panel a method."""
    axes = panels(figure, -(-len(PANELS) // 2), 2, [METHODS[script].title for script in PANELS])
    for ax in axes[1:]:  # what a method covers is seen beside the others'
        ax.sharex(axes[0])
        ax.sharey(axes[0])
    points = None
    for ax, (script, experiment) in zip(axes, PANELS.items(), strict=True):
        if not wanting(ax, results, experiment, script):
            points = weight_points(ax, results.of(experiment, script))
        finish(ax, **RETURNS)
    if points is not None:
        figure.colorbar(points, ax=axes, label="weight of carbon", shrink=0.7)
