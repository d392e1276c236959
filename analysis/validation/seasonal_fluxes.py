"""The seasonal course of carbon and water fluxes of held mature stands, over that of boreal forest towers."""

import calendar

import numpy as np
import pandas as pd

from analysis.validation import document, forest_towers
from analysis.validation.document import BLACK, BLUE, GREY, ORANGE, Miss, Part, number, percent
from analysis.validation.held_stands import KINDS, UNDISTURBED, Run, hold
from analysis.validation.scores import skill

CONIFER, DECIDUOUS = "mature conifer", "mature deciduous"
KINDS_SHOWN = {CONIFER: BLUE, DECIDUOUS: ORANGE}
YEARS = 5
TOLERANCE = 0.2
MARGIN = 0.05
FLUXES = {"gpp": "GPP", "reco": "ecosystem respiration", "nee": "NEE, uptake negative", "et": "evapotranspiration"}
UNITS = {"gpp": "gC m-2 day-1", "reco": "gC m-2 day-1", "nee": "gC m-2 day-1", "et": "mm day-1"}
#: What likely is behind a flux below and above the towers'.
LIKELY = {
    "gpp": ("a colder climate than any tower's", "light use is that of forests on better ground"),
    "reco": ("little soil carbon (2-10 kgC/m2) with one slow pool in a cold climate", "not looked into"),
    "nee": ("GPP too high, respiration too low, or both: see their biases", "not looked into"),
    "et": ("a colder climate than any tower's; autumn rain is scarce", "not looked into"),
}


def modelled(run: Run) -> dict[str, np.ndarray]:
    """Fluxes of each site and calendar month, (sites, 12), in `UNITS`."""
    months = {
        name: 1000.0 * run.months[f"{name}_kgc_m2"].mean(axis=0)
        for name in ("gpp", "autotrophic_respiration", "heterotrophic_respiration")
    }
    reco = months["autotrophic_respiration"] + months["heterotrophic_respiration"]
    water = run.months["evapotranspiration_mm"].mean(axis=0)
    return {"gpp": months["gpp"], "reco": reco, "nee": reco - months["gpp"], "et": water}


def measured() -> dict[str, pd.DataFrame]:
    """Median course of each tower near the sampled climate, by flux: a row a site, columns months 1-12."""
    sites = forest_towers.near_climate()
    carbon = forest_towers.courses(forest_towers.carbon_fluxes())
    water = forest_towers.courses(forest_towers.evapotranspiration())
    table = {name: carbon[name].unstack() for name in ("gpp", "reco", "nee")} | {"et": water.unstack()}
    courses = {name: values.reindex(columns=range(1, 13)).reindex(sites) for name, values in table.items()}
    return {name: values.dropna(how="all") for name, values in courses.items()}


def report(sites: int) -> Part:
    """Courses of mature stands on `sites` sites over those of the towers: a table, a figure, what misses."""
    runs = {kind: modelled(hold(KINDS[kind], sites, YEARS, mechanisms=UNDISTURBED)) for kind in KINDS_SHOWN}
    towers = measured()
    rows, misses = [], []
    for name, label in FLUXES.items():
        conifers = towers[name].drop(index=forest_towers.ASPEN, errors="ignore")
        unit = f"{label} [{UNITS[name]}]"
        observed = conifers.median()
        course = np.median(runs[CONIFER][name], axis=0)
        rows += _rows(unit, f"{len(conifers)} towers, conifers", observed, CONIFER, course)
        outside = [calendar.month_abbr[m] for m in range(1, 13) if _outside(course[m - 1], conifers, m)]
        bias = skill(course, observed).bias
        verdict = "**MISS**" if abs(bias) > TOLERANCE * observed.abs().mean() else "in"
        rows[-1] += [", ".join(outside) or "none", verdict]
        if verdict != "in":
            what = f"{label} over the year: bias {number(bias, sign=True)} {UNITS[name]}, towers' median course"
            misses.append(Miss(CONIFER, what, LIKELY[name][int(bias > 0.0)]))
        if forest_towers.ASPEN in towers[name].index:
            course = np.median(runs[DECIDUOUS][name], axis=0)
            aspen = towers[name].loc[forest_towers.ASPEN]
            rows += _rows(unit, f"{forest_towers.ASPEN}, aspen", aspen, DECIDUOUS, course)
            rows[-1] += ["", ""]
    temperature = forest_towers.mean_annual_temperature()[forest_towers.near_climate()]
    dated = forest_towers.disturbance_years()[temperature.index].notna().sum()
    text = f"""Mature stands held as in part 1 on {sites} sites, {YEARS} years, over the towers in forests without a
recorded disturbance since {forest_towers.UNDISTURBED_BEFORE} ({len(temperature) - dated} of the {len(temperature)} have
no year of one at all) and with a mean annual temperature of at most
{forest_towers.WARMEST_C:g} degC: {", ".join(temperature.index)}. Carbon is from ABCflux, water from FLUXNET2015. They
average {number(temperature.min(), 1)} to {number(temperature.max(), 1)} degC, the paper's sites −10 to −5: GPP as the
towers have it is no evidence that it is right for sites so much colder. Medians over sites, of
towers each with the median of its years. A course misses if its bias exceeds {percent(TOLERANCE)} of the towers' mean
magnitude (RMSE is not judged here); months outside are those in which it leaves the towers' range by more than
{percent(MARGIN)} of their largest month. All towers but one stand in forests of conifers; deciduous stands are set
beside that one, {forest_towers.ASPEN}, at {number(temperature[forest_towers.ASPEN], 1)} degC, without a verdict.

{document.table(["", "", *calendar.month_abbr[1:], "bias", "RMSE", "r", "months outside", "verdict"], rows, left=2)}

![Seasonal courses](images/validation_seasons.png)"""
    return Part(text, {"validation_seasons.png": draw(runs, towers)}, misses)


def _rows(label: str, of_towers: str, observed: pd.Series, kind: str, course: np.ndarray) -> list[list[str]]:
    """The towers' row, and the stand's with bias, RMSE and r; the stand's lacks its last two cells."""
    s = skill(course, observed)
    cells = [number(s.bias, sign=True), number(s.rmse), number(s.r)]
    return [
        [label, of_towers, *(number(value) for value in observed), *[""] * 5],
        ["", kind, *(number(value) for value in course), *cells],
    ]


def _outside(value: float, towers: pd.DataFrame, month: int) -> bool:
    margin = MARGIN * towers.median().abs().max()
    return bool(value < towers[month].min() - margin or value > towers[month].max() + margin)


@document.styled
def draw(runs: dict[str, dict[str, np.ndarray]], towers: dict[str, pd.DataFrame]) -> bytes:
    """PNG: range and median of the towers of conifers (grey, black), the one of aspen, and the stands (10-90 %)."""
    figure = document.new_figure(8.5, 6.0)
    month = np.arange(1, 13)
    for ax, (name, label) in zip(figure.subplots(2, 2).ravel(), FLUXES.items(), strict=True):
        conifers = towers[name].drop(index=forest_towers.ASPEN, errors="ignore")
        ax.fill_between(
            month, conifers.min(), conifers.max(), color=GREY, alpha=0.3, lw=0, label="towers of conifers, range"
        )
        ax.plot(month, conifers.median(), color=BLACK, lw=1.5, label="towers of conifers, median")
        if forest_towers.ASPEN in towers[name].index:
            ax.plot(month, towers[name].loc[forest_towers.ASPEN], color=BLACK, lw=1.2, ls="--", label="tower of aspen")
        for kind, colour in KINDS_SHOWN.items():
            low, median, high = np.percentile(runs[kind][name], [10, 50, 90], axis=0)
            ax.fill_between(month, low, high, color=colour, alpha=0.25, lw=0)
            ax.plot(month, median, color=colour, lw=1.5, label=f"{kind}, median and 10-90 %")
        ax.axhline(0.0, color=GREY, lw=0.6)
        ax.set_xticks(month, [calendar.month_abbr[m][0] for m in month])
        ax.set_title(label)
        ax.set_ylabel(UNITS[name])
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    figure.suptitle("Seasonal courses: mature stands on sampled sites and undisturbed boreal forest towers")
    return document.png(figure)
