"""A region that is killed where it is, by its own command."""

import pytest
from scripts import run_script

from analysis import excerpts, region_killed


@pytest.mark.slow
def test_a_small_region_is_killed_and_the_page_says_what_came_of_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert excerpts.region_killed() == "Not measured yet.\n"
    region_killed.main(region_killed.Args(stands=12, kills=1))
    said = excerpts.region_killed()
    assert "12 stands under `ppo_group-balanced` for 2 years, in steps of 120 minutes, killed 1 times" in said
    assert "the same bytes as a run that was left alone" in said


def test_a_step_that_does_not_divide_a_day_is_refused():
    with pytest.raises(SystemExit, match=r"--step-minutes 7: a divisor of 1440 of at most \d+ is allowed"):
        region_killed.main(region_killed.Args(step_minutes=7))


@pytest.mark.parametrize("flag, given", [("--stands", "0"), ("--years", "0"), ("--kills", "-1")])
def test_numbers_outside_their_limits_are_refused(flag, given):
    with pytest.raises(SystemExit, match=f"{flag} must lie in .*, not {given}"):
        run_script("analysis/region_killed.py", flag, given)
