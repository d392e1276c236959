"""Records of flux towers: weather to drive the simulator with, and measured fluxes to compare it with.

The published records are in `analysis/observations`, with their sources and licences in its README. Time is
turned into local mean solar time, in which the simulator's sun stands highest at 12:00. Gaps in the weather
are an error: no value is invented here. Gaps in the fluxes stay, with a flag for what was measured.
"""

import gzip
from dataclasses import dataclass
from importlib.resources import files

import pandas as pd

FORCING_COLUMNS = (
    "air_temperature_c",
    "relative_humidity",  # 0-1, over water
    "wind_speed_m_s",
    "shortwave_w_m2",
    "longwave_w_m2",
    "precipitation_mm",  # of the interval
)
CARBON_G_PER_UMOL = 12.011e-6


@dataclass(frozen=True)
class Tower:
    """A tower's record: where it is, how its columns are called, and what turns them into our units."""

    site: str
    file: str
    latitude_deg: float
    longitude_deg: float
    utc_offset_h: float
    interval_minutes: int
    time_column: str
    """Time stamps at the end of each interval."""
    forcing: dict[str, tuple[str, float]]
    """Our name -> (column, factor), in the order of FORCING_COLUMNS."""
    fluxes: dict[str, tuple[str, float, str | None]]
    """Our name -> (column, factor, flag column that is 0 where measured; None: measured wherever present)."""


SE_SVB = Tower(
    site="SE-Svb",
    file="SE-Svb_2019_halfhourly.csv.gz",
    latitude_deg=64.256,
    longitude_deg=19.774,
    utc_offset_h=1.0,
    interval_minutes=30,
    time_column="time_utc+1",
    forcing={
        "air_temperature_c": ("Tair_C", 1.0),
        "relative_humidity": ("RH_pct", 0.01),
        "wind_speed_m_s": ("U_ms", 1.0),
        "shortwave_w_m2": ("SWin_Wm2", 1.0),
        "longwave_w_m2": ("LWin_Wm2", 1.0),
        "precipitation_mm": ("Precip_mm_30min", 1.0),
    },
    fluxes={
        "gpp_gc_m2": ("GPP_umol", CARBON_G_PER_UMOL * 1800.0, "NEE_flag"),
        "respiration_gc_m2": ("Reco_umol", CARBON_G_PER_UMOL * 1800.0, "NEE_flag"),
        "exchange_gc_m2": ("NEE_umol", CARBON_G_PER_UMOL * 1800.0, "NEE_flag"),
        "latent_heat_w_m2": ("LE", 1.0, "LE_flag"),
        "sensible_heat_w_m2": ("H", 1.0, "H_flag"),
        "net_radiation_w_m2": ("Rnet", 1.0, None),
        "net_shortwave_w_m2": ("SWnet", 1.0, None),
        "ground_heat_w_m2": ("G", 1.0, None),
        "soil_temperature_c": ("Tsoil5cm_C", 1.0, "Tsoil_flag"),
    },
)


def read_table(file: str) -> pd.DataFrame:
    """A table of `analysis/observations`, packed or not, column for column."""
    path = files("analysis") / "observations" / file
    with path.open("rb") as raw:
        return pd.read_csv(gzip.open(raw) if file.endswith(".gz") else raw)


def read(tower: Tower) -> pd.DataFrame:
    """The published record, column for column, indexed by its time stamps."""
    table = read_table(tower.file)
    return table.set_index(pd.to_datetime(table.pop(tower.time_column)))


def forcing(record: pd.DataFrame, tower: Tower) -> pd.DataFrame:
    """The weather of a record, as `sim.simulate(forcing=...)` takes it.

    Returns a row per interval, indexed by the local mean solar time at which it begins, with those FORCING_COLUMNS
    that the tower has: means of the interval in degC, 1, m s-1 and W m-2, and its precipitation in mm. 29 February is
    dropped.
    Raises ValueError, naming column and time, for a missing value or interval.
    """
    record = _at_solar_time(record, tower)
    columns = tower.forcing.items()
    weather = pd.DataFrame({name: factor * record[column] for name, (column, factor) in columns})
    for name in weather:
        missing = weather.index[weather[name].isna()]
        if len(missing):
            raise ValueError(
                f"{tower.site}: {name} is missing at {missing[0]:%Y-%m-%d %H:%M}"
                f" ({len(missing)} intervals in all); a forcing has to be without gaps"
            )
    return weather


def fluxes(record: pd.DataFrame, tower: Tower) -> pd.DataFrame:
    """The measured fluxes of a record, indexed like `forcing`.

    Gross primary production, ecosystem respiration and net exchange (uptake negative) in gC m-2 per interval; heat
    fluxes and radiation in W m-2; temperatures in degC. For each `<name>` a boolean `<name>_measured`: False where the
    value is missing or was gap-filled by the station.
    """
    record = _at_solar_time(record, tower)
    measured = {}
    for name, (column, factor, flag) in tower.fluxes.items():
        measured[name] = factor * record[column]
        measured[f"{name}_measured"] = record[column].notna() & (True if flag is None else record[flag] == 0)
    return pd.DataFrame(measured)


def daily_fluxes(fluxes: pd.DataFrame) -> pd.DataFrame:
    """A record's fluxes by the day: carbon in gC m-2 day-1, the rest means; `<name>_measured` is the measured share.

    NaN where an interval of the day is missing.
    """
    days = fluxes.groupby(fluxes.index.normalize())
    complete = days.count() == days.size().iloc[0]
    daily = days.mean().where(complete)
    carbon = [name for name in fluxes if name.endswith("gc_m2")]
    daily[carbon] = days[carbon].sum().where(complete[carbon])
    return daily


def _at_solar_time(record: pd.DataFrame, tower: Tower) -> pd.DataFrame:
    """The record by the local mean solar time at which each interval begins, to the nearest interval."""
    interval = tower.interval_minutes
    ahead_of_clock = 60.0 * (tower.longitude_deg / 15.0 - tower.utc_offset_h)
    shift = interval * round((ahead_of_clock - interval) / interval)
    expected = pd.date_range(record.index[0], record.index[-1], freq=f"{interval}min")
    if not record.index.equals(expected):
        wrong = expected.difference(record.index)
        what = f"is missing at {wrong[0]:%Y-%m-%d %H:%M}" if len(wrong) else "has times twice or out of order"
        raise ValueError(f"{tower.site}: the record {what}; an interval every {interval} minutes is needed")
    start = (record.index + pd.Timedelta(minutes=shift)).rename("time")
    leap_day = (start.month == 2) & (start.day == 29)
    return record.set_axis(start)[~leap_day]
