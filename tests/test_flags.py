"""What a script says at once: of a bad flag, of a missing package, of a terminal that cannot take its output."""

import importlib.util
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from scripts import ROOT, run_script

from analysis.outside import arguments
from baselines_heuristic import Args
from cleanrl_style import flags
from cleanrl_style.protocol.sites import published_seeds

SCRIPTS = sorted(path.stem for path in (ROOT / "cleanrl_style").glob("*.py") if "\nclass Agent" in path.read_text())
OUTSIDE = sorted(path.stem for path in (ROOT / "analysis" / "outside").glob("*.py") if "parse(" in path.read_text())


def python(*arguments, **options):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "", **options.pop("env", {})}
    return subprocess.Popen(
        [sys.executable, *map(str, arguments)], stderr=subprocess.PIPE, text=True, env=environment, **options
    )


@pytest.mark.parametrize("script", SCRIPTS)
def test_a_bad_flag_is_answered_before_anything_slow_is_loaded(script):
    _, err = python("-X", "importtime", ROOT / "cleanrl_style" / f"{script}.py", "--sed", "3").communicate()
    *loaded, answer = err.splitlines()
    assert answer.startswith("error: Unrecognized options: --sed")
    assert not {"torch", "numba", "pandas", "gymnasium"} & {line.split("|")[-1].strip() for line in loaded}


@pytest.mark.parametrize("script", OUTSIDE)
def test_other_libraries_algorithms_answer_as_soon(script):
    if importlib.util.find_spec(library := "sb3_contrib" if script == "maskable_ppo" else "morl_baselines") is None:
        pytest.skip(f"{library} is not installed")
    _, err = python("-X", "importtime", ROOT / "analysis" / "outside" / f"{script}.py", "--seed", "x").communicate()
    *loaded, answer = err.splitlines()
    assert answer.startswith("error: --seed x: a whole number")
    assert not {"torch", "numba", "pandas", "gymnasium"} & {line.split("|")[-1].strip() for line in loaded}


def test_a_fixed_strategy_answers_as_soon():
    _, err = python("-X", "importtime", ROOT / "baselines_heuristic" / "zero_change.py", "--seed", "x").communicate()
    assert err.splitlines()[-1].startswith("error: --seed x: a whole number")
    assert " numba\n" not in err


@pytest.mark.parametrize(
    "script, package, extra",
    [
        ("cleanrl_style/ppo_gated.py", "torch", "train"),
        ("baselines_heuristic/zero_change.py", "tyro", "train"),
        ("analysis/explore.py", "panel", "explore"),
        ("analysis/outside/maskable_ppo.py", "sb3_contrib", "outside"),
    ],
)
def test_a_package_that_is_not_installed_is_named_with_the_command(monkeypatch, script, package, extra):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(SystemExit, match=rf"^error: not installed: {package}; .*pip install -e \"\.\[{extra}\]\"$"):
        run_script(script)


@pytest.mark.parametrize(
    "given, message",
    [
        (["--run-dir", ""], "--run-dir '': a value is allowed, not an empty text"),
        (
            ["--env-id", "boreal-v9"],
            "--env-id boreal-v9: Environment `boreal` doesn't exist.*allowed: boreal-generalist.*",
        ),
        (["--env-id", "boreal-balanced"], "--env-id boreal-balanced: give the version, boreal-balanced-v0"),
        (["--seed", "-1"], r"--seed must lie in \[0, 999999\], not -1"),
        (["--eval-weights", "0", "2"], r"--eval-weights must lie in \[0, 1\], not 2.0"),
        (["--learning-rate", "nan"], r"--learning-rate must lie in \[1e-12, 1\], not nan"),
        (["--reward-scales"], "--reward-scales: at least one value is allowed"),
        (["--mode", "both"], "(.*both.*--mode|.*--mode.*both).*"),
        (["--num-envs", "many"], "--num-envs many: a whole number is allowed"),
        (["--total-timesteps", "3e5"], "--total-timesteps 3e5: a whole number is allowed"),
        (["--gamma", "x"], "--gamma x: a number is allowed"),
        (["--eval-weights", "0", "x"], "--eval-weights 0 x: numbers are allowed"),
        (
            ["--total-timestep", "5", "--lerning-rate", "1"],
            r"Unrecognized options: .*; did you mean --learning-rate, --total-timesteps\?",
        ),
        (
            ["--hide-site", "True"],
            "Unrecognized options: True; --hide-site takes no value, --no-hide-site is its opposite",
        ),
        (
            ["--no-hide-site", "True"],
            "Unrecognized options: True; --no-hide-site takes no value, --hide-site is its .*",
        ),
        (["--seed=1", "extra"], "Unrecognized options: extra; --help lists all"),
        (["--total-timesteps", "1", "--hide-site", "1"], "Unrecognized options: 1; --help lists all"),
        (["--lr", "0.1"], "Unrecognized options: --lr, 0.1; --help lists all"),
        (["--eval-episodes", "201"], "--eval-episodes 201: at most 200 are allowed, as many as there are test sites"),
        (
            ["--eval-episodes", "201", "--env-id", "boreal-balanced-v0"],
            "--eval-episodes 201: at most 200 are allowed, .*",
        ),
        (["--seed"], ".*--seed.*"),
        (
            ["--env-id", "boreal-balanced-v0", "--mode", "site-specific"],
            "--mode site-specific contradicts --env-id boreal-balanced-v0, which is generalist",
        ),
        (["--reward-scales", "1"], r"--reward-scales: 2 numbers, of carbon, thaw, are allowed, not \[1.0\]"),
        (["--reward-scales", "0", "0"], "--reward-scales: not all of them 0, which leaves nothing to learn"),
        (["--env-id", "boreal-timber-v0", "--eval-weights", "0.5"], "--eval-weights: 3 numbers a weight, not 1 in all"),
        (
            ["--run-dir", f"{__file__}/run"],
            rf"--run-dir {__file__}/run: cannot write there \(not a folder: {__file__}\)",
        ),
        (["--mode", "x"], "--mode x: generalist, site-specific are allowed"),
        (["--run-dir=~/run"], r"--run-dir=~/run: the shell left the ~ as it is; \$HOME is understood everywhere"),
    ],
)
def test_a_bad_value_is_named(given, message):
    with pytest.raises(SystemExit, match=f"^error: {message}$"):
        run_script("cleanrl_style/ppo_gated.py", *given)


@pytest.mark.parametrize("given", [["--reward-scales", "1"], ["--run-dir", __file__], ["--env-id", "boreal-v9"]])
def test_a_value_that_does_not_go_with_the_environment_is_answered_before_torch_is_loaded(given):
    _, err = python("-X", "importtime", ROOT / "cleanrl_style" / "ppo_gated.py", *given).communicate()
    *loaded, answer = err.splitlines()
    assert answer.startswith(f"error: {given[0]}")
    assert "torch" not in {line.split("|")[-1].strip() for line in loaded}


def test_one_site_has_as_many_episodes_as_are_asked_for(monkeypatch):
    assert len(published_seeds("test")) == flags.TEST_SITES
    for given in (["--site-seed", "3"], ["--mode", "site-specific"], ["--env-id", "boreal-site-specific-v0"]):
        monkeypatch.setattr(sys, "argv", ["script", "--eval-episodes", "201", *given])
        assert flags.parse(Args).eval_episodes == 201


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_any_encoding_will_do(encoding):
    script = "from cleanrl_style.flags import prepare_output; prepare_output(); print('kgC m⁻²')"
    process = python("-c", script, stdout=subprocess.PIPE, env={"PYTHONIOENCODING": encoding}, encoding=encoding)
    assert process.communicate() == ("kgC m??\n" if encoding == "ascii" else "kgC m?²\n", "")
    path = ROOT / "cleanrl_style" / "ppo_gated.py"
    _, err = python(path, "--sed", "3", env={"PYTHONIOENCODING": encoding}).communicate()
    assert err.startswith("error: Unrecognized options: --sed") and err.count("\n") == 1


LINES = "from cleanrl_style.flags import prepare_output; prepare_output()\nfor i in range({}): print(i)"


@pytest.mark.parametrize(
    "lines, code, said", [(10, 0, ""), (100_000, 1, "stopped: nobody reads the output any more\n")]
)
def test_a_closed_pipe_is_a_line_at_most(lines, code, said):
    process = python("-c", LINES.format(lines), stdout=subprocess.PIPE)
    process.stdout.close()
    assert (process.stderr.read(), process.wait()) == (said, code)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_is_a_line():
    with open("/dev/full", "w") as full:
        process = python("-c", LINES.format(100_000), stdout=full)
    assert (process.stderr.read(), process.wait()) == ("error: [Errno 28] No space left on device\n", 1)


def test_ctrl_c_is_a_line(capsys):
    flags.end_quietly(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert capsys.readouterr().err == "\ninterrupted\n"


def test_a_script_without_a_terminal_works(monkeypatch):
    @dataclass
    class Args:
        """Nothing."""

        seed: int = 1

    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "argv", ["script.py", "--seed", "2"])
    assert flags.parse(Args).seed == 2


@pytest.mark.parametrize("script", SCRIPTS)
def test_the_trial_that_help_shows_can_be_made(monkeypatch, script):
    module = importlib.import_module(f"cleanrl_style.{script}")
    monkeypatch.setattr(sys, "argv", [f"cleanrl_style/{script}.py"])
    (words,) = re.findall(rf"python cleanrl_style/{script}.py (--.*)", flags.describe(module.Args))
    monkeypatch.setattr(sys, "argv", [f"cleanrl_style/{script}.py", *words.split()])
    args = flags.parse(module.Args)
    assert args.vectorization == "lockstep" and args.eval_episodes == 20
    generation = getattr(args, "population", 0) * 8 * 50  # of the search, eight episodes a candidate
    assert args.total_timesteps >= generation


def test_what_help_says_of_another_librarys_algorithm():
    text = flags.describe(arguments.Args)
    assert "lockstep" not in text and "starts over" in text and "updates.csv" not in text
