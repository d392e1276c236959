"""Dead wood: what decays, burns and comes in, by hand; and what a stand starts with."""

import numpy as np
import pandas as pd
import pytest

import sim
from sim.state import STATE_NAMES

QUIET = {"fire": False, "insects": False}
QUICK = {"seed": 1, "time_step_minutes": 120}
BARE = {"density_stems_ha": 0.0, "biomass_kgc_m2": 0.0}
MATURE = {"conifer_mature_stems_ha": 900.0, "deciduous_mature_stems_ha": 400.0, "biomass_kgc_m2": 7.0}
SPECIES = ("conifer", "deciduous")
STOCKS = [f"{species}_deadwood_kgc_m2" for species in SPECIES]


def constant(name):
    return sim.CONSTANTS[name].low


def simulate(site, **arguments):
    """The table by its row, not by its dates."""
    return sim.simulate(site, 12, **arguments).reset_index(drop=True)


def columns(table, flux):
    return table[[f"{species}_deadwood_{flux}_kgc_m2" for species in SPECIES]].to_numpy()


def test_decay_of_a_year_by_its_days():
    """On bare ground, where nothing is added: day by day at the mean air temperature, a Q10 from 10 degC."""
    given = dict(zip(STOCKS, (2.0, 1.0), strict=True))
    site = sim.middle_site({"q10": 2.0, "recruitment_rate": 0.0})
    arguments = {"initial": {**BARE, **given}, "mechanisms": QUIET, **QUICK}
    table = simulate(site, years=1, **arguments)
    days = simulate(site, years=1, output="daily", **arguments)
    warmth = 2.0 ** ((days.air_temperature_c - 10.0) / 10.0) / 365.0
    left = [
        stock * np.prod(1.0 - constant(f"deadwood_decay_{species}") * warmth)
        for species, stock in zip(SPECIES, given.values(), strict=True)
    ]
    np.testing.assert_allclose(table[STOCKS].iloc[0], left, rtol=1e-9)
    decayed = columns(table, "decay").sum()
    assert decayed == pytest.approx(3.0 - sum(left), rel=1e-9)
    assert table.deadwood_respiration_kgc_m2[0] == pytest.approx(constant("deadwood_respired_share") * decayed)
    assert 0.01 < decayed / 3.0 < 0.03  # a year, in a climate of so many degrees below zero
    heterotrophic = days.heterotrophic_respiration_kgc_m2
    assert heterotrophic.sum() == pytest.approx(table.heterotrophic_respiration_kgc_m2[0])
    assert (heterotrophic >= 0.8 * sum(left) * constant("deadwood_decay_conifer") * warmth).all()


def test_a_dead_tree_leaves_its_stem_to_dead_wood():
    table = simulate(None, years=3, initial=MATURE, mechanisms=QUIET, **QUICK)
    inputs = columns(table, "input").sum(axis=1)
    shares = [constant(f"stem_share_{species}") for species in SPECIES]
    assert ((min(shares) < inputs / table.mortality_kgc_m2) & (inputs / table.mortality_kgc_m2 < max(shares))).all()
    np.testing.assert_allclose(inputs + table.dead_litter_kgc_m2, table.mortality_kgc_m2, rtol=1e-12)


def test_what_is_left_without_stems_is_laid_down():
    stands = sim.Stands(1, time_step_minutes=120, mechanisms=QUIET)
    stands.start([0], [sim.middle_site()], [sim.episode_seeds(1)], {0: {"density_stems_ha": 0.0}})
    stands.state[0, [STATE_NAMES.index(f"{species}_biomass") for species in SPECIES]] = 1.0, 0.5
    year = dict(zip(sim.RECORD_NAMES, stands.step([12])[0], strict=True))
    assert year["mortality_kgc_m2"] == pytest.approx(1.5) and year["biomass_kgc_m2"] == 0.0
    for species, carbon in zip(SPECIES, (1.0, 0.5), strict=True):
        assert year[f"{species}_deadwood_input_kgc_m2"] == pytest.approx(carbon * constant(f"stem_share_{species}"))


def test_a_fire_burns_its_share_of_dead_wood_and_the_stems_it_kills_become_such():
    site = {"fire_base_probability": 0.05, "fire_drought_threshold": 0.0, "summer_rain_prob": 0.0}
    constants = {"fire_temperature_c": 0.0, "deadwood_decay_conifer": 0.0, "deadwood_decay_deciduous": 0.0}
    table = simulate(site, years=4, constants=constants, initial=MATURE, **QUICK)
    burnt = table.index[(table.fire_mortality > 0.0) & (table.index > 0)]
    assert len(burnt) > 0 and (columns(table, "decay") == 0.0).all()
    before = table[STOCKS].shift().loc[burnt].to_numpy()
    np.testing.assert_allclose(columns(table.loc[burnt], "burned"), constant("fire_combusted_deadwood") * before)
    dead = table.fire_mortality_kgc_m2 + table.burned_trees_kgc_m2 + table.mortality_kgc_m2
    assert (columns(table, "input").sum(axis=1) > 0.75 * dead).all()
    stillness = table.index[table.fire_mortality == 0.0]
    assert (columns(table.loc[stillness], "burned") == 0.0).all()


def test_the_first_dead_wood_is_what_the_stand_keeps_up():
    """In the mean year that it was found in, what dies is what decays; later both vary about that."""
    number = 8
    stands = sim.Stands(number, time_step_minutes=120, mechanisms=QUIET, constants={"mortality_spread": 0.0})
    sites = [sim.sample_site(k) for k in range(number)]
    stands.start(
        np.arange(number), sites, [sim.episode_seeds(k) for k in range(number)], dict.fromkeys(range(8), MATURE)
    )
    first = stands.stocks(np.arange(number))["deadwood_kgc_m2"]
    table = pd.DataFrame(stands.step(np.full(number, 12)), columns=sim.RECORD_NAMES)
    np.testing.assert_allclose(columns(table, "input"), columns(table, "decay"), rtol=0.05)
    assert ((0.2 < first) & (first < 6.0)).all()  # kgC m-2: 10 to 300 m3/ha, as in boreal forests left alone


def test_dead_wood_that_is_given_is_kept_and_bare_ground_has_none():
    for given in ({STOCKS[0]: 2.5}, {STOCKS[1]: 0.0}):
        name, value = next(iter(given.items()))
        table = simulate(None, years=1, initial={**MATURE, **given}, mechanisms=QUIET, **QUICK)
        gain = table[f"{name.removesuffix('_kgc_m2')}_input_kgc_m2"] - table[name.replace("_kgc", "_decay_kgc")]
        assert (table[name] - gain)[0] == pytest.approx(value, abs=1e-12)
    bare = simulate(None, years=1, initial={**BARE, "biomass_kgc_m2": 0.0}, mechanisms=QUIET, **QUICK)
    assert (bare[STOCKS] == 0.0).all(axis=None)
    with pytest.raises(ValueError, match=r"initial conifer_deadwood_kgc_m2 = -1: a number in \[0, 60\]"):
        simulate(None, years=1, initial={STOCKS[0]: -1}, **QUICK)
