"""Observed stands by age and stands that run free: readers, ranges, and arithmetic against values by hand."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import sim
from analysis.validation import free_report, stand_development
from analysis.validation.free_stands import AFTER_FIRE, Course, basal_area, grow, stem_weights
from analysis.validation.held_stands import Run
from sim.state import STATE_NAMES, STATE_SIZE


@pytest.fixture(scope="module")
def table():
    return stand_development.observed()


def test_published_values_are_read(table):
    wet = table[(table.stand == "Manitoba black spruce, wet, burned 1930") & (table.quantity == "leaf area")]
    assert wet[["age_low", "age_high", "low", "high"]].to_numpy().tolist() == [[71, 71, 3.0, 3.0]]
    assert set(table.species) == {"conifer", "deciduous"}
    assert set(table.quantity) == set(free_report.OBSERVED)


def test_range_at_an_age_is_that_of_stands_about_as_old():
    rows = [("conifer", 71, 71, "biomass", 3.0, 3.2), ("conifer", 60, 80, "biomass", 4.0, 6.0)]
    rows += [("conifer", 150, 150, "biomass", 9.0, 9.0), ("deciduous", 70, 70, "biomass", 1.0, 1.0)]
    rows += [("conifer", 70, 70, "NEP", -0.02, 0.1)]
    made_up = pd.DataFrame(rows, columns=["species", "age_low", "age_high", "quantity", "low", "high"])
    band = stand_development.band(made_up, "conifer", "biomass", 70)
    assert (band.low, band.high) == (0.75 * 3.0, 1.25 * 6.0)
    nep = stand_development.band(made_up, "conifer", "NEP", 71)
    assert (nep.low, nep.high) == pytest.approx((-0.05, 0.13))
    assert stand_development.band(made_up, "conifer", "biomass", 110) is None
    assert len(stand_development.about(made_up, "conifer", "biomass", 100)) == 1  # 80 years are near enough


def test_towers_of_known_age(table):
    towers = table[table.source == "ABCflux"].set_index(["stand", "quantity"])
    assert towers.age_low["CA-NS7", "NEP"] == 5.0  # burned 1998, measured 2001-05
    assert towers.low["CA-NS7", "NEP"] < 0.0 < towers.low["CA-NS5", "NEP"]
    assert not {"CA-SF1", "SE-Ros", "US-Rpf"} & set(towers.index.get_level_values("stand"))


def test_biomass_of_the_chronosequence_over_a_span(table):
    held = free_report.growth(table, ((71, 151),))
    assert held.low == pytest.approx(3.45 / 3.81) and held.high == pytest.approx(8.43 / 6.72)


def test_basal_area_of_equal_stems():
    """1000 stems of 35 kgC x 0.001 on a hectare: each as thick as the rule says."""
    constants = {name: parameter.low for name, parameter in sim.CONSTANTS.items()}
    state = np.zeros((2, STATE_SIZE))
    state[0, len(STATE_NAMES) + 70] = 1000.0
    state[0, STATE_NAMES.index("conifer_biomass")] = 1000.0 * 30.0 / 1e4
    area = basal_area(state, stem_weights(constants))
    diameter_m = 0.01 * (30.0 / 0.035) ** 0.4
    assert area[0] == pytest.approx(1000.0 * np.pi / 4.0 * diameter_m**2)
    assert diameter_m == pytest.approx(0.15, abs=0.003)
    assert area[1] == 0.0


def test_fluxes_are_means_of_the_years_before_and_stocks_are_not():
    gpp = np.arange(1.0, 9.0)[:, None]
    run = Run({"gpp_kgc_m2": gpp, "biomass_kgc_m2": gpp}, {}, {})
    assert free_report.course_of(run, "GPP")[:, 0].tolist() == [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0]
    assert free_report.course_of(run, "biomass")[:, 0].tolist() == gpp[:, 0].tolist()


def test_deaths_are_a_share_of_what_lived():
    run = Run({"mortality_kgc_m2": np.array([[0.1, 0.0]]), "biomass_kgc_m2": np.array([[1.9, 0.0]])}, {}, {})
    np.testing.assert_allclose(free_report.deaths(run), [[5.0, 0.0]])


def test_stands_run_free_and_are_planted():
    first = {"conifer_mature_stems_ha": 1000.0, "biomass_kgc_m2": 6.0}
    run = grow(Course(first, first_action=24, years=2, mechanisms={"fire": False, "insects": False}), 2)
    np.testing.assert_allclose(run.annual["planted_stems_ha"], [[100.0, 100.0], [0.0, 0.0]])
    density = run.annual["density_stems_ha"]
    assert density.shape == (2, 2) and (density[0] != density[1]).all()
    assert (run.annual["basal_area_m2_ha"] > 20.0).all()


def test_a_stand_that_burned_grows_without_fire():
    run = grow(replace(AFTER_FIRE["after fire"], years=3), 2)
    burned = run.annual["fire_mortality"]
    assert (burned[0] >= 0.65).all() and (burned[1:] == 0.0).all()
    assert (run.annual["biomass_kgc_m2"][0] < 0.4 * 6.0).all()
    assert (run.annual["recruited_stems_ha"] > 10.0).all()
