"""What chronosequences, inventories and towers say of stands by age: one table, and ranges from it.

The values of `analysis/observations/stand_development.csv`, and GPP and NEP of the towers whose stand's year of origin
is known. A range at an age is that of all stands about as old.
"""

import numpy as np
import pandas as pd

from analysis.validation import forest_towers, towers
from analysis.validation.scores import Band

NEAR = 0.2  # a stand counts for an age if its own differs by no more than this share
SLACK = 0.25  # of a value: what plots of a stand, allometry and roots leave open
SLACK_NEP = 0.03  # kgC m-2 yr-1
WINTER_GPP = 0.05  # share of the year's GPP in December to February beyond which a record's gaps were filled wrongly
DECIDUOUS_TOWERS = (forest_towers.ASPEN,)
MIXED_TOWERS = ("US-Rpf",)  # birch, aspen and willow among spruce seedlings


def observed() -> pd.DataFrame:
    """All observations: species, stand, age_low, age_high [yr], quantity, low, high, unit, source.

    Raises ValueError for a row whose age or value is reversed, or whose quantity has a second unit.
    """
    table = towers.read_table("stand_development.csv")
    for low, high in (("age_low", "age_high"), ("low", "high")):
        wrong = ~(table[low] <= table[high])
        if wrong.any():
            row = table[wrong].iloc[0]
            raise ValueError(f"stand_development.csv, {row.stand}: {low} {row[low]} has to be at most {row[high]}")
    units = table.groupby("quantity").unit.nunique()
    if (units > 1).any():
        raise ValueError(f"stand_development.csv: {units.idxmax()} has more than one unit")
    return pd.concat([table.drop(columns="read"), tower_years()], ignore_index=True)


def tower_years() -> pd.DataFrame:
    """Mean annual GPP and NEP of towers over stands of known age, rows as in `observed`.

    A year is the sum of the twelve calendar months' means; the age is that in the record's middle year. Towers warmer
    than `forest_towers.WARMEST_C` are left out, mixed stands, and those that lack a month or photosynthesise in winter.
    """
    origin = year_of_origin()
    warmth = forest_towers.mean_annual_temperature()
    months = forest_towers.carbon_fluxes().reset_index()
    days = pd.to_datetime(months[["year", "month"]].assign(day=1)).dt.days_in_month
    months["GPP"], months["NEP"] = 1e-3 * months["gpp"] * days, -1e-3 * months["nee"] * days
    rows = []
    for site, record in months[months.site.isin(origin.index)].groupby("site"):
        course = record.groupby("month")[["GPP", "NEP"]].mean()
        complete = len(course) == 12 and course.notna().all(axis=None)
        winter = course.GPP.reindex([12, 1, 2]).sum() > WINTER_GPP * course.GPP.sum()
        if site in MIXED_TOWERS or warmth[site] > forest_towers.WARMEST_C or not complete or winter:
            continue
        age = float(record.year.unique().mean() - origin[site])
        for quantity, value in course.sum().items():
            rows.append((_species(site), site, age, age, quantity, value, value, "kgC m-2 yr-1"))
    columns = ["species", "stand", "age_low", "age_high", "quantity", "low", "high", "unit"]
    return pd.DataFrame(rows, columns=columns).assign(source="ABCflux")


def year_of_origin() -> pd.Series:
    """Year in which the stands of towers burned or were cut, for those of which it is known exactly."""
    table = towers.read_table("ABCflux_boreal_forests_monthly.csv.gz").drop_duplicates("site").set_index("site")
    return pd.to_numeric(table["disturb_year"], errors="coerce").dropna()


def _species(site: str) -> str:
    return "deciduous" if site in DECIDUOUS_TOWERS else "conifer"


def band(table: pd.DataFrame, species: str, quantity: str, age: float) -> Band | None:
    """Range of what was observed about this age, wider by the slack at both ends; None if nothing was."""
    near = about(table, species, quantity, age)
    if near.empty:
        return None
    low, high = float(near.low.min()), float(near.high.max())
    if quantity == "NEP":
        return Band(low - SLACK_NEP, high + SLACK_NEP)
    return Band((1.0 - SLACK) * low, (1.0 + SLACK) * high)


def about(table: pd.DataFrame, species: str, quantity: str, age: float) -> pd.DataFrame:
    """Rows of stands about this old, by their nearest age."""
    nearest = np.clip(age, table.age_low, table.age_high)
    near = (nearest - age).abs() <= NEAR * age
    return table[near & (table.species == species) & (table.quantity == quantity)]
