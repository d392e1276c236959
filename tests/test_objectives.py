"""What is rewarded: the paper's two objectives, their constants, and objectives of one's own."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from hypothesis import given
from hypothesis import strategies as st
from playing import (
    ACTIONS,
    BIOMASS_LIMIT,
    NAN,
    OLD_STAND,
    QUICK,
    SOIL_LIMIT,
    THREE,
    TIMBER,
    assert_same,
    eventful_episode,
    play,
    quick,
    timber_revenue,
    vector_trace,
)

import boreal_env
import sim
from boreal_env import BorealEnv, BorealVectorEnv, Objective, Reward


@pytest.fixture(scope="module")
def episode():
    return eventful_episode()


def test_components_add_up_to_the_carbon_reward(episode):
    _, rewards, info, *_ = episode
    y = info["years"]
    total = (
        y["carbon_change"]
        + y["stock_bonus"]
        + y["product_bonus"]
        - y["biomass_limit_penalty"]
        - y["soil_limit_penalty"]
        - y["density_penalty"]
        - y["ineffective_penalty"]
    )
    np.testing.assert_allclose(y["carbon_reward"] + y["carbon_clipped"], total, atol=1e-12)
    np.testing.assert_allclose(y["carbon_reward"], np.clip(total, -1.0, 1.0), atol=1e-12)
    np.testing.assert_array_equal(rewards[:, 0], y["carbon_reward"].astype(np.float32))
    np.testing.assert_array_equal(rewards[:, 1], y["thaw_reward"].astype(np.float32))
    assert info["carbon_return"] == pytest.approx(y["carbon_reward"].sum())
    assert info["thaw_return"] == pytest.approx(y["thaw_reward"].sum())
    assert y["biomass_limit_penalty"].max() > 0.0 and y["soil_limit_penalty"].max() > 0.0


def test_thaw_as_the_field_measures_it_is_ready():
    env = quick(objectives=("thaw", "active_layer", "permafrost_heat"), record_years=True)
    _, rewards, info, *_ = play(env, [12] * env.years, seed=1)
    y = info["years"]
    depth, heat = y["active_layer_depth_m"], y["upper_ground_heat_mj_m2"]
    np.testing.assert_allclose(rewards[:, 1], np.clip(1.0 - depth, -1.0, 1.0), rtol=1e-6)
    np.testing.assert_allclose(rewards[:, 2], np.clip(-1.0 - heat / 135.0, -1.0, 1.0), rtol=1e-6)
    assert info["active_layer_return"] == pytest.approx(y["active_layer_reward"].sum())
    assert pickle.loads(pickle.dumps(env)).objective_names == ("thaw", "active_layer", "permafrost_heat")
    with pytest.raises(ValueError, match="each is allowed once"):
        quick(objectives=("active_layer", boreal_env.FIELD_OBJECTIVES["active_layer"]))


AMOUNTS = st.floats(0.0, 200.0)


@given(
    change=st.floats(-100.0, 100.0),
    biomass=AMOUNTS,
    soil=AMOUNTS,
    stored=AMOUNTS,
    density=st.floats(0.0, 4000.0),
    planted=st.floats(0.0, 100.0),
    action=st.integers(0, 24),
    stock_bonus=st.floats(0.0, 2.0),
    product_bonus=st.floats(0.0, 2.0),
    scale=st.floats(0.1, 10.0),
)
def test_what_is_rewarded_and_what_is_clipped_add_up(
    change, biomass, soil, stored, density, planted, action, stock_bonus, product_bonus, scale
):
    columns = {
        "net_carbon_change_kgc_m2": change,
        "biomass_kgc_m2": biomass,
        "soil_kgc_m2": soil,
        "hwp_stored_kgc_m2": stored,
        "density_after_action": density,
        "planted_stems_ha": planted,
        "boundary_warming_mj_m2": biomass,
        "boundary_cooling_mj_m2": soil,
    }
    record = np.zeros((1, len(sim.RECORD_NAMES)))
    for name, value in columns.items():
        record[0, sim.RECORD_NAMES.index(name)] = value
    reward = Reward(carbon_scale=scale, stock_bonus=stock_bonus, product_bonus=product_bonus)
    parts = boreal_env.rewards_of_year(record, np.array([action]), reward, "asymmetric")
    p = {name: float(value[0]) for name, value in parts.items()}
    assert tuple(p) == boreal_env.REWARD_COLUMNS
    gains = p["carbon_change"] + p["stock_bonus"] + p["product_bonus"]
    names = ("biomass_limit_penalty", "soil_limit_penalty", "density_penalty", "ineffective_penalty")
    penalties = sum(p[name] for name in names)
    assert p["carbon_reward"] + p["carbon_clipped"] == pytest.approx(gains - penalties, abs=1e-9)
    unclipped = change / scale + stock_bonus * (biomass + soil) / 50.0 + product_bonus * stored
    assert gains + p["components_clipped"] == pytest.approx(unclipped, abs=1e-9)
    assert p["thaw_reward"] + p["thaw_clipped"] == pytest.approx((soil - 2.5 * biomass) / 40.0, abs=1e-9)
    assert abs(p["carbon_reward"]) <= 1.0 and abs(p["thaw_reward"]) <= 1.0
    assert min(p[name] for name in names) >= 0.0
    if abs(gains - penalties) <= 1.0:
        assert p["carbon_clipped"] == 0.0


def test_carbon_reward_by_the_papers_formula(episode):
    _, rewards, info, actions, _ = episode
    y = info["years"]
    wanted = np.array([-100.0, -50.0, 0.0, 50.0, 100.0])[np.array(actions) // 5]
    missed = np.abs(wanted - y["planted_stems_ha"] + y["thinned_stems_ha"]) / np.maximum(np.abs(wanted), 1.0)
    expected = (
        np.clip(y["net_carbon_change_kgc_m2"] / 2.0, -1.0, 1.0)
        - 0.5 * np.maximum(y["biomass_kgc_m2"] / BIOMASS_LIMIT - 1.0, 0.0)
        - 0.5 * np.maximum(y["soil_kgc_m2"] / SOIL_LIMIT - 1.0, 0.0)
        - 1.0 * (y["density_after_action"] >= 2000.0)
        - 0.5 * missed
    )
    np.testing.assert_allclose(rewards[:, 0], np.clip(expected, -1.0, 1.0), atol=1e-6)


def test_constants_of_the_reward_do_what_they_say():
    constants = {
        "carbon_scale": 0.5,
        "stock_bonus": 0.1,
        "product_bonus": 0.2,
        "thaw_scale": 80.0,
        "limit_penalty": 0.0,
    }
    ranges = {"density_stems_ha": (900.0, 900.0), "oldest_age_years": (120.0, 120.0)}
    env = quick(reward=constants, record_years=True, initial_ranges=ranges, mechanisms={"fire": False})
    _, rewards, info = play(env, [2] * 4, seed=1)
    y = info["years"]
    deadwood = y["conifer_deadwood_kgc_m2"] + y["deciduous_deadwood_kgc_m2"]
    expected = (
        np.clip(y["net_carbon_change_kgc_m2"] / 0.5, -1.0, 1.0)
        + 0.1 * np.clip((y["biomass_kgc_m2"] + deadwood + y["soil_kgc_m2"]) / 50.0, 0.0, 1.0)
        + 0.2 * np.clip(y["hwp_stored_kgc_m2"], 0.0, 1.0)
    )
    assert y["hwp_stored_kgc_m2"].min() > 0.0
    np.testing.assert_allclose(rewards[:, 0], np.clip(expected, -1.0, 1.0), atol=1e-6)
    thaw = (y["boundary_cooling_mj_m2"] - 2.5 * y["boundary_warming_mj_m2"]) / 80.0
    np.testing.assert_allclose(rewards[:, 1], np.clip(thaw, -1.0, 1.0), atol=1e-6)


THAW = {
    "asymmetric": lambda cool, warm: (cool - 2.5 * warm) / 40.0,
    "contrast": lambda cool, warm: (cool - warm) / (cool + warm),
    "raw_degree_days": lambda cool, warm: (cool - warm) / 40.0,
}


@pytest.mark.parametrize("formulation", THAW)
@pytest.mark.parametrize("boundary", [268.0, 272.0])
def test_thaw_reward_by_each_formulation(formulation, boundary):
    site = {"deep_boundary_temperature_k": boundary}
    env = quick(thaw_formulation=formulation, record_years=True, parameter_overrides=site)
    _, rewards, info = play(env, ACTIONS, seed=2)
    y = info["years"]
    thaw = THAW[formulation](y["boundary_cooling_mj_m2"], y["boundary_warming_mj_m2"])
    np.testing.assert_allclose(rewards[:, 1], np.clip(thaw, -1.0, 1.0), atol=1e-6)
    np.testing.assert_allclose(y["thaw_reward"] + y["thaw_clipped"], thaw, atol=1e-9)


def test_the_warming_penalty_is_heavier_than_the_cooling_reward():
    """What the asymmetric formulation is for: the same net flux is worth less the more heat went in."""
    cool, warm = np.array([10.0, 20.0, 0.0]), np.array([0.0, 10.0, 0.0])
    asymmetric = boreal_env.thaw_reward(cool, warm, Reward(), "asymmetric")
    assert asymmetric.tolist() == [0.25, -0.125, 0.0]
    assert boreal_env.thaw_reward(cool, warm, Reward(), "raw_degree_days").tolist() == [0.25, 0.25, 0.0]
    assert boreal_env.thaw_reward(cool, warm, Reward(), "contrast").tolist() == [1.0, pytest.approx(1 / 3), 0.0]
    with pytest.raises(ValueError, match="thaw_formulation 'Contrast': allowed are asymmetric, contrast"):
        boreal_env.thaw_reward(cool, warm, Reward(), "Contrast")


def test_a_third_objective():
    kwargs = {"record_years": True, "initial_ranges": OLD_STAND}
    env = quick(objectives=THREE, **kwargs)
    assert env.reward_dim == 3
    assert env.reward_space == gym.spaces.Box(np.float32([-1, -1, -10]), np.float32([1, 1, 100]))
    actions = [0, 24, 12, 4]
    observations, rewards, info = play(env, actions, seed=1)
    paper_observations, paper_rewards, paper_info = play(quick(**kwargs), actions, seed=1)
    np.testing.assert_array_equal(observations[:, 2:], paper_observations[:, 1:])
    np.testing.assert_array_equal(rewards[:, :2], paper_rewards)
    y = info["years"]
    revenue = 200.0 * y["harvest_kgc_m2"] - 0.1 * y["planted_stems_ha"]
    assert revenue[0] > 100.0 and revenue[1] == -10.0 and revenue[2] == 0.0
    np.testing.assert_allclose(rewards[:, 2], np.clip(revenue, -10.0, 100.0), rtol=1e-6)
    np.testing.assert_allclose(y["timber_reward"] + y["timber_clipped"], revenue)
    assert y["timber_clipped"][0] > 0.0
    assert info["timber_return"] == pytest.approx(rewards[:, 2].sum())
    assert info.keys() - paper_info.keys() == {"timber_return"}
    assert y.keys() - paper_info["years"].keys() == {"timber_reward", "timber_clipped"}
    assert pickle.loads(pickle.dumps(env)).reward_dim == 3


def test_a_third_objective_in_vector_environments():
    kwargs = {"objectives": (TIMBER, "carbon"), "initial_ranges": OLD_STAND, **QUICK}
    actions = np.random.default_rng(1).integers(0, 25, (5, 2))
    lockstep = gym.make_vec("boreal-generalist-v0", num_envs=2, **kwargs)
    assert lockstep.reward_dim == 2 and lockstep.reward_space.high.tolist() == [100.0, 1.0]
    parallel = AsyncVectorEnv([lambda: BorealEnv(**kwargs)] * 2, autoreset_mode=AutoresetMode.SAME_STEP)
    try:
        workers = vector_trace(parallel, actions, 3)
    finally:
        parallel.close()
    for one, other in zip(vector_trace(lockstep, actions, 3)[1:], workers[1:], strict=True):
        np.testing.assert_array_equal(one[1], other[1])
        assert_same(one[4], other[4])
    resumed = BorealVectorEnv(2, **kwargs)
    resumed.set_state(pickle.loads(pickle.dumps(lockstep.get_state())))
    np.testing.assert_array_equal(resumed.step(actions[0])[1], lockstep.step(actions[0])[1])


def rewrites_the_record(year):
    year["carbon_reward"][:] = 1.0
    return year["carbon_reward"]


def adds_to_its_own_dict(year):
    year["carbon_reward"] = np.ones_like(year["carbon_reward"])
    return year["carbon_reward"]


def test_an_objective_cannot_rewrite_the_record():
    with pytest.raises(ValueError, match="read-only"):
        play(quick(objectives=("carbon", Objective("bad", rewrites_the_record))), ACTIONS, seed=1)
    _, rewards, info = play(quick(objectives=("carbon", Objective("own", adds_to_its_own_dict))), ACTIONS, seed=1)
    np.testing.assert_array_equal(rewards[:, 0], play(quick(), ACTIONS, seed=1)[1][:, 0])
    assert info["own_return"] == 4.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: quick(objectives=("carbon", "wood")), r"objective 'wood': allowed are carbon, thaw"),
        (lambda: quick(objectives=()), r"objectives: .* got \(\)"),
        (lambda: quick(objectives="carbon"), r"objectives: .* got 'carbon'"),
        (lambda: quick(objectives=None), r"objectives: .* got None"),
        (lambda: quick(objectives=("carbon", timber_revenue)), r"objective <function .*: allowed are carbon, thaw"),
        (lambda: quick(objectives=("thaw", "thaw")), r"objectives thaw, thaw: each is allowed once"),
        (lambda: Objective("carbon", timber_revenue), r"objective name 'carbon': an identifier is allowed"),
        (lambda: Objective("my timber", timber_revenue), r"objective name 'my timber': an identifier"),
        (lambda: Objective("timber", 5.0), r"objective timber: a function .* got 5.0"),
        (lambda: Objective("timber", timber_revenue, 1.0, 0.0), r"objective timber: .* low < high.* \(1.0, 0.0\)"),
        (lambda: Objective("timber", timber_revenue, 0.0, np.inf), r"objective timber: finite limits .* inf"),
        (lambda: Objective("timber", timber_revenue, -1e39, 1.0), r"at most 1e\+38 either way, are .* got \(-1e\+39"),
        (lambda: Objective("_timber", timber_revenue), r"objective name '_timber': .* without _ at its front"),
        (
            lambda: play(quick(objectives=(Objective("bad", lambda year: 1.0),)), [12]),
            r"objective bad: an array of 1 finite .* array\(1.\)",
        ),
        (lambda: play(quick(objectives=(Objective("bad", lambda year: [NAN]),)), [12]), r"objective bad: .*nan"),
        (lambda: play(quick(objectives=(Objective("bad", lambda year: ["much"]),)), [12]), r"objective bad: .*'much'"),
    ],
)
def test_bad_objectives_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_an_objective_of_a_column_that_is_not_there_is_named():
    with pytest.raises(KeyError, match="harvest") as refused:
        play(quick(objectives=(Objective("mine", lambda year: year["harvest"]),)), [12])
    assert refused.value.__notes__[0].startswith("objective mine: columns of the record are ")
    assert "harvest_kgc_m2" in refused.value.__notes__[0]
