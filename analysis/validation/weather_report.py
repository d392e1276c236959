"""The part of the validation on the weather generator: its climate against records, and its calibration by halves."""

import calendar
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.validation import calibration, climate_records, document, forest_towers
from analysis.validation.climate_records import SEASONS, Climate
from analysis.validation.document import BLACK, BLUE, GREEN, ORANGE, PURPLE, Miss, Part, number
from analysis.validation.held_stands import KINDS, MONTH, UNDISTURBED, Run, hold
from sim.parameters import CONSTANTS, WEATHERS
from sim.physical_constants import MJ_PER_DAY
from sim.state import DAYS
from sim.weather import snow_share

MISS = "**MISS**"
YEARS = 6
DAILY = ("air_temperature_c", "precipitation_mm", "shortwave_mj_m2")
#: ERA-Interim 1989-2014 at US-Prr: mean and first harmonic of daily temperature.
US_PRR_CLIMATE = {"latitude_deg": 65.124, "mean_annual_temperature_c": -2.9, "seasonal_amplitude_c": 19.6}
DAYS_OF_MONTH = np.bincount(MONTH)[1:]
snow_share_of = np.vectorize(climate_records.uncompiled(snow_share))


@dataclass(frozen=True)
class Statistic:
    """A property of daily weather by season, its tolerance (absolute, or a share of the record), and what of the
    paper's weather is likely behind a difference from the record."""

    label: str
    unit: str
    tolerance: float
    relative: bool
    likely: str
    digits: int = 2


STATISTICS = {
    "temperature": Statistic("air temperature", "degC", 1.5, False, "one cosine for the year", 1),
    "spread": Statistic(
        "standard deviation of daily temperature",
        "K",
        0.25,
        True,
        "the paper's 1-2 degC, the same all year; the record has 3 in summer, 5 between, 9 in winter",
        1,
    ),
    "persistence": Statistic("lag-1 autocorrelation of it", "1", 0.1, False, "one value for all seasons"),
    "precipitation": Statistic(
        "precipitation", "mm day-1", 0.25, True, "the paper's wet-day probabilities and amounts"
    ),
    "wet days": Statistic("wet days (1 mm and more)", "1", 0.25, True, "the paper's probabilities of a wet day"),
    "wet amount": Statistic("mean amount of a wet day", "mm", 0.25, True, "the paper's amounts of a wet day", 1),
    "shortwave": Statistic("shortwave", "W m-2", 0.15, True, "clearness by season", 0),
}

PAPERS, AS_OBSERVED = "weather", "weather as observed"
#: What is the record's own, or what a constant was calibrated to on these records: no test of the generator.
INPUT = "temperature"
CALIBRATED = {
    PAPERS: ("persistence", "shortwave"),
    AS_OBSERVED: ("persistence", "shortwave", "spread", "wet days", "wet amount"),
}
CALIBRATED_WINTER = "precipitation"  # by `snowfall_scale`
ONE_FACTOR = dict.fromkeys(("precipitation", "wet days", "wet amount"), "one factor for the wet days of all seasons")


def likely_of(name: str, world: str) -> str:
    """What likely is behind a difference of a world's weather; of the observed one the paper's numbers are not."""
    return STATISTICS[name].likely if world == PAPERS else ONE_FACTOR.get(name, "not looked into")


#: Labels of the figure's axes where the unit is 1.
AXES = {"persistence": "correlation", "wet days": "share of the days"}


def of_days(temperature: np.ndarray, precipitation: np.ndarray, shortwave: np.ndarray) -> dict[str, np.ndarray]:
    """Statistics by month, (12,) each, of daily weather (years, 365) [degC, mm, W m-2]; NaN is not counted."""
    anomaly = climate_records.harmonic_anomaly(temperature)
    months = range(1, 13)
    wet = np.where(np.isnan(precipitation), np.nan, precipitation >= calibration.WET_MM)
    amounts = np.where(wet == 1.0, precipitation, np.nan)
    return {
        "temperature": _by_month(temperature),
        "spread": np.array([np.nanstd(anomaly[:, MONTH == m]) for m in months]),
        "persistence": np.array([_lag_one(anomaly[:, MONTH == m]) for m in months]),
        "precipitation": _by_month(precipitation),
        "wet days": _by_month(wet),
        "wet amount": np.array([_mean(amounts[:, MONTH == m]) for m in months]),
        "shortwave": _by_month(shortwave),
    }


def of_climate(climate: Climate) -> dict[str, np.ndarray]:
    """Statistics by month of a record's whole years."""
    days = climate.days[["air_temperature_c", "precipitation_mm", "shortwave_w_m2"]]
    days = days[~((days.index.month == 2) & (days.index.day == 29))]
    values = days.to_numpy().reshape(-1, DAYS, 3)
    return of_days(*np.moveaxis(values, 2, 0))


def of_run(run: Run) -> dict[str, np.ndarray]:
    """Statistics by month of the generated weather of each site, (sites, 12)."""
    weather = np.stack([run.daily[name] for name in DAILY])
    weather[2] /= MJ_PER_DAY
    each = [of_days(*weather[:, :, site]) for site in range(weather.shape[2])]
    return {name: np.array([statistics[name] for statistics in each]) for name in STATISTICS}


def by_season(months: np.ndarray) -> dict[str, np.ndarray]:
    """Mean over the months of each season, of (..., 12), weighted by their length."""
    found = {}
    for season, numbers in SEASONS.items():
        index = [month - 1 for month in numbers]
        found[season] = np.average(months[..., index], weights=DAYS_OF_MONTH[index], axis=-1)
    return found


def snowfall(climate: Climate) -> float:
    """Snowfall of a mean year [mm] of a record, by the simulator's rain-snow rule at the day's mean temperature."""
    days = climate.days.dropna(subset=["air_temperature_c", "precipitation_mm"])
    snow = (snow_share_of(days["air_temperature_c"]) * days["precipitation_mm"]).groupby(days.index.month).mean()
    return float((snow.to_numpy() * DAYS_OF_MONTH).sum())


def report(sites: int, repeats: int) -> Part:
    """The generator on `sites` sampled sites and in US-Prr's climate against the records; calibration by halves.

    repeats : times that a tower's year is run, as of `calibration.evaporative_fractions`.
    """
    sampled = hold(KINDS["open"], sites, YEARS, mechanisms=UNDISTURBED, keep_daily=DAILY)
    alike, varying = (
        hold(
            KINDS["open"],
            sites,
            YEARS,
            mechanisms=UNDISTURBED,
            keep_daily=DAILY,
            site_overrides=US_PRR_CLIMATE,
            weather=weather,
        )
        for weather in WEATHERS
    )
    records = climate_records.records()
    here, there, as_observed = of_run(sampled), of_run(alike), of_run(varying)
    towers = {name: of_climate(records[name]) for name in ("US-Prr", "ERA-Interim")}
    forests = _forests()
    rows, misses = _table(here, there, as_observed, towers, forests)
    generated = [run.sites("snowfall_mm") for run in (sampled, alike, varying)]
    rows.append(_snowfall_row(generated, records))
    share = {season: float(np.median(values)) for season, values in by_season(here["wet days"]).items()}
    winter = [month - 1 for month in calibration.WINTER_HALF]
    unscaled = here["precipitation"][:, winter].mean() / CONSTANTS["snowfall_scale"].low
    calibrated, more = calibration.report(share, unscaled, repeats)
    header = [
        "",
        "season",
        "generator, sampled sites",
        "generator, US-Prr's climate",
        "the same, as observed",
        "ERA-Interim 1989-2014",
        "US-Prr 2011-14",
        "forest towers",
        "verdict",
        "as observed",
    ]
    text = f"""Weather of {YEARS} years on {sites} sampled sites (median, 10-90 %), and on the same sites with latitude,
mean annual temperature and seasonal amplitude of US-Prr. The records at US-Prr are ERA-Interim, debiased by
FLUXNET2015 (26 years), and the tower's own (its winter precipitation is under-caught); forest towers are those of part
4 (median, range). Only US-Prr's climate is judged, against ERA-Interim: 1.5 degC, 0.1 of autocorrelation, 15 % of
shortwave, 25 % of the rest; its temperature is given by that record's mean and first harmonic. Judged are the paper's
weather and the weather as observed (`weather="observed"`, which `boreal-balanced-v0` has). Anomalies are departures
from two harmonics of the year.

The paper's parameter ranges force most of what differs: mean annual temperatures of −10 to −5 degC, a half-range of
20-25 K, noise of 1-2 K, wet days in summer with probability 0.1-0.2 and 10-20 mm each.

{document.table(header, rows, left=2)}

![Weather](images/validation_weather.png)

### Calibration and its stability

{calibrated}"""
    return Part(text, {"validation_weather.png": draw(here, there, as_observed, towers)}, [*misses, *more])


def _table(here, there, as_observed, towers, forests) -> tuple[list[list[str]], list[Miss]]:
    rows, misses = [], []
    for name, statistic in STATISTICS.items():
        digits = statistic.digits
        sampled = by_season(here[name])
        worlds = {PAPERS: by_season(there[name]), AS_OBSERVED: by_season(as_observed[name])}
        for season in SEASONS:
            generated = {world: float(np.median(values[season])) for world, values in worlds.items()}
            era, tower = (float(by_season(towers[record][name])[season]) for record in ("ERA-Interim", "US-Prr"))
            limit = statistic.tolerance * (abs(era) if statistic.relative else 1.0)
            verdicts = [_verdict(name, season, world, abs(value - era) <= limit) for world, value in generated.items()]
            forest = forests[name][season] if name in forests else None
            rows.append(
                [
                    f"{statistic.label} [{statistic.unit}]" if statistic.unit != "1" else statistic.label,
                    season,
                    document.spread(sampled[season], digits),
                    *(number(value, digits) for value in generated.values()),
                    number(era, digits),
                    number(tower, digits),
                    "-" if forest is None else document.spread(forest, digits, (0.0, 100.0)),
                    *verdicts,
                ]
            )
            for (world, value), verdict in zip(generated.items(), verdicts, strict=True):
                if verdict == MISS:
                    what = f"{statistic.label}, {season}: {number(value, digits)}, record {number(era, digits)}"
                    misses.append(Miss(world, what, likely_of(name, world)))
    return rows, misses


def _verdict(name: str, season: str, world: str, within: bool) -> str:
    if not within:
        return MISS
    if name == INPUT:
        return "input"
    calibrated = name in CALIBRATED[world] or (name == CALIBRATED_WINTER and season == "winter")
    return "in, calibrated" if calibrated else "in"


def _snowfall_row(generated: list[np.ndarray], records: dict[str, Climate]) -> list[str]:
    era, tower = (number(snowfall(records[name]), 0) for name in ("ERA-Interim", "US-Prr"))
    alike, varying = (number(float(np.median(values)), 0) for values in generated[1:])
    return ["snowfall [mm yr-1]", "year", document.spread(generated[0], 0), alike, varying, era, tower, "-", "", ""]


def _forests() -> dict[str, dict[str, pd.Series]]:
    """Seasonal means of temperature and precipitation [mm day-1] of the forest towers near the sampled climate."""
    months = forest_towers.carbon_fluxes()[["tair", "precip"]].groupby(["site", "month"]).mean()
    months = months.loc[forest_towers.near_climate()]
    found = {}
    for name, column in (("temperature", "tair"), ("precipitation", "precip")):
        course = months[column].unstack().dropna().to_numpy()
        found[name] = by_season(course if column == "tair" else course / DAYS_OF_MONTH)
    return found


def _by_month(days: np.ndarray) -> np.ndarray:
    return np.array([_mean(days[:, MONTH == month]) for month in range(1, 13)])


def _mean(values: np.ndarray) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")


def _lag_one(anomaly: np.ndarray) -> float:
    """Correlation of each day's anomaly with the next one's, within a month; (years, days)."""
    today, tomorrow = anomaly[:, :-1].ravel(), anomaly[:, 1:].ravel()
    both = np.isfinite(today) & np.isfinite(tomorrow)
    return float(np.corrcoef(today[both], tomorrow[both])[0, 1])


@document.styled
def draw(here: dict, there: dict, as_observed: dict, towers: dict) -> bytes:
    """PNG: monthly statistics of the generator on sampled sites, in US-Prr's climate with either weather, and of the
    records."""
    figure = document.new_figure(8.5, 9.0)
    month = np.arange(1, 13)
    axes = figure.subplots(4, 2).ravel()
    for ax, (name, statistic) in zip(axes, STATISTICS.items(), strict=False):
        low, median, high = np.percentile(here[name], [10, 50, 90], axis=0)
        ax.fill_between(month, low, high, color=BLUE, alpha=0.2, lw=0, label='weather "paper", sampled sites: 10-90 %')
        ax.plot(month, median, color=BLUE, lw=1.3, zorder=3, ls=":", label='weather "paper", sampled sites: median')
        for weather, world, colour in zip(WEATHERS, (there, as_observed), (ORANGE, PURPLE), strict=True):
            label = f'weather "{weather}", climate of US-Prr: median'
            ax.plot(month, np.nanmedian(world[name], axis=0), color=colour, lw=1.5, label=label)
        ax.plot(month, towers["ERA-Interim"][name], color=BLACK, lw=1.5, label="ERA-Interim 1989-2014, US-Prr")
        ax.plot(month, towers["US-Prr"][name], color=GREEN, lw=1.2, ls="--", label="US-Prr 2011-14")
        ax.set_xticks(month, [calendar.month_abbr[m][0] for m in month])
        ax.set_title(statistic.label)
        ax.set_ylabel(AXES.get(name, statistic.unit))
    handles, labels = axes[0].get_legend_handles_labels()
    axes[-1].axis("off")
    axes[-1].legend(handles, labels, loc="center left")
    figure.suptitle("Daily weather by month: the generator and the records at US-Prr")
    return document.png(figure)
