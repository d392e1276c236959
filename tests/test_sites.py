"""The published sites of the evaluation: what they stand for, and whose they are not."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

import boreal_env
import sim
from analysis import choose_sites
from cleanrl_style import protocol
from cleanrl_style.protocol import sites

TABLE = pd.read_csv(choose_sites.Args().path)
STRATA = TABLE.columns[3:]


@pytest.fixture(scope="module")
def population():
    """What decides gains, of sites at large."""
    return pd.DataFrame([choose_sites.strata(sim.sample_site(10**9 + k)) for k in range(4000)])


def test_the_table_says_what_its_seeds_draw():
    envs = protocol.Task.of("boreal-balanced-v0").make_lockstep(1)
    for row in TABLE.iloc[::60].itertuples():
        assert choose_sites.site_seed_of(row.seed) == row.site_seed
        values = choose_sites.strata(sim.sample_site(row.site_seed))
        assert list(values.values()) == pytest.approx([getattr(row, name) for name in STRATA], abs=1e-4)
        generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence(row.seed)))
        assert envs._episodes.draw(generator)[0] == row.site_seed  # as an environment that is reset with it


def test_no_site_is_in_two_splits_or_in_a_training():
    assert TABLE.groupby("split").size().to_dict() == {"test": 200, "validation": 100}
    assert TABLE.seed.is_unique and TABLE.site_seed.is_unique
    highest_training_seed = (protocol.LIMITS["seed"][1] + 1) * protocol.MAX_ENVS - 1
    assert TABLE.seed.min() >= protocol.FIRST_EVALUATION_SEED > highest_training_seed


@pytest.mark.parametrize("split, number", [("test", n) for n in (10, 25, 50, 100, 150, 200)] + [("validation", 100)])
def test_every_beginning_is_balanced(split, number, population):
    first = TABLE[TABLE.split == split].iloc[:number]
    for name in STRATA:
        # of samples by chance nineteen of twenty are farther from all sites: 0.8 / sqrt(number), at the worst of four
        assert stats.ks_2samp(first[name], population[name]).statistic < 0.75 / np.sqrt(number), name
        assert abs(first[name].mean() - population[name].mean()) < 0.35 * population[name].std() / np.sqrt(number), name
    # jointly, too: each quarter of the plane of any two has about as many as it has of all sites
    low, all_low = first[STRATA] < population.median(), population < population.median()
    for one in STRATA:
        for other in STRATA:
            assert (low[one] & low[other]).mean() == pytest.approx(
                (all_low[one] & all_low[other]).mean(), abs=0.05 + 1.2 / number
            )


def test_an_evaluation_takes_the_first_sites():
    task = protocol.Task.of("boreal-generalist-v0")
    assert not set(protocol.evaluation_seeds(task, 100, "validation")) & set(protocol.evaluation_seeds(task, 200))
    assert protocol.evaluation_seeds(task, 3) == TABLE.seed[:3].tolist()
    for message, arguments in {
        "-1 episodes: a whole number, 1 or more, is allowed": (-1,),
        "201 episodes: the test split has 200 sites": (201,),
        "split 'train': allowed are test, validation, warmer_boundary, .*, calmer, less_snow": (3, "train"),
    }.items():
        with pytest.raises(ValueError, match=message):
            protocol.evaluation_seeds(task, *arguments)


@pytest.mark.parametrize(
    "arguments", [{"env_id": "boreal-site-specific-v0"}, {"site_seed": 7}, {"env_id": "toy_env:toy-v0"}]
)
def test_what_draws_no_sites_has_new_weathers(arguments):
    task = protocol.Task.of(**{"env_id": "boreal-generalist-v0", **arguments})
    assert protocol.evaluation_seeds(task, 2) == [sites.FIRST_EVALUATION_SEED, sites.FIRST_EVALUATION_SEED + 1]


def test_a_split_outside_moves_one_property_of_the_test_sites():
    task = protocol.Task.of("boreal-generalist-v0", years=1, time_step_minutes=120)

    def sites_of(split):
        seen = []

        def plant(observations, masks, accrued_returns):
            seen.append(observations[0])
            return np.eye(25)[[12] * len(observations)]

        table, _ = protocol.evaluate(task, plant, [0.5], 1, ("greedy",), split)
        return table.site_seed[0], dict(zip(boreal_env.OBSERVATION_NAMES, seen[0], strict=True))

    (seed, inside), (same, calm) = sites_of("test"), sites_of("calmer")
    assert seed == same and calm["site_wind_speed_m_s"] < 0.0 <= inside["site_wind_speed_m_s"]
    moved = {name for name in inside if name.startswith("site_") and inside[name] != calm[name]}
    assert moved == {"site_wind_speed_m_s"}


def test_support_points_fill_a_line_evenly():
    values = np.random.default_rng(0).random((500, 1)) ** 3
    chosen = choose_sites.support_points(values, 10)
    assert len(set(chosen)) == 10
    ranks = stats.rankdata(values[:, 0])[chosen] / 500
    assert stats.kstest(ranks, "uniform").statistic < 0.2  # by chance 0.26
    barred = choose_sites.support_points(values, 10, barred=chosen)
    assert not set(chosen) & set(barred)


def test_splits_share_no_episode_where_no_sites_are_drawn():
    task = protocol.Task.of("boreal-generalist-v0", site_seed=3)
    seeds = [set(sites.evaluation_seeds(task, 100, split)) for split in sites.SPLITS]
    assert sum(map(len, seeds)) == len(set.union(*seeds)) == 200
    assert min(seeds[1]) > protocol.FIRST_EVALUATION_SEED
