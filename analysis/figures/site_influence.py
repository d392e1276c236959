"""How far the site decides about thaw, and how much the returns of training episodes scatter for it."""

import sim
from analysis.figures.common import SEEDS_95, STEPS, finish, learners, learning_curve, legend, panels
from analysis.studies import open_loop

SIZE = (7, 3)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = f"(a) evaluation, a point a site, mean over weights and seeds. (b) {SEEDS_95}."


def draw(figure, results) -> None:
    """Thaw return against the site's boundary less its air; scatter of thaw returns in training."""
    sites, volatility = panels(figure, 1, 2, ["thaw by site", "scatter of thaw returns in training"])
    for method in learners(sites, results):
        evaluations = [
            one.evaluation.groupby("site_seed").thaw_return.mean() for one in results.of("main", method.script)
        ]
        thaw = sum(evaluations) / len(evaluations)
        features = [open_loop.site_features(sim.sample_site(int(seed))) for seed in thaw.index]
        x = [feature["boundary_above_air_k"] for feature in features]
        sites.plot(
            x,
            thaw,
            method.marker,
            color=method.colour,
            label=method.title,
            markersize=3,
            alpha=0.7,
            markerfacecolor="none",
        )
    finish(sites, xlabel="temperature at 12 m less mean annual air (K)", ylabel="thaw return (50 years)")
    for method in learners(volatility, results):
        learning_curve(
            volatility, results.of("main", method.script), "thaw_return", method.colour, method.title, statistic="std"
        )
    finish(volatility, ylabel="standard deviation of thaw returns", **STEPS)
    legend(figure, [volatility, sites])
