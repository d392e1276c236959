"""The scientist's door: one stand, given actions, generated or observed weather, a table out."""

import numpy as np
import pandas as pd

from sim.draws import episode_seeds
from sim.management import check_actions
from sim.parameters import middle_site
from sim.spin_up import check_initial
from sim.stands import Stands
from sim.state import DAILY_NAMES, DAYS, FORCING, RECORD_NAMES

#: Allowed values of an observed forcing: column -> (low, high, unit, hint).
FORCING_LIMITS = {
    "air_temperature_c": (-75.0, 50.0, "degC", "is it in kelvin?"),
    "relative_humidity": (0.0, 1.1, "share of 1", "is it in percent?"),
    "wind_speed_m_s": (0.0, 60.0, "m s-1", ""),
    "shortwave_w_m2": (0.0, 1500.0, "W m-2", "negative night offsets have to be set to 0"),
    "longwave_w_m2": (50.0, 600.0, "W m-2", ""),
    "precipitation_mm": (0.0, 200.0, "mm per interval", ""),
}


def simulate(
    site,
    actions,
    *,
    seed,
    years=50,
    time_step_minutes=30,
    backend="numba",
    forcing=None,
    initial=None,
    output="annual",
    constants=None,
    mechanisms=None,
    weather="paper",
    boundary="sampled",
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
    actions : integer in [0, 25) for every year, or a sequence with one a year; 12 changes nothing.
    seed : of first state, weather and disturbances.
    years : years to run.
    forcing : observed weather instead of the generator: DataFrame with a regular DatetimeIndex of local solar time
        (start of the interval, from midnight) and the columns air_temperature_c [degC], relative_humidity [0-1, over
        water], wind_speed_m_s, shortwave_w_m2, longwave_w_m2 [W m-2], precipitation_mm [mm per interval]. Whole
        years of 365 days (29 February is dropped), repeated if there are fewer than `years`; or, with years=1,
        whole days of a part of a year that starts on 1 January. Intervals finer than the time step are averaged.
    initial : first stocks by name: density_stems_ha, conifer_fraction, biomass_kgc_m2, soil_kgc_m2,
        conifer_deadwood_kgc_m2, deciduous_deadwood_kgc_m2, hwp_kgc_m2, organic_layer_m, oldest_age_years, or stems by
        class (conifer_mature_stems_ha, ...); the rest is drawn, but for the stems' age, which follows from biomass and
        density, and for dead wood, which is what the stand's deaths keep up, where they are not given.
    output : "annual" for one row a year (columns `sim.state.RECORD`), "daily" for one row a day (`sim.state.DAILY`).
    scenario : climate change, see `sim.Stands`; not with `forcing`, which is weather of its own.
    constants, mechanisms, weather, boundary, soil_carbon, hwp_half_life_years, harvest_min_class, time_step_minutes,
    backend : see `sim.Stands`.

    Returns
    -------
    pandas.DataFrame, with a column `year` (from 0) and, daily, `doy` (from 1).

    Raises
    ------
    ValueError for bad input, naming the value and what is allowed; `sim.PhysicsError` if a balance does not close.
    """
    if output not in ("annual", "daily"):
        raise ValueError(f"output {output!r}: allowed are annual, daily")
    if isinstance(years, bool) or not isinstance(years, (int, np.integer)) or years < 1:
        raise ValueError(f"years: a positive integer is allowed, got {years!r}")
    per_year = np.full(years, actions) if np.ndim(actions) == 0 else np.asarray(actions)
    check_actions(per_year, years)
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
        stand.scenario.check_years(int(years))
    observed, days = None, DAYS
    if forcing is not None:
        observed, days = check_forcing(forcing, time_step_minutes, int(years))
    first_weather = None if observed is None else observed[0]
    stand.start(0, [middle_site(site)], [episode_seeds(seed)], {0: check_initial(initial)}, observed=first_weather)

    tables = []
    for year in range(years):
        weather = None if observed is None else observed[year % len(observed)]
        record, daily = stand.step(per_year[year : year + 1], observed=weather, days=days, daily=True)
        if output == "annual":
            table = pd.DataFrame(record, columns=RECORD_NAMES)
        else:
            table = pd.DataFrame(daily[0], columns=DAILY_NAMES)
            table.insert(0, "doy", np.arange(1, days + 1))
        table.insert(0, "year", year)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def check_forcing(forcing: pd.DataFrame, time_step_minutes: int, years: int) -> tuple[list[np.ndarray], int]:
    """Observed weather as one array (days x steps a day, 6) a year, and the days a year.

    Raises ValueError that names the column, the time and what is allowed.
    """
    if not isinstance(forcing, pd.DataFrame) or not isinstance(forcing.index, pd.DatetimeIndex):
        raise ValueError("forcing: a DataFrame with a DatetimeIndex is allowed")
    missing = [name for name in FORCING if name not in forcing]
    if missing:
        raise ValueError(f"forcing: column {missing[0]} is missing; needed: {', '.join(FORCING)}")
    index = forcing.index
    if len(index) < 2:
        raise ValueError(f"forcing: {len(index)} rows; whole days at a regular interval are allowed")
    interval = index[1] - index[0]
    minutes = interval / pd.Timedelta(minutes=1)
    if minutes <= 0:
        raise ValueError(f"forcing: times do not increase at {index[1]}")
    late = index[1:][np.diff(index.to_numpy()) != interval.to_timedelta64()]
    for time in late:
        leap_day_dropped = (time.month, time.day, time.hour, time.minute) == (3, 1, 0, 0) and time.is_leap_year
        if not leap_day_dropped or time - interval - pd.Timedelta(days=1) not in index:
            raise ValueError(f"forcing: times are not regular at {time}; fill the gap or drop the year")
    if time_step_minutes % minutes:
        raise ValueError(
            f"time_step_minutes = {time_step_minutes}: the forcing comes every {minutes:g} minutes; "
            "the same or a multiple is allowed"
        )
    kept = forcing.loc[~((index.month == 2) & (index.day == 29)), list(FORCING)]
    for name, (low, high, unit, hint) in FORCING_LIMITS.items():
        if not pd.api.types.is_numeric_dtype(kept[name]):
            raise ValueError(f"forcing: {name} has type {kept[name].dtype}; numbers are allowed")
        values = kept[name].to_numpy(float)
        wrong = ~((values >= low) & (values <= high))
        if wrong.any():
            at = kept.index[wrong][0]
            value = values[wrong][0]
            what = "a gap" if np.isnan(value) else f"{value:g}"
            why = f" ({hint})" if hint and not np.isnan(value) else ""
            raise ValueError(f"forcing: {name} is {what} at {at}; [{low:g}, {high:g}] {unit} is allowed{why}")
    if (kept.index[0].month, kept.index[0].day, kept.index[0].hour, kept.index[0].minute) != (1, 1, 0, 0):
        raise ValueError(f"forcing starts at {kept.index[0]}; it has to start at 00:00 of 1 January")
    per_day = 1440 / minutes
    days = len(kept) / per_day
    if days % 1 or (days > DAYS and days % DAYS) or (days < DAYS and years > 1):
        raise ValueError(f"forcing of {days:g} days: whole years of 365 days, or whole days with years=1, are allowed")
    group = int(time_step_minutes // minutes)
    values = kept.to_numpy(float).reshape(-1, group, len(FORCING))
    steps = values.mean(axis=1)
    steps[:, FORCING.index("precipitation_mm")] *= group
    days = int(min(days, DAYS))
    by_year = steps.reshape(-1, days * 1440 // time_step_minutes, len(FORCING))
    return [np.ascontiguousarray(year) for year in by_year], days
