"""Drive the simulator with a flux tower's weather and compare its fluxes with the measured ones.

    python analysis/validate.py --site SE-Svb

prints gross primary production, latent heat and net radiation of every month, modelled beside measured,
with bias, RMSE and correlation of months and days, and writes a figure and the monthly table to
results/validation. No parameter was fitted to the record: stand and site are from the literature, below.
"""
import calendar
import io
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd

import sim
from analysis import protocol, towers

MJ_PER_DAY = 0.0864  # MJ m-2 day-1 of 1 W m-2
NO_CHANGE = 10  # action 5 * 2 + 0: density index 2 leaves the stand alone
MEASURED_SHARE = 0.5  # of a day's half-hours, for the day to count; the station's gap filling does the rest
FEWEST_DAYS = 5  # for a month to count

#: Name -> (unit of a month, column of the tower, column of the simulator, factor to the tower's daily unit)
QUANTITIES = {
    "GPP": ("gC m-2 month-1", "gpp_gc_m2", "gpp_kgc_m2", 1000.0),
    "latent heat": ("W m-2", "latent_heat_w_m2", "latent_heat_mj_m2", 1.0 / MJ_PER_DAY),
    "net radiation": ("W m-2", "net_radiation_w_m2", "net_radiation_mj_m2", 1.0 / MJ_PER_DAY),
    "sensible heat": ("W m-2", "sensible_heat_w_m2", "sensible_heat_mj_m2", 1.0 / MJ_PER_DAY),
}
PRINTED = ("GPP", "latent heat", "net radiation")


@dataclass(frozen=True)
class Stand:
    """What grows at a tower: overrides of the site's parameters, and the stocks to start from."""

    site: dict[str, float]
    initial: dict[str, float]


STANDS = {
    # Inventory of 2018 (ICOS Sweden, station page of Svartberget): 535 spruces, 415 pines and 112 birches per
    # hectare, about 100 years old, basal area 29.3 m2/ha, top height 20 m.
    "SE-Svb": Stand(
        site={
            "latitude_deg": 64.256,
            # The record's own annual wave; no permafrost: the soil at 5 cm was 4.2 degC on average.
            "mean_annual_temperature_c": 2.5,
            "seasonal_amplitude_c": 11.3,
            "deep_boundary_temperature_k": 277.4,
            # Needles of the mean stem of each species, 17-21 cm thick and 17 m tall (Marklund 1988), with the
            # specific leaf areas of Harkonen et al. (2015), give the conifers a leaf area of 5.
            "max_lai_conifer": 5.0,
            # The stand stays the one of the inventory while soil and snow come into balance.
            "natural_mortality": 0.0,
            "density_dependent_mortality": 0.0,
            "recruitment_rate": 0.0,
            "fire_base_probability": 0.0,
            "insect_base_probability": 0.0,
        },
        initial={
            "conifer_mature_stems_ha": 950.0,
            "deciduous_mature_stems_ha": 112.0,
            # Marklund (1988), roots by Petersson and Stahl (2006), at the same stems; half of it is carbon.
            "biomass_kgc_m2": 8.7,
            # Assumed: organic layer and mineral soil of a podzol on till, 6-10; no flux compared hangs on it.
            "soil_kgc_m2": 8.0,
        },
    ),
}


@dataclass
class Args:
    """Drive the simulator with a flux tower's weather and compare its fluxes with the measured ones."""

    site: str = "SE-Svb"
    """tower whose record is used: SE-Svb (Svartberget, northern Sweden, pine and spruce, 2019)"""
    years: int = 6
    """years to simulate under the same weather; the last, with soil and snow in balance, is compared"""
    output_dir: Path = Path("results/validation")
    """folder for SITE.png (daily course) and SITE.csv (the monthly table)"""


def simulate(tower: towers.Tower, stand: Stand, forcing: pd.DataFrame, years: int) -> pd.DataFrame:
    """The simulator's last year under the tower's weather, a row a day."""
    daily = sim.simulate(
        stand.site,
        NO_CHANGE,
        seed=0,
        years=years,
        time_step_minutes=tower.interval_minutes,
        forcing=forcing,
        initial=stand.initial,
        output="daily",
    )
    return daily[daily["year"] == daily["year"].max()]


def compare(fluxes: pd.DataFrame, modelled: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Per quantity a row a day: `measured`, `modelled` and whether the day `counts`.

    A day counts if at least MEASURED_SHARE of its half-hours were measured and none of the rest is missing.
    """
    day = fluxes.index.normalize()
    days = {}
    for name, (_, column, simulated, factor) in QUANTITIES.items():
        by_day = fluxes[column].groupby(day)
        measured = by_day.sum() if column.startswith("gpp") else by_day.mean()
        complete = by_day.count() == by_day.size()
        enough = fluxes[f"{column}_measured"].groupby(day).mean() >= MEASURED_SHARE
        days[name] = pd.DataFrame({"measured": measured, "counts": complete & enough})
        days[name]["modelled"] = factor * modelled[simulated].to_numpy()
    return days


def by_month(days: pd.DataFrame, unit: str) -> pd.DataFrame:
    """Months 1-12 with `measured` and `modelled` over the days that count, and their number `days`.

    Means of the days, times the month's length where the unit is per month; NaN for a month with fewer than
    FEWEST_DAYS days.
    """
    counted = days[days["counts"]]
    months = counted.groupby(counted.index.month)[["measured", "modelled"]].mean().reindex(range(1, 13))
    number = counted.groupby(counted.index.month).size().reindex(range(1, 13), fill_value=0)
    if unit.endswith("month-1"):
        months = months.mul(_month_lengths(), axis=0)
    return months.where(number >= FEWEST_DAYS).assign(days=number)


def skill(pairs: pd.DataFrame) -> dict[str, float]:
    """Bias (modelled less measured), root mean square error and Pearson correlation of the complete pairs."""
    pairs = pairs.dropna()
    error = pairs["modelled"] - pairs["measured"]
    return {
        "bias": error.mean(),
        "RMSE": np.sqrt((error**2).mean()),
        "r": pairs["modelled"].corr(pairs["measured"]),
    }


def energy_closure(fluxes: pd.DataFrame) -> float:
    """Turbulent heat over available energy, (H + LE) / (Rn - G), of half-hours with all four measured."""
    names = ("sensible_heat_w_m2", "latent_heat_w_m2", "net_radiation_w_m2", "ground_heat_w_m2")
    complete = fluxes[[f"{name}_measured" for name in names]].all(axis=1)
    h, le, rn, g = (fluxes.loc[complete, name].sum() for name in names)
    return (h + le) / (rn - g)


def summer_evaporative_fraction(days: dict[str, pd.DataFrame]) -> tuple[float, float]:
    """LE / (LE + H) of June to August, measured and modelled: a ratio that does not depend on closure."""
    latent, sensible = days["latent heat"], days["sensible heat"]
    summer = latent["counts"] & sensible["counts"] & latent.index.month.isin([6, 7, 8])
    latent, sensible = latent[summer].sum(), sensible[summer].sum()
    fraction = latent / (latent + sensible)
    return fraction["measured"], fraction["modelled"]


def report(site: str, fluxes: pd.DataFrame, days: dict[str, pd.DataFrame]) -> str:
    """The printed comparison."""
    months = {name: by_month(days[name], QUANTITIES[name][0]) for name in PRINTED}
    year = fluxes.index[0].year
    lines = [
        f"{site} {year}: modelled beside measured, days with >= {MEASURED_SHARE:.0%} of the flux measured",
        "",
        "       " + "".join(f"{f'{name} [{QUANTITIES[name][0]}]':^30}" for name in PRINTED),
        "month  " + "".join(f"{'measured':>10}{'modelled':>10}{'days':>6}    " for _ in PRINTED),
    ]
    for month in range(1, 13):
        cells = (months[name].loc[month, ["measured", "modelled", "days"]] for name in PRINTED)
        lines.append(f"{calendar.month_abbr[month]:<7}" + "".join(_cells(*cell) for cell in cells))
    lines.append("year   " + "".join(_cells(*_annual(months[name], QUANTITIES[name][0])) for name in PRINTED))
    lines += ["", "skill (modelled less measured)"]
    for name in PRINTED:
        unit = QUANTITIES[name][0]
        daily_unit = unit.replace("month-1", "day-1")
        counted = days[name][days[name]["counts"]]
        for kind, pairs, pair_unit in (("months", months[name], unit), ("days", counted, daily_unit)):
            s = skill(pairs[["measured", "modelled"]])
            lines.append(
                f"  {name:<14}{kind:<7} bias {s['bias']:+7.2f}  RMSE {s['RMSE']:6.2f} {pair_unit:<15}"
                f" r {s['r']:5.2f}"
            )
    closure = energy_closure(fluxes)
    measured, modelled = summer_evaporative_fraction(days)
    lines += [
        "",
        f"The tower's (H + LE)/(Rn - G) is {closure:.2f} where all four were measured: a model that closes",
        "the energy balance has to exceed its latent or sensible heat. A ratio that does not depend on it,",
        f"LE/(LE + H) of June to August: measured {measured:.2f}, modelled {modelled:.2f}.",
    ]
    return "\n".join(lines)


def figure(site: str, fluxes: pd.DataFrame, days: dict[str, pd.DataFrame], modelled: pd.DataFrame) -> bytes:
    """PNG of the year's course: compared fluxes, and soil temperature with the snow."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    black, blue, grey = "#222222", "#1f6fb2", "#9a9a9a"
    fig, axes = plt.subplots(4, 1, figsize=(8, 10), sharex=True, layout="constrained")
    for ax, name in zip(axes[:-1], PRINTED, strict=True):
        values, unit = days[name], QUANTITIES[name][0].replace("month-1", "day-1")
        counted = values["measured"].where(values["counts"])
        ax.plot(values.index, counted, ".", color=grey, ms=4, label="measured, days")
        week = values[["measured", "modelled"]].rolling(7, center=True, min_periods=4).mean()
        ax.plot(values.index, week["measured"], color=black, lw=1.3, label="measured and gap-filled, week")
        ax.plot(values.index, week["modelled"], color=blue, lw=1.3, label="modelled, week")
        s = skill(values.loc[values["counts"], ["measured", "modelled"]])
        title = f"{name}: daily bias {s['bias']:+.2f}, RMSE {s['RMSE']:.2f}, r {s['r']:.2f}"
        ax.set_title(title, fontsize=10, loc="left")
        ax.set_ylabel(unit)
    axes[0].legend(frameon=False, fontsize=8)

    index = days["GPP"].index
    soil = fluxes["soil_temperature_c"].where(fluxes["soil_temperature_c_measured"])
    soil = soil.groupby(soil.index.normalize()).mean()
    ax = axes[3]
    ax.plot(index, soil, color=black, lw=1.3, label="measured, 5 cm")
    ax.plot(index, modelled["surface_soil_temperature_c"], color=blue, lw=1.3, label="modelled, surface soil")
    ax.set_title("Soil temperature, and the modelled snow", fontsize=10, loc="left")
    ax.set_ylabel("degC")
    ax.legend(frameon=False, fontsize=8, loc="upper left")
    snow = ax.twinx()
    snow.fill_between(index, modelled["swe_mm"], color=blue, alpha=0.12, lw=0)
    snow.set_ylabel("snow water [mm]")
    snow.set_ylim(0, max(1.0, 2.0 * modelled["swe_mm"].max()))
    ax.xaxis.set_major_locator(matplotlib.dates.MonthLocator())
    ax.xaxis.set_major_formatter(matplotlib.dates.DateFormatter("%b"))
    ax.set_xlim(index[0], index[-1])
    fig.suptitle(f"{site} {index[0].year}: simulator under the tower's weather")

    png = io.BytesIO()
    fig.savefig(png, format="png", dpi=110, metadata={"Software": None})
    plt.close(fig)
    return png.getvalue()


def _month_lengths() -> pd.Series:
    return pd.Series({month: calendar.mdays[month] for month in range(1, 13)})


def _annual(months: pd.DataFrame, unit: str) -> tuple[float, float, float]:
    """Measured and modelled of the months that count, as a sum or a mean weighted by length, and the days."""
    valid = months.dropna()
    if unit.endswith("month-1"):
        return valid["measured"].sum(), valid["modelled"].sum(), months["days"].sum()
    weights = _month_lengths()[valid.index]
    return (
        np.average(valid["measured"], weights=weights),
        np.average(valid["modelled"], weights=weights),
        months["days"].sum(),
    )


def _cells(measured: float, modelled: float, days: float) -> str:
    numbers = "".join(f"{'-':>10}" if np.isnan(x) else f"{x:>10.1f}" for x in (measured, modelled))
    return f"{numbers}{int(days):>6}    "


def _make_writable(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--output-dir {folder}: {error.strerror}; a writable folder is needed") from error
    if not os.access(folder, os.W_OK):
        raise ValueError(f"--output-dir {folder}: a writable folder is needed")


def _write(path: Path, content: bytes) -> None:
    """Whole or not at all."""
    part = path.with_name(path.name + ".part")
    part.write_bytes(content)
    os.replace(part, path)


def main(args: Args) -> None:
    try:
        tower = towers.find(args.site)
        if args.years < 1:
            raise ValueError(f"--years {args.years}: at least 1 is needed")
        _make_writable(args.output_dir)
    except ValueError as error:
        sys.exit(f"validate.py: {error}")

    record = towers.read(tower)
    fluxes = towers.fluxes(record, tower)
    modelled = simulate(tower, STANDS[args.site], towers.forcing(record, tower), args.years)
    days = compare(fluxes, modelled)
    print(report(args.site, fluxes, days))

    months = {f"{name} [{unit}]": by_month(days[name], unit) for name, (unit, *_) in QUANTITIES.items()}
    months = pd.concat(months, names=["quantity", "month"])
    _write(args.output_dir / f"{args.site}.csv", months.to_csv(float_format="%.4f").encode())
    _write(args.output_dir / f"{args.site}.png", figure(args.site, fluxes, days, modelled))
    print(f"wrote {args.output_dir / args.site}.png and .csv")


if __name__ == "__main__":
    main(protocol.parse(Args))
