"""What the commands share: the environment as a library trains on it, and the run folder that comes of it.

A library has its own loop and its own preferences. It gets an environment without the preference that ours observes,
in which it can take valid actions alone: random ones are drawn from them, and a network that has no mask is given one
(`masked`), so that all methods choose among the same actions. What it has learnt is evaluated as ours is.
"""

import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import gymnasium as gym
import numpy as np
import pandas as pd
import torch

from analysis.outside.arguments import Args
from cleanrl_style import protocol

try:
    import resource
except ImportError:  # Windows
    resource = None

INVALID = -1e8  # as a value or a logit: never the highest, and its probability is exactly 0
COST_COLUMNS = ("steps", "own_evaluation_steps", "peak_memory_mb")


# ---------------------------------------------------------------------------------------------- the environment


class ValidActions(gym.spaces.Discrete):
    """The actions, of which `sample` draws valid ones alone."""

    def __init__(self, env: gym.Env, seed: int):
        super().__init__(env.action_space.n, seed=seed)
        self.env = env

    def sample(self, mask=None, probability=None):
        """An action that can be carried out in full."""
        return super().sample(mask=self.env.get_wrapper_attr("action_masks")().astype(np.int8))


class Env(gym.Wrapper):
    """One environment, seeded by the run whatever a library asks for, without the preference in its observation.

    seeds : of the episodes, in turn for ever, or of the first of a stream of ever new ones (`repeat=False`).
    finished : called with the episode's number, returns and last info when it ends.
    """

    def __init__(self, task: protocol.Task, seeds: list[int], finished: Callable | None = None, repeat: bool = True):
        super().__init__(task.make())
        self.hidden = task.num_objectives - 1  # entries of the preference, at the front
        space = self.env.observation_space
        self.observation_space = gym.spaces.Box(space.low[self.hidden :], space.high[self.hidden :], dtype=space.dtype)
        self.action_space = ValidActions(self.env, seeds[0])
        self.seeds, self.finished, self.repeat = seeds, finished, repeat
        self.steps, self.episodes, self.seconds = 0, 0, 0.0

    def reset(self, *, seed=None, options=None):
        """The next episode."""
        begins = self.episodes == 0 or self.repeat
        start = time.perf_counter()
        observation, info = self.env.reset(seed=self.seeds[self.episodes % len(self.seeds)] if begins else None)
        self.seconds += time.perf_counter() - start
        self.episodes += 1
        self.returns = 0.0
        return observation[self.hidden :], info

    def step(self, action):
        """A year."""
        start = time.perf_counter()
        observation, reward, terminated, truncated, info = self.env.step(int(action))
        self.seconds += time.perf_counter() - start
        self.steps += 1
        self.returns = self.returns + reward.astype(np.float64)
        if terminated and self.finished is not None:
            self.finished(self, info)
        return observation[self.hidden :], reward, terminated, truncated, info

    def action_masks(self) -> np.ndarray:
        """Valid actions, bool (25,)."""
        return self.env.get_wrapper_attr("action_masks")()


class NoEnv(gym.Env):
    """Ends at once with nothing: for evaluations of a library's own whose results go to its log alone."""

    def __init__(self, env: Env):
        self.observation_space, self.action_space = env.observation_space, env.action_space
        self.observation = np.zeros(env.observation_space.shape, env.observation_space.dtype)
        self.reward = np.zeros(env.unwrapped.reward_dim, np.float32)

    def reset(self, *, seed=None, options=None):
        """Always the same."""
        return self.observation.copy(), {}

    def step(self, action):
        """The end."""
        return self.observation.copy(), self.reward.copy(), True, False, {}


def valid_actions(task: protocol.Task, observations: np.ndarray) -> np.ndarray:
    """Valid actions (n, 25) of observations (n, d) without the preference."""
    assert task.masks is not None
    unseen = np.zeros((len(observations), task.num_objectives - 1), np.float32)
    return task.masks(np.hstack([unseen, observations]))


def masked(task: protocol.Task, network: torch.nn.Module) -> None:
    """Have a network's outputs, (n, 25) or (n, 25, m), never favour an invalid action; its first input is observed."""

    def hook(module, inputs, outputs):
        observations = inputs[0].detach()
        mask = torch.from_numpy(valid_actions(task, observations.reshape(-1, observations.shape[-1]).numpy()))
        return torch.where(mask if outputs.dim() == 2 else mask[:, :, None], outputs, INVALID)

    network.register_forward_hook(hook)


def best_actions(values: np.ndarray) -> np.ndarray:
    """Probabilities (n, 25) of the policy that takes the action of the highest value (n, 25)."""
    return np.eye(25)[values.argmax(axis=1)]


# -------------------------------------------------------------------------------------------------- a run


@dataclass
class Session:
    """A run under way, as a command's `learn` gets it."""

    args: Args
    task: protocol.Task
    run: protocol.Run

    def __post_init__(self):
        self.envs: list = []  # each counts its steps, episodes and seconds
        self.own: list[Env] = []  # of a library's own evaluations
        self.progress = protocol.Progress("training", self.args.total_timesteps, "steps", 0, self.task.objectives)

    def env(self, weights=None) -> Env:
        """Another training environment, with episodes of its own.

        weights : of the agent that trains on it, by which its episodes are logged; None: equal ones.
        """
        m = self.task.num_objectives
        weights = np.full(m, 1 / m) if weights is None else weights

        def finished(env, info):
            self.finished(self.envs.index(env), weights, env.returns, info)

        first = self.args.seed * protocol.MAX_ENVS + len(self.envs)
        self.envs.append(Env(self.task, [first], finished, repeat=False))
        return self.envs[-1]

    def finished(self, number: int, weights: np.ndarray, returns: np.ndarray, info: dict) -> None:
        """Log an episode of the stand of that number, and show how far the training is."""
        step = sum(one.steps for one in self.envs)
        row = {"global_step": step, "episode": sum(one.episodes for one in self.envs), "env": number}
        row |= self.task.returns_row(weights, returns)
        row |= {name: info[name] for name in ("site_seed", *protocol.EPISODE_INFO)}
        self.run.log("episodes", row)
        self.progress.returns.append(returns)
        self.progress.show(step)

    def own_evaluation(self, episodes: int) -> Env:
        """An environment for a library's own evaluations: the same episodes, none of the published ones, in turn."""
        first = (self.args.seed + 1) * protocol.MAX_ENVS - 1
        self.own.append(Env(self.task, [first - k for k in range(episodes)]))
        return self.own[-1]


def main(script: str, args: Args, learn: Callable, samples: bool, check: Callable | None = None) -> None:
    """Train and evaluate as the script of that name.

    learn : Session -> policy, a function of weights (n, m), observations (n, d) without the preference, masks (n, 25)
    and accrued returns (n, m) that gives action probabilities (n, 25). samples : whether they are a distribution; if
    not, the sampled policy is the greedy one, and is played once. check : (args, task) -> None, ends the script with
    one line for a bad value before the run begins.
    """
    task = protocol.make_task(args)
    if not task.boreal or task.masks is None:
        protocol.fail(f"--env-id {args.env_id}: a boreal environment that observes the stand is allowed")
    if check is not None:
        check(args, task)
    tables = {"episodes": task.episode_columns, "cost": COST_COLUMNS}
    with protocol.Run(args, task, script, plays_validation=False, **tables) as run:
        random.seed(args.seed)
        np.random.seed(args.seed)  # noqa: NPY002, the libraries draw from it
        torch.manual_seed(args.seed)
        torch.set_num_threads(1)
        if args.num_envs == 1:
            protocol.compile_physics([1])
        session, start = Session(args, task, run), time.perf_counter()
        learnt = learn(session)
        seconds = time.perf_counter() - start
        steps, own = (sum(env.steps for env in envs) for envs in (session.envs, session.own))
        simulated = sum(env.seconds for env in session.envs + session.own)
        run.time("environment", steps, simulated)
        run.time("rollout", steps, simulated)
        run.time("update", steps, seconds - simulated)

        def policy(observations, masks, accrued_returns):
            weights = protocol.observed_weights(observations, task.num_objectives)
            return learnt(weights, observations[:, task.num_objectives - 1 :], masks, accrued_returns)

        start = time.perf_counter()
        policies = protocol.POLICIES if samples else ("greedy",)
        tables = protocol.evaluate(task, policy, args.eval_weights, args.eval_episodes, policies)
        if not samples:
            tables = [as_both(table) for table in tables]
        run.time("evaluation", steps, time.perf_counter() - start)
        run.log("cost", {"steps": steps, "own_evaluation_steps": own, "peak_memory_mb": peak_memory_mb()})
        run.finish(*tables)


def peak_memory_mb() -> float:
    """The largest memory of this process [MiB]; NaN on Windows, which does not say it so."""
    if resource is None:
        return np.nan
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10))


def as_both(table: pd.DataFrame) -> pd.DataFrame:
    """A table of the greedy policy once for every policy."""
    return pd.concat([table.assign(policy=policy) for policy in protocol.POLICIES], ignore_index=True)
