"""What each method does with the stands of the evaluation."""

from analysis.figures.common import (
    SEEDS_95,
    finish,
    learners,
    legend,
    panels,
    season_curves,
    year_curve,
)

SIZE = (7, 5.2)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = (
    f"Evaluation, means over the episodes and the weights 0, 0.5 and 1; {SEEDS_95}. (c) last year: median, and "
    "80 % of the episodes, a cross a weight and seed. (d) all weights; eighths of the episodes by days above "
    "5 °C."
)


def draw(figure, results) -> None:
    """Species, density, both in the last year, growing season against thaw."""
    species, density, composition, season = panels(
        figure, 2, 2, ["species", "stem density", "composition after 50 years", "growing season and thaw"]
    )
    for ax, variable, label in (
        (species, "conifer_fraction", "conifer fraction"),
        (density, "density_stems_ha", "stems/ha"),
    ):
        for method in learners(ax, results):
            year_curve(ax, results.of("main", method.script), variable, method.colour, method.title)
        finish(ax, xlabel="year", ylabel=label)
    for method in learners(composition, results):
        for one in results.of("main", method.script):
            last = one.last_year.pivot(index="preference", columns="variable", values=["p10", "p50", "p90"])
            x, y = last["p50"].density_stems_ha, last["p50"].conifer_fraction
            spread = {
                name: [last["p50"][column] - last["p10"][column], last["p90"][column] - last["p50"][column]]
                for name, column in (("xerr", "density_stems_ha"), ("yerr", "conifer_fraction"))
            }
            composition.errorbar(x, y, **spread, fmt=method.marker, color=method.colour, linewidth=0.5, markersize=4)
    finish(composition, xlabel="stems/ha", ylabel="conifer fraction", ylim=(0, 1))
    season_curves(season, results)
    legend(figure, [species, season])
