"""Episodes: seeds, sites, starts, modes, what is told at the end."""

import numpy as np
import pytest
from playing import ACTIONS, CLIMATE, ENTRIES, INDEX, SITE, WITHOUT_SITE, assert_same, play, quick, quick_vector

import boreal_env
import sim
from analysis import document_environment


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
    by_argument = {"years", "net_present_value_eur_ha"}
    assert infos[3].keys() | by_argument == document_environment.FINAL_INFO.keys()


def test_seeds_of_the_fixed_world_are_what_the_page_says():
    default, other = (play(quick(mode="site-specific", **k), ACTIONS, seed=1)[2] for k in ({}, {"site_seed": 5}))
    assert (default["site_seed"], default["episode_seed"]) == (-1, 0)
    assert (other["site_seed"], other["episode_seed"]) == (5, 5)


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


@pytest.mark.parametrize("how", ["option", "constructor"])
def test_a_site_override_changes_nothing_else(how):
    drawn = play(quick(record_years=True), ACTIONS, seed=2)
    if how == "option":
        given = play(quick(record_years=True), ACTIONS, seed=2, options={"site": {"q10": 3.1}})
    else:
        given = play(quick(record_years=True, parameter_overrides={"q10": 3.1}), ACTIONS, seed=2)
    np.testing.assert_allclose(given[0][0][INDEX["site_q10"]], (3.1 - 1.8) / 0.5, rtol=1e-6)
    # the first dead wood, which is in the stand's carbon, is in balance with its decay
    same = np.delete(np.arange(ENTRIES), [INDEX["site_q10"], INDEX["carbon_stock"]])
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
    other = [INDEX["site_q10"], INDEX["carbon_stock"]]
    np.testing.assert_array_equal(np.delete(drawn, other, 1), np.delete(whole, other, 1))


def test_the_interpreted_backend_gives_the_same_episode():
    compiled, interpreted = (
        play(quick(years=1, time_step_minutes=720, backend=backend), [24], seed=1) for backend in ("numba", "python")
    )
    for one, other in zip(compiled[:2], interpreted[:2], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-7)


def test_site_specific_mode_is_one_world_whatever_the_seed():
    episodes = [play(quick(mode="site-specific", record_years=True), ACTIONS, seed=seed) for seed in (1, 2)]
    (one, rewards, info), (other, other_rewards, other_info) = episodes
    assert one.shape[1] == WITHOUT_SITE
    np.testing.assert_array_equal(one[:, 1:], other[:, 1:])
    assert one[0, 0] != other[0, 0]
    np.testing.assert_array_equal(rewards, other_rewards)
    assert_same(info["years"], other_info["years"])


def test_site_specific_mode_is_the_middle_of_every_range_without_noise():
    env = quick(mode="site-specific")
    observation, _ = env.reset(seed=1)
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
    noise = sim.state.PARAMETER_NAMES.index("daily_noise_std_c")
    assert env._episodes.stands.parameters[0, noise] == 0.0


def test_site_specific_mode_with_another_site():
    default = play(quick(mode="site-specific"), ACTIONS, seed=1)
    other, again = (play(quick(mode="site-specific", site_seed=5), ACTIONS, seed=seed) for seed in (1, 2))
    assert not np.array_equal(default[0][0, CLIMATE], other[0][0, CLIMATE])
    np.testing.assert_array_equal(other[0][:, 1:], again[0][:, 1:])
    latitude = sim.sample_site(5)["latitude_deg"]
    assert other[0][0, INDEX["latitude"]] == pytest.approx((latitude - 50.0) / 20.0, rel=1e-5)


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
    assert info["mean_conifer_fraction"] == pytest.approx(y["conifer_fraction"].mean())
    for name in ("growing_season_days", "latent_heat_mj_m2", "ground_shortwave_mj_m2"):
        assert info[name] == pytest.approx(y[name].mean())


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
