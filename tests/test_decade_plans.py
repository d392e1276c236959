"""Plans that change every ten years: a search on known gains, and what is said of what it finds."""

import numpy as np
import pytest

from analysis import paths
from analysis.studies import decade_plans, site_choice
from analysis.studies.decade_plans import ACTIONS, Design, Played, search, summarise


class Known:
    """Gains of plans of three blocks on two sites: conifers pay in the first block alone, deciduous trees always."""

    nothing, block_years = (12, 12, 12), 10

    def gains(self, plans, weight):
        def of(plan):
            return 3.5 * (plan[0] == 24) + sum(action == 20 for action in plan)

        return np.array([[of(plan) - 0.1, of(plan) + 0.1] for plan in plans])


def test_search_begins_with_the_best_constant_plan_and_changes_it_where_that_pays():
    tried = []
    constant, plan = search(Known(), 0.0, tried.append)
    assert (constant, plan) == ((24, 24, 24), (24, 20, 20))
    assert len(tried) == 6  # from the last block to the first, and again, where nothing is changed
    assert "years 20-" in tried[0] and "years 0-" in tried[2]


def test_every_action_that_differs_is_tried():
    assert len(ACTIONS) == len(set(ACTIONS)) == 21 and {12, 20, 24} < set(ACTIONS)


def test_a_plan_is_played_once_and_gains_nothing_where_it_does_nothing(monkeypatch):
    played = Played("boreal-balanced-v0", 0, 2, Design(sites=2, judging=2, years=4, block_years=2))
    numbers, original = [], site_choice.play
    monkeypatch.setattr(site_choice, "play", lambda *given: numbers.append(len(given[2])) or original(*given))
    for weight in (0.0, 1.0):
        nothing, planted = played.gains([(12, 12), (20, 24)], weight)
        assert (nothing == 0).all() and (planted != 0).all()
    assert numbers == [2]


def test_what_is_found_is_held_against_the_constant_plan():
    found = [(0.0, (24, 24), (24, 20)), (1.0, (20, 20), (20, 20))]
    gains = np.array([[[1.0, 3.0], [2.0, 4.0]], [[5.0, 7.0], [5.0, 7.0]]])  # (weights, both plans, sites)
    first, second, every = summarise(found, gains)
    assert (first["constant"], first["plan"]) == ("24 24", "24 20")
    assert (first["more"], first["more_low"], first["more_high"]) == (1.0, 1.0, 1.0)
    assert second["more"] == 0.0
    assert every["plan_gain"] == pytest.approx(100 * 4.5 / 4.0) and every["more"] == pytest.approx(12.5)
    assert every["more_low"] == pytest.approx(10.0) and every["more_high"] == pytest.approx(100 * 0.5 / 3)


def test_a_task_that_is_none_and_too_few_sites_are_refused():
    with pytest.raises(SystemExit, match="--tasks boreal-none-v0: allowed are boreal-generalist-v0, boreal-balanced"):
        decade_plans.main(decade_plans.Args(tasks=("boreal-none-v0",)))
    with pytest.raises(SystemExit, match="--sites 1 --judging 512: 2 or more of both are allowed"):
        decade_plans.main(decade_plans.Args(sites=1))


@pytest.mark.slow
def test_runs_and_is_not_run_twice(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(paths, "studies", lambda quick: tmp_path)
    for _ in range(2):
        decade_plans.main(decade_plans.Args(quick=True))
    for task in decade_plans.TASKS:
        assert len(decade_plans.path(task, quick=True).read_text().splitlines()) == 2 + 6  # five weights and all
    assert capsys.readouterr().out.count("is finished") == 2
