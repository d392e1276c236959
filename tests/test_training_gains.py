import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from tiny_runs import TINY_RUNS

import boreal_env
from analysis import experiments, runs
from analysis.studies import training_gains
from cleanrl_style import protocol

YEARS = boreal_env.DEFAULT_YEARS


def test_the_episodes_are_those_of_the_training():
    """Round 2 of a training whose first round was played otherwise."""
    envs = gym.make_vec("boreal-generalist-v0", num_envs=2)
    envs.reset(seed=[3 * protocol.MAX_ENVS, 3 * protocol.MAX_ENVS + 1])
    for _ in range(YEARS):
        envs.step(np.array([24, 2]))
    returns = sum(envs.step(np.full(2, boreal_env.NO_CHANGE))[1].astype(float) for _ in range(YEARS))
    table = training_gains.play(num_envs=2, seed=3, steps=2 * YEARS * 2 + 99, every=2)
    assert table[["env", "global_step"]].to_numpy().tolist() == [[0, 4 * YEARS], [1, 4 * YEARS]]
    np.testing.assert_array_equal(table[["carbon_return", "thaw_return"]], returns)


def test_gains_are_differences_on_the_same_episode():
    run = runs.read_run(TINY_RUNS / "curriculum")
    stream = {name: run.arguments[name] for name in training_gains.STREAM}
    episodes = run.tables["sample"].iloc[[1, 3]]
    nothing = pd.DataFrame(
        {
            **stream,
            "env": episodes.env,
            "global_step": episodes.global_step,
            "carbon_return": [1.0, 2.0],
            "thaw_return": [0.5, -0.5],
        }
    )
    gains = training_gains.gains(run, nothing)
    assert gains.global_step.tolist() == episodes.global_step.tolist()
    np.testing.assert_allclose(gains.carbon_gain, episodes.carbon_return.to_numpy() - [1.0, 2.0])
    np.testing.assert_allclose(gains.thaw_gain, episodes.thaw_return.to_numpy() - [0.5, -0.5])
    weight = episodes.preference.to_numpy()
    np.testing.assert_allclose(gains.scalarized_gain, weight * gains.carbon_gain + (1 - weight) * gains.thaw_gain)
    assert training_gains.gains(run, nothing.assign(seed=99)) is None


def test_without_runs_it_names_a_command(tmp_path, monkeypatch):
    found = training_gains.results.Results((tmp_path,), experiments.jobs(), tmp_path)
    monkeypatch.setattr(training_gains.results.Results, "load", staticmethod(lambda quick: found))
    with pytest.raises(SystemExit, match="no finished run; python cleanrl_style/eupg_var_lambda.py"):
        training_gains.main(training_gains.Args())


def test_a_stream_that_is_there_is_not_played_again(tmp_path, monkeypatch):
    found = training_gains.results.Results((TINY_RUNS,), experiments.jobs(), tmp_path)
    monkeypatch.setattr(training_gains.results.Results, "load", staticmethod(lambda quick: found))
    played = []

    def play(num_envs, seed, steps, every):
        played.append(seed)
        return pd.DataFrame(
            {
                "num_envs": num_envs,
                "seed": seed,
                "env": [0],
                "global_step": [50],
                "carbon_return": [0.25],
                "thaw_return": [-3.0],
            }
        )

    monkeypatch.setattr(training_gains, "play", play)
    training_gains.main(training_gains.Args())
    first = (tmp_path / "training_gains.csv").read_bytes()
    training_gains.main(training_gains.Args())
    assert len(played) == len(set(played)) > 0
    assert (tmp_path / "training_gains.csv").read_bytes() == first
