"""What looking at the stand is worth to one who has the simulator: choices on known gains, and what they are."""

import numpy as np
import pytest

from analysis import paths
from analysis.studies import replanning
from analysis.studies.site_choice import PLANS


def test_three_ways_to_choose_on_known_gains():
    """Two sites, one die, two plans, carbon alone: plan 0 is better on average, plan 1 on the second site."""
    plans = np.zeros((2, 1, 2, 2))
    plans[:, 0, :, 0] = [[5.0, 1.0], [1.0, 3.0]]
    anew = np.zeros((2, 1, 1, 2))
    anew[:, 0, 0, 0] = [6.0, 4.0]
    gains = replanning.chosen_gains(plans, anew, first=np.array([[0], [1]]), weights=np.array([1.0]))
    assert gains.tolist() == [[[5.0, 1.0], [5.0, 3.0], [6.0, 4.0]]]
    one, every = replanning.summarise(gains, np.array([1.0]), np.array([0.25]))
    assert (one["all_sites"], one["once"], one["every_ten_years"]) == (3.0, 4.0, 5.0)
    assert every["all_sites"] == 100 and every["once"] == pytest.approx(400 / 3)
    assert every["anew_less_once"] == pytest.approx(100 / 3) and every["plan_changed"] == 0.25


def test_what_is_never_chosen_anew_is_the_plan_of_the_first_choice():
    plans, anew, choices = replanning.play_site("boreal-generalist-v0", 0, replanning.Design(1, 2, 2, every=4, years=4))
    assert plans.shape == (2, len(PLANS), 2) and choices.shape == (1, 2, 5)
    assert (plans[:, 0] == 0).all() and not (plans[:, 1] == plans[:, 5]).all()
    np.testing.assert_array_equal(anew, np.take_along_axis(plans, choices[0][..., None], axis=1))
    assert (choices[0][0] == choices[0][1]).all()  # the futures are the site's, whatever the episode's dice


def test_a_task_that_is_none_is_refused():
    with pytest.raises(SystemExit, match="--tasks boreal-none-v0: allowed are boreal-generalist-v0, boreal-balanced"):
        replanning.main(replanning.Args(tasks=("boreal-none-v0",)))


@pytest.mark.slow
def test_runs_and_is_not_run_twice(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(paths, "studies", lambda quick: tmp_path)
    for _ in range(2):
        replanning.main(replanning.Args(quick=True))
    for task in replanning.TASKS:
        assert len(replanning.path(task, quick=True).read_text().splitlines()) == 2 + 6  # five weights and all
    assert capsys.readouterr().out.count("is finished") == 2
