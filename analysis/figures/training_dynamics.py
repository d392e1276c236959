"""What the methods do with stands while they train."""

from analysis.figures.common import SEEDS_95, STEPS, finish, learners, learning_curve, legend, panels

SIZE = (7, 2.9)
MADE_BY = "python analysis/reproduce.py --only main"
CAPTION = f"Training episodes; {SEEDS_95}."


def draw(figure, results) -> None:
    """Species and density, each the mean over an episode's 50 years."""
    species, density = panels(figure, 1, 2, ["species", "stem density"])
    for ax, column, label in (
        (species, "mean_conifer_fraction", "conifer fraction, mean of 50 years"),
        (density, "mean_density", "stems/ha, mean of 50 years"),
    ):
        for method in learners(ax, results):
            learning_curve(ax, results.of("main", method.script), column, method.colour, method.title)
        finish(ax, ylabel=label, **STEPS)
    legend(figure, [species])
