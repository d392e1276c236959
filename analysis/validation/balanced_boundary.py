"""Sites whose permafrost boundary is in balance with the climate and the stand above it.

The boundary's temperature is drawn without regard to either. Here it is found for each site: the stand is held, the
site's own weather runs, and the boundary is set to the mean temperature of the deep soil above it, again and again,
until no heat flows through it in the mean.
"""

import numpy as np

import sim
from analysis.validation.held_stands import NO_CHANGE
from sim.parameters import SITE_PARAMETERS
from sim.physical_constants import FREEZING_POINT_K
from sim.stands import HELD_IN_SPIN_UP
from sim.state import STATE, STATE_NAMES

ROUNDS = 5
YEARS = 12
BOUNDARY = "deep_boundary_temperature_k"
UNDISTURBED = {"fire": False, "insects": False}


def balanced(sites: list[dict], seeds: list) -> tuple[list[dict], np.ndarray]:
    """The sites with a boundary in balance, and the mean heat that still flows into it [MJ m-2 yr-1], (sites,).

    sites : parameters by name; seeds : of each, which give its first stand and weather.
    """
    sites = [dict(site) for site in sites]
    lowest, highest = SITE_PARAMETERS[BOUNDARY].physical_low, SITE_PARAMETERS[BOUNDARY].physical_high
    for _ in range(ROUNDS):
        deep, _ = run_held(sites, seeds)
        for site, temperature in zip(sites, deep + FREEZING_POINT_K, strict=True):
            site[BOUNDARY] = float(np.clip(temperature, lowest, highest))
    return sites, run_held(sites, seeds)[1]


def run_held(sites: list[dict], seeds: list) -> tuple[np.ndarray, np.ndarray]:
    """Mean temperature of the deep soil [degC] and mean heat into the boundary [MJ m-2 yr-1] below held first stands.

    (sites,) each, over YEARS years after the spin-up.
    """
    stands = sim.Stands(len(sites), mechanisms=UNDISTURBED)
    stands.start(np.arange(len(sites)), sites, seeds)
    held = [STATE_NAMES.index(name) for name in HELD_IN_SPIN_UP] + list(range(len(STATE), stands.state.shape[1]))
    first = stands.state[:, held].copy()
    column = sim.RECORD_NAMES.index
    deep, heat = [], []
    for _ in range(YEARS):
        record = stands.step(np.full(len(sites), NO_CHANGE))
        stands.state[:, held] = first
        deep.append(record[:, column("deep_soil_temperature_c")])
        heat.append(record[:, column("boundary_warming_mj_m2")] - record[:, column("boundary_cooling_mj_m2")])
    return np.mean(deep, axis=0), np.mean(heat, axis=0)
