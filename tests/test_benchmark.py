"""The benchmark's quick mode gives every figure it promises. How fast anything is, is no test's business."""

import inspect
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scripts import run_script

from analysis import benchmark, profile_kernel
from analysis.machine import machine
from sim.step import simulate_step

FIGURES = {
    "episode": {"s"},
    "stands": {"ns per stand"},
    "steps": {"ms per stand", "ns per stand"},
    "threads": {"stand-years per s"},
    "environment": {"years per s", "% not physics"},
    "memory": {"MB of its own"},
    "start": {"s"},
    "training": {"min", "ms per step", "ms per year"},
}


@pytest.mark.slow
def test_every_section_has_positive_figures_in_its_units(monkeypatch):
    monkeypatch.setattr(benchmark, "ROLLOUT", 256)
    table = benchmark.run(benchmark.Args(quick=True, repeats=1))
    assert tuple(table.columns) == benchmark.COLUMNS
    told = Path("/proc/self/smaps_rollup").exists()
    figures = {name: units for name, units in FIGURES.items() if name != "memory" or told}
    assert {name: set(rows.unit) for name, rows in table.groupby("section")} == figures
    assert not table.duplicated(["section", "what", "unit"]).any()
    figures = table[["median", "low", "high"]]
    assert np.isfinite(figures.to_numpy()).all()
    difference = (table.unit == "% not physics") | table.what.str.endswith("plumbing")
    assert (figures[~difference] > 0.0).all(axis=None)
    assert (table.repeats == 1).all()
    first = table.drop_duplicates(["section", "unit"])
    assert (first.ratio[first.unit != "% not physics"] == 1.0).all()

    training = table[(table.section == "training") & (table.unit == "ms per step")].set_index("what")["median"]
    parts = ("physics", "plumbing", "policy", "update")
    assert set(training.index) == {f"lockstep, 32 stands: {part}" for part in parts}


def test_the_script_writes_its_tables(tmp_path, capsys):
    run_script("analysis/benchmark.py", "--quick", "--repeats", 1, "--only", "stands", "--output-dir", tmp_path)
    table = pd.read_csv(tmp_path / "benchmark.csv")
    assert tuple(table.columns) == benchmark.COLUMNS
    assert set(table.section) == {"stands"}
    printed = capsys.readouterr().out
    assert all(what in printed for what in table.what)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("--only", "everything"), "--only everything"),
        (("--repeats", 0), r"--repeats must lie in \[1, 10000\], not 0$"),
    ],
)
def test_a_bad_argument_is_refused(arguments, message, tmp_path):
    with pytest.raises(SystemExit, match=message):
        run_script("analysis/benchmark.py", *arguments, "--output-dir", tmp_path)


def test_sections_that_are_not_measured_keep_their_rows(tmp_path):
    path = tmp_path / "benchmark.csv"
    rows = [
        ("episode", "a", "s", 1.0, 1.0, 1.0, 1.0, 1, "5-7 s"),
        ("stands", "b", "ns per stand", 2.0, 2.0, 2.0, np.nan, 1, ""),
        ("threads", "c", "stand-years per s", 3.0, 3.0, 3.0, 1.0, 1, ""),
    ]
    pd.DataFrame(rows, columns=benchmark.COLUMNS).to_csv(path, index=False)
    new = pd.DataFrame([("stands", "d", "ns per stand", 4.0, 4.0, 4.0, 1.0, 1, "")], columns=benchmark.COLUMNS)
    both = benchmark.with_earlier(new, path)
    assert both.what.tolist() == ["a", "d", "c"] and both.paper.tolist() == ["5-7 s", "", ""]
    assert benchmark.with_earlier(new, tmp_path / "none.csv") is new
    assert "| a " in benchmark.markdown({"cores": "2"}, both)


def test_the_machine_is_named():
    facts = machine()
    assert {"processor", "cores", "python", "numba", "numpy"} <= set(facts)
    assert all(facts.values())


def test_the_profile_has_the_phases_of_a_step_in_its_order():
    called = re.findall(r"\b(\w+)\(b\b", inspect.getsource(simulate_step.py_func).split('"""')[2])
    assert list(profile_kernel.phases()) == list(dict.fromkeys(called))
    assert len(called) > 15
