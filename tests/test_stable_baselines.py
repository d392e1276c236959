"""Stands in lockstep as Stable-Baselines3 takes them."""

import gymnasium as gym
import numpy as np
import pytest

import boreal_env

pytest.importorskip("stable_baselines3")

SHORT = {"years": 3, "time_step_minutes": 120}


def test_it_is_the_lockstep_environment_scalarised():
    envs = gym.make_vec("boreal-generalist-v0", num_envs=3, record_steps=True, **SHORT).stable_baselines3()
    same = gym.make_vec("boreal-generalist-v0", num_envs=3, **SHORT)
    with pytest.raises(ValueError, match="seed: an integer .* got -1"):
        envs.seed(-1)
    envs.set_options({"preferense": 0.5})
    with pytest.raises(ValueError, match="unknown option 'preferense'; allowed: preference, site"):
        envs.reset()
    envs.seed(5)
    envs.set_options([{"preference": w} for w in (0.0, 0.25, 1.0)])
    shown = envs.reset()
    np.testing.assert_array_equal(shown, same.reset(seed=5, options={"preference": [0.0, 0.25, 1.0]})[0])
    weights, total = np.array([[0.0, 1.0], [0.25, 0.75], [1.0, 0.0]]), np.zeros(3)
    for year in range(3):
        actions = np.array([12, 22, 24])
        shown, rewards, dones, infos = envs.step(actions)
        expected, vectors, *_, together = same.step(actions)
        np.testing.assert_array_equal(shown, expected)
        np.testing.assert_allclose(rewards, (weights * vectors).sum(axis=1), rtol=1e-6)
        assert infos[1]["record"]["density_stems_ha"] > 0
        total += rewards
        assert dones.all() == (year == 2)
    for i, info in enumerate(infos):
        np.testing.assert_array_equal(info["terminal_observation"], together["final_obs"][i])
        returns = np.array([info["carbon_return"], info["thaw_return"]])
        assert total[i] == pytest.approx(weights[i] @ returns, abs=1e-5) and info["TimeLimit.truncated"] is False
    np.testing.assert_array_equal(envs.env_method("action_masks", indices=[1]), same.action_masks()[1:2])
    assert envs.get_attr("years") == [3, 3, 3] and envs.has_attr("action_masks") and not envs.has_attr("nothing")
    with pytest.raises(AttributeError, match="cannot be set"):
        envs.set_attr("years", 5)


def test_the_example_of_the_page():
    """docs/clients.md, in small."""
    contrib = pytest.importorskip("sb3_contrib")
    from stable_baselines3.common.vec_env import VecMonitor

    envs = VecMonitor(boreal_env.BorealVectorEnv(4, **SHORT).stable_baselines3())
    model = contrib.MaskablePPO("MlpPolicy", envs, n_steps=6, batch_size=12, n_epochs=1, seed=1)
    model.learn(48)
    assert len(model.ep_info_buffer) == 16
    observations = envs.reset()
    actions, _ = model.predict(observations, action_masks=np.stack(envs.env_method("action_masks")))
    assert all(mask[action] for mask, action in zip(envs.env_method("action_masks"), actions, strict=True))
