"""The stress test in small: every way of drawing stands, and that what it looks for is found when it is there."""

import numpy as np
import pandas as pd
import pytest
from scripts import run_script

import sim
from analysis import stress
from sim.closure import TOLERANCES
from sim.parameters import check_constants
from sim.state import RECORD_NAMES, STATE_NAMES

CORNERS = list(stress.GROUPS).index("sampled corners")  # a batch of this group is soon done


@pytest.mark.parametrize("number", range(len(stress.GROUPS)), ids=list(stress.GROUPS))
def test_nothing_is_lost_negative_or_out_of_range(number):
    outcome = stress.run_batch(1, number)
    assert outcome.failures == []
    assert outcome.stand_years == stress.planned_years(number)
    assert set(outcome.residuals) == {*TOLERANCES, *stress.YEARLY_BUDGETS}
    assert all(np.isfinite(residual) for residual in outcome.residuals.values())


def test_a_batch_is_a_function_of_seed_and_number():
    first, second = (stress.run_batch(3, CORNERS) for _ in range(2))
    assert first == second
    assert first != stress.run_batch(4, CORNERS)


@pytest.mark.parametrize("corners", [False, True])
def test_drawn_constants_are_allowed(corners):
    generator = np.random.default_rng(0)
    for _ in range(30):
        check_constants(stress.draw_constants(generator, corners))


def plant(monkeypatch, table, column, change):
    """From now on a year after spin-up has `change` made to one column of the state or the record of stand 5."""
    run, names = sim.Stands._run, {"state": STATE_NAMES, "record": RECORD_NAMES}[table]

    def faulty_run(self, *args, **kwargs):
        state, record = run(self, *args, **kwargs)
        if "steps_per_day" not in kwargs:
            {"state": state, "record": record}[table][5, names.index(column)] += change
        return state, record

    monkeypatch.setattr(sim.Stands, "_run", faulty_run)


@pytest.mark.parametrize(
    ("table", "column", "change", "kind", "what"),
    [
        ("state", "soil_carbon", 1e-6, "balance", "carbon_of_the_year_kgc_m2"),
        ("state", "soil_water", -1e-6, "balance", "water_of_the_year_mm"),
        ("state", "deep_heat", 1e4, "balance", "deep_heat_of_the_year_mj_m2"),
        ("state", "swe", -1e4, "out of range", "swe"),
        ("state", "albedo", 1.0, "out of range", "snow albedo"),
        ("record", "latent_heat_mj_m2", 0.1, "balance", "latent_heat_of_the_year_mj_m2"),
        ("record", "energy_residual_w_m2", 1e-5, "balance", "energy_residual_w_m2"),
        ("record", "fire_mortality", -1.0, "out of range", "fire_mortality"),
        ("record", "gpp_kgc_m2", np.nan, "not finite", "gpp_kgc_m2"),
    ],
)
def test_a_planted_fault_is_found(monkeypatch, table, column, change, kind, what):
    plant(monkeypatch, table, column, change)
    failures = stress.run_batch(1, CORNERS).failures
    found = [failure for failure in failures if failure["kind"] == kind and failure["what"].startswith(what)]
    assert found
    assert {failure["stand"] for failure in found} <= {5, None}  # None: the kernel's own check, which names it


def test_failures_are_tabulated_and_end_the_script_with_the_command_that_replays_them(monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(TOLERANCES, "water_residual_mm", -1.0)
    with pytest.raises(SystemExit) as end:
        run_script("analysis/stress.py", "--stand-years", 401, "--seed", 2, "--output-dir", tmp_path)
    assert end.value.code == "2 failures in 2 batches"
    printed = capsys.readouterr().out
    assert "python analysis/stress.py --seed 2 --batch 1" in printed
    residuals = pd.read_csv(tmp_path / "residuals.csv", index_col="group")
    assert residuals.loc[["sampled sites", "sampled corners"], "balance"].tolist() == [1, 1]
    assert residuals.loc["tolerance", "energy_residual_w_m2"] == TOLERANCES["energy_residual_w_m2"]
    assert (pd.read_csv(tmp_path / "failures.csv").kind == "balance").all()

    with pytest.raises(SystemExit) as end:
        run_script("analysis/stress.py", "--seed", 2, "--batch", 1)
    assert end.value.code == 1
    assert "gpp_kgc_m2=" in capsys.readouterr().out


@pytest.mark.slow
def test_a_clean_run_ends_with_its_tables(tmp_path, capsys):
    run_script("analysis/stress.py", "--stand-years", 1, "--output-dir", tmp_path)
    residuals = pd.read_csv(tmp_path / "residuals.csv", index_col="group")
    ran = residuals.loc["sampled sites"]
    assert ran.stand_years == stress.planned_years(0)
    assert ran[["balance", "not_finite", "out_of_range"]].sum() == 0
    assert (ran[list(TOLERANCES)] <= pd.Series(TOLERANCES)).all()
    extremes = pd.read_csv(tmp_path / "extremes.csv")
    assert ((extremes.lowest >= extremes.allowed_low) & (extremes.highest <= extremes.allowed_high)).all()
    assert "tolerance" in capsys.readouterr().out


def test_a_bad_argument_is_refused(tmp_path):
    with pytest.raises(SystemExit, match="--stand-years 0"):
        run_script("analysis/stress.py", "--stand-years", 0, "--output-dir", tmp_path)
