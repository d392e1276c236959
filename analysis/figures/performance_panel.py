"""Both objectives in training and evaluation, the growing season, and the stands' ages."""

import numpy as np

from analysis.figures.common import (
    OF_SITES,
    RETURNS,
    SEEDS_95,
    finish,
    learners,
    legend,
    mean_front,
    panels,
    season_curves,
)
from analysis.methods import LEARNERS
from analysis.reduction import AGE_CLASSES, SPECIES
from analysis.results import by_year

SIZE = (7, 5.4)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = (
    "(a) mean over the seeds in eighths of the training, the mark is the last. "
    f"{OF_SITES}. (b) a point a weight, plain mean over seeds. (c) {SEEDS_95}. "
    "(d) mean over the weights 0, 0.5 and 1 and seeds; lines on bars: sd over seeds. (b-d) greedy."
)
PARTS = 8  # of the training
GROUP, BARS = 0.81, 0.75  # width of a class's bars, with the gaps between them and without


def draw(figure, results) -> None:
    """Carbon against thaw twice, growing season, demographics."""
    training, evaluation, season, ages = panels(
        figure, 2, 2, ["training", "evaluation", "growing season and thaw", "ages after 50 years"]
    )
    for method in learners(training, results):
        runs = [one.runs[0] for one in results.of("main", method.script)]
        courses = [[run.course(f"{name}_return", parts=PARTS) for run in runs] for name in ("thaw", "carbon")]
        thaw, carbon = (np.mean(one, axis=0) for one in courses)
        known = np.flatnonzero(~np.isnan(thaw))
        training.plot(thaw[known], carbon[known], color=method.colour, linewidth=0.7, alpha=0.6)
        last = known[-1:]  # none where no episode came to its end
        training.plot(thaw[last], carbon[last], method.marker, color=method.colour, label=method.title)
    finish(training, **RETURNS)
    for method in learners(evaluation, results):
        front = mean_front(results.of("main", method.script))
        evaluation.plot(front.thaw_return, front.carbon_return, method.marker, color=method.colour, label=method.title)
    finish(evaluation, **RETURNS)
    season_curves(season, results)
    for k, method in enumerate(learners(ages, results)):
        stems = np.array(
            [
                sum(
                    by_year(results.of("main", method.script), f"{species}_{age}_stems_ha")[:, -1]
                    for species in SPECIES
                )
                for age in AGE_CLASSES
            ]
        )
        ages.bar(
            np.arange(len(AGE_CLASSES)) + GROUP / len(LEARNERS) * (k - (len(LEARNERS) - 1) / 2),
            stems.mean(axis=1),
            BARS / len(LEARNERS),
            yerr=stems.std(axis=1, ddof=1) if stems.shape[1] > 1 else None,
            color=method.colour,
            error_kw={"linewidth": 0.6},
        )
    ages.set_xticks(range(len(AGE_CLASSES)), AGE_CLASSES)
    finish(ages, ylabel="stems/ha")
    legend(figure, [training, season])
