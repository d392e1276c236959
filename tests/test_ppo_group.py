import subprocess
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
import torch
from resumed import assert_goes_on_to_the_same_bytes, assert_same_bytes
from scripts import ROOT, run_script
from toy_env import optimal_return

from cleanrl_style import protocol
from cleanrl_style.ppo_group import Agent, less_the_others, ppo_losses, spread_preferences, weigh_advantages
from cleanrl_style.protocol import run_folder

SCRIPT = "cleanrl_style/ppo_group.py"
TOY = "resumable_toy:resumable-toy-v0"
THREE = "toy_env:toy-three-v0"


def train(folder, *arguments, env_id=TOY, steps=160):
    given = ("--num-envs", 4, "--group-size", 2, "--rollout-steps", 80, "--minibatch-size", 40)
    evaluation = ("--eval-episodes", 2, "--eval-weights", *((0, 1) if env_id != THREE else (1, 0, 0, 0, 0, 1)))
    run_script(
        SCRIPT, "--env-id", env_id, "--run-dir", folder, "--total-timesteps", steps, *given, *evaluation, *arguments
    )


# -------------------------------------------------------------------------------------------------- the idea


def test_what_a_site_adds_to_all_of_a_group_is_gone():
    generator = torch.Generator().manual_seed(0)
    rewards = torch.rand((5, 6, 2), generator=generator, dtype=torch.double)
    of_site_and_weather = 100 * torch.rand((5, 2, 1, 2), generator=generator, dtype=torch.double)
    added = of_site_and_weather.expand(5, 2, 3, 2).reshape(5, 6, 2)
    torch.testing.assert_close(less_the_others(rewards + added, 3), less_the_others(rewards, 3))


def test_a_stand_keeps_the_whole_of_its_own_reward():
    """Unlike less the mean of all, which has an own part: the expected gradient is that of the reward."""
    rewards = torch.zeros(1, 4, 2)
    rewards[0, 1, 0] = 3.0
    torch.testing.assert_close(less_the_others(rewards, 4)[0, :, 0], torch.tensor([-1.0, 3.0, -1.0, -1.0]))
    assert torch.equal(less_the_others(rewards, 1), rewards)


def test_advantages_are_divided_by_a_deviation_of_the_preference_alone():
    generator = np.random.default_rng(0)
    advantages = torch.tensor(generator.normal(size=(500, 3)) * [1, 5, 0.2] @ generator.normal(size=(3, 3)))
    weight = np.array([0.2, 0.5, 0.3])
    weights = torch.tensor(weight).expand(500, 3)
    weighed, plain = weigh_advantages(advantages, weights).numpy(), advantages.numpy() @ weight
    np.testing.assert_allclose(weighed, plain / plain.std(ddof=1), rtol=1e-6)


def test_advantages_are_divided_by_roots_that_every_processor_makes_alike():
    generator = torch.Generator().manual_seed(1)
    advantages, weight = torch.randn((1000, 2), generator=generator), torch.rand(1000, generator=generator)
    weights = torch.stack([weight, 1 - weight], dim=1)
    variance = ((weights @ advantages.T.cov()) * weights).sum(dim=1)
    exact = torch.from_numpy(np.sqrt(variance.numpy().astype(np.float64)).astype(np.float32))
    assert torch.equal(weigh_advantages(advantages, weights), (weights * advantages).sum(dim=1) / (exact + 1e-8))


def test_preferences_of_a_group_are_spread():
    np.random.seed(0)  # noqa: NPY002 (that generator is the scripts')
    weights = np.sort(spread_preferences(100, 8, 2).reshape(100, 8))
    assert (np.floor(weights * 8) == np.arange(8)).all()
    assert np.ptp(weights * 8 % 1) > 0.99


def test_preferences_of_three_objectives_are_uniform_and_spread():
    np.random.seed(0)  # noqa: NPY002 (that generator is the scripts')
    first = spread_preferences(2000, 8, 3)
    assert first.shape == (16_000, 2) and (first >= 0).all() and (first.sum(axis=1) <= 1).all()
    weights = np.column_stack([first, 1 - first.sum(axis=1)])
    # uniform on the simplex: means 1/3, variances 1/18
    np.testing.assert_allclose(weights.mean(axis=0), 1 / 3, atol=0.005)
    np.testing.assert_allclose(weights.var(axis=0), 1 / 18, rtol=0.05)
    # means of groups differ less than those of eight independent draws
    assert (weights.reshape(-1, 8, 3).mean(axis=1).var(axis=0) < 0.6 / 18 / 8).all()


def test_values_are_of_their_unit_and_the_loss_of_none():
    agent = agent_of_three_entries()
    x, mask = torch.randn(6, 3), torch.ones(6, 25, dtype=torch.bool)
    batch = (torch.zeros(6, dtype=torch.long), torch.zeros(6), torch.zeros(6))
    raw, target = agent.get_value(x).detach(), torch.randn(6, 2)
    args = SimpleNamespace(clip_coef=0.2)
    loss = ppo_losses(agent, x, mask, *batch, target, args)[1]
    agent.value_mean += torch.tensor([3.0, -20.0])
    agent.value_std *= torch.tensor([0.1, 10.0])
    torch.testing.assert_close(agent.get_value(x), raw * agent.value_std + agent.value_mean)
    target = target * agent.value_std + agent.value_mean
    scaled = ppo_losses(agent, x, mask, *batch, target, args)[1]
    torch.testing.assert_close(scaled, loss)


def agent_of_three_entries(**arguments):
    torch.manual_seed(0)
    return Agent(SimpleNamespace(single_observation_space=gym.spaces.Box(0, 1, (3,))), **arguments)


@pytest.mark.parametrize("objectives", [2, 3])
def test_at_one_objective_s_weight_alone_its_logits_decide(objectives):
    agent, mask = (
        agent_of_three_entries(num_values=objectives, num_logits=objectives),
        torch.ones(1, 25, dtype=torch.bool),
    )
    for k in range(objectives):
        x = torch.full((1, 3), 0.3)
        x[:, : objectives - 1] = torch.eye(objectives)[k, :-1]
        gate, other, plant = agent.actor(x)[0, k].split([2, 15, 10])
        gate = gate.log_softmax(0)
        expected = torch.cat([gate[0] + other.log_softmax(0), gate[1] + plant.log_softmax(0)])
        torch.testing.assert_close(agent.get_logprobs(x, mask)[0], expected)


def test_one_set_of_logits_is_not_weighed():
    agent, mask = agent_of_three_entries(num_logits=1), torch.ones(1, 25, dtype=torch.bool)
    x = torch.tensor([[0.2, 0.5, 0.7]])
    gate = agent.actor(x)[0, 0, :2].log_softmax(0)
    torch.testing.assert_close(agent.get_logprobs(x, mask)[0, 15:].exp().sum(), gate[1].exp())


# ------------------------------------------------------------------------------------------------- script


@pytest.mark.slow
def test_learns_the_toy(tmp_path):
    train(
        tmp_path,
        *("--vectorization", "lockstep", "--num-envs", 64, "--group-size", 8),
        *("--rollout-steps", 640, "--minibatch-size", 128, "--learning-rate", 0.004),
        *("--eval-episodes", 10, "--eval-weights", 0, 0.5, 1),
        env_id="toy_env:toy-lockstep-v0",
        steps=25_600,
    )
    evaluation = pd.read_csv(tmp_path / "evaluation.csv")
    returns = evaluation[evaluation.policy == "greedy"].groupby("preference").scalarized_return.mean()
    assert all(returns[weight] > 0.95 * optimal_return(weight) for weight in (0.0, 0.5, 1.0))


@pytest.mark.parametrize("env_id", [TOY, THREE])
def test_a_group_shares_dice_and_not_the_preference(env_id, tmp_path):
    train(tmp_path, env_id=env_id)
    episodes = pd.read_csv(tmp_path / "episodes.csv")
    weights = [name for name in episodes if name == "preference" or name.startswith("weight_")]
    assert len(episodes) == 16 and len(weights) == (3 if env_id == THREE else 1)
    assert episodes[weights].drop_duplicates().shape[0] == 16
    if env_id == THREE:
        np.testing.assert_allclose(episodes[weights].sum(axis=1), 1)
    else:  # one in each half
        groups = (episodes.preference.to_numpy().reshape(-1, 2) < 0.5).sum(axis=1)
        assert (groups == 1).all()
    assert np.isfinite(pd.read_csv(tmp_path / "updates.csv").to_numpy()).all()


def test_groups_share_site_start_and_weather_async_as_in_lockstep(tmp_path):
    steps = ("--rollout-steps", 200, "--update-epochs", 1, "--eval-episodes", 1)
    for how in ("async", "lockstep"):
        train(tmp_path / how, "--vectorization", how, *steps, env_id="boreal-generalist-v0", steps=400)
    episodes = pd.read_csv(tmp_path / "async" / "episodes.csv")
    sites = episodes.site_seed.to_numpy().reshape(-1, 2)
    assert len(sites) == 4 and (sites[:, 0] == sites[:, 1]).all() and len(set(sites[:, 0])) == 4
    same = ("timing.csv", "config.json", "checkpoint.pt", "summary.png")
    assert_same_bytes(tmp_path / "async", tmp_path / "lockstep", same)


def test_what_all_of_a_group_lose_teaches_nothing(tmp_path):
    """In a group of two what both lose is gone to the bit; without groups it is not."""
    for size in (2, 1):
        for toy in ("resumable-toy-v0", "shifted-toy-v0"):
            train(tmp_path / f"{toy}-{size}", "--group-size", size, env_id=f"resumable_toy:{toy}")
        one, other = (
            torch.load(tmp_path / f"{toy}-{size}" / "policy.pt", weights_only=True)["agent"]["actor.0.weight"]
            for toy in ("resumable-toy-v0", "shifted-toy-v0")
        )
        assert torch.equal(one, other) == (size == 2)


@pytest.mark.parametrize("arguments", [(), ("--group-size", 1, "--rollout-steps", 48)])
def test_killed_and_resumed_is_as_never_killed(arguments, tmp_path, monkeypatch):
    """Also without groups where rollouts cut episodes."""
    monkeypatch.setattr(run_folder, "CHECKPOINT_STEPS", 64)
    assert_goes_on_to_the_same_bytes(lambda folder: train(folder, *arguments), tmp_path)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("--group-size", 3), "--num-envs 4: a multiple of --group-size 3 is allowed"),
        (("--group-size", 0), r"--group-size must lie in \[1, 1000\], not 0"),
        (("--gae-lambda", 1, 1, 1), r"--gae-lambda: 1 number or 2 are allowed, not \[1.0, 1.0, 1.0\]"),
        (("--gae-lambda", 1.5, 1), r"--gae-lambda must lie in \[0, 1\], not 1.5"),
    ],
)
def test_bad_values_end_before_anything_is_written(arguments, message, tmp_path):
    with pytest.raises(SystemExit, match=message):
        train(tmp_path / "run", *arguments)
    assert not (tmp_path / "run").exists()


def test_a_loaded_agent_observes_as_in_training(tmp_path):
    train(tmp_path)
    agent = torch.load(tmp_path / "policy.pt", weights_only=True)["agent"]
    assert 0.4 < agent["observation_mean"][0] < 0.6 and 0.2 < agent["observation_std"][0] < 0.4
    written = pd.read_csv(tmp_path / "evaluation.csv")
    again, _ = protocol.evaluate(protocol.Task.of(TOY), protocol.load_policy(tmp_path), (0, 1), 2)
    pd.testing.assert_frame_equal(written, again, rtol=1e-8, check_dtype=False)


def test_its_difference_to_gated_ppo_is_as_long_as_its_page_says():
    files = [ROOT / "cleanrl_style" / f"ppo_{name}.py" for name in ("gated", "group")]
    lines = subprocess.run(["diff", *files], capture_output=True, text=True).stdout.splitlines()
    gone, new = (sum(line.startswith(mark) for line in lines) for mark in "<>")
    page = (ROOT / "docs" / "algorithms" / "ppo_group.md").read_text(encoding="utf-8")
    assert f"{gone} lines gone, {new} new" in page
    assert gone + new < 200


@pytest.mark.parametrize("name", ["eupg_var_lambda", "ppo_gated", "ppo_curriculum", "ppo_group"])
def test_an_environment_of_one_preference_is_refused(tmp_path, name):
    gym.register("one-preference-v0", "boreal_env:BorealEnv", kwargs={"years": 2, "fixed_preference": 0.3})
    given = ("--env-id", "one-preference-v0", "--run-dir", tmp_path / "run", "--vectorization", "lockstep")
    try:
        with pytest.raises(SystemExit, match="one-preference-v0: it has a fixed_preference, and training is over all"):
            run_script(f"cleanrl_style/{name}.py", *given)
    finally:
        del gym.registry["one-preference-v0"]
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("ratio, advantage, loss", [(2, 1, -1.2), (2, -1, 2.0), (0.5, 1, -0.5), (0.5, -1, 0.8)])
def test_the_clipped_loss_by_hand(ratio, advantage, loss):
    agent, x, mask = agent_of_three_entries(), torch.randn(1, 3), torch.ones(1, 25, dtype=torch.bool)
    action = torch.zeros(1, dtype=torch.long)
    old = agent.get_logprobs(x, mask)[:, 0].detach() - np.log(ratio)
    target = agent.get_value(x).detach() + 2
    args = SimpleNamespace(clip_coef=0.2)
    policy_loss, value_loss, *_ = ppo_losses(
        agent, x, mask, action, old, torch.tensor([float(advantage)]), target, args
    )
    assert policy_loss.item() == pytest.approx(loss, rel=1e-5) and value_loss.item() == pytest.approx(2.0, rel=1e-5)
