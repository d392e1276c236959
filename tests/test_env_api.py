"""The environment through the doors of gymnasium and mo-gymnasium: ids, checkers, workers, copies, memory."""

import gc
import pickle
import threading
import tracemalloc
import warnings
from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from gymnasium.wrappers import TransformReward
from playing import ENTRIES, QUICK, THREE, TIMBER, WITHOUT_SITE, assert_same, play, quick, quick_vector, vector_trace

import boreal_env
import sim
from boreal_env import BorealEnv, BorealVectorEnv, Reward
from sim.state import PARAMETER_NAMES

IDS = ("boreal-generalist-v0", "boreal-site-specific-v0", "boreal-balanced-v0", "boreal-warming-v0")


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("prefix", ["", "boreal_env:"])
def test_all_ids(prefix, name):
    env = gym.make(prefix + name, **QUICK)
    assert isinstance(env.unwrapped, BorealEnv)
    size = WITHOUT_SITE if "site-specific" in name else ENTRIES
    assert env.observation_space.shape == env.reset(seed=1)[0].shape == (size,)
    assert env.action_space == gym.spaces.Discrete(25)
    assert env.unwrapped.reward_space == gym.spaces.Box(-1.0, 1.0, (2,), np.float32)
    assert env.unwrapped.reward_dim == 2


@pytest.mark.parametrize("name", IDS)
def test_all_ids_as_vector_environment(name):
    envs = gym.make_vec(f"boreal_env:{name}", num_envs=3, **QUICK)
    assert isinstance(envs.unwrapped, BorealVectorEnv)
    assert envs.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    observations, infos = envs.reset(seed=1)
    assert observations in envs.observation_space and infos == {}
    assert envs.single_observation_space.shape == (WITHOUT_SITE if "site-specific" in name else ENTRIES,)


def test_an_episode_is_fifty_years_by_default():
    assert gym.make("boreal-generalist-v0").unwrapped.years == 50


def test_the_balanced_id_is_in_balance_and_the_papers_are_the_papers():
    paper, balanced = (gym.make(name).unwrapped._episodes for name in ("boreal-generalist-v0", "boreal-balanced-v0"))
    assert paper.reward == Reward()
    assert balanced.reward == Reward(carbon_scale=1.8) != paper.reward
    for episodes, world in ((paper, ("sampled", "drawn", 0.0)), (balanced, ("balanced", "balanced", 1.0))):
        stands = episodes.stands
        assert (stands.boundary, stands.soil_carbon, stands.weather["weather_as_observed"]) == world


def test_the_balanced_boundary_is_observed():
    env = quick(**boreal_env.BALANCED_WORLD)
    observation, _ = env.reset(seed=3, options={"site": {"mean_annual_temperature_c": -16.0}})
    assert observation in env.observation_space
    name = "site_deep_boundary_temperature_k"
    found = boreal_env.in_unit(observation[None], name)[0]
    stands = env._episodes.stands
    assert found == pytest.approx(stands.parameters[0, PARAMETER_NAMES.index("deep_boundary_temperature_k")], abs=1e-3)
    assert found < sim.SITE_PARAMETERS["deep_boundary_temperature_k"].low  # a cold place is cold below


def test_the_balanced_id_keeps_its_constant_beside_others():
    def rewards(**kwargs):
        env = gym.make("boreal-balanced-v0", **kwargs)
        spec = gym.envs.registration.EnvSpec.from_json(env.spec.to_json())
        envs = gym.make_vec("boreal-balanced-v0", num_envs=2, **kwargs)
        made = env.unwrapped, gym.make(spec).unwrapped, envs.unwrapped
        copies = [pickle.loads(pickle.dumps(one)) for one in (made[0], made[2])]
        return {one._episodes.reward for one in (*made, *copies)}

    balanced = boreal_env.BALANCED_CARBON_SCALE
    assert rewards(reward={"warming_weight": 3.0}) == {Reward(carbon_scale=balanced, warming_weight=3.0)}
    assert rewards(reward={"carbon_scale": 0.4}) == {Reward(carbon_scale=0.4)}
    assert BorealEnv(balanced=True, reward=Reward(thaw_scale=3.0))._episodes.reward == Reward(thaw_scale=3.0)


@pytest.mark.parametrize("objectives", [("carbon", "thaw"), THREE, (TIMBER,)], ids=len)
@pytest.mark.parametrize("mode", boreal_env.MODES)
def test_gymnasiums_checker_is_satisfied(mode, objectives):
    env = TransformReward(quick(mode=mode, objectives=objectives), lambda reward: float(reward.sum()))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*different from the unwrapped version.*")
        check_env(env, skip_render_check=True)


def test_the_passive_checker_has_nothing_to_say_but_that_rewards_are_vectors():
    env = gym.make("boreal-generalist-v0", disable_env_checker=False, render_mode="rgb_array", **QUICK)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        env.reset(seed=1)
        for action in (0, 12, 24, 4):
            env.step(action)
        env.render()
    remarks = [str(w.message) for w in caught if not issubclass(w.category, DeprecationWarning)]  # of old matplotlibs
    assert len(remarks) == 1 and "reward returned by `step()` must be a float" in remarks[0]


def test_a_spawned_worker_needs_nothing_but_the_id():
    shorter = QUICK | {"time_step_minutes": 120}  # a new process allows no longer steps
    make = partial(gym.make, "boreal_env:boreal-generalist-v0", **shorter)
    envs = AsyncVectorEnv([make], autoreset_mode=AutoresetMode.SAME_STEP, context="spawn")
    try:
        observations, _ = envs.reset(seed=3)
        stepped, rewards, *_ = envs.step(np.array([24]))
    finally:
        envs.close()
    expected = play(quick(time_step_minutes=120), [24], seed=3)
    np.testing.assert_array_equal([observations[0], stepped[0]], expected[0])
    np.testing.assert_array_equal(rewards, expected[1])


def test_instances_do_not_disturb_each_other():
    one, other = quick(), quick(mode="site-specific")
    one.reset(seed=1), other.reset(seed=9)
    rewards = [(one.step(action)[1], other.step(24 - action)[1])[0] for action in (24, 0, 17, 3)]
    np.testing.assert_array_equal(rewards, play(quick(), [24, 0, 17, 3], seed=1)[1])


def test_mo_gymnasium_makes_it_too_and_weighs_its_rewards():
    mo_gymnasium = pytest.importorskip("mo_gymnasium", reason="not for Python 3.14")
    env = mo_gymnasium.make("boreal_env:boreal-generalist-v0", **QUICK)
    assert isinstance(env.unwrapped, BorealEnv)
    env = mo_gymnasium.wrappers.LinearReward(env, weight=np.array([0.25, 0.75]))
    env.reset(seed=1)
    _, reward, *_ = env.step(12)
    vector = play(quick(), [12] * 4, seed=1)[1][0]
    assert reward == pytest.approx(0.25 * vector[0] + 0.75 * vector[1], abs=1e-7)  # rewards are float32


def test_pickle_keeps_the_arguments():
    env = quick(thaw_formulation="contrast", reward={"carbon_scale": 0.4}, site_seed=3)
    env.reset(seed=8)
    copy = pickle.loads(pickle.dumps(env))
    for one, other in zip(play(env, [24, 0, 12, 7], seed=5), play(copy, [24, 0, 12, 7], seed=5), strict=True):
        assert_same(one, other)
    assert copy.thaw_formulation == "contrast" and copy._episodes.reward.carbon_scale == 0.4


def test_pickle_of_the_vector_environment_keeps_the_arguments():
    envs = quick_vector(4, group_size=2, reward={"carbon_scale": 0.4})
    actions = np.array([[24, 0, 12, 7], [3, 17, 24, 12]])
    expected = vector_trace(envs, actions, 5)  # threads are running now
    copy = pickle.loads(pickle.dumps(envs))
    assert (copy.num_envs, copy.group_size) == (4, 2)
    for one, other in zip(vector_trace(copy, actions, 5), expected, strict=True):
        for a, b in zip(one, other, strict=True):
            assert_same(a, b)


def test_memory_is_bounded_over_any_number_of_episodes():
    env = quick(years=20, time_step_minutes=1440, record_years=True)

    def memory_after(seeds):
        for seed in seeds:
            play(env, [24, 0] * 10, seed=seed)
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        before = memory_after(range(4))
        growth = memory_after(range(4, 12)) - before
    finally:
        tracemalloc.stop()
    assert growth < 4 * env._episodes.history.nbytes  # of eight episodes' records


def test_an_environment_says_what_it_is():
    env = gym.make("boreal-site-specific-v0", site_seed=5, thaw_formulation="contrast", objectives=THREE, years=7)
    for one in (env.unwrapped, env.unwrapped.lockstep(2)):
        assert (one.mode, one.years, one.site_seed, one.thaw_formulation) == ("site-specific", 7, 5, "contrast")
        assert (one.objective_names, one.reward_dim) == (("carbon", "thaw", "timber"), 3)
        assert one.observation_names[:3] == ("preference_carbon", "preference_thaw", "year")


def test_arguments_are_those_that_were_given_whatever_becomes_of_them():
    class Counted:
        def __init__(self):
            self.lock = threading.Lock()  # which nothing can copy

        def of(self, year):
            return year["harvest_kgc_m2"]

    overrides, groups, counted = {"q10": [1.9, 2.0]}, ["preference", "site"], Counted()
    objectives = ["carbon", boreal_env.Objective("harvest", counted.of)]
    env = quick(parameter_overrides=overrides, observation_groups=groups, objectives=objectives)
    before = env.reset(seed=1)[0]
    overrides["q10"][:], groups[:], objectives[:] = [2.2, 2.3], ["climate"], ["thaw"]
    np.testing.assert_array_equal(env.reset(seed=1)[0], before)
    np.testing.assert_array_equal(env.lockstep(1).reset(seed=1)[0][0], before)


def test_lockstep_has_the_same_arguments_but_for_the_changes():
    env = quick(site_seed=3, reward={"carbon_scale": 0.4}, render_mode="rgb_array")
    envs = env.lockstep(4, group_size=2, thaw_formulation="contrast")
    expected = quick_vector(4, site_seed=3, reward={"carbon_scale": 0.4}, group_size=2, thaw_formulation="contrast")
    actions = np.array([[24, 0, 12, 7], [3, 17, 24, 12]])
    for one, other in zip(vector_trace(envs, actions, 5), vector_trace(expected, actions, 5), strict=True):
        for a, b in zip(one, other, strict=True):
            assert_same(a, b)
    with pytest.raises(ValueError, match="unknown argument 'carbon_price'"):
        env.lockstep(4, carbon_price=3)
    assert envs.lockstep(6).group_size == 2 and envs.lockstep(3, group_size=1).group_size == 1


@pytest.mark.parametrize("years", [50, 3])
def test_its_spec_says_how_long_an_episode_is(years):
    env, envs = (make("boreal-generalist-v0", years=years) for make in (gym.make, gym.make_vec))
    assert env.spec.max_episode_steps == env.unwrapped.spec.max_episode_steps == envs.spec.max_episode_steps == years
    assert BorealEnv().spec is None and gym.spec("boreal-generalist-v0").max_episode_steps is None
    env = gym.make("boreal-generalist-v0", **{**QUICK, "years": 2})  # in no TimeLimit: its end is its own
    env.reset(seed=1)
    assert [env.step(12)[2:4] for _ in range(2)] == [(False, False), (True, False)]


def test_every_step_has_its_record_if_asked():
    env, envs = quick(record_steps=True, record_years=True), quick_vector(2, record_steps=True)
    env.reset(seed=3), envs.reset(seed=[3, 4])
    terminated, densities = False, []
    while not terminated:
        *_, terminated, _, info = env.step(22)
        *_, together = envs.step(np.array([22, 22]))
        assert tuple(info["record"]) == boreal_env.HISTORY_NAMES
        assert info["record"] == {name: together["record"][name][0] for name in boreal_env.HISTORY_NAMES}
        densities.append(info["record"]["density_stems_ha"])
    np.testing.assert_array_equal(densities, info["years"]["density_stems_ha"])
    assert together["_record"].all() and together["record"]["_density_stems_ha"].all()
