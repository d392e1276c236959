"""A third objective, as a user would add one: the boreal environment, paid for the wood that is cut, under an id.

Four years of six steps a day.
"""

import gymnasium as gym

from boreal_env import Objective


def harvest(year):
    """Carbon of trees cut, a tenth of a kgC m-2 a unit."""
    return 10.0 * year["harvest_kgc_m2"]


gym.register(
    "timber-v0",
    entry_point="boreal_env:BorealEnv",
    kwargs={
        "objectives": ("carbon", "thaw", Objective("timber", harvest, 0.0, 1.0)),
        "years": 4,
        "time_step_minutes": 240,
    },
)
