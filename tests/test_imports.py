"""The house: analysis reads what runs leave and nothing needs it; no two files import each other; lazy libraries."""

import ast
import os
import subprocess
import sys

import pytest
from gymnasium.error import DependencyNotInstalled
from scripts import ROOT

from boreal_env import BorealEnv

PACKAGES = ("sim", "cleanrl_style", "baselines_heuristic", "analysis")
FILES = sorted([ROOT / "boreal_env.py", *(path for name in PACKAGES for path in (ROOT / name).rglob("*.py"))])


def module_name(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in FILES}


def imported(path):
    """Modules of ours that a file imports, wherever in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= names & MODULES.keys() or {node.module}
    return found & MODULES.keys() - {module_name(path)}


GRAPH = {name: imported(path) for name, path in MODULES.items()}


def reachable(name, seen=()):
    """All that a module imports, and what that imports."""
    found, waiting = set(), [name]
    while waiting:
        for other in GRAPH[waiting.pop()] - found:
            found.add(other)
            waiting.append(other)
    return found


def test_nothing_but_analysis_imports_analysis():
    users = {name for name, targets in GRAPH.items() if any(target.split(".")[0] == "analysis" for target in targets)}
    assert {name.split(".")[0] for name in users} == {"analysis"}


def test_no_two_files_import_each_other():
    circles = [name for name in GRAPH if name in reachable(name)]
    assert circles == []


def test_the_simulator_knows_neither_task_nor_training():
    simulator = {
        name for name in GRAPH if name.split(".")[0] == "sim" and name.split(".")[1:2] not in (["task"], ["region"])
    }
    assert len(simulator) > 20
    assert all(reachable(name) <= simulator for name in simulator)


def test_what_is_slow_or_an_extra_is_imported_when_it_is_needed():
    code = "import sys, boreal_env, cleanrl_style.protocol, baselines_heuristic; print(*sys.modules)"
    names = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert not {"matplotlib", "mo_gymnasium", "moocore", "scipy.stats", "torch", "tyro"} & set(names.split())


def test_what_the_extra_train_installs_is_enough_for_tables():
    modules = ", ".join(f"analysis.{name}" for name in ("make_tables", "make_figures", "reproduce", "score_policy"))
    block = "import sys; sys.modules.update(dict.fromkeys(('pymoo', 'panel', 'ray', 'xarray', 'zarr')))"
    subprocess.run([sys.executable, "-c", f"{block}; import {modules}"], check=True, cwd=ROOT)


def test_a_picture_without_its_library_is_refused(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(DependencyNotInstalled, match='^render_mode "rgb_array": pip install matplotlib$'):
        BorealEnv(render_mode="rgb_array")


@pytest.mark.parametrize("name", ["sim/__init__.py", "sim.py"])
def test_another_sim_is_named(tmp_path, name):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.touch()
    command, environment = [sys.executable, "-c", "import boreal_env"], {**os.environ, "PYTHONPATH": str(ROOT)}
    said = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment).stderr.splitlines()
    assert said[-1].startswith("ImportError: boreal_env needs the package `sim` beside it, but Python found ")
    assert str(tmp_path / "sim") in said[-1]
