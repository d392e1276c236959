"""What the environment refuses, and how it says so."""

import gymnasium as gym
import pandas as pd
import pytest
from playing import NAN, play, quick, quick_vector

import sim
from boreal_env import BorealEnv, BorealVectorEnv

BAD_ARGUMENTS = {
    "mode": ({"mode": "specialist"}, r"mode 'specialist': allowed are generalist, site-specific"),
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
    "noise beyond the weather's": (
        {"weather": "observed", "parameter_overrides": {"daily_noise_std_c": (0.0, 10.0)}},
        r"daily_noise_std_c = 10: with weather as observed, .* at most 2.54 is allowed",
    ),
    "what can be read once": ({"observation_groups": iter(["state"])}, r"observation_groups: .* a list of it is"),
    "unknown range": ({"initial_ranges": {"carbon": (0, 1)}}, r"unknown initial range 'carbon'; allowed: density"),
    "range of one": ({"initial_ranges": {"biomass_kgc_m2": 3}}, r"initial range biomass_kgc_m2: a \(low, high\) pair"),
    "range reversed": ({"initial_ranges": {"biomass_kgc_m2": (3, 1)}}, r"biomass_kgc_m2: reversed, 3 > 1"),
    "range beyond limits": ({"initial_ranges": {"biomass_kgc_m2": (-1, 1)}}, r"biomass_kgc_m2 = -1: .*\[0, 60\]"),
    "ranges without stems": (
        {"initial_ranges": {"density_stems_ha": (0, 0), "biomass_kgc_m2": (0, 10)}},
        r"biomass_kgc_m2: up to 10; .*\(0, 0\)",
    ),
    "objectives with numbers": (
        {"objectives": {"carbon": 1, "thaw": 2}},
        r"objectives: a list or tuple of carbon, thaw",
    ),
    "objectives without an order": ({"objectives": {"carbon", "thaw"}}, r"objectives: a list or tuple of carbon, thaw"),
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
        {"constants": {"insect_lethal_c": -10.0, "insect_mild_c": -20.0}},
        r"insect_lethal_c = -10 .*insect_mild_c = -20",
    ),
    "unknown group": (
        {"observation_groups": ("weather",)},
        r"observation group 'weather': allowed are preference, state",
    ),
    "groups as text": ({"observation_groups": "state"}, r"observation_groups.*'state'"),
    "groups as number": ({"observation_groups": 5}, r"observation_groups.*5"),
    "no groups": ({"observation_groups": ()}, r"observation_groups"),
    "no group left": ({"observation_groups": ("site",), "mode": "site-specific"}, r"observation_groups.*site"),
    "group twice": ({"observation_groups": ("age", "state", "age")}, r"observation_groups age, state, age: each"),
    "boundary": ({"boundary": "fixed"}, r"boundary 'fixed': allowed are sampled, balanced"),
    "soil carbon": ({"soil_carbon": 1.0}, r"soil_carbon 1.0: allowed are drawn, balanced"),
    "boundary twice": (
        {"boundary": "balanced", "parameter_overrides": {"deep_boundary_temperature_k": 270.0}},
        r"deep_boundary_temperature_k: boundary='balanced' finds it",
    ),
    "soil carbon twice": (
        {"soil_carbon": "balanced", "initial_ranges": {"soil_kgc_m2": (2.0, 3.0)}},
        r"soil_kgc_m2: soil_carbon='balanced' finds it",
    ),
    "weather": ({"weather": None}, r"weather None: allowed are paper, observed"),
    "balanced of number": ({"balanced": 1.4}, r"balanced: True or False is allowed, got 1.4"),
    "record of number": ({"record_years": 1}, r"record_years: True or False is allowed, got 1"),
    "render mode": ({"render_mode": "human"}, r"render_mode 'human': allowed are rgb_array, None$"),
    "render mode of text": ({"render_mode": "None"}, r"render_mode 'None': allowed are rgb_array, None$"),
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


@pytest.mark.parametrize("make", [quick, lambda: quick_vector(1)], ids=["single", "vector"])
def test_step_before_reset_is_refused(make):
    with pytest.raises(RuntimeError, match="call reset first"):
        make().step([12] if isinstance(make(), BorealVectorEnv) else 12)


def test_a_picture_before_reset_is_refused():
    with pytest.raises(RuntimeError, match="picture of episode 0 that has not begun: call reset first"):
        quick(render_mode="rgb_array").render()


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
        ({"preference": {0.5, 0.7}}, r"preference: a number in \[0, 1\] is allowed, got {0"),
        ({"preference": iter([0.5, 0.7])}, r"preference: .* got <list_iterator"),
        (
            {"preference": pd.Series({"thaw": 0.3, "carbon": 0.7})},
            r"preference: a Series labelled \['thaw', 'carbon'\], which are not read",
        ),
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


def test_a_boundary_of_ones_own_is_refused_where_it_is_found():
    world = sim.sample_site(3)
    for env in (quick(boundary="balanced"), quick_vector(2, boundary="balanced")):
        env.reset(seed=1, options={"site": world})
        with pytest.raises(ValueError, match="site: deep_boundary_temperature_k: boundary='balanced' finds it"):
            env.reset(options={"site": {"deep_boundary_temperature_k": 275.0}})


@pytest.mark.parametrize("seed", [-1, 1.5, "one", True, [1, 2.5], [1, -2]])
def test_bad_seeds_are_refused(seed):
    with pytest.raises((ValueError, gym.error.Error), match="(?i)seed"):
        quick_vector(2).reset(seed=seed)
    with pytest.raises((ValueError, gym.error.Error), match="(?i)seed"):
        quick().reset(seed=seed)
