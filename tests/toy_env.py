"""A small multi-objective environment with a known optimum, of the kind that a user would bring.

Ten steps. Each step the ground is full or not, which is observed. Where it is full, planting (actions 15-24)
is invalid and costs 1; where it is not, failing to plant costs 0.5. The mix m in {0, .25, .5, .75, 1} earns
carbon m and thaw 1 - m^2.
"""

import gymnasium as gym
import numpy as np

LENGTH = 10
MIXES = np.linspace(0, 1, 5)


def optimal_return(preference: float) -> float:
    """Scalarised return of the best policy."""
    return LENGTH * float(np.max(preference * MIXES + (1 - preference) * (1 - MIXES**2)))


class ToyEnv(gym.Env):
    """Observation: preference, share of the episode gone, ground full or not.

    with_site: 105 entries, the last 62 of which are drawn in every episode and mean nothing; offset: taken from
    every reward, so that a policy gradient without a baseline does not settle for the first actions it tried.
    """

    def __init__(self, with_site: bool = False, offset: float = 0.0):
        self.offset = offset
        self.size = 105 if with_site else 3
        self.observation_space = gym.spaces.Box(0, 1, (self.size,), np.float32)
        self.action_space = gym.spaces.Discrete(25)
        self.reward_space = gym.spaces.Box(-2, 1, (2,), np.float32)
        self.reward_dim = 2

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.preference = self.np_random.random()
        if options and "preference" in options:
            self.preference = float(options["preference"])
        self.site = self.np_random.random(62) if self.size == 105 else np.zeros(0)
        self.steps = 0
        self.full = self.np_random.random() < 0.5
        return self._observation(), {}

    def _observation(self):
        observation = np.zeros(self.size, np.float32)
        observation[:3] = self.preference, self.steps / LENGTH, self.full
        observation[self.size - len(self.site) :] = self.site
        return observation

    def action_masks(self):
        masks = np.ones(25, dtype=bool)
        masks[15:] = not self.full
        return masks

    def step(self, action):
        cost = float(not self.action_masks()[action]) + 0.5 * (action < 15 and not self.full)
        mix = MIXES[action % 5]
        self.steps += 1
        self.full = self.np_random.random() < 0.5
        reward = np.array([mix - cost, 1 - mix**2 - cost], dtype=np.float32) - np.float32(self.offset)
        return self._observation(), reward, self.steps == LENGTH, False, {}


class LooseToyEnv(ToyEnv):
    """As one would write it without a thought for types: observations of float64, masks of integers."""

    def _observation(self):
        return super()._observation().astype(float)

    def action_masks(self):
        return super().action_masks().astype(np.int8)


class ThawlessToyEnv(ToyEnv):
    """Pays carbon alone."""

    def step(self, action):
        observation, reward, *rest = super().step(action)
        return observation, reward * np.float32([1, 0]), *rest


class HopelessToyEnv(ToyEnv):
    """With no valid action."""

    def action_masks(self):
        return np.zeros(25, dtype=bool)


class UnevenToyEnv(ToyEnv):
    """Every second episode is a step longer."""

    episodes = 0

    def reset(self, *, seed=None, options=None):
        observation, info = super().reset(seed=seed, options=options)
        self.episodes += 1
        self.steps = -(self.episodes % 2)
        return self._observation(), info

    def _observation(self):
        return np.clip(super()._observation(), 0, 1)


class ToyVectorEnv(gym.vector.VectorEnv):
    """All environments in one call, for `--vectorization lockstep`; their episodes end, and restart, together."""

    metadata = {"autoreset_mode": gym.vector.AutoresetMode.SAME_STEP}

    def __init__(self, num_envs: int = 1):
        self.num_envs = num_envs
        self.single_observation_space = gym.spaces.Box(0, 1, (3,), np.float32)
        self.single_action_space = gym.spaces.Discrete(25)
        self.generator = np.random.default_rng()

    def reset(self, *, seed=None, options=None):
        if seed is not None:
            self.generator = np.random.default_rng(seed)
        drawn = self.generator.random(self.num_envs)
        self.preference = np.asarray((options or {}).get("preference", drawn))
        self.steps = 0
        return self._observe(), {}

    def _observe(self):
        self.full = self.generator.random(self.num_envs) < 0.5
        share = np.full(self.num_envs, self.steps / LENGTH)
        return np.stack([self.preference, share, self.full], axis=1).astype(np.float32)

    def call(self, name):
        return np.where(np.arange(25) < 15, True, ~self.full[:, None])

    def step(self, actions):
        plants = actions >= 15
        cost, mix = np.where(self.full, 1.0 * plants, 0.5 * ~plants), MIXES[actions % 5]
        self.steps += 1
        ended = np.full(self.num_envs, self.steps == LENGTH)
        observations = self.reset()[0] if ended.all() else self._observe()
        rewards = np.stack([mix - cost, 1 - mix**2 - cost], axis=1)
        return observations, rewards, ended, np.zeros(self.num_envs, dtype=bool), {}


gym.register("toy-v0", entry_point="toy_env:ToyEnv")
gym.register("toy-lockstep-v0", entry_point="toy_env:ToyEnv", vector_entry_point="toy_env:ToyVectorEnv")
gym.register("toy-sites-v0", entry_point="toy_env:ToyEnv", kwargs={"with_site": True})
gym.register("toy-centred-v0", entry_point="toy_env:ToyEnv", kwargs={"offset": 0.6})
gym.register("loose-toy-v0", entry_point="toy_env:LooseToyEnv")
gym.register("thawless-toy-v0", entry_point="toy_env:ThawlessToyEnv")
gym.register("hopeless-toy-v0", entry_point="toy_env:HopelessToyEnv")


class ThreeToyEnv(ToyEnv):
    """Of three objectives: the mixture earns a third reward, most at one half. Observation: two weights first."""

    objective_names = ("carbon", "thaw", "variety")

    def __init__(self):
        super().__init__()
        self.observation_space = gym.spaces.Box(0, 1, (4,), np.float32)
        self.reward_space = gym.spaces.Box(-2, 1, (3,), np.float32)
        self.reward_dim = 3

    def reset(self, *, seed=None, options=None):
        weights = (options or {}).get("preference")
        super().reset(seed=seed)
        self.weights = self.np_random.dirichlet(np.ones(3)) if weights is None else np.asarray(weights)
        return self._observation(), {}

    def _observation(self):
        weights = getattr(self, "weights", np.zeros(3))
        return np.array([*weights[:2], self.steps / LENGTH, self.full], dtype=np.float32)

    def step(self, action):
        observation, reward, *rest = super().step(action)
        mix = MIXES[action % 5]
        return observation, np.append(reward, np.float32(4 * mix * (1 - mix))), *rest


gym.register("toy-three-v0", entry_point="toy_env:ThreeToyEnv")
gym.register("uneven-v0", entry_point="toy_env:UnevenToyEnv")
