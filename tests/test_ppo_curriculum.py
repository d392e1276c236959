import json
import os
import subprocess
import sys
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
import torch
from resumed import assert_goes_on_to_the_same_bytes
from scripts import ROOT, run_script
from toy_env import optimal_return

import boreal_env
from cleanrl_style import ppo_curriculum, ppo_gated, ppo_group, protocol
from cleanrl_style.ppo_curriculum import Agent, Args, Curriculum, compute_gae, weigh_advantages
from cleanrl_style.protocol import run_folder

SCRIPT = "cleanrl_style/ppo_curriculum.py"
OBSERVATIONS = 105


def make_agent(seed=0):
    torch.manual_seed(seed)
    return Agent(SimpleNamespace(single_observation_space=gym.spaces.Box(0, 1, (OBSERVATIONS,))))


def train(folder, *arguments, env_id="toy_env:toy-sites-v0"):
    run_script(
        SCRIPT,
        "--env-id",
        env_id,
        "--run-dir",
        folder,
        "--total-timesteps",
        640,
        "--num-envs",
        4,
        "--rollout-steps",
        256,
        "--eval-episodes",
        2,
        "--eval-weights",
        0,
        1,
        *arguments,
    )


@pytest.fixture(scope="module")
def finished_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "first"
    train(folder)
    return folder


# -------------------------------------------------------------------------------------------------- agent


def test_joint_probabilities_are_gate_times_head_and_sum_to_one():
    agent = make_agent()
    x, mask = torch.randn(6, OBSERVATIONS), torch.rand(6, 25) < 0.5
    mask[:, 12] = mask[:, 20] = True
    probabilities = agent.get_logprobs(x, mask).exp().detach()
    torch.testing.assert_close(probabilities.sum(dim=1), torch.ones(6))
    assert (probabilities[~mask] == 0).all()
    gate, other, plant = agent.actor(x).split([2, 15, 10], dim=1)
    gate = gate.softmax(dim=1)
    heads = [other.exp() * mask[:, :15], plant.exp() * mask[:, 15:]]
    expected = [gate[:, [k]] * head / head.sum(dim=1, keepdim=True) for k, head in enumerate(heads)]
    torch.testing.assert_close(probabilities, torch.cat(expected, dim=1).detach())


@pytest.mark.parametrize("valid", [slice(0, 15), slice(15, 25), slice(24, 25)])
def test_a_group_without_a_valid_action_leaves_all_to_the_other(valid):
    agent = make_agent()
    mask = torch.zeros(3, 25, dtype=torch.bool)
    mask[:, valid] = True
    action, logprob, entropy, _ = agent.get_action_and_value(torch.randn(3, OBSERVATIONS), mask)
    probabilities = agent.get_logprobs(torch.randn(3, OBSERVATIONS), mask).exp()
    torch.testing.assert_close(probabilities[:, valid].sum(dim=1), torch.ones(3))
    assert mask.gather(1, action[:, None]).all()
    assert torch.isfinite(logprob).all() and torch.isfinite(entropy).all()


def test_masked_actions_give_no_gradient():
    agent = make_agent()
    mask = torch.ones(1, 25, dtype=torch.bool)
    mask[:, 15:] = False
    _, logprob, entropy, _ = agent.get_action_and_value(torch.randn(1, OBSERVATIONS), mask, torch.tensor([3]))
    (logprob + entropy).sum().backward()
    gate, other, plant = agent.actor[4].weight.grad.split([2, 15, 10])
    assert not plant.any() and not gate.any() and other.any()


@pytest.mark.parametrize("compute_gae", [ppo_curriculum.compute_gae, ppo_group.compute_gae])
def test_gae_of_a_hand_computed_episode(compute_gae):
    # gamma and lambda 0.5; an episode of three steps (rewards 1, 2, 4, values 1, 2, 3), then the next one
    rewards = torch.tensor([[1.0], [2.0], [4.0], [8.0]])
    values = torch.tensor([[1.0], [2.0], [3.0], [5.0]])
    dones = torch.tensor([[1.0], [0.0], [0.0], [1.0]])
    # the end is terminal: delta_2 = 4 - 3 = 1; delta_1 = 2 + 1.5 - 2 = 1.5; delta_0 = 1 + 1 - 1 = 1
    # A_2 = 1; A_1 = 1.5 + .25 * 1 = 1.75; A_0 = 1 + .25 * 1.75 = 1.4375
    # the rollout cuts the second episode: bootstrapped with the value 10: 8 + 5 - 5 = 8
    advantages = compute_gae(rewards, values, dones, torch.tensor([10.0]), torch.tensor([0.0]), 0.5, 0.5)
    torch.testing.assert_close(advantages.flatten(), torch.tensor([1.4375, 1.75, 1.0, 8.0]))
    # the same, had the second episode ended there: no bootstrap
    advantages = compute_gae(rewards, values, dones, torch.tensor([10.0]), torch.tensor([1.0]), 0.5, 0.5)
    torch.testing.assert_close(advantages.flatten(), torch.tensor([1.4375, 1.75, 1.0, 3.0]))


def test_gae_of_two_objectives_is_that_of_their_weighted_sum():
    # linear in rewards and values: so, if the critic's values add up, weighing commutes with it
    generator = torch.Generator().manual_seed(0)
    rewards, values = torch.rand((2, 20, 3, 2), generator=generator, dtype=torch.double)
    next_value = torch.rand((3, 2), generator=generator, dtype=torch.double)
    dones = torch.rand((21, 3, 1), generator=generator) < 0.2
    dones, last_done = dones[:-1].double(), dones[-1].double()
    weights = torch.tensor([0.3, 0.7], dtype=torch.double)

    vector = compute_gae(rewards, values, dones, next_value, last_done, 0.9, 0.8)
    scalar = compute_gae(
        (rewards @ weights)[..., None],
        (values @ weights)[..., None],
        dones,
        (next_value @ weights)[..., None],
        last_done,
        0.9,
        0.8,
    )
    assert vector.shape == (20, 3, 2)
    torch.testing.assert_close((vector @ weights)[..., None], scalar)


def test_advantages_are_normalised_per_objective_then_weighed():
    # of the trained ones (0, 1): carbon 1, 3 has mean 2 and deviation 1; thaw 10, 50 has 30 and 20
    advantages = torch.tensor([[1.0, 10.0], [3.0, 50.0], [4.0, 50.0]])
    weighed = weigh_advantages(advantages, torch.tensor([[1.0, 0.0], [0.25, 0.75], [0.5, 0.5]]), np.array([0, 1]))
    torch.testing.assert_close(weighed, torch.tensor([-1.0, 1.0, 1.5]))


# --------------------------------------------------------------------------------------------- curriculum


def make_curriculum(raw=False, seed=1, size=OBSERVATIONS, selector="network"):
    task = protocol.Task("sites-v0", {}, ("carbon", "thaw"), site_entries=tuple(range(43, size)))
    return Curriculum(task, Args(seed=seed, raw_selector=raw, selector=selector))


@pytest.mark.parametrize("script", [ppo_curriculum, ppo_gated])
def test_deviations_are_roots_that_every_processor_makes_alike(script):
    advantages = torch.randn((64, 500), generator=torch.Generator().manual_seed(1))
    mean = advantages.mean(dim=0)
    variance = (advantages - mean).square().mean(dim=0).numpy()
    exact = torch.from_numpy(np.sqrt(variance.astype(np.float64)).astype(np.float32))
    weights = torch.eye(500)[:64]
    expected = (weights * ((advantages - mean) / (exact + 1e-8))).sum(dim=1)
    assert torch.equal(script.weigh_advantages(advantages, weights, np.arange(64)), expected)


def test_scores_are_centred_and_scaled_over_sampled_sites():
    observations = np.zeros((1000, OBSERVATIONS), np.float32)
    observations[:, -62:] = boreal_env.sample_site_observations(range(1000))
    for seed in range(5):
        scores = make_curriculum(seed=seed).score(observations)
        logits = np.log(scores / (1 - scores))
        assert logits.mean() == pytest.approx(0, abs=1e-6)
        assert logits.std() == pytest.approx(1, abs=1e-6)
        assert 0.35 < (scores > 0.5).mean() < 0.65


def test_raw_scores_are_the_networks_own():
    observations = np.random.default_rng(0).random((50, OBSERVATIONS)).astype(np.float32)
    raw = make_curriculum(raw=True)
    sites = observations[:, -62:].astype(np.float64)
    np.testing.assert_allclose(raw.score(observations), 1 / (1 + np.exp(-raw.logit(sites))))
    assert not np.allclose(raw.score(observations), make_curriculum().score(observations))


def test_the_selector_sees_only_the_site():
    curriculum = make_curriculum()
    observations = np.random.default_rng(0).random((2, OBSERVATIONS)).astype(np.float32)
    observations[1, -62:] = observations[0, -62:]
    assert np.ptp(curriculum.score(observations)) < 1e-12


def test_without_site_observations_every_episode_is_accepted():
    assert (make_curriculum(size=43).score(np.zeros((4, 43), np.float32)) > 0.5).all()


def test_one_site_in_all_episodes_is_accepted(tmp_path):
    """This site scores below the threshold: the agent would never be trained."""
    observations = np.zeros((1, OBSERVATIONS), np.float32)
    observations[:, -62:] = boreal_env.sample_site_observations([2])
    assert make_curriculum().score(observations)[0] < 0.5
    run_script(
        SCRIPT,
        "--site-seed",
        2,
        "--vectorization",
        "lockstep",
        "--num-envs",
        2,
        "--rollout-steps",
        100,
        "--total-timesteps",
        100,
        "--eval-episodes",
        1,
        "--eval-weights",
        0.5,
        "--run-dir",
        tmp_path,
    )
    assert pd.read_csv(tmp_path / "updates.csv").selected_transitions.tolist() == [100]


def test_a_coin_accepts_half_whatever_the_site():
    curriculum = make_curriculum(selector="coin")
    scores = curriculum.score(np.zeros((10_000, 3), np.float32))
    assert (scores > 0.5).mean() == pytest.approx(0.5, abs=0.02)
    assert len(set(scores)) == 10_000 and 0 <= scores.min() and scores.max() < 1
    again, other = (make_curriculum(selector="coin", seed=seed).score(np.ones((10_000, 105))) for seed in (1, 2))
    assert (again == scores).all() and abs(np.corrcoef(other, scores)[0, 1]) < 0.05


@pytest.mark.parametrize(
    "finished, factor",
    [
        ([(0.5, 2.0, True), (0.5, 1.0, False)], 0.999),
        ([(0.5, 1.0, True), (0.5, 2.0, False)], 1.001),
        ([(0.5, 1.0, True), (0.5, 1.0, False)], 1.001),
        ([(0.5, 1.0, True), (0.5, 2.0, True)], 1),
        ([(0.5, 1.0, False)], 1),
        ([], 1),
    ],
)
def test_threshold_rule(finished, factor):
    curriculum = make_curriculum()
    curriculum.finished = finished
    counts = curriculum.update_threshold()
    assert curriculum.threshold == 0.5 * factor
    assert counts == (sum(s for *_, s in finished), sum(not s for *_, s in finished))


def test_returns_are_compared_within_their_preference_decile():
    curriculum = make_curriculum()
    # preference .95 earns about 10, preference .05 about 0: the selected episode did worse for its preference
    curriculum.finished = [(0.95, 10.0, True), (0.95, 12.0, False), (0.05, 0.0, False), (0.05, 0.0, False)]
    curriculum.update_threshold()
    assert curriculum.threshold == 0.5 * 1.001
    # the running mean remembers: decile 9 stands at 11, so a selected 11.5 is good and a skipped 0 neutral
    curriculum.finished = [(1.0, 11.5, True), (0.0, 0.0, False)]
    curriculum.update_threshold()
    assert curriculum.threshold == 0.5 * 1.001 * 0.999


def test_skipped_episodes_are_in_no_gradient(tmp_path):
    train(tmp_path, "--threshold", 1)
    trained = torch.load(tmp_path / "checkpoint.pt", weights_only=False)["agent"]
    initial = make_agent(seed=1).state_dict()
    assert all(torch.equal(trained[name], initial[name]) for name in initial)
    updates = pd.read_csv(tmp_path / "updates.csv")
    assert updates.selected_transitions.tolist() == [0, 0, 0]
    assert updates.policy_loss.isna().all()


def test_updates_use_exactly_the_steps_of_selected_episodes(finished_run):
    episodes, updates = (pd.read_csv(finished_run / f"{name}.csv") for name in ("episodes", "updates"))
    # 640 steps of 4 environments are 160 each: 16 episodes of 10 steps; rollouts end at steps 64, 128, 160
    assert len(episodes) == 64 and updates.global_step.tolist() == [256, 512, 640]
    steps = {rollout: 0 for rollout in (64, 128, 160)}
    for _, rows in episodes.groupby("env"):
        for k, selected in enumerate(rows.selected):
            for step in range(10 * k, 10 * k + 10):
                steps[next(end for end in steps if step < end)] += selected
    assert updates.selected_transitions.tolist() == list(steps.values())
    assert ((episodes.score > episodes.threshold) == episodes.selected).all()
    assert 0 < episodes.selected.mean() < 1
    assert episodes.score.nunique() == len(episodes)


def test_episodes_are_scored_by_their_own_site(tmp_path):
    train(
        tmp_path,
        "--total-timesteps",
        400,
        "--vectorization",
        "lockstep",
        "--eval-episodes",
        1,
        env_id="boreal-generalist-v0",
    )
    episodes = pd.read_csv(tmp_path / "episodes.csv")
    observations = np.zeros((len(episodes), OBSERVATIONS), np.float32)
    observations[:, -62:] = boreal_env.sample_site_observations(episodes.site_seed)
    assert len(episodes) == 8
    np.testing.assert_allclose(episodes.score, make_curriculum().score(observations), rtol=1e-6)
    filled = {"final_density", "mean_density", "final_conifer_fraction", "mean_conifer_fraction"}
    assert episodes[list(filled)].gt(0).all(axis=None)


def test_threshold_path_follows_from_the_episodes(finished_run):
    episodes, updates = (pd.read_csv(finished_run / f"{name}.csv") for name in ("episodes", "updates"))
    curriculum, start = make_curriculum(), 0
    for _, update in updates.iterrows():
        ended = episodes[(episodes.global_step > start) & (episodes.global_step <= update.global_step)]
        curriculum.finished = list(zip(ended.preference, ended.scalarized_return, ended.selected, strict=True))
        curriculum.update_threshold()
        assert update.threshold == pytest.approx(curriculum.threshold, rel=1e-8)
        start = update.global_step


@pytest.mark.slow
def test_a_coins_run_resumes_to_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder, "CHECKPOINT_STEPS", 256)
    arguments = ("--selector", "coin", "--update-epochs", 1)
    assert_goes_on_to_the_same_bytes(
        lambda folder: train(folder, *arguments, env_id="resumable_toy:resumable-toy-v0"), tmp_path
    )
    episodes = pd.read_csv(tmp_path / "whole" / "episodes.csv")
    assert episodes.score.nunique() == len(episodes) == 64 and 0.3 < episodes.selected.mean() < 0.7


# ------------------------------------------------------------------------------------------------- script


@pytest.mark.parametrize(
    "arguments",
    [["--reward-scales", 3, 0.5], ["--per-objective-advantages"], ["--per-objective-advantages", "--clip-vloss"]],
)
def test_a_flag_changes_the_updates_and_no_units(arguments, finished_run, tmp_path):
    train(tmp_path, *arguments)
    ours, default = (pd.read_csv(folder / "updates.csv") for folder in (tmp_path, finished_run))
    assert np.isfinite(ours.to_numpy()).all() and (ours.value_loss != default.value_loss).all()
    ours, default = (pd.read_csv(folder / "episodes.csv") for folder in (tmp_path, finished_run))
    if "--reward-scales" in arguments:  # the initial policy, which plays the first rollout, is the default's
        first = ours.global_step <= 256
        pd.testing.assert_frame_equal(ours[first], default[first])
    np.testing.assert_allclose(
        ours.scalarized_return,
        ours.preference * ours.carbon_return + (1 - ours.preference) * ours.thaw_return,
        rtol=1e-6,
    )


def test_reward_scales_are_of_carbon_then_thaw(tmp_path):
    """Thaw that counts nothing is thaw that is not paid."""
    train(tmp_path / "scaled", "--reward-scales", 1, 0, env_id="toy_env:toy-v0")
    train(tmp_path / "unpaid", env_id="toy_env:thawless-toy-v0")
    scaled, unpaid = (pd.read_csv(tmp_path / name / "updates.csv") for name in ("scaled", "unpaid"))
    np.testing.assert_array_equal(scaled.policy_loss, unpaid.policy_loss)


@pytest.mark.parametrize(
    "script, arguments",
    [
        ("ppo_gated", ["--rollout-steps", "100"]),
        ("ppo_curriculum", ["--rollout-steps", "100", "--selector", "coin"]),
        ("eupg_var_lambda", []),
    ],
)
def test_hiding_the_site_leaves_43_observations(script, arguments, tmp_path):
    run_script(
        f"cleanrl_style/{script}.py",
        "--hide-site",
        "--run-dir",
        tmp_path,
        "--total-timesteps",
        100,
        "--num-envs",
        2,
        "--vectorization",
        "lockstep",
        "--eval-episodes",
        1,
        "--eval-weights",
        0.5,
        *arguments,
    )
    agent = torch.load(tmp_path / "checkpoint.pt", weights_only=False)["agent"]
    accrued_returns = 2 if "eupg" in script else 0
    assert agent["actor.0.weight"].shape[1] == OBSERVATIONS - 62 + accrued_returns
    assert len(pd.read_csv(tmp_path / "evaluation.csv")) == 2


def test_same_command_twice_gives_the_same_bytes(finished_run, tmp_path):
    train(tmp_path / "second")
    names = {path.name for path in finished_run.iterdir()}
    assert names == {
        "config.json",
        "episodes.csv",
        "updates.csv",
        "evaluation.csv",
        "timing.csv",
        "checkpoint.pt",
        "policy.pt",
        "summary.png",
    }
    for name in names - {"timing.csv"}:
        assert (finished_run / name).read_bytes() == (tmp_path / "second" / name).read_bytes(), name


def test_another_seed_gives_another_run(finished_run, tmp_path):
    train(tmp_path / "second", "--seed", 2)
    assert (finished_run / "episodes.csv").read_bytes() != (tmp_path / "second" / "episodes.csv").read_bytes()


def test_a_finished_run_is_left_alone(finished_run, capsys):
    before = {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in finished_run.iterdir()}
    with pytest.raises(SystemExit) as exit:
        train(finished_run)
    assert exit.value.code == 0
    assert "finished" in capsys.readouterr().out
    assert before == {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in finished_run.iterdir()}


@pytest.mark.slow
def test_learns_the_toy(tmp_path):
    train(
        tmp_path,
        "--vectorization",
        "lockstep",
        "--total-timesteps",
        25_600,
        "--num-envs",
        32,
        "--rollout-steps",
        1280,
        "--minibatch-size",
        128,
        "--learning-rate",
        0.004,
        "--eval-episodes",
        10,
        "--eval-weights",
        0,
        0.5,
        1,
        env_id="toy_env:toy-lockstep-v0",
    )
    evaluation = pd.read_csv(tmp_path / "evaluation.csv")
    returns = evaluation[evaluation.policy == "greedy"].groupby("preference").scalarized_return.mean()
    for weight in (0.0, 0.5, 1.0):
        assert returns[weight] > 0.95 * optimal_return(weight)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["--eval-weights", "nan"], "--eval-weights must lie in [0, 1], not nan"),
        (["--eval-weights", "0", "0"], "none twice"),
        (["--eval-weights", "0.1234567891", "0.1234567892"], "none twice to six digits"),
        (["--eval-episodes", "0"], "--eval-episodes must lie in [1, "),
        (["--env-id", "forest-v0"], "forest"),
        (["--env-id", "no_such_module:forest-v0"], "no_such_module"),
        (["--env-id", "CartPole-v1"], "Discrete(25)"),
        (["--num-envs", "7"], "multiple of --num-envs 7"),
        (["--num-envs", "0"], "--num-envs must lie in [1, 1000], not 0"),
        (["--total-timesteps", "3"], "--total-timesteps 3"),
        (["--gamma", "1.1"], "--gamma must lie in [0, 1], not 1.1"),
        (["--mode", "generalist", "--env-id", "boreal_env:boreal-site-specific-v0"], "contradicts"),
        (["--site-seed", "3", "--env-id", "toy_env:toy-v0"], "--site-seed is for boreal environments"),
        (["--thaw-formulation", "contrast", "--env-id", "toy_env:toy-v0"], "not for --env-id toy_env:toy-v0"),
        (["--vectorization", "lockstep", "--env-id", "toy_env:toy-v0"], "no vector entry point"),
        (["--reward-scales", "1", "-1"], "--reward-scales must lie in [0, 1000000], not -1"),
        (["--hide-site", "--mode", "site-specific"], "--env-id boreal-site-specific-v0 observes no site parameters"),
        (["--hide-site", "--env-id", "toy_env:toy-v0"], "--env-id toy_env:toy-v0 observes no site parameters"),
        (["--hide-site"], "--hide-site leaves --selector network nothing to score"),
        (["--selector", "coin", "--raw-selector"], "--raw-selector is for --selector network"),
        (["--mode", "site-specific", "--raw-selector"], "--raw-selector: boreal-site-specific-v0 shows no sites to"),
        (["--site-seed", "7", "--threshold", "0.9"], "--threshold: boreal-generalist-v0 shows no sites to choose from"),
    ],
)
def test_bad_arguments_leave_nothing_behind(arguments, message, tmp_path):
    with pytest.raises(SystemExit, match="^error: ") as exit:
        run_script(SCRIPT, "--run-dir", tmp_path / "run", *arguments)
    assert message in str(exit.value) and "\n" not in str(exit.value)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("arguments", [["--mode", "specialist"], ["--run-dir", "/dev/null/run"]])
def test_refusal_on_the_command_line(arguments, tmp_path):
    command = [sys.executable, ROOT / SCRIPT, "--env-id", "toy_env:toy-v0", *arguments]
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    result = subprocess.run(
        command, capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}
    )
    assert result.returncode != 0
    assert arguments[1] in result.stderr and "Traceback" not in result.stderr
    assert result.stdout == "" and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "given, env_id, mode, steps, envs",
    [
        ({}, "boreal-generalist-v0", "generalist", 300_000, 8),
        ({"mode": "site-specific"}, "boreal-site-specific-v0", "site-specific", 100_000, 8),
        ({"env_id": "boreal-site-specific-v0"}, "boreal-site-specific-v0", "site-specific", 100_000, 8),
        ({"env_id": "boreal_env:boreal-generalist-v0"}, "boreal-generalist-v0", "generalist", 300_000, 8),
        ({"env_id": "boreal-balanced-v0"}, "boreal-balanced-v0", "generalist", 300_000, 8),
        ({"vectorization": "lockstep"}, "boreal-generalist-v0", "generalist", 300_000, 32),
    ],
)
def test_defaults_that_depend_on_others(given, env_id, mode, steps, envs):
    args = Args(**given)
    protocol.make_task(args)
    assert (args.env_id, args.mode, args.total_timesteps, args.num_envs) == (env_id, mode, steps, envs)


def test_configuration_names_no_place(finished_run):
    config = json.loads((finished_run / "config.json").read_text())
    assert config["arguments"]["env_id"] == "toy_env:toy-sites-v0" and config["arguments"]["gamma"] == 0.99
    assert "run_dir" not in config["arguments"] and str(finished_run.parent) not in json.dumps(config)
