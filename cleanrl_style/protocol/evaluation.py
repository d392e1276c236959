"""The evaluation protocol: every method on the same episodes, every weight on the same sites and weathers."""

import contextlib
import math

import gymnasium as gym
import numpy as np
import pandas as pd

import boreal_env
from cleanrl_style.protocol.compilation import compile_physics
from cleanrl_style.protocol.fronts import return_columns, weight_columns
from cleanrl_style.protocol.progress import Progress
from cleanrl_style.protocol.sites import of_split
from cleanrl_style.protocol.task import Task, as_option, final_info
from sim.block import lanes_for
from sim.stands import available_cores

#: What is evaluated of an agent: its most probable action, and one drawn from its probabilities.
POLICIES = ("greedy", "sampled")
# The policy that results are about: one acts by it, and no exploration is left in it (docs/decisions.md, 64).
PRIMARY = "greedy"
# Stands stepped in one call: enough to fill eight cores' blocks of 16 where half of them are alike, and a bound on the
# memory.
CHUNK = 256

EVALUATION_INFO = ("growing_season_days", "latent_heat_mj_m2", "ground_shortwave_mj_m2")
# One more column for agents trained on another thaw formulation: the thaw return of the same episodes under it.
ASYMMETRIC = "asymmetric_thaw_return"


def evaluation_columns(objectives) -> tuple[str, ...]:
    """Columns of evaluation.csv."""
    returns = (*return_columns(objectives), "scalarized_return")
    return ("policy", *weight_columns(objectives), "episode", "seed", "site_seed", *returns, *EVALUATION_INFO)


class PlainLoop(gym.vector.VectorEnv):
    """Single environments stepped one after the other, for those without a vector entry point.

    An environment whose episode has ended is left alone: its last observation is repeated, with no reward.
    """

    def __init__(self, task: Task, num_envs: int):
        self.num_envs, self.num_objectives = num_envs, task.num_objectives
        self.envs = [task.make(**task.recording) for _ in range(num_envs)]

    def reset(self, *, seed: list[int], options: dict):
        """seed: one per environment; options: preference, one per environment."""
        self.ended, self.answers = np.zeros(self.num_envs, dtype=bool), [None] * self.num_envs
        self.observations = np.stack(
            [
                env.reset(seed=env_seed, options={"preference": preference})[0]
                for env, env_seed, preference in zip(self.envs, seed, options["preference"], strict=True)
            ]
        )
        return self.observations.copy(), {}

    def step(self, actions: np.ndarray):
        """actions (n,); returns observations (n, d), rewards (n, m), terminations, truncations, infos."""
        rewards = np.zeros((self.num_envs, self.num_objectives))
        terminations, truncations, infos = self.ended.copy(), np.zeros(self.num_envs, dtype=bool), {}
        for i in np.flatnonzero(~self.ended):
            step = self.envs[i].step(int(actions[i]))
            self.observations[i], rewards[i], terminations[i], truncations[i], info = step
            if terminations[i] or truncations[i]:
                infos = self._add_info(infos, {"final_info": info}, i)
        self.ended |= terminations | truncations
        return self.observations.copy(), rewards, terminations, truncations, infos

    def call(self, name: str) -> tuple:
        """Result of a method of every environment; of one whose episode has ended, its last answer."""
        for i in np.flatnonzero(~self.ended):
            self.answers[i] = self.envs[i].get_wrapper_attr(name)()
        return tuple(self.answers)

    def close_extras(self, **kwargs) -> None:
        """Close every environment."""
        for env in self.envs:
            env.close()


def check_probabilities(probabilities, shape: tuple[int, int]) -> None:
    """Raise a ValueError for what are no probabilities; `choose_actions` refuses those that are not finite."""
    if np.shape(probabilities) != shape:
        raise ValueError(f"a policy's probabilities: shape {shape} is allowed, got {np.shape(probabilities)}")
    sums = np.sum(probabilities, axis=1, dtype=np.float64)
    if np.min(probabilities) < 0.0 or np.abs(sums - 1.0).max() > 1e-3:
        got = f"got {np.min(probabilities):g} and {sums[np.abs(sums - 1.0).argmax()]:g}"
        raise ValueError(f"a policy's probabilities: none below 0 and sums of 1 are allowed, {got}")


def choose_actions(probabilities: np.ndarray, uniforms: np.ndarray | None) -> np.ndarray:
    """Actions (n,) for probabilities (n, 25): the most probable, or those drawn by a uniform number each."""
    if not np.isfinite(probabilities).all():
        raise FloatingPointError("the policy's action probabilities are not finite numbers: its training diverged")
    if uniforms is None:
        return probabilities.argmax(axis=1)
    cumulative = np.cumsum(probabilities, axis=1, dtype=np.float64)
    return (cumulative <= (uniforms * cumulative[:, -1])[:, None]).sum(axis=1)


def play(task: Task, envs, policy, weights: np.ndarray, seeds: list[int], greedy: np.ndarray):
    """One episode in each environment, under weights (n, m), by the most probable actions where `greedy` (n,) is true.

    Returns the episodes' returns (n, m), and what each reported at its end.
    """
    # One stream of uniform numbers an episode, whatever the chunk, the weight and the method.
    generators = [np.random.default_rng([seed, 1]) for seed in seeds]
    observations, _ = envs.reset(seed=seeds, options={"preference": as_option(weights)})
    returns, reports = np.zeros((len(seeds), task.num_objectives)), [{} for _ in seeds]
    playing = np.ones(len(seeds), dtype=bool)
    while playing.any():
        observations = observations.astype(np.float32)
        masks = task.action_masks(envs, observations)
        probabilities = np.asarray(policy(observations, masks, returns.copy()))
        check_probabilities(probabilities, masks.shape)
        uniforms = np.array([generator.random() for generator in generators])
        drawn = choose_actions(probabilities, uniforms)
        actions = np.where(greedy, choose_actions(probabilities, None), drawn)
        observations, rewards, terminations, truncations, infos = envs.step(actions)
        returns[playing] += rewards[playing]
        ended = playing & (terminations | truncations)
        for i in np.flatnonzero(ended):
            reports[i] = final_info(infos, i, ("site_seed", "years", *EVALUATION_INFO))
        playing &= ~ended
    return returns, reports


def make_envs(task: Task, num_envs: int) -> gym.vector.VectorEnv:
    """Environments in lockstep, else a plain loop; ours with the annual record."""
    return task.make_lockstep(num_envs, **task.recording) if task.has_lockstep else PlainLoop(task, num_envs)


def episodes_by_policy(task: Task, episodes: int, policies=POLICIES) -> dict[str, int]:
    """Episodes of each weight: a greedy policy in site-specific mode does the same in every one."""
    return {kind: 1 if kind == "greedy" and task.mode == "site-specific" else episodes for kind in policies}


def lanes_of_evaluation(task: Task, weights: int, episodes: int, policies=POLICIES) -> set[int]:
    """Lanes of the kernels that an evaluation needs, of so many weights."""
    return lanes_of(task, weights * sum(episodes_by_policy(task, episodes, policies).values()))


def lanes_of(task: Task, number: int) -> set[int]:
    """Lanes of the kernels that so many episodes need."""
    return {lanes_for(len(chunk) if task.has_lockstep else 1, available_cores()) for chunk in chunks(number)}


def chunks(number: int) -> list[range]:
    """Episodes that are stepped in one call each: all of nearly the same size, so that one kernel does."""
    size = math.ceil(number / math.ceil(number / CHUNK))
    return [range(first, min(first + size, number)) for first in range(0, number, size)]


def evaluate(task: Task, policy, weights, episodes: int, policies=POLICIES, split: str = "test"):
    """Evaluate a policy: every weight on the same episodes, by its most probable actions and by sampled ones.

    policy : a function of observations (n, d) float32, masks (n, 25) bool and accrued returns (n, m), giving action
    probabilities (n, 25). weights : each a number (of two objectives, the first's weight) or m numbers. episodes : how
    many of each weight, on the first sites of split: "test", "validation" or one outside the range of training
    (`sim.task.shifts`).
    Returns the table of episodes (`evaluation_columns`; with a thaw formulation other than asymmetric also ASYMMETRIC)
    and the statistics of the annual record over the episodes of each weight (None if there is no such record).
    """
    if not callable(policy):
        raise ValueError(f"policy {policy!r}: a function is allowed, such as protocol.load_policy gives")
    weights = check_asked(task, weights, policies)
    numbers = episodes_by_policy(task, episodes, policies)
    task, seeds = of_split(task, episodes, split)
    if task.boreal:
        compile_physics(lanes_of_evaluation(task, len(weights), episodes, policies))
    other_formulation = (ASYMMETRIC,) if "thaw" in task.objectives and task.thaw_formulation != "asymmetric" else ()
    # all policies and weights of a site side by side, so that it is spun up once
    jobs = [
        (kind, k, episode)
        for episode in range(episodes)
        for kind in policies
        if episode < numbers[kind]
        for k in range(len(weights))
    ]
    progress = Progress("evaluation", len(jobs), "episodes")
    rows, records = {}, {(kind, k): [] for kind in policies for k in range(len(weights))}
    for part in chunks(len(jobs)):
        chunk = [jobs[number] for number in part]
        its_weights = np.array([weights[k] for _, k, _ in chunk])
        its_seeds = [seeds[episode] for *_, episode in chunk]
        greedy = np.array([kind == "greedy" for kind, *_ in chunk])
        with contextlib.closing(make_envs(task, len(chunk))) as envs:
            returns, reports = play(task, envs, policy, its_weights, its_seeds, greedy)
        for (kind, k, episode), seed, its_returns, report in zip(chunk, its_seeds, returns, reports, strict=True):
            if "years" in report:
                records[kind, k].append(report.pop("years"))
                if other_formulation:
                    report[ASYMMETRIC] = asymmetric_thaw_return(records[kind, k][-1])
            returned = task.returns_row(weights[k], its_returns)
            rows[kind, k, episode] = {"policy": kind, "episode": episode, "seed": seed, **returned, **report}
        progress.show(len(rows))
    in_order = [
        rows[kind, k, episode] for kind in policies for k in range(len(weights)) for episode in range(numbers[kind])
    ]
    years = [
        summarize_years({"policy": kind, **task.weights_row(weights[k])}, record)
        for (kind, k), record in records.items()
        if record
    ]
    table = pd.DataFrame(in_order, columns=(*evaluation_columns(task.objectives), *other_formulation))
    return table, pd.concat(years, ignore_index=True) if years else None


def check_asked(task: Task, weights, policies) -> list[np.ndarray]:
    """The weights, each (m,). Raises ValueError for what cannot be evaluated."""
    if not isinstance(task, Task):
        raise ValueError(f"task {task!r}: protocol.Task.of(env_id) gives one")
    if isinstance(policies, str) or not len(policies) or not set(policies) <= set(POLICIES):
        raise ValueError(f"policies {policies!r}: a list or tuple of {', '.join(POLICIES)} is allowed")
    if len(set(policies)) < len(policies):
        raise ValueError(f"policies {policies!r}: each is allowed once")
    if not np.iterable(weights) or not len(weights):
        raise ValueError(f"weights {weights!r}: a list of at least one is allowed")
    found = [task.check_weights(value) for value in weights]
    if len(np.unique(found, axis=0)) < len(found):
        raise ValueError(f"weights {weights!r}: each is allowed once")
    return found


def asymmetric_thaw_return(record: dict) -> float:
    """Thaw return of an episode's annual record under the paper's asymmetric reward, whatever it was played for."""
    rewards = boreal_env.thaw_reward(
        record["boundary_cooling_mj_m2"], record["boundary_warming_mj_m2"], boreal_env.Reward(), "asymmetric"
    )
    return float(np.clip(rewards, -1, 1).sum())


def summarize_years(key: dict, records: list[dict]) -> pd.DataFrame:
    """Statistics over episodes of every variable of the annual record, after the columns of `key`; years from 1."""
    names = [name for name in records[0] if name != "year"]
    # (episodes, variables, years)
    values = np.array([[record[name] for name in names] for record in records])
    low, median, high = np.percentile(values, [10, 50, 90], axis=0)
    columns = {"mean": values.mean(axis=0), "sd": values.std(axis=0), "p10": low, "p50": median, "p90": high}
    return pd.DataFrame(
        {
            **key,
            "year": np.repeat(np.arange(1, values.shape[2] + 1), len(names)),
            "variable": np.tile(names, values.shape[2]),
            **{name: column.T.ravel() for name, column in columns.items()},
        }
    )
