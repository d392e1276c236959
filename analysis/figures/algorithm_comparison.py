"""The preference-conditioned methods and the fixed strategies: learning, evaluation, trade-offs."""

import numpy as np

from analysis import metrics
from analysis.figures.common import (
    OF_SITES,
    RETURNS,
    SEEDS_95,
    STEPS,
    finish,
    learners,
    learning_curve,
    legend,
    mean_front,
    no_data,
    panels,
    wanting,
    weight_points,
)
from analysis.methods import LEARNERS, METHODS, STRATEGIES

SIZE = (7, 5.6)
MADE_BY = "python analysis/reproduce.py --only main"
SHOWN = (*LEARNERS, *STRATEGIES)
CAPTION = (
    f"Returns are sums over 50 years. (a) {SEEDS_95}; {OF_SITES}. (b) 0: doing nothing, 100: the best constant plan of "
    "each weight; bars: interquartile mean over seeds, left greedy, right sampled; dots: seeds. (c) a point a weight, "
    "plain mean over seeds. (d) large: mean over seeds, small: seeds. (c, d) greedy."
)


def draw(figure, results) -> None:
    """Learning curves, evaluation, trade-offs of all, the curriculum's trade-off."""
    learning, bars, trade_offs, curriculum = panels(
        figure, 2, 2, ["training", "score", "trade-offs", "Curriculum PPO by weight"]
    )
    for method in learners(learning, results):
        replicates = results.of("main", method.script)
        learning_curve(learning, replicates, "scalarized_return", method.colour, method.title)
    finish(learning, ylabel="scalarised return", **STEPS)

    shown = [METHODS[script] for script in SHOWN if not wanting(bars, results, "main", script)]
    shown = [method for method in shown if not np.isnan([one.score for one in results.of("main", method.script)]).all()]
    for k, method in enumerate(shown):
        replicates = results.of("main", method.script)
        for offset, policy, opacity in ((-0.2, "greedy", 0.8), (0.2, "sampled", 0.4)):
            scores = [one.score_of(one.by_policy.get(policy)) for one in replicates]
            bars.bar(k + offset, metrics.iqm(scores), 0.38, color=method.colour, alpha=opacity)
            bars.plot(np.full(len(scores), k + offset), scores, "o", color="black", markersize=2)
    bars.set_xticks(range(len(shown)), [method.title for method in shown], rotation=40, ha="right")
    for level in (0, 100) if shown else ():
        bars.axhline(level, color="black", linewidth=0.5)
    if results.constant_plans is None:
        no_data(bars, "python analysis/studies/constant_plans.py")
    else:
        finish(bars, ylabel="score")

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
