"""What the README and docs/results.md say of the main table, against tables whose words are known."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from analysis import main_points
from analysis.tables import main_results

WORLD = main_points.WORLDS[0]
SCORES = {"plus_100": 70.0, "eupg_var_lambda": 60.0, "ppo_gated": 80.0, "ppo_group": 110.0, "moea": 65.0, "best": 100.0}


@pytest.fixture
def results(monkeypatch):
    """Rows of one world, a replicate being the script's name; two of the three trained follow one objective."""
    rows = {(script, WORLD, "vectorization=lockstep"): [script] * 5 for script in SCORES if script != "best"}
    rows |= {
        ("ppo_gated", WORLD, "ent_coef=0.0, vectorization=lockstep"): ["ppo_group"],
        ("ppo_curriculum", WORLD, "default"): [],
        ("moea", WORLD, "algorithm=moead, vectorization=lockstep"): ["ppo_gated"],
    }
    changes = {"eupg_var_lambda": (-1.0, 1.0), "ppo_gated": (0.5, 0.1), "ppo_group": (0.5, -0.1)}

    def scores(replicates):
        value = SCORES[replicates[0]]
        return {"score_greedy": value, "score_greedy_low": value - 5.0, "score_greedy_high": value + 5.0}

    def row_of_runs(key, replicates):
        return dict(zip(("carbon_change_low", "thaw_change_high"), changes[key[0]], strict=True))

    plans = {(main_points.BEST_PLAN, env_id, "default"): ["best"] for env_id in main_points.WORLDS}
    monkeypatch.setattr(main_results, "scores", scores)
    monkeypatch.setattr(main_results, "row_of_runs", row_of_runs)
    monkeypatch.setattr(main_results, "constant_plans", lambda results: plans)
    monkeypatch.setattr(main_points, "beats", lambda one, other: SCORES[one[0]] > SCORES[other[0]])
    return SimpleNamespace(rows_of_two_objectives=lambda: rows)


def test_six_rows(results):
    lines = main_points.six_rows(results).splitlines()
    assert lines[0] == "| method | training seeds | `boreal-balanced-v0` | `boreal-generalist-v0` |"
    assert lines[2:] == [
        "| the best constant plan of each preference | | 100 [95, 105] | 100 [95, 105] |",
        "| +100 a year |  | 70 [65, 75] |  |",
        "| Variable λ EUPG | 5 | 60 [55, 65] |  |",
        "| PPO Gated | 5 | 80 [75, 85] |  |",
        "| Curriculum PPO | not run yet |  |  |",
        "| Group PPO | 5 | 110 [105, 115] |  |",
    ]


def test_the_score_of_a_single_training_is_not_shown(results):
    results.rows_of_two_objectives()["ppo_gated", WORLD, "vectorization=lockstep"].pop()
    assert "| PPO Gated | 4 | 80 [75, 85] |  |" in main_points.six_rows(results)
    del results.rows_of_two_objectives()["ppo_gated", WORLD, "vectorization=lockstep"][1:]
    assert "| PPO Gated | 1 |  |  |" in main_points.six_rows(results)


def test_the_words_follow_from_the_numbers(results):
    assert " ".join(main_points.in_words(results).split()) == (
        "- **`boreal-balanced-v0`.** Planting 100 stems a year without looking scores 70. The best of 5 trained "
        "methods is Group PPO with 110 [105, 115], 5 training seeds; by the whole interval of the difference on the "
        "same sites PPO Gated, Group PPO and MOEA/D are above planting, Group PPO is above 100. Few training seeds: "
        "MOEA/D 1. Not run yet: Curriculum PPO. "
        "Asked for carbon instead of thaw, PPO Gated and Group PPO store more carbon for it; asked for thaw instead of "
        "carbon, Group PPO keeps more cold in the ground (intervals over training seeds without 0)."
    )


def replicates(*shifts):
    """Trainings that gain so much more than 1, 2, .., 20 on as many sites."""
    sites = pd.DataFrame({"seed": range(20), "scalarized_return": np.arange(1.0, 21.0)})
    return [
        SimpleNamespace(by_policy={"greedy": sites.assign(scalarized_return=sites.scalarized_return + shift)})
        for shift in shifts
    ]


def test_a_method_is_above_another_by_all_of_its_interval_on_the_same_sites():
    fixed = replicates(0.0)
    assert main_points.beats(replicates(0.1, 0.2, 0.3), fixed)  # sites differ by more, and cancel
    assert not main_points.beats(replicates(-0.1, 0.5, 0.8), fixed)
    assert not main_points.beats(replicates(0.5), fixed)  # a single training


def test_few_seeds_do_not_say_whether_the_preference_is_followed(results):
    rows = {key: found[:2] for key, found in results.rows_of_two_objectives().items() if key[0] != "ppo_gated"}
    words = " ".join(main_points.in_words(SimpleNamespace(rows_of_two_objectives=lambda: rows)).split())
    assert "110 [105, 115], 2 training seeds;" in words and "Not run yet: PPO Gated and Curriculum PPO." in words
    assert words.endswith("Whether a method follows the preference is said from 5 training seeds on.")


def test_without_runs_nothing_is_said(results):
    assert main_points.in_words(SimpleNamespace(rows_of_two_objectives=dict)) == (
        "Not run yet: `python analysis/reproduce.py --only main balanced`.\n"
    )


def test_intervals_are_left_out_where_there_are_none():
    assert main_points.shown({"score_greedy": 99.6}) == "100"
    assert main_points.shown({"score_greedy": float("nan")}) == ""
    assert main_points.named([], "store") == "none stores"
