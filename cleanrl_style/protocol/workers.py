"""Worker processes that each step several environments in lockstep.

A stand costs least beside others: stands in lockstep take two fifths of the time that they take one by one.
gymnasium's AsyncVectorEnv knows one environment a worker. So each worker has `WorkerEnvs`, which pass for one,
and `WorkersVectorEnv` gives a script the environments of all workers side by side, as if each had its own.
"""

from collections.abc import Callable, Sequence

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from boreal_env import BorealEnv

SETTINGS = "settings"  # of a state: the arguments of all its environments, which are alike


def split_among_workers(num_envs: int, cores: int) -> list[range]:
    """Environments of each worker: neighbours, in no more workers than there are cores."""
    rows = -(-num_envs // cores)
    return [range(first, min(first + rows, num_envs)) for first in range(0, num_envs, rows)]


class WorkerEnvs(gym.Env):
    """The environments of one worker, in lockstep on one thread.

    Observations, rewards, terminations and truncations have a row for each, and so has the action. AsyncVectorEnv wants
    one shape of all workers: with fewer environments than `rows`, the most that one has, they end in zeros.
    """

    def __init__(self, env: BorealEnv, indices: range, rows: int):
        """env: one of them; indices: which of all environments these are."""
        self.envs = env.lockstep(len(indices), threads=1)
        self.indices, self.rows = indices, rows
        self.observation_space = batch_space(self.envs.single_observation_space, rows)
        self.action_space = batch_space(self.envs.single_action_space, rows)

    def reset(self, *, seed=None, options=None):
        """seed: a list, one for each; options: as for one environment, and a `mask_of_all` of all environments."""
        options = dict(options or {})
        if "mask_of_all" in options:
            options["reset_mask"] = options.pop("mask_of_all")[self.indices]
        if options.get("reset_mask", np.ones(1)).any():
            self.observations, _ = self.envs.reset(seed=seed, options=options)
        return self._filled(self.observations), {}

    def step(self, action):
        """A step of all; episodes restart within it. The info of each is in a list: info["environments"]."""
        self.observations, *results, infos = self.envs.step(action[: len(self.indices)])
        info = {"environments": [info_of(infos, i) for i in range(len(self.indices))]} if infos else {}
        return *map(self._filled, (self.observations, *results)), info

    def action_masks(self) -> np.ndarray:
        """Of each environment."""
        return self.envs.action_masks()

    def get_state(self) -> list[dict]:
        """Of each environment, as a `BorealEnv` gives it."""
        state = self.envs.get_state()
        return [
            {"episodes": row_of(state["episodes"], i), "generator": generator}
            for i, generator in enumerate(state["generators"])
        ]

    def set_state(self, states: Sequence[dict]) -> None:
        """Continue from `get_state`."""
        episodes = one_below_another([state["episodes"] for state in states])
        generators = [state["generator"] for state in states]
        self.envs.set_state({"episodes": episodes, "generators": generators, "group_size": self.envs.group_size})

    def _filled(self, values: np.ndarray) -> np.ndarray:
        """Values of each environment, and zeros for the rows that are left over."""
        filled = np.zeros((self.rows, *values.shape[1:]), values.dtype)
        filled[: len(values)] = values
        return filled


class WorkersVectorEnv(gym.vector.VectorWrapper):
    """All environments of an AsyncVectorEnv whose workers have `WorkerEnvs`."""

    env: gym.vector.AsyncVectorEnv

    def __init__(self, make: Sequence[Callable[[], gym.Env]], indices_by_worker: Sequence[range]):
        """make: for each worker, what makes its `WorkerEnvs`; indices_by_worker: `split_among_workers`."""
        # episodes restart in the worker: to AsyncVectorEnv they never end
        super().__init__(gym.vector.AsyncVectorEnv(make, autoreset_mode=AutoresetMode.DISABLED))
        self.indices_by_worker, rows = indices_by_worker, len(indices_by_worker[0])
        self.used = np.concatenate([np.arange(len(own)) + k * rows for k, own in enumerate(indices_by_worker)])
        one = self.env.single_observation_space
        self.single_observation_space = gym.spaces.Box(one.low[0], one.high[0], dtype=one.dtype)
        self.single_action_space = gym.spaces.Discrete(int(self.env.single_action_space.nvec[0]))
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.metadata = {**self.env.metadata, "autoreset_mode": AutoresetMode.SAME_STEP}

    @property
    def num_envs(self) -> int:
        """Of all workers."""
        return len(self.used)

    def reset(self, *, seed=None, options=None):
        """As AsyncVectorEnv's."""
        if seed is None or isinstance(seed, (int, np.integer)):
            seed = [None if seed is None else seed + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"seed: one value or {self.num_envs} are allowed, got {len(seed)}")
        options = dict(options or {})
        if "reset_mask" in options:
            options["mask_of_all"] = options.pop("reset_mask")
        observations, _ = self.env.reset(seed=self._by_worker(seed), options=options)
        return self._rows(observations), {}

    def step(self, actions):
        """As AsyncVectorEnv's."""
        padded = np.zeros(self.env.action_space.shape, self.env.action_space.dtype)
        padded.reshape(-1)[self.used] = actions
        *results, of_workers = self.env.step(padded)
        infos: dict = {}
        for indices, own in zip(self.indices_by_worker, of_workers.get("environments", ()), strict=False):
            for i, info in zip(indices, own or (), strict=False):
                infos = self._add_info(infos, info, i)
        return *map(self._rows, results), infos

    def call(self, name: str, *args, **kwargs) -> tuple:
        """Answers of all environments; `WorkerEnvs` give a list."""
        return tuple(answer for own in self.env.call(name, *args, **kwargs) for answer in own)

    def set_states(self, states: Sequence[dict]) -> None:
        """Continue from the states of all environments, as `call("get_state")` gives them."""
        self.env.call("set_states", self._by_worker(states))

    def _by_worker(self, values: Sequence) -> list[list]:
        """What belongs to each environment, as a list for each worker."""
        return [[values[i] for i in indices] for indices in self.indices_by_worker]

    def _rows(self, values: np.ndarray) -> np.ndarray:
        """Values (workers, rows, ..) as (environments, ..)."""
        return values.reshape(-1, *values.shape[2:])[self.used]


def info_of(infos: dict, i: int) -> dict:
    """Environment i's own info, of those that a vector environment has put together."""
    return {
        name: info_of(value, i) if isinstance(value, dict) else value[i]
        for name, value in infos.items()
        if not name.startswith("_") and infos[f"_{name}"][i]
    }


def row_of(state, i: int):
    """The state of environment i alone, of a state whose arrays and lists have a row for each, but for the settings."""
    if isinstance(state, dict):
        return {name: value if name == SETTINGS else row_of(value, i) for name, value in state.items()}
    return state[i : i + 1] if isinstance(state, (np.ndarray, list)) else state


def one_below_another(states: Sequence):
    """The state of several environments, of the states of each: `row_of`'s inverse."""
    first = states[0]
    if isinstance(first, dict):
        return {
            name: value if name == SETTINGS else one_below_another([state[name] for state in states])
            for name, value in first.items()
        }
    if isinstance(first, np.ndarray):
        return np.concatenate(states)
    return sum(states, []) if isinstance(first, list) else first
