"""Plan regression: what is fitted, which plan is played, which plans are kept, and the script."""

import json

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
import torch
from resumed import assert_goes_on_to_the_same_bytes
from scripts import run_script

from cleanrl_style import protocol
from cleanrl_style.plan_regression import PLANS, Agent, closest_to_the_best, make_policy
from cleanrl_style.protocol import run_folder

gym.register("no-site-v0", entry_point="boreal_env:BorealEnv", kwargs={"observation_groups": ("preference", "climate")})

SCRIPT = "cleanrl_style/plan_regression.py"
QUICK = "quick_env:quick-v0"


def fitted(sites, returns, ridge=0.0, plans=(12, 20, 24), inputs=(1, 2)):
    """An agent of observations that begin with the preference."""
    agent = Agent(None, plans, inputs, returns.shape[2])
    agent.fit(torch.tensor(sites), torch.tensor(returns), ridge)
    return agent


# -------------------------------------------------------------------------------------------- the regression


def test_a_linear_world_is_learned_whatever_sites_add_to_all_plans():
    generator = np.random.default_rng(0)
    sites, slopes = generator.normal(3, 2, (40, 2)), generator.normal(size=(2, 3, 2))
    returns = np.einsum("ni,ipm->npm", sites, slopes) + generator.normal(size=(3, 2))
    level = 100 * generator.normal(size=(40, 1, 2))
    others = torch.tensor(generator.normal(3, 2, (5, 2)))
    agent = fitted(sites, returns + level)
    torch.testing.assert_close(agent.predict(others), fitted(sites, returns).predict(others))
    known = np.einsum("ni,ipm->npm", sites, slopes - slopes.mean(axis=1, keepdims=True))
    left = agent.predict(torch.tensor(sites)).numpy() - known
    np.testing.assert_allclose(left, np.broadcast_to(left[:1], left.shape), atol=1e-9)  # but for what plans are worth


def test_the_penalty_leaves_the_plans_own_means():
    generator = np.random.default_rng(1)
    sites, returns = generator.normal(size=(30, 2)), generator.normal(size=(30, 3, 2))
    apart = returns.mean(axis=0) - returns.mean(axis=(0, 1))
    slopes = fitted(sites, returns, ridge=1e12).slopes.numpy()
    np.testing.assert_allclose(slopes[0], apart, atol=1e-9)
    np.testing.assert_allclose(slopes[1:], 0.0, atol=1e-9)


def test_what_all_sites_have_in_common_decides_nothing_elsewhere():
    generator = np.random.default_rng(2)
    sites = np.column_stack([generator.normal(size=20), np.full(20, 0.3)])
    agent = fitted(sites, generator.normal(size=(20, 3, 2)), ridge=1.0)
    here, there = torch.tensor([[0.1, 0.3]]).double(), torch.tensor([[0.1, 7.0]]).double()
    torch.testing.assert_close(agent.predict(here), agent.predict(there))


def test_without_anything_to_see_each_preference_has_its_best_plan():
    returns = np.array([[[0.0, 0.0], [3.0, -1.0], [1.0, 2.0]]] * 4)
    policy = make_policy(fitted(np.zeros((4, 0)), returns, ridge=100.0, inputs=()))
    observations = np.array([[1.0], [0.0]], dtype=np.float32)
    masks = np.ones((2, 25), dtype=bool)
    assert policy(observations, masks, None).argmax(axis=1).tolist() == [20, 24]
    masks[0, 20] = False
    assert policy(observations, masks, None).argmax(axis=1).tolist() == [12, 24]


def test_a_plan_is_chosen_by_the_site():
    sites = np.array([[-1.0, 0.0], [1.0, 0.0]] * 10)
    returns = np.zeros((20, 3, 2))
    returns[::2, 1], returns[1::2, 2] = 1.0, 1.0
    policy = make_policy(fitted(sites, returns, ridge=1.0))
    observations = np.array([[0.5, -1.0, 0.0], [0.5, 1.0, 0.0]], dtype=np.float32)
    assert policy(observations, np.ones((2, 25), bool), None).argmax(axis=1).tolist() == [20, 24]


# ------------------------------------------------------------------------------------------------- the finals


def test_the_best_of_each_weight_stay():
    carbon, thaw = [0.0, 5.0, 1.0, 4.9, -3.0], [0.0, -2.0, 3.0, -1.9, 2.9]
    returns = torch.tensor(np.stack([carbon, thaw], axis=1)[None], dtype=torch.double)
    weights = torch.tensor([[1.0, 0.0], [0.0, 1.0]], dtype=torch.double)
    assert closest_to_the_best(returns, weights, 2).tolist() == [1, 2]
    assert closest_to_the_best(returns, weights, 4).tolist() == [1, 2, 3, 4]


def test_of_more_best_plans_than_places_those_that_are_best_most_often_stay():
    angles = np.linspace(0, np.pi / 2, 4)  # four corners of a round front, the first the best of one weight alone
    returns = torch.tensor(np.stack([np.cos(angles), np.sin(angles)], axis=1)[None])
    share = torch.tensor([1.0, 0.7, 0.6, 0.4, 0.35, 0.3, 0.1, 0.0], dtype=torch.double)
    weights = torch.stack([share, 1 - share], dim=1)
    won = np.bincount((returns[0] @ weights.T).argmax(dim=0), minlength=4)
    assert won.tolist() == [1, 2, 3, 2]
    assert closest_to_the_best(returns, weights, 3).tolist() == [1, 2, 3]
    assert closest_to_the_best(returns, weights, 1).tolist() == [2]


def test_the_plans_are_all_that_do_the_same_every_year():
    # the five actions that change no density are one
    assert sorted(PLANS) == [action for action in range(25) if not 10 <= action < 15 or action == 12]


# ------------------------------------------------------------------------------------------------- the script


def train(folder, *more, env_id=QUICK):
    """Three rounds, one of them with all plans."""
    given = ("--env-id", env_id, "--vectorization", "lockstep", "--total-timesteps", 1008, "--screening", 0.3)
    weights = (0, 1) if env_id == QUICK else (1, 0, 0, 0, 0.5, 0.5)
    run_script(SCRIPT, *given, "--eval-episodes", 2, "--eval-weights", *weights, "--run-dir", folder, *more)


@pytest.mark.parametrize(
    "env_id, more", [(QUICK, ("--vectorization", "async")), ("timber_env:timber-v0", ("--finalists", 3))]
)
def test_a_training_leaves_a_run_and_goes_on_to_the_same_bytes(env_id, more, tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder, "CHECKPOINT_STEPS", 1)
    whole = tmp_path / "whole"  # stopped once before the finals, once in them
    assert_goes_on_to_the_same_bytes(lambda folder: train(folder, *more, env_id=env_id), tmp_path, stops=2)

    updates, episodes = pd.read_csv(whole / "updates.csv"), pd.read_csv(whole / "episodes.csv")
    finalists = 3 if "--finalists" in more else 6
    assert updates.plans.tolist() == [21, finalists, finalists]
    assert updates.sites.tolist() == [4, 4 + 84 // finalists, 4 + 2 * 84 // finalists]
    assert len(episodes) == 3 * 84 and episodes.site_seed.nunique() == updates.sites.iloc[-1]
    arguments = json.loads((whole / "config.json").read_text())["arguments"]
    policy = protocol.load_policy(whole)
    again, _ = protocol.evaluate(protocol.Task.of(env_id), policy, arguments["eval_weights"], 2)
    pd.testing.assert_frame_equal(pd.read_csv(whole / "evaluation.csv"), again, rtol=1e-6, check_dtype=False)


def test_on_one_site_or_without_seeing_it_there_is_one_plan_a_preference(tmp_path):
    for folder, flags in (("hidden", ("--hide-site",)), ("one", ("--site-seed", 7))):
        train(tmp_path / folder, "--total-timesteps", 672, "--eval-weights", 0, 0.5, 1, *flags)
        saved = torch.load(tmp_path / folder / "policy.pt", weights_only=True)["agent"]
        assert (saved["slopes"][1:].abs() < 1e-12).all()


def test_async_gives_the_same_episodes(tmp_path):
    one_round = ("--total-timesteps", 336)
    train(tmp_path / "lockstep", *one_round)
    train(tmp_path / "async", *one_round, "--vectorization", "async")
    for name in ("episodes.csv", "evaluation.csv"):
        assert (tmp_path / "lockstep" / name).read_bytes() == (tmp_path / "async" / name).read_bytes(), name


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("--total-timesteps", 335), "--total-timesteps 335: at least 336, a round, is allowed"),
        (("--screening", 1.5), r"--screening must lie in \[0, 1\], not 1.5"),
        (("--ridge", 0), r"--ridge must lie in \[0.001, 1000000000\], not 0"),
        (("--finalists", 5), "--finalists 5: 3, 4, 6, 7, 12, 21 are allowed"),
        (("--total-timesteps", 50), "--total-timesteps 50: at least 336, a round, is allowed"),
        (("--env-id", "no-site-v0"), "--env-id no-site-v0: it observes no site parameters by name; --hide-site is"),
        (("--env-id", "toy_env:toy-lockstep-v0"), "the plans are of the boreal environments alone"),
    ],
)
def test_what_cannot_be_learned_is_refused(arguments, message, tmp_path):
    with pytest.raises(SystemExit, match=message):
        train(tmp_path / "run", *arguments)
    assert not (tmp_path / "run").exists()


def test_the_rounds_are_said(tmp_path, capsys):
    given = ("--total-timesteps", 700, "--eval-episodes", 1)
    train(tmp_path / "some", *given)
    assert "2 rounds: 672 of 700 steps; from round 2 on 6 of 21 plans\n" in capsys.readouterr().out
    train(tmp_path / "none", *given, "--screening", 1)
    assert "2 rounds: 672 of 700 steps; all 21 plans in each, as none is left for --finalists\n" in (
        capsys.readouterr().out
    )
    phases = pd.read_csv(tmp_path / "some" / "timing.csv").set_index("phase").seconds
    assert 0 < phases["environment"].sum() < phases["rollout"].sum() and phases["update"].sum() > 0


def test_a_penalty_of_as_many_sites_halves_the_slopes():
    sites = np.array([-1.0, 1.0] * 10)
    returns = np.stack([sites, -sites], axis=1)[..., None]
    agent = fitted(sites[:, None], returns, ridge=20.0, plans=(12, 20), inputs=(1,))
    np.testing.assert_allclose(agent.slopes[1, :, 0], [0.5, -0.5])


def test_a_weight_of_small_returns_counts_as_much_as_one_of_large():
    returns = torch.tensor([[[100.0, 0.0], [99.0, 0.0], [0.0, 1.0], [0.0, 0.5]]], dtype=torch.double)
    assert closest_to_the_best(returns, torch.eye(2, dtype=torch.double), 3).tolist() == [0, 1, 2]
