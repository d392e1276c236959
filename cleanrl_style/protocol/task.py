"""The environment that a run is about: what it is, and what it can do. It is asked; no list of ids is kept."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import gymnasium as gym
import numpy as np
from gymnasium.wrappers import OrderEnforcing

import boreal_env
from cleanrl_style.flags import fail
from cleanrl_style.protocol.fronts import return_columns, weight_columns
from cleanrl_style.protocol.utility import LINEAR, Utility
from sim.task.preference import check_weights
from sim.task.shifts import SHIFTS, shifts_of

# What a boreal environment reports of an episode at its end.
EPISODE_INFO = ("final_density", "mean_density", "final_conifer_fraction", "mean_conifer_fraction")


@dataclass(frozen=True)
class Task:
    """An environment's id and arguments, and what it says of itself; make one by `Task.of`."""

    env_id: str
    env_kwargs: dict  # arguments beside those that it was registered with
    objectives: tuple[str, ...]
    mode: str = "generalist"  # or "site-specific": the same site and weather in every episode
    thaw_formulation: str = "asymmetric"
    years: int | None = None  # steps of an episode; None if it does not say
    boreal: bool = False  # ours, by whatever id: compiled physics, an annual record, a preference that can be fixed
    bare: bool = False  # ours itself, in no wrapper that does more than watch the order of calls
    has_lockstep: bool = False
    draws_sites: bool = False  # a new site of ours in every episode
    shifts: tuple[str, ...] = ()  # ways out of the range that its sites are drawn from (`sim.task.shifts`)
    masks: Callable | None = None  # valid actions as a function of observations; None: the environment is called
    site_entries: tuple[int, ...] = ()  # entries of the observation that are site parameters
    observes_preference: bool = True  # at the front of the observation, all weights but the last
    fixes_preference: bool = False  # the environment plays one preference alone
    preference: np.ndarray | None = field(default=None, compare=False)  # of every training episode; None: drawn
    utility: Utility = LINEAR  # of an episode's return

    @staticmethod
    def of(env_id: str, **env_kwargs) -> "Task":
        """Ask the environment. Raises what making it raises, ValueError for one that the scripts cannot handle."""
        env = gym.make(env_id, disable_env_checker=True, **env_kwargs)
        one = env.unwrapped
        objectives = _check_spaces(env)
        names, width = attribute(env, "observation_names", ()), len(env.observation_space.low)
        if len(names) != width:  # a wrapper's, or another's; laid out like ours, its last entries are a site
            names = boreal_env.OBSERVATION_NAMES if width == len(boreal_env.OBSERVATION_NAMES) else ()
        bare = type(env.env if isinstance(env, OrderEnforcing) else env) is boreal_env.BorealEnv
        task = Task(
            env_id=env_id,
            env_kwargs=env_kwargs,
            objectives=objectives,
            bare=bare,
            has_lockstep=bare or env.spec.vector_entry_point is not None,
            site_entries=tuple(i for i, name in enumerate(names) if name.startswith("site_")),
        )
        if isinstance(one, boreal_env.BorealEnv):
            front = names[: len(objectives) - 1]
            draws_sites = one.mode == "generalist" and one.site_seed is None
            task = replace(
                task,
                boreal=True,
                mode=one.mode,
                thaw_formulation=one.thaw_formulation,
                years=one.years,
                draws_sites=draws_sites,
                fixes_preference=env.spec.kwargs.get("fixed_preference") is not None,
                shifts=shifts_of(env.spec.kwargs.get("boundary", "sampled")) if draws_sites else (),
                masks=one.mask_function() if bare else None,  # a wrapper may change what is observed
                observes_preference=all(name.startswith("preference") for name in front),
            )
        if not bare:
            task._check_behaviour(env)
        env.close()
        return task

    def _check_behaviour(self, env: gym.Env) -> None:
        """Refuse a user's environment that does not observe its preference, has no valid action, or pays otherwise."""
        weights = 2.0 ** -np.arange(1, len(self.objectives) + 1)  # exact in float32
        weights[-1] = 1 - weights[:-1].sum()
        weights = np.array([0.25, 0.75]) if len(weights) == 2 else weights
        seen = env.reset(seed=0, options={"preference": as_option(weights)})[0][: len(weights) - 1]
        if not np.array_equal(seen, weights[:-1]):
            entries = "observation 0" if len(weights) == 2 else f"observations 0 to {len(weights) - 2}"
            raise ValueError(f"reset(options={{'preference': w}}) must give w as {entries}")
        mask = as_mask(env.get_wrapper_attr("action_masks")())
        reward = env.step(int(mask.argmax()))[1]
        _check_rewards("step", reward, weights.shape)
        if self.boreal:  # an evaluation's environments, which a training would come to in hours
            try:
                self.make(**self.recording).close()
            except TypeError as error:
                raise ValueError(f"what makes it must hand its arguments on to BorealEnv: {error}") from error
        if self.has_lockstep:
            self._check_lockstep(weights, reward)

    def _check_lockstep(self, weights: np.ndarray, reward: np.ndarray) -> None:
        """Refuse a user's vector environment that restarts episodes, takes preferences or pays otherwise than ours.

        reward (m,) : what the single environment of the same seed and preference paid for the first valid action.
        """
        with contextlib.closing(self.make_lockstep(2)) as envs:
            if envs.metadata.get("autoreset_mode") is not gym.vector.AutoresetMode.SAME_STEP:
                raise ValueError("its vector environment must restart episodes within the step: SAME_STEP autoreset")
            both = np.stack([weights, weights[::-1]])
            observations, _ = envs.reset(seed=[0, 1], options={"preference": as_option(both)})
            if not np.array_equal(observations[:, : len(weights) - 1], both[:, :-1]):
                raise ValueError("its vector environment must give each its own of reset(options={'preference': ws})")
            actions = self.action_masks(envs, observations).argmax(axis=1)
            rewards = envs.step(actions)[1]
            _check_rewards("its vector environment", rewards, both.shape)
            if self.boreal and not np.allclose(rewards[0], reward):
                raise ValueError(f"its vector environment pays {rewards[0]} for what the single one pays {reward}")

    @property
    def num_objectives(self) -> int:
        """m, the length of its reward."""
        return len(self.objectives)

    @property
    def recording(self) -> dict:
        """Arguments of an environment whose episodes keep the annual record, if it has one."""
        return {"record_years": True} if self.boreal else {}

    @cached_property
    def episode_columns(self) -> tuple[str, ...]:
        """Columns of episodes.csv."""
        returns = (*return_columns(self.objectives), "scalarized_return")
        return ("global_step", "episode", "env", "site_seed", *weight_columns(self.objectives), *returns, *EPISODE_INFO)

    def weights_row(self, weights: np.ndarray) -> dict:
        """A table's columns of weights (m,)."""
        return dict(zip(weight_columns(self.objectives), weights, strict=self.num_objectives != 2))

    def returns_row(self, weights: np.ndarray, returns: np.ndarray) -> dict:
        """A table's columns of weights (m,), returns (m,) and scalarised return, which is their utility.

        FloatingPointError for returns that are not finite, as an environment's rewards may make them.
        """
        if not np.isfinite(returns).all():
            raise FloatingPointError(f"{self.env_id}: an episode's returns are {returns}: a reward was not finite")
        columns = dict(zip(return_columns(self.objectives), returns, strict=True))
        return {**self.weights_row(weights), **columns, "scalarized_return": self.utility(returns, weights)}

    def check_weights(self, value) -> np.ndarray:
        """Weights (m,) of a preference as flags give it; ValueError names what is allowed."""
        return check_weights(value, self.num_objectives)

    def with_preference(self, value) -> "Task":
        """The same, with one preference in every training episode."""
        return replace(self, preference=self.check_weights(value))

    def shifted(self, shift: str) -> "Task":
        """The same on sites of which one property is outside the sampled range; one of `shifts`."""
        own = gym.spec(self.env_id.split(":")[-1]).kwargs | self.env_kwargs
        overrides = {**(own.get("parameter_overrides") or {}), **SHIFTS[shift]}
        return replace(self, env_kwargs={**self.env_kwargs, "parameter_overrides": overrides})

    def action_masks(self, envs: gym.vector.VectorEnv, observations: np.ndarray) -> np.ndarray:
        """Valid actions, bool (n, 25): by the observations if they say it, else by calling every environment."""
        if self.masks is not None:
            return self.masks(observations)
        return np.stack([as_mask(answer) for answer in envs.call("action_masks")])

    def sample_sites(self, site_seeds) -> np.ndarray:
        """What is observed at `site_entries` of sites of ours with these seeds, (n, entries)."""
        sites = boreal_env.sample_site_observations(site_seeds)
        if sites.shape[1] != len(self.site_entries):
            own = f"--env-id {self.env_id}: it observes {len(self.site_entries)} site parameters, ours {sites.shape[1]}"
            fail(f"{own}, whose sites the selector's scores are centred by; --raw-selector does without")
        return sites

    def make(self, **kwargs) -> gym.Env:
        """One environment."""
        return gym.make(self.env_id, disable_env_checker=True, **{**self.env_kwargs, **kwargs})

    def make_lockstep(self, num_envs: int, **kwargs) -> gym.vector.VectorEnv:
        """Environments in lockstep, of a task that `has_lockstep`."""
        kwargs = {**self.env_kwargs, **kwargs}
        if gym.spec(self.env_id.split(":")[-1]).vector_entry_point is not None:
            return gym.make_vec(self.env_id, num_envs=num_envs, **kwargs)
        return gym.make(self.env_id, disable_env_checker=True).unwrapped.lockstep(num_envs, **kwargs)


def as_option(weights: np.ndarray):
    """Weights (..., m) as an environment's reset takes them: of two objectives, the first's alone."""
    return weights[..., 0][()] if weights.shape[-1] == 2 else weights  # [()]: of one preference a number


def as_mask(answer) -> np.ndarray:
    """What an environment's action_masks() gave, as bool (25,); ValueError if no action is valid."""
    mask = np.asarray(answer).astype(bool)
    if mask.shape != (25,) or not mask.any():
        raise ValueError(
            f"action_masks() must give 25 values, at least one of them true, "
            f"not {np.array2string(np.asarray(answer), threshold=30)}"
        )
    return mask


def final_info(infos: dict, i: int, keys=("site_seed", *EPISODE_INFO)) -> dict:
    """What environment i reported under these keys at its episode's end (gymnasium's SAME_STEP layout)."""

    def of_one(values):
        if isinstance(values, dict):
            return {key: of_one(value) for key, value in values.items() if not key.startswith("_")}
        return values[i]

    info = infos.get("final_info", {})
    return {key: of_one(info[key]) for key in keys if key in info}


def attribute(env: gym.Env, name: str, default=None):
    """What an environment, or a wrapper of it, has under that name."""
    return env.get_wrapper_attr(name) if env.has_wrapper_attr(name) else default


def _check_rewards(whose: str, rewards, shape: tuple[int, ...]) -> None:
    """ValueError for rewards of another shape, which numpy might spread over all objectives."""
    if np.shape(rewards) != shape:
        raise ValueError(f"{whose} must give rewards of shape {shape}, not {np.asarray(rewards).tolist()}")


def _check_spaces(env: gym.Env) -> tuple[str, ...]:
    """The environment's objectives; ValueError if its spaces are not those that the scripts know."""
    space, actions = env.observation_space, env.action_space
    if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
        raise ValueError(f"observations must be a Box of one dimension, not {space}")
    if not isinstance(actions, gym.spaces.Discrete) or actions.n != 25:
        raise ValueError(f"actions must be Discrete(25), not {actions}")
    number = attribute(env, "reward_dim")
    if not isinstance(number, (int, np.integer)) or number < 2 or not env.has_wrapper_attr("action_masks"):
        raise ValueError("the environment needs reward_dim, 2 or more, and action_masks()")
    unnamed = ("carbon", "thaw") if number == 2 else tuple(f"objective_{k}" for k in range(1, number + 1))
    names = tuple(attribute(env, "objective_names", unnamed))
    if len(names) != number or len(set(names)) < number or "scalarized" in names:
        raise ValueError(f"objective_names must be {number} different names, none of them scalarized, not {names}")
    return names
