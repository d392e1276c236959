import re
import shutil
from pathlib import Path

import pandas as pd
import pytest
from tiny_runs import TINY_RUNS, write_run

from analysis import document_results, excerpts, experiments, main_points, methods, stored
from analysis.results import Results

ROOT = Path(__file__).parents[1]


@pytest.fixture
def pages(tmp_path):
    """A copy of the documents that have results."""
    for page in filter(lambda page: (ROOT / page).exists(), document_results.PAGES):
        (tmp_path / page).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / page, tmp_path / page)
    return tmp_path


def read(folder):
    return {
        path.relative_to(folder): path.read_text(encoding="utf-8")
        for path in map(folder.joinpath, document_results.PAGES)
        if path.exists()
    }


@pytest.mark.slow
def test_the_committed_documents_show_the_committed_runs(pages, monkeypatch):
    monkeypatch.chdir(ROOT)
    document_results.main(document_results.Args(runs_dir=(Path("results/runs"),), root=pages))
    assert read(pages) == read(ROOT)


def test_rows_are_those_of_the_runs(tmp_path):
    """Two seeds: carbon 0 and 1 at the ends of weight 0 to 1, then 1 and 2; zero change has nothing."""
    write_run(tmp_path / "zero", "zero_change", carbon=(0, 0, 0), thaw=(0, 0, 0))
    write_run(tmp_path / "a", "ppo_gated", seed=1, carbon=(0, 0, 1), thaw=(-1, -1, -1))
    write_run(tmp_path / "b", "ppo_gated", seed=2, carbon=(1, 1, 2), thaw=(-3, -3, -3))
    write_run(tmp_path / "c", "ppo_gated", carbon=(1, 1, 1), thaw=(0, 0, 0), ent_coef=0.0, hide_site=True)
    results = Results((tmp_path,), experiments.jobs(), tmp_path / "none")
    head, _, default, variant = document_results.section(results, "ppo_gated").splitlines()
    cells = [cell.strip() for cell in default.split("|")[1:-1]]
    assert len(cells) == len(head.split("|")) - 2
    assert cells[:2] == ["default", "2"]
    assert cells[2:4] == ["", ""]  # no constant plans, no score
    assert [cell.split(" ")[0] for cell in cells[6:10]] == ["0.50", "1.50", "-2.00", "-2.00"]
    # weights 0, 0.5, 1: (-1, -0.5, 1) and (-3, -1, 2); zero change has nothing, so gains are the same
    assert cells[4].split(" ")[0] == cells[10].split(" ")[0] == "-0.42"
    assert cells[11] == "4.70"  # the paper's
    assert variant.startswith("| `--ent-coef 0.0 --hide-site` | 1 |  |  | 0.50 | 0.00 | 1.00 |") and variant.endswith(
        "|  |"
    )


def test_all_methods_and_the_heuristics(tmp_path):
    results = Results((TINY_RUNS,), experiments.jobs(), tmp_path)
    every = (*methods.LEARNERS, *methods.STRATEGIES)
    lacking = [script for script in every if script not in ("ppo_curriculum", "zero_change")]
    assert [row.split(" | ")[0] for row in document_results.section(results, "all").splitlines()[2:]] == [
        "| Curriculum PPO",
        "| Zero change",
        *(f"| {methods.title(script)}" for script in lacking),
    ]
    last = document_results.section(results, "all").splitlines()[-1]
    assert last.startswith("| Random | not run yet |") and not re.search(r"\d", last)
    assert len(document_results.section(results, "heuristics").splitlines()) == 3
    assert document_results.section(results, "eupg_var_lambda") == (
        "Not run yet: `python analysis/reproduce.py --only main balanced variants`.\n"
    )


def test_every_section_without_runs_names_a_command(tmp_path, monkeypatch):
    """But for those of what needs no run: speed, towers, the site's worth and what misses."""
    texts = [(ROOT / page).read_text(encoding="utf-8") for page in document_results.PAGES]
    monkeypatch.chdir(tmp_path)
    results = Results((), experiments.jobs(), tmp_path / "none")
    names = {name for text in texts for _, name, _ in document_results.SECTION.findall(text)}
    need_none = {
        "speed",
        "shares",
        "towers",
        "misses",
        "short_table",
        "boreal_map",
        "scaling",
        "region_killed",
        "splits",
    }
    for name in names - need_none:
        assert re.search(r"[Nn]ot (run|timed) yet: `python analysis/", document_results.section(results, name)), name
    assert document_results.section(results, "short_table").count("not run yet") == len(main_points.LEARNED)


def test_a_figure_is_shown_once_it_is_drawn(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    results = Results((), experiments.jobs(), tmp_path / "none")
    Path("results/figures").mkdir(parents=True)
    Path("results/figures/learning_curves.png").touch()
    section = document_results.section(results, "figure_learning_curves")
    assert section.startswith("![Returns of training episodes") and section.endswith(
        "(../results/figures/learning_curves.png)\n"
    )


def test_a_page_without_a_section_is_named(pages):
    (pages / "README.md").write_text("nothing")
    with pytest.raises(SystemExit, match="README.md: no section of results"):
        document_results.main(document_results.Args(runs_dir=(TINY_RUNS,), root=pages))


def test_the_splits_of_sites_and_the_policies_on_them(tmp_path):
    """Two sites; outside the greedy policy has half of its ratios on one."""
    results = Results((tmp_path,), experiments.jobs(), tmp_path)
    table = document_results.section(results, "splits")
    assert "| `validation` | 100 of `evaluation_sites.csv` |" in table
    assert "| `test` | 200 of `evaluation_sites.csv` |" in table
    assert "| `calmer` | those of `test` | `wind_speed_m_s` 0.4 to 1 (sampled: 1 to 5) |" in table
    assert document_results.section(results, "generalisation").startswith("Not run yet: `python analysis/gen")

    names = [f"runs/ppo_group/boreal-balanced-v0/seed2, {policy}" for policy in ("greedy", "sampled")]
    rows = [(name, site, 0.8, 1.0, "test") for name in names for site in (1, 2)]
    rows += [(name, site, 0.4 * site, 1.0, "calmer") for name in names for site in (1, 2)]
    table = pd.DataFrame(rows, columns=["policy", "site_seed", "nhgr", "eugr", "split"])
    scores = [[names[0], "test", 96.2], [names[0], "calmer", 61.0]]
    stored.write(tmp_path / "generalisation" / "boreal-balanced-v0.csv", table, {"scores": scores})
    _, _, inside, outside = document_results.section(results, "generalisation").splitlines()
    assert inside == "| Group PPO, seed 2, `boreal-balanced-v0` | test | 2 | 96 | 0.80 |  | 1.00 |  |"
    assert outside.startswith("| Group PPO, seed 2, `boreal-balanced-v0` | calmer | 2 | 61 | 0.60 | 0.20 [")


def test_misses_are_told_beside_all_that_is_judged():
    judged = (
        "| a | 1 (0 .. 2) in, 56 % | 3 **MISS, high**, 4 % |\n| b | 2 | in, calibrated | in |\n| in winter | 3 | - |\n"
    )
    missed = "| where | what |\n| --- | --- |\n| here | a |\n| sites that span the sampled | b |\n"
    page = f"In all.\n\n{judged}\n## 9. What misses\n\n{missed}"
    assert excerpts.of_judged(page) == "1 of 4 judged values (1 of the others calibrated)"
