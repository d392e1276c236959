import numpy as np
import pandas as pd
import pytest

from analysis import reduction


def episodes(rounds, environments, steps_each=50):
    """Episodes of a training in lockstep, with random returns."""
    generator, number = np.random.default_rng(0), rounds * environments
    table = pd.DataFrame(
        {
            "global_step": np.repeat(np.arange(1, rounds + 1), environments) * environments * steps_each,
            "episode": np.arange(1, number + 1),
            "env": np.tile(np.arange(environments), rounds),
            "site_seed": generator.integers(1000, size=number),
            "preference": generator.random(number),
        }
    )
    for name in ("carbon_return", "thaw_return", "scalarized_return", *reduction.EPISODE_INFO):
        table[name] = generator.random(number)
    return table


@pytest.mark.parametrize("parts", [40, 20, 10, 8, 1])
@pytest.mark.parametrize("statistic", ["mean", "std"])
def test_coarser_parts_of_a_training_are_those_of_its_episodes(parts, statistic):
    table, steps = episodes(187, 3), 28_100
    number = np.minimum((table.global_step - 1) * parts // steps, parts - 1)
    expected = table.thaw_return.groupby(number).agg(statistic).reindex(range(parts))
    found = reduction.course(reduction.learning(table, steps), "thaw_return", statistic, parts)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_parts_without_episodes_are_no_numbers():
    table = reduction.learning(episodes(3, 2), 300)
    assert table.episodes.sum() == 6 and len(table) == reduction.BINS
    known = ~np.isnan(reduction.course(table, "carbon_return"))
    assert np.flatnonzero(known).tolist() == [13, 26, 39]
    with pytest.raises(ValueError, match="a divisor of 40, not 7"):
        reduction.course(table, "carbon_return", parts=7)


def test_the_sample_is_every_eighth_round_and_all_of_a_short_training():
    assert sorted(set(reduction.sample(episodes(20, 4).assign(selected=1)).global_step)) == [8 * 200, 16 * 200]
    assert len(reduction.sample(episodes(15, 4).assign(selected=1))) == 60


def test_the_threshold_of_a_curriculum():
    table = pd.DataFrame(
        {"threshold": [0.5, 0.5, 0.51, 0.505], "score": [0.5, 0.505, 0.51, 0.9], "selected": [0, 1, 0, 1]}
    )
    (row,) = reduction.selection(table).to_dict("records")
    assert row == {
        "episodes": 4,
        "selected": 2,
        "between": 2,
        "lowest_threshold": 0.5,
        "highest_threshold": 0.51,
        "moves": 2,
        "moves_up": 1,
    }


def record(weights: dict):
    """An annual record of two years of one variable that is kept and one that is not."""
    statistics = {"sd": 1, "p10": 0, "p50": 1, "p90": 2}
    rows = [
        {**weight, "year": year, "variable": name, "mean": year, **statistics}
        for weight in weights
        for year in (1, 2)
        for name in ("density_stems_ha", "energy_residual_w_m2")
    ]
    return pd.DataFrame(rows)


def test_the_annual_record_is_kept_at_the_ends_and_in_the_middle():
    two = record([{"preference": w} for w in (0.0, 0.25, 0.5, 0.75, 1.0)])
    years = reduction.years(two)
    assert years.columns.tolist() == ["preference", "year", "density_stems_ha"]
    assert years.preference.tolist() == [0, 0, 0.5, 0.5, 1, 1] and years.density_stems_ha.tolist() == [1, 2] * 3
    assert reduction.last_year(two).columns.tolist() == ["preference", "variable", "p10", "p50", "p90"]
    names = ("weight_carbon", "weight_thaw", "weight_timber")
    weights = [(1, 0, 0), (0.5, 0.5, 0), (0, 1, 0), (1 / 3, 1 / 3, 1 / 3), (0, 0, 1), (0.25, 0.25, 0.5)]
    years = reduction.years(record([dict(zip(names, w, strict=True)) for w in weights]))
    assert len(years) == 2 * 4 and years.columns.tolist()[:4] == [*names, "year"]


def test_only_the_primary_policy_has_more_than_returns():
    table = pd.DataFrame(
        {"policy": ["greedy", "sampled"], "episode": 0, "carbon_return": 1.0, "latent_heat_mj_m2": 2.0}
    )
    kept = reduction.evaluation(table)
    assert "episode" not in kept and kept.latent_heat_mj_m2.isna().tolist() == [False, True]


def test_steps_that_a_killed_run_made_twice_are_timed_once():
    rows = [("rollout", 100, 1.0), ("update", 100, 2.0), ("rollout", 200, 4.0), ("rollout", 200, 8.0)]
    seconds = (
        reduction.timing(pd.DataFrame(rows, columns=["phase", "global_step", "seconds"])).set_index("phase").seconds
    )
    assert seconds.to_dict() == {"rollout": 9.0, "update": 2.0}


def test_an_episode_at_the_end_of_a_part_is_that_part_s():
    assert reduction.learning(episodes(40, 1, 10), 400).episodes.tolist() == [1] * 40


def test_the_composition_is_of_the_last_fifth():
    assert reduction.composition(episodes(10, 1)).episodes.sum() == 2


def test_the_last_year_is_the_last():
    years = record([{"preference": 1.0}])
    assert reduction.last_year(years.assign(p50=years.year)).p50.tolist() == [2]
