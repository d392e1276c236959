import importlib.util
import os
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from scripts import ROOT, run_script

import baselines_heuristic
import boreal_env
from analysis.runs import read_run
from baselines_heuristic import conifer_restoration, plus_100, random_valid, target_density, zero_change
from boreal_env import NO_CHANGE
from cleanrl_style import protocol
from cleanrl_style.protocol import evaluation, provenance, reference

SCRIPTS = ("zero_change", "plus_100", "target_density", "conifer_restoration", "random_valid")


def observe(*densities):
    observations = np.zeros((len(densities), 105), np.float32)
    observations[:, 2] = np.array(densities) / 1500
    return observations


def test_fixed_actions():
    assert zero_change.policy(observe(0, 1500), None).tolist() == [12, 12]
    assert plus_100.policy(observe(0, 1500), None).tolist() == [22, 22]


@pytest.mark.parametrize(
    "density, change",
    [
        (0, 100),
        (900, 100),
        (924, 100),
        (926, 50),
        (974, 50),
        (976, 0),
        (1000, 0),
        (1024, 0),
        (1026, -50),
        (1074, -50),
        (1076, -100),
        (1900, -100),
    ],
)
def test_target_density(density, change):
    index = (-100, -50, 0, 50, 100).index(change)
    assert target_density.policy(observe(density), None).tolist() == [5 * index + 2]
    assert conifer_restoration.policy(observe(density), None).tolist() == [5 * index + 4]


def test_random_is_uniform_over_the_valid_actions():
    masks = np.zeros((2, 25), bool)
    masks[0, :4], masks[1, 12] = True, True
    np.testing.assert_array_equal(random_valid.policy(None, masks), masks / [[4], [1]])


@pytest.mark.parametrize("script", SCRIPTS)
def test_run_folder(script, tmp_path):
    run_script(
        f"baselines_heuristic/{script}.py", "--run-dir", tmp_path, "--eval-episodes", 2, "--eval-weights", 0, 0.25, 1
    )
    names = {"config.json", "evaluation.csv", "evaluation_years.csv", "summary.png", "timing.csv"}
    assert {path.name for path in tmp_path.iterdir()} == names
    episodes = pd.read_csv(tmp_path / "evaluation.csv")
    assert tuple(episodes.columns) == evaluation.evaluation_columns(("carbon", "thaw"))
    assert episodes.groupby(["policy", "preference"]).size().tolist() == [2] * 6
    years = pd.read_csv(tmp_path / "evaluation_years.csv")
    assert years.groupby(["policy", "preference", "year", "variable"]).size().eq(1).all()


def test_no_torch_is_needed(monkeypatch, tmp_path):
    (tmp_path / "torch.py").write_text("raise ModuleNotFoundError('torch is not there', name='torch')")
    script = ROOT / "baselines_heuristic" / "zero_change.py"
    given = ("--eval-episodes", "1", "--eval-weights", "1", "--run-dir", tmp_path / "run")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    subprocess.run([sys.executable, script, *given], check=True, capture_output=True, cwd=ROOT, env=environment)
    assert (tmp_path / "run" / "evaluation.csv").exists()
    there = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "torch" else there(name))
    packages = {"numpy", "numba", "gymnasium", "pandas", "matplotlib", "moocore"}
    assert {*provenance.versions()} == packages | {"python", "processor", "MKL_CBWR", "ATEN_CPU_CAPABILITY"}


def test_one_simulation_stands_for_every_weight(tmp_path):
    run_script(
        "baselines_heuristic/target_density.py", "--run-dir", tmp_path, "--eval-episodes", 2, "--eval-weights", 0, 0.7
    )
    written = pd.read_csv(tmp_path / "evaluation.csv")

    def where_it_can_be_done(observations, masks, returns):
        chosen = target_density.policy(observations, masks)
        return np.eye(25)[np.where(masks[np.arange(len(masks)), chosen], chosen, NO_CHANGE)]

    task = protocol.Task.of("boreal-generalist-v0")
    simulated, _ = protocol.evaluate(task, where_it_can_be_done, (0.0, 0.7), 2)
    pd.testing.assert_frame_equal(written, simulated, rtol=1e-8, check_dtype=False)


def test_planting_every_year_is_the_constant_plan(tmp_path):
    run_script("baselines_heuristic/plus_100.py", "--run-dir", tmp_path, "--eval-episodes", 2, "--eval-weights", 0, 1)
    written = pd.read_csv(tmp_path / "evaluation.csv").drop_duplicates("seed")
    plans = reference.reference_returns(protocol.Task.of("boreal-generalist-v0"), written.seed.tolist())
    plan = plans[plans.plan == reference.PLUS_100].set_index("seed").loc[written.seed]
    np.testing.assert_allclose(written[["carbon_return", "thaw_return"]], plan[["carbon_return", "thaw_return"]], 1e-4)


def test_without_masks_forbidden_actions_are_played_and_penalised(tmp_path):
    """From a full stand on, +100 pays for planting every year."""
    run_script("baselines_heuristic/plus_100.py", "--no-masks", "--run-dir", tmp_path, "--eval-episodes", 2)
    written = pd.read_csv(tmp_path / "evaluation.csv").drop_duplicates("seed")
    task = protocol.Task.of("boreal-generalist-v0")
    envs = task.make_lockstep(2)
    envs.reset(seed=written.seed.tolist())
    returns = np.sum([envs.step(np.full(2, 22))[1] for _ in range(50)], axis=0)
    np.testing.assert_allclose(written[["carbon_return", "thaw_return"]], returns, rtol=1e-5)
    assert (returns[:, 0] < -10).all()


def test_random_actions_have_no_masks_to_leave_out(tmp_path):
    with pytest.raises(SystemExit, match="--no-masks: actions of this strategy are drawn from the valid ones"):
        run_script("baselines_heuristic/random_valid.py", "--no-masks", "--run-dir", tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_users_environments_are_refused(tmp_path):
    with pytest.raises(SystemExit, match="fixed strategies know the boreal environments alone"):
        run_script("baselines_heuristic/zero_change.py", "--env-id", "toy_env:toy-v0", "--run-dir", tmp_path / "run")
    for name, groups in (("unseen-v0", ("state", "age")), ("little-v0", ("preference", "state", "age"))):
        gym.register(name, "boreal_env:BorealEnv", kwargs={"observation_groups": groups})
        with pytest.raises(SystemExit, match="observation_groups must have them"):
            run_script("baselines_heuristic/target_density.py", "--env-id", name, "--run-dir", tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_strategy_that_looks_at_the_preference_is_refused(tmp_path, monkeypatch):
    """Its episodes would be of one preference, and be scored at all."""
    given = ["own.py", "--env-id", "boreal-timber-v0", "--eval-episodes", "2", "--run-dir", str(tmp_path / "run")]
    monkeypatch.setattr(sys, "argv", given)
    with pytest.raises(SystemExit, match="own.py: it looks at the preference, and is played once for all"):
        baselines_heuristic.main("own.py", lambda observations, masks: np.where(observations[:, 0] < 0.1, 24, 20))


def test_what_a_wrapper_may_change_is_refused(tmp_path):
    gym.register("wrapped-v0", lambda **kwargs: gym.wrappers.TransformReward(boreal_env.BorealEnv(**kwargs), abs))
    with pytest.raises(SystemExit, match="--env-id wrapped-v0: a wrapper may change what fixed strategies look at"):
        run_script("baselines_heuristic/zero_change.py", "--env-id", "wrapped-v0", "--run-dir", tmp_path / "run")


@pytest.mark.parametrize("env_id", ["boreal-generalist-v0", "boreal-balanced-v0"])
@pytest.mark.parametrize("script", ["target_density", "conifer_restoration", "random_valid"])
def test_what_a_runs_picture_compares_with_is_what_the_script_gives(script, env_id):
    shipped, _ = reference.read(reference.shipped(env_id))
    run = read_run(ROOT / "results" / "runs" / script / env_id / "seed1")
    archived = run.of_policy("greedy").groupby("seed")[["carbon_return", "thaw_return"]].mean()
    ours = shipped[shipped.plan == script].set_index("seed")[["carbon_return", "thaw_return"]]
    pd.testing.assert_frame_equal(ours.sort_index(), archived.sort_index(), rtol=1e-4, check_dtype=False)
