"""The environments that a script trains on: made, saved, restored, and ended with nothing left behind."""

import multiprocessing
import os
import signal
import sys
import time
import traceback
from functools import partial

import gymnasium as gym
import numpy as np
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker

from cleanrl_style.protocol.compilation import compile_physics
from cleanrl_style.protocol.task import Task, as_option
from cleanrl_style.protocol.workers import WorkerEnvs, WorkersVectorEnv, split_among_workers
from sim.block import lanes_for
from sim.stands import available_cores

WATCHING = (OrderEnforcing, PassiveEnvChecker)  # wrappers that only watch the calls


class InWorker(gym.Wrapper):
    """A worker process's environment or environments, which can be given a preference and a state to continue from.

    An error ends the process, after its traceback: passing it on through gymnasium would lose the traceback, or
    hang if the error cannot be pickled. Numbers that are not finite are an error.
    """

    def __init__(self, env: gym.Env, worker: int, indices: range, preference=None):
        super().__init__(env)
        self.worker, self.indices, self.preference = worker, indices, preference

    def reset(self, *, seed=None, options=None):
        """As the environment's; with the fixed preference, if there is one."""
        if self.preference is not None:
            options = {**(options or {}), "preference": self.preference}
        return self._or_end(self._finite, self.env.reset, 1, seed=seed, options=options)

    def step(self, action):
        """As the environment's."""
        return self._or_end(self._finite, self.env.step, 2, action)

    def action_masks(self):
        """As the environment's."""
        return self._or_end(self.env.get_wrapper_attr("action_masks"))

    def get_state(self):
        """The environment's own get_state(); None if it has none, or if a wrapper may have a state beside it."""
        if not hasattr(self.unwrapped, "get_state") or is_wrapped(self.env):
            return None
        return self._or_end(self.unwrapped.get_state)

    def set_states(self, states) -> None:
        """Continue from this worker's state among those of all."""
        self._or_end(self.unwrapped.set_state, states[self.worker])

    @staticmethod
    def _finite(function, number, *args, **kwargs):
        """A call whose first results, observation and reward, must be finite."""
        results = function(*args, **kwargs)
        for name, value in zip(("observation", "reward")[:number], results, strict=False):
            if not np.isfinite(value).all():
                raise FloatingPointError(f"{function.__name__} gave the {name} {value}")
        return results

    def _or_end(self, function, *args, **kwargs):
        try:
            return function(*args, **kwargs)
        except Exception:
            end_process(self.indices)


def is_wrapped(env: gym.Env) -> bool:
    """Whether an environment is in a wrapper that does more than watch the calls."""
    return isinstance(env, gym.Wrapper) and (not isinstance(env, WATCHING) or is_wrapped(env.env))


def name_of(indices: range) -> str:
    """Environment 1, environments 0 to 3."""
    return f"environment {indices[0]}" if len(indices) == 1 else f"environments {indices[0]} to {indices[-1]}"


def end_process(indices: range) -> None:
    """End a worker process, after the traceback of the error that is being handled."""
    print(f"error in {name_of(indices)}:\n{traceback.format_exc()}", file=sys.stderr, flush=True)
    os._exit(1)


def make_env(task: Task, indices_by_worker: list[range], worker: int, env_kwargs: dict) -> gym.Env:
    """The environment of a worker of an AsyncVectorEnv; indices_by_worker : the environments that each worker has."""
    indices = indices_by_worker[worker]
    try:
        option = None if task.preference is None or task.boreal else as_option(task.preference)
        env = task.make(**env_kwargs)
        if task.bare:
            env = WorkerEnvs(env.unwrapped, indices, len(indices_by_worker[0]))
        return InWorker(env, worker, indices, option)
    except Exception:
        if multiprocessing.parent_process() is None:  # AsyncVectorEnv makes one more to look at its spaces
            raise
        end_process(indices)


def make_training_envs(
    task: Task, num_envs: int, vectorization: str, lanes_later=(), **env_kwargs
) -> gym.vector.VectorEnv:
    """Environments, in worker processes ("async") or all in "lockstep"; episodes restart within the step.

    A worker has one environment, or of ours its share of them: no more workers than cores then.
    lanes_later : of kernels that the run needs after its training, compiled meanwhile.
    env_kwargs : arguments of theirs that the evaluation's do not have.
    """
    indices_by_worker = split_among_workers(num_envs, available_cores() if task.bare else num_envs)
    if task.boreal:
        if task.preference is not None:
            env_kwargs["fixed_preference"] = as_option(task.preference)
        shared = [lanes_for(num_envs, available_cores())]
        apart = [lanes_for(len(indices), 1) for indices in indices_by_worker]
        compile_physics(shared if vectorization == "lockstep" else apart, lanes_later)
    if vectorization == "lockstep":
        return task.make_lockstep(num_envs, **env_kwargs)
    make = [partial(make_env, task, indices_by_worker, worker, env_kwargs) for worker in range(len(indices_by_worker))]
    # Ctrl-C reaches all processes of a terminal: the workers leave it to the main one, which then ends them
    handlers = {
        number: signal.signal(number, handler)
        for number, handler in ((signal.SIGINT, signal.SIG_IGN), (signal.SIGTERM, signal.SIG_DFL))
    }
    try:
        if task.bare:
            return WorkersVectorEnv(make, indices_by_worker)
        return gym.vector.AsyncVectorEnv(make, autoreset_mode=gym.vector.AutoresetMode.SAME_STEP)
    except (EOFError, ConnectionError):
        sys.exit("error: an environment could not be made: its error is above")
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def get_states(envs: gym.vector.VectorEnv):
    """State of every environment, generators included; None if the environment offers none."""
    if not isinstance(envs.unwrapped, gym.vector.AsyncVectorEnv):
        return envs.get_state() if hasattr(envs, "get_state") else None
    states = envs.call("get_state")
    return None if any(state is None for state in states) else states


def set_states(envs: gym.vector.VectorEnv, states) -> None:
    """Continue from `get_states`."""
    if isinstance(envs, WorkersVectorEnv):
        envs.set_states(states)
    elif isinstance(envs, gym.vector.AsyncVectorEnv):
        envs.call("set_states", states)
    else:
        envs.set_state(states)


def end(envs: gym.vector.VectorEnv) -> list[str]:
    """End the environments' processes, whatever they are doing; says which had already ended, and how."""
    pool = envs.unwrapped
    if not isinstance(pool, gym.vector.AsyncVectorEnv) or pool.closed:
        return []
    several = isinstance(envs, WorkersVectorEnv)
    of_workers = envs.indices_by_worker if several else split_among_workers(envs.num_envs, envs.num_envs)
    dead, deadline = [], time.monotonic() + 0.1  # of all together: there may be a thousand
    for indices, process in zip(of_workers, pool.processes, strict=True):
        process.join(timeout=0 if dead else max(deadline - time.monotonic(), 0))
        if process.exitcode is not None:
            cause = f"signal {-process.exitcode}" if process.exitcode < 0 else "its error above"
            worker = name_of(indices) if len(indices) == 1 else f"the worker of {name_of(indices)}"
            dead.append(f"{worker} was ended by {cause}")
        process.kill()
        process.join()
    pool.closed = True  # its own close() would wait for answers of the processes
    return dead
