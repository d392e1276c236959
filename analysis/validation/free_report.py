"""The part of the validation on stands that run free: left alone, planted, and even-aged after fire."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.validation import document, stand_development
from analysis.validation.disturbance_report import FIRE_RETURN, Fires
from analysis.validation.document import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, Miss, Part, number, percent
from analysis.validation.free_stands import (
    AFTER_FIRE,
    BALANCED,
    EPISODE_YEARS,
    EPISODES,
    EVEN_AGED,
    SEEDLINGS_HA,
    STAND_YEARS,
    STEM_EXPONENT,
    STEM_KGC,
    UNBURNED,
    grow,
)
from analysis.validation.held_stands import Run
from analysis.validation.observed_bands import CHECKS
from analysis.validation.scores import IN, Band

WINDOW = 5  # years that a flux is averaged over, up to the one shown
SHOWN_YEARS = (1, 10, 25, 50, 100, STAND_YEARS)
AGES = {"conifer": (20, 37, 71, 110, 150), "deciduous": (22, 30, 53, 75, 120)}
LEFT_ALONE = ("left alone", "mature stand left alone")
COURSES = dict(zip((*EPISODES, *AFTER_FIRE), (BLACK, PURPLE, GREY, BLUE, GREEN, ORANGE, SKY), strict=True))
DRAWN = ("biomass", "density", "leaf area", "basal area", "NPP", "NEP")
EVEN_AGED_COLOURS = {"conifer": BLUE, "deciduous": ORANGE}
FLUX = "kgC m-2 yr-1"


@dataclass(frozen=True)
class Quantity:
    """What is shown of a run, (years, sites): its unit, digits, and what likely is behind a value too low or high."""

    unit: str
    values: Callable[[Run], np.ndarray]
    digits: int
    low: str = ""
    high: str = ""
    flux: bool = False


def net_primary_production(run: Run) -> np.ndarray:
    return run.annual["gpp_kgc_m2"] - run.annual["autotrophic_respiration_kgc_m2"]


def net_production(run: Run) -> np.ndarray:
    """Net ecosystem production without fire, positive for uptake."""
    return net_primary_production(run) - run.annual["heterotrophic_respiration_kgc_m2"]


def deaths(run: Run) -> np.ndarray:
    """Share of the biomass that dies in a year, fire aside [%]; 0 where nothing lives."""
    dead = run.annual["mortality_kgc_m2"]
    whole = run.annual["biomass_kgc_m2"] + dead
    return 100.0 * np.divide(dead, whole, out=np.zeros_like(dead), where=whole > 0.0)


COLDER = "a colder climate than that of the measured stands"
FEW_DEATHS = "large stems die least; no deaths of old age"
THINNED = "stems of an age are alike: the suppressed among them do not die first"
QUANTITIES = {
    "biomass": Quantity(
        "kgC m-2",
        lambda run: run.annual["biomass_kgc_m2"],
        1,
        f"litter is a share of wood, too, which bounds what a stand can hold; {THINNED}",
        "few trees die; young trees lose little litter",
    ),
    "density": Quantity(
        "stems ha-1",
        lambda run: run.annual["density_stems_ha"],
        0,
        "the paper's largest density of 1500-2000 stems/ha, where thousands come up after fire",
        "recruits",
    ),
    "leaf area": Quantity(
        "m2 m-2",
        lambda run: run.annual["max_lai"],
        1,
        "cover falls with the number of stems; leaf area of closed crowns is the paper's 3-6",
        "crowns close early",
    ),
    "basal area": Quantity("m2 ha-1", lambda run: run.annual["basal_area_m2_ha"], 0, "biomass", "biomass"),
    "GPP": Quantity(FLUX, lambda run: run.annual["gpp_kgc_m2"], 2, COLDER, "light use", True),
    "NPP": Quantity(FLUX, net_primary_production, 2, COLDER, "respiration", True),
    "NEP": Quantity(FLUX, net_production, 2, "soil carbon drawn is beyond the litter's", "few dead trees", True),
    "deaths": Quantity("% yr-1", deaths, 1, FEW_DEATHS, THINNED, True),
}
OBSERVED = tuple(name for name in QUANTITIES if name != "deaths")

#: Biomass in a year over that in the first, by what it was over spans of 34 to 114 years in the Manitoba
#: chronosequence: 71 to 151 years for a mature stand, 37 to 151 for one of any age. Course -> year -> spans of ages.
HELD = {
    "left alone, no fire": {EPISODE_YEARS: ((37, 71), (71, 151)), STAND_YEARS: ((37, 151), (71, 151))},
    "mature stand left alone, no fire": {EPISODE_YEARS: ((71, 151),), STAND_YEARS: ((71, 151),)},
}
WOOD_DEATHS = Band(0.5, 1.5)
GROWS = "sparse first stands fill up with recruits and grow"
MATURE_GPP = CHECKS["GPP"].bands["mature mixed"]
DEATHS_SOURCE = "a choice, see above"


def report(sites: int) -> Part:
    """All courses on `sites` sites: tables, the figure, what misses."""
    after_fire = {kind: grow(course, sites) for kind, course in AFTER_FIRE.items()}
    episodes = {kind: grow(course, sites) for kind, course in EPISODES.items()}
    balanced = {kind: grow(course, sites) for kind, course in BALANCED.items()}
    unburned = {kind: grow(course, sites) for kind, course in UNBURNED.items()}
    even_aged = {species: grow(course, sites) for species, course in EVEN_AGED.items()}
    table = stand_development.observed()
    ages, age_misses = _by_age(even_aged, table)
    checks, check_misses = _checks({**episodes, **balanced}, unburned, table)
    unit = ", ".join(f"{name} [{quantity.unit}]" for name, quantity in QUANTITIES.items())
    left_alone = "; ".join(
        f"{kind}: {', '.join(number(np.median(_at(episodes[kind], 'biomass', y)), 1) for y in SHOWN_YEARS)} kgC/m2"
        for kind in LEFT_ALONE
    )
    text = f"""{sites} sites drawn as for episodes of the environment; {STAND_YEARS} years of weather as generated,
the same for every course. Nothing is put back. Stands begin as drawn or, where mature, with 1000 stems/ha of 41-100
years, half of each species, and 6 kgC/m2. They burn (unless *no fire* is said) and have insects, and are planted with
100 stems/ha a year as far as there is room. *Balanced* is the world of `boreal-balanced-v0`. After fire is a mature
stand that burns in the first year, and not again. Even-aged stands are {number(SEEDLINGS_HA, 0)} seedlings/ha on open
ground; they do not burn, so that their age is the time since fire. Cells are the median over sites (10-90 %); fluxes
are means of up to {WINDOW} years that end in the one named. Deaths are the share of the biomass that dies in a year,
fire aside. NEP leaves fire and products out. Basal area is no output of the simulator: a species' carbon is shared
among its stems by their relative carbon, and a stem of C kgC is (C/{STEM_KGC:g})^(1/{STEM_EXPONENT:g}) cm thick, so
that 30 and 64 kgC are 15 and 20 cm (Lambert et al. 2005). A species' carbon has its roots, so that basal area comes out
some 15 to 20 % too large (an estimate).

Of retained trees in Alberta 2.9 % (spruce), 6.1 % (aspen) and 8.7 % (birch) died a year, 2.5 to 4 times as many as in
reference stands (Bladon et al. 2008, the name from memory): 0.7-1.2, 1.5-2.4 and 2.2-3.5 % of stems there. The stems
that die are small (Luo and Chen 2011), so that the share of the wood is smaller;
{number(WOOD_DEATHS.low, 1)}-{number(WOOD_DEATHS.high, 1)} % is asked for here, by
choice. Biomass is held against a chronosequence, whose stands have not burned since their origin, over spans of 34 to
114 years; GPP against the band of mature stands in part 1. Intervals of the fire return are 95 % (Poisson);
`flammability_*` was calibrated to it.

Median biomass in years {", ".join(str(year) for year in SHOWN_YEARS)}. {left_alone}.

{document.table(["course", "year", *QUANTITIES], _by_year({**episodes, **balanced, **after_fire}), left=2)}

Units: {unit}.

{document.table(["check", "course", "value", "observed", "verdict", "source"], checks, left=6)}

Even-aged stands by age against stands of that age (within {percent(stand_development.NEAR)}), all of them in
[stand_development.csv](../analysis/observations/stand_development.csv) with their sources, and towers of known age in
ABCflux. The band is the range of the observations, {percent(stand_development.SLACK)} wider at both ends (NEP:
{stand_development.SLACK_NEP:g} kgC/m2/yr). The observed stands are in warmer climates, 2 to −3 degC against −10 to −5
here. GPP, NPP and NEP of the model have an understorey; so have those of towers and of Manitoba, other NPP may not.
GPP and NEP of old deciduous stands are those of one tower, in the warmest of those climates. Leaf area of young
conifers hangs on crowns that were chosen with the same Manitoba stands.

{document.table(["species", "quantity", "age", "model", "observed", "verdict", "from"], ages, left=7)}

![Free-running stands](images/validation_free_stands.png)"""
    figure = {"validation_free_stands.png": draw({**episodes, **after_fire}, even_aged, table)}
    return Part(text, figure, [*check_misses, *age_misses])


def course_of(run: Run, name: str) -> np.ndarray:
    """A quantity by year, (years, sites): stocks of the year, fluxes averaged over the window that ends with it."""
    values = QUANTITIES[name].values(run)
    if not QUANTITIES[name].flux:
        return values
    sums = np.cumsum(np.vstack([np.zeros_like(values[:1]), values]), axis=0)
    ends = np.arange(1, len(values) + 1)
    starts = np.maximum(ends - WINDOW, 0)
    return (sums[ends] - sums[starts]) / (ends - starts)[:, None]


def _at(run: Run, name: str, year: int) -> np.ndarray:
    """A quantity of the sites in a year, counted from 1."""
    return course_of(run, name)[year - 1]


def _by_year(episodes: dict[str, Run]) -> list[list[str]]:
    rows = []
    for kind, run in episodes.items():
        for year in SHOWN_YEARS:
            cells = [document.spread(_at(run, name, year), quantity.digits) for name, quantity in QUANTITIES.items()]
            rows.append([kind if year == 1 else "", str(year), *cells])
    return rows


def _by_age(even_aged: dict[str, Run], table: pd.DataFrame) -> tuple[list[list[str]], list[Miss]]:
    rows, misses = [], []
    for species, run in even_aged.items():
        for name in OBSERVED:
            for age in AGES[species]:
                band = stand_development.band(table, species, name, age)
                if band is None:
                    continue
                values = _at(run, name, age)
                median = float(np.median(values))
                quantity = QUANTITIES[name]
                digits = band.digits(median, quantity.digits)
                verdict = band.verdict(median)
                limits = document.limits(band, digits)
                stands = stand_development.about(table, species, name, age)
                sources = ", ".join(dict.fromkeys(stands.source))
                label = f"{name} [{quantity.unit}]"
                cells = [document.spread(values, digits), limits, document.marked(verdict), sources]
                rows.append([species, label, str(age), *cells])
                if verdict != IN:
                    likely = quantity.low if "low" in verdict else quantity.high
                    what = f"{name} at {age} years: median {number(median, digits)}, observed {limits}"
                    misses.append(Miss(f"even-aged {species}", what, likely))
    return rows, misses


def _checks(
    episodes: dict[str, Run], unburned: dict[str, Run], table: pd.DataFrame
) -> tuple[list[list[str]], list[Miss]]:
    """What a stand that is left alone or planted keeps, loses and how often it burns."""
    rows, misses = [], []

    def check(name, kind, value, band, digits, source, low, high, spread="", calibrated=False):
        digits, verdict = band.digits(value, digits), band.verdict(float(value))
        limits = document.limits(band, digits)
        shown = "in, calibrated" if verdict == IN and calibrated else document.marked(verdict)
        rows.append([name, kind, number(value, digits) + spread, limits, shown, source])
        if verdict != IN:
            likely = low if "low" in verdict else high
            misses.append(Miss(kind, f"{name}: {number(value, digits)}, observed {limits}", likely))

    for kind, years in HELD.items():
        for year, spans in years.items():
            biomass = unburned[kind].annual["biomass_kgc_m2"][[0, year - 1]]
            first, last = np.median(biomass, axis=1)
            name = f"biomass in year {year} over year 1"
            why = "the first stand is out of balance with its growth"
            check(name, kind, last / first, growth(table, spans), 2, _growth_source(spans), why, GROWS)
    for kind, run in episodes.items():
        value = float(np.median(deaths(run)[EPISODE_YEARS - 10 : EPISODE_YEARS]))
        name = f"deaths [% yr-1], years {EPISODE_YEARS - 9}-{EPISODE_YEARS}"
        check(name, kind, value, WOOD_DEATHS, 1, DEATHS_SOURCE, FEW_DEATHS, THINNED)
    for kind, run in episodes.items():
        value = float(np.median(course_of(run, "GPP")[EPISODE_YEARS - 1]))
        name = f"GPP [{FLUX}], years {EPISODE_YEARS - WINDOW + 1}-{EPISODE_YEARS}"
        check(name, kind, value, MATURE_GPP, 2, "mature stands, part 1", "leaf area and light use", "light use")
    for kind, run in episodes.items():
        fires = Fires.of(run)
        if fires.number:
            why = "deciduous cover burns five times slower; fires come in few of the warm days"
            source = "Yukon Flats 90 ± 32 (Drury and Grissom 2008); part 5"
            spread = f" ({number(fires.low, 0)} .. {number(fires.high, 0)})"
            check(
                "fire return [yr]", kind, fires.interval, FIRE_RETURN, 0, source, "cover", why, spread, calibrated=True
            )
    return rows, misses


def growth(table: pd.DataFrame, spans: tuple[tuple[int, int], ...]) -> Band:
    """Range of the biomass at the second age of a span over that at the first, wet and dry Manitoba stands."""
    ratios = []
    for drainage in ("dry", "wet"):
        chosen = table.stand.str.startswith(f"Manitoba black spruce, {drainage}") & (table.quantity == "biomass")
        by_age = table[chosen].set_index("age_low")[["low", "high"]].mean(axis=1)
        ratios += [by_age[end] / by_age[start] for start, end in spans]
    return Band(float(min(ratios)), float(max(ratios)))


def _growth_source(spans: tuple[tuple[int, int], ...]) -> str:
    ages = " and ".join(f"{start} to {end}" for start, end in spans)
    return f"Manitoba black spruce, wet and dry, from {ages} years (Wang et al. 2003)"


@document.styled
def draw(episodes: dict[str, Run], even_aged: dict[str, Run], table: pd.DataFrame) -> bytes:
    """PNG: even-aged stands by age with what was observed (two rows), and the courses of an episode (third row)."""
    figure = document.new_figure(14.0, 7.8)
    axes = figure.subplots(3, len(DRAWN))
    for row, (species, run) in enumerate(even_aged.items()):
        for ax, name in zip(axes[row], DRAWN, strict=True):
            _draw_ages(ax, name, run, EVEN_AGED_COLOURS[species], table[table.species == species])
            ax.set_title(f"even-aged {species}: {name}")
    for ax, name in zip(axes[2], DRAWN, strict=True):
        for kind, run in episodes.items():
            medians = np.median(course_of(run, name), axis=1)
            dashed = kind in LEFT_ALONE
            years = np.arange(1, len(medians) + 1)
            ax.plot(years, medians, color=COURSES[kind], ls="--" if dashed else "-", label=kind)
        ax.set_title(f"courses: {name}")
        ax.set_xlabel("year")
        ax.set_ylabel(QUANTITIES[name].unit)
        if name == "NEP":
            ax.axhline(0.0, color=GREY, lw=0.8)
        else:
            ax.set_ylim(0.0)
    handles, labels = axes[2, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    title = (
        "Free-running stands: median (rows 1-2: and 10-90 % of sites); observed stands by age: plots (black), towers "
        "(light blue)\nBars: ranges of value and age; of mature stands without an age 70-130 or 50-90 years"
    )
    figure.suptitle(title)
    return document.png(figure)


def _draw_ages(ax, name: str, run: Run, colour: str, table: pd.DataFrame) -> None:
    values = course_of(run, name)
    years = np.arange(1, len(values) + 1)
    low, median, high = np.percentile(values, [10, 50, 90], axis=1)
    ax.fill_between(years, low, high, color=colour, alpha=0.25, lw=0)
    ax.plot(years, median, color=colour)
    for stand in table[table.quantity == name].itertuples():
        shade = SKY if stand.source == "ABCflux" else BLACK
        age, value = 0.5 * (stand.age_low + stand.age_high), 0.5 * (stand.low + stand.high)
        spans = [[0.5 * (stand.age_high - stand.age_low)], [0.5 * (stand.high - stand.low)]]
        ax.errorbar(age, value, xerr=spans[0], yerr=spans[1], fmt="o", ms=3.5, lw=1, color=shade)
    if name == "NEP":
        ax.axhline(0.0, color=GREY, lw=0.8)
    else:
        ax.set_ylim(0.0)
    ax.set_xlim(0.0, STAND_YEARS + 5)
    ax.set_xlabel("age [yr]")
    ax.set_ylabel(QUANTITIES[name].unit)
