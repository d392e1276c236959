"""The first state of a stand: stocks and ages drawn, soil, snow and water brought into balance with the site.

Soil, snow and water start near the site's means and are spun up under the mean year of its climate, with the stand
held fixed. Deep soil remembers decades, more where it freezes; a secant search on its heat finds the balance in a few.
"""

import functools
import math
from statistics import NormalDist

import numpy as np

from sim import organic, soil, structure
from sim.deadwood import MOST_DEADWOOD
from sim.demography import AGE_CLASSES, AGES, OLDEST, first_ages, stem_weight
from sim.jit import uncompiled
from sim.parameters import CONSTANTS, SITE_PARAMETERS, check_mapping
from sim.physical_constants import FREEZING_POINT_K, SQUARE_METRES_PER_HECTARE, WATER_DENSITY
from sim.state import DAYS, STATE

enthalpy, temperature = uncompiled(soil.enthalpy), uncompiled(soil.temperature)
node_capacities = uncompiled(soil.node_capacities)
layer_capacities = uncompiled(organic.layer_capacities)
crown_factor, weight = uncompiled(structure.crown_factor), uncompiled(stem_weight)

DEFAULTS = {name: parameter.low for name, parameter in CONSTANTS.items()}
SPIN_UP_YEARS = 8
SPIN_UP_YEARS_OF_A_RECORD = 30  # near 0 degC eight are too few, and of one stand time is no matter
SPIN_UP_STEPS_PER_DAY = 12
LONGEST_LEAP = 15.0  # years
FIRST_SNOW_DENSITY = 200.0  # kg m-3
SEASONAL_RANGE_K = 4.0
GOLDEN_RATIO = 0.5 * (math.sqrt(5.0) - 1.0)

#: The fixed temperature below: drawn for the site, or the one that the first stand has in balance.
BOUNDARIES = ("sampled", "balanced")
BOUNDARY = "deep_boundary_temperature_k"

#: First soil carbon: drawn, or what the litter of the first stand keeps up.
SOIL_CARBONS = ("drawn", "balanced")
LEAST_SOIL_KGC = 2.0  # the least that is drawn: ground that has no trees now had some before

#: Ranges that the first stocks are drawn from. Biomass is drawn within what the stems can hold, and their age follows
#: from it, unless `oldest_age_years` is given or a range of it.
INITIAL_RANGES = {
    "density_stems_ha": (0.0, 600.0),
    "conifer_fraction": (0.2, 0.8),
    "biomass_kgc_m2": (1.0, 10.0),
    "soil_kgc_m2": (2.0, 10.0),
}
DRAWN = (*INITIAL_RANGES, "oldest_age_years")  # a number is drawn for each, whatever is given

#: Dead wood of a stand before its first is found in spin-up [kgC m-2].
SOME_DEADWOOD = 1.0
DEADWOOD = tuple(f"{species}_deadwood" for species in ("conifer", "deciduous"))

#: Stems by species and age class, which can be given instead of density, conifer fraction and oldest age.
CLASS_NAMES = tuple(f"{species}_{age}_stems_ha" for species in ("conifer", "deciduous") for age in AGE_CLASSES)

#: Physical limits of the first stocks.
INITIAL_LIMITS = {
    "density_stems_ha": (0.0, 10000.0),
    "conifer_fraction": (0.0, 1.0),
    "biomass_kgc_m2": (0.0, 60.0),
    "soil_kgc_m2": (0.0, 100.0),
    "oldest_age_years": (1.0, 200.0),
    **{f"{name}_kgc_m2": (0.0, MOST_DEADWOOD) for name in DEADWOOD},
    "hwp_kgc_m2": (0.0, 60.0),
    "organic_layer_m": (0.0, 2.0),
    **dict.fromkeys(CLASS_NAMES, (0.0, 10000.0)),
}

LARGEST_STEM_KGC = 120.0  # of the last age, 26 cm thick (Lambert et al. 2005); a stand of sparse old trees has these
LARGEST_OF_ITS_AGE = 3.0  # a choice: a given stem may have so many times the carbon that ours has at its age
YEARLY_SURVIVAL = 0.975
COHORT_YEARS = 20  # in which the stems of a first stand came up, as after a fire (Gutsell and Johnson 2002)


def check_stocks(values: dict | None, limits=INITIAL_LIMITS) -> dict:
    """First stocks by record name, each for itself. Raises ValueError naming the value and what is allowed."""
    values = check_mapping("initial", values)
    for name, value in values.items():
        if name not in limits:
            raise ValueError(f"unknown initial stock {name!r}; allowed: {', '.join(limits)}")
        low, high = limits[name]
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not low <= value <= high:
            raise ValueError(f"initial {name} = {value!r}: a number in [{low:g}, {high:g}] is allowed")
    return values


def check_initial(values: dict | None, limits=INITIAL_LIMITS) -> dict[str, float]:
    """First stocks by record name, which have to go together, too. Raises ValueError as `check_stocks`."""
    values = check_stocks(values, limits)
    classes = [name for name in values if name in CLASS_NAMES]
    together = [name for name in ("density_stems_ha", "conifer_fraction", "oldest_age_years") if name in values]
    if classes and together:
        raise ValueError(f"initial {together[0]} = {values[together[0]]:g}: {classes[0]} is given too; one is allowed")
    biomass, held = values.get("biomass_kgc_m2", 0.0), most_biomass(values)
    if held is not None:
        stems, most = held
        if stems == 0.0 and biomass > 0.0:
            raise ValueError(f"initial biomass_kgc_m2 = {biomass:g}: without stems, 0 is allowed")
        if biomass > most:
            raise ValueError(
                f"initial biomass_kgc_m2 = {biomass:g}: of {stems:g} stems/ha at most {most:.4g} is allowed, "
                f"{most / stems * 1e4:.3g} kgC a stem of that age"
            )
    return {name: float(value) for name, value in values.items()}


def most_biomass(stocks) -> tuple | None:
    """Stems [stems ha-1] and the most biomass that they hold [kgC m-2], from numbers or columns by record name.

    None where neither density nor classes are given.
    """
    return most_of_stems(stocks) if {"density_stems_ha", *CLASS_NAMES} & set(stocks) else None


def most_of_stems(stocks) -> tuple:
    """Stems [stems ha-1] and the most biomass that they hold [kgC m-2], of stocks that have density or classes."""
    first, largest = first_ages(DEFAULTS), largest_stems()
    by_class = [(stocks[name], k) for k, name in enumerate(CLASS_NAMES) if name in stocks]
    if by_class:
        ends = [largest[row, first[size + 1] - 1] for row, size in (divmod(k, len(AGE_CLASSES)) for _, k in by_class)]
        stems = sum(number for number, _ in by_class)
        return stems, sum(number * end for (number, _), end in zip(by_class, ends, strict=True)) * 1e-4
    stems = stocks["density_stems_ha"]
    if "oldest_age_years" not in stocks:
        return stems, stems * LARGEST_STEM_KGC * 1e-4
    return stems, stems * np.interp(stocks["oldest_age_years"], np.arange(AGES), largest.max(axis=0)) * 1e-4


@functools.cache
def largest_stems() -> np.ndarray:
    """The most carbon that a given stem may have, by species and age [kgC], shape (2, AGES)."""
    return read_only(np.minimum(LARGEST_OF_ITS_AGE * stem_sizes(DEFAULTS), LARGEST_STEM_KGC))


def check_initial_ranges(ranges: dict | None) -> dict[str, tuple[float, float]]:
    """Ranges of first stocks, checked like `check_initial`; each a (low, high) pair. Without stems no biomass."""
    checked = {}
    for name, pair in check_mapping("initial_ranges", ranges).items():
        if name not in DRAWN:
            raise ValueError(f"unknown initial range {name!r}; allowed: {', '.join(DRAWN)}")
        if not isinstance(pair, (tuple, list, np.ndarray)) or np.shape(pair) != (2,):
            raise ValueError(f"initial range {name}: a (low, high) pair is allowed, got {pair!r}")
        low, high = (check_initial({name: value})[name] for value in pair)
        if low > high:
            raise ValueError(f"initial range {name}: reversed, {low:g} > {high:g}")
        checked[name] = (low, high)
    if checked.get("density_stems_ha") == (0.0, 0.0):
        biomass = checked.setdefault("biomass_kgc_m2", (0.0, 0.0))[1]
        if biomass > 0.0:
            raise ValueError(f"initial range biomass_kgc_m2: up to {biomass:g}; without stems, (0, 0) is allowed")
    return checked


def first_state(parameters: dict, generator: np.random.Generator, given: dict | None, ranges: dict) -> np.ndarray:
    """State vector of a stand before spin-up, shape (fields of `STATE` + ages of both species,).

    parameters : all parameters by name; given : stocks by record name, in place of drawn ones; ranges : of the drawn
    ones, as `INITIAL_RANGES`. As many numbers are drawn whatever is given.
    """
    dice = {name: generator.random() for name in DRAWN}
    stocks = drawn_stocks(dice, given or {}, ranges)
    biomass = stocks["biomass_kgc_m2"]
    sizes = stem_sizes(parameters)
    if any(name in CLASS_NAMES for name in stocks):
        stems = stems_of_classes(stocks, parameters)
    else:
        shares = np.array([stocks["conifer_fraction"], 1.0 - stocks["conifer_fraction"]])
        if "oldest_age_years" in stocks:
            ages = stems_of_ages(stocks["oldest_age_years"])
        else:
            mean_stem = biomass / (stocks["density_stems_ha"] * 1e-4) if stocks["density_stems_ha"] > 0.0 else 0.0
            ages = stems_of_size(mean_stem, shares @ sizes)
        stems = stocks["density_stems_ha"] * shares[:, None] * ages
    conifers, deciduous = stems
    density = stems.sum()
    carbon = (stems * sizes).sum(axis=1)
    conifer_biomass = biomass * (carbon[0] / carbon.sum() if density > 0.0 else stocks["conifer_fraction"])

    depth = stocks.get("organic_layer_m", organic_depth_in_balance(stems, parameters))
    organic_water = 0.4 * WATER_DENSITY * (parameters["moss_water_held"] + parameters["humus_water_held"]) * depth
    mean = parameters["mean_annual_temperature_c"]
    boundary = parameters["deep_boundary_temperature_k"] - FREEZING_POINT_K
    winter = mean - parameters["seasonal_amplitude_c"]
    state = dict.fromkeys(STATE, 0.0) | {
        "conifer_biomass": conifer_biomass,
        "deciduous_biomass": biomass - conifer_biomass,
        "soil_carbon": stocks["soil_kgc_m2"],
        **{name: stocks.get(f"{name}_kgc_m2", SOME_DEADWOOD) for name in DEADWOOD},
        "products": stocks.get("hwp_kgc_m2", 0.0),
        "organic_depth": depth,
        "canopy": winter,
        "trunk": winter,
        "ground": min(winter, 0.0),
        "organic_heat": enthalpy(0.5 * (mean + winter), *organic_node(parameters, depth, organic_water)),
        "organic_water": organic_water,
        "surface_heat": enthalpy(mean - 1.0, *soil_node(parameters, "surface")),
        "deep_heat": enthalpy(0.5 * (mean + 2.0 + boundary), *soil_node(parameters, "deep")),
        "swe": 40.0 if winter < 0.0 else 0.0,
        "snow_density": FIRST_SNOW_DENSITY,
        "albedo": parameters["snow_albedo_fresh"],
        "soil_water": 0.7 * parameters["max_water_content_mm"],
        "acclimation": winter,
    }
    return np.concatenate([list(state.values()), conifers, deciduous])


def organic_depth_in_balance(stems: np.ndarray, parameters: dict) -> float:
    """Depth [m] of the organic layer in balance with the crowns of these stems by species and age, shape (2, AGES)."""
    cover = crown_covers(stems, parameters)
    depths = np.array([parameters["organic_depth_conifer_m"], parameters["organic_depth_deciduous_m"]])
    return float(cover @ depths + (1.0 - cover.sum()) * parameters["organic_depth_open_m"])


def crown_covers(stems: np.ndarray, parameters: dict) -> np.ndarray:
    """Shares of the ground under conifers' and deciduous trees' crowns, from stems by species and age, (2, AGES)."""
    crowns = np.zeros(2)
    for k, species in enumerate(("conifer", "deciduous")):
        grown_as = species if parameters["crown_development"] else "conifer"
        factors = [parameters[f"crown_{grown_as}_{size}"] for size in AGE_CLASSES]
        relative = stems[k] @ crowns_by_age(*factors)
        crowns[k] = relative * parameters[f"crown_area_{species}_m2"] / SQUARE_METRES_PER_HECTARE
    area = crowns.sum()
    return (1.0 - math.exp(-area)) * crowns / area if area > 0.0 else crowns


@functools.lru_cache(maxsize=1024)
def crowns_by_age(*factors: float) -> np.ndarray:
    """Crown area of a stem relative to a mature one, shape (AGES,), from that of each age class."""
    return read_only([crown_factor(age, *factors) for age in range(AGES)])


def read_only(values) -> np.ndarray:
    """An array that many sites share."""
    array = np.array(values)
    array.flags.writeable = False
    return array


def first_stems(state: np.ndarray) -> np.ndarray:
    """Stems by species and age of a `first_state`, shape (2, AGES)."""
    return state[-2 * AGES :].reshape(2, AGES)


def drawn_stocks(dice: dict, given: dict, ranges: dict) -> dict[str, float]:
    """First stocks by record name, from uniform numbers by name; biomass within what the stems can hold.

    That is `most_biomass`: beyond it the upper end of its range is cut off, and if need be the lower. Where biomass is
    given and density drawn, there are at least the stems that hold it.
    """
    stocks = {name: low + (high - low) * dice[name] for name, (low, high) in ranges.items()}
    stocks.update(given)
    classes = [stocks[name] for name in CLASS_NAMES if name in stocks]
    density = sum(classes) if classes else stocks["density_stems_ha"]
    if "biomass_kgc_m2" not in given:
        _, held = most_of_stems(stocks)
        low, high = (min(end, held) for end in ranges["biomass_kgc_m2"])
        stocks["biomass_kgc_m2"] = low + (high - low) * dice["biomass_kgc_m2"]
    if "biomass_kgc_m2" in given and not classes and "density_stems_ha" not in given:
        _, of_a_stem = most_of_stems({**stocks, "density_stems_ha": 1.0})
        stocks["density_stems_ha"] = max(density, given["biomass_kgc_m2"] / of_a_stem)
    return stocks


def middle_stocks(ranges: dict) -> dict[str, float]:
    """The stocks in the middle of what is drawn."""
    return drawn_stocks(dict.fromkeys(DRAWN, 0.5), {}, ranges)


def stem_sizes(parameters: dict) -> np.ndarray:
    """Carbon of a stem by species and age [kgC], shape (2, AGES), `LARGEST_STEM_KGC` at the last age."""
    exponent = parameters["stem_carbon_exponent"]
    return np.array(
        [
            sizes_by_age(parameters[f"height_rate_{species}"], parameters[f"height_shape_{species}"], exponent)
            for species in ("conifer", "deciduous")
        ]
    )


@functools.lru_cache(maxsize=1024)
def sizes_by_age(rate: float, shape: float, exponent: float) -> np.ndarray:
    """Carbon of a stem of one species by age [kgC], shape (AGES,); rate [yr-1], shape, exponent: of `stem_weight`."""
    sizes = np.array([weight(age, rate, shape, exponent) for age in range(AGES)])
    return read_only(LARGEST_STEM_KGC * (sizes / sizes[-1]))


@functools.lru_cache(maxsize=1024)
def stems_of_ages(oldest_age: float, youngest_age: float = 1) -> np.ndarray:
    """Shares of stems by age, shape (AGES,): the youngest to the oldest, fewer by `YEARLY_SURVIVAL` each year."""
    ages = np.zeros(AGES)
    oldest, youngest = (max(1, int(round(age))) for age in (oldest_age, youngest_age))
    years = np.arange(youngest, oldest + 1)
    np.add.at(ages, np.minimum(years, OLDEST), YEARLY_SURVIVAL ** (years - youngest))
    return read_only(ages / ages.sum())


def stems_of_size(mean_kgc: float, sizes: np.ndarray) -> np.ndarray:
    """Shares of stems by age, shape (AGES,), of a stand that came up in `COHORT_YEARS` and whose mean stem has so much
    carbon; the youngest or the oldest stand if that is out of reach.

    sizes : carbon of a stem by age [kgC], shape (AGES,).
    """
    older = stems_of_ages(1)
    for oldest in range(2, OLDEST + COHORT_YEARS):
        younger, older = older, stems_of_ages(oldest, oldest - COHORT_YEARS + 1)
        small, large = younger @ sizes, older @ sizes
        if mean_kgc <= large:
            share = min(max((mean_kgc - small) / (large - small), 0.0), 1.0) if large > small else 1.0
            return share * older + (1.0 - share) * younger
    return older


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


def organic_node(parameters: dict, depth: float, water: float) -> tuple[float, float, float, float]:
    """The same of an organic layer of so much depth [m] and water [mm]."""
    return *layer_capacities(
        parameters["soil_freezing"], depth, parameters["organic_heat_capacity_dry"], water
    ), parameters["soil_freezing_range_k"]


def climate_draws(as_observed: bool = False, persistence: float = 0.0) -> dict[str, np.ndarray]:
    """Draws of the climate's mean year: wet days spread evenly, no fire, no insects, the mean mortality.

    The paper's weather has no noise and the mean amount on each wet day. Weather as observed swings by several degrees,
    and what snow, wind and frost make of that is not what they make of the mean: its days have all amounts and winds,
    spread evenly, and its temperature is a wave of the noise's variance and about its `persistence` from day to day,
    with as many whole waves in each season.
    """
    day = np.arange(DAYS)
    draws = {
        "wet_dice": (day * GOLDEN_RATIO) % 1.0,
        "wet_amount": np.ones(DAYS),
        "fire_dice": np.ones(DAYS),
        "insect_dice": np.ones(1),
        "mortality_dice": np.full(1, 0.5),
    }
    if as_observed:
        waves = 4 * max(1, round(math.acos(persistence) * DAYS / (8.0 * math.pi)))
        wave = math.sqrt(2.0) * np.cos(2.0 * math.pi * waves / DAYS * np.arange(-1, DAYS))
        noise = (wave[1:] - persistence * wave[:-1]) / math.sqrt(1.0 - persistence**2)
        noise[0] = wave[1]  # nothing is remembered on 1 January
        normal = NormalDist()
        draws["temperature_noise"] = noise
        draws["wet_amount"] = -np.log(1.0 - (0.5 + day * 2.0 ** (1.0 / 3.0)) % 1.0)
        draws["wind_noise"] = np.array([normal.inv_cdf(share) for share in (0.5 + day * math.sqrt(3.0)) % 1.0])
    return draws


def deep_heat_limits(parameters: dict, surface_temperature: float) -> tuple[float, float]:
    """Range of the deep soil's enthalpy [J m-2] on 1 January: its mean lies between the surface soil's and the
    boundary's, and the season moves it by less than `SEASONAL_RANGE_K` from that."""
    boundary = parameters[BOUNDARY] - FREEZING_POINT_K
    low, high = sorted((surface_temperature, boundary))
    node = soil_node(parameters, "deep")
    return enthalpy(low - SEASONAL_RANGE_K, *node), enthalpy(high + SEASONAL_RANGE_K, *node)


def boundary_in_balance(parameters: dict, mean: float, heat: float, next_heat: float) -> float:
    """Boundary [K] through which no heat flows in the year to come: as warm as the deep soil will be in its mean.

    mean : of the year just run [degC], in which its enthalpy [J m-2] was `heat`; next_heat : where it starts now.
    """
    node = soil_node(parameters, "deep")
    expected = mean + temperature(next_heat, *node) - temperature(heat, *node)
    limits = SITE_PARAMETERS[BOUNDARY]
    return min(max(expected + FREEZING_POINT_K, limits.physical_low), limits.physical_high)


def soil_carbon_in_balance(soil, change, respired) -> np.ndarray:
    """Soil carbon [kgC m-2] whose respiration is what it gets, for respiration is in proportion to it.

    soil : at the start of the year just run; change : what it gained; respired : what it lost to the air itself.
    """
    rate = respired / (soil + 0.5 * change)
    limit = INITIAL_LIMITS["soil_kgc_m2"][1]
    return np.clip((change + respired) / np.maximum(rate, 1e-6), LEAST_SOIL_KGC, limit)


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
