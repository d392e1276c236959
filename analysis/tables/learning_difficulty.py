"""Why thaw is harder to learn than carbon: what the returns vary with, and actions' effects against their noise.

From variance.py, signal_to_noise.py and gradient_noise.py of analysis/studies; docs/learning.md defines every row.
"""

import numpy as np
import pandas as pd

from analysis import stored
from analysis.studies.open_loop import OBJECTIVES
from analysis.studies.signal_to_noise import CONTRASTS, EVERY, UNIFORM, YEARS, episodes_needed

MADE_BY = "python analysis/studies/variance.py && python analysis/reproduce.py --only difficulty"
COLUMNS = {"of": "of", "quantity": "quantity", "carbon": "carbon", "thaw": "thaw"}
GRADIENT = "EUPG's gradient, as much signal as noise"
VALUES = {"return": "variance of returns", "one year": "variance of one year's rewards"}
YEAR = "5"  # of the action: the stand is there, and most of the episode still to come
OTHER_YEARS = ("0", "15", "30")
LATE = "years_20_50"  # share of the effect that comes late
#: Row -> (weighting of the years to come, column, factor).
EFFECTS = {
    "effect on the return": ("return", "effect", 1),
    "noise": ("return", "noise", 1),
    "noise about the site's mean": ("return", "site_noise", 1),
    "noise about the state's mean": ("return", "state_noise", 1),
    "episodes to tell the actions apart": ("return", "episodes", 1),
    "episodes, site baseline": ("return", "site_episodes", 1),
    "episodes, state baseline": ("return", "state_episodes", 1),
    "effect that comes after 20 years %": ("return", LATE, 100),
    "effect that discounted rewards carry %": ("discounted", "carried", 100),
    "effect that GAE rewards carry %": ("GAE", "carried", 100),
    "episodes, site baseline, GAE": ("GAE", "site_episodes", 1),
}
#: Row -> (weighting, noise) of a choice that is the same in every year.
SHARED = {
    "episodes, one choice for all years": ("return", "noise"),
    "episodes, one choice for all years, site baseline": ("return", "site_noise"),
    "episodes, one choice for all years, site baseline, GAE": ("GAE", "site_noise"),
}


def variance_components(results) -> pd.DataFrame | None:
    """The table of analysis/studies/variance.py, None if it has not been made."""
    path = results.studies_dir.parent / "variance" / "components.csv"
    return stored.read(path) if path.exists() else None


def of_objectives(rows: pd.DataFrame, column: str, factor: float) -> dict:
    """carbon and thaw of a column, with the intervals that it has; rows: one an objective, indexed by it."""
    row = {}
    for objective in OBJECTIVES:
        for end in ("", "_low", "_high"):
            if f"{column}{end}" in rows and objective in rows.index:
                row[f"{objective}{end}"] = factor * rows.loc[objective, f"{column}{end}"]
    return row


def shared_episodes(case: pd.DataFrame, noise: str) -> float:
    """Episodes to tell two actions apart if all years of an episode bear on the choice; case: a row a year of it.

    The gradient of a parameter that sets the same choice in all years is a sum over them of the score times the
    advantage. Scores have mean zero given the past, so the effects add up, and so do the variances. Effect and variance
    are taken as linear between the years that were played, and as none at the episode's end.
    """
    case = case[case.year != EVERY].assign(year=lambda table: table.year.astype(int)).sort_values("year")
    years = np.arange(YEARS)

    def all_years(values):
        return np.interp(years, [*case.year, YEARS], [*values, 0.0]).sum()

    return float(episodes_needed(abs(all_years(case.effect)) / all_years(case[noise] ** 2) ** 0.5))


def make(results) -> pd.DataFrame:
    """Rows of variance shares, then for each pair of actions its effect, the noise and what follows from both."""
    rows = []
    components = variance_components(results)
    for value, title in VALUES.items():
        if components is None:
            rows.append({"of": title, "quantity": "not run yet: python analysis/studies/variance.py"})
            continue
        of_value = components[components.value == value]
        for component in dict.fromkeys(of_value.component):
            there = of_value[of_value.component == component].set_index("objective")
            rows.append({"of": title, "quantity": f"{component} %", **of_objectives(there, "share", 100)})
    table = results.study("signal_to_noise")
    for contrast in CONTRASTS:
        if table is None:
            rows.append({"of": contrast, "quantity": "not run yet: python analysis/studies/signal_to_noise.py"})
            continue
        case = table[(table.reference == UNIFORM) & (table.contrast == contrast) & (table.year == YEAR)]
        for quantity, (weighting, column, factor) in EFFECTS.items():
            there = case[case.weighting == weighting].set_index("objective")
            if column == LATE:  # a share of what may be nothing says nothing
                there[column] = there[column].where((there.effect_low > 0) | (there.effect_high < 0))
            rows.append({"of": contrast, "quantity": quantity, **of_objectives(there, column, factor)})
        uniform = table[(table.reference == UNIFORM) & (table.contrast == contrast)]
        for year in OTHER_YEARS:
            there = uniform[(uniform.weighting == "return") & (uniform.year == year)].set_index("objective")
            quantity = f"episodes to tell the actions apart, year {year}"
            rows.append({"of": contrast, "quantity": quantity, **of_objectives(there, "episodes", 1)})
        for quantity, (weighting, noise) in SHARED.items():
            years = {
                objective: uniform[(uniform.weighting == weighting) & (uniform.objective == objective)]
                for objective in OBJECTIVES
            }
            needed = {objective: shared_episodes(case, noise) for objective, case in years.items()}
            rows.append({"of": contrast, "quantity": quantity, **needed})
    gradients = results.study("gradient_noise")
    if gradients is None:
        rows.append({"of": GRADIENT, "quantity": "not run yet: python analysis/studies/gradient_noise.py"})
    else:
        for (utility, baseline), case in gradients.groupby(["utility", "baseline"], sort=False):
            needed = of_objectives(case.set_index("objective"), "episodes", 1)
            rows.append({"of": GRADIENT, "quantity": f"episodes, {utility} utility, baseline: {baseline}", **needed})
    columns = [f"{objective}{end}" for objective in OBJECTIVES for end in ("", "_low", "_high")]
    return pd.DataFrame(rows, columns=["of", "quantity", *columns])
