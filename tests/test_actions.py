"""Actions: which are valid, what the others cost, what is none."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from playing import ENTRIES, INDEX, NAN, THREE, TIMBER, WITHOUT_SITE, play, quick, quick_vector

import boreal_env
import sim
from sim.jit import uncompiled
from sim.management import check_actions, feasible_change, missed_share


def test_masks_of_worked_cases():
    def mask(density, harvestable, **kwargs):
        observation = np.zeros(WITHOUT_SITE, np.float32)
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


def test_actions_in_rows_of_unequal_length_are_refused():
    message = r"^actions \[\[1\], \[2, 3\]\]: rows of unequal length; integers in \[0, 25\) are allowed$"
    with pytest.raises(ValueError, match=message):
        quick().step([[1], [2, 3]])
    with pytest.raises(ValueError, match=message):
        check_actions([[1], [2, 3]], 2)
    with pytest.raises(ValueError, match=message):
        sim.simulate(actions=[[1], [2, 3]], years=2)


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


def test_the_environments_mask_needs_no_whole_observation():
    env, whole = quick(observation_groups=("carbon",)), quick()
    env.reset(seed=3), whole.reset(seed=3)
    np.testing.assert_array_equal(env.action_masks(), whole.action_masks())


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
    observations = np.zeros((2, WITHOUT_SITE))
    observations[1, INDEX["density"]] = NAN
    with pytest.raises(ValueError, match="observations: finite densities"):
        boreal_env.action_masks(observations)


NO_WIDTHS = (10, WITHOUT_SITE - 1, WITHOUT_SITE + 1, ENTRIES - 1, ENTRIES + 1)


@pytest.mark.parametrize("shape", [*((2, width) for width in NO_WIDTHS), (2, 2, ENTRIES), (0,)], ids=str)
def test_masks_of_arrays_that_are_no_whole_observations_are_refused(shape):
    allowed = rf"\(n, {WITHOUT_SITE}\) or \(n, {ENTRIES}\)"
    message = rf"observations of shape .*: {allowed}, all groups .*; env.unwrapped.action_masks\(\) works"
    with pytest.raises(ValueError, match=message):
        boreal_env.action_masks(np.zeros(shape))


def test_five_actions_without_density_change_are_equal():
    episodes = [play(quick(), [action] * 4, seed=1) for action in range(10, 15)]
    mix = INDEX["mix_action"]
    for observations, rewards, _ in episodes[1:]:
        np.testing.assert_array_equal(np.delete(observations, mix, axis=1), np.delete(episodes[0][0], mix, axis=1))
        np.testing.assert_array_equal(rewards, episodes[0][1])


def test_masks_stay_after_the_end():
    env = quick(years=2)
    observations, *_ = play(env, [24, 24], seed=1)
    np.testing.assert_array_equal(env.action_masks(), boreal_env.action_masks(observations[-1])[0])


@pytest.mark.parametrize("make", [quick, lambda **kwargs: quick_vector(2, **kwargs)], ids=["single", "vector"])
def test_masks_before_reset_are_refused(make):
    with pytest.raises(RuntimeError, match="action_masks of episode 0 that has not begun: call reset first"):
        make().action_masks()


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


# ------------------------------------------------------------------------------------------------------- one rule

DENSITIES = st.one_of(st.floats(0.0, 4000.0), st.sampled_from([0.0, 150.0, 200.0, 250.0, 1900.0, 1950.0, 2000.0]))


@given(change=st.sampled_from([-100.0, -50.0, 0.0, 50.0, 100.0]), density=DENSITIES, share=st.floats(0.0, 1.0))
def test_what_can_be_made_of_a_change(change, density, share):
    """Planting ends at 2000 stems; thinning leaves 150, and takes none that may not be cut."""
    harvestable = share * density
    if change > 0.0:
        expected = min(change, max(2000.0 - density, 0.0))
    else:
        expected = -min(-change, harvestable, max(density - 150.0, 0.0))
    assert feasible_change(change, density, harvestable) == expected
    arrays = uncompiled(feasible_change)(np.array([change, 0.0]), np.array([density] * 2), np.array([harvestable] * 2))
    assert arrays.tolist() == [expected, 0.0]

    undone = abs(change - expected)
    share_undone = 0.0 if undone < 0.01 else undone / abs(change)
    assert missed_share(np.array([change]), np.array([expected])) == share_undone
    valid = boreal_env.valid_actions(np.array([density]), np.array([harvestable]))[0]
    if valid[int(5 * [-100.0, -50.0, 0.0, 50.0, 100.0].index(change))]:
        assert share_undone == 0.0


def test_masks_are_the_rule_with_half_of_what_is_negligible_to_spare():
    generator = np.random.default_rng(0)
    density, share = generator.uniform(0.0, 2500.0, 20000), generator.random(20000)
    harvestable = share * density
    masks = boreal_env.valid_actions(density, harvestable).reshape(-1, 5, 5)
    for k, change in enumerate((-100.0, -50.0, 0.0, 50.0, 100.0)):
        if change > 0.0:
            expected = density + change < 2000.0 - 0.005
        else:
            expected = -change <= np.minimum(harvestable, density - 150.0) + 0.005
        expected |= change == 0.0
        np.testing.assert_array_equal(masks[:, k], np.repeat(expected[:, None], 5, axis=1))


# ------------------------------------------------------------------------------------ masks of any environment's own


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"mode": "site-specific", "harvest_min_class": "mature"},
        {"objectives": THREE},
        {"objectives": (TIMBER,), "harvest_min_class": "old"},
        {"observation_groups": ("age", "climate", "state")},
    ],
    ids=["default", "one-site", "three", "timber", "no-site"],
)
def test_an_environments_mask_function_gives_its_masks(arguments):
    ranges = {"density_stems_ha": (0.0, 2200.0), "oldest_age_years": (10.0, 150.0)}
    envs = quick_vector(24, initial_ranges=ranges, **arguments)
    function = pickle.loads(pickle.dumps(envs.mask_function()))
    observations, _ = envs.reset(seed=2)
    for _ in range(3):
        np.testing.assert_array_equal(function(observations), envs.action_masks())
        if "observation_groups" not in arguments:
            youngest, number = arguments.get("harvest_min_class", "young"), envs.reward_dim
            masks = boreal_env.action_masks(observations, youngest, objectives=number)
            np.testing.assert_array_equal(masks, envs.action_masks())
        observations, *_ = envs.step(np.arange(24))
    with pytest.raises(ValueError, match=rf"observations of shape \(24, 3\): \(n, {observations.shape[1]}\)"):
        function(observations[:, :3])


@pytest.mark.parametrize("groups", [("state",), ("age", "site"), ("carbon",)])
def test_no_mask_function_without_density_and_ages(groups):
    assert quick(observation_groups=groups).mask_function() is None


def test_masks_of_another_number_of_objectives_are_refused():
    allowed = rf"\(n, {WITHOUT_SITE + 1}\) or \(n, {ENTRIES + 1}\)"
    with pytest.raises(ValueError, match=rf"observations of shape \(1, {ENTRIES}\): {allowed}"):
        boreal_env.action_masks(np.zeros((1, ENTRIES)), objectives=3)
    with pytest.raises(ValueError, match="objectives: a positive integer is allowed, got 0"):
        boreal_env.action_masks(np.zeros((1, ENTRIES)), objectives=0)


def test_an_action_that_a_mask_forbids_is_no_change():
    masks = np.zeros((3, 25), bool)
    masks[[0, 1], [24, 3]] = True
    with pytest.raises(ValueError, match=r"action -1: integers in \[0, 25\) are allowed"):
        boreal_env.where_valid(np.array([24, -1, 3]), masks)
    with pytest.raises(ValueError, match=r"masks of shape \(25,\), bool: bool of shape \(n, 25\)"):
        boreal_env.where_valid(np.array([24]), masks[0])
    assert boreal_env.where_valid(np.array([24, 24, 3]), masks).tolist() == [
        24,
        boreal_env.NO_CHANGE,
        boreal_env.NO_CHANGE,
    ]
