"""What knowing a site is worth: choices on known gains."""

import numpy as np
import pandas as pd
import pytest

from analysis import paths, stored
from analysis.studies import decade_plans, site_choice, site_regression


def test_a_choice_is_judged_on_the_dice_that_it_was_made_on_and_on_others():
    """Two plans, one site, two dice: each plan wins once, so that luck alone tells them apart."""
    gains = np.zeros((2, 1, 2, 2))
    gains[:, 0, :, 0] = [[3.0, 1.0], [0.0, 2.0]]
    all_sites, same_dice, other_dice, all_dice = site_choice.chosen_gains(gains, weight=1.0)[:, 0]
    assert (all_sites, same_dice) == (2.0, 2.5)  # plan 0 has the better mean; the winner of each die
    assert other_dice == 0.5  # on the first die what won on the second, which gains 0, and the other way round
    assert all_dice == 2.0  # plan 0, by its mean


def test_one_plan_for_all_sites_is_constant_and_what_is_chosen_by_site_may_change():
    gains = np.ones((len(site_choice.PLANS) + len(site_choice.CHANGING), 3, 2, 2))
    gains[-1] = 4.0
    all_sites, same_dice, other_dice, all_dice = site_choice.chosen_gains(gains, weight=0.5)
    assert (all_sites == 1.0).all()
    assert (same_dice == 4.0).all() and (other_dice == 4.0).all() and (all_dice == 4.0).all()


def test_plans_that_change_are_those_that_the_search_found():
    tables = [stored.read(decade_plans.path(task), text=("constant", "plan")) for task in decade_plans.TASKS]
    found = pd.concat(tables)
    found = set(found.plan[found.plan != found.constant])
    assert {" ".join(map(str, plan)) for plan in site_choice.CHANGING} == found


def test_regression_finds_a_plan_that_a_parameter_decides_and_no_other():
    rng = np.random.default_rng(0)
    parameters = rng.normal(size=(400, 3))
    parameters[:, 2] = 1.0  # one that no site varies
    noise = 0.3 * rng.normal(size=(2, 400))
    decided = np.stack([parameters[:, 0], -parameters[:, 0]]) + 1.0
    gains = np.stack([decided + noise, 1.0 + noise], axis=-1)  # carbon hangs on the site, thaw on luck alone
    rows = {row["weight"]: row for row in site_regression.summarise("task", parameters, gains)}
    carbon = gains[..., 0]
    to_be_had = 100 * carbon.max(axis=0).mean() / carbon.mean(axis=1).max()
    assert rows[1.0]["score"] == pytest.approx(to_be_had, rel=0.02)
    assert rows[0.0]["score"] == pytest.approx(100, abs=5)  # luck is not to be foreseen
    assert rows[1.0]["score_low"] < rows[1.0]["score"] < rows[1.0]["score_high"]
    assert rows[1.0]["score_constant"] == rows[1.0]["score"]  # all plans are constant


def test_plans_that_change_are_chosen_beside_the_constant_ones_and_the_score_is_of_those():
    rng = np.random.default_rng(1)
    parameters = rng.normal(size=(64, 2))
    gains = np.ones((len(site_choice.PLANS) + len(site_choice.CHANGING), 64, 2))
    gains[-1] = 2.0
    for row in site_regression.summarise("task", parameters, gains):
        assert (row["score"], row["score_constant"]) == (pytest.approx(200), pytest.approx(100))


@pytest.mark.slow
@pytest.mark.parametrize("study", [site_choice, site_regression])
def test_runs_and_is_not_run_twice(study, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(paths, "studies", lambda quick: tmp_path)
    study.main(study.Args(quick=True))
    assert len(study.path(quick=True).read_text().splitlines()) == 2 + 2 * 6  # settings, header, five weights and all
    study.main(study.Args(quick=True))
    assert "is finished" in capsys.readouterr().out
