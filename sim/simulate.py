"""The scientist's door: one stand, given actions, generated or observed weather, a table or a Dataset out."""

from numbers import Real

import numpy as np
import pandas as pd

from sim import stands
from sim.draws import episode_seeds
from sim.io.check import check_forcing, interval_of
from sim.io.dataset import import_xarray, to_dataset
from sim.io.disaggregation import climate_of
from sim.jit import uncompiled
from sim.management import NO_CHANGE, as_array, check_actions, decode
from sim.parameters import SITE_PARAMETERS, brief, check_mapping, is_integer, middle_site
from sim.physical_constants import FREEZING_POINT_K
from sim.scenario import FIRST_YEAR
from sim.spin_up import BOUNDARIES, BOUNDARY, INITIAL_RANGES, check_initial, crown_covers, first_state, first_stems
from sim.stands import HELD_COLUMNS, MOST_YEARS, Stands
from sim.state import DAILY, DAILY_NAMES, DAYS, PARAMETER_NAMES, RECORD, RECORD_NAMES
from sim.structure import leaf_out

OUTPUTS = ("annual", "daily", "xarray")
DEFAULT_YEARS = 50
DATES = (1678, 2261)  # years whose nanoseconds xarray can count
DEFAULT_MINUTES = 30
NUMBER = (int, float, np.number)

#: Site parameters of a stand whose stems neither come nor go.
HELD_STAND = {
    "natural_mortality": 0.0,
    "density_dependent_mortality": 0.0,
    "recruitment_rate": 0.0,
    "fire_base_probability": 0.0,
    "insect_base_probability": 0.0,
}
CLIMATE = ("mean_annual_temperature_c", "seasonal_amplitude_c")
NET_EXCHANGE = "nee_kgc_m2"
#: Name -> (unit, meaning) of what the tables have beside the columns of `sim.state`.
ADDED = {
    "year": ("year", "from 0"),
    "doy": ("day of year", "from 1"),
    NET_EXCHANGE: ("kgC m-2", "net ecosystem exchange: respiration less gross primary production; uptake is negative"),
}


def simulate(
    site=None,
    actions=None,
    *,
    seed=0,
    years=None,
    time_step_minutes=None,
    backend="numba",
    forcing=None,
    initial=None,
    hold_stand=False,
    lai=None,
    output="annual",
    constants=None,
    mechanisms=None,
    weather="paper",
    boundary=None,
    soil_carbon="drawn",
    scenario=None,
    hwp_half_life_years=None,
    harvest_min_class="young",
):
    """Simulate one stand.

    Parameters
    ----------
    site : dict of site parameters that differ from the middle of their ranges (any value inside the physical
        limits of `sim/site_parameters.csv`), or None. All of them, as `sim.sample_site` returns them, are a site too.
        Latitude and climate are the forcing's, where they are not given; a frame that neither `sim.read_forcing` nor
        `sim.half_hours` made does not know its latitude. Beside whole years of forcing nothing acts of what the
        weather generator takes of the site, such as rain and wind, but summer's first and last day, which bound the
        season of fire; nor does `weather`.
    actions : integer in [0, 25) for every year, or a sequence with one a year; None changes nothing.
    seed : of first state, weather and disturbances.
    years : years to run, at most 5,000; by default those of the forcing, or 50.
    forcing : observed weather instead of the generator, as `sim.read_forcing` returns it: DataFrame with a regular
        DatetimeIndex of local solar time (start of the interval, from midnight) and the columns air_temperature_c
        [degC], relative_humidity [0-1, over water], wind_speed_m_s, shortwave_w_m2, longwave_w_m2 [W m-2],
        precipitation_mm [mm per interval]. Whole years of 365 days (29 February is dropped), repeated if there are
        fewer than `years`; or, with years=1, whole days of a part of a year that starts on 1 January, whose ground is
        spun up under generated weather of the site's mean_annual_temperature_c and seasonal_amplitude_c, which have to
        be given. Intervals finer than the time step are averaged, precipitation summed.
    initial : first stocks by name: density_stems_ha, conifer_fraction, biomass_kgc_m2, soil_kgc_m2,
        conifer_deadwood_kgc_m2, deciduous_deadwood_kgc_m2, hwp_kgc_m2, organic_layer_m, oldest_age_years, or stems by
        class (conifer_mature_stems_ha, ...). Of stems, biomass and soil carbon what is not given is drawn; the stems'
        age follows from biomass and density, dead wood is what the stand's deaths keep up, the organic layer is in
        balance with the crowns, and there are no products.
    hold_stand : True keeps the stand as it begins: no stem dies, comes up, burns or is eaten, and on every 1 January
        trees, soil carbon, dead wood and organic layer are those of the first. Dead wood is then none, unless given.
    lai : leaf area of the first stand in full leaf, per ground area [m2 m-2]; None leaves it to crowns and site.
    output : "annual" for one row a year (columns `sim.state.RECORD`), "daily" for one row a day (`sim.state.DAILY`),
        "xarray" for a Dataset of both with names and units of ALMA and CF (`sim.io.dataset`; `.to_netcdf(file)`). A
        part of a year has no annual values.
    boundary : temperature far below: "sampled", the site's; "balanced", that at which no heat flows through it below
        the first stand, whatever the site has; or a number [degC]. None: "balanced" with a forcing, unless the site has
        one, else "sampled".
    scenario : climate change, see `sim.Stands`; not with `forcing`, which is weather of its own.
    time_step_minutes : a divisor of a day of at most 120 minutes; by default 30, or the least multiple of the forcing's
        interval from 30 on that divides a day.
    constants, mechanisms, weather, soil_carbon, hwp_half_life_years, harvest_min_class, backend : see `sim.Stands`.

    Returns
    -------
    pandas.DataFrame, indexed by `time` (start of the year or day: the forcing's, going on where it is repeated, or from
    2025 on; there is no 29 February), with a column `year` (from 0), daily `doy` (from 1), and `nee_kgc_m2`, net
    exchange. Fluxes are sums of the row's year or day; `attrs["units"]` has each column's unit. Or an xarray.Dataset.

    Raises
    ------
    ValueError for bad input, naming the value and what is allowed; `sim.PhysicsError` if a balance does not close;
    ImportError for output="xarray" without xarray.
    """
    if not isinstance(output, str) or output not in OUTPUTS:
        raise ValueError(f"output {output!r}: allowed are {', '.join(OUTPUTS)}")
    if output == "xarray":
        import_xarray('output="xarray"')
    if not isinstance(hold_stand, (bool, np.bool_)):
        raise ValueError(f"hold_stand: True or False is allowed, got {hold_stand!r}")
    interval = DEFAULT_MINUTES if forcing is None else interval_of(forcing)
    if interval > stands.LONGEST_STEP_MINUTES or 1440 % interval:
        raise ValueError(
            f"forcing: it comes every {interval} minutes; a divisor of a day of at most {stands.LONGEST_STEP_MINUTES} "
            "is allowed"
        )
    if time_step_minutes is None:
        steps = range(interval, 1441, interval)
        time_step_minutes = next(step for step in steps if step >= DEFAULT_MINUTES and 1440 % step == 0)
    years = _check_years(years, forcing, interval)
    first_year = FIRST_YEAR if forcing is None else int(forcing.index[0].year)
    if output == "xarray" and not DATES[0] <= first_year <= first_year + years - 1 <= DATES[1]:
        which = f"{first_year} to {first_year + years - 1}"
        raise ValueError(
            f'output "xarray": years in [{DATES[0]}, {DATES[1]}] are allowed, got {which}; "daily" has all'
        )
    given = as_array(NO_CHANGE if actions is None else actions)
    per_year = np.full(years, given) if given.ndim == 0 else given
    check_actions(per_year, years, "years")
    given_site = check_mapping("site parameters", site)
    if boundary is None:  # the middle of what is sampled would be in balance with a record's climate by chance alone
        boundary = "balanced" if forcing is not None and BOUNDARY not in given_site else "sampled"
    overrides, boundary = _with_boundary(given_site, boundary)
    for name, value in overrides.items():
        if np.ndim(value):
            raise ValueError(f"site: {name} = {value!r}: one number is allowed for one stand")
    if hold_stand:
        overrides = {**overrides, **HELD_STAND}
    stand = Stands(
        1,
        time_step_minutes=time_step_minutes,
        backend=backend,
        constants=constants,
        mechanisms=mechanisms,
        weather=weather,
        boundary=boundary,
        soil_carbon=soil_carbon,
        scenario=scenario,
        hwp_half_life_years=hwp_half_life_years,
        harvest_min_class=harvest_min_class,
    )
    if stand.scenario is not None:
        if forcing is not None:
            raise ValueError("scenario: only generated weather can change; with forcing, None is allowed")
        stand.scenario.check_years(years)
    observed, days = None, DAYS
    if forcing is not None:
        observed, days = check_forcing(forcing, time_step_minutes, years)
        overrides = _of_forcing(overrides, forcing)
    if days < DAYS:
        _check_part(days, output, overrides)
    first_weather = None if observed is None else observed[0]
    place, seeds, stocks = middle_site(overrides), episode_seeds(seed), check_initial(initial)
    if lai is not None:
        place = _with_leaf_area(place, lai, stand, seeds, stocks)
    if hold_stand and decode(per_year)[0].any():
        raise ValueError("hold_stand: a stand that is held is neither planted nor cut; actions=None is allowed")
    stand.start(0, [place], [seeds], {0: stocks}, observed=first_weather)

    held = stand.state[:, HELD_COLUMNS].copy()
    records, rows = [], []
    for year in range(years):
        year_weather = None if observed is None else observed[year % len(observed)]
        record, daily = stand.step(per_year[year : year + 1], observed=year_weather, days=days, daily=True)
        if hold_stand:
            stand.state[:, HELD_COLUMNS] = held
        records.append(record)
        if output != "annual":
            rows.append(daily[0])
    annual = _table(np.concatenate(records), RECORD_NAMES, _new_year(first_year, years))
    if output == "annual":
        return annual
    daily = _table(np.concatenate(rows), DAILY_NAMES, _dates(first_year, years, days), days)
    if output == "daily":
        return daily
    boundary_c = stand.parameters[0, PARAMETER_NAMES.index(BOUNDARY)] - FREEZING_POINT_K
    about = {
        "seed": int(seed),
        "time_step_minutes": int(time_step_minutes),
        "hold_stand": int(hold_stand),
        "site": place,
    }
    place[BOUNDARY] = boundary_c + FREEZING_POINT_K
    about |= {"initial": stocks, "actions": per_year.tolist(), "boundary": boundary}
    about |= {"constants": {name: float(value) for name, value in (constants or {}).items()}}
    about |= {"mechanisms": {name: bool(value) for name, value in (mechanisms or {}).items()}}
    about |= {"weather": weather, "soil_carbon": soil_carbon, "harvest_min_class": harvest_min_class}
    about |= {"hwp_half_life_years": "for ever" if hwp_half_life_years is None else float(hwp_half_life_years)}
    if scenario is not None:
        about["scenario"] = scenario if isinstance(scenario, str) else "a table"
    if forcing is not None:
        about["forcing"] = "; ".join(forcing.attrs.get("report", ["as given"]))
    if days < DAYS:
        annual = annual.iloc[:0, :1]
    return to_dataset(daily, annual, RECORD | DAILY | ADDED, stand.constants, boundary_c, about)


def _check_years(years, forcing, interval: int) -> int:
    if years is None:
        return DEFAULT_YEARS if forcing is None else max(1, len(forcing) * interval // (1440 * DAYS))
    if not is_integer(years) or years < 1:
        raise ValueError(f"years: a positive integer is allowed, got {years!r}")
    if years > MOST_YEARS:
        raise ValueError(f"years = {years}: at most {MOST_YEARS} are allowed")
    return int(years)


def _of_forcing(given: dict, forcing: pd.DataFrame) -> dict:
    """The site's overrides, with what the forcing's record tells of it where they do not."""
    told = forcing.attrs.get("site", {})
    name = "latitude_deg"
    if name not in told and name not in given:
        raise ValueError(f'{name} is needed: the forcing does not know its place; site={{"{name}": ..}} does')
    wanted = given.get(name)
    if name in told and isinstance(wanted, Real) and abs(wanted - told[name]) > 1.0:
        raise ValueError(
            f"{name} = {float(wanted):g}: the forcing is of {told[name]:g}, and the sun has to be that of its place"
        )
    # of whole years, and then no more than where the search for the ground's balance begins: so within a site's limits
    found = climate_of(forcing["air_temperature_c"])
    for name, value in found.items():
        found[name] = min(max(value, SITE_PARAMETERS[name].physical_low), SITE_PARAMETERS[name].physical_high)
    return {**told, **found, **given}


def _check_part(days: int, output: str, overrides: dict) -> None:
    """Refuse what a part of a year does not have: annual values, and a climate."""
    if output == "annual":
        raise ValueError(f'output "annual": {days} days of forcing are no whole year; "daily" and "xarray" are allowed')
    lacking = [name for name in CLIMATE if name not in overrides]
    if lacking:
        raise ValueError(
            f"forcing: {days} days are no whole year, so the ground is spun up under the site's climate; "
            f"site= needs {' and '.join(lacking)}"
        )


def _with_boundary(site: dict, boundary) -> tuple[dict, object]:
    """The site with a boundary's temperature that is given as a number [degC], and how the boundary is found."""
    if isinstance(boundary, (bool, np.bool_)) or not isinstance(boundary, NUMBER):
        if not isinstance(boundary, str) or boundary not in BOUNDARIES:
            allowed = ", ".join(BOUNDARIES)
            raise ValueError(f"boundary {brief(boundary)}: allowed are {allowed}, and a temperature in degC")
        return site, boundary
    parameter = SITE_PARAMETERS[BOUNDARY]
    low, high = (limit - FREEZING_POINT_K for limit in (parameter.physical_low, parameter.physical_high))
    if not low <= boundary <= high:
        raise ValueError(f"boundary = {boundary:g}: a temperature in [{low:g}, {high:g}] degC, or a name, is allowed")
    if BOUNDARY in site:
        raise ValueError(f"boundary = {boundary:g}: the site has {BOUNDARY} too; one of them is allowed")
    return {**site, BOUNDARY: float(boundary) + FREEZING_POINT_K}, "sampled"


def _with_leaf_area(site: dict, lai, stand: Stands, seeds, stocks: dict) -> dict:
    """The site whose crowns have so many leaves that its first stand has this leaf area in full leaf."""
    if isinstance(lai, (bool, np.bool_)) or not isinstance(lai, NUMBER) or not 0.0 < lai <= 15.0:
        raise ValueError(f"lai = {lai!r}: a number in (0, 15] m2 m-2 is allowed")
    values = {**site, **stand.constants, **stand.mechanisms}
    state = first_state(values, np.random.default_rng(seeds.start), stocks, INITIAL_RANGES)
    covers = dict(zip(("max_lai_conifer", "max_lai_deciduous"), crown_covers(first_stems(state), values), strict=True))
    leaf = uncompiled(leaf_out)
    dates = ("growth_start_day", "growth_rate", "fall_start_day", "fall_rate")
    full = max(leaf(day, *(site[name] for name in dates)) for day in range(DAYS))
    out = {"max_lai_conifer": 1.0, "max_lai_deciduous": full}
    now = sum(site[name] * covers[name] * out[name] for name in covers)
    if now <= 0.0:
        raise ValueError(f"lai = {lai:g}: the first stand has no crowns; give stems by initial=")
    there = [name for name in covers if covers[name] > 0.0]
    most = min(SITE_PARAMETERS[name].physical_high / site[name] for name in there)
    least = max(SITE_PARAMETERS[name].physical_low / site[name] for name in there)
    if not least <= lai / now <= most:
        raise ValueError(
            f"lai = {lai:g}: crowns cover {sum(covers.values()):.2g} of the ground, so [{least * now:.2g}, "
            f"{most * now:.2g}] m2 m-2 is allowed; more or older stems in initial= cover more"
        )
    return site | {name: site[name] * (lai / now) for name in there}


def _table(values: np.ndarray, names, dates: pd.DatetimeIndex, days: int | None = None) -> pd.DataFrame:
    """A table with dates and units, a row a year or, where it is said how many a year has, a day."""
    table = pd.DataFrame(values, columns=names, index=dates)
    table[NET_EXCHANGE] = (
        table["autotrophic_respiration_kgc_m2"] + table["heterotrophic_respiration_kgc_m2"] - table["gpp_kgc_m2"]
    )
    if days is not None:
        table.insert(0, "doy", np.arange(len(table)) % days + 1)
    table.insert(0, "year", np.arange(len(table)) // (days or 1))
    described = (RECORD if days is None else DAILY) | ADDED
    table.attrs["units"] = {name: described[name][0] for name in table}
    return table


def _new_year(first: int, years: int) -> pd.DatetimeIndex:
    return pd.DatetimeIndex([f"{year}-01-01" for year in range(first, first + years)], name="time")


def _dates(first: int, years: int, days: int) -> pd.DatetimeIndex:
    """Every day of the years but 29 February, or so many days of the only year."""
    dates = pd.date_range(f"{first}-01-01", f"{first + years - 1}-12-31", name="time")
    return dates[~((dates.month == 2) & (dates.day == 29))][: years * days]
