"""Many stands in lockstep: the same as one by one, groups, resets of a part, refusals."""

import importlib.util
import threading

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from playing import INDEX, QUICK, SITE, assert_same, loop, of_environment, quick, quick_vector, vector_trace

import boreal_env
import sim
from boreal_env import BorealEnv, BorealVectorEnv


def test_stable_baselines3_is_named_where_it_is_missing(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(gym.error.DependencyNotInstalled, match=r'^stable_baselines3\(\): pip install -e "\.\[sb3\]"$'):
        quick_vector(2).stable_baselines3()


def test_nothing_is_compiled_for_no_stands():
    with pytest.raises(ValueError, match="num_envs: a positive integer is allowed, got -1"):
        boreal_env.warm_up(-1)
    with pytest.raises(ValueError, match="threads: a positive integer is allowed, got 0"):
        boreal_env.warm_up(threads=0)


@pytest.mark.parametrize("mode", boreal_env.MODES)
def test_async_lockstep_and_a_plain_loop_agree_to_the_bit(mode):
    number, kwargs = 3, {**QUICK, "mode": mode, "record_years": True}
    actions = np.random.default_rng(1).integers(0, 25, (9, number))  # two episodes of four years, and a bit
    expected = loop(number, actions, 21, mode=mode, record_years=True)
    lockstep = vector_trace(BorealVectorEnv(number, **kwargs), actions, 21)
    parallel = AsyncVectorEnv([lambda: BorealEnv(**kwargs)] * number, autoreset_mode=AutoresetMode.SAME_STEP)
    try:
        workers = vector_trace(parallel, actions, 21)
    finally:
        parallel.close()
    np.testing.assert_array_equal(lockstep[0], expected[0])
    np.testing.assert_array_equal(workers[0], expected[0])
    for (shown, rewards, ends, final_observations, finals), *vectors in zip(
        expected[1:], lockstep[1:], workers[1:], strict=True
    ):
        for observations, got, terminated, truncated, infos in vectors:
            np.testing.assert_array_equal(observations, shown)
            np.testing.assert_array_equal(got, rewards)
            np.testing.assert_array_equal(terminated, ends)
            assert not truncated.any()
            assert bool(infos) == ends.any()
            if ends.any():
                np.testing.assert_array_equal(np.stack(infos["final_obs"]), final_observations)
                for i, final in enumerate(finals):
                    assert_same(of_environment(infos["final_info"], i), final)
    assert sum(len(step[4]) for step in expected[1:]) == 2 * number
    for one, other in zip(lockstep[1:], workers[1:], strict=True):
        assert_same(one[4], other[4])


@pytest.mark.parametrize("number", [2, 16, 21])
def test_the_number_of_environments_does_not_matter(number):
    actions = np.random.default_rng(2).integers(0, 25, (5, 21))[:, :number]
    envs = vector_trace(quick_vector(number), actions, 100)
    first = vector_trace(quick_vector(1), actions[:, :1], 100)
    for one, many in zip(first[1:], envs[1:], strict=True):
        np.testing.assert_array_equal(many[0][0], one[0][0])
        np.testing.assert_array_equal(many[1][0], one[1][0])


def test_vector_options_are_spread_or_given_one_by_one():
    envs = quick_vector(3)
    observations, _ = envs.reset(seed=1, options={"preference": 0.4, "site": {"q10": 2.0}})
    assert (observations[:, 0] == np.float32(0.4)).all()
    np.testing.assert_allclose(observations[:, INDEX["site_q10"]], 0.4, rtol=1e-5)
    options = {"preference": [0.1, 0.2, 0.3], "site": [{"q10": 2.0}, None, {"q10": 2.1}]}
    observations, _ = envs.reset(seed=1, options=options)
    np.testing.assert_allclose(observations[:, 0], [0.1, 0.2, 0.3], rtol=1e-6)
    expected = (sim.sample_site(int(envs._episodes.site_seeds[1]))["q10"] - 1.8) / 0.5
    np.testing.assert_allclose(observations[:, INDEX["site_q10"]], [0.4, expected, 0.6], rtol=1e-5)


def test_a_list_of_seeds():
    envs = quick_vector(3)
    observations, _ = envs.reset(seed=[7, 3, 7])
    np.testing.assert_array_equal(observations[0], observations[2])
    np.testing.assert_array_equal(observations[1], quick().reset(seed=3)[0])


def test_a_partial_reset_restarts_only_what_it_names():
    envs, undisturbed = quick_vector(3), quick_vector(3)
    actions = np.array([24, 0, 12])
    for env in (envs, undisturbed):
        env.reset(seed=1)
        env.step(actions)
    observations, _ = envs.reset(seed=[50, 51, 52], options={"reset_mask": np.array([False, True, False])})
    np.testing.assert_array_equal(observations[1], quick().reset(seed=51)[0])
    after, rewards, *_ = envs.step(actions)
    expected, expected_rewards, *_ = undisturbed.step(actions)
    for i in (0, 2):
        np.testing.assert_array_equal(after[i], expected[i])
        np.testing.assert_array_equal(rewards[i], expected_rewards[i])
    assert after[1, INDEX["year"]] == np.float32(1 / 50)


def test_the_first_reset_is_of_all():
    envs = quick_vector(3)
    with pytest.raises(ValueError, match="reset_mask: environment 1 has not begun, and has to be among the first"):
        envs.reset(seed=1, options={"reset_mask": np.array([True, False, True])})


def test_a_refused_seed_leaves_the_others():
    envs, untouched = quick_vector(2), quick_vector(2)
    for env in (envs, untouched):
        env.reset(seed=1)
    with pytest.raises(ValueError, match="seed: .* got -1"):
        envs.reset(seed=[77, -1])
    np.testing.assert_array_equal(envs.reset()[0], untouched.reset()[0])


def test_a_years_record_at_an_episodes_end_is_where_gymnasium_has_it():
    make = [lambda: quick(years=1, record_steps=True)] * 2
    both = quick_vector(2, years=1, record_steps=True), AsyncVectorEnv(make, autoreset_mode=AutoresetMode.SAME_STEP)
    found = []
    for envs in both:
        envs.reset(seed=1)
        found.append(envs.step(np.array([24, 12]))[4]["final_info"]["record"])
        envs.close()
    assert_same(*found)


def test_threads_end_when_it_is_closed():
    envs = quick_vector(20, threads=2)
    before = threading.active_count()
    envs.reset(seed=1)
    envs.step(np.full(20, 12))
    envs.close()
    assert threading.active_count() == before


def test_a_group_shares_site_and_weather_in_every_episode_not_the_preference():
    envs = quick_vector(6, group_size=3, record_years=True)
    observations, _ = envs.reset(seed=1)
    actions = np.array([24, 24, 24, 3, 3, 12])
    for _ in range(2):
        for group in (slice(0, 3), slice(3, 6)):
            np.testing.assert_array_equal(observations[group, 1:], np.repeat(observations[group, 1:][:1], 3, axis=0))
            assert len(set(observations[group, 0])) == 3
        assert not np.array_equal(observations[0, SITE], observations[3, SITE])
        for _ in range(4):
            observations, rewards, *_, infos = envs.step(actions)
        years = infos["final_info"]["years"]
        for name in ("precipitation_mm", "air_temperature_c"):
            np.testing.assert_array_equal(years[name][3], years[name][5])
        for name in sim.RECORD_NAMES:
            np.testing.assert_array_equal(years[name][0], years[name][2], err_msg=name)
        assert not np.array_equal(years["density_stems_ha"][3], years["density_stems_ha"][5])


def test_of_the_seeds_in_a_group_the_first_is_the_worlds():
    envs = quick_vector(4, group_size=2)
    one, other = (envs.reset(seed=seeds)[0] for seeds in ([1, 2, 3, 4], [1, 98, 3, 99]))
    np.testing.assert_array_equal(one[:, 1:], other[:, 1:])
    assert (one[:, 0] == other[:, 0]).tolist() == [True, False, True, False]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"reset_mask": np.array([True, True, True, False])}, r"reset_mask: .* stands 2 to 3, a group, .*True, False"),
        ({"site": [{"q10": 2.0}, {"q10": 2.1}, None, None]}, r"site: .* stands 0 to 1, a group, is allowed, .*2.1"),
        ({"site": [None, None, {}, {"q10": 2.1}]}, r"site: .* stands 2 to 3"),
    ],
)
def test_a_group_that_would_not_share_is_refused(options, message):
    envs = quick_vector(4, group_size=2)
    envs.reset(seed=1)
    with pytest.raises(ValueError, match=message):
        envs.reset(options=options)


def test_a_group_may_have_a_site_and_be_reset_as_one():
    envs = quick_vector(4, group_size=2)
    envs.reset(seed=1)
    sites = [{}, None, {"q10": (1.9, 2.2)}, {"q10": [1.9, 2.2]}]
    mask = np.array([False, False, True, True])
    observations, _ = envs.reset(seed=7, options={"reset_mask": mask, "site": sites})
    np.testing.assert_array_equal(observations[2, 1:], observations[3, 1:])


def test_a_closed_vector_environment_is_refused():
    envs = quick_vector(2)
    envs.reset(seed=1)
    envs.close()
    for call in (lambda: envs.step([12, 12]), lambda: envs.reset(seed=1)):
        with pytest.raises(gym.error.ClosedEnvironmentError, match="closed"):
            call()


BAD_VECTORS = {
    "no environments": ((0, {}), r"num_envs: an integer in \[1, 1000000\] is allowed, got 0"),
    "more than fit": ((10**9, {}), r"num_envs: an integer in \[1, 1000000\] is allowed, got 1000000000"),
    "two and a half": ((2.5, {}), r"num_envs: .* got 2.5"),
    "group of three in four": ((4, {"group_size": 3}), r"group_size = 3: a divisor of num_envs = 4"),
    "group of none": ((4, {"group_size": 0}), r"group_size: an integer in \[1, 1000000\] is allowed, got 0"),
    "no threads": ((2, {"threads": 0}), r"threads: a positive integer is allowed, got 0"),
    "a million threads": ((2, {"threads": 10**6}), r"threads: at most 10000 are allowed, got 1000000"),
    "drawing": ((4, {"render_mode": "rgb_array"}), r"render_mode 'rgb_array'"),
}


@pytest.mark.parametrize(("arguments", "message"), BAD_VECTORS.values(), ids=BAD_VECTORS)
def test_vector_constructor_refuses(arguments, message):
    number, kwargs = arguments
    with pytest.raises(ValueError, match=message):
        BorealVectorEnv(number, **kwargs)


@pytest.mark.parametrize(
    ("reset", "message"),
    [
        ({"seed": 2**63 - 1}, r"seed = 9223372036854775807: stand i gets seed \+ i, so at most 2\^63 - 3 is allowed"),
        ({"seed": [1, 2]}, r"seed: one value or 3 are allowed, got 2"),
        ({"options": {"preference": [0.1, 0.2]}}, r"preference: one value or 3 are allowed, got 2"),
        ({"options": {"preference": [0.1, 0.2, 3.0]}}, r"preference: .* got 3.0"),
        ({"options": {"site": [{}, {}, {"q11": 1}]}}, r"unknown site parameter 'q11'"),
        ({"options": {"reset_mask": np.array([True, False])}}, r"reset_mask: 3 booleans"),
        ({"options": {"reset_mask": np.zeros(3, bool)}}, r"reset_mask: 3 booleans, at least one True"),
        ({"options": {"reset_mask": np.array([1, 0, 1])}}, r"reset_mask: 3 booleans"),
    ],
)
def test_vector_reset_refuses(reset, message):
    with pytest.raises(ValueError, match=message):
        quick_vector(3).reset(**reset)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ([1, 2], r"actions of shape \(2,\): one integer for each of 3 stands"),
        ([1, 2, 25], r"action 25: integers in \[0, 25\)"),
        ([1.5, 2.0, 3.0], r"action 1.5 of type float64: integers in \[0, 25\) are allowed"),
        (3, r"actions of shape \(\)"),
        ([[1, 2, 3]], r"actions of shape \(1, 3\)"),
        (np.ma.masked_array([1, 2, 3], [False, True, False]), "some are masked; integers in"),
    ],
)
def test_vector_step_refuses(actions, message):
    envs = quick_vector(3)
    envs.reset(seed=1)
    with pytest.raises(ValueError, match=message):
        envs.step(actions)


def test_stands_that_begin_alike_are_spun_up_once(monkeypatch):
    spun_up, spin_up = [], sim.Stands._spin_up

    def noted(stands, chosen, *args):
        spun_up.append(len(chosen))
        return spin_up(stands, chosen, *args)

    monkeypatch.setattr(sim.Stands, "_spin_up", noted)
    seeds = [5, 6, 5, 5, 6]
    together = gym.make_vec("boreal-balanced-v0", num_envs=5, years=2, time_step_minutes=240)
    observations, _ = together.reset(seed=seeds, options={"preference": 0.5})
    assert spun_up == [2]
    actions = np.array([24, 12, 12, 24, 0])
    rewards = [together.step(actions)[1] for _ in range(2)]
    for i, (seed, action) in enumerate(zip(seeds, actions, strict=True)):
        alone = gym.make("boreal-balanced-v0", years=2, time_step_minutes=240)
        observation, _ = alone.reset(seed=seed, options={"preference": 0.5})
        np.testing.assert_array_equal(observation, observations[i])
        for reward in rewards:
            np.testing.assert_array_equal(alone.step(action)[1], reward[i])
    assert any(not np.array_equal(reward[0], reward[2]) for reward in rewards)  # their actions differ


def test_stands_that_are_alike_are_simulated_once(monkeypatch):
    simulated, run = [], sim.stands.run_block

    def noted(lanes, parameters, *args, **kwargs):
        simulated.append(len(parameters))
        return run(lanes, parameters, *args, **kwargs)

    monkeypatch.setattr(sim.stands, "run_block", noted)
    seeds, years = [5, 6, 5, 5, 6], np.array([[24, 24, 24, 12, 24], [12, 12, 0, 12, 12], [3, 3, 3, 3, 3]])
    together = gym.make_vec("boreal-balanced-v0", num_envs=5, years=3, time_step_minutes=240, threads=1)
    together.reset(seed=seeds, options={"preference": [0.0, 0.5, 1.0, 0.2, 0.7]})
    simulated.clear()
    found = []
    for k, actions in enumerate(years):
        if k == 2:  # what is saved goes on the same
            state = together.get_state()
            together = gym.make_vec("boreal-balanced-v0", num_envs=5, years=3, time_step_minutes=240, threads=1)
            together.set_state(state)
        found.append(together.step(actions)[:2])
    assert simulated[:3] == [3, 4, 4]  # of seeds 5, 6 and the fourth's action; then the third parts from the first
    for i, seed in enumerate(seeds):
        alone = gym.make("boreal-balanced-v0", years=3, time_step_minutes=240)
        alone.reset(seed=seed, options={"preference": [0.0, 0.5, 1.0, 0.2, 0.7][i]})
        for k, (observations, rewards) in enumerate(found[:2]):
            observation, reward, *_ = alone.step(years[k, i])
            np.testing.assert_array_equal(observation, observations[i])
            np.testing.assert_array_equal(reward, rewards[i])
        np.testing.assert_array_equal(alone.step(years[2, i])[1], found[2][1][i])
