import difflib
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
import torch
from scripts import ROOT, run_script
from toy_env import ToyVectorEnv, optimal_return

from cleanrl_style import eupg_fixed_lambda, eupg_var_lambda, protocol
from cleanrl_style.eupg_var_lambda import Agent, compute_utilities, eupg_loss, policy_input

STEPS, SIZE = 6, 5


def make_agent(masked=True):
    torch.manual_seed(0)
    agent = Agent(SimpleNamespace(single_observation_space=gym.spaces.Box(0, 1, (SIZE,))), masked=masked).double()
    with torch.no_grad():
        agent.actor[-1].weight *= 100  # far from uniform
    return agent


@pytest.fixture
def episode():
    """A recorded episode of one environment: x, masks, actions, rewards (steps, 2), preference."""
    generator = np.random.default_rng(3)
    rewards, preference = generator.normal(size=(STEPS, 2)), 0.3
    accrued = np.vstack([np.zeros(2), np.cumsum(rewards, axis=0)[:-1]])
    masks = generator.random((STEPS, 25)) < 0.6
    masks[:, 12] = True
    actions = np.array([generator.choice(np.flatnonzero(mask)) for mask in masks])
    return np.hstack([generator.random((STEPS, SIZE)), accrued / 50]), masks, actions, rewards, preference


def numpy_gradient(agent, x, masks, actions, utilities):
    """Gradient of -mean_t utility_t log pi(a_t | x_t) in every parameter, by hand."""
    parameters = {name: value.detach().numpy() for name, value in agent.named_parameters()}
    (w1, b1, w2, b2, w3, b3), n = parameters.values(), len(x)
    h1 = np.tanh(x @ w1.T + b1)
    h2 = np.tanh(h1 @ w2.T + b2)
    odds = np.exp(h2 @ w3.T + b3) * masks
    probabilities = odds / odds.sum(axis=1, keepdims=True)
    # d log pi(a) / d logit_k = [k = a] - pi(k)
    d3 = (probabilities - np.eye(25)[actions]) * utilities[:, None] / n
    d2 = (d3 @ w3) * (1 - h2**2)
    d1 = (d2 @ w2) * (1 - h1**2)
    return [d1.T @ x, d1.sum(0), d2.T @ h1, d2.sum(0), d3.T @ h2, d3.sum(0)]


@pytest.mark.parametrize("which", ["total", "future"])
@pytest.mark.parametrize(("gamma", "masked"), [(1.0, True), (0.9, True), (1.0, False)])
def test_gradient_is_that_of_a_numpy_implementation(episode, which, gamma, masked):
    x, masks, actions, rewards, preference = episode
    scalarized = preference * rewards[:, 0] + (1 - preference) * rewards[:, 1]
    discounts = gamma ** np.arange(STEPS)
    if which == "total":
        expected = np.full(STEPS, (discounts * scalarized).sum())
    else:
        expected = np.array([(discounts[: STEPS - t] * scalarized[t:]).sum() for t in range(STEPS)])
    utilities = compute_utilities(rewards[:, None], np.array([[preference, 1 - preference]]), gamma, which)[:, 0]
    np.testing.assert_allclose(utilities, expected, rtol=1e-12)

    agent = make_agent(masked)
    loss, _ = eupg_loss(agent, torch.tensor(x), torch.tensor(masks), torch.tensor(actions), torch.tensor(utilities))
    loss.backward()
    choice = masks if masked else np.ones_like(masks)
    gradients = numpy_gradient(agent, x, choice, actions, expected)
    for parameter, gradient in zip(agent.parameters(), gradients, strict=True):
        np.testing.assert_allclose(parameter.grad.numpy(), gradient, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("which", ["total", "future"])
def test_others_baseline_leaves_each_episode_out_of_its_own(which):
    rewards = np.arange(12.0).reshape(2, 3, 2) ** 2  # 2 steps, 3 episodes
    preferences = np.array([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]])
    returns = rewards[::-1].cumsum(axis=0)[::-1] if which == "future" else np.stack([rewards.sum(axis=0)] * 2)
    for i, preference in enumerate(preferences):
        excess = returns[:, i] - returns[:, [k for k in range(3) if k != i]].mean(axis=1)
        expected = excess @ preference
        utilities = compute_utilities(rewards, preferences, 1.0, which, "others")[:, i]
        np.testing.assert_allclose(utilities, expected, rtol=1e-12)


def test_others_baseline_needs_others():
    with pytest.raises(SystemExit, match="--baseline others .* --num-envs 2 or more is allowed"):
        run_script("cleanrl_style/eupg_fixed_lambda.py", "--baseline", "others", "--num-envs", 1)


def test_masked_actions_have_no_probability_and_the_others_all_of_it(episode):
    x, masks, *_ = episode
    probabilities = make_agent().get_distribution(torch.tensor(x), torch.tensor(masks)).probs.detach().numpy()
    assert (probabilities[~masks] == 0).all() and (probabilities[masks] > 0).all()
    np.testing.assert_allclose(probabilities.sum(axis=1), 1)


def test_evaluation_gives_the_policy_the_returns_so_far():
    """Played again by hand: the same x at every step."""
    evaluated = []
    task = protocol.Task.of("toy_env:toy-v0")
    actions = np.random.default_rng(0).integers(25, size=10)

    def policy(observations, masks, accrued_returns):
        evaluated.append(policy_input(observations, accrued_returns))
        return np.eye(25)[[actions[len(evaluated) - 1]]]

    protocol.evaluate(task, policy, [0.25], 1, policies=("greedy",))
    env = gym.make("toy_env:toy-v0", disable_env_checker=True)
    next_obs, _ = env.reset(seed=protocol.FIRST_EVALUATION_SEED, options={"preference": 0.25})
    episode_returns = np.zeros((1, 2))
    for action, x in zip(actions, evaluated, strict=True):
        torch.testing.assert_close(policy_input(next_obs[None], episode_returns), x, rtol=0, atol=0)
        next_obs, reward, *_ = env.step(action)
        episode_returns += reward
    assert evaluated[-1][0, -2:].abs().sum() > 0.1


class RecordedToy(ToyVectorEnv):
    """Keeps what it gave and was given."""

    seen, done, paid = [], [], []

    def _observe(self):
        self.seen.append(super()._observe())
        return self.seen[-1]

    def step(self, actions):
        observations, rewards, *rest = super().step(actions)
        self.done.append(actions)
        self.paid.append(rewards)
        return observations, rewards, *rest


def test_the_first_update_is_that_of_its_first_episodes(tmp_path):
    """From what the environment gave in the script's training, by the functions that are tested above."""
    gym.register("recorded-toy-v0", "toy_env:ToyEnv", vector_entry_point=lambda num_envs: RecordedToy(num_envs))
    given = ("--env-id", "recorded-toy-v0", "--vectorization", "lockstep", "--num-envs", 3, "--total-timesteps", 30)
    run_script("cleanrl_style/eupg_var_lambda.py", *given, "--eval-episodes", 1, "--run-dir", tmp_path)
    seen, actions, rewards = (
        np.stack([of_all for of_all in kept if len(of_all) == 3][:10])  # not of the one that is tried before
        for kept in (RecordedToy.seen, RecordedToy.done, RecordedToy.paid)
    )
    accrued = np.cumsum(rewards, axis=0) - rewards
    x = torch.cat([policy_input(*one) for one in zip(seen, accrued, strict=True)])
    masks = torch.from_numpy(np.where(np.arange(25) < 15, True, seen[:, :, [2]] == 0).reshape(-1, 25))
    weights = np.stack([seen[0, :, 0], 1 - seen[0, :, 0]], axis=1).astype(float)
    utilities = compute_utilities(rewards, weights, 1.0, "future")
    torch.manual_seed(1)
    agent = Agent(SimpleNamespace(single_observation_space=gym.spaces.Box(0, 1, (3,))))
    loss, _ = eupg_loss(agent, x, masks, torch.from_numpy(actions.ravel()), torch.from_numpy(utilities.ravel()).float())
    loss.backward()
    norm = torch.stack([p.grad.norm() for p in agent.parameters()]).norm().item()
    first = pd.read_csv(tmp_path / "updates.csv").iloc[0]
    np.testing.assert_allclose((first.policy_loss, first.gradient_norm), (loss.item(), norm), rtol=1e-4)


def learn(script, folder, *arguments):
    """Return of the greedy policy per weight, as the toy gives it that is not centred."""
    run_script(
        f"cleanrl_style/{script}.py",
        "--env-id",
        "toy_env:toy-centred-v0",
        "--run-dir",
        folder,
        "--num-envs",
        8,
        "--eval-episodes",
        10,
        *arguments,
    )
    evaluation = pd.read_csv(folder / "evaluation.csv")
    return evaluation[evaluation.policy == "greedy"].groupby("preference").scalarized_return.mean() + 6


@pytest.mark.slow
def test_fixed_lambda_learns_the_toy(tmp_path):
    returns = learn(
        "eupg_fixed_lambda", tmp_path, "--preference", 1, "--learning-rate", 0.005, "--total-timesteps", 16_000
    )
    assert returns.index.tolist() == [1.0]
    assert returns[1.0] > 0.95 * optimal_return(1)
    assert (pd.read_csv(tmp_path / "episodes.csv").preference == 1).all()


@pytest.mark.slow
def test_variable_lambda_learns_to_follow_the_preference(tmp_path):
    """Without a bonus for entropy the policy settles before it has told the preferences apart."""
    run_script(
        "cleanrl_style/eupg_var_lambda.py",
        *("--env-id", "toy_env:toy-lockstep-v0", "--vectorization", "lockstep", "--num-envs", 32),
        *("--total-timesteps", 160_000, "--utility", "future", "--baseline", "others"),
        *("--ent-coef", 0.05, "--learning-rate", 0.004),
        *("--eval-episodes", 10, "--eval-weights", 0, 0.5, 1, "--run-dir", tmp_path),
    )
    evaluation = pd.read_csv(tmp_path / "evaluation.csv")
    returns = evaluation[evaluation.policy == "greedy"].groupby("preference").scalarized_return.mean()
    assert all(returns[weight] > 0.9 * optimal_return(weight) for weight in (0.0, 0.5, 1.0))
    assert pd.read_csv(tmp_path / "episodes.csv").preference.nunique() > 1000


def test_a_budget_without_room_for_a_batch_leaves_no_folder(tmp_path):
    with pytest.raises(SystemExit, match="--total-timesteps 49 has no room for a batch.*50 steps"):
        run_script("cleanrl_style/eupg_var_lambda.py", "--total-timesteps", 49, "--run-dir", tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_episodes_of_another_length_than_those_before_are_refused(tmp_path):
    flags = ("--env-id", "toy_env:uneven-v0", "--total-timesteps", 100, "--run-dir", tmp_path)
    with pytest.raises(
        SystemExit, match="EUPG needs episodes of one length, and one ended at step 1[01], others did not"
    ):
        run_script("cleanrl_style/eupg_var_lambda.py", *flags)


def test_the_scripts_differ_in_the_preference_and_nothing_else():
    fixed, variable = ((ROOT / "cleanrl_style" / f"eupg_{name}_lambda.py").read_text() for name in ("fixed", "var"))
    agents = [source.split("class Agent")[1].splitlines() for source in (fixed, variable)]
    differing = [line[2:] for line in difflib.ndiff(*agents) if line[0] in "+-" and line[2:].strip()]
    assert 0 < len(differing) <= 6 and all("preference" in line or "make_task" in line for line in differing)
    fields = [set(script.Args.__dataclass_fields__) for script in (eupg_fixed_lambda, eupg_var_lambda)]
    assert fields[0] ^ fields[1] == {"preference", "eval_weights"}


def test_both_vectorizations_give_the_same_bytes(tmp_path):
    """A batch is eight episodes in either, of the same seeds: only the speed differs."""
    given = ("--env-id", "quick_env:quick-v0", "--num-envs", 8, "--total-timesteps", 128)
    for vectorization in ("async", "lockstep"):
        run_script(
            "cleanrl_style/eupg_var_lambda.py",
            *(*given, "--vectorization", vectorization, "--run-dir", tmp_path / vectorization),
            *("--eval-episodes", 1, "--eval-weights", 0, 1),
        )
    for name in ("episodes", "updates", "evaluation"):
        first, second = ((tmp_path / kind / f"{name}.csv").read_bytes() for kind in ("async", "lockstep"))
        assert first == second and first.count(b"\n") > 2
