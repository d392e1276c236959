"""What flows through a boundary in balance below stands that are held as they are, in the site's own weather."""

import numpy as np

import sim
from analysis.validation.held_stands import UNDISTURBED
from boreal_env import NO_CHANGE
from sim.spin_up import BOUNDARY
from sim.stands import HELD_COLUMNS
from sim.state import PARAMETER_NAMES

YEARS = 10


def run_held(sites: list[dict], seeds: list, **world) -> tuple[np.ndarray, ...]:
    """Temperature of the boundary in balance [K] and mean heat into it [MJ m-2 yr-1] in the first years, (sites,) each.

    sites : parameters by name; seeds : of each, which give its first stand and weather; world : arguments of
    `sim.Stands`, a boundary in balance among them.
    """
    stands = sim.Stands(len(sites), mechanisms=UNDISTURBED, **world)
    stands.start(np.arange(len(sites)), sites, seeds)
    first = stands.state[:, HELD_COLUMNS].copy()
    column = sim.RECORD_NAMES.index
    heat = np.zeros(len(sites))
    for _ in range(YEARS):
        record = stands.step(np.full(len(sites), NO_CHANGE))
        stands.state[:, HELD_COLUMNS] = first
        heat += record[:, column("boundary_warming_mj_m2")] - record[:, column("boundary_cooling_mj_m2")]
    return stands.parameters[:, PARAMETER_NAMES.index(BOUNDARY)], heat / YEARS
