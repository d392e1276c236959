"""A run that is stopped, by whatever, and started again by the same command."""

import errno
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import torch
from resumed import assert_same_bytes
from scripts import ROOT, run_script

from cleanrl_style import protocol
from cleanrl_style.protocol import run_folder, training_envs

TOY = ("--env-id", "resumable_toy:resumable-toy-v0", "--total-timesteps", 1500, "--num-envs", 3, "--eval-episodes", 2)
BOREAL_ASYNC = ("--total-timesteps", 1000, "--num-envs", 4, "--eval-episodes", 1)
IMPORT_SECONDS = 3


def arguments(script, common):
    rollout = {TOY: 150, BOREAL_ASYNC: 200}[common]
    ppo = ("--rollout-steps", rollout, "--update-epochs", 2) if "ppo" in script else ()
    weights = ("--eval-weights", 0, 1) if script != "eupg_fixed_lambda" else ()
    return (*common, *ppo, *weights)


def start(script, folder, *arguments, **environment):
    """The script in a process group of its own, as from a terminal, but with checkpoints every 512 steps."""
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    saved = [ROOT / "tests" / "often_saved.py", f"cleanrl_style/{script}.py"]
    command = [sys.executable, *saved, "--run-dir", folder, *arguments]
    limit = environment.pop("file_size", None)
    return subprocess.Popen(
        [str(part) for part in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path, **environment},
        start_new_session=True,
        preexec_fn=limit and (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))),
    )


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


@pytest.mark.parametrize(
    "script, common, moments",
    [
        pytest.param("ppo_curriculum", BOREAL_ASYNC, "checkpoint", marks=pytest.mark.slow),
        ("eupg_fixed_lambda", TOY, "any checkpoint"),
    ],
    ids=["ppo_curriculum-async", "eupg_fixed_lambda-toy"],
)
def test_killed_and_resumed_is_as_never_killed(script, common, moments, tmp_path):
    """Killed at any moment (before anything is written, in training, in the evaluation), and after a checkpoint."""
    given, killed, whole = arguments(script, common), tmp_path / "killed", tmp_path / "whole"
    begun = time.monotonic()
    run_script(f"cleanrl_style/{script}.py", "--run-dir", whole, *given)
    seconds, dice, timing = time.monotonic() - begun, random.SystemRandom(), b""
    for moment in moments.split():
        process = start(script, killed, *given)
        while moment == "checkpoint" and process.poll() is None and not (killed / "checkpoint.pt").exists():
            time.sleep(0.005)
        delay = dice.uniform(0, 0.3 * seconds) if moment == "checkpoint" else dice.uniform(0, seconds + IMPORT_SECONDS)
        time.sleep(delay)
        process.kill()
        finish(process)
        print(f"killed {delay:.2f} s after {moment}, of {seconds:.2f} s: {[path.name for path in killed.glob('*')]}")
        if (killed / "timing.csv").exists():
            earlier, timing = timing, (killed / "timing.csv").read_bytes()
            assert timing.startswith(earlier[: earlier.rfind(b"\n") + 1])
    unfinished = not (killed / "evaluation.csv").exists()
    code, out, err = finish(start(script, killed, *given))
    assert code == 0, err
    if "checkpoint" in moments and unfinished:
        assert "resuming at step" in out
    assert_same_bytes(whole, killed)


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """A run that Ctrl-C stopped, pressed twice, and what it said."""
    folder = tmp_path_factory.mktemp("runs") / "interrupted"
    process = start("ppo_gated", folder, *arguments("ppo_gated", TOY), TOY_SECONDS="0.01")
    while process.poll() is None and not (folder / "checkpoint.pt").exists():
        time.sleep(0.005)
    os.killpg(process.pid, signal.SIGINT)
    time.sleep(0.1)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)
    return folder, *finish(process)


def test_ctrl_c_says_how_to_go_on(interrupted):
    folder, code, _, err = interrupted
    assert code == 130
    assert err.strip().splitlines() == [f"{folder}: interrupted; the same command goes on from step 600"]
    assert (folder / "checkpoint.pt").exists() and not (folder / "evaluation.csv").exists()


@pytest.mark.parametrize(
    "flags, command", [((), "the same command"), (("--overwrite",), "the same command without --overwrite")]
)
def test_before_the_first_checkpoint_a_command_starts_it_again(tmp_path, monkeypatch, capsys, flags, command):
    def interrupt(run, *row):
        raise KeyboardInterrupt

    monkeypatch.setattr(run_folder.Run, "log", interrupt)
    given = ("--run-dir", tmp_path, *flags, *arguments("eupg_var_lambda", TOY))
    with pytest.raises(SystemExit, match="130"):
        run_script("cleanrl_style/eupg_var_lambda.py", *given)
    assert capsys.readouterr().err.strip() == f"{tmp_path}: interrupted; {command} starts it again"


def copy(interrupted, tmp_path):
    """A copy of the interrupted run, to be harmed."""
    return shutil.copytree(interrupted[0], tmp_path / "copy")


def resume(folder):
    """Run on in this process."""
    run_script("cleanrl_style/ppo_gated.py", "--run-dir", folder, *arguments("ppo_gated", TOY))


@pytest.mark.parametrize(
    "harm",
    [
        lambda data: b"",
        lambda data: data[:1000],
        lambda data: data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 1]) + data[len(data) // 2 + 1 :],
        lambda data: data[: (at := data.rindex(b"data.pkl"))] + b"\xff" + data[at + 1 :],
    ],
    ids=["empty", "cut", "one bit", "one bit of a name"],
)
def test_a_damaged_checkpoint_is_refused(interrupted, tmp_path, harm):
    folder = copy(interrupted, tmp_path)
    checkpoint = folder / "checkpoint.pt"
    checkpoint.write_bytes(harm(checkpoint.read_bytes()))
    before = {path: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(SystemExit, match="^error: .*checkpoint.pt is damaged.*--overwrite starts over"):
        resume(folder)
    assert before == {path: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize(
    "state",
    [
        [1],
        {"weights": 1},
        {"script": "ppo_mine"},
        {"script": "ppo_gated", "global_step": 5},
        {"script": "ppo_gated", "global_step": "5", "envs": [], "random_states": (), "table_sizes": {}},
        {"script": "ppo_gated", "global_step": 10**9, "envs": [], "random_states": (), "table_sizes": {}},
        {"script": "ppo_gated", "global_step": 5, "envs": [], "random_states": (), "table_sizes": {}},
    ],
)
def test_a_checkpoint_of_another_program_is_refused(interrupted, tmp_path, state):
    folder = copy(interrupted, tmp_path)
    torch.save(state, folder / "checkpoint.pt")
    with pytest.raises(SystemExit, match="checkpoint.pt is no checkpoint of this version of ppo_gated; --overwrite"):
        resume(folder)


def test_a_table_of_other_columns_is_refused(interrupted, tmp_path):
    folder = copy(interrupted, tmp_path)
    size = torch.load(folder / "checkpoint.pt", weights_only=False)["table_sizes"]["updates"]
    header, *rows = (folder / "updates.csv").read_bytes()[:size].splitlines(keepends=True)
    first, second, *others = header.split(b",")
    (folder / "updates.csv").write_bytes(b"".join([b",".join([second, first, *others]), *rows]))
    with pytest.raises(SystemExit, match="checkpoint.pt is no checkpoint of this version of ppo_gated; --overwrite"):
        resume(folder)


@pytest.mark.parametrize("part", ["agent", "optimizer"])
def test_a_checkpoint_of_another_network_is_refused(interrupted, tmp_path, part):
    folder = copy(interrupted, tmp_path)
    state = torch.load(folder / "checkpoint.pt", weights_only=False)
    state[part].popitem()
    torch.save(state, folder / "checkpoint.pt")
    with pytest.raises(SystemExit, match=f"checkpoint.pt: its {part} does not fit that of this ppo_gated; --overwrite"):
        resume(folder)


def test_a_checkpoint_of_another_environment_is_refused(interrupted, tmp_path, monkeypatch):
    def refuse(envs, states):
        raise ValueError("state of 3 stands given to 4")

    monkeypatch.setattr(training_envs, "set_states", refuse)
    with pytest.raises(SystemExit, match=r"its environments are not those of this ppo_gated \(state of 3 .*; --over"):
        resume(copy(interrupted, tmp_path))


def test_a_table_shorter_than_its_checkpoint_is_refused(interrupted, tmp_path):
    folder = copy(interrupted, tmp_path)
    (folder / "episodes.csv").write_bytes((folder / "episodes.csv").read_bytes()[:200])
    with pytest.raises(SystemExit, match="episodes.csv is shorter than when the checkpoint was written"):
        resume(folder)


def test_a_table_changed_since_its_checkpoint_is_refused(interrupted, tmp_path):
    folder = copy(interrupted, tmp_path)
    size = torch.load(folder / "checkpoint.pt", weights_only=False)["table_sizes"]["episodes"]
    rows = bytearray((folder / "episodes.csv").read_bytes())
    rows[size - 1] = ord("0")  # where a row ended
    (folder / "episodes.csv").write_bytes(rows)
    with pytest.raises(SystemExit, match="episodes.csv is not as it was when the checkpoint was written"):
        resume(folder)


def test_other_versions_are_named_and_a_second_process_is_refused(interrupted, tmp_path, monkeypatch):
    folder = copy(interrupted, tmp_path)
    config = json.loads((folder / "config.json").read_text())
    config["versions"]["numpy"], config["source"] = "1.0", "another"
    (folder / "config.json").write_text(json.dumps(config))
    first = start("ppo_gated", folder, *arguments("ppo_gated", TOY), TOY_SECONDS="0.01")
    wait_for_rows(first, folder, 5)
    written = (folder / "config.json").read_bytes()
    monkeypatch.setattr("cleanrl_style.protocol.run_folder.versions", lambda: {"numpy": "2.0"})
    with pytest.raises(SystemExit, match="another process is at work on this run"):
        resume(folder)
    assert (folder / "config.json").read_bytes() == written
    first.terminate()  # as Ctrl-C, to the main process alone
    code, out, err = finish(first)
    assert code == 130 and "resuming at step 600" in out
    assert "was begun with other code" in err and "numpy 1.0 there" in err and "source another there" in err
    assert "Traceback" not in err
    config = json.loads((folder / "config.json").read_text())
    assert config["begun_with"] == [{"numpy": "1.0", "source": "another"}] and config["source"] != "another"


def test_of_two_processes_that_start_at_once_the_second_leaves_no_configuration(tmp_path):
    hold = "import fcntl; f = open('timing.csv', 'wb'); fcntl.lockf(f, fcntl.LOCK_EX); print(1, flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", hold], cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as first:
        assert first.stdout.readline() == "1\n"
        with pytest.raises(SystemExit, match="another process is at work on this run"):
            resume(tmp_path)
        first.communicate("\n")
    assert [path.name for path in tmp_path.iterdir()] == ["timing.csv"]


def test_where_files_cannot_be_locked_a_run_says_so_and_goes_on(interrupted, tmp_path, monkeypatch, capsys):
    def lockf(file, how):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(run_folder.fcntl, "lockf", lockf)
    resume(copy(interrupted, tmp_path))
    assert "its file system has no locks (No locks available); see that no other process" in capsys.readouterr().err


def test_a_checkpoint_comes_after_the_rows_that_it_needs(interrupted, tmp_path, monkeypatch):
    flushed, folder = [], copy(interrupted, tmp_path)
    replacing, flush = run_folder.replacing, run_folder.Run._flush_tables
    monkeypatch.setattr(run_folder.Run, "_flush_tables", lambda run: (flush(run), flushed.append("tables")))
    monkeypatch.setattr(run_folder, "replacing", lambda path: (flushed.append(path.name), replacing(path))[1])
    resume(folder)
    needs = [k for k, name in enumerate(flushed) if name in ("checkpoint.pt", "evaluation.csv")]
    assert len(needs) >= 2 and all(flushed[k - 1] == "tables" for k in needs)


def test_a_full_disk_leaves_the_old_checkpoint(interrupted, tmp_path):
    folder = copy(interrupted, tmp_path)
    old = (folder / "checkpoint.pt").read_bytes()
    code, out, err = finish(start("ppo_gated", folder, *arguments("ppo_gated", TOY), file_size=len(old) // 2))
    assert code == 1 and "Traceback" not in err
    assert err.strip() == f"error: --run-dir {folder}: cannot write there (File too large)"
    assert (folder / "checkpoint.pt").read_bytes() == old
    assert not list(folder.glob("*.tmp"))


@pytest.mark.parametrize(
    "where, error",
    [
        ("step 3", "FloatingPointError: the ground is 100% gone"),
        ("mask 3", "NoPickle: the mask slipped"),
        ("nan 3", "FloatingPointError: step gave the reward [nan nan]"),
    ],
)
def test_an_error_of_any_call_is_shown_and_ends_the_worker(where, error, monkeypatch, capfd):
    monkeypatch.setenv("TOY_ERROR", where)
    envs = training_envs.make_training_envs(protocol.Task.of("resumable_toy:resumable-toy-v0"), 1, "async")
    envs.reset(seed=1)
    with pytest.raises((EOFError, ConnectionError)):
        for _ in range(4):
            envs.call("action_masks")
            envs.step(np.array([15]))
    assert training_envs.end(envs) == ["environment 0 was ended by its error above"]
    shown = capfd.readouterr().err
    assert error in shown and "error in environment 0" in shown


def test_an_error_in_a_worker_is_shown_and_ends_the_run(interrupted, tmp_path):
    folder = copy(interrupted, tmp_path)
    old = (folder / "checkpoint.pt").read_bytes()
    code, _, err = finish(start("ppo_gated", folder, *arguments("ppo_gated", TOY), TOY_ERROR="step 20"))
    assert code == 1
    assert "FloatingPointError: the ground is 100% gone" in err and "error in environment 0" in err
    last = err.strip().splitlines()[-1]
    assert last.startswith("error: environment 0 was ended by its error above")
    assert last.endswith("the same command goes on from step 600")
    assert (folder / "checkpoint.pt").read_bytes() == old


def test_an_environment_that_cannot_be_made_in_a_worker_ends_the_run(tmp_path):
    code, _, err = finish(start("ppo_gated", tmp_path / "run", *arguments("ppo_gated", TOY), TOY_ERROR="making 1"))
    assert code == 1 and "FloatingPointError: no ground to stand on" in err
    assert err.strip().splitlines()[-1] == "error: an environment could not be made: its error is above"


@pytest.mark.slow
def test_a_killed_worker_ends_the_run(interrupted, tmp_path):
    folder = copy(interrupted, tmp_path)
    process = start("ppo_gated", folder, *arguments("ppo_gated", TOY), TOY_SECONDS="0.01")
    wait_for_rows(process, folder, 5)
    os.kill(children(process)[1], signal.SIGKILL)
    code, _, err = finish(process)
    assert code == 1
    assert err.strip() == "error: environment 1 was ended by signal 9; the same command goes on from step 600"


def test_an_environment_without_a_state_starts_over(tmp_path, capsys):
    command = (
        "cleanrl_style/eupg_var_lambda.py",
        "--env-id",
        "toy_env:toy-v0",
        "--run-dir",
        tmp_path,
        "--num-envs",
        2,
        "--total-timesteps",
        40,
        "--eval-episodes",
        1,
        "--eval-weights",
        0,
        1,
    )
    run_script(*command)
    whole = {path: path.read_bytes() for path in tmp_path.iterdir() if path.name != "timing.csv"}
    (tmp_path / "evaluation.csv").unlink()
    (tmp_path / "episodes.csv").write_bytes(whole[tmp_path / "episodes.csv"][:30])  # interrupted once more, and earlier
    run_script(*command)
    assert "gives no state to go on from: the interrupted run starts over" in capsys.readouterr().out
    assert whole == {path: path.read_bytes() for path in tmp_path.iterdir() if path.name != "timing.csv"}
