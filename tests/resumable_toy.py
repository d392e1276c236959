"""The toy, able to be resumed, and told by its environment variables when to fail."""

import os
import time

import gymnasium as gym
from toy_env import ToyEnv


class ResumableToyEnv(ToyEnv):
    """TOY_ERROR_AT: the step of the environment's life at which it fails; TOY_SECONDS: what each step takes."""

    def __init__(self, with_site: bool = True):
        super().__init__(with_site)
        self.life = 0

    def step(self, action):
        self.life += 1
        if self.life == int(os.environ.get("TOY_ERROR_AT", 0)):
            raise FloatingPointError("the ground is 100% gone")
        time.sleep(float(os.environ.get("TOY_SECONDS", 0)))
        return super().step(action)

    def get_state(self):
        """All but the life."""
        names = ("preference", "site", "steps", "full")
        return {"generator": self.np_random.bit_generator.state, **{name: getattr(self, name) for name in names}}

    def set_state(self, state):
        """As get_state gave it."""
        self.np_random.bit_generator.state = state["generator"]
        for name, value in state.items():
            if name != "generator":
                setattr(self, name, value)


gym.register("resumable-toy-v0", entry_point="resumable_toy:ResumableToyEnv")
