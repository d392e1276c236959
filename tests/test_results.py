"""What tables and figures read: gains against doing nothing under the same conditions, and which row is whose."""

from types import SimpleNamespace

import pandas as pd
import pytest
from tiny_runs import write_run

from analysis import experiments, stored
from analysis.experiments import GENERALIST
from analysis.results import Results, by_year
from analysis.tables.common import paper_name


def in_folder(folder, *run_folders):
    return Results(run_folders, experiments.jobs(), folder)


@pytest.fixture
def plans(tmp_path):
    """The study of constant plans of two episodes: doing nothing earns 5 and 7, and action 24 one and two more."""
    rows = [(a, s, 5.0 + c, 7.0 + 2 * c) for a, c in ((12, 0), (24, 1)) for s in (0, 1)]
    table = pd.DataFrame(rows, columns=["action", "seed", "carbon_return", "thaw_return"]).assign(env_id=GENERALIST)
    stored.write(tmp_path / "constant_plans.csv", table, {})
    return table


def test_constant_plans_count_from_doing_nothing_on_the_same_episodes(plans, tmp_path):
    results, played = in_folder(tmp_path), plans[plans.action == 24]
    assert results.plans(played, GENERALIST).query("plan == '24'").thaw_return.tolist() == [2, 2]
    others = played.assign(seed=[0, 2])
    assert results.plans(others, GENERALIST) is None and results.gains(others, GENERALIST) is None


@pytest.mark.parametrize("condition", [{"thaw_formulation": "contrast"}, {"site_seed": 3}])
def test_constant_plans_of_another_reward_or_site_do_not_count(plans, tmp_path, condition):
    results = in_folder(tmp_path)
    assert results.plans(plans, GENERALIST, **condition) is None
    assert results.gains(plans, GENERALIST, **condition) is None


def test_returns_of_one_thaw_formulation_are_not_compared_with_another(tmp_path):
    write_run(tmp_path / "zero", "zero_change")
    write_run(tmp_path / "own", "ppo_mine", thaw_formulation="contrast")
    results = in_folder(tmp_path, tmp_path)
    assert [one.gains for key, row in results.rows.items() if key[0] == "ppo_mine" for one in row] == [None]
    assert "ppo_mine" not in {key[0] for key in results.of_main_and_others(("zero_change",))}


def test_eupg_of_one_weight_is_a_row_of_the_papers(tmp_path):
    key = next(job for job in experiments.jobs() if job.experiment == "fixed" and not job.is_study).row
    assert paper_name(*key) is not None


def test_a_curve_by_year_is_the_mean_over_weights():
    years = pd.DataFrame({"year": [1, 1], "density_stems_ha": [100.0, 300.0]})
    assert by_year([SimpleNamespace(years=years)], "density_stems_ha").tolist() == [[200.0]]
