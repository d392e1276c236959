"""Any number of objectives, all the way: an environment with a third one through every script, tables and resuming."""

import json

import numpy as np
import pandas as pd
import pytest
from resumed import assert_goes_on_to_the_same_bytes
from scripts import run_script

from analysis import make_tables
from cleanrl_style.protocol import fronts, run_folder

SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("ppo_gated", "ppo_curriculum", "eupg_var_lambda")]
OBJECTIVES = ["carbon", "thaw", "timber"]
WEIGHTS = [f"weight_{name}" for name in OBJECTIVES]
RETURNS = [f"{name}_return" for name in OBJECTIVES]


def train(script, folder, *more):
    """A training of two checkpoints on the boreal environment with timber: 64 episodes of four years."""
    rollout = ("--rollout-steps", 128) if "ppo" in script else ()
    fixed = ("--preference", 0.25, 0.25, 0.5) if "fixed" in script else ("--eval-weights", 1, 0, 0, 0, 0.5, 0.5)
    given = ("--env-id", "timber_env:timber-v0", "--vectorization", "lockstep", "--total-timesteps", 256)
    run_script(f"cleanrl_style/{script}.py", *given, *rollout, *fixed, "--run-dir", folder, "--eval-episodes", 2, *more)


@pytest.mark.parametrize("script", [*SLOW, "eupg_fixed_lambda"])
def test_a_third_objective_is_trained_evaluated_resumed_and_tabulated(script, tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder, "CHECKPOINT_STEPS", 128)
    whole = tmp_path / "whole"
    assert_goes_on_to_the_same_bytes(lambda folder: train(script, folder), tmp_path)

    episodes, evaluation = (pd.read_csv(whole / f"{name}.csv") for name in ("episodes", "evaluation"))
    for table in (episodes, evaluation):
        assert fronts.objectives_of(table.columns) == OBJECTIVES
        np.testing.assert_allclose(table[WEIGHTS].sum(axis=1), 1, rtol=1e-6)
        dot = (table[WEIGHTS].to_numpy() * table[RETURNS].to_numpy()).sum(axis=1)
        np.testing.assert_allclose(table.scalarized_return, dot, atol=1e-6)
    assert episodes.timber_return.max() > 0
    config = json.loads((whole / "config.json").read_text())
    given = [[0.25, 0.25, 0.5]] if "fixed" in script else [[1, 0, 0], [0, 0.5, 0.5]]
    assert config["arguments"]["eval_weights"] == given
    assert evaluation[WEIGHTS].drop_duplicates().to_numpy().tolist() == given
    if "fixed" in script:
        assert (episodes[WEIGHTS] == given[0]).all(axis=None)

    make_tables.main(make_tables.Args(runs_dir=(whole,), tables_dir=tmp_path / "tables"))
    assert "timber" in "".join(path.read_text() for path in (tmp_path / "tables").glob("*.csv"))


@pytest.mark.parametrize("script", ["zero_change", "target_density"])
def test_fixed_strategies_are_evaluated_too(script, tmp_path):
    given = ("--env-id", "timber_env:timber-v0", "--eval-episodes", 2, "--run-dir", tmp_path)
    run_script(f"baselines_heuristic/{script}.py", *given)
    evaluation = pd.read_csv(tmp_path / "evaluation.csv")
    assert fronts.objectives_of(evaluation.columns) == OBJECTIVES
    assert len(evaluation[WEIGHTS].drop_duplicates()) == 15
    dot = (evaluation[WEIGHTS].to_numpy() * evaluation[RETURNS].to_numpy()).sum(axis=1)
    np.testing.assert_allclose(evaluation.scalarized_return, dot, atol=1e-6)


@pytest.mark.slow
def test_learning_follows_three_weights(tmp_path):
    """On the toy, whose best mixture for each weight is known."""
    corners = (1, 0, 0, 0, 1, 0, 0, 0, 1)
    given = ("--env-id", "toy_env:toy-three-v0", "--total-timesteps", 12288, "--num-envs", 2, "--learning-rate", 3e-3)
    run_script(
        "cleanrl_style/ppo_gated.py", *given, "--run-dir", tmp_path, "--eval-episodes", 2, "--eval-weights", *corners
    )
    evaluation = pd.read_csv(tmp_path / "evaluation.csv")
    greedy = evaluation[evaluation.policy == "greedy"]
    assert greedy.groupby(["weight_carbon", "weight_thaw"]).scalarized_return.mean().min() > 9


def test_without_weights_a_lattice_is_evaluated(tmp_path):
    run_script(
        "cleanrl_style/eupg_var_lambda.py",
        *("--env-id", "toy_env:toy-three-v0", "--total-timesteps", 80, "--num-envs", 2, "--eval-episodes", 1),
        *("--run-dir", tmp_path),
    )
    evaluation = pd.read_csv(tmp_path / "evaluation.csv")
    weights = evaluation[["weight_carbon", "weight_thaw", "weight_variety"]].drop_duplicates().to_numpy()
    assert weights.shape == (15, 3)
    np.testing.assert_allclose(weights.sum(axis=1), 1)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("--eval-weights", 0, 1), "--eval-weights: 3 numbers a weight, not 2 in all"),
        (("--eval-weights", 0.5, 0.5, 0.5), "--eval-weights: a weight for each of 3 objectives"),
    ],
)
def test_weights_off_the_simplex_are_refused(arguments, message, tmp_path):
    with pytest.raises(SystemExit, match=message):
        run_script(
            "cleanrl_style/ppo_gated.py", "--env-id", "toy_env:toy-three-v0", "--run-dir", tmp_path / "r", *arguments
        )
    assert not (tmp_path / "r").exists()
