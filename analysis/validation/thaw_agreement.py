"""How often the measures of thaw agree on whether a plan warms or cools the ground."""

from collections.abc import Callable
from itertools import combinations

import numpy as np

import sim
from analysis.validation import document
from analysis.validation.document import percent

Record = Callable[[str], np.ndarray]

#: Measure -> what a plan's episode scores in it, (episodes,), from its columns (episodes, years): more is colder.
MEASURES: dict[str, Callable[[Record], np.ndarray]] = {
    "net heat into the boundary": lambda of: -(of("boundary_warming_mj_m2") - of("boundary_cooling_mj_m2")).sum(axis=1),
    "thaw depth": lambda of: -of("active_layer_depth_m").mean(axis=1),
    "heat of the upper 3 m": lambda of: -of("upper_ground_heat_mj_m2").mean(axis=1),
    "temperature of the upper 3 m": lambda of: -of("upper_ground_temperature_c").mean(axis=1),
    "temperature of the permafrost's top": lambda of: -of("permafrost_top_temperature_c").mean(axis=1),
}

ROUNDING = 1e-9  # of a measure: what is below, an order of summing decides


def effects(record: np.ndarray, plans: int) -> dict[str, np.ndarray]:
    """What each plan adds to the first one, in every measure, (sites x other plans,).

    record : annual records (sites x plans, years, columns of `sim.RECORD_NAMES`), the plans of a site in a row.
    """

    def column(name):
        return record[:, :, sim.RECORD_NAMES.index(name)]

    scores = {name: measure(column).reshape(-1, plans) for name, measure in MEASURES.items()}
    found = {name: (values[:, 1:] - values[:, :1]).ravel() for name, values in scores.items()}
    return {name: np.where(np.abs(effect) > ROUNDING, effect, 0.0) for name, effect in found.items()}


def disagreement(first: np.ndarray, second: np.ndarray) -> float:
    """Share of effects, of those that both see, that two measures see with different signs."""
    product = first * second
    return float((product < 0.0).sum() / max((product != 0.0).sum(), 1))


def text(worlds: dict[str, np.ndarray], plans: list[str]) -> str:
    """Markdown: pairs of measures and how often they disagree, in every world; worlds : name -> record of `effects`."""
    found = {name: effects(record, len(plans)) for name, record in worlds.items()}
    rows = [
        [f"{first}, {second}", *(percent(disagreement(one[first], one[second])) for one in found.values())]
        for first, second in combinations(MEASURES, 2)
    ]
    return f"""Thaw as the field measures it is in the annual record. How often two measures, over all years of an
episode, differ in the sign of what a plan does ({", ".join(plans[1:])}, each less {plans[0]}; of the effects that both
see):

{document.table(["measures", *found], rows, left=1)}"""
