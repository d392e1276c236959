"""The boreal environment in small, under an id that commands can be given: four years of six steps a day."""

import gymnasium as gym

SMALL = {"mode": "generalist", "years": 4, "time_step_minutes": 240}

gym.register("quick-v0", entry_point="boreal_env:BorealEnv", kwargs=SMALL)
