"""The first state of a stand: stocks and ages drawn, soil, snow and water brought into balance with the site.

Soil, snow and water start near the site's means and are spun up under the mean year of its climate, with the stand
held fixed. Deep soil remembers decades, more where it freezes; a secant search on its heat finds the balance in a few.
"""

import math

import numpy as np

from sim import soil
from sim.demography import AGE_CLASSES, AGES, OLDEST, first_ages
from sim.jit import uncompiled
from sim.parameters import check_mapping
from sim.physical_constants import FREEZING_POINT_K
from sim.state import DAYS, STATE

enthalpy, node_capacities = uncompiled(soil.enthalpy), uncompiled(soil.node_capacities)

SPIN_UP_YEARS = 8
SPIN_UP_STEPS_PER_DAY = 12
LONGEST_LEAP = 15.0  # years
SEASONAL_RANGE_K = 4.0
GOLDEN_RATIO = 0.5 * (math.sqrt(5.0) - 1.0)

#: Ranges that the first stocks are drawn from.
INITIAL_RANGES = {
    "density_stems_ha": (0.0, 600.0),
    "conifer_fraction": (0.2, 0.8),
    "biomass_kgc_m2": (1.0, 10.0),
    "soil_kgc_m2": (2.0, 10.0),
    "oldest_age_years": (30.0, 110.0),
}

#: Stems by species and age class, which can be given instead of density, conifer fraction and oldest age.
CLASS_NAMES = tuple(f"{species}_{age}_stems_ha" for species in ("conifer", "deciduous") for age in AGE_CLASSES)

#: Physical limits of the first stocks.
INITIAL_LIMITS = {
    "density_stems_ha": (0.0, 10000.0),
    "conifer_fraction": (0.0, 1.0),
    "biomass_kgc_m2": (0.0, 60.0),
    "soil_kgc_m2": (0.0, 100.0),
    "oldest_age_years": (1.0, 200.0),
    "hwp_kgc_m2": (0.0, 60.0),
    "organic_layer_m": (0.0, 2.0),
    **dict.fromkeys(CLASS_NAMES, (0.0, 10000.0)),
}

LARGEST_STEM_KGC = 120.0
YEARLY_SURVIVAL = 0.975


def check_initial(values: dict | None, limits=INITIAL_LIMITS) -> dict[str, float]:
    """First stocks by record name, checked. Raises ValueError naming the value and what is allowed."""
    values = check_mapping("initial", values)
    for name, value in values.items():
        if name not in limits:
            raise ValueError(f"unknown initial stock {name!r}; allowed: {', '.join(limits)}")
        if name in CLASS_NAMES and set(values) & {"density_stems_ha", "conifer_fraction", "oldest_age_years"}:
            raise ValueError(f"initial {name}: stems by class exclude density, conifer fraction and oldest age")
        low, high = limits[name]
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not low <= value <= high:
            raise ValueError(f"initial {name} = {value!r}: a number in [{low:g}, {high:g}] is allowed")
    return {name: float(value) for name, value in values.items()}


def check_initial_ranges(ranges: dict | None) -> dict[str, tuple[float, float]]:
    """Ranges of first stocks, checked like `check_initial`; each a (low, high) pair."""
    checked = {}
    for name, pair in check_mapping("initial_ranges", ranges).items():
        if name not in INITIAL_RANGES:
            raise ValueError(f"unknown initial range {name!r}; allowed: {', '.join(INITIAL_RANGES)}")
        if not isinstance(pair, (tuple, list)) or len(pair) != 2:
            raise ValueError(f"initial range {name}: a (low, high) pair is allowed, got {pair!r}")
        low, high = (check_initial({name: value})[name] for value in pair)
        if low > high:
            raise ValueError(f"initial range {name}: reversed, {low:g} > {high:g}")
        checked[name] = (low, high)
    return checked


def first_state(parameters: dict, generator: np.random.Generator, given: dict | None, ranges: dict) -> np.ndarray:
    """State vector of a stand before spin-up, shape (fields of `STATE` + ages of both species,).

    parameters : all parameters by name; given : stocks by record name, in place of drawn ones. As many numbers are
    drawn whatever is given.
    """
    stocks = {name: low + (high - low) * generator.random() for name, (low, high) in ranges.items()}
    stocks.update(given or {})
    if any(name in CLASS_NAMES for name in stocks):
        conifers, deciduous = stems_of_classes(stocks, parameters)
    else:
        ages = stems_of_ages(stocks["oldest_age_years"]) * stocks["density_stems_ha"]
        conifers, deciduous = stocks["conifer_fraction"] * ages, (1.0 - stocks["conifer_fraction"]) * ages
    density = conifers.sum() + deciduous.sum()
    mix = conifers.sum() / density if density > 0.0 else stocks["conifer_fraction"]
    biomass = stocks["biomass_kgc_m2"]
    if given is None or "biomass_kgc_m2" not in given:
        biomass = min(biomass, density * LARGEST_STEM_KGC * 1e-4) if density > 0.0 else biomass

    crowns = 1.0 - math.exp(-density * 1e-4 * parameters["crown_area_conifer_m2"])
    organic = (
        crowns * (mix * parameters["organic_depth_conifer_m"] + (1.0 - mix) * parameters["organic_depth_deciduous_m"])
        + (1.0 - crowns) * parameters["organic_depth_open_m"]
    )
    mean = parameters["mean_annual_temperature_c"]
    boundary = parameters["deep_boundary_temperature_k"] - FREEZING_POINT_K
    winter = mean - parameters["seasonal_amplitude_c"]
    state = dict.fromkeys(STATE, 0.0) | {
        "conifer_biomass": mix * biomass,
        "deciduous_biomass": (1.0 - mix) * biomass,
        "soil_carbon": stocks["soil_kgc_m2"],
        "products": stocks.get("hwp_kgc_m2", 0.0),
        "organic_depth": stocks.get("organic_layer_m", organic),
        "canopy": winter,
        "trunk": winter,
        "ground": min(winter, 0.0),
        "surface_heat": enthalpy(mean - 1.0, *soil_node(parameters, "surface")),
        "deep_heat": enthalpy(0.5 * (mean + 2.0 + boundary), *soil_node(parameters, "deep")),
        "swe": 40.0 if winter < 0.0 else 0.0,
        "albedo": parameters["snow_albedo_fresh"],
        "soil_water": 0.7 * parameters["max_water_content_mm"],
        "acclimation": winter,
    }
    return np.concatenate([list(state.values()), conifers, deciduous])


def stems_of_ages(oldest_age: float) -> np.ndarray:
    """Shares of stems by age, shape (AGES,): ages 1 to the oldest, fewer by `YEARLY_SURVIVAL` each year."""
    ages = np.zeros(AGES)
    oldest = max(1, int(round(oldest_age)))
    np.add.at(ages, np.minimum(np.arange(1, oldest + 1), OLDEST), YEARLY_SURVIVAL ** np.arange(oldest))
    return ages / ages.sum()


def stems_of_classes(stocks: dict, parameters: dict) -> np.ndarray:
    """Stems by species and age, shape (2, AGES), spread evenly over the ages of each class."""
    first = first_ages(parameters)
    stems = np.zeros((2, AGES))
    for k, name in enumerate(CLASS_NAMES):
        row, age_class = divmod(k, len(AGE_CLASSES))
        ages = slice(first[age_class], first[age_class + 1])
        stems[row, ages] = stocks.get(name, 0.0) / (ages.stop - ages.start)
    return stems


def soil_node(parameters: dict, node: str) -> tuple[float, float, float, float]:
    """Heat capacities thawed and frozen [J m-2 K-1], latent heat [J m-2] and freezing range [K] of a soil node."""
    names = (
        "soil_freezing",
        "surface_soil_depth_m",
        "deep_soil_node_m",
        "boundary_depth_m",
        "soil_heat_capacity_thawed",
        "soil_heat_capacity_frozen",
        "soil_freezing_water",
    )
    surface, deep = node_capacities(*(parameters[name] for name in names))
    return *(surface if node == "surface" else deep), parameters["soil_freezing_range_k"]


def climate_draws() -> dict[str, np.ndarray]:
    """Draws of the climate's mean year: no noise, wet days spread evenly, each with the mean amount; no fire."""
    evenly = (np.arange(DAYS) * GOLDEN_RATIO) % 1.0
    return {"wet_dice": evenly, "wet_amount": np.ones(DAYS), "fire_dice": np.ones(DAYS)}


def deep_heat_limits(parameters: dict, surface_temperature: float) -> tuple[float, float]:
    """Range of the deep soil's enthalpy [J m-2] on 1 January: its mean lies between the surface soil's and the
    boundary's, and the season moves it by less than `SEASONAL_RANGE_K` from that."""
    boundary = parameters["deep_boundary_temperature_k"] - FREEZING_POINT_K
    low, high = sorted((surface_temperature, boundary))
    node = soil_node(parameters, "deep")
    return enthalpy(low - SEASONAL_RANGE_K, *node), enthalpy(high + SEASONAL_RANGE_K, *node)


def next_deep_heat(heat, gain, heat_before, gain_before, limits) -> np.ndarray:
    """Deep-soil enthalpy [J m-2] to start the next year of spin-up with, so that the deep soil comes to gain nothing.

    heat, gain : enthalpy at the start of the year just run, and what the year added; *_before : of the year before,
    or None; shape (stands,) each; limits : (stands, 2). A secant step, no longer than `LONGEST_LEAP` years of the
    gain, kept within the limits.
    """
    if heat_before is None:
        return np.clip(heat + gain, *limits.T)
    steepness = gain - gain_before
    moved = heat - heat_before
    falling = steepness * moved < 0.0
    secant = -gain * moved / np.where(falling, steepness, 1.0)
    longest = LONGEST_LEAP * np.abs(gain)
    leap = np.where(falling, np.clip(secant, -longest, longest), np.sign(gain) * longest)
    return np.clip(heat + leap, *limits.T)
