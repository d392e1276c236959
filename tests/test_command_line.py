"""`python -m boreal_env`, policies by name, and the commands that ship and score them."""

import contextlib
import json
import pickle
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import gymnasium as gym
import matplotlib
import numpy as np
import pandas as pd
import pytest
from PIL import Image
from scripts import ROOT, run_script

import boreal_env
from analysis import best_plans, choose_sites, draw_readme, reference_returns, score_policy, ship_policies
from cleanrl_style import flags, protocol
from cleanrl_style.protocol import command_line, run_folder

SHORT = (
    *("--env-id", "boreal-site-specific-v0", "--vectorization", "lockstep", "--num-envs", 4, "--update-epochs", 1),
    *("--rollout-steps", 200, "--total-timesteps", 200, "--eval-episodes", 1),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A short run on the fixed site."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    run_script("cleanrl_style/ppo_gated.py", *SHORT, "--run-dir", folder)
    return folder


@pytest.fixture
def shipped(run, tmp_path, monkeypatch):
    """That run's policy, shipped."""
    monkeypatch.setattr(flags, "SHIPPED", tmp_path)
    ship_policies.main(ship_policies.Args((run,), tmp_path))
    return "ppo_gated-site-specific"


def test_the_module_says_what_there_is():
    command = [sys.executable, "-W", "error::UserWarning", "-m", "boreal_env"]
    out = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert all(name in out for name in boreal_env.REGISTERED) and "watch" in out
    assert set(command_line.ENVIRONMENTS) == set(boreal_env.REGISTERED)


def test_a_policy_ships_small_and_is_loaded_by_name(shipped, run, tmp_path):
    path = tmp_path / f"{shipped}.pt"
    assert path.stat().st_size <= ship_policies.LARGEST < (run / "policy.pt").stat().st_size + 50_000
    by_name, by_folder, by_file = (protocol.load_policy(name) for name in (shipped, run, run / "policy.pt"))
    observations = np.random.default_rng(0).random((5, 43), dtype=np.float32)
    masks = np.ones((5, 25), bool)
    for policy in (by_folder, by_file):
        expected = policy.probabilities(observations, masks, np.zeros((5, 2)))
        np.testing.assert_array_equal(by_name.probabilities(observations, masks, np.zeros((5, 2))), expected)
    assert by_name.env_id == "boreal-site-specific-v0" and by_name.task().mode == "site-specific"


def test_a_policy_acts(run):
    policy = protocol.load_policy(run)
    env = policy.task().make()
    observation, _ = env.reset(seed=1)
    mask = env.unwrapped.action_masks()
    action = policy.act(observation, mask)
    assert isinstance(action, int) and mask[action]
    assert policy.act(np.stack([observation] * 3), np.stack([mask] * 3)).tolist() == [action] * 3
    drawn = {policy.act(observation, mask, generator=np.random.default_rng(k)) for k in range(20)}
    assert len(drawn) > 3
    with pytest.raises(ValueError, match=r"observations \(n, 43\) and masks \(n, 25\) are allowed, got \(1, 3\)"):
        policy.act(np.zeros(3), mask)
    with pytest.raises(ValueError, match="an observation is not finite"):
        policy.act(observation * np.nan, mask)
    with pytest.raises(ValueError, match="a mask has no valid action"):
        policy.act(observation, mask & False)


def test_a_policy_is_watched(shipped, tmp_path, capsys, monkeypatch):
    path, make = tmp_path / "years.gif", protocol.Task.make
    monkeypatch.setattr(protocol.Task, "make", lambda task, **kwargs: make(task, years=4, **kwargs))
    command_line.main(["watch", shipped, "--preference", "0.3", "--site-seed", "7", "--out", str(path)])
    with Image.open(path) as animation:
        assert animation.n_frames == 5 and animation.size == command_line.FRAME_SIZE
    out = capsys.readouterr().out
    assert "carbon weight 0.30: return" in out and "doing nothing" in out and ": 4 years" in out


def test_a_folder_without_a_policy_hides_none_that_ships(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ppo_group").mkdir()
    assert flags.policy_file("ppo_group") == flags.shipped_policies()["ppo_group"]


class OnlyFour(gym.Wrapper):
    """Allows action 4 alone."""

    def action_masks(self):
        return np.arange(25) == 4


def test_a_wrappers_masks_are_those_that_count():
    with contextlib.closing(OnlyFour(gym.make("boreal-site-specific-v0", render_mode="rgb_array", years=1))) as env:
        masks = []
        command_line.play(env, lambda seen, mask, returns: masks.append(mask) or 4, 0, np.array([0.5, 0.5]))
    assert [np.flatnonzero(mask).tolist() for mask in masks] == [[4]]


def test_what_shows_other_years_has_another_name(run):
    def name(*given, policy="ppo_group"):
        args = command_line.arguments(["watch", str(policy), *given])
        loaded = protocol.load_policy(policy)
        return command_line.name_of_animation(args, loaded, "pond:pond-v0", np.array(args.preference))

    assert name("--preference", "0.3", "0.7") == "ppo_group-pond-v0-preference0.3-seed0.gif"
    others = ([], ["--seed", "1"], ["--site-seed", "1"], ["--sampled"], ["--site-seed", "1", "--seed", "1"])
    assert len({name("--preference", weight, "0.7", *other) for weight in ("0.3", "0.4") for other in others}) == 10
    assert re.match("ppo_gated-[0-9a-f]{6}-pond-v0-", name("--preference", "0.3", "0.7", policy=run))


def test_a_policy_is_pickled_as_what_it_is_loaded_from(run, monkeypatch):
    policy = protocol.load_policy(run)
    monkeypatch.chdir("/")
    again = pickle.loads(pickle.dumps(policy))
    observations, masks = np.random.default_rng(0).random((5, 43), dtype=np.float32), np.ones((5, 25), bool)
    np.testing.assert_array_equal(again(observations, masks, np.zeros((5, 2))), policy(observations, masks, None))
    assert again.name == policy.name
    with pytest.raises(ValueError, match="generator: a numpy.random.Generator is allowed, got int"):
        policy.act(observations, masks, generator=3)


def test_an_agent_of_one_preference_is_watched_at_its_own(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(
        protocol.Task, "make", lambda task, make=protocol.Task.make, **kwargs: make(task, years=2, **kwargs)
    )
    out = ["--out", str(tmp_path / "years.gif")]
    command_line.main(["watch", "eupg_fixed_lambda", *out])
    assert "carbon weight 0.50" in (said := capsys.readouterr().out) and "trained for" not in said
    command_line.main(["watch", "eupg_fixed_lambda", "--preference", "0.1", *out])
    assert "trained for the preference 0.5 alone" in capsys.readouterr().out


def test_an_environment_that_draws_nothing_cannot_be_watched(run, monkeypatch):
    monkeypatch.setattr(boreal_env.BorealEnv, "metadata", {"render_modes": []})
    with pytest.raises(SystemExit, match="boreal-site-specific-v0 draws no pictures: its metadata"):
        command_line.main(["watch", str(run)])


@pytest.mark.parametrize(
    "given, message",
    [
        (["watch", "nobody"], "nobody: neither the folder of a finished run"),
        (["watch", "{run}", "--preference", "2"], r"--preference: a number in \[0, 1\] is allowed, got 2.0"),
        (["watch", "{run}", "--env-id", "boreal-balanced-v0"], "observes 43 entries, boreal-balanced-v0 has 105"),
        (
            ["watch", "{run}", "--env-id", "boreal-timber-v0", "--preference", "0.3"],
            "observes 43 entries, boreal-timber-v0",
        ),
        (["watch", "{run}", "--env-id", "boral-v0"], "boral"),
        (["watch", "{run}", "--env-id", "./pond.py:pond-v0"], "a module is allowed, such as pond:pond-v0, with PYTHON"),
        (["watch", "{run}", "--env-id", "pond.py:pond-v0"], "a module is allowed, such as pond:pond-v0, with PYTHON"),
        (["watch", "{run}", "--out", "/nowhere/years.gif"], "--out /nowhere/years.gif: there is no folder /nowhere"),
        (["watch", "{run}", "--out", "/proc/years.gif"], "--out /proc/years.gif: (cannot write|there is no folder)"),
        (["watch", "{run}", "--window"], "--window: matplotlib finds no display here; without it a GIF is written"),
        (["watch", "{run}", "--out", "years.mp4"], r"--out years.mp4: a file that ends in .gif is allowed"),
        (["watch", "{run}", "--site-seed", "-1"], r"--site-seed: an integer in \[0, 2\^63\) is allowed, got -1"),
        (["watch", "{run}", "--script", "x.md"], "--script x.md: a file that ends in .py, and is there, is allowed"),
        (["watch", "{run}", "--script", flags.__file__], "flags.py: it has no Agent and no make_policy"),
        (["watch", __file__], "no policy that a script of this project has written"),
        (["wach"], "invalid choice: 'wach'"),
    ],
)
def test_a_bad_command_gets_one_line(run, given, message, monkeypatch):
    monkeypatch.setattr(command_line, "play", None)  # nothing is played for it
    matplotlib.use("agg")  # as where there is no display
    with pytest.raises(SystemExit, match=message) as refused:
        command_line.main([word.format(run=run) for word in given])
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "name, harm",
    [
        ("evaluation.csv", lambda data: b""),
        ("evaluation.csv", lambda data: data[:-3]),
        ("evaluation.csv", lambda data: data[: data[:-1].rindex(b"\n") + 1]),
        ("evaluation.csv", lambda data: data[: data.rindex(b",") + 1] + b"nan\n"),
        ("episodes.csv", lambda data: data[:100]),
        ("policy.pt", lambda data: data[: len(data) // 2]),
        ("policy.pt", lambda data: None),
    ],
    ids=["empty", "cut in a number", "cut after a row", "no number", "half a log", "half a policy", "no policy"],
)
def test_a_finished_run_that_is_damaged_is_not_called_finished(run, tmp_path, name, harm):
    folder = tmp_path / "run"
    shutil.copytree(run, folder)
    assert run_folder.damage_of(folder, 5) is None
    harmed = harm((folder / name).read_bytes())
    (folder / name).unlink()
    if harmed is not None:
        (folder / name).write_bytes(harmed)
    assert run_folder.damage_of(folder, 5) == name


@pytest.mark.parametrize("name, content", [("episodes.csv", None), ("updates.csv", None), ("summary.png", b"")])
def test_a_finished_run_that_lacks_a_file_is_not_called_finished(run, tmp_path, name, content):
    folder = tmp_path / "run"
    shutil.copytree(run, folder)
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_bytes(content)
    with pytest.raises(SystemExit, match=f"{name} is (damaged|missing); --overwrite starts over"):
        run_script("cleanrl_style/ppo_gated.py", *SHORT, "--run-dir", folder)


def test_a_finished_run_that_lost_an_episode_of_one_weight_is_damaged(run, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(run, folder)
    one = pd.read_csv(folder / "evaluation.csv")
    two = pd.concat([one, one.assign(episode=1)])
    two.to_csv(folder / "evaluation.csv", index=False)
    assert run_folder.damage_of(folder, 5) is None
    two.iloc[:-1].to_csv(folder / "evaluation.csv", index=False)
    assert run_folder.damage_of(folder, 5) == "evaluation.csv"


def test_what_saves_no_policy_is_finished_without_one(run, tmp_path):
    shutil.copytree(run, tmp_path / "run", ignore=shutil.ignore_patterns("policy.pt"))
    config = json.loads((run / "config.json").read_text())
    assert config.pop("policy") == "policy.pt"
    (tmp_path / "run" / "config.json").write_text(json.dumps(config))
    assert run_folder.damage_of(tmp_path / "run", 5) is None


@pytest.mark.parametrize(
    "text, what",
    [
        ("import torch\n\nclass Agent(:\n    pass\n", ", line 3: invalid syntax"),
        ("import nowhere_to_be_found\n", ": No module named 'nowhere_to_be_found'"),
    ],
)
def test_a_script_that_cannot_be_loaded_is_named(run, tmp_path, text, what):
    script = tmp_path / "own.py"
    script.write_text(text)
    with pytest.raises(SystemExit, match=rf"^error: script {script}{what}$"):
        command_line.main(["watch", str(run), "--script", str(script)])
    with pytest.raises(SystemExit, match=rf"^error: script {script}{what}$"):
        score_policy.main(score_policy.Args(run, script, tasks=("boreal-site-specific-v0",)))


def test_a_run_is_checked_and_scored(run, capsys):
    args = score_policy.Args(run, tasks=("boreal-site-specific-v0",), episodes=1)
    score_policy.main(args)
    out = capsys.readouterr().out
    assert "plays its evaluation again" in out and "boreal-site-specific-v0: SCORE" in out


def test_a_script_that_a_folder_brings_runs_only_when_it_is_named(run, tmp_path):
    shutil.copytree(run, tmp_path / "run")
    (tmp_path / "ppo_gated.py").write_text("raise RuntimeError('it ran')\n")
    config = json.loads((run / "config.json").read_text())
    (tmp_path / "run" / "config.json").write_text(json.dumps(config | {"file": str(tmp_path / "ppo_gated.py")}))
    with pytest.raises(SystemExit, match=f"names {tmp_path}/ppo_gated.py; once you have read it, --script"):
        score_policy.main(score_policy.Args(tmp_path / "run", tasks=("boreal-site-specific-v0",), episodes=1))


def test_a_policy_with_dice_of_its_own_is_refused(run):
    policy = protocol.load_policy(run)
    dice = np.random.default_rng(0)

    def drawn(observations, masks, accrued_returns):
        return np.eye(25)[[dice.choice(np.flatnonzero(mask)) for mask in masks]]

    task = policy.task()
    for probabilities in (policy.probabilities, drawn):
        evaluation, _ = protocol.evaluate(task, probabilities, (0.0, 1.0), 2)
        if probabilities is drawn:
            with pytest.raises(ValueError, match="plays otherwise when it plays again"):
                score_policy.check_repeats(replace(policy, probabilities=drawn), task, evaluation)
        else:
            score_policy.check_repeats(policy, task, evaluation)


def test_a_policy_of_another_observation_is_refused_before_it_plays(run, monkeypatch):
    monkeypatch.setattr(protocol, "evaluate", None)
    with pytest.raises(SystemExit, match="observes 43 entries; boreal-balanced-v0 has 105: --tasks"):
        score_policy.main(score_policy.Args(run, tasks=("boreal-site-specific-v0", "boreal-balanced-v0")))


def test_a_policy_that_does_not_play_its_evaluation_is_refused(run, tmp_path):
    for name in ("config.json", "policy.pt"):
        (tmp_path / name).write_bytes((run / name).read_bytes())
    table = pd.read_csv(run / "evaluation.csv")
    table.assign(thaw_return=table.thaw_return + 1).to_csv(tmp_path / "evaluation.csv", index=False)
    with pytest.raises(SystemExit, match="does not play what evaluation.csv says"):
        score_policy.main(score_policy.Args(tmp_path, tasks=("boreal-site-specific-v0",), episodes=1))


def test_not_only_the_first_episode_is_played_again(run, tmp_path):
    shutil.copytree(run, tmp_path / "run")
    policy, config = protocol.load_policy(run), json.loads((run / "config.json").read_text())
    config["arguments"]["eval_episodes"] = 2
    (tmp_path / "run" / "config.json").write_text(json.dumps(config))
    table, _ = protocol.evaluate(policy.task(), policy.probabilities, config["arguments"]["eval_weights"], 2)
    table.to_csv(tmp_path / "run" / "evaluation.csv", index=False)
    assert "plays its evaluation again" in score_policy.check(policy, tmp_path / "run")
    last = table.episode == table.episode.max()
    table.assign(thaw_return=table.thaw_return + last).to_csv(tmp_path / "run" / "evaluation.csv", index=False)
    with pytest.raises(ValueError, match="does not play what evaluation.csv says"):
        score_policy.check(policy, tmp_path / "run")


@pytest.mark.parametrize(
    "name, text, message",
    [
        ("config.json", None, "it has no config.json; a run's folder has config.json, policy.pt, evaluation.csv$"),
        (
            "evaluation.csv",
            None,
            "it has no evaluation.csv; a run's folder has config.json, policy.pt, evaluation.csv$",
        ),
        ("config.json", "", r"damaged: config.json \("),
        ("config.json", "{}", r"damaged: config.json \(KeyError\('script'\)\)$"),
        ("evaluation.csv", "", r"damaged: evaluation.csv \(No columns to parse from file\)$"),
        ("evaluation.csv", "HEADER\ngreedy,0", "damaged: evaluation.csv does not end with a newline$"),
        ("evaluation.csv", "HEADER\n", "damaged: evaluation.csv has 0 episodes of the greedy policy, not 5$"),
        ("evaluation.csv", "a,b\n1,2\n", "damaged: evaluation.csv with the returns of .* lacks the column policy$"),
        ("evaluation.csv", "a\n1,2\n1,2,3\n", r"damaged: evaluation.csv \(Error tokenizing"),
    ],
)
def test_a_damaged_file_of_a_submitted_run_is_named(run, tmp_path, name, text, message):
    for one in score_policy.SUBMITTED:
        (tmp_path / one).write_bytes((run / one).read_bytes())
    (tmp_path / name).unlink()
    if text is not None:
        header = (run / name).read_text().splitlines()[0]
        (tmp_path / name).write_text(text.replace("HEADER", header))
    args = score_policy.Args(tmp_path, tasks=("boreal-site-specific-v0",), episodes=1)
    with pytest.raises(SystemExit, match=message) as refused:
        score_policy.check_flags(args)
        score_policy.main(args)
    assert str(refused.value).startswith(f"error: {tmp_path}: ") and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda episode: episode + 8, "line 2: episode is 8, not 0"),
        (lambda episode: episode * 0 - 1, "line 2: episode is -1, not 0"),
        (lambda episode: episode.where(episode.index > 2), "line 2: episode is nan, not 0.*"),
    ],
)
def test_episodes_of_other_numbers_are_refused(run, tmp_path, change, message):
    shutil.copytree(run, tmp_path / "run")
    path = tmp_path / "run" / "evaluation.csv"
    table = pd.read_csv(path)
    table.assign(episode=change(table.episode)).to_csv(path, index=False)
    with pytest.raises(ValueError, match=f"^{path.parent}: damaged: evaluation.csv, {message}$"):
        score_policy.evaluation_of(path.parent)


@pytest.mark.parametrize(
    "given, message",
    [
        (("nobody",), "nobody: neither the folder of a finished run"),
        (("ppo_group", "--episodes", "1", "--add"), "--add: a row of the leaderboard is of both tasks and all 200"),
        (("ppo_group", "--tasks", "boreal-balanced-v0", "--add"), "--add: a row of the leaderboard is of both tasks"),
        (("ppo_group", "--episodes", "0"), "--episodes 0: 1 to 200 are allowed"),
        (("ppo_group", "--root", "/nowhere", "--add"), "--root /nowhere: no docs/leaderboard.md with"),
        (("ppo_group", "--name", "a|b"), r"--name 'a\|b': a cell of a table, without \|, is allowed"),
        (("ppo_group", "--name", "mine"), "--name goes with --add"),
        (("ppo_group", "--script", "nowhere.py"), "--script nowhere.py: a file that ends in .py, and is there"),
        (("ppo_group", "--tasks", "boral-v0"), "--tasks boral-v0: Environment `boral` doesn't exist"),
        (("ppo_group", "--tasks", "./pond.py:pond-v0"), "--tasks ./pond.py:pond-v0: a module is allowed"),
    ],
)
def test_a_policy_is_scored_with_good_flags_alone(given, message):
    with pytest.raises(SystemExit, match=f"^error: {message}") as refused:
        run_script("analysis/score_policy.py", *given)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        (
            {"env_id": "boreal-site-specific-v0"},
            "--add: a policy trained on boreal-generalist-v0 or boreal-balanced-v0",
        ),
        ({"site_seed": 3}, "--add: a policy trained on the task itself is allowed, not with another site_seed"),
        ({"thaw_formulation": "contrast"}, "is allowed, not with another thaw_formulation"),
    ],
)
def test_a_policy_of_another_task_is_no_row_of_the_leaderboard(changed, what, tmp_path, monkeypatch):
    policy = protocol.load_policy("ppo_group")
    other = replace(policy, arguments={**policy.arguments, **changed})
    monkeypatch.setattr(protocol, "load_policy", lambda *_: other)
    monkeypatch.setattr(protocol, "evaluate", None)  # refused before it plays
    with pytest.raises(SystemExit, match=what):
        score_policy.main(score_policy.Args(Path("ppo_group"), add=True, root=tmp_path))


def test_a_row_has_both_scores_of_a_policy_that_was_played_twice(tmp_path, monkeypatch):
    task, rows, repeated = score_policy.TASKS[1], [], []
    by_weight = pd.DataFrame({"greedy": [1.0], "best": [2.0]})
    played = SimpleNamespace(evaluation=None, by_weight=by_weight, score={"greedy": 10.0, "sampled": 20.0}.get)
    monkeypatch.setattr(score_policy, "comparison", lambda *_: played)
    monkeypatch.setattr(score_policy, "followed", lambda *_: "")
    monkeypatch.setattr(score_policy, "check_repeats", lambda *given: repeated.append(given))
    monkeypatch.setattr(score_policy, "add", lambda row, root: rows.append(row))
    score_policy.main(score_policy.Args(Path("ppo_group"), tasks=(task,), add=True, root=tmp_path))
    assert (rows[0][f"greedy, {task}"], rows[0][f"sampled, {task}"], len(repeated)) == (10, 20, 1)


@pytest.mark.parametrize("command", [("analysis/score_policy.py", "nobody"), ("-m", "boreal_env", "watch", "nobody")])
def test_a_bad_flag_is_answered_before_torch_is_loaded(command):
    said = subprocess.run([sys.executable, "-X", "importtime", *command], capture_output=True, text=True, cwd=ROOT)
    assert said.stderr.splitlines()[-1].startswith("error: nobody: neither")
    assert "| torch\n" not in said.stderr


def test_a_row_may_have_any_name_and_no_steps(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / score_policy.PAGE).write_text("<!-- leaderboard -->\n<!-- end of leaderboard -->\n", encoding="utf-8")
    scores = dict.fromkeys(score_policy.SCORES, 50.0)
    for name, steps in (("NA", None), ("one", 1_234_567), ("NA", 300_000)):
        row = {"name": name, "script": "ppo", "trained on": "boreal-balanced-v0", "steps": steps}
        score_policy.add(row | scores, tmp_path)
    lines = (tmp_path / score_policy.TABLE).read_text(encoding="utf-8").splitlines()[1:]
    assert [line.split(",")[:4] for line in lines] == [
        ["NA", "ppo", "boreal-balanced-v0", "300000"],
        ["one", "ppo", "boreal-balanced-v0", "1234567"],
    ]


def test_rows_go_into_the_leaderboard(tmp_path):
    (tmp_path / "docs").mkdir()
    page = tmp_path / score_policy.PAGE
    page.write_text("# Leaderboard\n<!-- leaderboard -->\n<!-- end of leaderboard -->\nend\n", encoding="utf-8")
    scores = dict.fromkeys(score_policy.SCORES, 50.0)
    other = f"greedy, {score_policy.TASKS[0]}"  # does not rank
    for name, best in (("one", 60.0), ("two", 80.0), ("one", 90.0)):
        row = {"name": name, "script": "ppo", "trained on": "boreal-balanced-v0", "steps": 300000}
        score_policy.add({**row, **scores, f"greedy, {score_policy.TASKS[1]}": best, other: -best}, tmp_path)
    names = pd.read_csv(tmp_path / score_policy.TABLE).name.tolist()
    assert names == ["one", "two"]
    text = page.read_text(encoding="utf-8")
    assert text.index("| one |") < text.index("| two |") and text.endswith("end\n") and "| 90 |" in text
    args = score_policy.Args(Path("ppo_group"), add=True, root=tmp_path)
    with pytest.raises(ValueError, match="--name 'one': .* has a row of that name; --replace puts this one in"):
        score_policy.check_name("one", args)
    score_policy.check_name("three", args)
    score_policy.check_name("one", replace(args, replace=True))


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda text: text[:-20], "its row 'Group PPO, balanced task' lacks a score"),
        (lambda text: text[:-1], "it does not end with a newline"),
        (lambda text: text.replace(",", ";"), "its columns have to be 'name', 'script', .*"),
        (lambda text: "", r"\(No columns to parse from file\)"),
    ],
    ids=["cut in a row", "cut", "semicolons", "empty"],
)
def test_a_damaged_leaderboard_is_left_as_it_is(change, message, tmp_path):
    (tmp_path / "docs").mkdir()
    path = tmp_path / score_policy.TABLE
    path.write_text(change((ROOT / score_policy.TABLE).read_text(encoding="utf-8")), encoding="utf-8")
    damaged, args = path.read_bytes(), score_policy.Args(Path("ppo_group"), add=True, replace=True, root=tmp_path)
    for refused in (lambda: score_policy.check_name("one", args), lambda: score_policy.add({"name": "one"}, tmp_path)):
        with pytest.raises(ValueError, match=rf"^{path} is damaged:? {message}$"):
            refused()
    assert path.read_bytes() == damaged


@pytest.mark.parametrize(
    "command, given",
    [
        (best_plans, {"folder": "file"}),
        (choose_sites, {"path": "file/sites.csv"}),
        (draw_readme, {"images": "file"}),
        (reference_returns, {"folder": "file"}),
        (ship_policies, {"runs": ("ppo_group",), "folder": "file"}),
    ],
    ids=lambda part: part.__name__ if hasattr(part, "__name__") else "",
)
def test_where_nothing_can_be_written_nothing_is_computed(command, given, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    given = {name: Path(value) if isinstance(value, str) else value for name, value in given.items()}
    with pytest.raises(SystemExit, match=r"^error: --\w+ file: cannot write there \(file is a file\)$"):
        command.main(command.Args(**given))
