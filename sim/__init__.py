"""The simulator of a boreal stand: energy, water, carbon, demography, disturbance and management.

`simulate` runs one stand and returns a table; `read_forcing` makes its weather of a tower's file. `simulate_many` runs
one on each of many sites, `sites_on_grid` makes those of a region. `Stands` steps many, for the environment.
`sample_site` draws the parameters of a site. `docs/simulator.md` shows how to use them, `docs/model.md` has the
equations. Of the source `year`, `day` and `step` have the order, `state` what they carry; each process has a file.
"""

from importlib import import_module

from sim.closure import PhysicsError
from sim.draws import Seeds, episode_seeds
from sim.io.disaggregation import DiurnalCycle, diurnal_cycle, half_hours
from sim.io.forcing import read_forcing
from sim.jit import cache_folder
from sim.parameters import (
    CONSTANTS,
    MECHANISMS,
    OBSERVED_SITE_PARAMETERS,
    SITE_PARAMETERS,
    middle_site,
    sample_site,
    scale_site,
)
from sim.scenario import SCENARIOS
from sim.simulate import simulate
from sim.spin_up import INITIAL_RANGES
from sim.stands import Stands
from sim.state import RECORD_NAMES

__all__ = [
    "CONSTANTS",
    "INITIAL_RANGES",
    "MECHANISMS",
    "OBSERVED_SITE_PARAMETERS",
    "RECORD_NAMES",
    "SCENARIOS",
    "SITE_PARAMETERS",
    "DiurnalCycle",
    "PhysicsError",
    "Seeds",
    "Stands",
    "cache_folder",
    "diurnal_cycle",
    "episode_seeds",
    "half_hours",
    "middle_site",
    "read_forcing",
    "sample_site",
    "scale_site",
    "simulate",
    "simulate_many",
    "sites_on_grid",
]


#: Loaded when they are asked for, since they import `sim.task`, which imports `sim`.
_OF_A_REGION = {"simulate_many": "sim.region.many", "sites_on_grid": "sim.region.grid"}


def __getattr__(name: str):
    if name in _OF_A_REGION:
        return getattr(import_module(_OF_A_REGION[name]), name)
    raise AttributeError(f"module 'sim' has no attribute {name!r}")
