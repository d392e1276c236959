"""docs/simulator.md as its reader uses it: its Python runs as it stands, and prints what the page says."""

import contextlib
import io
import re

import matplotlib
import pytest
from scripts import ROOT

import sim
from sim.io.dataset import PROFILE, VARIABLES

PAGE = (ROOT / "docs" / "simulator.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", PAGE, re.DOTALL)


def test_the_pages_python_runs_and_prints_what_it_says(tmp_path, monkeypatch):
    pytest.importorskip("xarray")
    matplotlib.use("Agg")
    (tmp_path / "analysis").symlink_to(ROOT / "analysis")
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for number, (code, says) in enumerate(BLOCKS):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, f"docs/simulator.md, Python block {number + 1}", "exec"), names)
        assert not says or printed.getvalue() == says
    assert sum(bool(says) for _, says in BLOCKS) >= 2
    assert (tmp_path / "poker_flat.png").stat().st_size > 10_000 and (tmp_path / "poker_flat.nc").exists()


def test_the_first_figure_takes_ten_lines():
    lines = [line for line in BLOCKS[0][0].splitlines() if line and not line.startswith("import")]
    assert len(lines) <= 10


def test_the_page_names_every_variable():
    assert [name for name, *_ in VARIABLES.values() if f"`{name}`" not in PAGE] == []
    assert "SoilTemp(time, depth)" in PAGE and len(PROFILE) == 3
    assert all(f"sim.{name}" in PAGE for name in ("read_forcing", "simulate", "half_hours")) and sim.half_hours
