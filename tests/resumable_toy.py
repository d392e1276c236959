"""The toy, able to be resumed, and told by its environment variables when to fail."""

import multiprocessing
import os
import time

import gymnasium as gym
import numpy as np
from toy_env import ToyEnv


class ResumableToyEnv(ToyEnv):
    """Told by TOY_ERROR, "where number", to fail: in its numberth "step" or "mask", or at "making" in a worker.

    "nan number": that step's reward is NaN. TOY_SECONDS: what each step takes.
    """

    def __init__(self, with_site: bool = True, offset: float = 0.0):
        super().__init__(with_site, offset)
        self.lives = {"step": 0, "mask": 0, "nan": 0, "making": 0}
        if multiprocessing.parent_process() is not None and self._fails("making"):
            raise FloatingPointError("no ground to stand on")

    def _fails(self, where):
        self.lives[where] += 1
        return os.environ.get("TOY_ERROR") == f"{where} {self.lives[where]}"

    def action_masks(self):
        if self._fails("mask"):

            class NoPickle(Exception):
                pass

            raise NoPickle("the mask slipped")
        return super().action_masks()

    def step(self, action):
        if self._fails("step"):
            raise FloatingPointError("the ground is 100% gone")
        time.sleep(float(os.environ.get("TOY_SECONDS", 0)))
        observation, reward, *rest = super().step(action)
        return observation, reward * np.nan if self._fails("nan") else reward, *rest

    def get_state(self):
        """All but the lives."""
        names = ("preference", "site", "steps", "full")
        return {"generator": self.np_random.bit_generator.state, **{name: getattr(self, name) for name in names}}

    def set_state(self, state):
        """As get_state gave it."""
        self.np_random.bit_generator.state = state["generator"]
        for name, value in state.items():
            if name != "generator":
                setattr(self, name, value)


gym.register("resumable-toy-v0", entry_point="resumable_toy:ResumableToyEnv")
gym.register("shifted-toy-v0", entry_point="resumable_toy:ResumableToyEnv", kwargs={"offset": 0.5})
