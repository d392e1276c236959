"""Learning with one fixed weight: carbon against thaw, on all sites and on single ones, and what is done meanwhile."""

import matplotlib

from analysis.figures.common import (
    SEEDS_95,
    STEPS,
    WEIGHT_COLOURS,
    finish,
    learning_curve,
    legend,
    letter,
    steps_of,
    training_curve,
    validation_curve,
    wanting,
)

SIZE = (7.2, 5.0)
MADE_BY = "python analysis/reproduce.py --only fixed site"
CAPTION = (
    "Fixed λ EUPG, one agent a weight; sums over 50 years. (c) Greedy, over doing nothing, on validation sites; "
    f"{SEEDS_95}, of five; (b, f) of boreal-site-specific-v0, over five sites instead of seeds. (f) agents of one "
    "objective alone, its gain in training; dashed: with --baseline others."
)
GAIN = "scalarized_gain"
PANELS = {  # experiment, column of the training episodes, label, title
    "a": ("fixed", "scalarized_return", "scalarised return", "all sites"),
    "b": ("site", "scalarized_return", "scalarised return", "single sites"),
    "c": ("fixed", GAIN, "scalarised gain", "gain, all sites"),
    "d": ("fixed", "final_density", "stems/ha after 50 years", "stem density, all sites"),
    "e": ("fixed", "final_conifer_fraction", "conifer fraction after 50 years", "species, all sites"),
}
BASELINES = {"-": {}, "--": {"baseline": "others"}}


def draw(figure, results) -> None:
    """Six panels; in the first five a curve for each weight."""
    *axes, alone = figure.subplots(2, 3).flat
    letter([*axes, alone], [*(title for *_, title in PANELS.values()), "own gain, single sites"])
    colours = matplotlib.colormaps[WEIGHT_COLOURS]
    for ax, (experiment, column, label, _) in zip(axes, PANELS.values(), strict=True):
        wanting(ax, results, experiment, "eupg_fixed_lambda")
        agents = [one for replicate in results.of(experiment, "eupg_fixed_lambda") for one in replicate.each_run()]
        for weight in sorted({one.runs[0].arguments["preference"] for one in agents}):
            of_weight = [one for one in agents if one.runs[0].arguments["preference"] == weight]
            if column == GAIN:
                validation_curve(ax, of_weight, column, colours(0.9 * weight))
            else:
                learning_curve(ax, of_weight, column, colours(0.9 * weight), f"weight of carbon {weight:g}")
        finish(ax, ylabel=label, **STEPS)
    site_gains(alone, results, colours)
    legend(figure, axes[:1])


def site_gains(ax, results, colours) -> None:
    """Gain over zero change, in the objective that it is trained for, of agents of one alone; all episodes are one."""
    zero = {one.runs[0].arguments["site_seed"]: one.evaluation for one in results.of("site", "zero_change")}
    for script in ("eupg_fixed_lambda", "zero_change"):
        wanting(ax, results, "site", script)
    for style, flags in BASELINES.items():
        runs = [
            run
            for one in results.of("site", "eupg_fixed_lambda", **flags)
            for run in one.runs
            if run.arguments["site_seed"] in zero
        ]
        for weight, objective in ((0.0, "thaw_return"), (1.0, "carbon_return")):
            of_weight = [run for run in runs if run.arguments["preference"] == weight]
            if not of_weight:
                continue
            nothing = [zero[run.arguments["site_seed"]][objective].mean() for run in of_weight]
            gains = [run.course(objective) - mean for run, mean in zip(of_weight, nothing, strict=True)]
            training_curve(ax, gains, steps_of(of_weight), colours(0.9 * weight), None, style=style)
    finish(ax, ylabel="gain in the own objective", **STEPS)
