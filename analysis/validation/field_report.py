"""The part of the validation on field experiments: a clear-cut, floors below closed canopies, thaw on deep moss."""

import numpy as np

from analysis.validation import clear_cut, document
from analysis.validation.document import Miss, Part, number
from analysis.validation.held_stands import KINDS, UNDISTURBED, Run, hold
from analysis.validation.scores import IN, Band
from analysis.validation.tower_stands import US_PRR

SKIPPED_YEARS, KEPT_YEARS = 7, 3
TEMPERATURES = ("air_temperature_c", "ground_temperature_c", "soil_top_temperature_c")
WINDS = (1.0, 2.0, 3.0)
JUDGED_WIND = 2.0

#: Heat of May to August [MJ m-2] and thaw [m], cutover less forest, by year after the cut (Iwahana et al. 2005).
IWAHANA_HEAT = (44.0, 69.0)
IWAHANA_THAW = (0.14, 0.16, 0.14)
FACTOR = 2.0  # within which a modelled change counts as the measured one
IWAHANA = "Iwahana et al. 2005, abstract"

CLOSED = ("mature conifer", "mature deciduous", "mature mixed")
FLOOR = Band(0.85, 1.0)
FLOOR_SOURCE = "forests near Whitehorse .92 (NICOP 2008); below air until thaw is deep (Karunaratne and Burn 2004)"

#: Spruce as at Wickersham (1240 stems/ha) on a deep organic layer, in the climate of US-Prr, 20 km from it.
DEEP_MOSS = {"conifer_mature_stems_ha": 1240.0, "biomass_kgc_m2": 3.2, "organic_layer_m": 0.25}
INTERIOR_ALASKA = {
    name: US_PRR.site[name]
    for name in ("latitude_deg", "mean_annual_temperature_c", "seasonal_amplitude_c", "deep_boundary_temperature_k")
}
DEEP_MOSS_THAW = Band(0.36, 0.52)
DEEP_MOSS_SOURCE = "Wickersham, 36 years (Viereck et al. 2008, abstract)"

SUMMER = "the moss on top does not dry by itself; ice-poor mineral soil; exchange in and below the canopy"


def report(sites: int) -> Part:
    """All experiments on `sites` sites: three tables and what misses."""
    cut_rows, misses = _clear_cut(sites)
    floor_rows, floor_misses = _floors(sites)
    thaw_rows, thaw_misses = _deep_moss(sites)
    header = ["", "stand", "median (10-90 %)", "observed", "verdict", "source"]
    text = f"""{sites} sampled sites, with the climate of the experiment where one is named; all else as drawn. Medians
over sites (10-90 %). Stands are held as in part 1, without fire and insects.

Larch near Yakutsk, leaf area about 2.5, felled after {clear_cut.YEARS_BEFORE} years (the model's deciduous tree; the
climate's half-range and the permafrost's temperature are from memory): what the cutover has more than the
forest on the same site and in the same weather, in the years after. The organic layer stays that of the forest. Wind is
{number(JUDGED_WIND, 0)} m/s where judged; the band is the measured within a factor of {number(FACTOR, 0)}.

{document.table(header, cut_rows, left=6)}

Thawing n-factors: the sum of daily mean temperatures above 0 °C at the ground's skin over that of the air, years
{SKIPPED_YEARS + 1} to {SKIPPED_YEARS + KEPT_YEARS}. Below the skin, at the top of the mineral soil, freezing
n-factors and open ground have no verdict. Air is above the canopy.

{document.table(header, floor_rows, left=6)}

Mature spruce on {DEEP_MOSS["organic_layer_m"]:g} m of organic layer, the climate and permafrost of US-Prr. Where thaw
is metres deep the permafrost is being lost.

{document.table(header, thaw_rows, left=6)}"""
    return Part(text, misses=[*misses, *floor_misses, *thaw_misses])


def thawing_factor(surface: np.ndarray, air: np.ndarray) -> np.ndarray:
    """Degree days above 0 degC of a surface over those of the air, (sites,); both (years, sites, days)."""
    return np.maximum(surface, 0.0).sum(axis=(0, 2)) / np.maximum(air, 0.0).sum(axis=(0, 2))


def within_factor(measured: float) -> Band:
    """What counts as the measured change."""
    return Band(measured / FACTOR, measured * FACTOR)


def _clear_cut(sites: int) -> tuple[list[list[str]], list[Miss]]:
    rows, misses = [], []
    for wind in WINDS:
        found = clear_cut.cut({**clear_cut.YAKUTSK, "wind_speed_m_s": wind}, clear_cut.LARCH, sites)
        judged = wind == JUDGED_WIND
        stand = f"wind {number(wind, 0)} m/s"
        for year, measured in enumerate(IWAHANA_HEAT):
            name = f"ground heat, May to August, year {year + 1} [MJ m-2]"
            band = within_factor(measured) if judged else None
            _add(rows, misses, name, stand, found.heat[year], band, 0, IWAHANA)
        for year, measured in enumerate(IWAHANA_THAW):
            band = within_factor(measured) if judged else None
            _add(rows, misses, f"thaw, year {year + 1} [m]", stand, found.thaw[year], band, 2, IWAHANA)
        year = len(found.warming)
        _add(rows, misses, f"top of the mineral soil, year {year} [K]", stand, found.warming[-1], None, 1, "")
        _add(rows, misses, "thaw of the forest itself [m]", stand, found.forest_thaw[0], None, 2, "")
    return rows, misses


def _floors(sites: int) -> tuple[list[list[str]], list[Miss]]:
    rows, misses = [], []
    runs = {kind: _daily(KINDS[kind], sites) for kind in (*CLOSED, "open")}
    runs["mature conifer, wind 1 m/s"] = _daily(KINDS["mature conifer"], sites, {"wind_speed_m_s": 1.0})
    for kind, run in runs.items():
        air, skin, top = (run.daily[name] for name in TEMPERATURES)
        band = FLOOR if kind != "open" else None
        _add(rows, misses, "thawing, skin", kind, thawing_factor(skin, air), band, 2, FLOOR_SOURCE)
        _add(rows, misses, "thawing, top of the mineral soil", kind, thawing_factor(top, air), None, 2, "")
        _add(rows, misses, "freezing, top of the mineral soil", kind, thawing_factor(-top, -air), None, 2, "")
    return rows, misses


def _deep_moss(sites: int) -> tuple[list[list[str]], list[Miss]]:
    rows, misses = [], []
    run = hold(DEEP_MOSS, sites, KEPT_YEARS, SKIPPED_YEARS, UNDISTURBED, INTERIOR_ALASKA)
    depth = run.sites("active_layer_depth_m")
    _add(rows, misses, "depth of thaw [m]", "spruce, interior Alaska", depth, DEEP_MOSS_THAW, 2, DEEP_MOSS_SOURCE)
    return rows, misses


def _daily(stocks: dict, sites: int, overrides: dict | None = None) -> Run:
    return hold(stocks, sites, KEPT_YEARS, SKIPPED_YEARS, UNDISTURBED, overrides, keep_daily=TEMPERATURES)


def _add(
    rows: list[list[str]],
    misses: list[Miss],
    name: str,
    stand: str,
    values: np.ndarray,
    band: Band | None,
    digits: int,
    source: str,
) -> None:
    """Add a row to a table, and a miss to `misses` if the median is outside the band."""
    median = float(np.median(values))
    digits = band.digits(median, digits) if band else digits
    cell = document.spread(values, digits)
    if band is None:
        rows.append([name, stand, cell, "", "", ""])
        return
    limits, verdict = document.limits(band, digits), band.verdict(median)
    rows.append([name, stand, cell, limits, document.marked(verdict), source])
    if verdict != IN:
        misses.append(Miss(stand, f"{name}: median {number(median, digits)}, observed {limits}", SUMMER))
