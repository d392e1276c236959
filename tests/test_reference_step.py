"""The kernel against tests/reference_step.py, which is written from docs/model.md: both agree to ten digits.

Sites, constants, states, days and weathers are drawn, within the climate of the sites and far beyond. The kernel begins
a day; then it and the reference take steps of that day, each from the kernel's state.
"""

import functools
import math
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from pytest import approx
from reference_step import (
    FUSION,
    SPECIES,
    WATER_DENSITY,
    acclimated,
    generated_weather,
    hour_angle,
    observed_weather,
    prepare_day,
    renew_stems,
    settled_density,
    structure,
    sun,
    take_step,
)

import sim
import sim.canopy
from sim.account import clear_day, write_day
from sim.block import namespace
from sim.day import begin_day
from sim.demography import AGES
from sim.forcing import hour_angles, step_weather
from sim.jit import uncompiled
from sim.parameters import CONSTANTS, MECHANISMS, ORDERED_CONSTANTS, SITE_PARAMETERS
from sim.snow import settle_snow
from sim.state import DAILY, DAYS, DRAWS, FORCING, RECORD, STATE, block_dtype, daily_dtype
from sim.step import simulate_step
from sim.year import begin_year

AGREEMENT = 1e-10  # of the natural scale
STEPS = 2  # from each drawn state
STEPS_PER_DAY = (12, 48, 144)
FEWEST = 5  # steps with each of the features
DAILY_WEATHER_DRAWS = ("temperature_noise", "wet_dice", "wet_amount", "wind_noise")

# Name -> (limits of the site's parameters, corners or even draws, weather, cases).
KINDS = {
    "sampled": ("sampled", "even", "generated", 100),
    "sampled-corners": ("sampled", "corners", "generated", 50),
    "sampled-observed": ("sampled", "even", "observed", 80),
    "physical": ("physical", "even", "generated", 50),
    "physical-corners": ("physical", "corners", "generated", 50),
    "physical-corners-observed": ("physical", "corners", "observed", 50),
}

# The kernel stops at a residual of 1e-7 W m-2: enough for budgets, not for ten digits of a thin canopy's temperature.
with pytest.MonkeyPatch.context() as patch:
    patch.setattr(sim.canopy, "NEWTON_TOLERANCE", 1e-10)
    begin_year, begin_day, hour_angles, clear_day, step_weather, simulate_step, write_day = (
        uncompiled(phase)
        for phase in (begin_year, begin_day, hour_angles, clear_day, step_weather, simulate_step, write_day)
    )


# ------------------------------------------------------------------------------------------------ what is drawn


def draw_parameters(generator, limits, how):
    """Site, constants within a quarter of their values, and mechanisms."""
    p = {}
    for name, q in SITE_PARAMETERS.items():
        low, high = (q.low, q.high) if limits == "sampled" else (q.physical_low, q.physical_high)
        p[name] = float(generator.choice([low, high]) if how == "corners" else generator.uniform(low, high))
    constants = {name: q.low for name, q in CONSTANTS.items()}
    while True:
        p |= {
            name: float(np.clip(value * generator.uniform(0.8, 1.25), q.physical_low, q.physical_high))
            for (name, value), q in zip(constants.items(), CONSTANTS.values(), strict=True)
        }
        if all(p[low] < p[high] for low, high in ORDERED_CONSTANTS):
            break
    switches = {name: float(generator.random() > 0.1) for name in MECHANISMS}
    as_observed = float(generator.random() > 0.5)
    scenario = {"warming_k": 2.0, "warming_amplitude_k": -0.5, "precipitation_factor": 1.1}
    return SimpleNamespace(**p, **switches, weather_as_observed=as_observed, **scenario)


def season_of(p, day):
    """Temperature of the season [degC], roughly."""
    return p.mean_annual_temperature_c - p.seasonal_amplitude_c * math.cos(2.0 * math.pi * (day - 10) / DAYS)


def draw_state(generator, p, day):
    """State by name. Temperatures about the season's; stores often empty, at times beyond what they hold."""
    season = season_of(p, day)
    swe = generator.choice([0.0, generator.uniform(0.0, 3.0), generator.uniform(0.0, 300.0)], p=[0.4, 0.3, 0.3])
    ground = generator.normal(season, 8.0)
    capacity = p.max_water_content_mm
    surface, deep = p.surface_soil_depth_m, p.boundary_depth_m - p.surface_soil_depth_m
    ice = FUSION * WATER_DENSITY * p.soil_freezing_water
    water = generator.choice([0.0, generator.uniform(0.0, 120.0)], p=[0.1, 0.9])
    state = {
        "conifer_biomass": generator.choice([0.0, 1e-6, generator.uniform(0.0, 12.0)], p=[0.1, 0.1, 0.8]),
        "deciduous_biomass": generator.choice([0.0, 1e-6, generator.uniform(0.0, 12.0)], p=[0.1, 0.1, 0.8]),
        "soil_carbon": generator.uniform(0.0, 25.0),
        "products": generator.uniform(0.0, 5.0),
        "organic_depth": generator.uniform(0.0, 0.4),
        "canopy": generator.normal(season, 8.0),
        "trunk": generator.normal(season, 8.0),
        "trunk_capacity": 1e4,
        "ground": min(ground, 0.0) if swe > 0.0 else ground,
        "organic_heat": drawn_organic_heat(generator, p, water),
        "organic_water": water,
        "surface_heat": ice * surface * generator.choice([0.0, generator.uniform(-1.3, 0.3)], p=[0.05, 0.95]),
        "deep_heat": ice * deep * generator.choice([0.0, generator.uniform(-1.2, 0.1)], p=[0.05, 0.95]),
        "swe": swe,
        "snow_density": generator.uniform(40.0, 500.0),
        "albedo": generator.uniform(p.snow_albedo_old, p.snow_albedo_fresh),
        "canopy_rain": generator.choice([0.0, generator.uniform(0.0, 1.5)]),
        "canopy_snow": generator.choice([0.0, generator.uniform(0.0, 0.5), generator.uniform(0.0, 20.0)]),
        "soil_water": generator.choice([0.0, capacity, generator.uniform(0.0, capacity)], p=[0.1, 0.1, 0.8]),
        "drought": generator.uniform(0.0, 60.0),
        "acclimation": generator.normal(season, 5.0),
    }
    there = generator.choice([(1, 1), (1, 0), (0, 1), (0, 0)], p=[0.55, 0.15, 0.15, 0.15])
    for species, present in zip(SPECIES, there, strict=True):
        ages = generator.random(AGES) < generator.uniform(0.02, 1.0)
        state[f"{species}_stems"] = present * ages * generator.exponential(15.0, AGES)
    return state


def drawn_organic_heat(generator, p, water):
    """Enthalpy [J m-2] of an organic layer with so much water [mm]: thawed, at 0 degC, freezing or frozen."""
    warm = (0.01 * p.organic_heat_capacity_dry + 2100.0 * water) * generator.uniform(-20.0, 15.0)
    ice = FUSION * water * generator.choice([0.0, generator.uniform(0.0, 1.0)])
    return generator.choice([warm if warm > 0.0 else warm - FUSION * water, -ice, 0.0], p=[0.6, 0.35, 0.05])


def draw_generated(generator):
    """Draws of the year, of which the day sees its own, and the anomaly of the day before."""
    draws = {}
    for name, (daily, distribution, _) in DRAWS.items():
        size = DAYS if daily else 1
        if distribution == "normal":
            draws[name] = generator.standard_normal(size)
        elif distribution == "exponential":
            draws[name] = generator.standard_exponential(size)
        else:
            draws[name] = generator.random(size)
    draws["wet_dice"] *= generator.choice([0.0, 1.0])
    return draws, generator.normal(0.0, 3.0)


def draw_observed(generator, p, steps_per_day, day):
    """Forcing of a day, shape (steps, columns of `sim.state.FORCING`): hot and cold, calm air, twilight."""
    sines = [sun(p, day, hour_angle(step, steps_per_day))[0] for step in range(steps_per_day)]
    light = np.array(sines) * generator.uniform(0.0, 1200.0, steps_per_day)
    light += generator.choice([0.0, 20.0], steps_per_day)
    rows = np.empty((steps_per_day, len(FORCING)))
    rows[:, 0] = generator.normal(season_of(p, day), 10.0) + generator.normal(0.0, 4.0, steps_per_day)
    rows[:, 0] = np.clip(rows[:, 0], -75.0, 50.0)
    rows[:, 1] = generator.uniform(0.05, 1.1, steps_per_day)
    rows[:, 2] = generator.uniform(0.3, 12.0, steps_per_day) * generator.choice([0.0, 1.0])
    rows[:, 3] = light
    rows[:, 4] = generator.uniform(100.0, 450.0, steps_per_day)
    rows[:, 5] = generator.exponential(20.0 / steps_per_day, steps_per_day) * generator.choice([0.0, 1.0])
    return rows


# ------------------------------------------------------------------------------------------------- the comparison


def fill_block(p, s, draws, anomaly):
    """A block of one lane as p attributes, for the interpreter."""
    block = np.zeros(1, block_dtype(1))[0]
    for group, values in (("p", vars(p)), ("s", s), ("d", draws), ("w", {"anomaly": anomaly})):
        for name, value in values.items():
            block[group][name][:] = np.reshape(value, block[group][name].shape)
    return namespace(block)


def state_of(b):
    """The block's state: numbers by name, and stems by age."""
    state = {name: float(getattr(b.s, name)[0]) for name in STATE}
    return SimpleNamespace(**state, **{f"{x}_stems": getattr(b.s, f"{x}_stems")[:, 0].copy() for x in SPECIES})


def kernel_step(b, step, steps_per_day, forcing):
    """Take one step with the kernel: what it adds to the record, and its row of daily output, by name."""
    record = {name: float(getattr(b.r, name)[0]) for name in RECORD}
    row = namespace(np.zeros(1, daily_dtype(1))[0])
    seconds = 86400.0 / steps_per_day
    clear_day(b, 0, [row])
    step_weather(b, step, hour_angles(steps_per_day), seconds, forcing)
    simulate_step(b, seconds)
    write_day(b, 1, row)
    daily = {name: float(getattr(row, name)[0]) for name in DAILY}
    means = {name for name in record if name.endswith("_temperature_c")}  # filled at the day's end
    added = {name: float(getattr(b.r, name)[0]) - record[name] for name in RECORD if name not in means}
    return daily | added


def scale(name, value, seconds):
    """Natural scale of a quantity: its size, at least what 1000 W m-2 or 1 mgC m-2 s-1 make of it in a step."""
    unit = (STATE.get(name) or RECORD.get(name) or ("1", ""))[0]
    unit = "MJ m-2" if name.endswith("_mj_m2") else "degC" if name.endswith("_temperature_c") else unit
    least = {
        "degC": 273.15,
        "mm": 4e-4 * seconds,
        "J m-2": 1e3 * seconds,
        "MJ m-2": 1e-3 * seconds,
        "kgC m-2": 1e-6 * seconds,
    }
    return max(abs(value), least.get(unit, 1.0))


def features_of(p, before, after, fluxes, steps_per_day):
    """What a step has that a test of it should see."""
    melted_out = before.swe > 0.0 and after["swe"] == 0.0
    temperature = {
        "organic": fluxes["organic_temperature_c"],
        "surface": fluxes["surface_soil_temperature_c"],
        "deep": fluxes["deep_soil_temperature_c"],
    }
    stems = {species: float(getattr(before, f"{species}_stems").sum()) for species in SPECIES}
    found = {
        "bare ground": before.swe == 0.0 and after["swe"] == 0.0,
        "cold snow": after["swe"] > 0.0 and after["ground"] < -1e-6,
        "melting snow": after["swe"] > 0.0 and abs(after["ground"]) <= 1e-6,
        "last snow melts": melted_out and after["ground"] > 0.0,
        "snow falls on warm ground": before.ground > 0.0 and before.swe == 0.0 and fluxes["snowfall_mm"] > 0.0,
        "vapour settles on snow": fluxes["sublimation_mm"] < fluxes["canopy_sublimation_mm"],
        "canopy snow sublimates": fluxes["canopy_sublimation_mm"] > 0.0,
        "canopy snow melts": before.canopy_snow > 0.0 and fluxes["air_temperature_c"] > 0.0,
        "rain in the canopy": after["canopy_rain"] > 0.0,
        "rain in the canopy dries up": before.canopy_rain > 0.0 and after["canopy_rain"] < 1e-9,
        "transpiration": fluxes["transpiration_mm"] > 0.0,
        "photosynthesis": fluxes["gpp_kgc_m2"] > fluxes["understorey_gpp_kgc_m2"],
        "photosynthesis of the understorey": fluxes["understorey_gpp_kgc_m2"] > 0.0,
        "respiration takes all": 0.0 < before.conifer_biomass and after["conifer_biomass"] < 1e-15,
        "night": fluxes["shortwave_mj_m2"] == 0.0,
        "dry soil": before.soil_water == 0.0,
        "the floor evaporates": fluxes["floor_evaporation_mm"] > 0.0,
        "the organic layer drains": before.organic_water > after["organic_water"] + fluxes["floor_evaporation_mm"],
        "the organic layer is wetted": before.organic_water < after["organic_water"],
        "runoff": fluxes["runoff_mm"] > 0.0,
        "conifers": stems["conifer"] > 0.0 and stems["deciduous"] == 0.0,
        "deciduous trees": stems["conifer"] == 0.0 and stems["deciduous"] > 0.0,
        "both": stems["conifer"] > 0.0 and stems["deciduous"] > 0.0,
        "no trees": stems["conifer"] == 0.0 and stems["deciduous"] == 0.0,
        "air above 30 degC": fluxes["air_temperature_c"] > 30.0,
        "air below -40 degC": fluxes["air_temperature_c"] < -40.0,
    }
    for node, celsius in temperature.items():
        found[f"{node} soil thawed"] = celsius > 0.0
        found[f"{node} soil freezing"] = p.soil_freezing > 0.0 and -p.soil_freezing_range_k < celsius < 0.0
        found[f"{node} soil frozen"] = p.soil_freezing > 0.0 and celsius < -p.soil_freezing_range_k
    found |= {f"{1440 // steps} minutes": steps == steps_per_day for steps in STEPS_PER_DAY}
    found |= {f"without {name}": getattr(p, name) == 0.0 for name in MECHANISMS}
    found |= {f"weather as observed: {on}": p.weather_as_observed == on for on in (0.0, 1.0)}
    return found


@functools.cache
def compare(kind):
    """All steps of a kind: (case, quantity, kernel's value, reference's, error in natural scales); counted features."""
    limits, how, weather, cases = KINDS[kind]
    compared, features = [], Counter()
    for case in range(cases):
        generator = np.random.default_rng([case, *kind.encode()])
        p = draw_parameters(generator, limits, how)
        day = int(generator.integers(DAYS))
        s = draw_state(generator, p, day)
        steps_per_day = int(generator.choice(STEPS_PER_DAY))
        first = int(generator.integers(steps_per_day - STEPS))
        draws, yesterday = draw_generated(generator)
        observed = None
        if weather == "observed":
            observed = draw_observed(generator, p, steps_per_day, day)
        steps = take_steps(p, s, day, draws, yesterday, observed, first, steps_per_day)
        for before, (after, fluxes), (new_state, new_fluxes) in steps:
            features.update(features_of(p, before, after, fluxes, steps_per_day))
            seconds = 86400.0 / steps_per_day
            treeless = before.conifer_stems.sum() + before.deciduous_stems.sum() == 0.0
            pairs = [(name, after[name], expected) for name, expected in new_state.items()]
            pairs += [(name, fluxes[name], expected) for name, expected in new_fluxes.items()]
            for name, value, expected in pairs:
                if treeless and name in ("canopy", "canopy_temperature_c"):
                    continue  # there is no canopy
                if math.isnan(value) and math.isnan(expected):
                    continue  # the albedo of a night
                compared.append((case, name, value, expected, abs(value - expected) / scale(name, expected, seconds)))
    return compared, features


def take_steps(p, s, day, draws, yesterday, observed, first, steps_per_day):
    """Steps of a case: the state before, the kernel's new state and fluxes, the reference's new state and fluxes."""
    if observed is None:
        forcing = np.zeros((0, len(FORCING), 1))
        weather = generated_weather(p, day, yesterday, *(draws[name][day] for name in DAILY_WEATHER_DRAWS))
    else:
        forcing = observed[:, :, None]
        weather = observed_weather(p, day, observed)
    b = fill_block(p, s, draws, yesterday)
    with np.errstate(all="ignore"):
        begin_year(b)
        begin_day(b, day, hour_angles(steps_per_day), forcing)
        today = prepare_day(p, state_of(b), day, weather, steps_per_day)
        for step in range(first, first + STEPS):
            before = state_of(b)
            fluxes = kernel_step(b, step, steps_per_day, forcing)
            new_state, new_fluxes = take_step(p, before, today, step, steps_per_day)
            yield before, (vars(state_of(b)), fluxes), (new_state, new_fluxes)


@pytest.mark.parametrize("kind", KINDS)
def test_kernel_takes_the_step_of_the_document(kind):
    compared, _ = compare(kind)
    wrong = [row for row in compared if not row[-1] <= AGREEMENT]
    assert not wrong, "case {}, {}: {!r}, not {!r}, {:.1e} apart".format(*wrong[0])


def test_the_steps_have_all_that_a_step_can_have():
    features = sum((compare(kind)[1] for kind in KINDS), Counter())
    assert {name: number for name, number in features.items() if number < FEWEST} == {}


@pytest.mark.parametrize("limits", ["sampled", "physical"])
def test_generated_weather_of_every_day(limits):
    generator = np.random.default_rng(365)
    for as_observed in (0.0, 1.0, 1.0):
        p = draw_parameters(generator, limits, "even")
        p.weather_as_observed = as_observed
        draws, _ = draw_generated(generator)
        b = fill_block(p, draw_state(generator, p, 0), draws, 0.0)
        begin_year(b)
        yesterday = math.nan  # the first day has none
        acclimation = b.s.acclimation[0]
        for day in range(DAYS):
            begin_day(b, day, hour_angles(4), np.zeros((0, len(FORCING), 1)))
            dice = (draws[name][day] for name in DAILY_WEATHER_DRAWS)
            expected = generated_weather(p, day, yesterday, *dice)
            yesterday = expected.anomaly
            acclimation = acclimated(p, acclimation, expected)
            assert b.w.mean_temperature[0] == approx(expected.mean, abs=1e-10)
            assert b.s.acclimation[0] == approx(acclimation, abs=1e-10)
            for name in ("precipitation", "vapour", "emissivity", "diffuse", "wind"):
                assert getattr(b.w, name)[0] == approx(getattr(expected, name), rel=1e-10)


def test_old_deciduous_trees_without_crown_development():
    generator = np.random.default_rng(0)
    p = draw_parameters(generator, "sampled", "even")
    p.crown_development, p.light_use_old = 0.0, 0.85
    s = draw_state(generator, p, 0)
    s["deciduous_stems"] = np.linspace(0.0, 10.0, AGES)
    b = fill_block(p, s, draw_generated(generator)[0], 0.0)
    begin_year(b)
    expected = structure(p, state_of(b), 0).light_use["deciduous"]
    assert b.w.light_use_deciduous[0] == approx(expected, rel=1e-10)


@pytest.mark.parametrize("crowded", [1.0, 20.0])
def test_stems_at_the_end_of_a_year(crowded):
    """Deaths by size, crowding, recruits in gaps and ageing, on sampled sites; `crowded` times their stems."""
    number = 12
    constants = {"mortality_spread": 0.0}
    stands = sim.Stands(
        number, time_step_minutes=240, constants=constants, mechanisms={"fire": False, "insects": False}
    )
    sites = [sim.sample_site(k) for k in range(number)]
    stands.start(np.arange(number), sites, [sim.episode_seeds(k) for k in range(number)])
    stands.state[:, -2 * AGES :] *= crowded
    for _ in range(3):
        before = stands.state[:, -2 * AGES :].reshape(number, 2, AGES).copy()
        record = dict(zip(sim.RECORD_NAMES, stands.step(np.full(number, 12)).T, strict=True))
        after = stands.state[:, -2 * AGES :].reshape(number, 2, AGES)
        living = stands.state[:, [list(STATE).index(f"{species}_biomass") for species in SPECIES]]
        for k, site in enumerate(sites):
            p = SimpleNamespace(**{**site, **stands.constants, **stands.mechanisms})
            # The carbon of each species before its deaths, by iteration from that after them.
            biomass = living[k].copy()
            for _ in range(60):
                s = SimpleNamespace(
                    conifer_stems=before[k, 0],
                    deciduous_stems=before[k, 1],
                    conifer_biomass=biomass[0],
                    deciduous_biomass=biomass[1],
                )
                stems, dead, shares = renew_stems(p, s)
                biomass = living[k] / (1.0 - np.array([shares[species] for species in SPECIES]))
            np.testing.assert_allclose([stems[species] for species in SPECIES], after[k], rtol=1e-9, atol=1e-9)
            assert record["mortality_kgc_m2"][k] == approx(dead, rel=1e-8)


def test_a_day_of_settling_snow():
    generator, lanes, steps = np.random.default_rng(1), 200, 48
    p = {name: constant.low for name, constant in CONSTANTS.items() if name.startswith("snow_")}
    swe, density = generator.uniform(1.0, 500.0, lanes), generator.uniform(50.0, 500.0, lanes)
    ground, organic = generator.uniform(-40.0, 0.0, lanes), generator.uniform(-20.0, 2.0, lanes)
    b = SimpleNamespace(
        s=SimpleNamespace(swe=swe, snow_density=density.copy()),
        p=SimpleNamespace(**{name: np.full(lanes, value) for name, value in p.items()}),
        w=SimpleNamespace(ground_sum=steps * ground, organic=organic),
    )
    uncompiled(settle_snow)(b, steps)
    stands = [SimpleNamespace(swe=a, snow_density=c) for a, c in zip(swe, density, strict=True)]
    expected = [settled_density(SimpleNamespace(**p), *of) for of in zip(stands, ground, organic, strict=True)]
    assert b.s.snow_density == approx(np.array(expected), rel=AGREEMENT)
