"""The part of the validation on fire, insects and mortality of held stands, next to figures from the literature."""

from dataclasses import dataclass

import numpy as np

import sim
from analysis.validation import climate_records, document
from analysis.validation.document import Miss, Part, number, percent
from analysis.validation.held_stands import KINDS, UNDISTURBED, Run, hold
from analysis.validation.scores import IN, Band, poisson_interval
from sim.parameters import CONSTANTS
from sim.state import DAYS
from sim.weather import drought_index

YEARS = 50
MORTALITY_YEARS = 4
KINDS_SHOWN = {
    **{kind: KINDS[kind] for kind in ("mature conifer", "mature mixed", "mature deciduous")},
    "as episodes start": {},  # everything drawn: 0-600 stems/ha, 0.2-0.8 of them conifers
}
JUDGED = ("mature conifer", "mature mixed")
DAILY = ("air_temperature_c", "precipitation_mm", "swe_mm")
drought_index_of = np.vectorize(climate_records.uncompiled(drought_index))
#: Densities [stems ha-1] at which mortality is measured, by species; at the first no stand thins itself.
DENSITIES = (800.0, 1500.0, 2000.0)

#: Bands; their sources are below.
FIRE_RETURN = Band(80.0, 200.0)
KILLED = Band(0.65, 1.0)
BURNED = Band(1.5, 4.5)
OUTBREAKS = Band(2.0, 5.0)
INSECT_KILL = Band(0.02, 0.20)
MORTALITY = {"conifer": Band(0.28, 1.8), "deciduous": Band(0.7, 4.4)}
SOURCES = {
    "fire return": "CBM-CFS3 100-175 in the taiga; Yukon Flats 90 ± 32 (Drury and Grissom 2008); larch 82 ± 7 at 64 N "
    "(Kharuk et al. 2011); fire spreads 5 times slower in leafless aspen (Canadian FBP)",
    "share of stems killed": "DVM-DOS-TEM, FVS-FFE",
    "carbon burned": "2004 in the Yukon basin 3.1 ± 0.7, three quarters of it ground layer (Tan et al. 2007)",
    "outbreaks": "the paper's 0.02-0.05 a year",
    "share of conifers killed": "CBM-CFS3, spruce beetle: 2, 10 or 20 % by severity; budworm 45 % over 12 years",
    "mortality": "a choice; FVS-Alaska: spruce 0.3-0.5, birch 0.7-4.4, aspen 0.9-8.7; CLM6 1.7-2.4; LPJmL 1.5",
}
#: What is a draw or a parameter of the simulator and so cannot miss by itself, and what was calibrated to its band.
INPUT = ("share of stems killed", "outbreaks", "share of conifers killed")
CALIBRATED = ("fire return",)
LIKELY = {
    "fire return": "the level of flammability; most warm days are dry enough",
    "share of stems killed": "draw of the share",
    "carbon burned": "depth and density of the organic layer that burns",
    "outbreaks": "winters below the temperature at which insects live",
    "share of conifers killed": "the paper's range is for one year; outbreaks last several",
    "mortality": "the paper's background mortality, 2-3 % a year",
}


@dataclass(frozen=True)
class Fires:
    """Fires in stand-years: how many, their return interval with 95 % limits [yr], what they kill and burn."""

    number: int
    interval: float
    low: float
    high: float
    killed: float
    burned: float

    @classmethod
    def of(cls, run: Run, sites: np.ndarray | slice = slice(None)) -> "Fires":
        killed = run.annual["fire_mortality"][:, sites]
        burned = run.annual["fire_loss_kgc_m2"][:, sites]
        struck = killed > 0.0
        fires, years = int(struck.sum()), killed.size
        fewest, most = poisson_interval(fires)
        nothing = float("nan")
        return cls(
            fires,
            years / fires if fires else float("inf"),
            years / most,
            years / fewest if fewest else float("inf"),
            float(killed[struck].mean()) if fires else nothing,
            float(burned[struck].mean()) if fires else nothing,
        )


def mortality(run: Run) -> np.ndarray:
    """Stems that die a year [%], mean over the years, (sites,)."""
    return 100.0 * (run.annual["dead_stems_ha"] / run.annual["density_after_action"]).mean(axis=0)


def report(sites: int) -> Part:
    """Fire and insects over many stand-years, mortality by density; tables and what misses."""
    runs = {kind: hold(stocks, sites, YEARS, keep_daily=DAILY) for kind, stocks in KINDS_SHOWN.items()}
    fire_rows, fire_misses = _fire(runs)
    insect_rows, insect_misses = _insects(runs)
    mortality_rows, mortality_misses = _mortality(sites)
    years = sites * YEARS
    mortality_header = ["mortality [% yr-1]", "stems/ha", "median (10-90 %)", "literature", "verdict", "source"]
    warm, ready = fire_days(runs["mature conifer"], [sim.sample_site(k) for k in range(sites)])
    dry = _dry_sites(runs["mature conifer"])
    shares = [percent(float(ready[half].sum() / warm[half].sum())) for half in (dry, ~dry)]
    warm_days, days = (
        [number(float(count[half].mean()) / YEARS, 0) for half in (dry, ~dry)] for count in (warm, ready)
    )
    text = f"""Stands held as in part 1, with fire and insects, {sites} sites for {YEARS} years: {years} stand-years of
each kind, the last as an episode of the environment starts. Intervals are 95 % (Poisson). *Input* is what the simulator
draws or is given, so that it cannot miss by itself: the paper's ranges, and for fire those of the sources named.
Flammability was calibrated to the return of fire. Dry and wet sites are the halves by annual precipitation.

{document.table(["fire", "stand", "value", "literature", "verdict", "source"], fire_rows, left=6)}

The return does not follow the sites' wetness. Mature conifers at dry sites have {days[0]} summer days a year that are
warm (above {CONSTANTS["fire_temperature_c"].low:g} degC) and beyond the drought threshold, those at wet ones {days[1]}:
{shares[0]} and {shares[1]} of their {warm_days[0]} and {warm_days[1]} warm days. Rain falls on few days, in amounts
that empty the index at once, and between them it soon fills again.

{document.table(["insects", "stand", "value", "literature", "verdict", "source"], insect_rows, left=6)}

Mortality without fire and insects, {MORTALITY_YEARS} years, of stands of one species; what comes on top at higher
densities is self-thinning. Alaska's spruces and hardwoods reach full density at 4500-6200 stems/ha with a mean
diameter of 10 cm, at 1500-2000 with 19-20 cm (Reineke's rule with FVS-Alaska's largest densities): at that size the
paper's limit of 1500-2000 stems/ha holds here.

{document.table(mortality_header, mortality_rows, left=6)}"""
    return Part(text, misses=[*fire_misses, *insect_misses, *mortality_misses])


def fire_days(run: Run, parameters: list[dict[str, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Days of each site, (sites,), on which summer is warm enough for fire, and on which it is dry enough as well."""
    columns = [
        np.array([site[name] for site in parameters])
        for name in ("summer_start_day", "summer_end_day", "fire_drought_threshold")
    ]
    start, end, threshold = columns
    drying, warmth = CONSTANTS["drought_evaporation"].low, CONSTANTS["fire_temperature_c"].low
    warm, ready, index = np.zeros(len(start)), np.zeros(len(start)), np.zeros(len(start))
    weather = [run.daily[name] for name in DAILY]
    for year in range(weather[0].shape[0]):
        for day in range(DAYS):
            temperature, rain, snow = (values[year, :, day] for values in weather)
            index = drought_index_of(index, temperature, rain, snow, drying)
            summer = (start <= day + 1) & (day + 1 < end) & (temperature > warmth)
            warm += summer
            ready += summer & (index > threshold)
    return warm, ready


def _dry_sites(run: Run) -> np.ndarray:
    """Which sites are of the half with less precipitation."""
    rain = run.sites("precipitation_mm")
    return rain <= np.median(rain)


def _fire(runs: dict[str, Run]) -> tuple[list[list[str]], list[Miss]]:
    rows, misses = [], []
    for kind, run in runs.items():
        dry = _dry_sites(run)
        judged = FIRE_RETURN if kind in JUDGED else None
        for label, sites in (("", slice(None)), (", dry sites", dry), (", wet sites", ~dry)):
            fires = Fires.of(run, sites)
            spread = f" ({number(fires.low, 0)} .. {number(fires.high, 0)})"
            band = judged if not label else None
            name = f"return interval{label} [yr]"
            rows.append(_row(name, kind, fires.interval, spread, band, "fire return", misses, 0))
        fires = Fires.of(run)
        if not fires.number:
            continue
        grown = kind in KINDS
        for name, value, band, source, digits in (
            ("share of stems killed", fires.killed, KILLED if grown else None, "share of stems killed", 2),
            ("carbon burned [kgC m-2]", fires.burned, BURNED if grown else None, "carbon burned", 1),
        ):
            rows.append(_row(name, kind, value, "", band, source, misses, digits))
    return rows, misses


def _insects(runs: dict[str, Run]) -> tuple[list[list[str]], list[Miss]]:
    rows, misses = [], []
    for kind, run in runs.items():
        killed = run.annual["insect_mortality"]
        outbreaks = 100.0 * float((killed > 0.0).mean())
        band = OUTBREAKS if kind in KINDS else None
        rows.append(_row("outbreaks a century", kind, outbreaks, "", band, "outbreaks", misses, 1))
    killed = runs["mature conifer"].annual["insect_mortality"]
    if (killed > 0.0).any():
        share, name = float(killed[killed > 0.0].mean()), "share of conifers killed"
        rows.append(_row(name, "mature conifer", share, "", INSECT_KILL, name, misses, 2))
    return rows, misses


def _mortality(sites: int) -> tuple[list[list[str]], list[Miss]]:
    rows, misses = [], []
    for species, band in MORTALITY.items():
        for density in DENSITIES:
            stocks = {**KINDS[f"mature {species}"], f"{species}_mature_stems_ha": density}
            sample = mortality(hold(stocks, sites, MORTALITY_YEARS, mechanisms=UNDISTURBED))
            low, median, high = np.percentile(sample, [10, 50, 90])
            spread = f" ({number(low)} .. {number(high)})"
            judged = band if density == DENSITIES[0] else None
            row = _row(species, number(density, 0), float(median), spread, judged, "mortality", misses, 2)
            rows.append(row)
    return rows, misses


def _row(
    name, kind, value: float, spread: str, band: Band | None, source: str, misses: list[Miss], digits: int
) -> list[str]:
    """A row of a table, `spread` behind the value; a miss is added to `misses`."""
    if band is None:
        return [name, kind, number(value, digits) + spread, "", "", ""]
    digits, verdict = band.digits(value, digits), band.verdict(value)
    limits = document.limits(band, digits)
    if verdict != IN:
        misses.append(Miss(kind, f"{name}: {number(value, digits)}, literature {limits}", LIKELY[source]))
    text = number(value, digits) + spread
    shown = document.marked(verdict)
    if verdict == IN and source in (*INPUT, *CALIBRATED):
        shown = "input" if source in INPUT else "in, calibrated"
    return [name, kind, text, limits, shown, SOURCES[source]]
