"""The validation: held stands stay what they are, comparisons by hand, calibration, and a quick run that writes."""

import math

import numpy as np
import pandas as pd
import pytest
from scripts import run_script

from analysis import validate
from analysis.validation import (
    bands,
    calibration,
    climate_records,
    disturbance_report,
    document,
    held_stands,
    tower_comparison,
    tower_report,
    weather_report,
)
from analysis.validation.held_stands import KINDS, UNDISTURBED, hold
from analysis.validation.scores import Band
from sim.parameters import CONSTANTS


@pytest.fixture(scope="module")
def conifers():
    return hold(KINDS["mature conifer"], 3, years=2, mechanisms=UNDISTURBED, keep_daily=("precipitation_mm",))


def test_held_stands_begin_every_year_alike(conifers):
    density = conifers.annual["density_after_action"]
    np.testing.assert_allclose(density, 1500.0, rtol=1e-12)
    np.testing.assert_array_equal(conifers.annual["organic_layer_m"][0], conifers.annual["organic_layer_m"][1])
    assert (conifers.annual["mortality_kgc_m2"] > 0.0).all()


def test_months_are_means_of_days(conifers):
    days = conifers.daily["precipitation_mm"]
    assert days.shape == (2, 3, 365)
    np.testing.assert_allclose(conifers.months["precipitation_mm"][:, :, 1], days[:, :, 31:59].mean(axis=2))
    np.testing.assert_allclose(days.sum(axis=2), conifers.annual["precipitation_mm"], rtol=1e-9)


def test_kinds_share_sites_and_weather(conifers):
    open_ground = hold(KINDS["open"], 3, years=2, mechanisms=UNDISTURBED)
    np.testing.assert_array_equal(open_ground.annual["precipitation_mm"], conifers.annual["precipitation_mm"])
    assert (open_ground.annual["gpp_kgc_m2"] == open_ground.annual["understorey_gpp_kgc_m2"]).all()


def test_verdict_of_a_sample_is_that_of_its_median():
    sample = np.array([0.1, 0.2, 0.9])
    assert bands._verdict(Band(0.15, 0.3), sample) == "in, 33 %"
    assert bands._verdict(Band(0.25, 1.0), sample) == "**MISS, low**, 33 %"


@pytest.mark.parametrize(
    ("swe", "day"),
    [
        ([0.0, 20.0, 40.0, 10.0, 0.5, 0.0, 9.0, 0.0], 5),  # snow in May does not count
        ([50.0, 40.0, 0.0, 0.0], 3),
        ([0.0, 0.0, 0.0], 0),
        ([5.0, 9.0, 12.0], 0),  # never gone
    ],
)
def test_day_on_which_the_pack_is_gone(swe, day):
    assert tower_comparison.melt_out(np.array(swe)) == day


def test_only_measured_days_and_full_months_count():
    index = pd.date_range("2013-01-01", "2013-02-28")
    days = pd.DataFrame({"measured": 1.0, "modelled": 3.0, "counts": True}, index=index)
    days.loc["2013-01-20":, "counts"] = False
    days.loc["2013-02-01":"2013-02-04", "counts"] = True  # four days: too few
    days.loc["2013-01-05", "counts"], days.loc["2013-01-05", "modelled"] = False, 1e6
    months = tower_comparison.by_month(days)
    assert months.loc[(2013, 1)].tolist() == [1.0, 3.0, 18.0]
    assert math.isnan(months.loc[(2013, 2), "modelled"]) and months.loc[(2013, 2), "days"] == 4
    monthly, daily = tower_comparison.scores(days)
    assert (monthly.pairs, daily.pairs, monthly.bias) == (1, 22, 2.0)


def test_energy_closure_by_hand():
    index = pd.date_range("2013-07-01", periods=2)
    heats = {
        "sensible_heat_w_m2": 40.0,
        "latent_heat_w_m2": 50.0,
        "net_radiation_w_m2": 130.0,
        "ground_heat_w_m2": 30.0,
    }
    fluxes = pd.DataFrame({**heats, **{f"{name}_measured": 1.0 for name in heats}}, index=index)
    fluxes.loc[index[1], ["latent_heat_w_m2", "latent_heat_w_m2_measured"]] = [500.0, 0.3]
    assert tower_comparison.energy_closure(fluxes) == pytest.approx(0.9)


def test_evaporative_fraction_of_even_and_odd_days():
    index = pd.date_range("2019-06-01", periods=4)
    latent = pd.DataFrame({"measured": [1.0, 3.0, 1.0, 3.0], "modelled": 2.0, "counts": True}, index=index)
    sensible = pd.DataFrame({"measured": 3.0, "modelled": [2.0, 6.0, 2.0, 6.0], "counts": True}, index=index)
    compared = {"latent heat": latent, "sensible heat": sensible}
    assert tower_comparison.summer_evaporative_fraction(compared, 0) == (0.5, 0.25)
    assert tower_comparison.summer_evaporative_fraction(compared, 1) == (0.25, 0.5)


def test_energy_offset_by_hand():
    index = pd.date_range("2019-01-01", periods=2)
    heats = {
        "sensible_heat_w_m2": -20.0,
        "latent_heat_w_m2": 5.0,
        "net_radiation_w_m2": -10.0,
        "ground_heat_w_m2": -7.0,
    }
    fluxes = pd.DataFrame({**heats, **{f"{name}_measured": 1.0 for name in heats}}, index=index)
    fluxes.loc[index[1], "net_radiation_w_m2"] = np.nan
    assert tower_comparison.energy_offset(fluxes) == (12.0, 1)


def test_temperature_below_the_organic_layer():
    """A straight line from the top of the mineral soil to the middle of its surface layer, and nowhere else."""
    columns = {"soil_top_temperature_c": [2.0, -4.0], "surface_soil_temperature_c": [4.0, 0.0], "organic_layer_m": 0.30}
    days, node = pd.DataFrame(columns), CONSTANTS["surface_soil_depth_m"].low / 2.0
    np.testing.assert_allclose(tower_report.temperature_below_moss(days, 0.30 + node / 2.0), [3.0, -2.0])
    for depth in (0.01, 0.31 + node):
        with pytest.raises(ValueError, match="is not between the organic layer and"):
            tower_report.temperature_below_moss(days, depth)


def test_temperature_within_the_organic_layer():
    """Straight lines from the surface to the layer's middle, and from there to the mineral soil."""
    days = pd.DataFrame(
        {
            "ground_temperature_c": [12.0, -15.0],
            "organic_temperature_c": [6.0, -8.0],
            "soil_top_temperature_c": [2.0, -4.0],
            "organic_layer_m": 0.30,
        }
    )
    np.testing.assert_allclose(tower_report.temperature_in_moss(days, 0.05), [10.0, -15.0 + 7.0 / 3.0])
    np.testing.assert_allclose(tower_report.temperature_in_moss(days, 0.15), [6.0, -8.0])
    np.testing.assert_allclose(tower_report.temperature_in_moss(days, 0.25), [6.0 - 8.0 / 3.0, -8.0 + 8.0 / 3.0])


def test_large_rmse_misses_without_bias_and_unjudged_has_no_verdict():
    index = pd.date_range("2013-01-01", "2013-12-31")
    measured = pd.Series(np.where(index.month < 7, 3.0, -3.0), index)
    days = pd.DataFrame({"measured": measured, "modelled": 0.0, "counts": True})
    found = tower_comparison.find_misses("here", {"soil temperature": days}, {})
    assert len(found) == 1 and "RMSE 3.0" in found[0].what
    assert tower_comparison.skill_table({"soil temperature": days}).endswith("| **MISS** |")
    assert tower_comparison.skill_table({"soil temperature": days}, ("soil temperature",)).endswith("| none |")


def test_digits_show_the_verdict():
    assert Band(0.5, 1.5).digits(0.498, 2) == 3
    assert Band(0.5, 1.5).digits(0.502, 2) == 2
    assert Band(0.0975, 0.1625).digits(0.1629, 3) == 4


def test_days_dry_and_warm_enough_for_fire():
    """15 degC dries 3 mm a day from day 0: 30 mm are passed on the eleventh day; snow sets the index back."""
    weather = {name: np.zeros((1, 1, 365)) for name in disturbance_report.DAILY}
    weather["air_temperature_c"][:] = 15.0
    weather["swe_mm"][0, 0, 150] = 1.0
    site = {"summer_start_day": 150.0, "summer_end_day": 250.0, "fire_drought_threshold": 30.0}
    warm, ready = disturbance_report.fire_days(held_stands.Run({}, {}, weather), [site])
    assert (warm[0], ready[0]) == (100.0, 100.0 - 11.0)


def test_statistics_of_a_made_up_year():
    angle = 2.0 * math.pi * (np.arange(365) + 0.5) / 365.0
    temperature = np.tile(-5.0 - 20.0 * np.cos(angle), (2, 1)) + np.array([[1.0], [-1.0]])
    rain = np.where(np.arange(365) % 4 == 0, 8.0, 0.0) * np.ones((2, 1))
    months = weather_report.of_days(temperature, rain, np.full((2, 365), 100.0))
    np.testing.assert_allclose(months["spread"], 1.0, rtol=1e-9)
    assert months["wet days"].mean() == pytest.approx(0.25, abs=0.02)
    np.testing.assert_allclose(months["wet amount"], 8.0)
    np.testing.assert_allclose(months["shortwave"], 100.0)


def test_calibration_leaves_all_days_as_clear_as_observed():
    even, _ = calibration.split(climate_records.records())
    share = dict.fromkeys(climate_records.SEASONS, 0.2)
    found = calibration.calibrate(even, share, snowfall_unscaled_mm=1.25)
    observed = np.mean([even[name].clearness("summer") for name in calibration.SUN_RECORDS])
    generated = 0.8 * found["clearness_dry_summer"] + 0.2 * found["clearness_wet_summer"]
    assert generated == pytest.approx(observed)
    assert found["snowfall_scale"] == pytest.approx(0.40, abs=0.05)


def test_numbers_of_the_document():
    assert document.number(-0.004, 2, sign=True) == "+0.00"
    assert document.number(-1.25, 1) == "−1.2" and document.number(float("nan")) == "-"
    assert document.table(["a", "b"], [["x", "1"]]) == "| a | b |\n| --- | ---: |\n| x | 1 |"


def test_paragraphs_are_filled_and_tables_left_alone():
    table = "| a |\n| --- |\n| " + "x" * 200 + " |"
    text = document.fill("# Heading\n\nshort\nlines\n\n" + table)
    assert text == "# Heading\n\nshort lines\n\n" + table


@pytest.mark.slow
def test_quick_run_writes_the_same_bytes_twice(tmp_path, capsys):
    for folder in ("first", "second"):
        run_script("analysis/validate.py", "--quick", "--parts", "seasons", "--output-dir", tmp_path / folder)
    text = (tmp_path / "first" / "validation.md").read_text()
    last = f"## {len(validate.PARTS) + 1}. What misses"
    assert "## 4. Seasonal courses" in text and last in text and "## 1." not in text
    for name in ("validation.md", "images/validation_seasons.png"):
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()
    assert f"wrote {tmp_path / 'second' / 'validation.md'}, figures: 1" in capsys.readouterr().out


def test_refusals_are_one_line(tmp_path):
    with pytest.raises(SystemExit, match="--free-sites of at least 1 is allowed, not 0") as few:
        run_script("analysis/validate.py", "--free-sites", "0")
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit, match="--output-dir .*: cannot write there") as unwritable:
        run_script("analysis/validate.py", "--quick", "--parts", "towers", "--output-dir", tmp_path / "file")
    assert "\n" not in str(few.value) + str(unwritable.value)


def test_every_miss_is_listed_and_parts_keep_their_order():
    miss = document.Miss("here", "too low", "a process")
    text = validate.assemble({"seasons": document.Part("later", misses=[miss]), "bands": document.Part("first")})
    assert text.index("first") < text.index("later") < text.index("| here | too low | a process |")


@pytest.mark.slow
def test_stands_run_free_and_experiments_in_a_quick_run(tmp_path, capsys):
    run_script("analysis/validate.py", "--quick", "--parts", "free", "field", "robustness", "--output-dir", tmp_path)
    text = (tmp_path / "validation.md").read_text()
    for heading in ("## 6. Stands that run free", "## 7. Field experiments", "## 8. What the thaw return hangs on"):
        assert heading in text
    assert (tmp_path / "images" / "validation_free_stands.png").exists()
    assert "`python analysis/studies/planting_signs.py` finds them" in " ".join(text.split())
    assert " nan" not in text
    capsys.readouterr()
