"""The simulator of a boreal stand: energy, water, carbon, demography, disturbance and management.

`simulate` runs one stand and returns a table; `Stands` steps many, for the environment. `sample_site` draws the
parameters of a site. `docs/model.md` has the equations.
"""

from sim.closure import PhysicsError
from sim.draws import Seeds, episode_seeds
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
    "PhysicsError",
    "Seeds",
    "Stands",
    "cache_folder",
    "episode_seeds",
    "middle_site",
    "sample_site",
    "scale_site",
    "simulate",
]
