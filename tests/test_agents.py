"""A trained policy, loaded again from its run's folder, plays as it did in the run's own evaluation."""

import pickle
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import torch
from scripts import ROOT, run_script

from analysis import score_policy
from cleanrl_style import protocol
from cleanrl_style.flags import policy_file
from cleanrl_style.ppo_group import Agent
from cleanrl_style.protocol.agents import load_script, own_script

TOY = "toy_env:toy-v0"
SCRIPTS = ("ppo_gated", "ppo_curriculum", "eupg_var_lambda", "eupg_fixed_lambda")


def train(path, folder, *more):
    given = ("--env-id", TOY, "--total-timesteps", 80, "--num-envs", 2, "--eval-episodes", 2, "--run-dir", folder)
    run_script(path, *given, *(("--rollout-steps", 40) if "ppo" in str(path) else ()), *more)


def evaluate_again(folder, policy):
    written = pd.read_csv(folder / "evaluation.csv")
    again, _ = protocol.evaluate(protocol.Task.of(TOY), policy, written.preference.unique(), 2)
    pd.testing.assert_frame_equal(written, again, rtol=1e-8, check_dtype=False)


@pytest.mark.parametrize("script", SCRIPTS)
def test_a_loaded_agent_plays_the_evaluation_again(script, tmp_path):
    train(f"cleanrl_style/{script}.py", tmp_path)
    evaluate_again(tmp_path, protocol.load_policy(tmp_path))
    assert own_script(tmp_path) is None  # it is imported, not read a second time


@pytest.mark.parametrize("script", [*SCRIPTS, "ppo_group"])
def test_training_moves_every_layer(script, tmp_path):
    more = ("--minibatch-size", 10, *(("--group-size", 2) if script == "ppo_group" else ())) if "ppo" in script else ()
    for rate in (1e-3, 1e-12):
        train(f"cleanrl_style/{script}.py", tmp_path / str(rate), "--learning-rate", rate, *more)
    trained, first = (
        torch.load(tmp_path / str(rate) / "policy.pt", weights_only=True)["agent"] for rate in (1e-3, 1e-12)
    )
    layers = [name for name in first if name.startswith("actor")]
    assert len(layers) == 6
    for name in layers:
        assert (trained[name] - first[name]).abs().max() > 1e-5, name


def test_a_folder_of_several_runs_says_what_to_give(tmp_path):
    (tmp_path / "seed1").mkdir()
    (tmp_path / "seed1" / "policy.pt").write_bytes(b"")
    with pytest.raises(FileNotFoundError, match=f"{tmp_path} holds runs: give one of them, such as {tmp_path}/seed1"):
        protocol.load_policy(tmp_path)


def test_a_finished_run_says_if_its_script_has_changed(tmp_path, capsys):
    path = tmp_path / "ppo_own.py"
    path.write_text((ROOT / "cleanrl_style" / "ppo_gated.py").read_text())
    train(path, tmp_path / "run")
    for changed, said in (
        ("", "is finished (--overwrite starts over)"),
        ("# more", "finished, but ppo_own.py has changed"),
    ):
        path.write_text(path.read_text() + changed)
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            train(path, tmp_path / "run")
        assert end.value.code == 0 and said in capsys.readouterr().out


def test_the_agent_of_a_script_elsewhere(tmp_path):
    path = tmp_path / "ppo_own.py"
    path.write_text((ROOT / "cleanrl_style" / "ppo_gated.py").read_text())
    train(path, tmp_path / "run")
    evaluate_again(tmp_path / "run", protocol.load_policy(tmp_path / "run"))  # its config.json says where
    path = path.rename(tmp_path / "moved.py")
    with pytest.raises(FileNotFoundError, match="no cleanrl_style/ppo_own.py to import; script=path"):
        protocol.load_policy(tmp_path / "run")
    policy = protocol.load_policy(tmp_path / "run", script=path)
    evaluate_again(tmp_path / "run", policy)
    evaluate_again(tmp_path / "run", pickle.loads(pickle.dumps(policy)))


def test_scripts_in_two_folders_have_each_its_own_helper(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "of_both.py").write_text(f"NAME = {name!r}\n")
        (tmp_path / name / "method.py").write_text("import of_both, json, sim.wind\nNAME = of_both.NAME\n")
    assert [load_script("method", tmp_path / name / "method.py").NAME for name in ("a", "b", "a")] == ["a", "b", "a"]
    assert "of_both" not in sys.modules and "json" in sys.modules and "sim.wind" in sys.modules


def test_an_agent_may_ask_for_the_number_of_actions_and_for_what_lies_beside_its_script(tmp_path, monkeypatch):
    text = (ROOT / "cleanrl_style" / "ppo_gated.py").read_text()
    text = text.replace("import torch.nn as nn\n", "import torch.nn as nn\nfrom beside import WIDTH\n")
    text = text.replace("2 + 15 + 10)", "2 + envs.single_action_space.n)").replace("64)", "WIDTH)")
    assert text.count("WIDTH") > 2 and "single_action_space" in text
    (tmp_path / "beside.py").write_text("WIDTH = 64\n")
    (tmp_path / "ppo_wide.py").write_text(text)
    with monkeypatch.context() as as_python:
        as_python.syspath_prepend(tmp_path)
        train(tmp_path / "ppo_wide.py", tmp_path / "run")
    sys.modules.pop("beside")
    assert protocol.load_policy(tmp_path / "run").size == 3


def test_a_policy_that_could_not_be_loaded_is_not_written(tmp_path):
    text = (ROOT / "cleanrl_style" / "ppo_gated.py").read_text()
    text = text.replace("def __init__(self, envs, num_values=1)", "def __init__(self, envs, num_values=1, act=nn.Tanh)")
    text = text.replace("num_values=num_values)", "num_values=num_values, act=nn.Tanh)")
    (tmp_path / "ppo_act.py").write_text(text)
    with pytest.raises(TypeError, match="run.save_policy: numbers, texts and tuples of them are allowed"):
        train(tmp_path / "ppo_act.py", tmp_path / "run")


def test_the_agent_of_one_preference_knows_it():
    observations = [protocol.load_policy("eupg_fixed_lambda").task().make().reset(seed=seed)[0] for seed in (1, 2)]
    assert [one[0] for one in observations] == [0.5, 0.5]


@pytest.mark.parametrize("preference", [0.0, 1.0])
def test_the_agent_of_one_objective_alone_is_loaded(preference, tmp_path):
    saved = torch.load(policy_file("eupg_fixed_lambda"), weights_only=True)
    saved["run"]["arguments"]["preference"] = preference
    torch.save(saved, tmp_path / "policy.pt")
    before = torch.get_rng_state()
    assert protocol.load_policy(tmp_path / "policy.pt").task().env_kwargs["fixed_preference"] == preference
    assert torch.equal(before, torch.get_rng_state())  # loading draws nothing of what is drawn later


def test_the_task_of_an_agent_is_as_it_was_trained():
    policy = protocol.load_policy("ppo_group")
    hidden = replace(policy, arguments={**policy.arguments, "hide_site": True}, size=43)
    assert hidden.task().make().observation_space.shape == (43,)
    assert score_policy.task_of(hidden, "boreal-balanced-v0").make().observation_space.shape == (43,)
    one = protocol.load_policy("eupg_fixed_lambda")
    kept = replace(one, arguments={**one.arguments, "thaw_formulation": "contrast"}).task().env_kwargs
    assert kept["thaw_formulation"] == "contrast" and kept["fixed_preference"] is not None


def test_each_row_of_a_batch_has_an_action_of_its_own():
    policy, observations, masks = protocol.load_policy("ppo_group"), np.zeros((40, 105)), np.ones((40, 25), bool)
    assert len(set(policy.act(observations, masks, generator=np.random.default_rng(0)).tolist())) > 3
    assert policy.act(observations[:1], masks[:1]).shape == (1,)


def test_returns_accrued_so_far_are_of_all_objectives():
    policy = protocol.load_policy("eupg_fixed_lambda")
    three = replace(policy, arguments={**policy.arguments, "eval_weights": [[1, 0, 0]]})
    with pytest.raises(ValueError, match=r"accrued_returns \(1, 3\) are allowed"):
        three.act(np.zeros(105), np.ones(25, bool), [0.0, 0.0])


def test_an_agent_of_another_network_is_refused(tmp_path):
    train("cleanrl_style/eupg_var_lambda.py", tmp_path)
    saved = torch.load(tmp_path / "policy.pt", weights_only=True)
    saved["agent"] = {f"older.{name}": value for name, value in saved["agent"].items()}
    torch.save(saved, tmp_path / "policy.pt")
    with pytest.raises(ValueError, match="policy.pt: another version of eupg_var_lambda.py than .* trained it"):
        protocol.load_policy(tmp_path)
    with pytest.raises(
        ValueError, match="ppo_group.pt: another version of ppo_group.py than .*ppo_gated.py trained it"
    ):
        protocol.load_policy("ppo_group", script=ROOT / "cleanrl_style" / "ppo_gated.py")


def test_an_environment_that_is_not_registered_here_is_named():
    policy = protocol.load_policy("ppo_group")
    elsewhere = replace(policy, arguments={**policy.arguments, "env_id": "nobodys-v0"})
    with pytest.raises(ValueError, match="ppo_group: --env-id nobodys-v0: .*allowed: boreal-"):
        elsewhere.task()


def test_a_module_that_python_cannot_read_is_named(tmp_path, monkeypatch):
    (tmp_path / "unreadable.py").write_text("import gymnasium\ndef make(:\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SystemExit, match="--env-id unreadable:x-v0: .*unreadable.py, line 2: "):
        run_script("cleanrl_style/ppo_gated.py", "--env-id", "unreadable:x-v0", "--run-dir", tmp_path / "run")


def test_returns_of_another_number_of_objectives_are_refused():
    policy = protocol.load_policy("eupg_var_lambda")
    with pytest.raises(ValueError, match=r"eupg_var_lambda: accrued_returns \(1, 2\) are allowed, got \(1, 3\)"):
        policy.act(np.zeros(105), np.ones(25, bool), [0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="eupg_var_lambda: accrued_returns are not finite"):
        policy.act(np.zeros(105), np.ones(25, bool), [np.nan, 0.0])
    with pytest.raises(ValueError, match="eupg_var_lambda: accrued_returns are not finite numbers"):
        policy.act(np.zeros(105), np.ones(25, bool), ["much", "more"])
    for without in (policy.act, lambda *given: policy(*given, None)):
        with pytest.raises(ValueError, match="eupg_var_lambda looks at the returns .*: give accrued_returns"):
            without(np.zeros((1, 105), np.float32), np.ones((1, 25), bool))


def test_a_script_with_a_dot_in_its_name_is_named(tmp_path):
    saved = torch.load(policy_file("ppo_gated"), weights_only=True)
    saved["run"]["script"] = "ppo_v1.2"
    torch.save(saved, tmp_path / "policy.pt")
    with pytest.raises(FileNotFoundError, match="no cleanrl_style/ppo_v1.2.py to import; script=path .*--script"):
        protocol.load_policy(tmp_path)
    assert protocol.load_policy(tmp_path, ROOT / "cleanrl_style" / "ppo_gated.py").script == "ppo_v1.2"


def test_a_policy_whose_training_went_wrong_is_refused(tmp_path):
    saved = torch.load(ROOT / "cleanrl_style" / "policies" / "ppo_gated.pt", weights_only=True)
    next(iter(saved["agent"].values())).fill_(torch.nan)
    torch.save(saved, tmp_path / "policy.pt")
    with pytest.raises(ValueError, match="policy.pt: a weight of its network is not finite"):
        protocol.load_policy(tmp_path)


def test_a_folder_without_a_policy_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="neither the folder of a finished run, with policy.pt"):
        protocol.load_policy(tmp_path)


def test_a_file_that_was_cut_short_is_named(tmp_path):
    path = tmp_path / "cut.pt"
    path.write_bytes(policy_file("ppo_group").read_bytes()[:5000])
    with pytest.raises(ValueError, match="cut.pt: cut short, or no policy"):
        protocol.load_policy(path)


def test_a_bit_that_has_turned_is_seen(tmp_path):
    path, whole = tmp_path / "turned.pt", policy_file("ppo_group").read_bytes()
    for at in np.linspace(0.2, 0.8, 5) * len(whole):
        path.write_bytes(whole[: int(at)] + bytes([whole[int(at)] ^ 16]) + whole[int(at) + 1 :])
        with pytest.raises(ValueError, match="turned.pt: "):
            protocol.load_policy(path)


def test_a_mask_is_of_truth_values():
    policy, observation = protocol.load_policy("ppo_group"), np.zeros(105, np.float32)
    only = np.arange(25) == 12
    assert policy.act(observation, only) == policy.act(observation, only.astype(int)) == 12
    with pytest.raises(ValueError, match="masks of true and false are allowed"):
        policy.act(observation, np.where(only, 0.0, -np.inf))


@pytest.mark.parametrize(
    "damage",
    [
        {"observation_shape": None},
        {"observation_shape": [5, 21]},
        {"run": {"script": "ppo_group", "arguments": {}}},
        {"run": {"script": "ppo_group", "arguments": None}},
        {"run": {"script": "ppo_group", "arguments": {"env_id": "boreal-generalist-v0", "eval_weights": []}}},
        {"run": {"script": "ppo_group", "arguments": {"env_id": "boreal-generalist-v0", "preference": "zzz"}}},
        {"run": {"script": "ppo_group", "arguments": {"env_id": "boreal-generalist-v0", "preference": 7}}},
    ],
    ids=str,
)
def test_a_file_that_no_script_has_written_is_named(damage, tmp_path):
    saved = torch.load(policy_file("ppo_group"), weights_only=True)
    torch.save({**saved, **damage}, tmp_path / "policy.pt")
    with pytest.raises(ValueError, match="policy.pt: no policy that a script of this project has written"):
        protocol.load_policy(tmp_path / "policy.pt")


@pytest.mark.parametrize("script", [5, ""])
def test_what_is_no_path_of_a_script_is_refused(script):
    with pytest.raises(ValueError, match=f"^script {script!r}: the path of one is allowed$"):
        protocol.load_policy("ppo_group", script=script)


def test_a_policy_is_not_saved_without_the_arguments_that_make_it():
    envs = SimpleNamespace(single_observation_space=SimpleNamespace(shape=(5,)))
    run = SimpleNamespace(envs=envs, config={"arguments": {}})
    lacking = r"wants every argument that the Agent was made with after envs, not \{'num_logits': 3\}: "
    with pytest.raises(TypeError, match=lacking):
        protocol.Run.save_policy(run, Agent(envs, num_values=3, num_logits=3), num_logits=3)
