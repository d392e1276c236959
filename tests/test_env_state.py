"""Saving an environment in mid-episode and going on."""

import pickle

import numpy as np
import pytest
from playing import assert_same, quick, quick_vector, vector_trace

import boreal_env
import sim


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


@pytest.mark.parametrize(
    ("state", "wrong"),
    [({}, "missing: episodes, generators?"), (None, "got NoneType"), ({"generator": 1}, "missing: episodes")],
)
def test_what_is_no_state_is_refused(state, wrong):
    for env in (quick(), quick_vector(2)):
        with pytest.raises(ValueError, match=rf"^state: a dict of episodes, .* is allowed; {wrong}"):
            env.set_state(state)


def test_half_a_state_is_refused_by_what_it_lacks():
    for env in (quick(), quick_vector(2)):
        saved = env.get_state()
        for part, where in ((saved["episodes"], "episodes"), (saved["episodes"]["stands"], "stands")):
            for name in list(part):
                value = part.pop(name)
                with pytest.raises(ValueError, match=rf"^state of {where}: a dict of .* is allowed; missing: {name}$"):
                    env.set_state(saved)
                part[name] = value
        saved["episodes"]["stands"]["record"] = saved["episodes"]["stands"]["record"][:, 1:]
        with pytest.raises(ValueError, match=r"^state of stands: record of shape \(\d, \d+\), \(\d, \d+\) is allowed"):
            env.set_state(saved)


@pytest.mark.parametrize(
    "arguments",
    [
        {"time_step_minutes": 120},
        {"thaw_formulation": "contrast"},
        {"balanced": True},
        {"reward": {"thaw_scale": 20.0}},
        {"scenario": "ssp585"},
        {"mechanisms": {"fire": False}},
        {"constants": {"snow_albedo_old": 0.4}},
        {"weather": "observed"},
        {"initial_ranges": {"biomass_kgc_m2": (1.0, 2.0)}},
        {"parameter_overrides": {"latitude_deg": 60.0}},
        {"fixed_preference": 0.5},
    ],
    ids=lambda arguments: next(iter(arguments)),
)
def test_the_state_of_one_with_other_arguments_is_refused(arguments):
    saved, env = quick(), quick(**arguments)
    saved.reset(seed=1), env.reset(seed=2)
    before = pickle.dumps(env.get_state())
    with pytest.raises(ValueError, match="make both with the same arguments"):
        env.set_state(saved.get_state())
    assert pickle.dumps(env.get_state()) == before


@pytest.mark.parametrize(
    ("part", "name", "value", "wrong"),
    [
        ("stands", "parameters", np.nan, "stands: parameters: finite numbers are allowed, got nan"),
        ("stands", "parameters", 1e30, "latitude_deg = 1e.30 is outside its physical limits"),
        ("stands", "state", np.inf, "stands: state: finite numbers are allowed, got inf"),
        ("stands", "state", -1.0, "stands: conifer_biomass: 0 or more is allowed, got -1 in stand 0"),
        ("stands", "years", -1, r"stands: years: \[0, 5000\] is allowed, got -1"),
        ("episodes", "weights", -1.0, r"episodes: weights: \[0, 1\] is allowed, got -1"),
        ("episodes", "year", 99, r"episodes: year: \[0, \d\] is allowed, got 99"),
        ("episodes", "year", 4, r"episodes: an episode that runs is before year 4, got \[4\]"),
        ("episodes", "year", 1, "episodes: episode 0 runs in year 1, its stand does not"),
        ("episodes", "weights", 1.0, r"episodes: weights whose sum is 1 are allowed, got \[\[1.0, 1.0\]\]"),
        ("stands", "streams", 4, r"stands: streams: a PCG64's increment is odd, got \[4, 4\]"),
    ],
)
def test_a_damaged_state_is_refused_and_nothing_of_it_taken(part, name, value, wrong):
    env = quick()
    env.reset(seed=1)
    saved, before = env.get_state(), pickle.dumps(env.get_state())
    (saved["episodes"]["stands"] if part == "stands" else saved["episodes"])[name][:] = value
    with pytest.raises(ValueError, match=wrong):
        env.set_state(saved)
    assert pickle.dumps(env.get_state()) == before


def test_a_mask_is_not_lost_in_silence():
    env = quick()
    env.reset(seed=1)
    saved = env.get_state()
    saved["episodes"]["observed"] = np.ma.masked_greater(saved["episodes"]["observed"], 1.0)
    with pytest.raises(ValueError, match="observed: an array of float64 is allowed"):
        env.set_state(saved)


EVEN = {**np.random.PCG64(1).state, "state": {"state": 5, "inc": 4}}


@pytest.mark.parametrize("generator", [None, {"bit_generator": "PCG64"}, {"bit_generator": "MT19937"}, 3, EVEN])
def test_a_state_without_its_generator_is_refused_and_nothing_of_it_taken(generator):
    env, other = quick(), quick()
    env.reset(seed=1), other.reset(seed=2)
    saved, before = other.get_state(), pickle.dumps(env.get_state())
    with pytest.raises(ValueError, match="generator"):
        env.set_state({**saved, "generator": generator})
    assert pickle.dumps(env.get_state()) == before


def test_generators_of_fewer_stands_are_refused():
    envs = quick_vector(2)
    envs.reset(seed=1)
    saved = envs.get_state()
    saved["generators"].pop()
    with pytest.raises(ValueError, match="^state: generators of 2 stands are allowed, got 1$"):
        envs.set_state(saved)


def test_groups_and_generators_of_episodes_that_run_are_needed():
    envs = quick_vector(4, group_size=2)
    envs.reset(seed=1)
    with pytest.raises(ValueError, match="^state of groups of 2, these are of 1: "):
        quick_vector(4).set_state(envs.get_state())
    with pytest.raises(ValueError, match="^state: generators of episodes that run are allowed, got None$"):
        envs.set_state(envs.get_state() | {"generators": None})


def test_a_year_that_fails_changes_nothing():
    """Not even the weather to come."""
    one = quick()
    one.reset(seed=1)
    stands = one._episodes.stands
    stands.state[0, sim.stands.STATE_NAMES.index("albedo")] = 1e6
    before = pickle.dumps(stands.get_state())
    with pytest.raises(sim.PhysicsError):
        stands.step([12])
    assert pickle.dumps(stands.get_state()) == before


def test_after_an_objectives_error_only_a_reset_goes_on():
    def fails_once(year):
        calls.append(year)
        if len(calls) == 1:
            raise ZeroDivisionError
        return 0.0 * year["biomass_kgc_m2"]

    calls = []
    env = quick(objectives=("carbon", boreal_env.Objective("mine", fails_once, 0.0, 1.0)))
    env.reset(seed=1)
    with pytest.raises(ZeroDivisionError):
        env.step(12)
    with pytest.raises(RuntimeError, match="call reset first"):
        env.step(12)
    env.reset(seed=1)
    env.step(12)


@pytest.mark.parametrize("action", [np.timedelta64(12), np.array(True)])
def test_a_refused_action_changes_nothing(action):
    env = quick()
    env.reset(seed=1)
    before = pickle.dumps(env.get_state())
    with pytest.raises(ValueError, match=r"integers in \[0, 25\) are allowed"):
        env.step(action)
    assert pickle.dumps(env.get_state()) == before


def test_the_state_of_a_vector_environment_is_not_that_of_one():
    one, envs = quick(), quick_vector(1)
    one.reset(seed=1), envs.reset(seed=1)
    with pytest.raises(ValueError, match="state of a vector environment given to a single one"):
        one.set_state(envs.get_state())
    with pytest.raises(ValueError, match="state of a single environment given to a vector one"):
        envs.set_state(one.get_state())


def test_a_state_of_other_arguments_is_refused_by_the_values_that_were_given():
    there, here = quick(hwp_half_life_years=30, harvest_min_class="mature"), quick(hwp_half_life_years=30)
    there.reset(seed=1)
    with pytest.raises(ValueError, match="of one with harvest_min_class = 'mature', this one has 'young'"):
        here.set_state(there.get_state())
    with pytest.raises(ValueError, match="of one with hwp_half_life_years = 30, this one has None"):
        quick(harvest_min_class="mature").set_state(there.get_state())
