"""Stands that run free on sampled sites: they grow, thin, burn and are planted, as in an episode.

All kinds have the same sites, weather and dice; only the first stocks and what is planted differ.
"""

from dataclasses import dataclass, field

import numpy as np

import sim
from analysis.validation.held_stands import Run
from boreal_env import BALANCED_WORLD, NO_CHANGE
from sim.demography import AGES, stem_weight
from sim.jit import uncompiled
from sim.state import PARAMETER_NAMES, STATE

PLANT_CONIFERS, PLANT_HALF, PLANT_DECIDUOUS = 24, 22, 20  # 100 stems/ha
EPISODE_YEARS = 50
STAND_YEARS = 150

#: Parameters under which every stand burns on the first day of summer that is above freezing, or soon after.
BURNING = {"fire": 1.0, "fire_base_probability": 1.0, "fire_drought_threshold": -1.0, "fire_temperature_c": 0.0}

#: A stem of C kgC is (C / STEM_KGC)^(1 / 2.5) cm thick: 30 and 64 kgC are 15 and 20 cm (Lambert et al. 2005).
STEM_KGC, STEM_EXPONENT = 0.035, 2.5


@dataclass(frozen=True)
class Course:
    """A kind of stand: its first stocks (the rest is drawn), what is done in the first year and in all later ones, for
    how many years, which mechanisms are off, whether it burns in the first year, and in which world (arguments of
    `sim.Stands`)."""

    initial: dict = field(default_factory=dict)
    first_action: int = NO_CHANGE
    action: int = NO_CHANGE
    years: int = STAND_YEARS
    mechanisms: dict = field(default_factory=dict)
    burned: bool = False
    world: dict = field(default_factory=dict)


MATURE = {"conifer_mature_stems_ha": 500.0, "deciduous_mature_stems_ha": 500.0, "biomass_kgc_m2": 6.0}

#: Stands as episodes have them, with fire and insects, and on for as long as stands grow.
EPISODES = {
    "left alone": Course(),
    "mature stand left alone": Course(MATURE),
    "planted once, half": Course(first_action=PLANT_HALF),
    "planted every year, conifers": Course(first_action=PLANT_CONIFERS, action=PLANT_CONIFERS),
    "planted every year, half": Course(first_action=PLANT_HALF, action=PLANT_HALF),
    "planted every year, deciduous": Course(first_action=PLANT_DECIDUOUS, action=PLANT_DECIDUOUS),
}

#: Two of them in the world of `boreal-balanced-v0`.
BALANCED = {
    "left alone, balanced": Course(world=BALANCED_WORLD),
    "planted every year, half, balanced": Course(first_action=PLANT_HALF, action=PLANT_HALF, world=BALANCED_WORLD),
}

#: Stands left alone that do not burn, as the stands of a chronosequence have not since their origin.
UNBURNED = {
    "left alone, no fire": Course(mechanisms={"fire": False}),
    "mature stand left alone, no fire": Course(MATURE, mechanisms={"fire": False}),
}

#: A mature stand that burns in the first year, and not again: its age is the time since fire.
AFTER_FIRE = {"after fire": Course(MATURE, mechanisms={"fire": False}, burned=True)}

#: Even-aged stands: 2000 seedlings on open ground, which do not burn, so that their age is the time since fire.
SEEDLINGS_HA, SEEDLINGS_KGC_M2 = 2000.0, 0.02
EVEN_AGED = {
    species: Course(
        {f"{species}_seedling_stems_ha": SEEDLINGS_HA, "biomass_kgc_m2": SEEDLINGS_KGC_M2}, mechanisms={"fire": False}
    )
    for species in ("conifer", "deciduous")
}


def grow(course: Course, sites: int) -> Run:
    """Run a kind of stand on sampled sites 0 to `sites` - 1; annual records and `basal_area_m2_ha`, (years, sites)."""
    stands = sim.Stands(sites, mechanisms=course.mechanisms, **course.world)
    parameters = [sim.sample_site(k) for k in range(sites)]
    seeds = [sim.episode_seeds(k) for k in range(sites)]
    stands.start(np.arange(sites), parameters, seeds, initial=dict.fromkeys(range(sites), course.initial))
    weights = stem_weights(stands.constants)
    lasting = stands.parameters.copy()
    annual, areas = [], []
    for year in range(course.years):
        action = course.first_action if year == 0 else course.action
        if course.burned and year == 0:
            set_alight(stands)
        annual.append(stands.step(np.full(sites, action)).copy())
        areas.append(basal_area(stands.state, weights))
        stands.parameters[:] = lasting
    annual = np.stack(annual)
    records = {name: annual[..., i] for i, name in enumerate(sim.RECORD_NAMES)}
    return Run({**records, "basal_area_m2_ha": np.stack(areas)}, {}, {})


def set_alight(stands: sim.Stands) -> None:
    """Make it certain that stands burn in summer, until their parameters are put back."""
    for name, value in BURNING.items():
        stands.parameters[:, PARAMETER_NAMES.index(name)] = value


def stem_weights(constants: dict) -> np.ndarray:
    """Carbon of a stem relative to a very old one, by species and age, (2, AGES)."""
    weight = uncompiled(stem_weight)
    exponent = constants["stem_carbon_exponent"]
    return np.array(
        [
            [
                weight(age, constants[f"height_rate_{species}"], constants[f"height_shape_{species}"], exponent)
                for age in range(AGES)
            ]
            for species in ("conifer", "deciduous")
        ]
    )


def basal_area(state: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Basal area [m2 ha-1] of stands, (stands,), from their state vectors (stands, fields).

    A species' carbon is shared among its stems by weight; a stem's diameter follows from its carbon.
    """
    stems = state[:, len(STATE) :].reshape(len(state), 2, AGES)
    names = list(STATE)
    carbon = 1e4 * state[:, [names.index("conifer_biomass"), names.index("deciduous_biomass")]]  # kgC ha-1
    whole = (stems * weights).sum(axis=2)
    stem = np.divide(carbon, whole, out=np.zeros_like(carbon), where=whole > 0.0)[:, :, None] * weights
    diameter = 0.01 * (stem / STEM_KGC) ** (1.0 / STEM_EXPONENT)
    return (stems * 0.25 * np.pi * diameter**2).sum(axis=(1, 2))
