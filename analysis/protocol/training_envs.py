"""The environments that a script trains on: made, saved, restored, and ended with nothing left behind."""

import os
import signal
import sys
import traceback
from functools import partial

import gymnasium as gym

from analysis.protocol.evaluation import MODES


class InWorker(gym.Wrapper):
    """An environment in a process of its own, which can be given a preference and a state to continue from.

    An error ends the process, after its traceback: passing it on through gymnasium would lose the traceback, or
    hang if the error cannot be pickled.
    """

    def __init__(self, env: gym.Env, index: int, preference: float | None = None):
        super().__init__(env)
        self.index, self.preference = index, preference

    def reset(self, *, seed=None, options=None):
        """As the environment's; with the fixed preference, if there is one."""
        if self.preference is not None:
            options = {**(options or {}), "preference": self.preference}
        return self._or_end(self.env.reset, seed=seed, options=options)

    def step(self, action):
        """As the environment's."""
        return self._or_end(self.env.step, action)

    def get_state(self):
        """The environment's own get_state(), None if it has none."""
        return self.unwrapped.get_state() if hasattr(self.unwrapped, "get_state") else None

    def set_states(self, states) -> None:
        """Continue from this environment's state among those of all."""
        self._or_end(self.unwrapped.set_state, states[self.index])

    def _or_end(self, function, *args, **kwargs):
        try:
            return function(*args, **kwargs)
        except Exception:
            print(f"error in environment {self.index}:\n{traceback.format_exc()}", file=sys.stderr, flush=True)
            os._exit(1)


def make_env(env_id: str, index: int, preference: float | None, env_kwargs: dict) -> gym.Env:
    """One environment of an AsyncVectorEnv."""
    return InWorker(gym.make(env_id, disable_env_checker=True, **env_kwargs), index, preference)


def make_training_envs(args, env_kwargs: dict) -> gym.vector.VectorEnv:
    """args.num_envs environments, each in a process or all in lockstep; episodes restart within the step."""
    if args.vectorization == "lockstep":
        return gym.make_vec(args.env_id, num_envs=args.num_envs, **env_kwargs)
    # boreal environments are told their preference by env_kwargs
    preference = None if args.env_id in MODES else getattr(args, "preference", None)
    make = [partial(make_env, args.env_id, i, preference, env_kwargs) for i in range(args.num_envs)]
    # Ctrl-C reaches all processes of a terminal: the workers leave it to the main one, which then ends them
    handlers = {number: signal.signal(number, handler)
                for number, handler in ((signal.SIGINT, signal.SIG_IGN), (signal.SIGTERM, signal.SIG_DFL))}
    try:
        return gym.vector.AsyncVectorEnv(make, autoreset_mode=gym.vector.AutoresetMode.SAME_STEP)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def get_states(envs: gym.vector.VectorEnv):
    """State of every environment, generators included; None if the environment offers none."""
    if not isinstance(envs, gym.vector.AsyncVectorEnv):
        return envs.get_state() if hasattr(envs, "get_state") else None
    states = envs.call("get_state")
    return None if None in states else states


def set_states(envs: gym.vector.VectorEnv, states) -> None:
    """Continue from `get_states`."""
    if isinstance(envs, gym.vector.AsyncVectorEnv):
        envs.call("set_states", states)
    else:
        envs.set_state(states)


def end(envs: gym.vector.VectorEnv) -> list[str]:
    """End the environments' processes, whatever they are doing; says which had already ended, and how."""
    if not isinstance(envs, gym.vector.AsyncVectorEnv) or envs.closed:
        return []
    dead = []
    for i, process in enumerate(envs.processes):
        process.join(timeout=0.1 if not dead else 0)
        if process.exitcode is not None:
            cause = f"signal {-process.exitcode}" if process.exitcode < 0 else "its error above"
            dead.append(f"environment {i} was ended by {cause}")
        process.kill()
        process.join()
    envs.closed = True  # its own close() would wait for answers of the processes
    return dead
