import json

import numpy as np
import pandas as pd
import pytest
from scripts import run_script

from analysis import runs
from analysis.outside import common
from cleanrl_style import protocol

TOY_YEARS = 10


@pytest.fixture(scope="module")
def task():
    few = {"density_stems_ha": (30.0, 60.0)}  # too few to be thinned by 100
    return protocol.Task.of("boreal-balanced-v0", years=TOY_YEARS, initial_ranges=few)


def play(env, number=1):
    """Observations and returns of episodes of random actions, all of which were valid."""
    observations, returns = [], []
    for _ in range(number):
        observation, _ = env.reset(seed=7)  # a library's own seed changes nothing
        total, terminated = 0.0, False
        while not terminated:
            action = env.action_space.sample()
            assert env.action_masks()[action]
            observations.append(observation)
            observation, reward, terminated, _, _ = env.step(action)
            total = total + reward
        returns.append(total)
    return np.array(observations), np.array(returns)


def test_a_library_sees_valid_actions_and_no_preference(task):
    env = common.Env(task, [1000])
    observations, _ = play(env)
    assert env.observation_space.shape == (104,) and env.steps == TOY_YEARS
    full = common.Env(task, [1000])
    full.hidden = 0
    seen, _ = full.reset()
    np.testing.assert_array_equal(seen[1:], observations[0])
    masks = common.valid_actions(task, observations)
    assert masks.shape == (TOY_YEARS, 25) and not masks.all() and masks.any(axis=1).all()


def test_episodes_are_the_runs_own(task):
    first, again, other = (play(common.Env(task, [seed]), 2)[1] for seed in (1000, 1000, 2000))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all() and (first[0] != first[1]).all()
    in_turn = common.Env(task, [1998, 1999])
    starts = [in_turn.reset()[0] for _ in range(3)]
    np.testing.assert_array_equal(starts[0], starts[2])
    assert (starts[0] != starts[1]).any()


def test_networks_never_favour_an_invalid_action(task):
    torch = pytest.importorskip("torch")
    observations, _ = play(common.Env(task, [1000]))
    masks = common.valid_actions(task, observations)
    logits, values = torch.nn.Linear(104, 25), torch.nn.Linear(104, 50)
    values = torch.nn.Sequential(values, torch.nn.Unflatten(1, (25, 2)))
    for network, invalid in ((logits, ~masks), (values, np.repeat(~masks[:, :, None], 2, axis=2))):
        common.masked(task, network)
        with torch.no_grad():
            outputs = network(torch.from_numpy(observations)).numpy()
        np.testing.assert_array_equal(outputs == np.float32(common.INVALID), invalid)


QUICK, TIMBER = "quick_env:quick-v0", "timber_env:timber-v0"  # of four years
LIBRARIES = {"maskable_ppo": "sb3_contrib"}
FLAGS = {
    "pcn": ("--num-er-episodes", 2, "--num-step-episodes", 2),
    "morld": ("--learning-starts", 100, "--exchange-every", 40, "--pop-size", 2),
    "gpi_ls": ("--timesteps-per-iter", 80, "--own-episodes", 1),
    "maskable_ppo": ("--num-envs", 2),
}


@pytest.mark.parametrize(
    ("script", "env_id"),
    [("pcn", QUICK), ("gpi_ls", TIMBER), ("envelope", "boreal-four-v0"), ("morld", QUICK), ("maskable_ppo", TIMBER)],
)
def test_a_run_is_as_ours(tmp_path, script, env_id):
    pytest.importorskip(LIBRARIES.get(script, "morl_baselines"))
    corners = {QUICK: (0, 1), TIMBER: (1, 0, 0, 0, 0, 1), "boreal-four-v0": (1, 0, 0, 0)}
    given = ("--env-id", env_id, "--total-timesteps", 160, "--eval-episodes", 2, *FLAGS.get(script, ()))
    weights = ("--eval-weights", *corners[env_id])
    folders = [tmp_path / name for name in (("first", "second") if script in ("pcn", "maskable_ppo") else ("first",))]
    for folder in folders:
        run_script(f"analysis/outside/{script}.py", *given, *weights, "--run-dir", folder)
    run = runs.read_run(folders[0])
    assert run.script == script and run.setting.startswith("eval_episodes=2")
    assert set(run.tables["evaluation"].policy) == {*protocol.POLICIES}
    cost = run.tables["cost"].iloc[0]
    assert 150 <= cost.steps <= 160 and cost.peak_memory_mb > 100
    assert len(pd.read_csv(folders[0] / "episodes.csv")) == cost.steps // (50 if env_id == "boreal-four-v0" else 4)
    assert json.loads((folders[0] / "config.json").read_text())["arguments"]["total_timesteps"] == 160
    for again in folders[1:]:  # of the two that are played twice
        assert (again / "evaluation.csv").read_bytes() == (folders[0] / "evaluation.csv").read_bytes()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("--num-envs", 300), "--num-envs 300: times 5 weights at most 1000 is allowed"),
        (("--n-steps", 15), "--n-steps 15: a multiple of --num-envs 16 is allowed"),
        (("--batch-size", 5000), "--batch-size 5000: at most --n-steps 2048 is allowed"),
        (("--total-timesteps", 79), "--total-timesteps 79: at least 80, a year of every stand for each weight"),
    ],
)
def test_what_does_not_go_together_is_refused_before_a_file_is_written(given, message, tmp_path):
    pytest.importorskip("sb3_contrib")
    with pytest.raises(SystemExit, match=message):
        run_script("analysis/outside/maskable_ppo.py", *given, "--run-dir", tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_the_budget_of_morld_is_of_whole_rounds(tmp_path):
    pytest.importorskip("morl_baselines")
    with pytest.raises(SystemExit, match="--total-timesteps 12000: a multiple of --exchange-every 5000 is allowed"):
        run_script("analysis/outside/morld.py", "--total-timesteps", 12000, "--run-dir", tmp_path / "run")
    assert not (tmp_path / "run").exists()
