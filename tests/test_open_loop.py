import numpy as np
import pytest

import boreal_env
import sim
from analysis.studies import open_loop


def test_play_gives_the_environments_returns_and_replaces_what_cannot_be_done():
    env = boreal_env.BorealEnv(years=3)
    env.reset(seed=5)
    plan = [24, 0, 14]
    carried_out = []
    for action in plan:
        carried_out.append(action if env.action_masks()[action] else boreal_env.NO_CHANGE)
        *_, info = env.step(carried_out[-1])
    assert carried_out != plan

    site, seeds = sim.sample_site(info["site_seed"]), sim.episode_seeds(info["episode_seed"])
    episodes = open_loop.play([site], [seeds], [plan])
    assert episodes.actions[0].tolist() == carried_out
    assert episodes.returns()[0].tolist() == [info["carbon_return"], info["thaw_return"]]
    assert episodes.last("density_stems_ha")[0] == info["final_density"]


def test_planted_conifers_follow_the_mix():
    site = open_loop.FIRST_SITE_SEED
    plans = [[24, 24], [23, 15], [12, 12]]
    seeds = [open_loop.seeds(site, 0)] * 3
    episodes = open_loop.play([sim.sample_site(site)] * 3, seeds, plans)
    assert episodes.total("planted_stems_ha").tolist() == [200, 150, 0]
    assert episodes.planted_conifers().tolist() == [200, 75, 0]


def test_years_at_the_rewards_bounds_are_counted():
    rewards = np.array([[[0, -1], [1, 0.5], [0.2, -1]], [[0, 0], [0, 0], [0, 1]]])
    episodes = open_loop.Episodes(rewards, actions=None, record=None, start={})
    assert episodes.clipped_years().tolist() == [[1, 2], [0, 1]]


def test_a_site_keeps_its_start_and_a_weather_its_dice():
    first, second = open_loop.seeds(1, 0), open_loop.seeds(1, 1)
    elsewhere = open_loop.seeds(2, 0)
    assert first.start == second.start != elsewhere.start
    assert (first.weather, first.disturbance) == (elsewhere.weather, elsewhere.disturbance)
    assert first.weather != second.weather


def test_no_two_sites_share_a_weather_of_their_own():
    sites = [open_loop.FIRST_SITE_SEED + k for k in range(3)]
    own = [open_loop.own_seeds(site, weather, 4) for site in sites for weather in range(4)]
    assert len({one.weather for one in own}) == len({one.disturbance for one in own}) == 12
    assert [one.start for one in own] == [open_loop.seeds(site, 0).start for site in sites for _ in range(4)]


def test_sites_span_the_ranges():
    def features(seeds):
        return np.array([list(open_loop.site_features(sim.sample_site(seed)).values()) for seed in seeds])

    sites = open_loop.spanning_sites(12)
    assert len(set(sites)) == 12
    assert open_loop.spanning_sites(3) == sites[:3]
    sampled = features(range(open_loop.FIRST_SITE_SEED, open_loop.FIRST_SITE_SEED + open_loop.CANDIDATES))
    for chosen, all_of_them in zip(features(sites).T, sampled.T, strict=True):
        low, high = np.percentile(all_of_them, [10, 90])
        assert chosen.min() < low and chosen.max() > high
    with pytest.raises(ValueError, match="0: 1 to 400"):
        open_loop.spanning_sites(0)


def test_quartile_sites():
    def boundary_above_air(site_seed):
        return open_loop.site_features(sim.sample_site(site_seed))["boundary_above_air_k"]

    sampled = [boundary_above_air(open_loop.FIRST_SITE_SEED + k) for k in range(open_loop.CANDIDATES)]
    chosen = [boundary_above_air(site) for site in open_loop.quartile_sites()]
    assert chosen == pytest.approx(np.percentile(sampled, [50, 25, 75]), abs=0.3)
