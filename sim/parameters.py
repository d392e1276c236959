"""The two parameter tables, sampling of sites, and the checks of user-given values.

`site_parameters.csv`: the parameters that differ between sites, with the range they are sampled from, and whether an
observation of the site shows them. `constants.csv`: literature constants, one value each. Both have physical limits, a
unit and a source, and both are passed to the compiled physics at run time: changing one recompiles nothing.
"""

import csv
import difflib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from numbers import Real
from statistics import NormalDist

import numpy as np


@dataclass(frozen=True)
class Parameter:
    """One row of a parameter table; `low == high` for a constant, which is not observed."""

    name: str
    low: float
    high: float
    physical_low: float
    physical_high: float
    unit: str
    group: str
    source: str
    description: str
    observed: bool = False


def _read(table: str) -> dict[str, Parameter]:
    parameters = {}
    for row in csv.DictReader((files("sim") / table).read_text(encoding="utf-8").splitlines()):
        observed = row.get("observed", "no")
        if observed not in ("yes", "no"):
            raise ValueError(f"{table}: {row['name']} has observed {observed!r}; yes and no are allowed")
        parameters[row["name"]] = Parameter(
            name=row["name"],
            low=float(row.get("value") or row["low"]),
            high=float(row.get("value") or row["high"]),
            physical_low=float(row["physical_low"]),
            physical_high=float(row["physical_high"]),
            unit=row["unit"],
            group=row["group"],
            source=row["source"],
            description=row["description"],
            observed=observed == "yes",
        )
    return parameters


#: Parameters of a site, by name: the rows of `site_parameters.csv`.
SITE_PARAMETERS = _read("site_parameters.csv")
#: Literature constants, by name: the rows of `constants.csv`.
CONSTANTS = _read("constants.csv")

#: Names of the site parameters that are observed, in the order of the table.
OBSERVED_SITE_PARAMETERS = tuple(name for name, parameter in SITE_PARAMETERS.items() if parameter.observed)

#: Mechanisms that can be switched off, to run the paper's bare five nodes or to measure what each one does.
MECHANISMS = {
    "moss": "moss and organic layer between the surface and the mineral soil",
    "interception": "rain and snow held, evaporated and sublimated by the canopy",
    "soil_freezing": "latent heat and conductivity of freezing soil",
    "crown_development": "crown growth by species and age (off: both species grow alike)",
    "fire": "stochastic fire",
    "insects": "stochastic insect outbreaks",
    "snowfall_limit": "snowfall of the records, less in cold spells (off: the site table's, 2.4 times as much)",
}

#: Weather of the generator: as the paper's table has it, or with the daily variability of the records; where the second
#: is chosen, the parameter `weather_as_observed` is 1.
WEATHERS = ("paper", "observed")

#: Constants that make sense only in this order.
ORDERED_CONSTANTS = (
    ("surface_soil_depth_m", "deep_soil_node_m"),
    ("deep_soil_node_m", "boundary_depth_m"),
    ("snow_albedo_old", "snow_albedo_cold"),
    ("snow_albedo_cold", "snow_albedo_fresh"),
    ("fire_kill_low", "fire_kill_high"),
    ("fire_organic_low", "fire_organic_high"),
    ("insect_lethal_c", "insect_mild_c"),
    ("moss_water_held", "organic_porosity"),
    ("humus_water_held", "organic_porosity"),
    ("organic_conductivity_dry", "organic_conductivity_saturated"),
    ("organic_conductivity_saturated", "organic_conductivity_saturated_frozen"),
)

MOST_NOISE_C = 15.0  # s.d. of daily temperature about the year's course: Yakutia's winter has 9 to 10 K
WHOLE_CONSTANTS = ("young_age_limit", "mature_age_limit")

_LOWEST, _HIGHEST = np.array([(p.physical_low, p.physical_high) for p in SITE_PARAMETERS.values()]).T
_LATITUDE_SOUTH, _LATITUDE_RANGE = 56.0, 9.0
_SITE_TEMPERATURE_SPREAD_C = 0.5


def mean_annual_temperature(latitude_deg: float, uniform: float) -> float:
    """Mean annual temperature [degC] of a site: -5 - 5 (latitude - 56) / 9 + N(0, 0.5), kept in the sampled range.

    `uniform` in [0, 1) is turned into the truncated normal deviate by its inverse distribution, so that one draw
    is used whatever the latitude. Where the range is out of reach the nearer limit is returned.
    """
    parameter = SITE_PARAMETERS["mean_annual_temperature_c"]
    centre = -5.0 - 5.0 * (latitude_deg - _LATITUDE_SOUTH) / _LATITUDE_RANGE
    low, high = ((limit - centre) / _SITE_TEMPERATURE_SPREAD_C for limit in (parameter.low, parameter.high))
    if low > 6.0 or high < -6.0:
        return parameter.low if low > 6.0 else parameter.high
    normal = NormalDist()
    share = normal.cdf(low) + uniform * (normal.cdf(high) - normal.cdf(low))
    deviate = normal.inv_cdf(min(max(share, 1e-12), 1.0 - 1e-12))
    return min(max(centre + _SITE_TEMPERATURE_SPREAD_C * deviate, parameter.low), parameter.high)


def sample_site(site_seed: int, overrides: dict | None = None) -> dict[str, float]:
    """The parameters of the site with this seed, in the order of `site_parameters.csv`.

    All are always drawn, so that an override (a value, or a (low, high) range to draw from) changes nothing else, but
    for the mean annual temperature, which is drawn around that of the latitude; those that are not observed after the
    others, so that a new one changes no site. Raises ValueError for an unknown name or
    a value outside physical limits.
    """
    overrides = check_overrides(overrides)
    generator = np.random.default_rng(check_seed("site_seed", site_seed))
    observed_first = sorted(SITE_PARAMETERS, key=lambda name: not SITE_PARAMETERS[name].observed)
    uniforms = {name: generator.random() for name in observed_first}
    site = {}
    for name, parameter in SITE_PARAMETERS.items():
        low, high = overrides.get(name, (parameter.low, parameter.high))
        site[name] = float(low + (high - low) * uniforms[name])
    name = "mean_annual_temperature_c"
    if name not in overrides:
        site[name] = mean_annual_temperature(site["latitude_deg"], uniforms[name])
    return site


def middle_site(overrides: dict | None = None) -> dict[str, float]:
    """The site in the middle of every range (mean annual temperature: that of its latitude), with overrides, in units
    of `sim/site_parameters.csv`. ValueError names what is no parameter or beyond its limits."""
    overrides = check_overrides(overrides)
    site = {}
    for name, parameter in SITE_PARAMETERS.items():
        low, high = overrides.get(name, (parameter.low, parameter.high))
        site[name] = 0.5 * (low + high)
    name = "mean_annual_temperature_c"
    if name not in overrides:
        site[name] = mean_annual_temperature(site["latitude_deg"], 0.5)
    return site


def scale_site(site: dict[str, float]) -> np.ndarray:
    """The observed parameters as shares of their sampled ranges: 0 at the low end, 1 at the high end.

    Shape (number of `OBSERVED_SITE_PARAMETERS`,). Raises ValueError for a site that lacks one.
    """
    if missing := [name for name in OBSERVED_SITE_PARAMETERS if name not in check_mapping("site", site)]:
        more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
        raise ValueError(f"site: {', '.join(missing[:3])}{more} missing; sim.sample_site and sim.middle_site give all")
    parameters = {name: SITE_PARAMETERS[name] for name in OBSERVED_SITE_PARAMETERS}
    return np.array([(_check_number(name, site[name], p) - p.low) / (p.high - p.low) for name, p in parameters.items()])


def check_noise(values: dict) -> None:
    """Raise ValueError for observed weather whose temperature would swing more than anywhere on Earth.

    values : parameters by name. The weather generator's noise is the site's times a factor of the season, then.
    """
    if not values["weather_as_observed"]:
        return
    name = max((name for name in values if name.startswith("noise_factor_")), key=values.__getitem__)
    if values["daily_noise_std_c"] * values[name] > MOST_NOISE_C:
        raise ValueError(
            f"daily_noise_std_c = {values['daily_noise_std_c']:g}: with weather as observed, in which {name} = "
            f"{values[name]:g} multiplies it, at most {MOST_NOISE_C / values[name]:.3g} is allowed"
        )


def check_overrides(overrides: dict | None) -> dict[str, tuple[float, float]]:
    """Site overrides as name -> (low, high), checked against names and physical limits."""
    checked = {}
    for name, value in check_mapping("site parameters", overrides).items():
        parameter = _lookup(SITE_PARAMETERS, "site parameter", name)
        ends = value if isinstance(value, (tuple, list)) or np.ndim(value) == 1 else (value, value)
        if len(ends) != 2:
            raise ValueError(f"{name}: a value or a (low, high) pair is allowed, got {value!r}")
        low, high = (_check_number(name, end, parameter) for end in ends)
        if low > high:
            raise ValueError(f"{name}: range reversed, {low:g} > {high:g}")
        checked[name] = (low, high)
    return checked


def check_site(site) -> None:
    """Raise ValueError for a site that has not all parameters, others, or one outside its physical limits."""
    if not isinstance(site, dict) or site.keys() != SITE_PARAMETERS.keys():
        given = check_mapping("site", site)
        for name in given:
            _lookup(SITE_PARAMETERS, "site parameter", name)
        missing = next(name for name in SITE_PARAMETERS if name not in given)
        raise ValueError(f"site: {missing} is missing; sim.sample_site and sim.middle_site give all")
    numbers = all(isinstance(value, float) for value in site.values())  # as sim.sample_site gives them
    values = np.array([site[name] for name in SITE_PARAMETERS]) if numbers else None
    if values is None or not ((values >= _LOWEST) & (values <= _HIGHEST)).all():
        for name, value in site.items():
            _check_number(name, value, SITE_PARAMETERS[name])


def check_constants(overrides: dict | None) -> dict[str, float]:
    """All literature constants by name, with checked overrides."""
    values = {name: parameter.low for name, parameter in CONSTANTS.items()}
    for name, value in check_mapping("constants", overrides).items():
        values[name] = _check_number(name, value, _lookup(CONSTANTS, "constant", name))
        if name in WHOLE_CONSTANTS and values[name] % 1:
            raise ValueError(f"{name} = {values[name]:g}: a whole number is allowed")
    for low, high in ORDERED_CONSTANTS:
        if values[low] >= values[high]:
            raise ValueError(f"{low} = {values[low]:g} has to be less than {high} = {values[high]:g}")
    return values


def check_mechanisms(switches: dict | None) -> dict[str, bool]:
    """All mechanism switches by name; those not given are on."""
    values = dict.fromkeys(MECHANISMS, True)
    for name, value in check_mapping("mechanisms", switches).items():
        _lookup(MECHANISMS, "mechanism", name)
        if not isinstance(value, (bool, np.bool_)):
            raise ValueError(f"mechanism {name!r}: True or False is allowed, got {value!r}")
        values[name] = bool(value)
    return values


def check_weather(weather: str) -> dict[str, bool]:
    """One of `WEATHERS`, as the parameter that it is."""
    return {"weather_as_observed": check_name("weather", weather, WEATHERS) == "observed"}


def brief(value) -> str:
    """A value as an error shows it: in one line, a table or a long list by its type alone."""
    text = repr(value)
    return text if len(text) <= 100 and "\n" not in text else f"of type {type(value).__name__}"


def check_name(what: str, value, allowed: Sequence[str]) -> str:
    """The value, which has to be one of the names that are allowed."""
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"{what} {brief(value)}: allowed are {', '.join(allowed)}")
    return value


def check_mapping(what: str, mapping) -> dict:
    """A dict, or an empty one for None."""
    if mapping is None:
        return {}
    if not isinstance(mapping, dict):
        raise ValueError(f"{what}: a dict of names and values is allowed, got {type(mapping).__name__}")
    return mapping


def _lookup(table: dict, kind: str, name):
    if name in table:
        return table[name]
    near = difflib.get_close_matches(str(name), table, n=3)
    hint = f"did you mean {', '.join(near)}? " if near else ""
    raise ValueError(f"unknown {kind} {name!r}; {hint}allowed: {', '.join(table)}")


def _check_number(name: str, value, parameter: Parameter) -> float:
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real) or not math.isfinite(value):
        raise ValueError(f"{name}: a finite number is allowed, got {value!r}")
    number = float(value)
    if not parameter.physical_low <= number <= parameter.physical_high:
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        raise ValueError(
            f"{name} = {number:g} is outside its physical limits "
            f"[{parameter.physical_low:g}, {parameter.physical_high:g}]{unit}"
        )
    return number


def is_integer(value) -> bool:
    """Whether it is an integer of Python or numpy: no truth value, no span of time, both of which pass for one."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, (bool, np.timedelta64))


def check_seed(name: str, seed) -> int:
    """A seed: an integer in [0, 2^63)."""
    if not is_integer(seed) or not 0 <= seed < 2**63:
        raise ValueError(f"{name}: an integer in [0, 2^63) is allowed, got {seed!r}")
    return int(seed)
