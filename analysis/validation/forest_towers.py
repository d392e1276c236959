"""Monthly records of boreal forest towers: carbon fluxes and climate (ABCflux), evapotranspiration (FLUXNET2015)."""

import pandas as pd

from analysis.validation import towers

FAILED_G = 5.0  # gC m-2 month-1: a partitioning whose GPP or respiration is as negative as this has failed
UNDISTURBED_BEFORE = 1950
WARMEST_C = 2.0  # mean annual air temperature of a tower that is still near the sampled climate
ASPEN = "CA-Oas"  # the one deciduous forest among them, in the warmest of their climates


def carbon_fluxes() -> pd.DataFrame:
    """`gpp`, `reco`, `nee` (uptake negative) [gC m-2 day-1], `tair` [degC], `precip` [mm month-1] by site, year, month.

    ABCflux counts GPP negative and gives each month once per partitioning: rows of a failed one are left out, the rest
    averaged. NaN where nothing is left.
    """
    table = towers.read_table("ABCflux_boreal_forests_monthly.csv.gz")
    table["gpp"] = -table["gpp"]
    failed = (table["gpp"] < -FAILED_G) | (table["reco"] < -FAILED_G)
    table.loc[failed, ["gpp", "reco"]] = float("nan")
    keys = ["site", "year", "month"]
    months = table.groupby(keys)[["gpp", "reco", "nee", "tair", "precip"]].mean()
    days = pd.to_datetime(months.index.to_frame()[["year", "month"]].assign(day=1)).dt.days_in_month
    return months.assign(**{name: months[name] / days for name in ("gpp", "reco", "nee")})


def evapotranspiration() -> pd.Series:
    """Evapotranspiration [mm day-1] by site, year, month."""
    return towers.read_table("FLUXNET2015_boreal_forests_monthly.csv.gz").set_index(["site", "year", "month"])["ET"]


def courses(months: pd.DataFrame | pd.Series) -> pd.DataFrame | pd.Series:
    """Median over the years of each site and month, indexed by (site, month)."""
    return months.groupby(["site", "month"]).median()


def annual_sums() -> pd.DataFrame:
    """`gpp`, `reco`, `nee` [kgC m-2 yr-1] of each site near the sampled climate; NaN where a month is missing."""
    course = courses(carbon_fluxes())[["gpp", "reco", "nee"]]
    days = pd.Series({month: pd.Timestamp(2001, month, 1).days_in_month for month in range(1, 13)})
    sums = {name: (course[name].unstack() * days).sum(axis=1, skipna=False) / 1000.0 for name in course}
    return pd.DataFrame(sums).loc[near_climate()]


def mean_annual_temperature() -> pd.Series:
    """Mean annual air temperature [degC] of each site, from its calendar months; NaN if one is missing."""
    course = carbon_fluxes()["tair"].groupby(["site", "month"]).mean().unstack()
    return course.mean(axis=1).where(course.notna().all(axis=1))


def disturbance_years() -> pd.Series:
    """Year of each site's last recorded disturbance; NaN where the table has none."""
    table = towers.read_table("ABCflux_boreal_forests_monthly.csv.gz").drop_duplicates("site").set_index("site")
    return table["disturb_year"].astype("string").str.extract(r"(\d{4})")[0].astype(float)


def near_climate() -> list[str]:
    """Sites without a recorded disturbance since UNDISTURBED_BEFORE whose mean annual temperature is at most
    WARMEST_C."""
    since, temperature = disturbance_years(), mean_annual_temperature()
    return [site for site in since.index if not since[site] >= UNDISTURBED_BEFORE and temperature[site] <= WARMEST_C]
