"""Whether the methods learn: returns and gains in training, against fixed strategies and the best constant plan."""

import numpy as np

from analysis import metrics
from analysis.figures.common import (
    SEEDS_95,
    STEPS,
    finish,
    learners,
    learning_curve,
    legend,
    no_data,
    panels,
    steps_of,
    training_curve,
)
from analysis.methods import LEARNERS, METHODS, STRATEGIES
from analysis.studies import constant_plans
from analysis.studies.training_gains import gains

SIZE = (7.2, 4.8)
MADE_BY = "python analysis/reproduce.py --only main"
PARTS = 20  # of the training; fewer than of a learning curve, as a part of the episodes has a gain
CAPTION = (
    "Sums over 50 years: (a-c) returns of training episodes, (d-f) less those of zero change on the same "
    f"episodes; {SEEDS_95}. Dashed, dotted, where (d-f) have been run: fixed strategies, their mean gain on the "
    "evaluation's sites, which are others, in (a-c) added to zero change's mean return in training; the best constant "
    "plan is that of each weight."
)
BEST = "Best constant plan"
QUANTITIES = {"carbon": "carbon", "thaw": "thaw", "scalarized": "scalarised"}


def draw(figure, results) -> None:
    """Carbon, thaw and their scalarisation: returns above, gains below."""
    axes = panels(figure, 2, 3, [f"{title} {kind}" for kind in ("return", "gain") for title in QUANTITIES.values()])
    nothing = results.study("training_gains")
    levels = [] if nothing is None else baselines(results, nothing)
    for k, name in enumerate(QUANTITIES):
        for method in learners(axes[k], results):
            replicates = results.of("main", method.script)
            learning_curve(axes[k], replicates, f"{name}_return", method.colour, method.title)
        for method in learners(axes[3 + k], results) if nothing is not None else ():
            gain_curve(axes[3 + k], results.of("main", method.script), nothing, f"{name}_gain", method.colour)
        for ax, kind in ((axes[k], "return"), (axes[3 + k], "gain")):
            if kind == "gain" and nothing is None:
                no_data(ax, "python analysis/studies/training_gains.py")
                continue
            for label, colour, values in levels:
                style = ":" if label == BEST else "--"
                ax.axhline(values[f"{name}_{kind}"], color=colour, linestyle=style, linewidth=0.9, label=label)
            finish(ax, ylabel=f"{QUANTITIES[name]} {kind}", **STEPS)
    legend(figure, axes[:1])


def gain_curve(ax, replicates, nothing, column: str, colour) -> None:
    """A gain of the training episodes against environment steps; none until every seed has it: a part may mislead."""
    runs = [one.runs[0] for one in replicates]
    tables, steps = [gains(run, nothing) for run in runs], steps_of(runs)
    if any(table is None for table in tables):
        return
    parts = [np.minimum((table.global_step - 1) * PARTS // steps, PARTS - 1) for table in tables]
    curves = [table[column].groupby(part).mean() for table, part in zip(tables, parts, strict=True)]
    training_curve(ax, [curve.reindex(range(PARTS)) for curve in curves], steps, colour, None)


def baselines(results, nothing) -> list[tuple]:
    """(title, colour, quantity -> level) of the fixed strategies and of the best constant plan.

    nothing : the study's table. The evaluation's sites are few, and returns differ between sites far more than between
    strategies, so that a strategy's level among the training's returns is its gain over zero change's mean there.
    """
    fixed = [(METHODS[script], one.evaluation) for script in STRATEGIES for one in results.of("main", script)]
    zero = next((evaluation for method, evaluation in fixed if method.script == "zero_change"), None)
    if zero is None:
        return []
    evaluated = [(method.title, method.colour, evaluation) for method, evaluation in fixed]
    plans = results.constant_plans_in(results.first_job("main", LEARNERS[0]).env_id, "asymmetric", None)
    if plans is not None:
        weights = sorted(zero.preference.unique())
        best = constant_plans.as_evaluation(plans, weights, best=True)
        evaluated.append((BEST, "#000000", best))
    carbon, thaw = nothing.carbon_return.mean(), nothing.thaw_return.mean()
    start = {"carbon": carbon, "thaw": thaw, "scalarized": (carbon + thaw) / 2}  # a training's mean weight is 1/2
    levels = []
    for title, colour, evaluation in evaluated:
        gained = metrics.gains(evaluation, zero)
        gain = {
            "carbon": gained.carbon_return.mean(),
            "thaw": gained.thaw_return.mean(),
            "scalarized": metrics.mean_scalarized(gained),
        }
        levels.append(
            (
                title,
                colour,
                {f"{name}_gain": gain[name] for name in gain}
                | {f"{name}_return": start[name] + gain[name] for name in gain},
            )
        )
    return levels
