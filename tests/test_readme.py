"""The README as its reader uses it: its Python runs as it stands, and its commands name files that are there."""

import re

import pandas as pd
import pytest
from scripts import ROOT

from analysis import excerpts
from analysis.document_results import EXCERPTS, SECTION

README, START, RESULTS = (
    (ROOT / page).read_text(encoding="utf-8") for page in ("README.md", "docs/start.md", "docs/results.md")
)
VALIDATION = (ROOT / excerpts.VALIDATION).read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", README + START, re.DOTALL)


@pytest.mark.parametrize("number", range(len(PYTHON)))
def test_python_blocks_run(number):
    exec(compile(PYTHON[number], f"README.md and docs/start.md, Python block {number + 1}", "exec"), {})


def test_there_are_python_blocks():
    assert len(PYTHON) >= 2


def test_commands_and_links_name_files_that_exist():
    named = set(re.findall(r"python ([\w/]+\.py)", README)) | set(re.findall(r"\]\(([\w/.-]+)\)", README))
    assert len(named) > 12
    assert [path for path in sorted(named) if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("name", EXCERPTS)
def test_excerpts_are_of_what_was_measured_last(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    names = ("performance.md", "scaling.md", "learning.md", "outside.md")
    pages = [(ROOT / "docs" / page).read_text(encoding="utf-8") for page in names]
    shown = {match[0] for match in SECTION.finditer(README + START + RESULTS + "".join(pages)) if match[2] == name}
    assert shown == {f"<!-- results of {name} -->\n{EXCERPTS[name]()}<!-- end of results -->"}


def test_the_readme_is_a_screen_and_a_half():
    assert len(README.splitlines()) <= 125  # of which 40 are made by commands


def test_times_are_shown_in_minutes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "Not timed yet" in excerpts.times()
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "readme.csv").write_text(
        "command,seconds,machine\npytest,330,2 cores of X\npip,61,2 cores of X\n"
    )
    assert excerpts.times() == "*On 2 cores of X: `pytest` 6 min, `pip` 61 s.*\n"


def test_a_speed_that_was_measured_once_says_so(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    row = {"unit": "s", "median": 0.3, "low": 0.2, "high": 0.4, "repeats": 3, "paper": ""}
    table = pd.DataFrame([{"what": name} | row for name in excerpts.SPEEDS]).set_index("what")
    table.loc["first start, 16 stands", ["median", "low", "high"]] = 31.0
    table.to_csv(tmp_path / "results" / "benchmark.csv")
    lines = excerpts.speed().splitlines()
    assert "median of 3 (lowest-highest)" in lines[0] and "0.30 s (0.20-0.40)" in lines[2]
    assert "| first start, the physics compiled | 31 s (once) |  |" in lines


def test_excerpts_read_the_pages():
    page = """### SE-Svb, north

|  | measured | months: bias | RMSE | r | n | days: bias | RMSE | r | verdict |
| --- | ---: | --- | --- | --- | --- | --- | --- | --- | --- |
| GPP [g] | 9 | +1 | 2 | 0.3 | 12 | +4 | 5 | 0.6 | in |

### US-Prr, west

|  | measured | months: bias | RMSE | r | n | days: bias | RMSE | r | verdict |
| --- | ---: | --- | --- | --- | --- | --- | --- | --- | --- |
| GPP [g] | 9 | −7 | 8 | 0.9 | 12 | +4 | 5 | 0.6 | **MISS** |

## 9. What misses

| where | what | likely |
| --- | --- | --- |
| US-Prr | GPP | light use |
"""
    assert excerpts.scores(page, "SE-Svb") == {"GPP [g]": ["+1", "2", "0.3", "in"]}
    assert excerpts.scores(page, "US-Prr") == {"GPP [g]": ["−7", "8", "0.9", "**MISS**"]}
    assert excerpts.misses(page) == 1


def missing(what):
    """Medians and limits of values that the list at the end of docs/validation.md has."""
    number = r"(-?[\d.]+)"
    listed = re.escape(what) + rf"[^|]*?: median {number}, observed {number} .. {number}"
    return [tuple(map(float, found)) for found in re.findall(listed, VALIDATION.split("What misses\n")[1])]


def test_the_words_on_what_misses_are_so():
    clear_cut = missing("ground heat, May to August")
    assert clear_cut and all(median <= 0.34 * (low * high) ** 0.5 for median, low, high in clear_cut)  # the limits are
    # half and twice the measured
    ((thaw, _, _),) = missing("depth of thaw [m]")
    assert 1.9 < thaw / 0.52 and thaw / 0.36 < 3.1  # measured: .36-.52, in that page's part 7
    assert re.findall(r"\| even-aged deciduous \| biomass at (\d+) years", VALIDATION) == ["30", "75"]
    assert all(median < low for median, low, _ in missing("biomass at 30 years") + missing("biomass at 75 years"))
