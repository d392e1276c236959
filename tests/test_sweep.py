"""A sweep's runs, their table, and what of it a job array does."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from scripts import ROOT
from tiny_runs import write_run

from analysis import commands, sweep

SCRIPT = ROOT / "cleanrl_style" / "ppo_group.py"


def args(folder, seeds="1-2", grid=("learning_rate=1e-4,3e-4",), script=SCRIPT, **changes):
    return sweep.Args(script, seeds, tuple(grid), "none", runs_dir=folder, output=folder / "sweep.csv", **changes)


@pytest.fixture(autouse=True)
def small_evaluations(monkeypatch):
    """What `write_run` writes has fewer episodes and weights than the scripts' own evaluation."""
    theirs = sweep.arguments_there

    def without(one):
        return {name: value for name, value in theirs(one).items() if not name.startswith("eval_")}

    monkeypatch.setattr(sweep, "arguments_there", without)


def finish(runs, shift=0.0):
    """Runs as if they had been trained; those of the larger learning rate are better by 1 on test sites, and worse on
    those of the validation."""
    for run in runs:
        better = float(run.settings.get("learning_rate") == "3e-4")
        returns = (better + 0.1 * run.seed + shift,) * 3
        write_run(run.folder, "ppo_group", seed=run.seed, carbon=returns, thaw=returns)
        config = run.folder / "config.json"
        there = json.loads(config.read_text())
        there["arguments"] |= {name: value for name, value in run.config.items() if name != "script"}
        config.write_text(json.dumps(there))
        gains = {"global_step": (1, 2, 2), "preference": (0.0, 0.0, 1.0), "scalarized_gain": (9.0, 1.0, 3.0 - better)}
        pd.DataFrame(gains).to_csv(run.folder / "validation.csv", index=False)


def test_every_combination_a_seed_of_all_before_the_next(tmp_path):
    runs = sweep.all_runs(
        args(tmp_path, "1-2,7", ["learning-rate=1e-4,3e-4", "gae_lambda=0.9 1,0.8", "hide_site=True"])
    )
    assert len(runs) == 12 and [run.seed for run in runs] == [1] * 4 + [2] * 4 + [7] * 4
    assert runs[0].settings == {"learning_rate": "1e-4", "gae_lambda": "0.9 1", "hide_site": "True"}
    words = " ".join(runs[0].command.words[1:])
    assert words.startswith("--seed 1 --learning-rate 1e-4 --gae-lambda 0.9 1 --hide-site --run-dir ")
    assert runs[1].settings["gae_lambda"] == "0.8"
    name = "boreal-generalist-v0-hide_site=True-learning_rate=0.0001-gae_lambda=0.9,1"
    assert runs[0].folder == tmp_path / "ppo_group" / name / "seed1"
    assert runs[0].command.steps == 300_000


def test_a_sweep_over_the_one_preference_of_a_script(tmp_path):
    script = ROOT / "cleanrl_style" / "eupg_fixed_lambda.py"
    names = [run.folder.parent.name for run in sweep.all_runs(args(tmp_path, "1", ["preference=0.2,0.5"], script))]
    assert names == ["boreal-generalist-v0-preference=0.2", "boreal-generalist-v0"]


def test_finished_runs_are_skipped_and_a_table_made(tmp_path, capsys, monkeypatch):
    runs = sweep.all_runs(args(tmp_path))
    finish(runs[:-1])
    started = []
    monkeypatch.setattr(
        commands, "run_all", lambda words, *rest, **more: started.extend(words) or finish(runs[-1:]) or []
    )
    monkeypatch.setattr(sweep.protocol, "compile_physics", lambda lanes: None)
    sweep.main(args(tmp_path))
    assert started == [runs[-1].command]
    table = pd.read_csv(tmp_path / "sweep.csv")
    assert list(table) == [
        *("learning_rate", "seed", "validation_gain"),
        *("scalarized_return", "carbon_return", "thaw_return"),
    ]
    assert table.carbon_return.round(6).tolist() == [0.1, 1.1, 0.2, 1.2]
    best, worst = capsys.readouterr().out.splitlines()[-3:-1]
    assert best.split()[:2] == ["1e-4", "2"] and worst.split()[:2] == ["3e-4", "2"]  # chosen on validation sites
    assert table.validation_gain.tolist() == [2.0, 1.5, 2.0, 1.5]


def test_a_finished_run_of_other_arguments_is_not_taken_for_ours(tmp_path):
    finish(runs := sweep.all_runs(args(tmp_path)))
    config = json.loads((runs[0].folder / "config.json").read_text())
    config["arguments"]["gamma"] = 0.5
    (runs[0].folder / "config.json").write_text(json.dumps(config))
    with pytest.raises(SystemExit, match=r"holds a run with other arguments: gamma 0.5 there, 1.0 now"):
        sweep.main(args(tmp_path))
    (runs[0].folder / "config.json").write_text("{}")
    with pytest.raises(SystemExit, match=r"config.json is damaged"):
        sweep.main(args(tmp_path))


def test_a_damaged_table_is_named_with_its_folder(tmp_path):
    finish(runs := sweep.all_runs(args(tmp_path)))
    evaluation = runs[1].folder / "evaluation.csv"
    evaluation.write_bytes(evaluation.read_bytes()[:300])
    with pytest.raises(SystemExit, match=f"{runs[1].folder}: damaged: evaluation.csv does not end"):
        sweep.main(args(tmp_path))


def test_trainings_too_short_for_validation_are_not_ranked(tmp_path, capsys):
    runs = sweep.all_runs(args(tmp_path))
    finish(runs)
    (runs[0].folder / "validation.csv").unlink()
    sweep.main(args(tmp_path))
    names, *rows = capsys.readouterr().out.splitlines()[-4:-1]
    assert "validation_gain" not in names and [row.split()[0] for row in rows] == ["1e-4", "3e-4"]


def test_parts_are_all_runs_once(tmp_path, capsys):
    runs = sweep.all_runs(args(tmp_path))
    parts = [sweep.part_of(runs, f"{k}/3") for k in (1, 2, 3)]
    assert sorted((run for part in parts for run in part), key=runs.index) == runs
    finish(parts[0])
    sweep.main(args(tmp_path, part="1/3"))
    assert "2 runs of other parts are not finished" in capsys.readouterr().out
    assert not (tmp_path / "sweep.csv").exists()


def test_a_slurm_array_is_its_parts(tmp_path):
    """With `python` a script that prints what it is asked to do."""
    fake = tmp_path / "python"
    fake.write_text('#!/bin/sh\necho "$@"\n')
    fake.chmod(0o755)

    def answer(first, last, number):
        array = dict(ID=4, MIN=first, MAX=last, COUNT=number)
        array = {f"SLURM_ARRAY_TASK_{name}": str(value) for name, value in array.items()}
        array |= {"SLURM_SUBMIT_DIR": str(tmp_path), "PATH": f"{tmp_path}:{os.environ['PATH']}"}
        words = [shutil.which("bash"), ROOT / "analysis" / "slurm_array.sh", "a script.py", "--seeds", "1-10"]
        return subprocess.run(words, env={**os.environ, **array}, capture_output=True, text=True)

    assert answer(2, 11, 10).stdout == (
        "analysis/sweep.py --workers 1 a script.py --seeds 1-10 --address none --part 3/10\n"
    )
    with_gaps = answer(4, 7, 2)
    assert with_gaps.returncode == 1 and with_gaps.stderr.startswith("error: --array without gaps is allowed")


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"seeds": "1-"}, "--seeds 1-: numbers and ranges are allowed"),
        ({"seeds": "1,1-2"}, "each once"),
        ({"grid": ["learning=1"]}, "unknown flag 'learning'; allowed: env_id"),
        ({"grid": ["seed=1,2"]}, "unknown flag 'seed'"),
        ({"grid": ["learning_rate"]}, "flag=value"),
        ({"grid": ["learning_rate=fast"]}, "fast"),
        ({"grid": ["learning_rate=1e-4 --seed 9"]}, "values are allowed, no other flag such as --seed"),
        ({"seeds": "\N{ARABIC-INDIC DIGIT ONE}-3"}, "numbers and ranges are allowed"),
        ({"grid": ["learning_rate=2"]}, r"--learning-rate must lie in \[1e-12, 1\]"),
        ({"seeds": "1-999999999"}, "--seeds 1-999999999: at most 999999 is allowed"),
        ({"script": ROOT / "README.md"}, "README.md: no script there, a file that ends in .py"),
        ({"grid": ["learning_rate=1e-4,0.0001"]}, "two of its combinations are the same run"),
        ({"part": "4/3"}, "--part 4/3"),
        ({"grid": ["env_id=./pond.py:pond-v0"]}, "--env-id ./pond.py:pond-v0: a module is allowed"),
    ],
)
def test_bad_arguments(changes, message, tmp_path):
    with pytest.raises(SystemExit, match=message):
        sweep.main(args(tmp_path, **changes))


def test_a_script_whose_import_is_missing_is_named(tmp_path):
    script = tmp_path / "own.py"
    script.write_text("import nowhere_to_be_found\n")
    with pytest.raises(SystemExit, match=f"^error: script {script}: No module named 'nowhere_to_be_found'$"):
        sweep.main(args(tmp_path, script=script))


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"address": "foo"}, "--address 'foo': none, local, auto, HOST:PORT and ray://HOST:PORT are allowed"),
        ({"address": ""}, "--address '': none"),
        ({"runs_dir": SCRIPT}, "--runs-dir .*: cannot write there"),
        ({"output": ROOT}, "--output .*: the name of a file is allowed"),
    ],
)
def test_commands_that_cannot_run_are_not_listed(changes, message, tmp_path, capsys):
    with pytest.raises(SystemExit, match=f"^error: {message}"):
        sweep.main(replace(args(tmp_path, list=True), **changes))
    assert capsys.readouterr().out == ""


def test_one_command_trains_all(tmp_path, monkeypatch):
    """The whole thing, of the toy."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(ROOT / "tests")]))
    words = [
        "ppo_gated.py",
        "--seeds",
        "1",
        "--address",
        "none",
        "--runs-dir",
        tmp_path,
        "--output",
        tmp_path / "t.csv",
    ]
    words[0] = str(SCRIPT.with_name("ppo_gated.py"))
    words += ["--grid", "env_id=toy_env:toy-v0", "total_timesteps=200", "num_envs=2", "rollout_steps=100"]
    words += ["eval_episodes=1", "eval_weights=0 1"]
    command = [sys.executable, ROOT / "analysis" / "sweep.py", *words]
    out = subprocess.run(list(map(str, command)), capture_output=True, text=True, cwd=tmp_path, check=True).stdout
    assert "1 runs, 0 of them finished; the others by processes of this machine" in out
    assert pd.read_csv(tmp_path / "t.csv").seed.tolist() == [1]
    assert len(list(Path(tmp_path).glob("logs/*.log"))) == 1
