"""Fluxes of the simulator under a tower's weather, day by day beside the measured ones.

A day counts if at least half of it was measured, where the record says so, and none of it is missing; a month if it has
five such days. Carbon is in gC m-2 day-1, heat in W m-2, temperature in degC.
"""

import calendar
import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

import sim
from analysis.validation import document
from analysis.validation.document import Miss, number
from analysis.validation.scores import Skill, skill
from analysis.validation.tower_stands import TowerStand
from boreal_env import NO_CHANGE
from sim.physical_constants import MJ_PER_DAY

MEASURED_SHARE = 0.5
FEWEST_DAYS = 5
SNOW_GONE_MM = 1.0
SPRING_ENDS = 212
DAYS_OF_SNOW_OFF = 7.0


@dataclass(frozen=True)
class Quantity:
    """What is compared: unit, column measured, columns modelled (their sum, less those of `less`) and their factor, and
    the bias and the RMSE of the months that count as a miss, in the unit or as shares of the measured months' mean
    magnitude."""

    unit: str
    measured: str
    modelled: tuple[str, ...]
    factor: float = 1.0
    tolerance: float = 0.2
    relative: bool = True
    digits: int = 1
    less: tuple[str, ...] = ()
    largest_rmse: float = 0.5


RESPIRATION = ("autotrophic_respiration_kgc_m2", "heterotrophic_respiration_kgc_m2")
QUANTITIES = {
    "GPP": Quantity("gC m-2 day-1", "gpp_gc_m2", ("gpp_kgc_m2",), 1000.0, digits=2),
    "ecosystem respiration": Quantity("gC m-2 day-1", "respiration_gc_m2", RESPIRATION, 1000.0, digits=2),
    "net exchange": Quantity("gC m-2 day-1", "exchange_gc_m2", RESPIRATION, 1000.0, digits=2, less=("gpp_kgc_m2",)),
    "latent heat": Quantity("W m-2", "latent_heat_w_m2", ("latent_heat_mj_m2",), 1.0 / MJ_PER_DAY),
    "sensible heat": Quantity("W m-2", "sensible_heat_w_m2", ("sensible_heat_mj_m2",), 1.0 / MJ_PER_DAY),
    "net radiation": Quantity("W m-2", "net_radiation_w_m2", ("net_radiation_mj_m2",), 1.0 / MJ_PER_DAY),
    "ground heat": Quantity("W m-2", "ground_heat_w_m2", ("ground_heat_mj_m2",), 1.0 / MJ_PER_DAY),
    "soil temperature": Quantity(
        "degC", "soil_temperature_c", ("soil_top_temperature_c",), tolerance=1.0, relative=False, largest_rmse=2.0
    ),
    "albedo": Quantity("1", "albedo", ("albedo",), tolerance=0.03, relative=False, digits=3, largest_rmse=math.inf),
}


def simulate(
    stand: TowerStand, forcing: pd.DataFrame, index: pd.DatetimeIndex, repeats: int, output: str = "daily"
) -> pd.DataFrame:
    """Output for the days, or years, `index` of the forcing's years, after running through them `repeats` - 1 times."""
    years = len(forcing.index.year.unique())
    table = sim.simulate(
        stand.site,
        NO_CHANGE,
        seed=0,
        years=repeats * years,
        forcing=forcing,
        initial=stand.initial,
        constants=stand.constants,
        lai=stand.lai,
        output=output,
    )
    return table[table["year"] >= (repeats - 1) * years].set_index(index)


def pair(fluxes: pd.DataFrame, modelled: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Per quantity a row a day: `measured`, `modelled`, and whether the day `counts`."""
    days = {}
    for name, q in QUANTITIES.items():
        values = modelled[list(q.modelled)].sum(axis=1, min_count=1) - modelled[list(q.less)].sum(axis=1)
        counts = (fluxes[f"{q.measured}_measured"] >= MEASURED_SHARE) & fluxes[q.measured].notna()
        days[name] = pd.DataFrame({"measured": fluxes[q.measured], "modelled": q.factor * values, "counts": counts})
    return days


def by_month(days: pd.DataFrame) -> pd.DataFrame:
    """Mean `measured` and `modelled` of the days that count and their number `days`, by (year, month); NaN for a month
    with fewer than FEWEST_DAYS."""
    counted = days[days["counts"]].dropna()
    groups = counted.groupby([counted.index.year, counted.index.month])
    number_of_days = groups.size()
    months = groups[["measured", "modelled"]].mean().where(number_of_days >= FEWEST_DAYS)
    return months.assign(days=number_of_days).rename_axis(["year", "month"])


def scores(days: pd.DataFrame) -> tuple[Skill, Skill]:
    """Skill of the months and of the days."""
    months, counted = by_month(days), days[days["counts"]]
    return skill(months["modelled"], months["measured"]), skill(counted["modelled"], counted["measured"])


def climatology(days: pd.DataFrame) -> pd.DataFrame:
    """`measured` and `modelled` by calendar month, each the mean of the years' months that count, 1 to 12."""
    return by_month(days)[["measured", "modelled"]].groupby("month").mean().reindex(range(1, 13))


def misses(name: str, days: pd.DataFrame) -> bool:
    """Whether bias or RMSE of the months is beyond the quantity's tolerance."""
    q, months = QUANTITIES[name], by_month(days)
    scale = months["measured"].dropna().abs().mean() if q.relative else 1.0
    agreement = scores(days)[0]
    return abs(agreement.bias) > q.tolerance * scale or agreement.rmse > q.largest_rmse * scale


def skill_table(compared: dict[str, pd.DataFrame], unjudged: tuple[str, ...] = ()) -> str:
    """Markdown: bias, RMSE and correlation of months and days, the worst calendar month, the verdict if there is
    one."""
    rows = []
    for name, days in compared.items():
        q, (months, single) = QUANTITIES[name], scores(days)
        course = climatology(days)
        worst = (course["modelled"] - course["measured"]).abs().idxmax()
        gap = course.loc[worst, "modelled"] - course.loc[worst, "measured"]
        cells = [f"{name} [{q.unit}]", number(by_month(days)["measured"].mean(), q.digits)]
        for s in (months, single):
            cells += [number(s.bias, q.digits, sign=True), number(s.rmse, q.digits), number(s.r, 2), str(s.pairs)]
        cells += [f"{calendar.month_abbr[worst]} {number(gap, q.digits, sign=True)}"]
        verdict = "**MISS**" if misses(name, days) else "in"
        rows.append([*cells, "none" if name in unjudged else verdict])
    header = [
        "",
        "measured",
        "months: bias",
        "RMSE",
        "r",
        "n",
        "days: bias",
        "RMSE",
        "r",
        "n",
        "worst month",
        "verdict",
    ]
    return document.table(header, rows)


def course_table(compared: dict[str, pd.DataFrame]) -> str:
    """Markdown: measured and modelled by calendar month."""
    rows = []
    for name, days in compared.items():
        q, course = QUANTITIES[name], climatology(days)
        for kind in ("measured", "modelled"):
            rows.append([f"{name}, {kind} [{q.unit}]", *(number(value, q.digits) for value in course[kind])])
    return document.table(["", *calendar.month_abbr[1:]], rows)


def find_misses(site: str, compared: dict[str, pd.DataFrame], likely: dict[str, str]) -> list[Miss]:
    """Every quantity whose bias or RMSE misses, with the likely process."""
    found = []
    for name, days in compared.items():
        if misses(name, days):
            q, months = QUANTITIES[name], by_month(days)
            agreement = scores(days)[0]
            unit = "" if q.unit == "1" else f" {q.unit}"
            what = f"{name}: bias of months {number(agreement.bias, q.digits, sign=True)}{unit}"
            what += f", RMSE {number(agreement.rmse, q.digits)}" if math.isfinite(q.largest_rmse) else ""
            what += f", measured {number(months['measured'].mean(), q.digits)}"
            found.append(Miss(site, what, likely.get(name, "not known")))
    return found


def energy_closure(fluxes: pd.DataFrame, months: tuple[int, ...] = tuple(range(1, 13))) -> float:
    """(H + LE) / (Rn - G) over days of these months on which all four were measured."""
    turbulent, available = _balance(fluxes[fluxes.index.month.isin(months)])
    return turbulent.sum() / available.sum()


def energy_offset(fluxes: pd.DataFrame) -> tuple[float, int]:
    """Mean of Rn - G - H - LE [W m-2] over the days on which all four were measured, and their number."""
    turbulent, available = _balance(fluxes)
    return (available - turbulent).mean(), len(available)


def _balance(fluxes: pd.DataFrame) -> tuple[pd.Series, pd.Series]:
    """H + LE and Rn - G of the days on which all four were measured."""
    names = ("sensible_heat_w_m2", "latent_heat_w_m2", "net_radiation_w_m2", "ground_heat_w_m2")
    complete = (fluxes[[f"{name}_measured" for name in names]] >= MEASURED_SHARE).all(axis=1)
    complete &= fluxes[list(names)].notna().all(axis=1)
    h, le, rn, g = (fluxes.loc[complete, name] for name in names)
    return h + le, rn - g


def summer_evaporative_fraction(compared: dict[str, pd.DataFrame], parity: int | None = None) -> tuple[float, float]:
    """LE / (LE + H) of June to August, measured and modelled: a ratio that does not depend on closure.

    parity : 0 for the even days of the months alone, 1 for the odd ones.
    """
    latent, sensible = compared["latent heat"], compared["sensible heat"]
    summer = latent["counts"] & sensible["counts"] & latent.index.month.isin([6, 7, 8])
    if parity is not None:
        summer &= latent.index.day % 2 == parity
    latent, sensible = (days.loc[summer, ["measured", "modelled"]].sum() for days in (latent, sensible))
    fraction = latent / (latent + sensible)
    return fraction["measured"], fraction["modelled"]


def melt_out(swe: np.ndarray) -> int:
    """Day of year on which winter's snowpack is gone: the first bare one after its peak; swe : a year of days [mm].

    The annual record's `snow_off_doy` also counts snow that falls on bare ground in May. 0 if nothing lies in spring.
    """
    spring = swe[:SPRING_ENDS]
    peak = int(spring.argmax())
    bare = np.flatnonzero(spring[peak:] <= SNOW_GONE_MM)
    return peak + int(bare[0]) + 1 if len(bare) and bare[0] > 0 else 0
