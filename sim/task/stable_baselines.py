"""Stands in lockstep for Stable-Baselines3: `BorealVectorEnv.stable_baselines3()` gives them so."""

from collections.abc import Sequence

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from sim.parameters import check_seed

OPTIONS = ("preference", "site")


class LockstepVecEnv(VecEnv):
    """A `BorealVectorEnv` as a VecEnv. Each reward is scalarised by the preference of its stand.

    sb3-contrib's MaskablePPO finds the masks. `seed` and `set_options` (of each stand: "preference", "site") are for
    the next reset. Episodes that end start anew within the step; their last info has the episode's totals.
    """

    def __init__(self, envs):
        self.envs = envs
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seeds of the stands at the next reset: stand i gets seed + i."""
        return super().seed(None if seed is None else check_seed("seed", seed))

    def reset(self) -> np.ndarray:
        """Start episodes."""
        for name in {name for one in self._options for name in one} - set(OPTIONS):
            raise ValueError(f"unknown option {name!r}; allowed: {', '.join(OPTIONS)}")
        options = {name: [one.get(name) for one in self._options] for name in OPTIONS}
        observations, _ = self.envs.reset(seed=self._seeds, options=options)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Take note of the actions."""
        self.actions = actions

    def step_wait(self):
        """A year of every stand: observations, scalarised rewards, ends, and an info of each."""
        weights = self.envs.weights()  # before those of the next episodes are drawn
        observations, rewards, ended, _, together = self.envs.step(self.actions)
        infos: list[dict] = [{"TimeLimit.truncated": False} for _ in range(self.num_envs)]
        for i, info in enumerate(infos):
            if "record" in together:
                info["record"] = _of_one(together["record"], i)
            if ended[i]:
                info |= _of_one(together["final_info"], i)
                info["terminal_observation"] = together["final_obs"][i]
        return observations, (weights * rewards).sum(axis=1).astype(np.float32), ended, infos

    def env_method(self, method_name: str, *method_args, indices=None, **method_kwargs) -> list:
        """Answers of the stands: to `action_masks` alone."""
        answers = self.envs.call(method_name, *method_args, **method_kwargs)
        return [answers[i] for i in self._get_indices(indices)]

    def get_attr(self, attr_name: str, indices=None) -> list:
        """An attribute of the environment, once for each stand."""
        value = getattr(self.envs, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value, indices=None) -> None:
        """Refused: stands in lockstep are one environment."""
        raise AttributeError(f"{attr_name} of stands in lockstep cannot be set: give it to gymnasium.make_vec")

    def env_is_wrapped(self, wrapper_class, indices=None) -> list[bool]:
        """None is."""
        return [False for _ in self._get_indices(indices)]

    def close(self) -> None:
        """Close the environment."""
        self.envs.close()


def _of_one(values, i: int):
    """What a vector environment's info says of stand i."""
    if isinstance(values, dict):
        return {name: _of_one(value, i) for name, value in values.items() if not name.startswith("_")}
    return values[i]
