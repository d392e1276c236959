"""The course of a training: when the policy is played, on what, and what a run says of it."""

import numpy as np
import pandas as pd
import pytest
from scripts import run_script

from cleanrl_style import protocol
from cleanrl_style.protocol import course, sites
from cleanrl_style.protocol.progress import Progress

TASK = protocol.Task.of("boreal-generalist-v0", years=3)


def make(task=TASK, steps=1000, episodes=2, done=0):
    return course.Course(task, steps, episodes, done)


def constant(action):
    return lambda observations, masks, accrued_returns: np.eye(25)[np.full(len(observations), action)]


def test_it_is_played_at_its_shares_and_at_the_end():
    one, due = make(), []
    for step in range(20, 981, 20):
        if one.reach(step, last=step == 980):
            due.append(step)
    assert due == [60, 100, 200, 400, 700, 980]
    resumed = make(done=200)
    assert not resumed.reach(380, False) and resumed.reach(420, False)


def test_its_episodes_are_no_test_s_and_its_weights_spread():
    one = make(episodes=200)
    assert one.seeds == list(sites.published_seeds("validation")[:10])
    assert not set(one.seeds) & set(sites.published_seeds("test"))
    assert one.weights.tolist() == [[0, 1], [0.5, 0.5], [1, 0]]
    fixed = make(TASK.with_preference(0.3), episodes=200)
    assert fixed.weights.tolist() == [[0.3, 0.7]] and len(fixed.seeds) == course.STANDS
    assert len(make(protocol.Task.of("boreal-site-specific-v0"), episodes=200).seeds) == 1


def test_constant_plans_gain_there_what_they_gain():
    one = make()
    nothing = one.play(constant(12))
    assert tuple(nothing.columns) == one.columns[1:]
    np.testing.assert_allclose(nothing[course.gain_columns(TASK.objectives)], 0, atol=1e-5)
    assert one.score(nothing) == pytest.approx(0, abs=1)  # returns of plans are kept to six digits
    pd.testing.assert_frame_equal(one.play(constant(22)), one.marks["plus_100"], atol=1e-4, check_dtype=False)
    assert (one.marks["best"].scalarized_gain >= one.marks["plus_100"].scalarized_gain).all()


def test_a_short_training_has_none(tmp_path):
    assert make(steps=300_000, episodes=200).fits and not make(steps=100, episodes=200).fits
    fifty_years = protocol.Task.of("boreal-generalist-v0")
    trial = make(fifty_years, steps=32_000, episodes=20)
    assert trial.fits and trial.shares == course.FEW_SHARES
    assert make(fifty_years, steps=22_500, episodes=20).fits and not make(fifty_years, steps=22_499, episodes=20).fits
    run_script(
        "cleanrl_style/ppo_gated.py",
        *("--vectorization", "lockstep", "--num-envs", 4, "--rollout-steps", 200, "--total-timesteps", 200),
        *("--eval-episodes", 1, "--eval-weights", 0, 1, "--update-epochs", 1, "--run-dir", tmp_path),
    )
    assert (tmp_path / "summary.png").exists() and not (tmp_path / "validation.csv").exists()


def test_a_run_writes_draws_and_says_it(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(course, "LONGEST", np.inf)
    run_script(
        "cleanrl_style/ppo_gated.py",
        *("--vectorization", "lockstep", "--num-envs", 4, "--rollout-steps", 200, "--total-timesteps", 400),
        *("--eval-episodes", 1, "--eval-weights", 0, 1, "--update-epochs", 1, "--run-dir", tmp_path),
    )
    table, out = pd.read_csv(tmp_path / "validation.csv"), capsys.readouterr().out
    assert table.global_step.tolist() == [200] * 3 + [400] * 3 and table.preference.tolist() == [0, 0.5, 1] * 2
    expected = table.preference * table.carbon_gain + (1 - table.preference) * table.thaw_gain
    np.testing.assert_allclose(table.scalarized_gain, expected, atol=1e-5)
    assert "on 1 validation site after 50, 100 % of the training" in out
    assert "min left with evaluation, score" in out
    timing = pd.read_csv(tmp_path / "timing.csv")
    assert (timing.phase == "validation").sum() == 2


def test_the_time_left_has_what_comes_afterwards(capsys):
    progress = Progress("training", 10, "steps", then=lambda rate: 600.0)
    progress.show(10)
    assert "10.0 min left with evaluation" in capsys.readouterr().out
