"""The observation: its table, what each entry is, its space, its page."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest
from playing import (
    ACTIONS,
    BIOMASS_LIMIT,
    CLIMATE,
    ENTRIES,
    INDEX,
    SITE,
    SOIL_LIMIT,
    WITHOUT_SITE,
    eventful_episode,
    play,
    quick,
    quick_vector,
)
from scripts import ROOT

import boreal_env
import sim
from analysis import document_environment
from boreal_env import OBSERVATION, OBSERVATION_NAMES, Observed
from sim.task import observation
from sim.task.objectives import HISTORY_NAMES


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
    observed = [sim.SITE_PARAMETERS[name] for name in sim.OBSERVED_SITE_PARAMETERS]
    expected = [(getattr(p, corner) - p.low) / (p.high - p.low) for p in observed]
    np.testing.assert_allclose(observation[SITE], expected, rtol=1e-5)


def test_drought_is_observed_up_to_its_limit():
    record = np.zeros((2, len(HISTORY_NAMES)))
    record[:, HISTORY_NAMES.index("drought_index")] = 50.0, 14_471.0
    row = next(row for row in OBSERVATION if row.name == "drought_index_1yr")
    assert row.source(SimpleNamespace(record=record)).tolist() == [50.0, row.high]


def test_penalties_of_heavy_constants_lie_in_the_observation_space():
    reward = {"biomass_limit": 0.001, "soil_limit": 0.001, "density_penalty": 500.0}
    env = quick(reward=reward, initial_ranges={"density_stems_ha": (2100.0, 2200.0)})
    env.reset(seed=1)
    observation = env.step(24)[0]
    assert observation in env.observation_space
    penalties = slice(INDEX["biomass_limit_penalty"], INDEX["density_penalty"] + 1)
    assert (observation[penalties] > quick().observation_space.high[penalties]).tolist() == [True, True, True]


PAPER_ORDER = """
preference year density conifer_fraction carbon_stock latitude mean_annual_temperature seasonal_amplitude
growth_start_day fall_start_day growing_season_length fire_mortality_1yr fire_mortality_2yr insect_mortality_1yr
insect_mortality_2yr drought_index_1yr drought_index_2yr biomass_change soil_change total_change natural_mortality
litterfall thinning_loss products_stored density_action mix_action density_change mix_change conifer_seedling
conifer_sapling conifer_young conifer_mature conifer_old deciduous_seedling deciduous_sapling deciduous_young
deciduous_mature deciduous_old biomass soil biomass_limit_penalty soil_limit_penalty density_penalty
""".split()


def test_entries_have_the_papers_order():
    assert list(OBSERVATION_NAMES) == PAPER_ORDER + [f"site_{name}" for name in sim.OBSERVED_SITE_PARAMETERS]
    assert (ENTRIES, WITHOUT_SITE) == (105, 43)
    assert all(entry.low < entry.high and entry.scale > 0.0 and entry.unit for entry in OBSERVATION)


@pytest.fixture(scope="module")
def episode():
    return eventful_episode()


def deadwood(r):
    return r["conifer_deadwood_kgc_m2"] + r["deciduous_deadwood_kgc_m2"]


# Name of an entry -> its value after year t, from the annual record.
FORMULAS = {
    "preference": lambda r, t: 0.3,
    "year": lambda r, t: (t + 1) / 50.0,
    "density": lambda r, t: r["density_stems_ha"][t] / 1500.0,
    "conifer_fraction": lambda r, t: r["conifer_fraction"][t],
    "carbon_stock": lambda r, t: (r["biomass_kgc_m2"][t] + deadwood(r)[t] + r["soil_kgc_m2"][t]) / 50.0,
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
        rows = [row for row in csv.DictReader(file) if row["observed"] == "yes"]
    ranges = {row["name"]: (float(row["low"]), float(row["high"])) for row in rows}
    scaled = [(site[name] - low) / (high - low) for name, (low, high) in ranges.items()]
    assert len(scaled) == 62
    for one in observations:
        np.testing.assert_allclose(one[CLIMATE], climate, rtol=1e-5)
        np.testing.assert_allclose(one[SITE], scaled, rtol=1e-5, atol=1e-6)


def test_every_index_is_compared_with_a_formula():
    elsewhere = {"density_action", "mix_action", "mix_change", *OBSERVATION_NAMES[CLIMATE], *OBSERVATION_NAMES[SITE]}
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
    assert quick_vector(2, mode="site-specific").observation_names == OBSERVATION_NAMES[:WITHOUT_SITE]


# -------------------------------------------------------------------------------------------------- a row more


def test_a_row_is_all_that_a_new_entry_needs(monkeypatch):
    row = Observed("snowpack", "snow", "mm", 0, 100, 0, 1e4, observation.recorded("peak_swe_mm"))
    old, _, info = play(quick(record_years=True), ACTIONS, seed=3)
    monkeypatch.setattr(observation, "ROWS", (*observation.ROWS[:1], row, *observation.ROWS[1:]))
    env = quick()
    new, *_ = play(env, ACTIONS, seed=3)
    assert env.observation_names == (*OBSERVATION_NAMES[:2], "snowpack", *OBSERVATION_NAMES[2:])
    assert env.observation_space.shape == (ENTRIES + 1,) and all(values in env.observation_space for values in new)
    np.testing.assert_array_equal(np.delete(new, 2, axis=1), old)
    assert new[0, 2] == 0.0
    np.testing.assert_allclose(new[1:, 2], info["years"]["peak_swe_mm"] / 100.0, rtol=1e-6)
    np.testing.assert_array_equal(boreal_env.action_masks(new[-1])[0], env.action_masks())
    assert quick(mode="site-specific").observation_space.shape == (WITHOUT_SITE + 1,)
    assert quick(observation_groups=("snow",)).observation_names == ("snowpack",)
    assert "| 2 | `snowpack` | mm | x / 100 | 0 .. 10000 | snow |" in document_environment.page()


def test_rows_may_look_a_year_back(monkeypatch):
    row = Observed("density_before", "state", "stems ha-1", 0, 1500, 0, 15000, observation.a_year_ago("density"))
    monkeypatch.setattr(observation, "ROWS", (*observation.ROWS, row))
    observations, *_ = play(quick(), ACTIONS, seed=3)
    np.testing.assert_array_equal(observations[1:, -1], observations[:-1, INDEX["density"]])
    assert observations[0, -1] == 0.0


def test_two_rows_of_one_name_are_refused(monkeypatch):
    monkeypatch.setattr(observation, "ROWS", (*observation.ROWS, observation.ROWS[0]))
    with pytest.raises(ValueError, match="entries of the observation: each is allowed once, got year twice"):
        quick()


def test_a_column_that_the_record_has_not_is_refused_where_the_row_is_written():
    with pytest.raises(ValueError, match="no column of the annual record: 'peak_snow'"):
        observation.recorded("peak_snow")
    with pytest.raises(ValueError, match="no parameter of the simulator: 'q11'"):
        observation.parameter("q11")


def test_entries_can_be_read_in_their_unit():
    env = quick(mode="site-specific")
    observations = env.reset(seed=1)[0][None]
    assert boreal_env.in_unit(observations, "density")[0] == pytest.approx(300.0, rel=1e-6)
    assert boreal_env.in_unit(observations, "latitude", env.observation_names)[0] == pytest.approx(60.5, rel=1e-6)
    with pytest.raises(ValueError, match="the observation has no entry 'densities'"):
        boreal_env.in_unit(observations, "densities")
    for shape in ((2, 10), (2, 106), (105,)):  # of three objectives entries are elsewhere
        with pytest.raises(ValueError, match=r"shape \(n, 43\) or \(n, 105\) is allowed without names, got "):
            boreal_env.in_unit(np.zeros(shape), "density")
    with pytest.raises(ValueError, match=r"shape \(n, 43\) or wider is allowed with these names, got \(2, 10\)"):
        boreal_env.in_unit(np.zeros((2, 10)), "density", env.observation_names)
    assert boreal_env.in_unit(np.full((1, 43), 0.3), "preference") == pytest.approx(0.3)
    with pytest.raises(ValueError, match="observations of 43 entries have no 'site_latitude_deg'"):
        boreal_env.in_unit(observations, "site_latitude_deg")
