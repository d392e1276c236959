"""Two methods are compared by their difference on the same sites."""

import pytest
from scripts import ROOT

from analysis import compare

RUNS, BALANCED = ROOT / "results" / "runs", "boreal-balanced-v0-vectorization=lockstep"


def test_a_method_is_not_told_from_itself(capsys):
    folder = RUNS / "plan_regression" / BALANCED
    compare.main(compare.Args(folder, folder))
    first, second, greedy, sampled = capsys.readouterr().out.splitlines()
    assert first.removeprefix("first") == second.removeprefix("second")
    for line in (greedy, sampled):
        assert "+0.0 points [-" in line and ": not told apart" in line


def test_what_has_other_signs_in_no_interval_is_told_apart(capsys):
    compare.main(compare.Args(RUNS / "ppo_gated" / BALANCED, RUNS / "plan_regression" / BALANCED))
    greedy = capsys.readouterr().out.splitlines()[2]
    assert greedy.startswith("greedy: first less second -") and ": told apart" in greedy


def test_a_single_training_has_no_interval(capsys):
    folder = RUNS / "plan_regression" / BALANCED
    compare.main(compare.Args(folder / "seed1", folder))
    assert "[" not in capsys.readouterr().out.splitlines()[2]


@pytest.mark.parametrize(
    "first, second, wrong",
    [
        ("plan_regression", "plan_regression", "one method and setting are allowed, not of: plan_regression, boreal-"),
        (f"plan_regression/{BALANCED}", "nothing", "nothing: no such folder"),
        (
            f"plan_regression/{BALANCED}",
            "plan_regression/boreal-generalist-v0-vectorization=lockstep",
            "the same environment and weights are allowed",
        ),
        (f"ppo_group/{BALANCED}", "ppo_group/boreal-warming-v0-vectorization=lockstep", "same environment|no constant"),
    ],
)
def test_what_cannot_be_compared_is_named(first, second, wrong):
    with pytest.raises(SystemExit, match=wrong):
        compare.main(compare.Args(RUNS / first, RUNS / second))
