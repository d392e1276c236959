"""The evaluation protocol: every method on the same episodes, every weight on the same sites and weathers."""

import contextlib

import gymnasium as gym
import numpy as np
import pandas as pd

import boreal_env
from cleanrl_style.protocol.fronts import scalarize
from cleanrl_style.protocol.progress import Progress

# The mode of each id of this benchmark; any other id is a user's own environment.
MODES = {
    "boreal-generalist-v0": "generalist",
    "boreal-balanced-v0": "generalist",
    "boreal-site-specific-v0": "site-specific",
}
EVAL_WEIGHTS = tuple(i / 10 for i in range(11))
POLICIES = ("greedy", "sampled")
# Training uses seeds below this one, evaluation from this one on: the same for every method.
FIRST_EVALUATION_SEED = 1_000_000_000
# Stands stepped in one call: enough to fill eight cores' blocks of 16, and a bound on the memory.
CHUNK = 128

EVALUATION_INFO = ("growing_season_days", "latent_heat_mj_m2", "ground_shortwave_mj_m2")
EVALUATION_COLUMNS = (
    "policy",
    "preference",
    "episode",
    "seed",
    "site_seed",
    "carbon_return",
    "thaw_return",
    "scalarized_return",
    *EVALUATION_INFO,
)
# One more column for agents trained on another thaw formulation: the thaw return of the same episodes under it.
ASYMMETRIC = "asymmetric_thaw_return"


def action_masks(envs: gym.vector.VectorEnv, observations: np.ndarray, env_id: str) -> np.ndarray:
    """Valid actions, bool (n, 25); those of the boreal environments follow from the observations alone."""
    if env_id in MODES:
        return boreal_env.action_masks(observations)
    return np.stack([as_mask(answer, env_id) for answer in envs.call("action_masks")])


def as_mask(answer, env_id: str) -> np.ndarray:
    """What an environment's action_masks() gave, as bool (25,); ValueError if no action is valid."""
    mask = np.asarray(answer).astype(bool)
    if mask.shape != (25,) or not mask.any():
        raise ValueError(
            f"--env-id {env_id}: action_masks() must give 25 values, at least one of them true, "
            f"not {np.array2string(np.asarray(answer), threshold=30)}"
        )
    return mask


def final_info(infos: dict, i: int, keys) -> dict:
    """What environment i reported under these keys at its episode's end (gymnasium's SAME_STEP layout)."""

    def of_one(values):
        if isinstance(values, dict):
            return {key: of_one(value) for key, value in values.items() if not key.startswith("_")}
        return values[i]

    info = infos.get("final_info", {})
    return {key: of_one(info[key]) for key in keys if key in info}


class PlainLoop(gym.vector.VectorEnv):
    """Single environments stepped one after the other, for those without a vector entry point.

    An environment whose episode has ended is left alone: its last observation is repeated, with no reward.
    """

    def __init__(self, env_id: str, num_envs: int):
        self.num_envs = num_envs
        self.envs = [gym.make(env_id, disable_env_checker=True) for _ in range(num_envs)]

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
        """actions (n,); returns observations (n, d), rewards (n, 2), terminations, truncations, infos."""
        rewards = np.zeros((self.num_envs, 2))
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


def make_envs(env_id: str, env_kwargs: dict, num_envs: int) -> gym.vector.VectorEnv:
    """Environments in lockstep, the boreal ones with the annual record; else a plain loop."""
    if env_id in MODES:
        return gym.make_vec(env_id, num_envs=num_envs, record_years=True, **env_kwargs)
    if gym.spec(env_id.split(":")[-1]).vector_entry_point is not None:
        return gym.make_vec(env_id, num_envs=num_envs)
    return PlainLoop(env_id, num_envs)


def choose_actions(probabilities: np.ndarray, uniforms: np.ndarray | None) -> np.ndarray:
    """Actions (n,) for probabilities (n, 25): the most probable, or those drawn by a uniform number each."""
    if not np.isfinite(probabilities).all():
        raise FloatingPointError("the policy's action probabilities are not finite numbers: its training diverged")
    if uniforms is None:
        return probabilities.argmax(axis=1)
    cumulative = np.cumsum(probabilities, axis=1, dtype=np.float64)
    return (cumulative <= (uniforms * cumulative[:, -1])[:, None]).sum(axis=1)


def play(envs, env_id: str, policy, weights: np.ndarray, seeds: list[int], greedy: bool):
    """One episode in each environment; its returns (n, 2), and what each reported at its end."""
    # One stream of uniform numbers an episode, whatever the chunk, the weight and the method.
    generators = [np.random.default_rng([seed, 1]) for seed in seeds]
    observations, _ = envs.reset(seed=seeds, options={"preference": weights})
    returns, reports = np.zeros((len(seeds), 2)), [{} for _ in seeds]
    playing = np.ones(len(seeds), dtype=bool)
    while playing.any():
        observations = observations.astype(np.float32)
        probabilities = policy(observations, action_masks(envs, observations, env_id), returns)
        uniforms = None if greedy else np.array([generator.random() for generator in generators])
        actions = choose_actions(probabilities, uniforms)
        observations, rewards, terminations, truncations, infos = envs.step(actions)
        returns[playing] += rewards[playing]
        ended = playing & (terminations | truncations)
        for i in np.flatnonzero(ended):
            reports[i] = final_info(infos, i, ("site_seed", "years", *EVALUATION_INFO))
        playing &= ~ended
    return returns, reports


def evaluate(args, env_kwargs: dict, policy, weights=None, policies=POLICIES):
    """Evaluate a policy: every weight on the same episodes, by its most probable actions and by sampled ones.

    policy: a function of observations (n, d) float32, masks (n, 25) bool and accrued returns (n, 2), giving
    action probabilities (n, 25). Returns the table of episodes (EVALUATION_COLUMNS; with a thaw formulation other
    than asymmetric also ASYMMETRIC) and the statistics of the annual record over the episodes of each weight (None
    if the environment keeps no such record).
    """
    weights = args.eval_weights if weights is None else weights
    # A greedy policy in site-specific mode does the same in every episode.
    episodes = {
        kind: 1 if kind == "greedy" and args.mode == "site-specific" else args.eval_episodes for kind in policies
    }
    progress = Progress("evaluation", sum(episodes.values()) * len(weights), "episodes")
    rows, years = [], []
    for kind in policies:
        jobs = [(weight, episode) for weight in weights for episode in range(episodes[kind])]
        records = {weight: [] for weight in weights}
        for start in range(0, len(jobs), CHUNK):
            chunk = jobs[start : start + CHUNK]
            chunk_weights = np.array([weight for weight, _ in chunk])
            seeds = [FIRST_EVALUATION_SEED + episode for _, episode in chunk]
            with contextlib.closing(make_envs(args.env_id, env_kwargs, len(chunk))) as envs:
                returns, reports = play(envs, args.env_id, policy, chunk_weights, seeds, kind == "greedy")
            for (weight, episode), seed, (carbon, thaw), report in zip(chunk, seeds, returns, reports, strict=True):
                if "years" in report:
                    records[weight].append(report.pop("years"))
                if args.thaw_formulation != "asymmetric":
                    report[ASYMMETRIC] = asymmetric_thaw_return(records[weight][-1])
                rows.append(
                    {
                        "policy": kind,
                        "preference": weight,
                        "episode": episode,
                        "seed": seed,
                        "carbon_return": carbon,
                        "thaw_return": thaw,
                        "scalarized_return": scalarize(carbon, thaw, weight),
                        **report,
                    }
                )
            progress.show(len(rows))
        years += [summarize_years(kind, weight, record) for weight, record in records.items() if record]
    other_formulation = (ASYMMETRIC,) if args.thaw_formulation != "asymmetric" else ()
    table = pd.DataFrame(rows, columns=(*EVALUATION_COLUMNS, *other_formulation))
    return table, pd.concat(years, ignore_index=True) if years else None


def asymmetric_thaw_return(record: dict) -> float:
    """Thaw return of an episode's annual record under the paper's asymmetric reward, whatever it was played for."""
    rewards = boreal_env.thaw_reward(
        record["boundary_cooling_mj_m2"], record["boundary_warming_mj_m2"], boreal_env.Reward(), "asymmetric"
    )
    return float(np.clip(rewards, -1, 1).sum())


def summarize_years(policy: str, weight: float, records: list[dict]) -> pd.DataFrame:
    """Statistics over episodes of every variable of the annual record; years count from 1."""
    names = [name for name in records[0] if name != "year"]
    # (episodes, variables, years)
    values = np.array([[record[name] for name in names] for record in records])
    low, median, high = np.percentile(values, [10, 50, 90], axis=0)
    columns = {"mean": values.mean(axis=0), "sd": values.std(axis=0), "p10": low, "p50": median, "p90": high}
    return pd.DataFrame(
        {
            "policy": policy,
            "preference": weight,
            "year": np.repeat(np.arange(1, values.shape[2] + 1), len(names)),
            "variable": np.tile(names, values.shape[2]),
            **{name: column.T.ravel() for name, column in columns.items()},
        }
    )
