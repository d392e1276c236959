"""Environments that are quick to play, and playing them: what the tests of the environment share."""

import numpy as np

from boreal_env import OBSERVATION, OBSERVATION_NAMES, BorealEnv, BorealVectorEnv, Objective

QUICK = {"years": 4, "time_step_minutes": 240}
INDEX = {name: i for i, name in enumerate(OBSERVATION_NAMES)}
ENTRIES = len(OBSERVATION)
WITHOUT_SITE = sum(row.group != "site" for row in OBSERVATION)
SITE = slice(WITHOUT_SITE, ENTRIES)
CLIMATE = slice(INDEX["latitude"], INDEX["growing_season_length"] + 1)
ACTIONS = [24, 0, 17, 3]
NAN = float("nan")


def quick(**kwargs):
    return BorealEnv(**{**QUICK, **kwargs})


def quick_vector(number, **kwargs):
    return BorealVectorEnv(number, **{**QUICK, **kwargs})


def play(env, actions, **reset):
    """Observations (first included), rewards and the last info of an episode under given actions."""
    observations, rewards, info = [env.reset(**reset)[0]], [], {}
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        observations.append(observation)
        rewards.append(reward)
        assert not truncated
    assert terminated == (len(actions) == env.unwrapped.years)
    return np.array(observations), np.array(rewards), info


def assert_same(a, b):
    """Equal in structure, types and to the bit, NaN beside NaN."""
    if isinstance(a, dict):
        assert list(a) == list(b)
        for key in a:
            assert_same(a[key], b[key])
    elif isinstance(a, np.ndarray) and a.dtype == object:
        assert a.shape == b.shape
        for one, other in zip(a.flat, b.flat, strict=True):
            assert_same(one, other)
    else:
        assert np.asarray(a).dtype == np.asarray(b).dtype
        np.testing.assert_array_equal(a, b)


def loop(number, actions, seed, **kwargs):
    """Single environments one after the other, restarted as SAME_STEP does."""
    envs = [quick(**kwargs) for _ in range(number)]
    trace = [np.array([env.reset(seed=seed + i)[0] for i, env in enumerate(envs)])]
    for row in actions:
        steps = [env.step(action) for env, action in zip(envs, row, strict=True)]
        observations, rewards, ends, _, infos = zip(*steps, strict=True)
        finals = [info for info in infos if info]
        shown = [env.reset()[0] if end else obs for env, obs, end in zip(envs, observations, ends, strict=True)]
        trace.append((np.array(shown), np.array(rewards), np.array(ends), np.array(observations), finals))
    return trace


def of_environment(infos, i):
    """The entries of one environment in infos of arrays, as gymnasium nests them."""
    values = {key: value for key, value in infos.items() if not key.startswith("_")}
    return {k: of_environment(v, i) if isinstance(v, dict) else v[i] for k, v in values.items()}


def vector_trace(envs, actions, seed):
    trace = [envs.reset(seed=seed)[0]]
    for row in actions:
        trace.append(envs.step(row))
    return trace


BIOMASS_LIMIT, SOIL_LIMIT = 0.05, 18.0  # kgC m-2; of the paper's 15 and 20 a burnt stand stays short


def eventful_episode():
    """An episode that burns, is infested, planted and thinned: observations, rewards, the annual record, the env."""
    site = {"fire_base_probability": 0.05, "fire_drought_threshold": 5.0, "insect_base_probability": 1.0}
    ranges = {"density_stems_ha": (800.0, 900.0), "soil_kgc_m2": (21.0, 22.0)}
    reward = {"biomass_limit": BIOMASS_LIMIT, "soil_limit": SOIL_LIMIT}
    env = quick(record_years=True, parameter_overrides=site, initial_ranges=ranges, years=6, reward=reward)
    actions = [24, 3, 16, 0, 11, 2]
    observations, rewards, info = play(env, actions, seed=6, options={"preference": 0.3})
    assert info["years"]["fire_mortality"].max() > 0.0 and info["years"]["insect_mortality"].max() > 0.0
    assert info["years"]["thinned_stems_ha"].max() > 0.0 and info["years"]["planted_stems_ha"].max() > 0.0
    return observations.astype(float), rewards, info, actions, env


PRICE = 200.0  # of a kgC/m2 of timber


def timber_revenue(year):
    """What the timber of a year is sold for, less what planting costs."""
    return PRICE * year["harvest_kgc_m2"] - 0.1 * year["planted_stems_ha"]


TIMBER = Objective("timber", timber_revenue, low=-10.0, high=100.0)
THREE = ("carbon", "thaw", TIMBER)
OLD_STAND = {"density_stems_ha": (900.0, 900.0), "biomass_kgc_m2": (8.0, 9.0), "oldest_age_years": (120.0, 120.0)}
