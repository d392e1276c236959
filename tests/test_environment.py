"""The environment as its users meet it: registration, spaces, seeds, vectorisation, masks, rewards, refusals."""

import csv
import gc
import pickle
import tracemalloc
import warnings
from functools import partial

import gymnasium as gym
import mo_gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from gymnasium.wrappers import TransformReward
from hypothesis import given
from hypothesis import strategies as st
from mo_gymnasium.wrappers import LinearReward
from scripts import ROOT

import boreal_env
import sim
from analysis import document_environment
from boreal_env import OBSERVATION, OBSERVATION_NAMES, BorealEnv, BorealVectorEnv, Objective, Reward

IDS = ("boreal-generalist-v0", "boreal-site-specific-v0", "boreal-balanced-v0")
QUICK = {"years": 4, "time_step_minutes": 240}
INDEX = {name: i for i, name in enumerate(OBSERVATION_NAMES)}
SITE = slice(43, 105)


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
    assert terminated == (len(actions) == env.unwrapped._episodes.years)
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


# ----------------------------------------------------------------------------------------------- registration


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("prefix", ["", "boreal_env:"])
@pytest.mark.parametrize("make", [gym.make, mo_gymnasium.make], ids=["gymnasium", "mo_gymnasium"])
def test_all_ids_through_all_doors(make, prefix, name):
    env = make(prefix + name, **QUICK)
    assert isinstance(env.unwrapped, BorealEnv)
    size = 43 if "site-specific" in name else 105
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
    assert envs.single_observation_space.shape == ((43,) if "site-specific" in name else (105,))


def test_an_episode_is_fifty_years_by_default():
    assert gym.make("boreal-generalist-v0").unwrapped._episodes.years == 50


def test_the_balanced_id_changes_one_constant_only():
    paper, balanced = (gym.make(name).unwrapped._episodes for name in ("boreal-generalist-v0", "boreal-balanced-v0"))
    assert paper.reward == Reward()
    assert balanced.reward == Reward(carbon_scale=boreal_env.BALANCED_CARBON_SCALE) != paper.reward


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


@pytest.mark.parametrize("mode", boreal_env.MODES)
def test_gymnasiums_checker_is_satisfied(mode):
    env = TransformReward(quick(mode=mode), lambda reward: float(reward.sum()))
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
    make = partial(gym.make, "boreal_env:boreal-generalist-v0", **QUICK)
    envs = AsyncVectorEnv([make], autoreset_mode=AutoresetMode.SAME_STEP, context="spawn")
    try:
        observations, _ = envs.reset(seed=3)
        stepped, rewards, *_ = envs.step(np.array([24]))
    finally:
        envs.close()
    expected = play(quick(), [24], seed=3)
    np.testing.assert_array_equal([observations[0], stepped[0]], expected[0])
    np.testing.assert_array_equal(rewards, expected[1])


def test_instances_do_not_disturb_each_other():
    one, other = quick(), quick(mode="site_specific")
    one.reset(seed=1), other.reset(seed=9)
    rewards = [(one.step(action)[1], other.step(24 - action)[1])[0] for action in (24, 0, 17, 3)]
    np.testing.assert_array_equal(rewards, play(quick(), [24, 0, 17, 3], seed=1)[1])


def test_mo_gymnasiums_linear_reward():
    env = LinearReward(mo_gymnasium.make("boreal-generalist-v0", **QUICK), weight=np.array([0.25, 0.75]))
    env.reset(seed=1)
    _, reward, *_ = env.step(12)
    vector = play(quick(), [12] * 4, seed=1)[1][0]
    assert reward == pytest.approx(0.25 * vector[0] + 0.75 * vector[1])


def test_pickle_keeps_the_arguments():
    env = quick(thaw_formulation="contrast", reward={"carbon_scale": 0.4}, site_seed=3)
    env.reset(seed=8)
    copy = pickle.loads(pickle.dumps(env))
    for one, other in zip(play(env, [24, 0, 12, 7], seed=5), play(copy, [24, 0, 12, 7], seed=5), strict=True):
        assert_same(one, other)
    assert copy._episodes.thaw_formulation == "contrast" and copy._episodes.reward.carbon_scale == 0.4


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


# -------------------------------------------------------------------------------------------------- the spaces


@pytest.mark.parametrize("action", [0, 4, 12, 20, 24])
@pytest.mark.parametrize("extreme", [False, True])
def test_observations_and_rewards_stay_in_their_spaces(action, extreme):
    ranges = {
        "density_stems_ha": (0.0, 10000.0),
        "biomass_kgc_m2": (0.0, 60.0),
        "soil_kgc_m2": (0.0, 100.0),
        "conifer_fraction": (0.0, 1.0),
        "oldest_age_years": (1.0, 200.0),
    }
    envs = quick_vector(16, years=12, initial_ranges=ranges if extreme else None)
    observations, _ = envs.reset(seed=action)
    box, rewards_box = envs.single_observation_space, envs.reward_space
    assert np.isfinite(box.low).all() and np.isfinite(box.high).all()
    for _ in range(12):
        assert observations.dtype == np.float32 and observations in envs.observation_space
        observations, rewards, *_ = envs.step(np.full(16, action))
        assert rewards.dtype == np.float32 and rewards.shape == (16, 2)
        assert all(reward in rewards_box for reward in rewards)


@pytest.mark.parametrize("corner", ["physical_low", "physical_high"])
def test_physical_limits_of_the_site_lie_in_the_observation_space(corner):
    env = quick()
    site = {name: getattr(p, corner) for name, p in sim.SITE_PARAMETERS.items()}
    observation, _ = env.reset(seed=1, options={"site": site})
    assert observation in env.observation_space
    expected = [(getattr(p, corner) - p.low) / (p.high - p.low) for p in sim.SITE_PARAMETERS.values()]
    np.testing.assert_allclose(observation[SITE], expected, rtol=1e-5)


def test_penalties_of_heavy_constants_lie_in_the_observation_space():
    reward = {"biomass_limit": 0.001, "soil_limit": 0.001, "density_penalty": 500.0}
    env = quick(reward=reward, initial_ranges={"density_stems_ha": (2100.0, 2200.0)})
    env.reset(seed=1)
    observation = env.step(24)[0]
    assert observation in env.observation_space
    assert (observation[40:43] > quick().observation_space.high[40:43]).tolist() == [True, True, True]


def test_arrays_are_fresh_every_step():
    env = quick()
    first, _ = env.reset(seed=1)
    kept = first.copy()
    second, reward, *_ = env.step(24)
    kept_second, kept_reward = second.copy(), reward.copy()
    env.step(0)
    for array, copy in ((first, kept), (second, kept_second), (reward, kept_reward)):
        np.testing.assert_array_equal(array, copy)


def test_info_is_empty_until_the_end():
    env = quick()
    assert env.reset(seed=1)[1] == {}
    infos = [env.step(12)[4] for _ in range(4)]
    assert infos[:3] == [{}, {}, {}]
    assert set(infos[3]) == {
        "carbon_return",
        "thaw_return",
        "site_seed",
        "episode_seed",
        "preference",
        "final_density",
        "mean_density",
        "final_conifer_fraction",
        "mean_conifer_fraction",
        "growing_season_days",
        "latent_heat_mj_m2",
        "ground_shortwave_mj_m2",
    }
    assert all(isinstance(value, (int, float)) for value in infos[3].values())
    assert infos[3].keys() | {"years"} == document_environment.FINAL_INFO.keys()


def test_seeds_of_the_fixed_world_are_what_the_page_says():
    default, other = (play(quick(mode="site_specific", **k), ACTIONS, seed=1)[2] for k in ({}, {"site_seed": 5}))
    assert (default["site_seed"], default["episode_seed"]) == (-1, 0)
    assert (other["site_seed"], other["episode_seed"]) == (5, 5)


# ---------------------------------------------------------------------------------------------- the observation

PAPER_ORDER = """
preference year density conifer_fraction carbon_stock latitude mean_annual_temperature seasonal_amplitude
growth_start_day fall_start_day growing_season_length fire_mortality_1yr fire_mortality_2yr insect_mortality_1yr
insect_mortality_2yr drought_index_1yr drought_index_2yr biomass_change soil_change total_change natural_mortality
litterfall thinning_loss products_stored density_action mix_action density_change mix_change conifer_seedling
conifer_sapling conifer_young conifer_mature conifer_old deciduous_seedling deciduous_sapling deciduous_young
deciduous_mature deciduous_old biomass soil biomass_limit_penalty soil_limit_penalty density_penalty
""".split()


def test_entries_have_the_papers_order():
    assert list(OBSERVATION_NAMES) == PAPER_ORDER + [f"site_{name}" for name in sim.SITE_PARAMETERS]
    assert len(OBSERVATION) == 105
    assert all(entry.low < entry.high and entry.scale > 0.0 and entry.unit for entry in OBSERVATION)


BIOMASS_LIMIT, SOIL_LIMIT = 0.05, 18.0  # kgC m-2; of the paper's 15 and 20 a burnt stand stays short


@pytest.fixture(scope="module")
def episode():
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


# Name of an entry -> its value after year t, from the annual record.
FORMULAS = {
    "preference": lambda r, t: 0.3,
    "year": lambda r, t: (t + 1) / 50.0,
    "density": lambda r, t: r["density_stems_ha"][t] / 1500.0,
    "conifer_fraction": lambda r, t: r["conifer_fraction"][t],
    "carbon_stock": lambda r, t: (r["biomass_kgc_m2"][t] + r["soil_kgc_m2"][t]) / 50.0,
    "fire_mortality_1yr": lambda r, t: r["fire_mortality"][t],
    "fire_mortality_2yr": lambda r, t: r["fire_mortality"][t - 1] if t else 0.0,
    "insect_mortality_1yr": lambda r, t: r["insect_mortality"][t],
    "insect_mortality_2yr": lambda r, t: r["insect_mortality"][t - 1] if t else 0.0,
    "drought_index_1yr": lambda r, t: r["drought_index"][t] / 100.0,
    "drought_index_2yr": lambda r, t: r["drought_index"][t - 1] / 100.0 if t else 0.0,
    "biomass_change": lambda r, t: r["biomass_change_kgc_m2"][t] + 0.5,
    "soil_change": lambda r, t: (r["soil_change_kgc_m2"][t] + 0.2) / 0.4,
    "total_change": lambda r, t: (r["net_carbon_change_kgc_m2"][t] + 0.7) / 1.4,
    "natural_mortality": lambda r, t: r["mortality_kgc_m2"][t] / 0.5,
    "litterfall": lambda r, t: r["litterfall_kgc_m2"][t] / 2.0,
    "thinning_loss": lambda r, t: r["harvest_kgc_m2"][t] + 0.5,
    "products_stored": lambda r, t: r["hwp_stored_kgc_m2"][t] / 0.5,
    "density_change": lambda r, t: (r["planted_stems_ha"][t] - r["thinned_stems_ha"][t] + 100.0) / 200.0,
    "biomass": lambda r, t: r["biomass_kgc_m2"][t] / 50.0,
    "soil": lambda r, t: r["soil_kgc_m2"][t] / 50.0,
    "biomass_limit_penalty": lambda r, t: max(r["biomass_kgc_m2"][t] / BIOMASS_LIMIT - 1.0, 0.0),
    "soil_limit_penalty": lambda r, t: max(r["soil_kgc_m2"][t] / SOIL_LIMIT - 1.0, 0.0),
    "density_penalty": lambda r, t: float(r["density_after_action"][t] >= 2000.0),
    **{
        f"{species}_{age}": lambda r, t, name=f"{species}_{age}_stems_ha": r[name][t] / r["density_stems_ha"][t]
        for species in ("conifer", "deciduous")
        for age in ("seedling", "sapling", "young", "mature", "old")
    },
}


@pytest.mark.parametrize("name", FORMULAS)
def test_entry_is_what_the_annual_record_says(episode, name):
    observations, _, info, *_ = episode
    expected = [FORMULAS[name](info["years"], t) for t in range(6)]
    np.testing.assert_allclose(observations[1:, INDEX[name]], expected, rtol=1e-5, atol=1e-6)


def test_entries_of_the_action_and_the_mix(episode):
    observations, _, info, actions, _ = episode
    np.testing.assert_allclose(observations[1:, INDEX["density_action"]], np.array(actions) // 5 / 4.0)
    np.testing.assert_allclose(observations[1:, INDEX["mix_action"]], np.array(actions) % 5 / 4.0)
    before = observations[:-1, INDEX["conifer_fraction"]]
    change = info["years"]["conifer_fraction_after_action"] - before
    np.testing.assert_allclose(observations[1:, INDEX["mix_change"]], change, atol=1e-6)


def test_entries_of_the_climate_and_the_site(episode):
    observations, _, info, _, env = episode
    site = sim.sample_site(info["site_seed"], env._episodes.parameter_overrides)
    climate = [
        (site["latitude_deg"] - 50.0) / 20.0,
        (site["mean_annual_temperature_c"] + 10.0) / 20.0,
        site["seasonal_amplitude_c"] / 30.0,
        site["growth_start_day"] / 365.0,
        site["fall_start_day"] / 365.0,
        (site["fall_start_day"] - site["growth_start_day"]) / 200.0,
    ]
    with (ROOT / "sim" / "site_parameters.csv").open() as file:
        ranges = {row["name"]: (float(row["low"]), float(row["high"])) for row in csv.DictReader(file)}
    scaled = [(site[name] - low) / (high - low) for name, (low, high) in ranges.items()]
    assert len(scaled) == 62
    for observation in observations:
        np.testing.assert_allclose(observation[5:11], climate, rtol=1e-5)
        np.testing.assert_allclose(observation[43:105], scaled, rtol=1e-5, atol=1e-6)


def test_every_index_is_compared_with_a_formula():
    elsewhere = {"density_action", "mix_action", "mix_change", *OBSERVATION_NAMES[5:11], *OBSERVATION_NAMES[43:]}
    assert FORMULAS.keys() | elsewhere == set(OBSERVATION_NAMES)


def test_the_page_of_the_environment_is_what_the_code_makes():
    """After a change: python analysis/document_environment.py."""
    assert (ROOT / "docs" / "environment.md").read_text(encoding="utf-8") == document_environment.page()


def test_normalisations_are_written_as_they_are():
    for name, x, written in (
        ("year", 25.0, "x / 50"),
        ("latitude", 60.0, "(x - 50) / 20"),
        ("mix_change", -0.5, "x"),
        ("biomass_change", 0.1, "x + 0.5"),
        ("soil_change", 0.1, "(x + 0.2) / 0.4"),
    ):
        entry = OBSERVATION[INDEX[name]]
        assert document_environment.normalisation(entry) == written
        assert eval(written) == pytest.approx((x + entry.shift) / entry.scale)


def test_age_fractions_of_both_species_sum_to_one(episode):
    observations = episode[0]
    ages = slice(INDEX["conifer_seedling"], INDEX["deciduous_old"] + 1)
    np.testing.assert_allclose(observations[:, ages].sum(axis=1), 1.0, atol=1e-6)


def test_before_the_first_action_history_shows_an_unchanged_stand(episode):
    first = episode[0][0]
    neutral = {
        "year": 0.0,
        "fire_mortality_1yr": 0.0,
        "insect_mortality_2yr": 0.0,
        "drought_index_1yr": 0.0,
        "biomass_change": 0.5,
        "soil_change": 0.5,
        "total_change": 0.5,
        "natural_mortality": 0.0,
        "litterfall": 0.0,
        "thinning_loss": 0.5,
        "products_stored": 0.0,
        "density_action": 0.5,
        "density_change": 0.5,
        "mix_change": 0.0,
    }
    for name, value in neutral.items():
        assert first[INDEX[name]] == pytest.approx(value), name
    nearest = round(4.0 * first[INDEX["conifer_fraction"]]) / 4.0
    assert first[INDEX["mix_action"]] == pytest.approx(nearest)


def test_sampled_site_observations_are_those_of_the_environment():
    env = quick(site_seed=17)
    np.testing.assert_array_equal(env.reset(seed=0)[0][SITE], boreal_env.sample_site_observations([17])[0])


@pytest.mark.parametrize("groups", [("state",), ("preference", "age"), ("site", "stocks")])
def test_observation_groups(groups):
    whole, _ = quick().reset(seed=3)
    env = quick(observation_groups=groups)
    part, _ = env.reset(seed=3)
    kept = [i for i, entry in enumerate(OBSERVATION) if entry.group in groups]
    np.testing.assert_array_equal(part, whole[kept])
    assert part in env.observation_space
    assert env.observation_names == quick_vector(2, observation_groups=groups).observation_names
    assert env.observation_names == tuple(OBSERVATION_NAMES[i] for i in kept)


def test_observation_names_of_the_modes():
    assert quick().observation_names == OBSERVATION_NAMES
    assert quick_vector(2, mode="site_specific").observation_names == OBSERVATION_NAMES[:43]


def test_the_environments_mask_needs_no_whole_observation():
    env, whole = quick(observation_groups=("carbon",)), quick()
    env.reset(seed=3), whole.reset(seed=3)
    np.testing.assert_array_equal(env.action_masks(), whole.action_masks())


# ------------------------------------------------------------------------------------------ seeds and determinism

ACTIONS = [24, 0, 17, 3]


@pytest.mark.parametrize("mode", boreal_env.MODES)
def test_two_instances_agree_in_everything(mode):
    one, other = (play(quick(mode=mode, record_years=True), ACTIONS, seed=11) for _ in range(2))
    for a, b in zip(one, other, strict=True):
        assert_same(a, b)


def test_seeds_differ_and_episodes_go_on_differing():
    env = quick()
    first, second, third = (env.reset(seed=seed)[0] for seed in (1, 2, None))
    sites = {observation[SITE].tobytes() for observation in (first, second, third)}
    assert len(sites) == 3
    env.reset(seed=2)
    np.testing.assert_array_equal(env.reset()[0], third)


def test_episode_is_replayed_by_simulate():
    _, _, info = play(quick(record_years=True), ACTIONS, seed=4)
    table = sim.simulate(
        sim.sample_site(info["site_seed"]), ACTIONS, seed=info["episode_seed"], years=4, time_step_minutes=240
    )
    for name in sim.RECORD_NAMES:
        np.testing.assert_array_equal(table[name], info["years"][name], err_msg=name)


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


@pytest.mark.parametrize("how", ["option", "constructor"])
def test_a_site_override_changes_nothing_else(how):
    drawn = play(quick(record_years=True), ACTIONS, seed=2)
    if how == "option":
        given = play(quick(record_years=True), ACTIONS, seed=2, options={"site": {"q10": 3.1}})
    else:
        given = play(quick(record_years=True, parameter_overrides={"q10": 3.1}), ACTIONS, seed=2)
    np.testing.assert_allclose(given[0][0][INDEX["site_q10"]], (3.1 - 1.8) / 0.5, rtol=1e-6)
    same = np.delete(np.arange(105), INDEX["site_q10"])
    np.testing.assert_array_equal(given[0][0][same], drawn[0][0][same])
    for name in ("precipitation_mm", "air_temperature_c", "planted_stems_ha"):
        np.testing.assert_array_equal(given[2]["years"][name], drawn[2]["years"][name])
    heterotrophic = "heterotrophic_respiration_kgc_m2"
    assert (given[2]["years"][heterotrophic] != drawn[2]["years"][heterotrophic]).all()


def test_the_reset_option_wins_over_the_constructor():
    env = quick(parameter_overrides={"q10": 3.0, "max_lai_conifer": 6.0})
    observation, _ = env.reset(seed=1, options={"site": {"q10": 2.0}})
    assert observation[INDEX["site_q10"]] == pytest.approx(0.4)
    assert observation[INDEX["site_max_lai_conifer"]] == pytest.approx(1.5)
    assert env.reset(seed=1)[0][INDEX["site_q10"]] == pytest.approx(2.4)


def test_a_site_seed_fixes_the_site_not_the_weather():
    one, other = (play(quick(site_seed=9, record_years=True), ACTIONS, seed=seed) for seed in (1, 2))
    np.testing.assert_array_equal(one[0][:, SITE], other[0][:, SITE])
    assert one[2]["site_seed"] == other[2]["site_seed"] == 9
    assert (one[2]["years"]["precipitation_mm"] != other[2]["years"]["precipitation_mm"]).all()


def test_first_stocks_are_drawn_from_their_ranges():
    observations, _ = quick_vector(64).reset(seed=1)
    density, conifers = 1500.0 * observations[:, INDEX["density"]], observations[:, INDEX["conifer_fraction"]]
    soil, biomass = (50.0 * observations[:, INDEX[name]] for name in ("soil", "biomass"))
    for values, low, high in ((density, 0.0, 600.0), (conifers, 0.2, 0.8), (soil, 2.0, 10.0)):
        assert low - 1e-3 <= values.min() < low + 0.15 * (high - low)
        assert high - 0.15 * (high - low) < values.max() <= high + 1e-3
    assert biomass.max() <= 10.0 and (biomass <= 1e-4 * 120.0 * density + 1e-4).all()
    narrow = quick_vector(16, initial_ranges={"density_stems_ha": (700.0, 710.0)}).reset(seed=1)[0]
    assert (np.abs(1500.0 * narrow[:, INDEX["density"]] - 705.0) <= 5.001).all()


def test_an_overridden_range_is_drawn_from():
    drawn, _ = quick_vector(32, parameter_overrides={"q10": (1.9, 2.0)}).reset(seed=1)
    q10 = 1.8 + 0.5 * drawn[:, INDEX["site_q10"]]
    assert 1.9 <= q10.min() < 1.92 and 1.98 < q10.max() <= 2.0
    whole, _ = quick_vector(32).reset(seed=1)
    np.testing.assert_array_equal(np.delete(drawn, INDEX["site_q10"], 1), np.delete(whole, INDEX["site_q10"], 1))


def test_the_interpreted_backend_gives_the_same_episode():
    compiled, interpreted = (
        play(quick(years=1, time_step_minutes=720, backend=backend), [24], seed=1) for backend in ("numba", "python")
    )
    for one, other in zip(compiled[:2], interpreted[:2], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-7)


# ------------------------------------------------------------------------------------------- site-specific mode


def test_site_specific_mode_is_one_world_whatever_the_seed():
    episodes = [play(quick(mode="site_specific", record_years=True), ACTIONS, seed=seed) for seed in (1, 2)]
    (one, rewards, info), (other, other_rewards, other_info) = episodes
    assert one.shape[1] == 43
    np.testing.assert_array_equal(one[:, 1:], other[:, 1:])
    assert one[0, 0] != other[0, 0]
    np.testing.assert_array_equal(rewards, other_rewards)
    assert_same(info["years"], other_info["years"])


def test_site_specific_mode_is_the_middle_of_every_range_without_noise():
    observation, _ = quick(mode="site_specific").reset(seed=1)
    middle = {
        "density": 300.0 / 1500.0,
        "conifer_fraction": 0.5,
        "soil": 6.0 / 50.0,
        "latitude": 10.5 / 20.0,
        "seasonal_amplitude": 22.5 / 30.0,
        "growth_start_day": 140.0 / 365.0,
    }
    for name, value in middle.items():
        assert observation[INDEX[name]] == pytest.approx(value, rel=1e-5), name
    daily = sim.simulate({"daily_noise_std_c": 0.0}, 12, seed=0, years=1, time_step_minutes=240, output="daily")
    smooth = np.abs(np.diff(daily.air_temperature_c)).max()
    assert smooth < 1.0


def test_site_specific_mode_with_another_site():
    default = play(quick(mode="site_specific"), ACTIONS, seed=1)
    other, again = (play(quick(mode="site_specific", site_seed=5), ACTIONS, seed=seed) for seed in (1, 2))
    assert not np.array_equal(default[0][0, 5:11], other[0][0, 5:11])
    np.testing.assert_array_equal(other[0][:, 1:], again[0][:, 1:])
    latitude = sim.sample_site(5)["latitude_deg"]
    assert other[0][0, INDEX["latitude"]] == pytest.approx((latitude - 50.0) / 20.0, rel=1e-5)


# ------------------------------------------------------------------------------------------------ vectorisation


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


# ---------------------------------------------------------------------------------------------------- resuming


def test_an_episode_resumes_from_its_state():
    env = quick(record_years=True)
    env.reset(seed=3)
    for action in (24, 0):
        env.step(action)
    saved = pickle.dumps(env.get_state())
    resumed = quick(record_years=True)
    resumed.set_state(pickle.loads(saved))
    np.testing.assert_array_equal(resumed.action_masks(), env.action_masks())
    for action in (17, 3):
        for one, other in zip(env.step(action), resumed.step(action), strict=True):
            assert_same(one, other)
    np.testing.assert_array_equal(env.reset()[0], resumed.reset()[0])  # the generator goes on too


def test_lockstep_resumes_from_its_state():
    actions = np.random.default_rng(0).integers(0, 25, (9, 5))
    envs = quick_vector(5, record_years=True)
    vector_trace(envs, actions[:2], 8)
    resumed = quick_vector(5, record_years=True)
    resumed.set_state(pickle.loads(pickle.dumps(envs.get_state())))
    for row in actions:
        for one, other in zip(envs.step(row), resumed.step(row), strict=True):
            assert_same(one, other)


def test_a_saved_state_does_not_change_as_the_episode_goes_on():
    env = quick()
    env.reset(seed=3)
    saved = env.get_state()
    before = pickle.dumps(saved)
    env.step(24)
    assert pickle.dumps(saved) == before


def test_the_state_of_another_environment_is_refused():
    saved = quick(years=2)
    saved.reset(seed=1)
    with pytest.raises(ValueError, match="2.*4|4.*2"):
        quick(years=4).set_state(saved.get_state())


# -------------------------------------------------------------------------------------------------------- masks


def test_masks_of_worked_cases():
    def mask(density, harvestable, **kwargs):
        observation = np.zeros(43, np.float32)
        observation[INDEX["density"]] = density / 1500.0
        observation[INDEX["conifer_mature"]] = harvestable / density
        observation[INDEX["deciduous_seedling"]] = 1.0 - harvestable / density
        valid = boreal_env.action_masks(observation, **kwargs)
        assert valid.shape == (1, 25)
        assert (valid.reshape(5, 5) == valid.reshape(5, 5)[:, :1]).all()  # the mix does not matter
        return valid.reshape(5, 5)[:, 0].tolist()

    assert mask(600.0, 300.0) == [True, True, True, True, True]
    assert mask(600.0, 60.0) == [False, True, True, True, True]
    assert mask(230.0, 230.0) == [False, True, True, True, True]
    assert mask(180.0, 180.0) == [False, False, True, True, True]
    assert mask(1920.0, 0.0) == [False, False, True, True, False]
    assert mask(1980.0, 1000.0) == [True, True, True, False, False]
    assert mask(1900.0, 0.0) == [False, False, True, True, False]  # planting has to end below 2000
    assert mask(600.0, 300.0, harvest_min_class="old") == [False, False, True, True, True]


@pytest.mark.parametrize("youngest", ["young", "mature", "old"])
def test_valid_means_no_penalty_and_invalid_a_penalty(youngest):
    years, number = 15, 48
    ranges = {"density_stems_ha": (0.0, 2200.0), "oldest_age_years": (10.0, 150.0)}
    envs = quick_vector(number, years=years, initial_ranges=ranges, harvest_min_class=youngest, record_years=True)
    generator = np.random.default_rng(5)
    observations, _ = envs.reset(seed=77)
    allowed = []
    for _ in range(years):
        masks = envs.action_masks()
        np.testing.assert_array_equal(masks, boreal_env.action_masks(observations, youngest))
        actions = generator.integers(0, 25, number)
        allowed.append(masks[np.arange(number), actions])
        observations, *_, infos = envs.step(actions)
    allowed = np.array(allowed)
    records = infos["final_info"]["years"]
    penalty = np.stack(records["ineffective_penalty"]).T
    density = np.stack(records["density_after_action"]).T
    assert 0.1 < allowed.mean() < 0.95
    assert (penalty[allowed] == 0.0).all()
    assert (penalty[~allowed] > 0.0).all() and penalty.max() <= 0.5
    planted = np.stack(records["planted_stems_ha"]).T > 0.0
    assert (density[allowed & planted] < 2000.0).all()


def test_the_mask_of_one_environment_is_that_of_its_observation():
    env = quick()
    observation, _ = env.reset(seed=5)
    for action in (24, 0, 0, 3):
        np.testing.assert_array_equal(env.action_masks(), boreal_env.action_masks(observation[None])[0])
        observation, *_ = env.step(action)


def test_the_penalty_is_half_the_share_that_could_not_be_made():
    ranges = {"density_stems_ha": (1970.0, 1970.0)}
    _, _, info = play(quick(initial_ranges=ranges, years=1, record_years=True), [24], seed=1)
    assert info["years"]["planted_stems_ha"][0] == pytest.approx(30.0)
    assert info["years"]["ineffective_penalty"][0] == pytest.approx(0.5 * 70.0 / 100.0)
    assert info["years"]["density_penalty"][0] == 1.0  # 2000 stems after planting


def test_planting_up_to_the_limit_costs_the_density_penalty_whatever_the_mix():
    """Stems of two species and many ages add up to 2000 but for round-off, on either side."""
    starts, mixes = np.repeat(np.arange(16), 5), np.tile(np.arange(5), 16)
    ranges = {"density_stems_ha": (1901.0, 2000.0)}
    envs = quick_vector(80, years=1, time_step_minutes=1440, record_years=True, initial_ranges=ranges)
    envs.reset(seed=starts.tolist())
    years = envs.step(20 + mixes)[4]["final_info"]["years"]
    density = np.concatenate(years["density_after_action"])
    np.testing.assert_allclose(density, 2000.0, rtol=1e-12)
    assert (density < 2000.0).any()
    assert (np.concatenate(years["density_penalty"]) == 1.0).all()


def test_planting_that_ends_just_below_the_limit_costs_nothing():
    env = quick(years=1, record_years=True, initial_ranges={"density_stems_ha": (1899.99, 1899.99)})
    env.reset(seed=1)
    assert env.action_masks()[24]
    years = env.step(24)[4]["years"]
    assert years["density_after_action"][0] == pytest.approx(1999.99, abs=1e-9)
    assert years["density_penalty"][0] == years["ineffective_penalty"][0] == 0.0


def test_masks_of_nan_are_refused():
    observations = np.zeros((2, 43))
    observations[1, INDEX["density"]] = NAN
    with pytest.raises(ValueError, match="observations: finite densities"):
        boreal_env.action_masks(observations)


@pytest.mark.parametrize("shape", [(2, 10), (2, 42), (2, 44), (2, 104), (2, 106), (2, 2, 105), (0,)], ids=str)
def test_masks_of_arrays_that_are_no_whole_observations_are_refused(shape):
    message = r"observations of shape .*: \(n, 43\) or \(n, 105\), all groups .*; env.action_masks\(\) works"
    with pytest.raises(ValueError, match=message):
        boreal_env.action_masks(np.zeros(shape))


# ------------------------------------------------------------------------------------------------------- reward


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
    _, rewards, info = play(quick(reward=constants, record_years=True, initial_ranges=ranges), [2] * 4, seed=1)
    y = info["years"]
    expected = (
        np.clip(y["net_carbon_change_kgc_m2"] / 0.5, -1.0, 1.0)
        + 0.1 * np.clip((y["biomass_kgc_m2"] + y["soil_kgc_m2"]) / 50.0, 0.0, 1.0)
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


def test_the_record_of_an_episode_has_every_column_for_every_year():
    _, _, info = play(quick(record_years=True), ACTIONS, seed=2)
    assert set(sim.RECORD_NAMES) | {"carbon_reward", "thaw_reward"} <= set(info["years"])
    assert {len(column) for column in info["years"].values()} == {4}
    assert "years" not in play(quick(), ACTIONS, seed=2)[2]


def test_final_totals_are_those_of_the_record():
    _, _, info = play(quick(record_years=True), ACTIONS, seed=2)
    y = info["years"]
    assert info["final_density"] == y["density_stems_ha"][-1]
    assert info["mean_density"] == pytest.approx(y["density_stems_ha"].mean())
    assert info["final_conifer_fraction"] == y["conifer_fraction"][-1]
    for name in ("growing_season_days", "latent_heat_mj_m2", "ground_shortwave_mj_m2"):
        assert info[name] == pytest.approx(y[name].mean())


def test_five_actions_without_density_change_are_equal():
    episodes = [play(quick(), [action] * 4, seed=1) for action in range(10, 15)]
    mix = INDEX["mix_action"]
    for observations, rewards, _ in episodes[1:]:
        np.testing.assert_array_equal(np.delete(observations, mix, axis=1), np.delete(episodes[0][0], mix, axis=1))
        np.testing.assert_array_equal(rewards, episodes[0][1])


def test_the_physics_can_be_changed_through_the_environment():
    for change in (
        {"constants": {"light_use_conifer": 2.0}},
        {"mechanisms": {"moss": False}},
        {"hwp_half_life_years": 5},
        {"time_step_minutes": 120},
    ):
        ranges = {"density_stems_ha": (590.0, 600.0)}
        base = play(quick(initial_ranges=ranges), ACTIONS, seed=1)[1]
        assert not np.array_equal(play(quick(initial_ranges=ranges, **change), ACTIONS, seed=1)[1], base), change


# --------------------------------------------------------------------------------------- objectives of one's own

PRICE = 200.0  # of a kgC/m2 of timber


def timber_revenue(year):
    """What the timber of a year is sold for, less what planting costs."""
    return PRICE * year["harvest_kgc_m2"] - 0.1 * year["planted_stems_ha"]


TIMBER = Objective("timber", timber_revenue, low=-10.0, high=100.0)
THREE = ("carbon", "thaw", TIMBER)
OLD_STAND = {"density_stems_ha": (900.0, 900.0), "biomass_kgc_m2": (8.0, 9.0), "oldest_age_years": (120.0, 120.0)}


def test_a_third_objective():
    kwargs = {"record_years": True, "initial_ranges": OLD_STAND}
    env = quick(objectives=THREE, **kwargs)
    assert env.reward_dim == 3
    assert env.reward_space == gym.spaces.Box(np.float32([-1, -1, -10]), np.float32([1, 1, 100]))
    actions = [0, 24, 12, 4]
    observations, rewards, info = play(env, actions, seed=1)
    paper_observations, paper_rewards, paper_info = play(quick(**kwargs), actions, seed=1)
    np.testing.assert_array_equal(observations, paper_observations)
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
        (lambda: quick(objectives=("carbon", "timber")), r"objective 'timber': allowed are carbon, thaw"),
        (lambda: quick(objectives=()), r"objectives: .* got \(\)"),
        (lambda: quick(objectives="carbon"), r"objectives: .* got 'carbon'"),
        (lambda: quick(objectives=None), r"objectives: .* got None"),
        (lambda: quick(objectives=("carbon", timber_revenue)), r"objective <function .*: allowed are carbon, thaw"),
        (lambda: quick(objectives=("thaw", "thaw")), r"objectives thaw, thaw: each is allowed once"),
        (lambda: Objective("carbon", timber_revenue), r"objective name 'carbon': an identifier is allowed"),
        (lambda: Objective("my timber", timber_revenue), r"objective name 'my timber': an identifier"),
        (lambda: Objective("timber", 5.0), r"objective timber: a function .* got 5.0"),
        (lambda: Objective("timber", timber_revenue, 1.0, 0.0), r"objective timber: .* low < high .* \(1.0, 0.0\)"),
        (lambda: Objective("timber", timber_revenue, 0.0, np.inf), r"objective timber: finite limits .* inf"),
        (lambda: play(quick(objectives=(Objective("bad", lambda year: 1.0),)), [12]), r"objective bad: 1 finite"),
        (lambda: play(quick(objectives=(Objective("bad", lambda year: [NAN]),)), [12]), r"objective bad: .*nan"),
    ],
)
def test_bad_objectives_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# ----------------------------------------------------------------------------------------------------- refusals

NAN = float("nan")
BAD_ARGUMENTS = {
    "mode": ({"mode": "specialist"}, r"mode 'specialist': allowed are generalist, site_specific"),
    "years 0": ({"years": 0}, r"years: an integer in \[1, 1000\] is allowed, got 0"),
    "years of float": ({"years": 1.5}, r"years: .* got 1.5"),
    "years of bool": ({"years": True}, r"years: .* got True"),
    "years of text": ({"years": "50"}, r"years: .* got '50'"),
    "time step 7": ({"time_step_minutes": 7}, r"time_step_minutes = 7: a divisor of 1440"),
    "time step of float": ({"time_step_minutes": 30.0}, r"time_step_minutes: .* got 30.0"),
    "backend": ({"backend": "torch"}, r"backend 'torch': allowed are numba, python"),
    "thaw formulation": ({"thaw_formulation": "thaw"}, r"thaw_formulation 'thaw': allowed are asymmetric, contrast"),
    "preference above 1": ({"fixed_preference": 1.1}, r"^fixed_preference: a number in \[0, 1\] is allowed, got 1.1"),
    "preference nan": ({"fixed_preference": NAN}, r"preference: .* got nan"),
    "preference of text": ({"fixed_preference": "carbon"}, r"preference: .* got 'carbon'"),
    "site seed -1": ({"site_seed": -1}, r"site_seed: .* got -1"),
    "site seed of float": ({"site_seed": 1.0}, r"site_seed: .* got 1.0"),
    "site seed beyond 64 bits": ({"site_seed": 2**70}, r"site_seed: .* got 1180591620717411303424"),
    "unknown parameter": ({"parameter_overrides": {"q11": 2}}, r"unknown site parameter 'q11'; did you mean q10"),
    "parameter beyond limits": ({"parameter_overrides": {"q10": 5}}, r"q10 = 5 is outside .*\[1, 4\]"),
    "parameter nan": ({"parameter_overrides": {"q10": NAN}}, r"q10: a finite number is allowed, got nan"),
    "parameter range reversed": ({"parameter_overrides": {"q10": (2.2, 1.9)}}, r"q10: range reversed, 2.2 > 1.9"),
    "parameters in a list": ({"parameter_overrides": [1]}, r"site parameters: a dict .* got list"),
    "parameters as text": ({"parameter_overrides": "q10"}, r"site parameters: a dict .* got str"),
    "unknown range": ({"initial_ranges": {"carbon": (0, 1)}}, r"unknown initial range 'carbon'; allowed: density"),
    "range of one": ({"initial_ranges": {"biomass_kgc_m2": 3}}, r"initial range biomass_kgc_m2: a \(low, high\) pair"),
    "range reversed": ({"initial_ranges": {"biomass_kgc_m2": (3, 1)}}, r"biomass_kgc_m2: reversed, 3 > 1"),
    "range beyond limits": ({"initial_ranges": {"biomass_kgc_m2": (-1, 1)}}, r"biomass_kgc_m2 = -1: .*\[0, 60\]"),
    "ranges in a list": ({"initial_ranges": [1]}, r"initial.*dict.* got list"),
    "half-life 0": ({"hwp_half_life_years": 0}, r"hwp_half_life_years.* 0"),
    "half-life of text": ({"hwp_half_life_years": "long"}, r"hwp_half_life_years.*'long'"),
    "half-life of bool": ({"hwp_half_life_years": True}, r"hwp_half_life_years.*True"),
    "harvest class": ({"harvest_min_class": "sapling"}, r"harvest_min_class 'sapling': allowed are young, mature, old"),
    "harvest classes": ({"harvest_min_class": ["old"]}, r"harvest_min_class \['old'\]: allowed are young, mature, old"),
    "unknown reward constant": ({"reward": {"carbon": 1}}, r"unknown reward constant 'carbon'; allowed: carbon_scale"),
    "reward scale 0": ({"reward": {"carbon_scale": 0}}, r"reward carbon_scale = 0: a positive number"),
    "reward penalty below 0": ({"reward": {"density_penalty": -1}}, r"reward density_penalty = -1: a non-negative"),
    "reward nan": ({"reward": {"thaw_scale": NAN}}, r"reward thaw_scale: a finite number is allowed, got nan"),
    "reward of number": ({"reward": 2.0}, r"reward: a Reward or a dict .* got float"),
    "unknown mechanism": ({"mechanisms": {"moose": True}}, r"unknown mechanism 'moose'; did you mean moss"),
    "mechanism of number": ({"mechanisms": {"fire": 1}}, r"mechanism 'fire': True or False is allowed, got 1"),
    "mechanisms in a list": ({"mechanisms": ["fire"]}, r"mechanisms: a dict .* got list"),
    "unknown constant": ({"constants": {"par": 1}}, r"unknown constant 'par'"),
    "constant beyond limits": ({"constants": {"reference_lai": 99}}, r"reference_lai = 99 is outside .*\[0.5, 10\]"),
    "constants out of order": (
        {"constants": {"vpd_low_hpa": 20.0, "vpd_high_conifer_hpa": 5.0}},
        r"vpd_low_hpa = 20 .*vpd_high_conifer_hpa = 5",
    ),
    "unknown group": ({"observation_groups": ("water",)}, r"observation group 'water': allowed are preference, state"),
    "groups as text": ({"observation_groups": "state"}, r"observation_groups.*'state'"),
    "groups as number": ({"observation_groups": 5}, r"observation_groups.*5"),
    "no groups": ({"observation_groups": ()}, r"observation_groups"),
    "no group left": ({"observation_groups": ("site",), "mode": "site_specific"}, r"observation_groups.*site"),
    "group twice": ({"observation_groups": ("age", "state", "age")}, r"observation_groups age, state, age: each"),
    "balanced of number": ({"balanced": 1.4}, r"balanced: True or False is allowed, got 1.4"),
    "record of number": ({"record_years": 1}, r"record_years: True or False is allowed, got 1"),
    "render mode": ({"render_mode": "human"}, r"render_mode 'human': allowed are rgb_array"),
}


@pytest.mark.parametrize(("arguments", "message"), BAD_ARGUMENTS.values(), ids=BAD_ARGUMENTS)
def test_constructor_refuses(arguments, message):
    for make in (BorealEnv, lambda **kwargs: BorealVectorEnv(2, **kwargs)):
        if make is not BorealEnv and "render_mode" in arguments:
            continue
        with pytest.raises(ValueError, match=message) as refusal:
            make(**arguments)
        assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("make", [BorealEnv, BorealVectorEnv])
def test_an_unknown_argument_is_refused_by_name(make):
    with pytest.raises((TypeError, ValueError), match="carbon_price"):
        make(carbon_price=3)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (25, r"action 25: integers in \[0, 25\)"),
        (-1, r"action -1: integers in \[0, 25\)"),
        (3.0, r"float64: integers in \[0, 25\)"),
        (np.float32(3), r"float32: integers in \[0, 25\)"),
        (NAN, r"float64: integers"),
        (True, r"bool: integers"),
        (None, r"integers in \[0, 25\)"),
        ("plant", r"integers in \[0, 25\)"),
        ([1, 2], r"\[1, 2\]: one integer in \[0, 25\)"),
        ([], r"\[\]: one integer in \[0, 25\)"),
    ],
)
def test_step_refuses(action, message):
    env = quick()
    env.reset(seed=1)
    with pytest.raises(ValueError, match=message):
        env.step(action)
    np.testing.assert_array_equal(env.step(24)[0], play(quick(), [24], seed=1)[0][1])  # nothing has happened


@pytest.mark.parametrize("action", [np.int64(24), np.int8(24), np.array(24)])
def test_integers_of_any_kind_are_actions(action):
    np.testing.assert_array_equal(play(quick(), [action], seed=1)[0], play(quick(), [24], seed=1)[0])


@pytest.mark.parametrize("make", [quick, lambda: quick_vector(1)], ids=["single", "vector"])
def test_step_before_reset_is_refused(make):
    with pytest.raises(RuntimeError, match="call reset first"):
        make().step([12] if isinstance(make(), BorealVectorEnv) else 12)


@pytest.mark.parametrize("make", [quick, lambda **kwargs: quick_vector(2, **kwargs)], ids=["single", "vector"])
def test_masks_before_reset_are_refused(make):
    with pytest.raises(RuntimeError, match="action_masks of episode 0 that has not begun: call reset first"):
        make().action_masks()


def test_a_picture_before_reset_is_refused():
    with pytest.raises(RuntimeError, match="picture of episode 0 that has not begun: call reset first"):
        quick(render_mode="rgb_array").render()


def test_masks_stay_after_the_end():
    env = quick(years=2)
    observations, *_ = play(env, [24, 24], seed=1)
    np.testing.assert_array_equal(env.action_masks(), boreal_env.action_masks(observations[-1])[0])


@pytest.mark.parametrize(("state", "got"), [({}, r"\[\]"), (None, "NoneType"), ({"generator": 1}, r"\['generator'\]")])
def test_what_is_no_state_is_refused(state, got):
    for env in (quick(), quick_vector(2)):
        with pytest.raises(ValueError, match=rf"state: a dict of episodes, generators?.* got {got}"):
            env.set_state(state)


def test_the_state_of_a_vector_environment_is_not_that_of_one():
    one, envs = quick(), quick_vector(1)
    one.reset(seed=1), envs.reset(seed=1)
    with pytest.raises(ValueError, match="state of a vector environment given to a single one"):
        one.set_state(envs.get_state())
    with pytest.raises(ValueError, match="state of a single environment given to a vector one"):
        envs.set_state(one.get_state())


def test_a_closed_vector_environment_is_refused():
    envs = quick_vector(2)
    envs.reset(seed=1)
    envs.close()
    for call in (lambda: envs.step([12, 12]), lambda: envs.reset(seed=1)):
        with pytest.raises(gym.error.ClosedEnvironmentError, match="closed"):
            call()


def test_step_after_the_end_is_refused():
    env = quick()
    play(env, [12] * 4, seed=1)
    with pytest.raises(RuntimeError, match="call reset first"):
        env.step(12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"preference": 1.5}, r"preference: a number in \[0, 1\] is allowed, got 1.5"),
        ({"preference": -0.1}, r"preference: .* got -0.1"),
        ({"preference": NAN}, r"preference: .* got nan"),
        ({"preference": "carbon"}, r"preference: .* got 'carbon'"),
        ({"preference": True}, r"preference: .* got True"),
        ({"weight": 0.5}, r"unknown reset option 'weight'; allowed: preference, site"),
        ({"site": {"q11": 2.0}}, r"unknown site parameter 'q11'; did you mean q10"),
        ({"site": {"q10": 50.0}}, r"q10 = 50 is outside .*\[1, 4\]"),
        ({"site": 5}, r"site parameters: a dict .* got int"),
        ([0.5], r"reset options: a dict is allowed, got list"),
    ],
)
def test_reset_refuses(options, message):
    for env in (quick(), quick_vector(2)):
        with pytest.raises(ValueError, match=message):
            env.reset(seed=1, options=options)


@pytest.mark.parametrize("seed", [-1, 1.5, "one", True, [1, 2.5], [1, -2]])
def test_bad_seeds_are_refused(seed):
    with pytest.raises((ValueError, gym.error.Error), match="(?i)seed"):
        quick_vector(2).reset(seed=seed)
    with pytest.raises((ValueError, gym.error.Error), match="(?i)seed"):
        quick().reset(seed=seed)


BAD_VECTORS = {
    "no environments": ((0, {}), r"num_envs: a positive integer is allowed, got 0"),
    "two and a half": ((2.5, {}), r"num_envs: .* got 2.5"),
    "group of three in four": ((4, {"group_size": 3}), r"group_size = 3: a divisor of num_envs = 4"),
    "group of none": ((4, {"group_size": 0}), r"group_size: a positive integer is allowed, got 0"),
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
        ([1.0, 2.0, 3.0], r"actions of type float64"),
        (3, r"actions of shape \(\)"),
        ([[1, 2, 3]], r"actions of shape \(1, 3\)"),
    ],
)
def test_vector_step_refuses(actions, message):
    envs = quick_vector(3)
    envs.reset(seed=1)
    with pytest.raises(ValueError, match=message):
        envs.step(actions)
