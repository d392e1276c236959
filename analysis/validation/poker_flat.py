"""US-Prr, Poker Flat Research Range: black spruce on permafrost in interior Alaska, 2011-14.

The published fluxes are daily, so the weather that drives the simulator is disaggregated (`sim.half_hours`);
spring 2013 is also there in half-hours, and tells what that costs. Winter precipitation is ERA-Interim's: the gauge
catches half of it. `analysis/observations/README.md` has sources, licence and columns.
"""

import pandas as pd

from analysis.validation import towers
from sim.io import disaggregation

SITE = "US-Prr"
LATITUDE_DEG = 65.124
YEARS = (2011, 2012, 2013, 2014)
LARGEST_OFFSET_W_M2 = 10.0  # of a shortwave sensor at night
LEAST_SUN_W_M2 = 20.0  # mean of a day whose albedo can be told

SPRING = towers.Tower(
    site=SITE,
    file="US-Prr_2013_spring_halfhourly.csv.gz",
    latitude_deg=LATITUDE_DEG,
    longitude_deg=-147.488,
    utc_offset_h=-9.0,
    interval_minutes=30,
    time_column="timestamp",
    forcing={
        "air_temperature_c": ("ta_f", 1.0),
        "relative_humidity": ("rh_f", 0.01),
        "wind_speed_m_s": ("ws_f", 1.0),
        "shortwave_w_m2": ("rsd_f", 1.0),
        "longwave_w_m2": ("rld_f", 1.0),
    },
    fluxes={
        "latent_heat_w_m2": ("leflux_f", 1.0, "leflux_flag"),
        "sensible_heat_w_m2": ("hflux_f", 1.0, "hflux_flag"),
        "soil_34_cm_c": ("ts_3", 1.0, None),
        "soil_44_cm_c": ("ts_4", 1.0, None),
        "soil_54_cm_c": ("ts_5", 1.0, None),
        "snow_depth_cm": ("dsnow", 1.0, None),
    },
)

#: Our name -> (column, factor, column with the share that was measured; None: measured wherever present).
FLUXES = {
    "gpp_gc_m2": ("GPP_DT_VUT_REF", 1.0, "NEE_VUT_REF_QC"),
    "respiration_gc_m2": ("RECO_DT_VUT_REF", 1.0, "NEE_VUT_REF_QC"),
    "exchange_gc_m2": ("NEE_VUT_REF", 1.0, "NEE_VUT_REF_QC"),
    "latent_heat_w_m2": ("LE_F_MDS", 1.0, "LE_F_MDS_QC"),
    "sensible_heat_w_m2": ("H_F_MDS", 1.0, "H_F_MDS_QC"),
    "ground_heat_w_m2": ("G_F_MDS", 1.0, None),
    "soil_temperature_c": ("TS_F_MDS_1", 1.0, "TS_F_MDS_1_QC"),
}


def record() -> pd.DataFrame:
    """The daily record 2011-14 as published, with ERA-Interim's precipitation as P_ERA, indexed by date."""
    daily = _by_date("US-Prr_2011-2014_daily.csv.gz")
    return daily.join(era_interim()["P_ERA"])


def era_interim() -> pd.DataFrame:
    """ERA-Interim 1989-2014, debiased to the site by FLUXNET2015, indexed by date."""
    return _by_date("US-Prr_1989-2014_era_interim_daily.csv.gz")


def snow_off() -> pd.Series:
    """Day of year on which snow was gone, from the tower's albedo, by year."""
    return towers.read_table("US-Prr_snow_disappearance.csv").set_index("year")["doy"]


def daily_weather(daily: pd.DataFrame) -> pd.DataFrame:
    """The record's weather as `disaggregation.half_hours` takes it; precipitation of frosty days is ERA-Interim's."""
    frost = daily["TA_F"] < 0.0
    return pd.DataFrame(
        {
            "air_temperature_c": daily["TA_F"],
            "vapour_pressure_deficit_hpa": daily["VPD_F"],
            "wind_speed_m_s": daily["WS_F"],
            "shortwave_w_m2": without_offset(daily["SW_IN_F"]),
            "longwave_w_m2": daily["LW_IN_F"],
            "precipitation_mm": daily["P_F"].where(~frost, daily["P_ERA"]),
        }
    )


def forcing(measured_spring: bool = False) -> pd.DataFrame:
    """Half-hourly weather 2011-14 for `sim.simulate`; with `measured_spring`, March to May 2013 as measured."""
    spring = spring_weather()
    cycle = disaggregation.diurnal_cycle(spring["air_temperature_c"], spring["shortwave_w_m2"])
    weather = disaggregation.half_hours(daily_weather(record()), LATITUDE_DEG, cycle)
    if measured_spring:
        weather.loc[spring.index, list(spring)] = spring
    return weather


def spring_weather() -> pd.DataFrame:
    """Measured weather but precipitation of the whole days of March to May 2013, by local solar time."""
    weather = towers.forcing(towers.read(SPRING), SPRING)
    weather["shortwave_w_m2"] = without_offset(weather["shortwave_w_m2"])
    return _whole_days(weather)


def spring_fluxes() -> pd.DataFrame:
    """Fluxes, soil temperatures by depth below the moss surface, and snow depth in half-hours, spring 2013."""
    return _whole_days(towers.fluxes(towers.read(SPRING), SPRING))


def daily_fluxes(daily: pd.DataFrame) -> pd.DataFrame:
    """Measured fluxes a day, named and in units as by `towers.daily_fluxes`, 29 February dropped.

    Net radiation is the sum of its four components: the published NETRAD of 2011-13 differs from it by up to
    39 W m-2 in monthly means, that of 2014 by 4 on average.
    """
    fluxes = {}
    for name, (column, factor, share) in FLUXES.items():
        fluxes[name] = factor * daily[column]
        fluxes[f"{name}_measured"] = (daily[share] if share else 1.0) * daily[column].notna()
    radiation = daily["SW_IN_F"] - daily["SW_OUT"] + daily["LW_IN_F"] - daily["LW_OUT"]
    fluxes["net_radiation_w_m2"] = radiation
    fluxes["net_radiation_w_m2_measured"] = daily[["SW_IN_F_QC", "LW_IN_F_QC"]].min(axis=1) * radiation.notna()
    lit = daily["SW_IN_F"] > LEAST_SUN_W_M2
    fluxes["albedo"] = (daily["SW_OUT"] / daily["SW_IN_F"]).where(lit)
    fluxes["albedo_measured"] = daily["SW_IN_F_QC"] * fluxes["albedo"].notna()
    leap_day = (daily.index.month == 2) & (daily.index.day == 29)
    return pd.DataFrame(fluxes)[~leap_day]


def without_offset(shortwave: pd.Series) -> pd.Series:
    """Shortwave with the sensor's negative offset at night set to 0. Raises ValueError for a larger one."""
    if shortwave.min() < -LARGEST_OFFSET_W_M2:
        raise ValueError(f"shortwave of {shortwave.min():g} W/m2 on {shortwave.idxmin()}: more than a sensor's offset")
    return shortwave.where(shortwave > 0.0, 0.0)


def _by_date(file: str) -> pd.DataFrame:
    table = towers.read_table(file)
    return table.set_index(pd.to_datetime(table.pop("TIMESTAMP").astype(str)).rename("date"))


def _whole_days(table: pd.DataFrame) -> pd.DataFrame:
    count = table.index.normalize().value_counts()
    return table[table.index.normalize().isin(count.index[count == disaggregation.STEPS_PER_DAY])]
