import numpy as np
import pandas as pd
import pytest

import sim
from analysis import stored
from analysis.studies import open_loop, signal_to_noise
from analysis.studies.signal_to_noise import Design

TINY = Design(sites=2, pasts=2, futures=2, years=(0, 2))


def toy(sites=400, pasts=4, futures=4):
    """Values of two actions: an effect of 0.5 and noises of 3 (site), 2 (past) and 1 (future, each action's own)."""
    generator = np.random.default_rng(0)
    shared = 3 * generator.standard_normal((sites, 1, 1)) + 2 * generator.standard_normal((sites, pasts, 1))
    first, second = (shared + generator.standard_normal((sites, pasts, futures)) for _ in range(2))
    return first + 0.5, second


def test_a_toy_with_known_effect_and_noise():
    row = signal_to_noise.summarise(*toy())
    assert row["effect"] == pytest.approx(0.5, abs=0.05) and row["effect_low"] < 0.5 < row["effect_high"]
    assert row["rms_effect"] == pytest.approx((0.5**2 + 2) ** 0.5, rel=0.03)
    assert row["noise"] == pytest.approx(14**0.5, rel=0.05)
    assert row["site_noise"] == pytest.approx((3 / 4 * 16 / 15 * 4 + 1) ** 0.5, rel=0.05)  # 4 pasts, each in 4 pairs
    assert row["state_noise"] == pytest.approx(1, rel=0.03)
    assert row["episodes"] == pytest.approx((2 * 1.96 * row["noise"] / row["effect"]) ** 2)
    assert row["state_episodes"] < row["site_episodes"] < row["episodes"]
    assert row["episodes_low"] < row["episodes"] < row["episodes_high"]
    # the same with the actions exchanged
    back = signal_to_noise.summarise(*toy()[::-1])
    assert back["effect"] == -row["effect"] and back["episodes"] == pytest.approx(row["episodes"])


def test_a_hand_case():
    # one site: the pairs (1, 0), (3, 0); the other: only (10, 2), its second pair not valid
    first, second = np.array([[[1.0, 3.0]], [[10.0, np.nan]]]), np.array([[[0.0, 0.0]], [[2.0, 5.0]]])
    sites = signal_to_noise.by_site(first, second)
    assert sites.pairs.tolist() == [2, 1] and sites.effect.tolist() == [2, 8] and sites.square.tolist() == [5, 64]
    row = signal_to_noise.summarise(first, second)
    assert (row["pairs"], row["effect"], row["rms_effect"]) == (3, 5, pytest.approx(34.5**0.5))
    # about the site's mean: 1 + 1 for the first action, nothing for the second; two degrees of freedom
    assert row["site_noise"] == row["state_noise"] == pytest.approx(1)
    # between the sites' means 2 and 10, 0 and 2: 32 and 2; within them 1, of which the means have 3/4 already
    assert row["noise"] == pytest.approx((17 + 1 / 4) ** 0.5)
    assert "effect" not in signal_to_noise.summarise(first[:1], second[:1])


def test_an_effect_that_cannot_be_told_from_none_needs_no_bounded_number():
    assert signal_to_noise.episodes_needed([0.0, -0.1, 2 * 1.96]).tolist() == [np.inf, np.inf, 1]
    first, second = toy()
    row = signal_to_noise.summarise(first - first.mean() + second.mean() + 0.001, second)
    assert row["episodes_high"] == np.inf and row["episodes"] < np.inf


def test_weights_and_shares():
    rewards = np.zeros((1, 1, 1, 3, 2))
    rewards[..., 2, 0], rewards[..., 0, 1] = 4.0, 1.0
    assert signal_to_noise.weighed(rewards, 0.5)[0, 0, 0].tolist() == [1, 1, 1]
    assert signal_to_noise.weighed(rewards, 1.0)[0, 0, 0].tolist() == [4, 1, 2.5]
    curve = np.zeros(50)
    curve[[0, 4, 5, 19, 20, 49]] = 1, 1, -2, -1, 5, 0
    shares = signal_to_noise.time_shares(curve)
    assert list(shares.values()) == [0.2, 0.3, 0.5]


def test_the_first_valid_of_a_random_order():
    order = signal_to_noise.order(signal_to_noise.UNIFORM, [1, 2], 2000)
    assert (np.sort(order, axis=1) == np.arange(25)).all()
    valid = np.isin(order, (3, 12, 24))
    drawn = np.take_along_axis(order, valid.argmax(axis=1)[:, None], axis=1)
    assert np.unique(drawn, return_counts=True)[1] == pytest.approx([667, 667, 667], abs=80)
    assert signal_to_noise.order(signal_to_noise.PLANTING, [1], 1)[0, :2].tolist() == [22, 12]
    assert sorted(signal_to_noise.fixed(12, 1)[0]) == list(range(25))


@pytest.fixture(scope="module")
def tiny():
    states = signal_to_noise.pasts(TINY)
    return states, signal_to_noise.play(TINY, 4, states, lambda number: None)


def test_no_two_weathers_are_the_same():
    sites, pasts, futures = (range(number) for number in TINY[:3])
    seeds = [TINY.past_seeds(site, past) for site in sites for past in pasts]
    seeds += [TINY.future_seeds(site, past, future) for site in sites for past in pasts for future in futures]
    assert len({one.weather for one in seeds}) == len(seeds) == 2 * 2 * 3


def test_equal_actions_have_no_effect(monkeypatch):
    monkeypatch.setattr(signal_to_noise, "ACTIONS", {"first": 12, "second": 12})
    rewards = signal_to_noise.play(TINY, 4, signal_to_noise.pasts(TINY), lambda number: None)
    for values in rewards.values():
        assert not np.isnan(values).any() and (values[:, :, :, :, 0] == values[:, :, :, :, 1]).all()


def test_a_pair_is_an_episode_of_the_environment(tiny):
    """An action in the first year of plans, on the weather that follows, as `open_loop.play` has it."""
    rewards = tiny[1][0]
    site, planting = TINY.seeds()[1], signal_to_noise.REFERENCES.index(signal_to_noise.PLANTING)
    seeds = [TINY.future_seeds(1, 1, 0)] * 2
    plans = [[24, 22, 22, 22], [12, 22, 22, 22]]
    played = open_loop.play([sim.sample_site(site)] * 2, seeds, plans).rewards
    np.testing.assert_allclose(rewards[planting, 1, 1, 0, [1, 0]], played)
    assert (played[0] != played[1]).any()


def test_the_past_is_the_same_for_all_that_follows(tiny):
    states, rewards = tiny
    stocks = sim.Stands(len(states[2]["years"]))
    stocks.set_state(states[2])
    assert (stocks.years == 2).all()
    assert rewards[2].shape == (2, 2, 2, 2, len(signal_to_noise.ACTIONS), 2, 2)
    # other dice follow: doing nothing has another return with each
    nothing = rewards[2][:, :, :, :, 0].sum(axis=(-2))
    assert (nothing[:, :, :, 0] != nothing[:, :, :, 1]).any(axis=-1).all()


@pytest.mark.slow
def test_the_same_bytes_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(signal_to_noise, "QUICK", TINY)
    monkeypatch.setattr(stored.provenance, "physics_name", lambda: "physics")
    names = ("signal_to_noise.csv", "signal_to_noise_years.csv")
    for folder in ("first", "second"):
        monkeypatch.setattr(signal_to_noise.paths, "studies", lambda quick, folder=folder: tmp_path / folder)
        signal_to_noise.main(signal_to_noise.Args(quick=True))
    for name in names:
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()
    signal_to_noise.main(signal_to_noise.Args(quick=True))
    assert "is finished" in capsys.readouterr().out
    table = stored.read(tmp_path / "first" / names[0], text=("year",))
    whole = table[(table.weighting == "return") & table.years_0_5.notna()]
    assert whole[list(signal_to_noise.PERIODS)].sum(axis=1).to_numpy() == pytest.approx(np.ones(len(whole)))
    assert set(table.year) == {"0", "2", signal_to_noise.EVERY}
    years = pd.read_csv(tmp_path / "first" / names[1], skiprows=1)
    case = {"reference": "uniform", "contrast": "plant conifers", "year": "0", "objective": "thaw"}
    of_case = [one[(one[list(case)] == list(case.values())).all(axis=1)] for one in (years, whole)]
    assert of_case[0].effect.sum() == pytest.approx(of_case[1].effect.item())
