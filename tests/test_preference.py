"""The preference: given, drawn, observed."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from playing import ACTIONS, ENTRIES, INDEX, NAN, QUICK, THREE, TIMBER, play, quick, quick_vector

import boreal_env
from boreal_env import BorealEnv


def test_preference_is_the_option_the_constructors_or_drawn():
    env = quick(fixed_preference=0.75)
    assert env.reset(seed=1)[0][0] == np.float32(0.75)
    assert env.reset(seed=1, options={"preference": 0.25})[0][0] == np.float32(0.25)
    assert not np.signbit(env.reset(seed=1, options={"preference": -0.0})[0][0])
    drawn = quick_vector(64, years=1).reset(seed=0)[0][:, 0]
    assert len(set(drawn)) == 64
    assert drawn.min() < 0.1 and drawn.max() > 0.9 and 0.35 < drawn.mean() < 0.65


def test_a_given_preference_changes_nothing_else():
    drawn = play(quick(), ACTIONS, seed=2)
    for env, reset in ((quick(), {"options": {"preference": 0.9}}), (quick(fixed_preference=0.9), {})):
        given = play(env, ACTIONS, seed=2, **reset)
        np.testing.assert_array_equal(given[0][:, 1:], drawn[0][:, 1:])
        np.testing.assert_array_equal(given[1], drawn[1])
        assert given[2]["preference"] == 0.9 != drawn[2]["preference"]


# ------------------------------------------------------------------------------------------ any number of objectives

WEIGHTS = [0.5, 0.3, 0.2]


def test_of_three_objectives_two_weights_are_observed():
    env = quick(objectives=THREE)
    observations, _, info = play(env, ACTIONS, seed=1, options={"preference": WEIGHTS})
    two, *_ = play(quick(), ACTIONS, seed=1)
    assert env.observation_names[:2] == ("preference_carbon", "preference_thaw")
    assert observations.shape == (5, ENTRIES + 1) and env.observation_space.shape == (ENTRIES + 1,)
    np.testing.assert_array_equal(observations[:, :2], np.tile(np.float32(WEIGHTS[:2]), (5, 1)))
    np.testing.assert_array_equal(observations[:, 2:], two[:, 1:])
    np.testing.assert_array_equal(info["preference"], WEIGHTS)
    np.testing.assert_allclose(boreal_env.observed_weights(observations, 3), np.tile(WEIGHTS, (5, 1)), atol=1e-7)


def test_of_one_objective_none_is_observed():
    env = quick(objectives=(TIMBER,))
    observations, _, info = play(env, ACTIONS, seed=1, options={"preference": [1.0]})
    np.testing.assert_array_equal(observations, play(quick(), ACTIONS, seed=1)[0][:, 1:])
    assert info["preference"].tolist() == [1.0] and env.observation_space.shape == (ENTRIES - 1,)
    assert boreal_env.observed_weights(observations, 1).tolist() == [[1.0]] * 5
    for wrong in (observations[0], observations[:, :1]):
        with pytest.raises(ValueError, match=r"observations: shape \(n, 2 or more\) is allowed, got "):
            boreal_env.observed_weights(wrong, 3)
    with pytest.raises(ValueError, match="objectives: a positive integer is allowed, got 0"):
        boreal_env.observed_weights(observations, 0)


def test_the_constructor_fixes_weights_of_any_number():
    env = quick(objectives=THREE, fixed_preference=WEIGHTS)
    for seed in (1, 2):
        np.testing.assert_array_equal(env.reset(seed=seed)[0][:2], np.float32(WEIGHTS[:2]))
    np.testing.assert_array_equal(env.reset(options={"preference": [0, 0, 1]})[0][:2], [0.0, 0.0])


def test_two_weights_may_be_given_for_their_first():
    one, both = (quick().reset(seed=1, options={"preference": weights})[0] for weights in (0.3, [0.3, 0.7]))
    np.testing.assert_array_equal(one, both)


def test_weights_are_drawn_uniformly_on_the_simplex():
    generator = np.random.default_rng(0)
    weights = np.array([boreal_env.draw_weights(generator, 3) for _ in range(4000)])
    assert weights.min() >= 0.0
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-15)
    for each in weights.T:  # of a flat Dirichlet distribution
        assert each.mean() == pytest.approx(1 / 3, abs=0.015)
        assert (each > 0.5).mean() == pytest.approx(1 / 4, abs=0.03)
    observations, _ = quick_vector(64, objectives=THREE).reset(seed=0)
    assert len({tuple(row) for row in observations[:, :2]}) == 64
    assert observations[:, :2].sum(axis=1).max() <= 1.0


def test_of_two_weights_the_first_is_one_uniform_number():
    weights = boreal_env.draw_weights(np.random.default_rng(3), 2)
    u = np.random.default_rng(3).random()
    assert weights.tolist() == [u, 1.0 - u]
    assert boreal_env.draw_weights(np.random.default_rng(3), 1).tolist() == [1.0]
    with pytest.raises(ValueError, match=r"generator: numpy.random.default_rng\(seed\) is allowed, got 3"):
        boreal_env.draw_weights(3, 2)


def test_vector_environments_take_weights_for_all_or_for_each():
    envs = quick_vector(3, objectives=THREE)
    observations, _ = envs.reset(seed=1, options={"preference": WEIGHTS})
    np.testing.assert_array_equal(observations[:, :2], np.tile(np.float32(WEIGHTS[:2]), (3, 1)))
    each = np.eye(3)
    np.testing.assert_array_equal(envs.reset(seed=1, options={"preference": each})[0][:, :2], each[:, :2])
    pairs = [[0.25, 0.75], [0.5, 0.5], 1.0]
    two = quick_vector(3).reset(seed=1, options={"preference": pairs})[0]
    assert two[:, 0].tolist() == [0.25, 0.5, 1.0]


def test_the_last_info_has_the_weights_in_every_kind_of_vector_environment():
    kwargs = {**QUICK, "objectives": THREE, "years": 1}
    lockstep = gym.make_vec("boreal-generalist-v0", num_envs=2, **kwargs)
    parallel = AsyncVectorEnv([lambda: BorealEnv(**kwargs)] * 2, autoreset_mode=AutoresetMode.SAME_STEP)
    try:
        weights = []
        for envs in (lockstep, parallel):
            observations, _ = envs.reset(seed=4)
            final = envs.step(np.array([12, 12]))[4]["final_info"]
            np.testing.assert_allclose(boreal_env.observed_weights(observations, 3), final["preference"], atol=1e-7)
            weights.append(final["preference"])
    finally:
        parallel.close()
    np.testing.assert_array_equal(*weights)


def test_a_state_of_another_number_of_objectives_is_refused():
    two, three = quick(), quick(objectives=("carbon",))
    two.reset(seed=1), three.reset(seed=1)
    with pytest.raises(ValueError, match="objectives"):
        two.set_state(three.get_state())


@pytest.mark.parametrize(
    ("objectives", "value", "message"),
    [
        (2, 1.1, r"^preference: a number in \[0, 1\] is allowed, got 1.1"),
        (2, [0.5, 0.6], r"^preference: a weight for each of 2 objectives, .* 1 in sum, is allowed, got \[0.5, 0.6\]"),
        (3, 0.3, r"^preference: a weight for each of 3 objectives, none negative, 1 in sum, is allowed, got 0.3"),
        (3, [0.5, 0.5], r"3 objectives, .* got \[0.5, 0.5\]"),
        (3, [0.5, 0.4, 0.2], r"1 in sum, is allowed, got \[0.5, 0.4, 0.2\]"),
        (3, [1.5, -0.5, 0.0], r"none negative, .* got \[1.5, -0.5, 0.0\]"),
        (3, [NAN, 0.5, 0.5], r"got \[nan, 0.5, 0.5\]"),
        (3, [True, 0.0, 0.0], r"got \[True, 0.0, 0.0\]"),
        (3, "abc", r"got 'abc'"),
        (1, 1.0, r"1 objectives, .* got 1.0"),
    ],
)
def test_what_are_no_weights_is_refused(objectives, value, message):
    with pytest.raises(ValueError, match=message):
        boreal_env.check_weights(value, objectives)


def test_given_weights_are_kept_but_for_the_sign_of_zero():
    weights = boreal_env.check_weights([0.1, 0.2, 0.7 + 5e-7], 3)
    assert weights.tolist() == [0.1, 0.2, 0.7 + 5e-7]
    assert not np.signbit(boreal_env.check_weights([-0.0, 1.0, -0.0], 3)).any()


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([0.5, 0.5], r"preference: a weight for each of 3 objectives"),
        (0.5, r"preference: a weight for each of 3 objectives, none negative, 1 in sum, is allowed, got 0.5"),
        (np.full((3, 3), 1 / 3), r"preference: one value or 2 are allowed, got 3"),
        ([WEIGHTS, [0.5, 0.5, 0.5]], r"1 in sum, is allowed, got \[0.5, 0.5, 0.5\]"),
    ],
)
def test_vector_environments_refuse_weights(value, message):
    with pytest.raises(ValueError, match=message):
        quick_vector(2, objectives=THREE).reset(seed=1, options={"preference": value})


def test_a_group_preference_of_one_objective_has_no_entries():
    env = quick(objectives=(TIMBER,), observation_groups=("preference", "state"))
    assert env.observation_names == ("year", "density", "conifer_fraction", "carbon_stock")
    assert env.reset(seed=1)[0][0] == 0.0 == quick().reset(seed=1)[0][INDEX["year"]]
