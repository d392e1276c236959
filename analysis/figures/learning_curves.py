"""Whether the methods learn: returns of training episodes, and gains on validation sites meanwhile."""

from analysis.experiments import GENERALIST
from analysis.figures.common import (
    OF_SITES,
    SEEDS_95,
    STEPS,
    finish,
    learners,
    learning_curve,
    legend,
    panels,
    validation_curve,
)
from cleanrl_style import protocol
from cleanrl_style.protocol.arguments import DEFAULT_STEPS
from cleanrl_style.protocol.course import STANDS, Course

SIZE = (7.2, 4.8)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = (
    "Sums over 50 years: (a-c) returns of training episodes, whose sites differ; (d-f) what the greedy policy gains"
    f" over doing nothing on ten validation sites, always the same, mean of the weights 0, 0.5 and 1; {SEEDS_95}. "
    f"{OF_SITES}. Best constant plans are the best in the weighted sum, not in each objective."
)
MARKS = {"best": (":", "Best constant plan of each weight"), "plus_100": ("--", "+100 a year")}
QUANTITIES = {"carbon": "carbon", "thaw": "thaw", "scalarized": "scalarised"}


def draw(figure, results) -> None:
    """Carbon, thaw and their scalarisation: returns above, gains below."""
    axes = panels(figure, 2, 3, [f"{title} {kind}" for kind in ("return", "gain") for title in QUANTITIES.values()])
    course = Course(protocol.Task.of(GENERALIST), DEFAULT_STEPS["generalist"], episodes=STANDS, done=0)
    for k, name in enumerate(QUANTITIES):
        returns, gains = axes[k], axes[3 + k]
        for method in learners(returns, results):
            learning_curve(returns, results.of("main", method.script), f"{name}_return", method.colour, method.title)
        for method in learners(gains, results):
            validation_curve(gains, results.of("main", method.script), f"{name}_gain", method.colour)
        if gains.has_data():
            for mark, (style, label) in MARKS.items():
                level = course.marks[mark][f"{name}_gain"].mean()
                gains.axhline(level, color="black", linestyle=style, linewidth=0.9, label=label)
        finish(returns, ylabel=f"{QUANTITIES[name]} return", **STEPS)
        finish(gains, ylabel=f"{QUANTITIES[name]} gain", xlim=(0, None), **STEPS)
    legend(figure, [axes[0], axes[3]])
