import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from scripts import ROOT, run_script, without_blocks
from test_ppo_curriculum import OBSERVATIONS, make_agent
from toy_env import optimal_return

from cleanrl_style.ppo_gated import Args, ppo_losses


def body(script):
    """A script without its header comment and the docstring of its arguments."""
    source = (ROOT / "cleanrl_style" / f"{script}.py").read_text()
    source = source[source.index("import math") :]
    start = source.index('    """')
    return source[:start] + source[source.index('"""', start + 7) :]


def test_ppo_curriculum_is_ppo_gated_and_its_marked_blocks():
    assert without_blocks(body("ppo_curriculum"), "CURRICULUM") == body("ppo_gated")
    assert "CURRICULUM" not in body("ppo_gated") and "urriculum" not in body("ppo_gated")


def numpy_losses(agent, x, mask, action, old_logprob, advantage, target, old_value, clip, norm_adv, clip_vloss):
    """The losses of Schulman et al. (2017) by loops over transitions, from the network's weights."""
    w = {name: value.detach().numpy() for name, value in agent.named_parameters()}

    def layers(name, h):
        for k in (0, 2):
            h = np.tanh(w[f"{name}.{k}.weight"] @ h + w[f"{name}.{k}.bias"])
        return h

    policy, value, entropy = [], [], []
    if norm_adv:
        advantage = (advantage - advantage.mean()) / (advantage.std(ddof=1) + 1e-8)
    for i in range(len(x)):
        hidden = layers("actor", x[i])
        odds_of_all = np.exp(w["actor.4.weight"] @ hidden + w["actor.4.bias"])
        plant_or_not = odds_of_all[:2] * [mask[i, :15].any(), mask[i, 15:].any()]
        probabilities = []
        for k, part in enumerate((slice(0, 15), slice(15, 25))):
            odds = odds_of_all[2:][part] * mask[i, part]
            probabilities += list(plant_or_not[k] / plant_or_not.sum() * odds / max(odds.sum(), 1e-300))
        ratio = probabilities[action[i]] / np.exp(old_logprob[i])
        policy.append(-min(ratio * advantage[i], np.clip(ratio, 1 - clip, 1 + clip) * advantage[i]))
        entropy.append(-sum(p * np.log(p) for p in probabilities if p > 0))
        v = (w["critic.4.weight"] @ layers("critic", x[i]) + w["critic.4.bias"])[0]
        errors = [(v - target[i]) ** 2]
        if clip_vloss:
            errors.append((old_value[i] + np.clip(v - old_value[i], -clip, clip) - target[i]) ** 2)
        value.append(0.5 * max(errors))
    return np.mean(policy), np.mean(value), np.mean(entropy)


@pytest.mark.parametrize("norm_adv", [True, False])
@pytest.mark.parametrize("clip_vloss", [True, False])
def test_losses_and_their_gradient_are_those_of_an_independent_implementation(norm_adv, clip_vloss):
    agent = make_agent().double()
    with torch.no_grad():
        agent.actor[4].weight *= 50  # far from uniform: ratios beyond the clip
    generator = np.random.default_rng(0)
    n = 16
    x, mask = generator.normal(size=(n, OBSERVATIONS)), generator.random((n, 25)) < 0.5
    mask[:, 12] = mask[: n // 2, 20] = True
    mask[n // 2 :, 15:] = False
    action = np.array([generator.choice(np.flatnonzero(row)) for row in mask])
    batch = [x, mask, action]
    with torch.no_grad():
        logprob = agent.get_action_and_value(*map(torch.tensor, batch))[1].numpy()
    batch += [logprob + generator.normal(0, 0.3, n), *generator.normal(size=(3, n))]
    args = replace(Args(), norm_adv=norm_adv, clip_vloss=clip_vloss)

    def reference():
        return numpy_losses(agent, *batch, args.clip_coef, norm_adv, clip_vloss)

    pg_loss, v_loss, entropy, _, _, clip_fraction = ppo_losses(agent, *map(torch.tensor, batch), args)
    np.testing.assert_allclose([part.item() for part in (pg_loss, v_loss, entropy)], reference(), rtol=1e-9)
    assert 0.2 < clip_fraction < 0.8

    (pg_loss + v_loss + entropy).backward()
    for parameter in (agent.actor[4].weight, agent.actor[4].bias, agent.actor[0].weight, agent.critic[4].weight):
        flat, h = parameter.detach().view(-1), 1e-6
        k = int(parameter.grad.abs().argmax())
        sums = []
        for step in (h, -2 * h):
            flat[k] += step
            sums.append(sum(reference()))
        flat[k] += h
        assert (sums[0] - sums[1]) / (2 * h) == pytest.approx(parameter.grad.view(-1)[k].item(), rel=1e-5)


@pytest.mark.slow
def test_learns_the_toy(tmp_path):
    run_script(
        "cleanrl_style/ppo_gated.py",
        "--env-id",
        "toy_env:toy-lockstep-v0",
        "--run-dir",
        tmp_path,
        "--vectorization",
        "lockstep",
        "--total-timesteps",
        20_480,
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
    )
    evaluation = pd.read_csv(tmp_path / "evaluation.csv")
    returns = evaluation[evaluation.policy == "greedy"].groupby("preference").scalarized_return.mean()
    assert all(returns[weight] > 0.95 * optimal_return(weight) for weight in (0.0, 0.5, 1.0))


def test_a_tracker_is_allowed_once(tmp_path):
    with pytest.raises(SystemExit, match="--track tensorboard tensorboard: each once is allowed"):
        run_script("cleanrl_style/ppo_gated.py", "--track", "tensorboard", "tensorboard", "--run-dir", tmp_path / "run")


def test_tracking_without_the_package_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "wandb", None)
    with pytest.raises(SystemExit, match="--track wandb: the package is not installed"):
        run_script("cleanrl_style/ppo_gated.py", "--track", "wandb", "--run-dir", tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_single_transition_has_no_explained_variance(tmp_path, recwarn):
    run_script(
        "cleanrl_style/ppo_gated.py",
        "--env-id",
        "toy_env:toy-v0",
        "--run-dir",
        tmp_path,
        "--total-timesteps",
        1,
        "--num-envs",
        1,
        "--eval-episodes",
        1,
        "--eval-weights",
        0.5,
    )
    assert pd.read_csv(tmp_path / "updates.csv").explained_variance.isna().all()
    assert not [warning.message for warning in recwarn if warning.category is not DeprecationWarning]


def test_one_site_under_all_weathers(tmp_path):
    run_script(
        "cleanrl_style/ppo_gated.py",
        "--site-seed",
        3,
        "--vectorization",
        "lockstep",
        "--num-envs",
        2,
        "--rollout-steps",
        100,
        "--total-timesteps",
        100,
        "--eval-episodes",
        2,
        "--eval-weights",
        0.5,
        "--run-dir",
        tmp_path / "run",
    )
    for name in ("episodes", "evaluation"):
        table = pd.read_csv(tmp_path / "run" / f"{name}.csv")
        assert set(table.site_seed) == {3} and table.thaw_return.nunique() > 1
