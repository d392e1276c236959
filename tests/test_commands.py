"""Scripts run to their end: in order, one a core, again when they are killed, but not longer than who started them."""

import os
import signal
import subprocess
import sys
import time

import pytest
from scripts import ROOT

from analysis import commands
from analysis.commands import Command

FAKE = """
import os, pathlib, signal, sys, time
name, what = sys.argv[1:3]
marks = pathlib.Path(__file__).parent
starts = marks / f"{name} starts"
starts.write_text(starts.read_text() + "." if starts.exists() else ".")
print("training 40/100 steps", flush=True)
if what == "fails":
    sys.exit("error: this one fails")
if what == "waits":
    time.sleep(60)
if what == "is killed twice" and len(starts.read_text()) < 3:
    os.kill(os.getpid(), signal.SIGKILL)
if what == "is slow":
    time.sleep(0.5)
if what == "reads a":
    assert (marks / "a done").exists()
(marks / f"{name} done").write_text(str(len(os.sched_getaffinity(0))) if hasattr(os, "sched_getaffinity") else "")
"""


@pytest.fixture
def fake(tmp_path):
    """A command of a script that fails, waits or ends, and leaves a file when it has ended."""
    script = tmp_path / "fake.py"
    script.write_text(FAKE)

    def command(name, what="ends", waits=False):
        return Command((str(script), name, what), tmp_path / "logs" / f"{name}.log", 100, waits, ROOT)

    return command, tmp_path


def test_a_failed_command_is_named_and_the_rest_goes_on(fake, capsys):
    command, folder = fake
    failed = commands.run_all([command("a"), command("b", "fails"), command("c")], 4, workers=2)
    out = capsys.readouterr().out
    assert [one.words[1] for one in failed] == ["b"]
    assert "FAILED: python" in out and "fake.py b fails" in out and "error: this one fails" in out
    assert "3/4 runs, 1 failed, 300 of 300 steps" in out
    assert all((folder / f"{name} done").exists() for name in "ac")


def test_what_is_killed_is_started_again(fake):
    command, folder = fake
    assert commands.run_all([command("a", "is killed twice")], 1, workers=2) == []
    assert (folder / "a starts").read_text() == "..." and (folder / "a done").exists()


def test_the_log_of_an_earlier_start_stays(fake):
    command, folder = fake
    for what in ("fails", "ends"):
        commands.run_all([command("a", what)], 1, workers=2)
    assert "error: this one fails" in (folder / "logs" / "a.log").read_text()


def test_one_that_waits_starts_when_those_before_it_have_ended(fake):
    command, folder = fake
    assert commands.run_all([command("a", "is slow"), command("b", "reads a", waits=True)], 2, workers=2) == []
    assert (folder / "b done").exists()


def test_a_command_has_a_core_of_its_own():
    with commands.own_core() as first, commands.own_core() as second:
        assert first is None or first != second
    if hasattr(os, "sched_getaffinity"):
        assert {first, second} <= {*os.sched_getaffinity(0), None}


def test_stopping_ends_what_is_under_way(fake, monkeypatch):
    command, folder = fake
    line = commands.Report.line

    def interrupted(report):
        if (folder / "logs" / "a.log").exists() and report.left[0].steps_done() == 40:
            os.kill(os.getpid(), signal.SIGINT)
        return line(report)

    monkeypatch.setattr(commands.Report, "line", interrupted)
    monkeypatch.setattr(commands, "REPORT_SECONDS", 0.05)
    with pytest.raises(KeyboardInterrupt):
        commands.run_all([command("a", "waits")], 1, workers=2)
    assert not commands._UNDER_WAY and not (folder / "a done").exists()
    assert (folder / "a starts").read_text() == "."


def test_a_script_ends_with_its_parent(fake):
    command, folder = fake
    call = f"run_once({str(ROOT)!r}, Path({str(folder / 'log')!r}), {command('a', 'waits').words!r}, None)"
    code = f"from pathlib import Path\nfrom analysis.commands import run_once\n{call}"
    parent = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)})
    for _ in range(200):
        if (folder / "a starts").exists():
            break
        time.sleep(0.05)
    script = subprocess.run(["pgrep", "-f", f"{folder}/fake.py a waits"], capture_output=True, text=True).stdout.split()
    assert script
    parent.kill()
    parent.wait()
    for _ in range(100):
        if not any(os.path.exists(f"/proc/{pid}") for pid in script):
            return
        time.sleep(0.05)
    pytest.fail("the script outlives who started it")


@pytest.mark.parametrize("given", [[], ["--nonsense"], ["any", "nowhere.py"], ["first", __file__]])
def test_a_tied_script_is_asked_for_in_one_line(given):
    said = subprocess.run([sys.executable, "-m", "analysis.tied", *given], capture_output=True, text=True, cwd=ROOT)
    got = " ".join(given) or "nothing"
    wanted = f"CORE SCRIPT ARGUMENTS are allowed, a core's number or any and a Python file, got {got}"
    assert said.returncode == 1 and said.stderr == f"error: {wanted}\n"
