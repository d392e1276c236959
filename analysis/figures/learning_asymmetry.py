"""Learning with one fixed weight: carbon against thaw, on all sites and on single ones, and what is done meanwhile."""

import matplotlib

from analysis.figures.common import SEEDS_95, STEPS, WEIGHT_COLOURS, finish, learning_curve, panels, wanting

SIZE = (7, 5.2)
CAPTION = f"Fixed λ EUPG, one agent a weight; returns are sums over 50 years; {SEEDS_95}; (b) over sites."
PANELS = {  # experiment, column of the training episodes, label, title
    "a": ("fixed", "scalarized_return", "scalarised return", "all sites"),
    "b": ("site", "scalarized_return", "scalarised return", "single sites"),
    "c": ("fixed", "final_density", "stems/ha after 50 years", "stem density, all sites"),
    "d": ("fixed", "final_conifer_fraction", "conifer fraction after 50 years", "species, all sites"),
}


def draw(figure, results) -> None:
    """Four panels, a curve for each weight."""
    axes = panels(figure, 2, 2, [title for *_, title in PANELS.values()])
    colours = matplotlib.colormaps[WEIGHT_COLOURS]
    for ax, (experiment, column, label, _) in zip(axes, PANELS.values(), strict=True):
        wanting(ax, results, experiment, "eupg_fixed_lambda")
        agents = [one for replicate in results.of(experiment, "eupg_fixed_lambda") for one in replicate.each_run()]
        for weight in sorted({one.runs[0].arguments["preference"] for one in agents}):
            of_weight = [one for one in agents if one.runs[0].arguments["preference"] == weight]
            learning_curve(ax, of_weight, column, colours(0.9 * weight), f"weight of carbon {weight:g}")
        finish(ax, legend=ax is axes[0], ylabel=label, **STEPS)
