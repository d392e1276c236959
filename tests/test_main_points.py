"""What the README and docs/results.md say of the main table, against tables whose words are known."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from analysis import main_points
from analysis.tables import main_results
from analysis.tables.common import score_text

WORLD = main_points.WORLDS[0]
TRAINED = {"eupg_var_lambda": 60.0, "ppo_gated": 80.0, "ppo_group": 110.0, "moea": 65.0}
SCORES = {"plus_100": 70.0, **TRAINED, "deciduous": 95.0, "best": 100.0}
PLANS = {main_points.BEST_PLAN: "best", main_points.DECIDUOUS: "deciduous"}


@pytest.fixture
def results(monkeypatch):
    """Rows of one world, a replicate being the script's name; two of the three trained follow one objective."""
    rows = {(script, WORLD, "vectorization=lockstep"): [script] * 5 for script in ("plus_100", *TRAINED)}
    rows |= {
        ("ppo_gated", WORLD, "ent_coef=0.0, vectorization=lockstep"): ["ppo_group"],
        ("ppo_curriculum", WORLD, "default"): [],
        ("moea", WORLD, "algorithm=moead, vectorization=lockstep"): ["ppo_gated"],
    }
    changes = {"eupg_var_lambda": (0.0, 0.0), "ppo_gated": (0.6, 0.1), "ppo_group": (0.6, -0.2), "moea": (0.3, -0.1)}

    def responses(replicates):
        """Of the last, seeds differ by more than they have in common."""
        apart = 1.0 if replicates[0] == "moea" else 0.0
        seeds = apart * np.linspace(-1.0, 1.0, len(replicates))[:, None]
        return np.array([seeds + np.full((len(replicates), 20), change) for change in changes[replicates[0]]])

    def scores(replicates):
        value = SCORES[replicates[0]]
        return {"score_greedy": value, "score_greedy_low": value - 5.0, "score_greedy_high": value + 5.0}

    plans = {(name, env_id, "default"): [PLANS[name]] for name in PLANS for env_id in main_points.WORLDS}
    monkeypatch.setattr(main_results, "scores", scores)
    monkeypatch.setattr(main_points, "responses", responses)
    monkeypatch.setattr(main_results, "constant_plans", lambda results: plans)
    monkeypatch.setattr(main_points, "is_above", lambda one, other: SCORES[one[0]] > SCORES[other[0]] + 20)
    monkeypatch.setattr(main_points, "is_below", lambda one, other: SCORES[one[0]] < SCORES[other[0]] - 5)
    monkeypatch.setattr(
        main_points, "ends_of_score", lambda its, *_: (its["score_greedy_low"], its["score_greedy_high"])
    )
    monkeypatch.setattr(main_points, "points", lambda one, other, best: f"{SCORES[one[0]] - SCORES[other[0]]:.1f}")
    monkeypatch.setattr(main_points, "gain_hypervolume", lambda replicates: 2.5)
    monkeypatch.setattr(main_points, "front_of_plans", lambda results, env_id: 3.0)
    monkeypatch.setattr(main_points, "flattery", lambda results, env_id: 0.5)
    return SimpleNamespace(rows_of_two_objectives=lambda: rows)


def test_short_table(results):
    lines = main_points.short_table(results).splitlines()
    assert lines[0] == "| method | training seeds | `boreal-balanced-v0` | `boreal-generalist-v0` |"
    assert lines[2:] == [
        "| +100 a year | | 70 [65, 75] |  |",
        "| 100 deciduous trees a year | | 95.0 [90.0, 100.0] | 95.0 [90.0, 100.0] |",
        "| Variable λ EUPG | 5 | 60 [55, 65] |  |",
        "| PPO Gated | 5 | 80 [75, 85] |  |",
        "| Curriculum PPO | not run yet |  |  |",
        "| Group PPO | 5 | 110.0 [105.0, 115.0] |  |",
        "| Plan regression | not run yet |  |  |",
    ]


def test_the_score_of_a_single_training_is_not_shown(results):
    results.rows_of_two_objectives()["ppo_gated", WORLD, "vectorization=lockstep"].pop()
    assert "| PPO Gated | 4 | 80 [75, 85] |  |" in main_points.short_table(results)
    del results.rows_of_two_objectives()["ppo_gated", WORLD, "vectorization=lockstep"][1:]
    assert "| PPO Gated | 1 |  |  |" in main_points.short_table(results)


def test_more_steps_are_a_row_of_their_own(results):
    runs = {
        ("ppo_group", world, "total_timesteps=1000000, vectorization=lockstep"): ["ppo_group"] * 5
        for world in main_points.WORLDS
    }
    results.rows_of_two_objectives().update(runs)
    rows = main_points.short_table(results).splitlines()
    assert rows[-3].startswith("| Group PPO | 5")
    assert rows[-2] == "| Group PPO, 1,000,000 steps | 5 | 110.0 [105.0, 115.0] | 110.0 [105.0, 115.0] |"
    words = " ".join(main_points.in_words(results).split())
    assert "With 1,000,000 steps and 5 training seeds Group PPO scores 110.0 [105.0, 115.0], above 100. These" in words
    assert "Against those of these very sites, taken as given, it gains 10.0 points more." in words


def test_the_words_follow_from_the_numbers(results):
    plans, ahead, followed = (" ".join(point.split()) for point in main_points.in_words(results).split("\n  - ")[1:])
    assert plans == (
        "Plans that look at nothing: 100 stems a year, half of them conifers, score 70, 100 deciduous trees a year "
        "95.0 [90.0, 100.0]. All constant plans together have a gain hypervolume of 3.00. The best of each weight, "
        "which 100 stands for, gain 0.5 % less when they are chosen on a half of the sites and judged on the other."
    )
    assert ahead == (
        "Of 5 trained methods Group PPO scores highest, 110.0 [105.0, 115.0] with 5 training seeds and a gain "
        "hypervolume of 2.50. Its score less that of 100 deciduous trees a year is 15.0. By both intervals, that of "
        "seeds and sites and that of seeds alone by t, Group PPO is above 100, 3 below 100, MOEA/D is of a "
        "single training, and not judged; none is above 100 deciduous trees a year, Group PPO is above +100 a year, "
        "half conifers; Variable λ EUPG is below that. Few training seeds: MOEA/D 1. Not run yet: Curriculum PPO."
    )
    assert followed == (
        "Asked for carbon instead of thaw, PPO Gated and Group PPO store more carbon for it. Asked for thaw instead of "
        "carbon, Group PPO keeps more cold in the ground, and PPO Gated keeps less. Variable λ EUPG does the same "
        "whatever is asked for. (Greedy policies; a change is named if neither interval, that over seeds "
        "and sites or that over seeds alone by t, holds 0.)"
    )


@pytest.mark.parametrize(("low", "high", "side"), [(100.1, 103, 1), (99.6, 103, 0), (95, 99.9, -1)])
def test_which_side_of_100_an_interval_lies_on(low, high, side):
    assert main_points.beside_100(low, high) == side


def test_the_ends_of_a_score_are_those_of_both_its_intervals():
    scores = {"score_greedy_low": 104.0, "score_greedy_high": 112.0}
    seeds = replicates(0.0, 0.5, 1.0)  # gains of 10.5, 11, 11.5
    low, high = main_points.ends_of_score(scores, seeds, replicates(-0.5))
    half = 100 * 4.30265 * 0.5 / 3**0.5 / 10  # by t of two degrees of freedom
    assert (low, high) == pytest.approx((110 - half, 110 + half), abs=1e-3)


def test_methods_that_are_not_told_apart_from_the_best_are_named(results, monkeypatch):
    monkeypatch.setattr(main_points, "is_above", lambda one, other: SCORES[one[0]] > SCORES[other[0]] + 40)
    assert "not told apart from PPO Gated. Its" in " ".join(main_points.in_words(results).split())


def replicates(*shifts):
    """Trainings that gain so much more than 1, 2, .., 20 on as many sites."""
    sites = pd.DataFrame({"seed": range(20), "scalarized_return": np.arange(1.0, 21.0)})
    return [
        SimpleNamespace(by_policy={"greedy": sites.assign(scalarized_return=sites.scalarized_return + shift)})
        for shift in shifts
    ]


def test_a_method_is_above_or_below_another_by_all_of_its_interval_on_the_same_sites():
    fixed = replicates(0.0)
    ours = replicates(0.15, 0.2, 0.25)
    assert main_points.is_above(ours, fixed) and main_points.is_below(
        fixed * 2, ours
    )  # sites differ by more, and cancel
    assert not main_points.is_above(replicates(-0.1, 0.5, 0.8), fixed)
    assert not main_points.is_above(replicates(0.5), fixed)  # a single training
    assert main_points.points(ours, fixed, replicates(-0.5)).startswith("2.0 [1.")  # of a mean of 10


def test_few_seeds_do_not_say_whether_the_preference_is_followed(results):
    rows = {key: found[:2] for key, found in results.rows_of_two_objectives().items() if key[0] != "ppo_gated"}
    words = " ".join(main_points.in_words(SimpleNamespace(rows_of_two_objectives=lambda: rows)).split())
    assert (
        "110.0 [105.0, 115.0] with 2 training seeds" in words and "Not run yet: PPO Gated and Curriculum PPO." in words
    )
    assert words.endswith("Whether a method follows the preference is said from 5 training seeds on.")


def test_without_runs_nothing_is_said(results):
    assert main_points.in_words(SimpleNamespace(rows_of_two_objectives=dict)) == (
        "Not run yet: `python analysis/reproduce.py --only main balanced`.\n"
    )


def test_intervals_are_left_out_where_there_are_none():
    assert main_points.shown({"score_greedy": 99.6}) == "99.6"
    assert main_points.shown({"score_greedy": float("nan")}) == ""


def test_scores_near_100_have_a_decimal():
    assert score_text(101.2, 99.6, 101.9) == "101.2 [99.6, 101.9]"
    assert score_text(100.0) == "100.0" and score_text(98.2, 96.0, 100.0) == "98.2 [96.0, 100.0]"
    assert score_text(94.4) == "94" and score_text(70.2, 60.0, 94.9) == "70 [60, 95]"
    assert main_points.named([], "store") == "none stores"


def test_plans_that_were_chosen_on_their_sites_are_flattered():
    """Two plans that are the better one on half of the sites each: which is chosen says nothing of the other sites."""
    sites = np.arange(40)
    lucky = np.where(sites % 2, 1.0, 3.0)
    plans = pd.concat(
        pd.DataFrame({"action": action, "seed": sites, "carbon_return": returns, "thaw_return": returns})
        for action, returns in ((12, 0.0 * sites), (20, lucky), (24, lucky[::-1]))
    )
    results = SimpleNamespace(constant_plans_in=lambda *conditions: plans)
    assert 2.0 < main_points.flattery(results, WORLD) < 20.0
    plans.loc[plans.action == 20, ["carbon_return", "thaw_return"]] = 5.0  # better on every site
    assert main_points.flattery(results, WORLD) == pytest.approx(0.0, abs=1e-9)


def test_below_is_all_of_the_interval_and_t_counts_too():
    assert not main_points.is_below(replicates(-0.1, 0.5, 0.8), replicates(0.0))
    assert not main_points.is_above(replicates(0.05, 0.2, 0.35), replicates(0.0))


def test_the_front_of_plans_is_of_gains():
    plans = pd.DataFrame({"action": [12, 24], "seed": 1, "carbon_return": [5.0, 6.0], "thaw_return": [5.0, 7.0]})
    results = SimpleNamespace(constant_plans_in=lambda *_: plans)
    assert main_points.front_of_plans(results, WORLD) == pytest.approx(2)
