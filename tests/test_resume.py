"""A run that is stopped, by whatever, and started again by the same command."""

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from scripts import ROOT

SCRIPTS = ("ppo_curriculum", "ppo_gated", "eupg_var_lambda", "eupg_fixed_lambda")
TOY = ("--env-id", "resumable_toy:toy-v0", "--total-timesteps", 9000, "--num-envs", 3, "--eval-episodes", 2)
BOREAL = ("--total-timesteps", 5200, "--num-envs", 4, "--eval-episodes", 1, "--vectorization", "lockstep")


def arguments(script, common):
    ppo = ("--rollout-steps", 900 if common is TOY else 800, "--update-epochs", 2) if "ppo" in script else ()
    weights = ("--eval-weights", 0, 1) if script != "eupg_fixed_lambda" else ()
    return (*common, *ppo, *weights)


def start(script, folder, *arguments, **environment):
    """The script in a process group of its own, as from a terminal."""
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, ROOT / "cleanrl_style" / f"{script}.py", "--run-dir", folder, *arguments]
    limit = environment.pop("file_size", None)
    return subprocess.Popen(
        [str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": path, **environment}, start_new_session=True,
        preexec_fn=limit and (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))))


def finish(process, timeout=120):
    """Exit code, standard output and error of a process that ends by itself, and leaves none behind."""
    out, err = process.communicate(timeout=timeout)
    for _ in range(50):
        if not members(process.pid):
            return process.returncode, out, err
        time.sleep(0.1)
    pytest.fail(f"processes {members(process.pid)} outlive the script")


def members(group):
    """Processes of a group that still run."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[2]) == group and fields[0] != "Z":
            found.append(int(path.parent.name))
    return found


def children(process):
    """The worker processes."""
    return sorted(pid for pid in members(process.pid) if pid != process.pid)


def wait_for_rows(process, folder, rows, table="updates.csv"):
    """Wait until a table has that many rows."""
    while process.poll() is None:
        if (folder / table).exists() and (folder / table).read_bytes().count(b"\n") > rows:
            return
        time.sleep(0.005)
    pytest.fail(f"ended before its {rows} rows: {process.communicate()}")


def assert_same_bytes(folder, other):
    """Every file but timing.csv."""
    names = {path.name for path in folder.iterdir()}
    assert names == {path.name for path in other.iterdir()}
    for name in names - {"timing.csv"}:
        assert (folder / name).read_bytes() == (other / name).read_bytes(), name


@pytest.mark.parametrize("script", SCRIPTS)
@pytest.mark.parametrize("common", [TOY, BOREAL], ids=["async", "lockstep"])
def test_killed_and_resumed_is_as_never_killed(script, common, tmp_path):
    given = arguments(script, common)
    whole, killed = (start(script, tmp_path / name, *given) for name in ("whole", "killed"))
    dice = random.Random(script)
    wait_for_rows(killed, tmp_path / "killed", dice.randrange(1, 5))
    time.sleep(0.2 * dice.random())
    os.kill(killed.pid, signal.SIGKILL)
    finish(killed)
    assert not (tmp_path / "killed" / "evaluation.csv").exists()
    timing = (tmp_path / "killed" / "timing.csv").read_bytes()
    had_checkpoint = (tmp_path / "killed" / "checkpoint.pt").exists()
    code, out, err = finish(start(script, tmp_path / "killed", *given))
    assert code == 0, err
    assert ("resuming at step" in out) == had_checkpoint
    assert finish(whole)[0] == 0
    assert_same_bytes(tmp_path / "whole", tmp_path / "killed")
    assert (tmp_path / "killed" / "timing.csv").read_bytes().startswith(timing)
