import contextlib

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
import torch

from analysis import metrics
from analysis.studies import gradient_noise
from analysis.studies.gradient_noise import MEAN, NONE, SITE
from cleanrl_style import eupg_var_lambda as eupg

TINY = gradient_noise.Design(sites=2, episodes=2, years=3)


@pytest.fixture(scope="module")
def played():
    """An agent and its episodes on two sites."""
    torch.manual_seed(0)
    with contextlib.closing(gym.make_vec(gradient_noise.ENV_ID, num_envs=4, group_size=2)) as envs:
        agent = eupg.Agent(envs)
        return agent, gradient_noise.play(agent, envs, TINY)


def test_the_episodes_of_a_site_share_it_and_not_the_preference(played):
    _, episodes = played
    first = episodes.inputs[:, :, 0, 1:-2]  # without the preference and the accrued returns
    np.testing.assert_array_equal(first[:, 0], first[:, 1])
    assert (first[0, 0] != first[1, 0]).any()
    assert len(set(episodes.preferences.ravel())) == 4
    np.testing.assert_array_equal(episodes.inputs[..., 0, 0].astype(float), episodes.preferences.astype(np.float32))
    accrued = episodes.inputs[:, :, 1:, -2:] * 50
    np.testing.assert_allclose(accrued, episodes.rewards.cumsum(axis=2)[:, :, :-1], rtol=1e-5, atol=1e-6)


def test_without_a_baseline_it_is_the_scripts_gradient(played):
    agent, episodes = played
    for utility in gradient_noise.UTILITIES:
        weights = gradient_noise.advantages(episodes.rewards, utility, NONE)
        mean = 0.0
        for which in np.ndindex(2, 2):
            carbon, thaw = gradient_noise.gradients(
                agent, *(column[which] for column in episodes[:3]), np.moveaxis(weights[which], -1, 0)
            )
            preference = episodes.preferences[which]
            mean = mean + (preference * carbon + (1 - preference) * thaw) / 4
        by_year = [np.moveaxis(column.reshape(4, *column.shape[2:]), 1, 0) for column in episodes[:4]]
        utilities = eupg.compute_utilities(by_year[3], metrics.pair(episodes.preferences.ravel()), 1.0, utility)
        flat = [torch.from_numpy(column.reshape(-1, *column.shape[2:]).copy()) for column in by_year[:3]]
        agent.zero_grad()
        loss, _ = eupg.eupg_loss(agent, *flat, torch.from_numpy(utilities.ravel().astype(np.float32)))
        loss.backward()
        expected = -torch.cat([parameter.grad.flatten() for parameter in agent.parameters()]).numpy()
        np.testing.assert_allclose(mean, expected, rtol=1e-3, atol=1e-5 * abs(expected).max())


def test_advantages_by_hand():
    # two sites, two episodes of two years each, carbon; thaw is ten times as much
    carbon = np.array([[[1.0, 2.0], [3.0, 4.0]], [[5.0, 6.0], [7.0, 8.0]]])
    rewards = np.stack([carbon, 10 * carbon], axis=-1)
    expected = {
        ("total", NONE): [[[3, 3], [7, 7]], [[11, 11], [15, 15]]],
        ("total", SITE): [[[-4, -4], [4, 4]], [[-4, -4], [4, 4]]],
        ("total", MEAN): [[[-8, -8], [-8 / 3, -8 / 3]], [[8 / 3, 8 / 3], [8, 8]]],
        ("future", NONE): [[[3, 2], [7, 4]], [[11, 6], [15, 8]]],
        ("future", SITE): [[[-4, -2], [4, 2]], [[-4, -2], [4, 2]]],
        ("future", MEAN): [[[-8, -4], [-8 / 3, -4 / 3]], [[8 / 3, 4 / 3], [8, 4]]],
    }
    for (utility, baseline), values in expected.items():
        got = gradient_noise.advantages(rewards, utility, baseline)
        np.testing.assert_allclose(got[..., 0], values)
        np.testing.assert_allclose(got[..., 1], 10 * np.array(values))


def test_a_gradient_of_known_signal_and_noise():
    generator = np.random.default_rng(0)
    sites, episodes, parameters = 300, 4, 50
    signal = np.full(parameters, 0.1)
    gradients = signal + generator.standard_normal((sites, episodes, parameters))
    row = gradient_noise.signal_and_noise(gradients.mean(axis=1), (gradients**2).sum(axis=-1))
    assert row["signal_low"] < 0.5 < row["signal_high"] and row["signal"] == pytest.approx(0.5, abs=0.15)
    assert row["noise"] == pytest.approx(50, rel=0.02)


def test_a_gradient_without_signal():
    gradients = np.random.default_rng(1).standard_normal((200, 50))
    row = gradient_noise.signal_and_noise(gradients, (gradients**2).sum(axis=-1))
    assert row["signal_low"] < 0 < row["signal_high"]


def test_the_signal_is_that_of_the_row_with_least_noise():
    table = pd.DataFrame(
        {
            "objective": ["carbon", "carbon", "thaw", "thaw"],
            "signal": [9.0, 2.0, -1.0, 5.0],
            "signal_low": [-9.0, 1.0, -2.0, 4.0],
            "signal_high": [99.0, 4.0, 3.0, 6.0],
            "noise": [80.0, 8.0, 30.0, 60.0],
        }
    )
    rows = gradient_noise.with_episodes(table)
    assert rows.episodes.tolist() == [40, 4, np.inf, np.inf]
    assert rows.episodes_low.tolist() == [20, 2, 10, 20] and rows.episodes_high.tolist() == [80, 8, np.inf, np.inf]
