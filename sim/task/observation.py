"""What is observed: one table, a row an entry, which space, names, values, masks and documentation follow.

A row says where its value comes from: a function of a `Moment`, stands at the end of a year or before the first.
To observe something more, add a row.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from gymnasium.spaces import Box

import sim
from sim.demography import AGE_CLASSES
from sim.management import CONIFER_MIXES, DENSITY_CHANGES, indices
from sim.state import PARAMETER_NAMES
from sim.task.objectives import HISTORY_NAMES, PAPER_OBJECTIVES

SPECIES_AND_AGES = tuple(product(("conifer", "deciduous"), AGE_CLASSES))
AGE_ENTRIES = tuple(f"{species}_{age_class}" for species, age_class in SPECIES_AND_AGES)


@dataclass
class Moment:
    """A number of stands at the end of a year. Before the first, the past year is one in which nothing happened."""

    weights: np.ndarray  # (n, objectives) the preference
    year: np.ndarray  # (n,) years so far
    stocks: dict  # what `sim.Stands.stocks` says of them now
    record: np.ndarray  # (n, columns of `HISTORY_NAMES`) of the past year, or more
    actions: np.ndarray  # (n,) of the past year
    parameters: np.ndarray  # (n, columns of `sim.state.PARAMETER_NAMES`)
    before: Callable[[str], np.ndarray]  # entry -> its value a year ago (n,)
    age_shares: np.ndarray = field(init=False)  # (n, species and age classes) of all stems

    def __post_init__(self):
        density = self.stocks["density_stems_ha"]
        self.age_shares = self.stocks["age_classes"] / np.where(density > 0.0, density, 1.0)[:, None]


# ---------------------------------------------------------------------------------------------------------------
# Where a value comes from
# ---------------------------------------------------------------------------------------------------------------

Source = Callable[[Moment], np.ndarray]


@dataclass(frozen=True)
class Column:
    """A source that is a column of one of a moment's arrays."""

    array: str
    number: int

    def __call__(self, now: Moment) -> np.ndarray:
        return getattr(now, self.array)[:, self.number]


def weight(objective: int) -> Source:
    """The preference's weight of an objective, by its number."""
    return Column("weights", objective)


def recorded(name: str) -> Source:
    """A column of the past year's record."""
    if name not in HISTORY_NAMES:
        raise ValueError(f"no column of the annual record: {name!r}")
    return Column("record", HISTORY_NAMES.index(name))


def parameter(name: str) -> Source:
    """A parameter of the site, or a constant of the simulator."""
    if name not in PARAMETER_NAMES:
        raise ValueError(f"no parameter of the simulator: {name!r}")
    return Column("parameters", PARAMETER_NAMES.index(name))


def age_share(entry: str) -> Source:
    """Stems of a species and age class among all stems."""
    return Column("age_shares", AGE_ENTRIES.index(entry))


def stock(name: str) -> Source:
    """What the stand is now."""
    return lambda now: now.stocks[name]


def a_year_ago(entry: str) -> Source:
    """What another entry was then."""
    return lambda now: now.before(entry)


growth_start, fall_start = parameter("growth_start_day"), parameter("fall_start_day")
planted, thinned = recorded("planted_stems_ha"), recorded("thinned_stems_ha")
drought_index = recorded("drought_index")
DRIEST = 1e4  # mm
conifer_fraction_after_action = recorded("conifer_fraction_after_action")


def drought(now: Moment) -> np.ndarray:
    """The past year's drought index, up to the limit of its row: only snow sets it back, and there may be none."""
    return np.minimum(drought_index(now), DRIEST)


def years(now: Moment) -> np.ndarray:
    """Years so far."""
    return now.year


def carbon_stock(now: Moment) -> np.ndarray:
    """Carbon of the living trees, dead wood and the soil."""
    return now.stocks["biomass_kgc_m2"] + now.stocks["deadwood_kgc_m2"] + now.stocks["soil_kgc_m2"]


def growing_season_length(now: Moment) -> np.ndarray:
    """Days from the site's growth start to its leaf fall."""
    return fall_start(now) - growth_start(now)


def density_index(now: Moment) -> np.ndarray:
    """The past action's place in `DENSITY_CHANGES`."""
    return indices(now.actions)[0]


def mix_index(now: Moment) -> np.ndarray:
    """The past action's place in `CONIFER_MIXES`."""
    return indices(now.actions)[1]


def density_change(now: Moment) -> np.ndarray:
    """What was carried out of the past action."""
    return planted(now) - thinned(now)


def mix_change(now: Moment) -> np.ndarray:
    """How much the past action changed the conifer fraction."""
    return conifer_fraction_after_action(now) - now.before("conifer_fraction")


# ---------------------------------------------------------------------------------------------------------------
# The table, in the paper's order
# ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Observed:
    """One entry of the observation: (value + shift) / scale, with the physical limits of the value."""

    name: str
    group: str
    unit: str
    shift: float
    scale: float
    low: float
    high: float
    source: Source


STOCK, CHANGE = 200.0, 100.0  # kgC m-2, beyond what a boreal stand can hold or move in a year
MOST = {"density": len(DENSITY_CHANGES) - 1, "mix": len(CONIFER_MIXES) - 1}  # the last index of each
OBSERVED_SITE = sim.OBSERVED_SITE_PARAMETERS


def limits(name: str) -> tuple[float, float]:
    """Physical limits of a site parameter."""
    return sim.SITE_PARAMETERS[name].physical_low, sim.SITE_PARAMETERS[name].physical_high


def climate(name: str, unit: str, shift: float, scale: float, of: str) -> Observed:
    """The row of the climate that is the site parameter `of`, scaled as the paper's."""
    return Observed(name, "climate", unit, shift, scale, *limits(of), parameter(of))


def site(name: str) -> Observed:
    """The row of a site parameter: its share of the range that it is sampled from."""
    p = sim.SITE_PARAMETERS[name]
    return Observed(f"site_{name}", "site", p.unit, -p.low, p.high - p.low, *limits(name), parameter(name))


(EARLIEST_GROWTH, LATEST_GROWTH), (EARLIEST_FALL, LATEST_FALL) = limits("growth_start_day"), limits("fall_start_day")
SEASON = EARLIEST_FALL - LATEST_GROWTH, LATEST_FALL - EARLIEST_GROWTH

#: All entries but the preference's: name, group, unit, shift, scale, low, high, source.
ROWS = (
    Observed("year", "state", "yr", 0, 50, 0, 1000, years),
    Observed("density", "state", "stems ha-1", 0, 1500, 0, 15000, stock("density_stems_ha")),
    Observed("conifer_fraction", "state", "1", 0, 1, 0, 1, stock("conifer_fraction")),
    Observed("carbon_stock", "state", "kgC m-2", 0, 50, 0, 3 * STOCK, carbon_stock),
    climate("latitude", "degN", -50, 20, of="latitude_deg"),
    climate("mean_annual_temperature", "degC", 10, 20, of="mean_annual_temperature_c"),
    climate("seasonal_amplitude", "degC", 0, 30, of="seasonal_amplitude_c"),
    climate("growth_start_day", "day of year", 0, 365, of="growth_start_day"),
    climate("fall_start_day", "day of year", 0, 365, of="fall_start_day"),
    Observed("growing_season_length", "climate", "day", 0, 200, *SEASON, growing_season_length),
    Observed("fire_mortality_1yr", "disturbance", "1", 0, 1, 0, 1, recorded("fire_mortality")),
    Observed("fire_mortality_2yr", "disturbance", "1", 0, 1, 0, 1, a_year_ago("fire_mortality_1yr")),
    Observed("insect_mortality_1yr", "disturbance", "1", 0, 1, 0, 1, recorded("insect_mortality")),
    Observed("insect_mortality_2yr", "disturbance", "1", 0, 1, 0, 1, a_year_ago("insect_mortality_1yr")),
    Observed("drought_index_1yr", "disturbance", "mm", 0, 100, 0, DRIEST, drought),
    Observed("drought_index_2yr", "disturbance", "mm", 0, 100, 0, DRIEST, a_year_ago("drought_index_1yr")),
    Observed("biomass_change", "carbon", "kgC m-2", 0.5, 1.0, -CHANGE, CHANGE, recorded("biomass_change_kgc_m2")),
    Observed("soil_change", "carbon", "kgC m-2", 0.2, 0.4, -CHANGE, CHANGE, recorded("soil_change_kgc_m2")),
    Observed("total_change", "carbon", "kgC m-2", 0.7, 1.4, -CHANGE, CHANGE, recorded("net_carbon_change_kgc_m2")),
    Observed("natural_mortality", "carbon", "kgC m-2", 0, 0.5, 0, CHANGE, recorded("mortality_kgc_m2")),
    Observed("litterfall", "carbon", "kgC m-2", 0, 2.0, 0, CHANGE, recorded("litterfall_kgc_m2")),
    Observed("thinning_loss", "carbon", "kgC m-2", 0.5, 1.0, 0, CHANGE, recorded("harvest_kgc_m2")),
    Observed("products_stored", "carbon", "kgC m-2", 0, 0.5, 0, CHANGE, recorded("hwp_stored_kgc_m2")),
    Observed("density_action", "management", "index", 0, MOST["density"], 0, MOST["density"], density_index),
    Observed("mix_action", "management", "index", 0, MOST["mix"], 0, MOST["mix"], mix_index),
    Observed("density_change", "management", "stems ha-1", 100, 200, -100, 100, density_change),
    Observed("mix_change", "management", "1", 0, 1, -1, 1, mix_change),
    *(Observed(name, "age", "1", 0, 1, 0, 1, age_share(name)) for name in AGE_ENTRIES),
    Observed("biomass", "stocks", "kgC m-2", 0, 50, 0, STOCK, stock("biomass_kgc_m2")),
    Observed("soil", "stocks", "kgC m-2", 0, 50, 0, STOCK, stock("soil_kgc_m2")),
    Observed("biomass_limit_penalty", "penalties", "1", 0, 0.5, 0, 100, recorded("biomass_limit_penalty")),
    Observed("soil_limit_penalty", "penalties", "1", 0, 0.5, 0, 100, recorded("soil_limit_penalty")),
    Observed("density_penalty", "penalties", "1", 0, 1.0, 0, 100, recorded("density_penalty")),
    *(site(name) for name in OBSERVED_SITE),
)


def observation_rows(objectives: Sequence[str]) -> tuple[Observed, ...]:
    """All rows for objectives of these names: the weights of all but the last come first."""
    names = ["preference"] if len(objectives) == 2 else [f"preference_{name}" for name in objectives[:-1]]
    return (*(Observed(name, "preference", "1", 0, 1, 0, 1, weight(k)) for k, name in enumerate(names)), *ROWS)


#: The observation of the paper's two objectives, an `Observed` for each entry.
OBSERVATION = observation_rows(PAPER_OBJECTIVES)
#: Names of its entries, in order.
OBSERVATION_NAMES = tuple(row.name for row in OBSERVATION)
#: Groups of its entries, in order: what `observation_groups` of an environment keeps.
OBSERVATION_GROUPS = tuple(dict.fromkeys(row.group for row in OBSERVATION))


# ---------------------------------------------------------------------------------------------------------------
# What follows from rows
# ---------------------------------------------------------------------------------------------------------------


class Table:
    """Rows, and what follows from them. Arrays of values or observations have a column for each row."""

    def __init__(self, rows: Sequence[Observed]):
        self.rows = tuple(rows)
        self.names = tuple(row.name for row in rows)
        for number, name in enumerate(self.names):
            if name in self.names[:number]:
                raise ValueError(f"entries of the observation: each is allowed once, got {name} twice")
        self.shift, self.scale = np.array([(row.shift, row.scale) for row in rows]).T
        # columns of the same array are read at once: a step of one stand would else take a percent longer
        columns: dict[str, list] = {}
        for number, row in enumerate(rows):
            if isinstance(row.source, Column):
                columns.setdefault(row.source.array, []).append((number, row.source.number))
        self._columns = {array: np.array(pairs).T for array, pairs in columns.items()}
        self._others = [(k, row.source) for k, row in enumerate(rows) if not isinstance(row.source, Column)]

    def values(self, now: Moment) -> np.ndarray:
        """Values at a moment, each in its unit, shape (n, rows)."""
        values = np.empty((len(self.rows), len(now.year)))
        for array, (numbers, columns) in self._columns.items():
            values[numbers] = getattr(now, array).T[columns]
        for number, source in self._others:
            values[number] = source(now)
        return values.T

    def normalised(self, values: np.ndarray) -> np.ndarray:
        """What is observed of values, shape (n, rows)."""
        return (values + self.shift) / self.scale

    def space(self, highest: dict[str, float]) -> Box:
        """Box of the rows, with bounds from physical limits, widened for float32 rounding.

        highest : entry -> what a user's constants can raise it to, beyond the limit of its row.
        """
        low = self.normalised(np.array([row.low for row in self.rows]))
        high = self.normalised(np.array([max(row.high, highest.get(row.name, row.high)) for row in self.rows]))
        margin = 1e-4 * (high - low)
        return Box((low - margin).astype(np.float32), (high + margin).astype(np.float32), dtype=np.float32)


class Reader:
    """Entries of observations in their own units again: observations (n, names) -> float64 (n, wanted); picklable."""

    def __init__(self, wanted: Sequence[str], names: Sequence[str] = OBSERVATION_NAMES):
        units = {row.name: (row.shift, row.scale) for row in ROWS}
        for name in set(wanted) - set(names):
            raise ValueError(f"the observation has no entry {name!r}; allowed: {', '.join(names)}")
        self.columns = [list(names).index(name) for name in wanted]
        of_weights = 0.0, 1.0  # of as many objectives as an environment has
        self.shift, self.scale = np.array([units.get(name, of_weights) for name in wanted]).T

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        return observations[:, self.columns].astype(float) * self.scale - self.shift


def in_unit(observations: np.ndarray, name: str, names: Sequence[str] = OBSERVATION_NAMES) -> np.ndarray:
    """One entry of observations, in its own unit again, float64, shape (n,).

    observations : (n, width). names : of their entries, in order, such as an environment's `observation_names`; more
    entries may follow. Without names: all entries of a two-objective environment, with its site (105) or without (43).
    Raises ValueError for an unknown entry, and for a width that does not fit.
    """
    width = np.shape(observations)[1] if np.ndim(observations) == 2 else 0
    if names is OBSERVATION_NAMES:
        widths = sum(row.group != "site" for row in OBSERVATION), len(names)
        good, allowed = width in widths, "(n, {}) or (n, {}) is allowed without names".format(*widths)
    else:
        good, allowed = width >= len(names), f"(n, {len(names)}) or wider is allowed with these names"
    if not good:
        raise ValueError(
            f"observations: shape {allowed}, got {np.shape(observations)}; observation[None] makes one of one, and the "
            "names of an environment's entries are its observation_names"
        )
    reader, observations = Reader((name,), names), np.asarray(observations)
    if reader.columns[0] >= width:
        raise ValueError(f"observations of {width} entries have no {name!r}, which is entry {reader.columns[0]}")
    return reader(observations)[:, 0]


def sample_site_observations(site_seeds: Sequence[int]) -> np.ndarray:
    """The site entries of the observation for sites with these seeds, shape (n, 62), float32."""
    table = Table([row for row in ROWS if row.group == "site"])
    sites = [sim.sample_site(seed) for seed in site_seeds]
    return table.normalised(np.array([[site[name] for name in OBSERVED_SITE] for site in sites])).astype(np.float32)
