"""Best known plans of published sites: the search, what it says of itself, the fronts that the environment plays."""

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
import quick_env
from playing import quick, quick_vector

import boreal_env
from analysis import best_plans, stored
from cleanrl_style import protocol
from cleanrl_style.protocol import sites
from sim.task import fronts

WEIGHTS = np.array([(0.0, 1.0), (0.5, 0.5), (1.0, 0.0)])
TARGETS = np.array([(24, 3, 12, 20, 7), (1, 24, 18, 12, 22)])  # of each objective, no constant plan


def returns_of(plans):
    """Each block that is an objective's target counts one."""
    return (np.asarray(plans)[:, None] == TARGETS).sum(axis=2).astype(float)


# -------------------------------------------------------------------------------------------------------- the search


def test_the_search_finds_the_best_at_every_weight_within_its_budget():
    tried = best_plans.search(returns_of, WEIGHTS, 4000, seed=1)
    returns = np.array(list(tried.values()))
    assert len(tried) == 4000
    assert (WEIGHTS @ returns.T).max(axis=1).tolist() == [5, 2.5, 5]
    assert list(tried)[:21] == [(action,) * 5 for action in best_plans.ACTIONS]
    assert list(best_plans.search(returns_of, WEIGHTS, 100, seed=1)) == list(tried)[:100]
    assert list(best_plans.search(returns_of, WEIGHTS, 100, seed=2)) != list(tried)[:100]


def test_the_summary_by_hand():
    rows = [
        # seed, plan, returns, front, half, constant
        (1, "12 12 12 12 12", 1.0, 0.0, False, False, True),
        (1, "24 24 24 24 24", 1.0, 2.0, False, True, True),
        (1, "24 24 12 12 12", 3.0, 4.0, True, False, False),
        (2, "12 12 12 12 12", 0.0, 0.0, True, True, True),
    ]
    names = ["seed", "plan", "carbon_return", "thaw_return", "front", "half", "constant"]
    found = best_plans.summary(pd.DataFrame(rows, columns=names), WEIGHTS[[0, 2]])
    assert found.loc[[(0.0, 1.0)]].to_numpy().tolist() == [[1, 1, 2, 100]]
    assert found.loc["mean"].tolist()[:3] == [0.5, 0.5, 1.5]


def test_a_plan_is_played_by_blocks():
    """An action for each two of ten years; where a year does not allow it, nothing is changed."""
    plan = [24, 3, 12, 20, 7]
    envs = quick_vector(2, years=10)
    rewards = fronts.play_plans(envs, 5, np.array([plan, [12] * 5]), 10)
    for number, blocks in enumerate((plan, [12] * 5)):
        env = quick(years=10)
        env.reset(seed=5)
        for year in range(10):
            action = blocks[year // 2]
            reward = env.step(action if env.action_masks()[action] else boreal_env.NO_CHANGE)[1]
            np.testing.assert_allclose(rewards[number, year], reward, rtol=1e-6)


def test_what_another_dominates_is_left_out():
    returns = np.array([[1.0, 3.0], [2.0, 2.0], [1.0, 2.0], [2.0, 2.0], [3.0, 0.0]])
    assert fronts.undominated(returns).tolist() == [[1.0, 3.0], [2.0, 2.0], [3.0, 0.0]]


# ------------------------------------------------------------------------------------------------------- all sites


@pytest.fixture
def small(tmp_path, monkeypatch):
    """The command, of a small environment under an id of ours, and how it is called."""
    monkeypatch.setitem(boreal_env.REGISTERED, "quick-v0", quick_env.SMALL)
    monkeypatch.setattr(fronts, "shipped", lambda env_id: tmp_path / "shipped" / f"{env_id}.csv.gz")
    monkeypatch.setattr(stored.provenance, "physics_name", lambda: "physics")
    fronts.published_plans.cache_clear()
    given = {"env_id": ("quick-v0",), "sites": 2, "budget": 60, "folder": tmp_path / "shipped"}
    yield lambda folder, **more: best_plans.main(best_plans.Args(**given, output_dir=tmp_path / folder, **more))
    fronts.published_plans.cache_clear()


def test_a_stopped_search_goes_on_and_its_fronts_are_played(small, tmp_path, monkeypatch, capsys):
    small("whole")
    whole = (tmp_path / "whole" / "quick-v0-60-1.csv").read_bytes()
    shipped = (tmp_path / "shipped" / "quick-v0.csv.gz").read_bytes()
    write = stored.write

    def write_once(*args):
        write(*args)
        raise KeyboardInterrupt

    with monkeypatch.context() as once, pytest.raises(KeyboardInterrupt):
        once.setattr(stored, "write", write_once)
        small("stopped")
    small("stopped")
    assert "quick-v0: 1 of 2 sites are in" in capsys.readouterr().out
    assert (tmp_path / "stopped" / "quick-v0-60-1.csv").read_bytes() == whole
    assert (tmp_path / "shipped" / "quick-v0.csv.gz").read_bytes() == shipped

    # the front of a site is what its plans return, step by step
    table = stored.read(tmp_path / "whole" / "quick-v0-60-1.csv", text=("plan",))
    seed = sites.published_seeds("test")[1]
    found = table[table.front & (table.seed == seed)]
    env = gym.make("quick-v0", disable_env_checker=True, record_steps=True)  # which changes no return
    env.reset(seed=seed)
    front = env.unwrapped.pareto_front(gamma=1.0)
    expected = found[["carbon_return", "thaw_return"]].sort_values("carbon_return").to_numpy()
    np.testing.assert_allclose(front, expected, rtol=1e-6)
    discounted = []
    for plan, *returns in found[["plan", "carbon_return", "thaw_return"]].itertuples(index=False):
        env.reset(seed=seed)
        rewards = []
        for action in map(int, plan.split()[:4]):
            possible = env.unwrapped.action_masks()[action]
            rewards.append(env.step(action if possible else boreal_env.NO_CHANGE)[1])
        np.testing.assert_allclose(sum(rewards), returns, rtol=1e-6)
        discounted.append(sum(0.5**year * reward for year, reward in enumerate(rewards)))
    env.reset(seed=seed)
    near = env.unwrapped.pareto_front(gamma=0.5)
    np.testing.assert_allclose(near, fronts.undominated(np.array(discounted)), rtol=1e-6)
    # it is of the first 50 years, and of an episode that was begun so
    with pytest.raises(ValueError, match="gamma: a number in"):
        env.unwrapped.pareto_front(1.5)
    for reset in ({"seed": 3}, {"seed": seed, "options": {"site": {"latitude_deg": 60.0}}}, {}):
        env.reset(**reset)
        with pytest.raises(ValueError, match="reset.seed=. of a published site, not .*; 2 have a front"):
            env.unwrapped.pareto_front(1.0)
    other = gym.make("quick-v0", disable_env_checker=True, hwp_half_life_years=30.0)
    other.reset(seed=seed)
    with pytest.raises(ValueError, match="published fronts are those of quick-v0, with no argument changed"):
        other.unwrapped.pareto_front(1.0)


@pytest.mark.parametrize(
    "given, message",
    [
        ({"budget": 30}, "--budget 30: 42 or more are allowed"),
        ({"sites": 201}, "--sites: 201 episodes: the test split has 200 sites"),
        (
            {"env_id": ("boreal-site-specific-v0",)},
            "--env-id boreal-site-specific-v0: an environment of ours that draws",
        ),
    ],
)
def test_what_cannot_be_searched_is_refused(given, message, tmp_path):
    with pytest.raises(SystemExit, match=message):
        best_plans.main(best_plans.Args(**{"output_dir": tmp_path, "folder": tmp_path, **given}))


def test_what_ships_is_of_published_sites():
    for env_id in boreal_env.REGISTERED:
        plans = fronts.published_plans(env_id)
        assert set(plans) <= set(protocol.evaluation_seeds(protocol.Task.of(env_id), 200))
        assert all(np.isin(one, best_plans.ACTIONS).all() for one in plans.values())
        assert len(plans) == (50 if env_id in best_plans.Args.env_id else 0)
