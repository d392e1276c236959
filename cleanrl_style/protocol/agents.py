"""Trained policies to hold: loaded from a run's folder, from a policy file, or by the name of one that ships."""

import importlib
import importlib.util
import json
import os
import pickle
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
from gymnasium.spaces import Box, Discrete

from cleanrl_style.flags import flat, policy_file
from cleanrl_style.protocol.arguments import make_task
from cleanrl_style.protocol.evaluation import choose_actions
from cleanrl_style.protocol.files import load_whole
from cleanrl_style.protocol.task import Task


@dataclass(frozen=True)
class Policy:
    """A trained policy: `act` gives its actions. Called, it gives their probabilities, as evaluations want them."""

    name: str
    script: str  # that trained it, with these arguments
    arguments: dict
    probabilities: Callable  # of observations (n, d), masks (n, 25), accrued returns (n, m): probabilities (n, 25)
    size: int  # d, entries of the observation
    looks_back: bool  # whether it needs the returns accrued so far, as EUPG does
    source: tuple  # what it is loaded from: its file, and the script's, or None

    def __reduce__(self):
        """Pickled as what it is loaded from: a spawned process loads it again."""
        return _load_again, (self.name, *self.source)

    def __call__(self, observations, masks, accrued_returns):
        """Probabilities (n, 25) for observations (n, d), masks (n, 25) and accrued returns (n, m)."""
        self._check_returns(accrued_returns)
        return self.probabilities(observations, masks, accrued_returns)

    def act(self, observation, mask, accrued_returns=None, generator: np.random.Generator | None = None):
        """The most probable action of an observation (d,) as an int, or of several (n, d) as an array (n,).

        mask : valid actions, bool, `env.unwrapped.action_masks()`. accrued_returns : (m,) or (n, m), the rewards of the
        episode so far, which EUPG's policies look at. generator : draws the action instead.
        """
        if np.asarray(mask).dtype != bool and not np.isin(mask, (0, 1)).all():
            raise ValueError(f"{self.name}: masks of true and false are allowed, env.unwrapped.action_masks()")
        observations, masks = np.atleast_2d(np.asarray(observation, np.float32)), np.atleast_2d(np.asarray(mask, bool))
        if observations.shape[1] != self.size or masks.shape != (len(observations), 25):
            raise ValueError(
                f"{self.name}: observations (n, {self.size}) and masks (n, 25) are allowed, got "
                f"{observations.shape} and {masks.shape}"
            )
        if not np.isfinite(observations).all():
            raise ValueError(f"{self.name}: an observation is not finite")
        if not masks.any(axis=1).all():
            raise ValueError(f"{self.name}: a mask has no valid action")
        self._check_returns(accrued_returns)
        accrued = np.zeros((len(masks), 0)) if accrued_returns is None else np.atleast_2d(accrued_returns)
        wanted = (len(masks), _objectives(self.arguments))
        if self.looks_back and accrued.shape != wanted:
            raise ValueError(f"{self.name}: accrued_returns {wanted} are allowed, got {accrued.shape}")
        if self.looks_back and not (accrued.dtype.kind in "biuf" and np.isfinite(accrued).all()):
            raise ValueError(f"{self.name}: accrued_returns are not finite numbers")
        if generator is not None and not isinstance(generator, np.random.Generator):
            raise ValueError(f"generator: a numpy.random.Generator is allowed, got {type(generator).__name__}")
        uniforms = None if generator is None else generator.random(len(masks))
        actions = choose_actions(self.probabilities(observations, masks, accrued), uniforms)
        return int(actions[0]) if np.ndim(observation) == 1 else actions

    def _check_returns(self, accrued_returns) -> None:
        if accrued_returns is None and self.looks_back:
            raise ValueError(f"{self.name} looks at the returns accrued so far: give accrued_returns")

    @property
    def env_id(self) -> str:
        """The environment that it was trained on."""
        return self.arguments["env_id"]

    def task(self) -> Task:
        """That environment with the arguments of its training; `task().make()` is one. ValueError if it is not here."""
        arguments = SimpleNamespace(**{**self.arguments, "scalarization": "linear", "ideal_point": None})
        try:
            task = make_task(arguments, hide_site=self.arguments.get("hide_site", False))
        except SystemExit as end:  # as a script ends; this is none
            raise ValueError(f"{self.name}: {str(end).removeprefix('error: ')}") from end
        preference = self.arguments.get("preference")
        if preference is None or not task.boreal:
            return task
        return replace(task, env_kwargs={**task.env_kwargs, "fixed_preference": preference})


def load_policy(run_or_name, script=None) -> Policy:
    """A trained policy.

    run_or_name : a run's folder, a policy file (its policy.pt), or the name of a policy that ships. script : path of
    the script that trained it, if that does not lie in cleanrl_style/. Raises FileNotFoundError if there is no such
    policy, or not the script, and ValueError if the script's network is another one by now.
    """
    path = policy_file(run_or_name)
    if not isinstance(script, (str, os.PathLike, type(None))) or script == "":
        raise ValueError(f"script {script!r}: the path of one is allowed")
    try:
        import torch
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError('load_policy needs torch: pip install -e ".[train]"', name="torch") from error

    try:
        saved = load_whole(path, weights_only=True)
        run = saved["run"]
        _check_run(saved, run)
    except (
        pickle.UnpicklingError,
        EOFError,
        RuntimeError,
        AttributeError,
        LookupError,
        TypeError,
        ValueError,
    ) as error:
        raise ValueError(f"{path}: no policy that a script of this project has written") from error
    except (OSError, zipfile.BadZipFile) as error:
        what = "cut short, or no policy that a script of this project has written"
        raise ValueError(f"{path}: {what} ({error})") from error
    module = _script_module(run["script"], script or own_script(path.parent))
    envs = spaces_alone(saved["observation_shape"])
    lacking = [part for part in ("Agent", "make_policy") if not hasattr(module, part)]
    if lacking:
        raise ValueError(f"{module.__file__}: it has no {' and no '.join(lacking)}, so it trained no policy")
    try:
        with torch.random.fork_rng(devices=[]):  # its first weights are drawn and thrown away
            agent = module.Agent(envs, **saved["arguments"])
        # a policy that ships is without its critic, which chooses nothing
        critic = {name: value for name, value in agent.state_dict().items() if name.startswith("critic.")}
        agent.load_state_dict({**critic, **saved["agent"]})
        agent.eval()
    except (RuntimeError, TypeError, AttributeError, NameError) as error:
        trained_it = f"another version of {run['script']}.py than {module.__file__} trained it"
        raise ValueError(f"{path}: {trained_it}, of another network or with other arguments of Agent") from error
    if not all(weights.isfinite().all() for weights in agent.state_dict().values()):
        raise ValueError(f"{path}: a weight of its network is not finite, so its training went wrong")
    probabilities, (size,) = module.make_policy(agent), envs.single_observation_space.shape
    # a policy that looks at accrued returns answers with NaN to returns that are NaN
    unknown = np.full((1, _objectives(run["arguments"])), np.nan)
    looks_back = bool(np.isnan(probabilities(np.zeros((1, size), np.float32), np.ones((1, 25), bool), unknown)).any())
    source = str(path.absolute()), None if script is None else str(Path(script).absolute())
    return Policy(str(run_or_name), run["script"], run["arguments"], probabilities, size, looks_back, source)


def spaces_alone(observation_shape) -> SimpleNamespace:
    """What an Agent is made with in place of environments: their spaces."""
    space = Box(-np.inf, np.inf, tuple(observation_shape), np.float32)
    return SimpleNamespace(single_observation_space=space, single_action_space=Discrete(25))


def own_script(folder: Path) -> Path | None:
    """Where the script lies that made a run, by the run's config.json, if it lies there and not in cleanrl_style/."""
    try:
        named = json.loads((folder / "config.json").read_text(encoding="utf-8")).get("file")
    except (OSError, ValueError, AttributeError):
        return None
    if not isinstance(named, str):
        return None
    path = Path(__file__).parents[2] / named  # an absolute one stays what it is
    return path if path.is_file() and path.parent != Path(__file__).parents[1] else None  # those there are imported


def _load_again(name: str, file: str, script: str | None) -> Policy:
    """A pickled policy."""
    return replace(load_policy(file, script), name=name)


def _check_run(saved: dict, run: dict) -> None:
    """Raise an error, whichever, where what a script writes with a policy is lacking or of another kind."""
    (size,), weights = saved["observation_shape"], run["arguments"].get("eval_weights", [0.0])
    if not isinstance(saved["agent"], dict) or not isinstance(saved["arguments"], dict) or size < 1:
        raise TypeError("no policy")
    if not isinstance(run["script"], str) or not isinstance(run["arguments"]["env_id"], str) or not len(weights):
        raise TypeError("no run")
    if not all(0 <= weight <= 1 for weight in flat(run["arguments"].get("preference"))):
        raise ValueError("no preference")


def _objectives(arguments: dict) -> int:
    """Number of objectives, from the evaluation's weights: of two each is a number."""
    first = arguments.get("eval_weights", [0.0])[0]
    return np.size(first) if np.ndim(first) else 2


def _script_module(name: str, path) -> ModuleType:
    """The script as a module."""
    if path is None:
        # a dot in its name would be taken for a package's
        if "." in name or importlib.util.find_spec(f"cleanrl_style.{name}") is None:
            raise FileNotFoundError(
                f"no cleanrl_style/{name}.py to import; script=path of load_policy, or --script of watch and "
                "score_policy, names another"
            )
        return importlib.import_module(f"cleanrl_style.{name}")
    return load_script(name, path)


def load_script(name: str, path) -> ModuleType:
    """The Python file as the module of that name. Raises FileNotFoundError or, if it cannot be imported, ValueError."""
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or not Path(path).exists():
        raise FileNotFoundError(f"script {path}: no Python file")
    module = sys.modules[name] = importlib.util.module_from_spec(spec)  # where texts of its annotations are looked up
    folder, before = str(Path(path).parent.absolute()), {*sys.modules}
    sys.path.insert(0, folder)  # as python has it, for what lies beside the script
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise ValueError(f"script {error.filename}, line {error.lineno}: {error.msg}") from error
    except ImportError as error:
        raise ValueError(f"script {path}: {error}") from error
    finally:
        sys.path.remove(folder)
        _forget_neighbours(folder, before)
    return module


def _forget_neighbours(folder: str, before: set[str]) -> None:
    """Forget what a script imported from beside it alone: another's helper of the same name is another module."""
    for name in {name.partition(".")[0] for name in {*sys.modules} - before}:
        file = getattr(sys.modules.get(name), "__file__", None)
        if file is None or name in before or not Path(file).is_relative_to(folder):
            continue
        parts = {part: sys.modules.pop(part) for part in [*sys.modules] if part == name or part.startswith(f"{name}.")}
        elsewhere = importlib.util.find_spec(name)
        if elsewhere is not None and elsewhere.origin == file:
            sys.modules.update(parts)
