"""What a return is worth: the weighted sum or Chebyshev's, in training, in the evaluation and in the score."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scripts import run_script
from test_score import PLANS, WEIGHTS, evaluation

from cleanrl_style import protocol
from cleanrl_style.eupg_var_lambda import compute_utilities
from cleanrl_style.protocol import arguments, score
from cleanrl_style.protocol.utility import LINEAR, SCALARIZATIONS, Chebyshev, Utility

IDEAL = Chebyshev((4.0, 2.0))
RETURNS = np.random.default_rng(0).normal(0, 3, (20, 2))


def test_chebyshev_is_the_largest_weighted_shortfall():
    assert IDEAL(np.array([3.0, 1.0]), np.array([0.25, 0.75])) == -0.75
    assert IDEAL(np.array([0.0, 1.9]), np.array([0.25, 0.75])) == -1.0
    assert IDEAL(np.array([5.0, -9.0]), np.array([1.0, 0.0])) == 1.0  # an objective of weight 0 does not count
    assert {"linear": type(LINEAR), "chebyshev": type(IDEAL)} == SCALARIZATIONS


class Soft(Utility):
    """A smooth least return."""

    def __call__(self, returns, weights):
        return -np.log((weights * np.exp(-returns)).sum(axis=-1))


def test_a_utility_of_ones_own_is_what_training_and_score_are_of(monkeypatch):
    monkeypatch.setitem(SCALARIZATIONS, "soft", Soft)
    given = {"env_id": "boreal-balanced-v0", "mode": None, "site_seed": None, "thaw_formulation": None}
    args = SimpleNamespace(**given, eval_weights=None, eval_episodes=2, scalarization="soft")
    assert isinstance(arguments.make_task(args).utility, Soft)
    args.reward_scales = (2.0, 1.0)
    with pytest.raises(SystemExit, match="--reward-scales: --scalarization soft is of rewards as they are: 1 each"):
        arguments.make_task(args)
    args.scalarization = "softer"
    with pytest.raises(SystemExit, match="--scalarization softer: allowed are linear, chebyshev, soft"):
        arguments.make_task(args)


@pytest.mark.parametrize("utility", [LINEAR, IDEAL, Soft()])
def test_yearly_gains_sum_to_the_utility_of_the_whole(utility):
    weights = np.array([0.3, 0.7])
    before = np.vstack([np.zeros(2), np.cumsum(RETURNS, axis=0)[:-1]])
    gains = utility.gain(before, RETURNS, weights)
    assert gains.sum() == pytest.approx(utility(RETURNS.sum(axis=0), weights) - utility(np.zeros(2), weights))


def test_chebyshev_finds_what_no_weighted_sum_does():
    """A front whose middle lies below the line between its ends: the weighted sum never takes it."""
    front, all_weights = np.array([[4.0, 0.0], [1.7, 1.7], [0.0, 4.0]]), np.linspace(0, 1, 101)
    weights = np.stack([all_weights, 1 - all_weights], axis=1)
    found = {
        utility.title: set(np.array([utility(front, one).argmax() for one in weights]))
        for utility in (LINEAR, Chebyshev((4.0, 4.0)))
    }
    assert found == {LINEAR.title: {0, 2}, Chebyshev.title: {0, 1, 2}}


def test_the_score_is_in_the_evaluation_s_own_utility():
    ideal = Chebyshev((4.0, 6.0))
    worth = {
        plan: [ideal(score.returns_of(rows), one).mean() for one in WEIGHTS] for plan, rows in PLANS.groupby("plan")
    }
    table = evaluation("greedy", (1, 1, 1), (2, 2, 2))
    table["scalarized_return"] = ideal(score.returns_of(table), score.weights_of(table))
    comparison = score.Comparison(table, PLANS, ideal)
    constant = [plan for plan in worth if plan.isdigit()]
    for k, plan in enumerate(comparison.best_plans):
        assert worth[plan][k] == max(worth[one][k] for one in constant)
    best = np.max([worth[plan] for plan in constant], axis=0)
    ours = table.groupby("preference").scalarized_return.mean()
    expected = 100 * (ours - worth["12"]).mean() / (best - worth["12"]).mean()
    assert comparison.score("greedy") == pytest.approx(expected)


def test_eupg_s_utility_is_of_the_whole_return_and_its_baseline_at_its_own_preference():
    rewards, weights = RETURNS[:12].reshape(3, 4, 2), np.array([[0.1, 0.9], [0.4, 0.6], [0.6, 0.4], [1.0, 0.0]])
    returns = rewards.sum(axis=0)
    plain = compute_utilities(rewards, weights, 1.0, "total", utility=IDEAL)
    np.testing.assert_allclose(plain, np.tile([IDEAL(r, w) for r, w in zip(returns, weights, strict=True)], (3, 1)))
    less = compute_utilities(rewards, weights, 1.0, "total", "others", IDEAL)
    others = [np.mean([IDEAL(returns[j], weights[i]) for j in range(4) if j != i]) for i in range(4)]
    np.testing.assert_allclose(less, plain - others)


def test_the_ideal_point_is_of_the_best_constant_plans(monkeypatch):
    monkeypatch.setattr(arguments, "reference_returns", lambda task, seeds: PLANS)
    task = protocol.Task.of("boreal-generalist-v0")
    assert arguments.ideal_point(task) == (4.0 + 2.0, 4.0 + 4.0)  # the sites' means are 2 and 4
    assert arguments.ideal_point(task, (1, 2)) == (1.0, 2.0)
    for given in ((1.0,), (1.0, np.nan)):
        with pytest.raises(SystemExit, match="--ideal-point: 2 finite numbers, of carbon, thaw"):
            arguments.ideal_point(task, given)


@pytest.mark.parametrize(
    "script, flags, message",
    [
        ("ppo_gated", ("--per-objective-advantages",), "--per-objective-advantages is for --scalarization linear"),
        ("eupg_var_lambda", ("--utility", "future"), "--utility future is for --scalarization linear"),
        ("ppo_curriculum", ("--ideal-point", 1), "--ideal-point: 2 finite numbers"),
    ],
)
def test_where_it_is_not_defined_it_is_refused(tmp_path, script, flags, message):
    given = ("--env-id", "toy_env:toy-v0", "--scalarization", "chebyshev", "--run-dir", tmp_path / "run")
    ideal = () if "--ideal-point" in flags else ("--ideal-point", 10, 10)
    with pytest.raises(SystemExit, match=message):
        run_script(f"cleanrl_style/{script}.py", *given, *ideal, *flags)
    assert not (tmp_path / "run").exists()


def test_an_ideal_point_is_asked_for_where_there_are_no_constant_plans(tmp_path):
    given = ("--env-id", "toy_env:toy-v0", "--run-dir", tmp_path / "run")
    with pytest.raises(SystemExit, match="--ideal-point: a return for each of carbon, thaw is needed"):
        run_script("cleanrl_style/eupg_var_lambda.py", *given, "--scalarization", "chebyshev", "--utility", "total")
    with pytest.raises(SystemExit, match="--ideal-point is for --scalarization chebyshev"):
        run_script("cleanrl_style/eupg_var_lambda.py", *given, "--ideal-point", 10, 10)


@pytest.mark.parametrize("script", ["ppo_gated", "eupg_fixed_lambda"])
def test_a_run_logs_its_own_utility(tmp_path, script):
    rollout = ("--rollout-steps", 20) if script == "ppo_gated" else ("--utility", "total")
    weights = ("--eval-weights", 0, 0.5) if script == "ppo_gated" else ("--preference", 0.3)
    run_script(
        f"cleanrl_style/{script}.py",
        *("--env-id", "toy_env:toy-v0", "--run-dir", tmp_path, "--num-envs", 2, "--total-timesteps", 40),
        *("--scalarization", "chebyshev", "--ideal-point", 10, 8, "--eval-episodes", 2, *rollout, *weights),
    )
    utility = Chebyshev((10.0, 8.0))
    for name in ("episodes", "evaluation"):
        table = pd.read_csv(tmp_path / f"{name}.csv")
        expected = utility(score.returns_of(table), score.weights_of(table))
        np.testing.assert_allclose(table.scalarized_return, expected, atol=1e-6)


def test_a_task_s_rows_have_its_utility():
    task = replace(protocol.Task.of("toy_env:toy-v0"), utility=IDEAL)
    assert task.returns_row(np.array([0.25, 0.75]), np.array([3.0, 1.0]))["scalarized_return"] == -0.75
