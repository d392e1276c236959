"""Learning with one fixed weight: carbon against thaw, on all sites and on single ones, and what is done meanwhile."""

import matplotlib

from analysis.figures.common import (
    SEEDS_95,
    STEPS,
    WEIGHT_COLOURS,
    finish,
    learning_curve,
    letter,
    no_data,
    wanting,
)
from analysis.figures.learning_curves import gain_curve

SIZE = (7.2, 4.8)
CAPTION = ("Fixed λ EUPG, one agent a weight; sums over 50 years; gains: less zero change on the same episodes; "
           f"{SEEDS_95}; (b) over sites.")  # fmt: skip
GAIN = "scalarized_gain"
PANELS = {  # experiment, column of the training episodes, label, title
    "a": ("fixed", "scalarized_return", "scalarised return", "all sites"),
    "b": ("site", "scalarized_return", "scalarised return", "single sites"),
    "c": ("fixed", GAIN, "scalarised gain", "gain, all sites"),
    "d": ("fixed", "final_density", "stems/ha after 50 years", "stem density, all sites"),
    "e": ("fixed", "final_conifer_fraction", "conifer fraction after 50 years", "species, all sites"),
}


def draw(figure, results) -> None:
    """Five panels, a curve for each weight; the sixth place is the legend's."""
    *axes, place = figure.subplots(2, 3).flat
    letter(axes, [title for *_, title in PANELS.values()])
    place.axis("off")
    colours, nothing = matplotlib.colormaps[WEIGHT_COLOURS], results.study("training_gains")
    for ax, (experiment, column, label, _) in zip(axes, PANELS.values(), strict=True):
        if not wanting(ax, results, experiment, "eupg_fixed_lambda") and column == GAIN and nothing is None:
            no_data(ax, "python analysis/studies/training_gains.py")
            continue
        agents = [one for replicate in results.of(experiment, "eupg_fixed_lambda") for one in replicate.each_run()]
        for weight in sorted({one.runs[0].arguments["preference"] for one in agents}):
            of_weight = [one for one in agents if one.runs[0].arguments["preference"] == weight]
            if column == GAIN:
                gain_curve(ax, of_weight, nothing, column, colours(0.9 * weight))
            else:
                learning_curve(ax, of_weight, column, colours(0.9 * weight), f"weight of carbon {weight:g}")
        finish(ax, legend=False, ylabel=label, **STEPS)
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        place.legend(handles, labels, loc="center")
