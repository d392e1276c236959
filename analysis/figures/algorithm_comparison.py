"""The three preference-conditioned methods and the fixed strategies: learning, evaluation, trade-offs."""

import numpy as np

from analysis.figures.common import (
    RETURNS,
    SEEDS_95,
    STEPS,
    finish,
    learners,
    learning_curve,
    legend,
    mean_front,
    panels,
    wanting,
    weight_points,
)
from analysis.methods import LEARNERS, METHODS, STRATEGIES

SIZE = (7, 5.6)
SHOWN = (*LEARNERS, *STRATEGIES)
CAPTION = (
    f"Returns are sums over 50 years. (a) {SEEDS_95}. (b) thin bars: standard deviation over episodes, as in "
    "the paper; dots: seeds. (c) a point a weight, mean over seeds. (d) large: mean over seeds, small: seeds."
)


def draw(figure, results) -> None:
    """Learning curves, evaluation, trade-offs of all, the curriculum's trade-off."""
    learning, bars, trade_offs, curriculum = panels(
        figure, 2, 2, ["training", "evaluation", "trade-offs", "Curriculum PPO by weight"]
    )
    for method in learners(learning, results):
        replicates = results.of("main", method.script)
        learning_curve(learning, replicates, "scalarized_return", method.colour, method.title)
    finish(learning, ylabel="scalarised return", **STEPS)

    shown = [METHODS[script] for script in SHOWN if not wanting(bars, results, "main", script)]
    for k, method in enumerate(shown):
        evaluations = [one.evaluation.scalarized_return for one in results.of("main", method.script)]
        means = [values.mean() for values in evaluations]
        bars.bar(k, np.mean(means), color=method.colour, alpha=0.6)
        spread = np.mean([values.std() for values in evaluations])
        bars.errorbar(k, np.mean(means), spread, color="black", linewidth=0.6)
        bars.plot(np.full(len(means), k), means, "o", color="black", markersize=2)
    bars.set_xticks(range(len(shown)), [method.title for method in shown], rotation=40, ha="right")
    bars.axhline(0, color="black", linewidth=0.5)
    finish(bars, ylabel="mean scalarised return")

    for script in SHOWN:
        if not wanting(trade_offs, results, "main", script):
            front, method = mean_front(results.of("main", script)), METHODS[script]
            trade_offs.plot(
                front.thaw_return,
                front.carbon_return,
                method.marker,
                color=method.colour,
                label=method.title,
                markersize=5,
            )
    finish(trade_offs, **RETURNS)

    if not wanting(curriculum, results, "main", "ppo_curriculum"):
        points = weight_points(curriculum, results.of("main", "ppo_curriculum"))
        figure.colorbar(points, ax=curriculum, label="weight of carbon")
    finish(curriculum, **RETURNS)
    legend(figure, [learning, trade_offs], ncols=4)
