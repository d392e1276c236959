"""What `analysis/scaling.py` makes of its measurements, and the Python of its page. How fast anything is, is no test's
business."""

import re

import numpy as np
import pandas as pd
import pytest
from scripts import ROOT

import sim
from analysis import excerpts, scaling
from sim.task.actions import NO_CHANGE


def test_a_row_a_figure_and_the_region_at_the_best_speed(tmp_path, monkeypatch):
    table = scaling.run(scaling.Args(stands=(1, 2), threads=(1,), environments=2, repeats=1, dollars_per_core_hour=0.5))
    assert tuple(table.columns) == scaling.COLUMNS
    table = table[table.backend == "numba"]
    speeds = table[table.unit == "stand-years per s"]
    assert speeds.stands.tolist() == [1, 2, 2]
    assert (speeds.efficiency[speeds.what == "a year"] == 1.0).all()
    hours, dollars = (table.loc[table.unit == unit, "median"].item() for unit in ("core-hours", "dollars"))
    assert hours == pytest.approx(1e6 * 52 / speeds["median"][speeds.what == "a year"].max() / 3600)
    assert dollars == 0.5 * hours
    (tmp_path / "results").mkdir()
    table.to_csv(tmp_path / "results" / "scaling.csv", index=False)
    monkeypatch.chdir(tmp_path)
    lines = excerpts.scaling().splitlines()
    assert lines[0].endswith(" cores:") and lines[2] == "| stands | 1 core |" and lines[4].startswith("| 1 | ")
    assert any(line.startswith("- A million stands for 50 years, on cores: ") and "dollars" in line for line in lines)


def test_repeated_stands_begin_as_those_they_repeat_and_are_all_simulated():
    first = sim.Stands(2, time_step_minutes=1440)
    first.start([0, 1], [sim.sample_site(k) for k in range(2)], [sim.episode_seeds(k) for k in range(2)])
    five = scaling.repeated(first, 5, time_step_minutes=1440)
    np.testing.assert_array_equal(five.state, first.state[[0, 1, 0, 1, 0]])
    assert len({row.tobytes() for row in five.step(np.full(5, NO_CHANGE))}) == 5


@pytest.mark.slow
def test_the_pages_python_runs(tmp_path, monkeypatch):
    """As it stands, but for a coarser grid and fewer years."""
    for package in ("xarray", "zarr", "matplotlib", "torch"):
        pytest.importorskip(package)
    import matplotlib

    matplotlib.use("Agg")
    page = (ROOT / "docs" / "scaling.md").read_text(encoding="utf-8")
    smaller = {"65, 0.5": "65, 4", "140, 1.0": "140, 25", "years=50": "years=2", "years=20": "years=10"}
    code = "\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL))
    for given, instead in smaller.items():
        assert given in code
        code = code.replace(given, instead)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(compile(code, "docs/scaling.md", "exec"), names)
    assert names["thaw"].shape == (3, 2) and names["thaw"].gt(0).all(axis=None)
    assert (tmp_path / "region.zarr").is_dir() and (tmp_path / "planted.zarr").is_dir()


def test_a_number_that_is_named_twice_is_refused(tmp_path):
    with pytest.raises(SystemExit, match="--stands 4 4: each once is allowed"):
        scaling.main(scaling.Args(stands=(4, 4), output_dir=tmp_path))


def test_what_is_quick_is_not_written_over_what_is_committed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(scaling, "run", lambda args: pd.DataFrame({"machine": ["this"], "median": [1.0]}))
    scaling.main(scaling.Args(quick=True))
    assert [path.name for path in tmp_path.rglob("*.csv")] == ["scaling.csv"]
    assert (tmp_path / "results" / "quick" / "scaling.csv").exists()
