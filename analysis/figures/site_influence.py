"""How far the site decides about thaw, and how much the returns of training episodes scatter for it."""

import numpy as np
import pandas as pd

import sim
from analysis.figures.common import OF_SITES, SEEDS_95, STEPS, finish, learners, learning_curve, legend, panels
from analysis.studies import open_loop

SIZE = (7, 3)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = (
    "(a) evaluation, greedy: a point a site, mean over methods, weights and seeds; line: lowest to highest method; sd: "
    "standard deviation; dotted: the least that fifty years can return, -1 each. "
    f"(b) {SEEDS_95}; {OF_SITES}."
)
LEAST = -50.0  # fifty years of a reward that is cut off at -1


def draw(figure, results) -> None:
    """Thaw return against the site's boundary less its air; scatter of thaw returns in training."""
    sites, volatility = panels(figure, 1, 2, ["thaw by site", "scatter of thaw returns in training"])
    of_methods = {}
    for method in learners(sites, results):
        evaluations = [
            one.evaluation.groupby("site_seed").thaw_return.mean() for one in results.of("main", method.script)
        ]
        of_methods[method.script] = sum(evaluations) / len(evaluations)
    if of_methods:
        draw_sites(sites, pd.DataFrame(of_methods))
    finish(sites, xlabel="temperature at 12 m less mean annual air (K)", ylabel="thaw return (50 years)")
    for method in learners(volatility, results):
        learning_curve(
            volatility, results.of("main", method.script), "thaw_return", method.colour, method.title, statistic="std"
        )
    for k, line in enumerate(reversed(volatility.lines)):  # wider below: no curve is hidden by another
        line.set_linewidth(1 + 0.7 * k)
    means = [line.get_ydata().mean() for line in volatility.lines if len(line.get_ydata())]
    if len(means) > 1:
        note = f"mean over the training: {min(means):.1f} to {max(means):.1f} by method"
        volatility.text(0.5, 0.3, note, transform=volatility.transAxes, ha="center", fontsize=7)
    finish(volatility, ylabel="standard deviation of thaw returns", ylim=(0, None), **STEPS)
    legend(volatility, [volatility], "center", 2)


def draw_sites(ax, thaw: pd.DataFrame) -> None:
    """Thaw returns of sites, a column a method: how far sites differ, and methods on one site."""
    features = [open_loop.site_features(sim.sample_site(int(seed))) for seed in thaw.index]
    x = [feature["boundary_above_air_k"] for feature in features]
    ax.vlines(x, thaw.min(axis=1), thaw.max(axis=1), color="#D55E00", linewidth=1.3)
    ax.plot(x, thaw.mean(axis=1), "o", color="black", markersize=2)
    if thaw.to_numpy().min() < 0.99 * LEAST:
        ax.axhline(LEAST, color="black", linestyle=":", linewidth=0.7)
    if thaw.shape[1] > 1 and len(thaw) > 1:
        between, within = thaw.mean(axis=1).std(), np.sqrt(thaw.var(axis=1).mean())
        note = f"sd between sites: {between:.1f}\nsd between methods on a site: {within:.1f}"
        ax.text(0.02, 0.98, note, transform=ax.transAxes, va="top", fontsize=7)
        ax.margins(y=0.12)
