"""The ranges that boreal forests show, each with its source, and how the quantity is got from a run of stands."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from analysis.validation import forest_towers, tower_comparison
from analysis.validation.document import number
from analysis.validation.held_stands import KINDS, Run
from analysis.validation.scores import Band

SUMMER = (6, 7, 8)
ALL = tuple(KINDS)
FORESTS = tuple(kind for kind in KINDS if kind != "open")
MATURE = ("mature conifer", "mature deciduous", "mature mixed")
FELLED = "felled conifers"  # open ground with the organic layer of the conifers that stood there

CONIFERS = ("mature conifer", "mature mixed")  # of GPP and respiration: of the towers one is in a forest of aspen
BETTS = "Betts and Ball 1997, ± 25 %"


SUMS = forest_towers.annual_sums()


def _towers(name: str, sign: float = 1.0) -> str:
    """Where a carbon flux's band lies: a choice, beside the annual sums of the towers of part 4."""
    sums = sign * SUMS[name]
    low, high = sums.drop(forest_towers.ASPEN).min(), sums.drop(forest_towers.ASPEN).max()
    aspen = number(sums[forest_towers.ASPEN])
    return f"a choice; towers of part 4: {number(low)} to {number(high)} over conifers, {aspen} over aspen"


@dataclass(frozen=True)
class Check:
    """A quantity of a run, (sites,), its band by kind of stand, the band's source, and what likely is behind a median
    below (`low`) or above (`high`) it."""

    unit: str
    value: Callable[[Run], np.ndarray]
    bands: dict[str, Band]
    source: str
    low: str
    high: str
    digits: int = 2
    shown: tuple[str, ...] = ALL


def carbon(run: Run) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """GPP, autotrophic and heterotrophic respiration [kgC m-2 yr-1], (sites,)."""
    heterotrophic = run.sites("heterotrophic_respiration_kgc_m2")
    return run.sites("gpp_kgc_m2"), run.sites("autotrophic_respiration_kgc_m2"), heterotrophic


def ecosystem_respiration(run: Run) -> np.ndarray:
    _, autotrophic, heterotrophic = carbon(run)
    return autotrophic + heterotrophic


def net_production(run: Run) -> np.ndarray:
    """Net ecosystem production, positive for uptake."""
    return carbon(run)[0] - ecosystem_respiration(run)


def use_efficiency(run: Run) -> np.ndarray:
    """Share of GPP that trees and understorey do not respire."""
    gpp, autotrophic, _ = carbon(run)
    return 1.0 - autotrophic / gpp


def bowen_ratio(run: Run) -> np.ndarray:
    return run.season("sensible_heat_mj_m2", SUMMER) / run.season("latent_heat_mj_m2", SUMMER)


def interception_loss(run: Run) -> np.ndarray:
    """Share of the snowfall that sublimates from the canopy."""
    return run.annual["canopy_sublimation_mm"].sum(axis=0) / run.annual["snowfall_mm"].sum(axis=0)


def surface_offset(run: Run) -> np.ndarray:
    """At the top of the mineral soil, the closest to where sensors are, 0.05 to 0.2 m below the surface."""
    return run.sites("soil_top_temperature_c") - run.sites("air_temperature_c")


def snow_off(run: Run) -> np.ndarray:
    """Day on which winter's pack is gone, mean over the years."""
    swe = run.daily["swe_mm"]
    return np.apply_along_axis(tower_comparison.melt_out, 2, swe).mean(axis=0)


def _for(kinds: tuple[str, ...], low: float, high: float) -> dict[str, Band]:
    return dict.fromkeys(kinds, Band(low, high))


def _around(**values: float) -> dict[str, Band]:
    return {kind.replace("_", " "): Band(0.75 * value, 1.25 * value) for kind, value in values.items()}


CHECKS = {
    "GPP": Check(
        "kgC m-2 yr-1",
        lambda run: run.sites("gpp_kgc_m2"),
        _for(CONIFERS, 0.4, 0.8),
        _towers("gpp"),
        "cold climate, or light use",
        "light use without nitrogen limitation",
        shown=FORESTS,
    ),
    "ecosystem respiration": Check(
        "kgC m-2 yr-1",
        ecosystem_respiration,
        _for(CONIFERS, 0.35, 0.75),
        _towers("reco"),
        "little soil carbon (2-10 kgC/m2 drawn, one slow pool), so little heterotrophic respiration in a cold climate",
        "soil respiration's base rate",
        shown=FORESTS,
    ),
    "NEP": Check(
        "kgC m-2 yr-1",
        net_production,
        {**_for(CONIFERS, -0.05, 0.15), **_for(("mature deciduous",), -0.05, 0.25)},
        _towers("nee", -1.0),
        "heterotrophic respiration",
        "GPP too high, respiration too low (soil carbon drawn is not in balance with this stand's litter), or both",
        shown=FORESTS,
    ),
    "carbon use efficiency": Check(
        "1",
        use_efficiency,
        _for(FORESTS, 0.35, 0.55),
        "a choice; DeLucia et al. 2007 have 0.23 to 0.83 over forests of all kinds, 0.53 in the mean",
        "maintenance at the site's rate",
        "maintenance falls with temperature without acclimation",
        shown=FORESTS,
    ),
    "evapotranspiration": Check(
        "mm yr-1",
        lambda run: run.sites("evapotranspiration_mm"),
        _for(FORESTS, 150.0, 280.0),
        "US-Prr 207 (Nakai et al. 2013), BOREAS, BERMS; up to 400 at wet sites",
        "rain",
        "wet canopies and wet ground",
        digits=0,
    ),
    "peak snow water": Check(
        "mm",
        lambda run: run.sites("peak_swe_mm"),
        _for(ALL, 40.0, 120.0),
        "US-Prr, Sodankylä, Canadian normals",
        "snowfall, or too much sublimation",
        "snowfall",
        digits=0,
    ),
    "snow gone": Check(
        "day of year",
        snow_off,
        _for(ALL, 93.0, 145.0),
        "US-Prr 98-133 (2011-20), US-Uaf from 93 (not stored here); 145, where colder, is a choice",
        "ageing of the snow's albedo",
        "melt below a canopy",
        digits=0,
    ),
    "albedo, June to August": Check(
        "1",
        lambda run: run.sites("summer_albedo"),
        _around(mature_conifer=0.083, mature_deciduous=0.15, open=0.20),
        BETTS,
        "site's albedo",
        "site's albedo",
        digits=3,
    ),
    "albedo, December to March": Check(
        "1",
        lambda run: run.sites("winter_albedo"),
        _around(mature_conifer=0.13, mature_deciduous=0.21, open=0.75),
        BETTS,
        "snow in the crowns changes no albedo; long slant paths hide the ground",
        "bare crowns hide too little snow: wood and twigs of a leafless stand",
        digits=3,
    ),
    "top of the soil less air": Check(
        "K",
        surface_offset,
        _for(ALL, 1.7, 5.0),
        "US-Prr 3.1 (2011-14), SE-Svb 1.8 (2019, November and December filled); limits by choice; Zhang et al. 2018; "
        "snow alone 5.1 ± 3.2 (Peng et al. 2024)",
        "dense, thin snow",
        "snow",
        digits=1,
    ),
    "Bowen ratio, June to August": Check(
        "1",
        bowen_ratio,
        _for(MATURE, 0.5, 1.1),
        "US-Prr and SE-Svb 1.0; but 1.0-2.2 over larch (Kelliher et al. 1997), "
        "1.5 by day over spruce (Betts et al. 1999)",
        "transpiration",
        "dry soil (the paper's few rain days) and cold nights stress transpiration, in colder summers equilibrium "
        "evaporation is smaller; little heat into the ground",
    ),
    "interception loss of snowfall": Check(
        "1",
        interception_loss,
        {**_for(("mature conifer",), 0.2, 0.4), **_around(mature_deciduous=0.13), **_for(("mature mixed",), 0.13, 0.4)},
        "Pomeroy et al. 1998: aspen 0.13 (± 25 %), conifers 0.3-0.4; Montesi et al. 2004: 0.2-0.3",
        "exposure is at its limit of 1: ventilation of intercepted snow, weak winter sun",
        "sublimation",
        shown=FORESTS,
    ),
}
WARMING = Check(
    "K",
    lambda run: run.sites("surface_soil_temperature_c"),
    {FELLED: Band(0.5, 1.5)},
    "half a kelvin about the mean where forest, there of larch, was removed: 1 K (The influence of boreal forest "
    "dynamics on the current state of permafrost in Central Yakutia, abstract; depth not given)",
    "the moss of the open does not dry by itself",
    "the organic layer of open ground insulates less than that of conifers",
)
