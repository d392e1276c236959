"""Several environments in a worker: to a script, workers with one each."""

import copy
import os
import pickle
import signal

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from playing import QUICK, assert_same

import boreal_env
from cleanrl_style import protocol
from cleanrl_style.protocol import training_envs

gym.register("hosted-v0", entry_point="boreal_env:BorealEnv", kwargs={**QUICK, "record_years": True})
gym.register("limited-v0", entry_point="boreal_env:BorealEnv", kwargs=QUICK, max_episode_steps=2)
OWN = boreal_env.Objective("harvest", lambda year: year["harvest_kgc_m2"], 0.0, 20.0)
SETTLED = {"fixed_preference": [0.2, 0.3, 0.5], "objectives": ("carbon", "thaw", OWN), "scenario": "ssp245"}
gym.register("settled-v0", entry_point="boreal_env:BorealEnv", kwargs={**QUICK, **SETTLED})
TASK = protocol.Task.of("hosted-v0")
NUMBER = 8
ACTIONS = np.random.default_rng(1).integers(0, 25, (10, NUMBER))


@pytest.fixture
def make(monkeypatch):
    """Environments in workers of so many cores; None: in a worker each, by gymnasium alone."""
    made = []

    def of_cores(cores, task=TASK):
        if cores is None:
            made.append(AsyncVectorEnv([task.make] * NUMBER, autoreset_mode=AutoresetMode.SAME_STEP))
        else:
            monkeypatch.setattr(training_envs, "available_cores", lambda: cores)
            made.append(training_envs.make_training_envs(task, NUMBER, "async"))
        return made[-1]

    yield of_cores
    for envs in made:
        envs.close()


def assert_same_steps(envs, others, actions=ACTIONS):
    for row in actions:
        for one, other in zip(envs.step(row), others.step(row), strict=True):
            assert_same(one, other)


SPACES = ("single_observation_space", "single_action_space", "observation_space", "action_space")


def seen(envs):
    """Observations, rewards, ends and infos over two episodes, of equal lengths and then of others."""
    trace = [envs.reset(seed=list(range(50, 50 + NUMBER)))[0], envs.call("action_masks")]
    trace += [part for row in ACTIONS for part in envs.step(row)]
    for some in ([1, 6], [7]):
        mask = np.isin(np.arange(NUMBER), some)
        trace.append(envs.reset(seed=9, options={"preference": 0.5, "reset_mask": mask})[0])
        trace += [part for row in ACTIONS[:3] for part in envs.step(row)]
    return [copy.deepcopy(one) for one in (*trace, envs.reset(seed=3)[0], envs.reset()[0])]


@pytest.fixture(scope="module")
def of_a_worker_each():
    """What is seen by gymnasium alone, and the spaces."""
    envs = AsyncVectorEnv([TASK.make] * NUMBER, autoreset_mode=AutoresetMode.SAME_STEP)
    yield seen(envs), [getattr(envs, name) for name in SPACES]
    envs.close()


@pytest.mark.parametrize(("cores", "workers"), [(1, 1), (3, 3), (7, 4), (16, 8)])
def test_a_script_sees_what_it_sees_of_a_worker_each(make, of_a_worker_each, cores, workers):
    envs = make(cores)
    assert len(envs.unwrapped.processes) == workers and envs.num_envs == NUMBER
    assert [getattr(envs, name) for name in SPACES] == of_a_worker_each[1]
    assert envs.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    for one, other in zip(seen(envs), of_a_worker_each[0], strict=True):
        assert_same(one, other)


@pytest.mark.parametrize("env_id", ["hosted-v0", "settled-v0"])
def test_states_are_of_environments_whatever_the_workers(make, env_id):
    """A run goes on where there are more cores, or fewer; whatever arguments its environments have."""
    task = protocol.Task.of(env_id)
    envs, others, resumed, alone = make(3, task), make(None, task), make(2, task), make(NUMBER, task)
    for one in (envs, others):
        one.reset(seed=3)
    assert_same_steps(envs, others, ACTIONS[:2])
    states = training_envs.get_states(envs)
    assert pickle.dumps(states[5]) == pickle.dumps(others.call("get_state")[5])
    assert len(states) == NUMBER
    for others_to_be in (resumed, alone):
        training_envs.set_states(others_to_be, pickle.loads(pickle.dumps(states)))
    for row in ACTIONS:
        expected = others.step(row)
        for one in (resumed, alone):
            for result, other in zip(one.step(row), expected, strict=True):
                assert_same(result, other)


def test_a_wrapped_environment_has_a_worker_for_itself(make):
    assert TASK.bare and not protocol.Task.of("limited-v0").bare
    envs = make(2, protocol.Task.of("limited-v0"))
    envs.reset(seed=1)
    envs.step(ACTIONS[0])
    assert len(envs.processes) == NUMBER and envs.step(ACTIONS[1])[3].all()


def test_an_error_names_the_environments_of_its_worker(make, capfd):
    envs = make(3)
    envs.reset(seed=1)
    with pytest.raises((EOFError, ConnectionError)):
        envs.step(np.full(NUMBER, 12) + 13 * (np.arange(NUMBER) == 4))
    assert training_envs.end(envs) == ["the worker of environments 3 to 5 was ended by its error above"]
    error = capfd.readouterr().err
    assert "error in environments 3 to 5:" in error and "ValueError: action 25" in error


def test_a_killed_worker_is_named(make):
    envs = make(3)
    envs.reset(seed=1)
    os.kill(envs.unwrapped.processes[2].pid, signal.SIGKILL)
    with pytest.raises((EOFError, ConnectionError)):
        envs.step(ACTIONS[0])
    assert training_envs.end(envs) == ["the worker of environments 6 to 7 was ended by signal 9"]
    assert not any(process.is_alive() for process in envs.unwrapped.processes)
