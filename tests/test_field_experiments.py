"""Field experiments and robustness: arithmetic by hand, what a cut and a boundary in balance do."""

import numpy as np
import pandas as pd
import pytest
from scripts import run_script

import sim
from analysis.studies import planting_signs
from analysis.validation import balanced_boundary, clear_cut, field_report, robustness_report, thaw_agreement
from analysis.validation.scores import Band


def test_thawing_factor_is_the_ratio_of_degree_days():
    air = np.array([[[10.0, 20.0, -5.0]], [[10.0, 0.0, -30.0]]])
    surface = np.array([[[9.0, 18.0, 4.0]], [[5.0, 0.0, -1.0]]])
    np.testing.assert_allclose(field_report.thawing_factor(surface, air), [36.0 / 40.0])
    np.testing.assert_allclose(field_report.thawing_factor(-surface, -air), [1.0 / 35.0])


def test_a_change_counts_within_a_factor():
    assert field_report.within_factor(44.0) == Band(22.0, 88.0)


def test_a_cut_lets_heat_into_the_ground_and_leaves_the_forest_alone():
    wind = {**clear_cut.YAKUTSK, "wind_speed_m_s": 3.0}
    found = clear_cut.cut(wind, clear_cut.LARCH, 1)
    assert found.heat.shape == found.thaw.shape == (clear_cut.YEARS_AFTER, 1)
    assert (found.heat > 0.0).all() and (found.thaw > 0.0).all()
    nothing = clear_cut.cut(wind, {"conifer_mature_stems_ha": 0.0, "biomass_kgc_m2": 0.0}, 1)
    np.testing.assert_array_equal(nothing.heat, 0.0)
    np.testing.assert_array_equal(nothing.thaw, 0.0)


def test_a_boundary_in_balance_takes_no_heat():
    seeds = [sim.episode_seeds(k) for k in (1, 2)]
    boundary, heat = balanced_boundary.run_held([sim.sample_site(k) for k in (1, 2)], seeds, boundary="balanced")
    assert (np.abs(heat) < robustness_report.BALANCE.high).all()
    assert (np.abs(boundary - [sim.sample_site(k)["deep_boundary_temperature_k"] for k in (1, 2)]) > 0.01).all()


def test_measures_of_thaw_agree_where_their_signs_do():
    measures = {"flux": np.array([1.0, -1.0, 2.0, 0.0]), "depth": np.array([3.0, 1.0, 0.1, 1.0])}
    assert thaw_agreement.disagreement(measures["flux"], measures["depth"]) == 1.0 / 3.0


@pytest.mark.parametrize(
    ("after", "found"),
    [
        ((-5.9, 1.0, 0.5), []),
        ((-6.1, 1.0, 0.5), ["zero change moves by −3.1"]),
        ((-3.0, -0.2, 0.5), ["conifers turn from +1.50 to −0.20"]),
        ((0.5, 2.0, -0.1), ["zero change moves by +3.5", "deciduous turn from +0.50 to −0.10"]),
    ],
)
def test_what_a_constant_should_not_do(after, found):
    assert robustness_report.problems((-3.0, 1.5, 0.5), after) == found


def test_signs_of_a_made_up_table():
    rows = [
        ("paper", "default", "", "default", -3.0, 1.5, 0.2, 0.5, 0.1),
        ("paper", "a", "1", "constants snow", -3.0, -0.5, 0.2, 0.5, 0.1),
        ("paper", "a", "2", "constants snow", -3.0, 1.6, 0.2, 0.5, 0.1),
        ("paper", "b", "3", "constants soil", 1.0, 1.0, 0.2, 0.4, 0.1),
        ("balanced", "default", "", "default", 1.0, 2.0, 0.2, 1.0, 0.1),
        ("balanced", "a", "1", "constants snow", 1.0, 2.0, 0.2, 1.0, 0.1),
        ("balanced", "a", "2", "constants snow", 1.0, 2.0, 0.2, 1.0, 0.1),
        ("balanced", "b", "3", "constants soil", 1.0, 2.1, 0.2, -1.0, 0.1),
    ]
    columns = ["constant", "value", "group", "zero_change", "conifers", "conifers_se", "deciduous", "deciduous_se"]
    text, misses = robustness_report.signs_found(pd.DataFrame(rows, columns=["world", *columns]), 5)
    words = " ".join(text.split())
    assert "(2 constants; steps" in words
    assert "deciduous trees; 0 change nothing there, so that nothing is said of them. In `balanced` zero" in words
    assert "this mean: 1 of conifers, 0 of deciduous trees; 0 change" in words
    assert "this mean: 0 of conifers, 1 of deciduous trees; 1 change" in words
    missed = [miss.what.split(":")[0] for miss in misses]
    assert missed == ["`a` = 1, `paper`", "`b` = 3, `paper`", "`b` = 3, `balanced`"]


def test_effects_are_paired_by_site():
    found = planting_signs.effects(np.array([[-10.0, -8.0, -11.0], [0.0, 1.0, 1.0]]))
    assert found["zero_change"] == -5.0
    assert (found["conifers"], found["deciduous"]) == (1.5, 0.0)
    assert found["conifers_se"] == pytest.approx(0.5)


def test_every_constant_has_its_levels():
    named = {variant.factor for variant in planting_signs.variants()}
    assert named == {"default", *sim.CONSTANTS}


def test_unknown_constants_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="--names nothing: a name in sim/constants.csv is allowed"):
        run_script("analysis/studies/planting_signs.py", "--names", "nothing")
    with pytest.raises(SystemExit, match="--sites 500: 1 to 400 are allowed"):
        run_script("analysis/studies/planting_signs.py", "--sites", 500)
