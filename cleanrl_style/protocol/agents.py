"""Trained agents, loaded again from their run's folder."""

import importlib
import importlib.util
import json
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
from gymnasium.spaces import Box


def load_agent(run_folder, script=None):
    """The policy that a run has trained, as the evaluation plays it.

    run_folder : with config.json and policy.pt. script : path of the script that trained it, if that does not lie in
    cleanrl_style/.
    Returns a function of observations (n, d) float32, masks (n, 25) bool and accrued returns (n, m), all numpy, that
    gives action probabilities (n, 25). Raises FileNotFoundError if one of the files, or the script, is missing, and
    ValueError if the script's network is another one by now.
    """
    import torch

    folder = Path(run_folder)
    for name in ("config.json", "policy.pt"):
        if not (folder / name).exists():
            raise FileNotFoundError(f"{folder} has no {name}: a finished run of a training script has both")
    name = json.loads((folder / "config.json").read_text(encoding="utf-8"))["script"]
    saved = torch.load(folder / "policy.pt", weights_only=True)
    module = _script_module(name, script)
    space = Box(-np.inf, np.inf, tuple(saved["observation_shape"]), np.float32)
    agent = module.Agent(SimpleNamespace(single_observation_space=space), **saved["arguments"])
    try:
        agent.load_state_dict(saved["agent"])
    except RuntimeError as error:
        raise ValueError(
            f"{folder / 'policy.pt'}: another version of {name}.py trained it, of another network"
        ) from error
    return module.make_policy(agent)


def _script_module(name: str, path) -> ModuleType:
    """The script as a module."""
    if path is None:
        if importlib.util.find_spec(f"cleanrl_style.{name}") is None:
            raise FileNotFoundError(f"no cleanrl_style/{name}.py; load_agent(run_folder, script=path) names another")
        return importlib.import_module(f"cleanrl_style.{name}")
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or not Path(path).exists():
        raise FileNotFoundError(f"script {path}: no Python file")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
