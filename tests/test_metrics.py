import itertools

import numpy as np
import pandas as pd
import pytest
import scipy.stats

from analysis import metrics
from analysis.tables.common import PAPER_TABLES
from cleanrl_style.protocol import fronts

FRONT = np.array([(0, 3), (1, 2), (3, 0)])


def paper_front(method):
    details = pd.read_csv(PAPER_TABLES / "detailed_objectives.csv")
    rows = details[details.method == method].sort_values("lambda_carbon")
    return rows[["carbon_mean", "thaw_mean"]].to_numpy()


def evaluation(carbon, thaw, weights):
    """Evaluation from returns of shape (episodes, weights)."""
    episodes = np.asarray(carbon).shape[0]
    return pd.DataFrame(
        {
            "preference": np.tile(weights, episodes),
            "seed": np.repeat(np.arange(episodes), len(weights)),
            "carbon_return": np.ravel(carbon),
            "thaw_return": np.ravel(thaw),
        }
    )


def test_golden_front():
    assert metrics.hypervolume(FRONT, reference=(-1, -1)) == pytest.approx(9.0)
    assert metrics.sparsity(FRONT) == pytest.approx(5.0)
    assert metrics.expected_utility(FRONT) == pytest.approx(2.2653, abs=5e-5)
    assert metrics.cardinality(FRONT) == 3


def test_three_objectives():
    cube = np.eye(3)
    # above -1 of each, three boxes of 2 x 1 x 1, any two of which share the same 1 x 1 x 1
    assert metrics.hypervolume(cube, reference=-1.0) == pytest.approx(3 * 2 - 3 * 1 + 1)
    assert metrics.hypervolume([(1, 2, 3), (1, 1, 1)], reference=(0, 0, 0)) == pytest.approx(6)
    assert metrics.hypervolume([(0, 0, 0)]) == pytest.approx(8)  # above -2 of each
    assert metrics.sparsity(cube) == pytest.approx(3 * 1 / 2)
    assert metrics.cardinality(np.vstack([cube, [(0, 0, 0)]])) == 3
    # the best of the corners is the largest weight: its mean over the weights that are multiples of a ninth
    lattice = [(i, j, 9 - i - j) for i in range(10) for j in range(10 - i)]
    assert len(lattice) == 55
    assert metrics.expected_utility(cube) == pytest.approx(np.mean([max(weights) / 9 for weights in lattice]))
    assert metrics.expected_utility([(2, 2, 2)]) == pytest.approx(2)


def three_objectives():
    """Two episodes at four weights; each return is its own weight, and a tenth of the episode's number more."""
    weights = np.array([(0, 0, 1), (0, 1, 0), (1, 0, 0), (0.5, 0.25, 0.25)])
    rows = []
    for seed, one in itertools.product((0, 1), weights):
        names = ("carbon", "thaw", "timber")
        returns = one + 0.1 * seed
        row = {f"weight_{name}": weight for name, weight in zip(names, one, strict=True)}
        row |= {"seed": seed} | {f"{name}_return": value for name, value in zip(names, returns, strict=True)}
        rows.append(row | {"scalarized_return": one @ returns, "asymmetric_thaw_return": 99.0})
    return pd.DataFrame(rows)


def test_an_evaluation_of_three_objectives():
    table = three_objectives()
    front = metrics.mean_returns(table)
    assert front.columns.tolist() == ["carbon_return", "thaw_return", "timber_return"]
    assert front.loc[(0, 1, 0)].tolist() == pytest.approx([0.05, 1.05, 0.05])
    assert metrics.mean_scalarized(table) == pytest.approx((3 + 0.375) / 4 + 0.05)
    gained = metrics.gains(table, table[table.weight_timber == 1])
    assert gained.loc[2, ["carbon_return", "thaw_return", "timber_return"]].tolist() == pytest.approx([1, 0, -1])
    assert gained.scalarized_return[2] == pytest.approx(1)
    response = metrics.preference_response(table)
    # from the mean of the weights without it, 0.05, to its own corner, 1.05
    assert response.change.tolist() == pytest.approx([1, 1, 1]) and response.slope.tolist() == pytest.approx([1, 1, 1])
    assert response.change_low.tolist() == pytest.approx([1, 1, 1])


def test_dominated_points_and_duplicates_change_nothing():
    more = np.vstack([FRONT, [(0, 0), (1, 2)]])
    assert metrics.sparsity(more) == metrics.sparsity(FRONT)
    assert metrics.hypervolume(more) == metrics.hypervolume(FRONT)
    assert metrics.cardinality(more) == 3


def test_points_below_the_reference_have_no_hypervolume():
    assert metrics.hypervolume([(100, -2.5)]) == 0
    assert metrics.hypervolume([(0, 0)]) == pytest.approx(4)


def test_one_point_has_no_sparsity():
    assert metrics.sparsity([(1, 1)]) == 0


@pytest.mark.parametrize(
    "method, hypervolume, sparsity, violations",
    [("curriculum_ppo", 119.80, 3.4, 50), ("ppo_gated", 65.20, 19.5, 100), ("eupg_variable_lambda", 24.54, 14.4, None)],
)
def test_paper_against_its_own_details(method, hypervolume, sparsity, violations):
    front = paper_front(method)
    assert metrics.hypervolume(front) == pytest.approx(hypervolume, abs=0.005)
    assert metrics.sparsity(front) == pytest.approx(sparsity, abs=0.05)
    if violations is not None:
        assert metrics.violations_percent(front) == violations


def test_monotone_front_has_no_violations_and_a_reversed_one_has_only_violations():
    assert metrics.violations_percent(FRONT) == 0
    assert metrics.violations_percent(FRONT[::-1]) == 100
    assert np.isnan(metrics.violations_percent(FRONT[:1]))


def test_a_tie_violates_as_the_paper_words_it():
    front = np.array([[0.0, 1.0], [1.0, 0.0], [1.0, -1.0], [2.0, -2.0]])
    assert metrics.violations_percent(front) == 0
    assert metrics.violations_or_ties_percent(front) == pytest.approx(100 / 3)
    assert metrics.violations_or_ties_percent(front[::-1]) == 100
    assert np.isnan(metrics.violations_or_ties_percent(front[:1]))


def test_only_consistent_violations_are_significant():
    weights = [0.0, 0.5, 1.0]
    noise = np.array([-1.0, 1.0] * 10)[:, None]
    # carbon falls by 0.1 in every episode from weight 0 to .5; thaw rises by 0.1 +- 1 from .5 to 1
    carbon = np.array([1.0, 0.9, 2.0]) + 5 * noise
    thaw = np.concatenate([3 + 0 * noise, 2 + 0 * noise, 2.1 + noise], axis=1)
    table = evaluation(carbon, thaw, weights)
    assert metrics.violations_percent(metrics.mean_returns(table)) == 100
    assert metrics.significant_violations_percent(table) == 50
    one_episode = table[table.seed == table.seed.iloc[0]]
    assert np.isnan(metrics.significant_violations_percent(one_episode))  # has no interval


def test_response_to_the_preference():
    weights = [0.0, 0.5, 1.0]
    site = np.array([-4.0, 0.0, 7.0])[:, None]
    slope = np.array([1.0, 2.0, 3.0])[:, None]
    table = evaluation(site + slope * weights, site - np.array(weights), weights)
    response = metrics.preference_response(table)
    assert response.loc["carbon_return", "change"] == pytest.approx(2)
    assert response.loc["carbon_return", "slope"] == pytest.approx(2)
    # the 0.975 quantile of t with 2 degrees of freedom is 4.302653, the standard error 1 / sqrt(3)
    high = response.loc["carbon_return", "change_high"]
    assert high == pytest.approx(2 + 4.302653 / np.sqrt(3), abs=1e-5)
    assert response.loc["thaw_return", "change"] == pytest.approx(-1)
    assert response.loc["thaw_return", "change_low"] == pytest.approx(-1)


def test_unpaired_weights_are_refused():
    table = evaluation(np.zeros((2, 2)), np.zeros((2, 2)), [0.0, 1.0])
    with pytest.raises(ValueError, match="same episodes"):
        metrics.preference_response(table.iloc[:-1])


def test_gains_subtract_zero_change_on_the_same_episode():
    ours = evaluation([[11, 12], [21, 22]], [[1, 2], [3, 4]], [0.0, 1.0])
    zero_change = evaluation([[20], [10]], [[1], [1]], [0.0]).assign(seed=[1, 0])
    gains = metrics.gains(ours, zero_change)
    assert gains.carbon_return.tolist() == [1, 2, 1, 2]
    assert gains.thaw_return.tolist() == [0, 1, 2, 3]
    assert gains.scalarized_return.tolist() == [0, 2, 2, 2]  # thaw at preference 0, carbon at 1, in turn
    with pytest.raises(ValueError, match="seed 1"):
        metrics.gains(ours, zero_change[zero_change.seed == 0])


def test_mean_scalarized():
    table = evaluation([[10, 20]], [[1, 2]], [0.25, 1.0])
    assert metrics.mean_scalarized(table) == pytest.approx((0.25 * 10 + 0.75 * 1 + 20) / 2)


def test_interquartile_mean_ignores_the_outer_quarters():
    assert metrics.iqm([-1000, 1, 2, 3, 4, 5, 6, 1000]) == pytest.approx(3.5)


def test_bootstrap_interval():
    values = np.random.default_rng(3).normal(5, 1, 10)
    low, high = metrics.bootstrap_interval(values)
    assert (low, high) == metrics.bootstrap_interval(values)
    assert low < metrics.iqm(values) < high
    # about +-2 standard errors; the IQM of a normal sample has 1.2 times the variance of its mean
    assert 0.6 < (high - low) / (4 * values.std() * np.sqrt(1.2 / 10)) < 1.4
    assert metrics.bootstrap_interval([2.0, 2.0, 2.0]) == (2.0, 2.0)
    assert np.isnan(metrics.bootstrap_interval([2.0])).all()


@pytest.mark.parametrize(("seeds", "covered"), [(3, 0.75), (5, 0.91)])
def test_few_seeds_have_intervals_that_are_too_narrow(seeds, covered):
    """As docs/results.md says of them."""
    samples = np.random.default_rng(1).normal(size=(400, seeds))
    ends = np.array([metrics.bootstrap_interval(values, repetitions=300) for values in samples])
    assert ((ends[:, 0] < 0) & (ends[:, 1] > 0)).mean() == pytest.approx(covered, abs=0.04)


def test_violations_expected_of_a_random_order():
    # three points on a front: one of their six orders has no violation, two have one of two, three have two
    front = np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0]])
    orders = [front[list(order)] for order in itertools.permutations(range(3))]
    exact = np.mean([metrics.violations_percent(order) for order in orders])
    assert metrics.expected_violations_percent(front) == pytest.approx(exact)
    assert np.isnan(metrics.expected_violations_percent(front[:1]))


def test_band_is_the_interval_at_each_point():
    curves = np.random.default_rng(1).normal(size=(7, 3))
    middle, low, high = metrics.bootstrap_band(curves)
    for k in range(3):
        assert middle[k] == pytest.approx(metrics.iqm(curves[:, k]))
        assert (low[k], high[k]) == pytest.approx(metrics.bootstrap_interval(curves[:, k]), abs=0.15)
    middle, low, high = metrics.bootstrap_band(curves[:1])
    assert middle == pytest.approx(curves[0]) and np.isnan([low, high]).all()


def plans_and_agents(rng, seeds=10, sites=100, between_seeds=0.1, between_sites=0.7):
    """Gains of agents, (seeds, sites), half of those of two constant plans, (plans, weights, sites)."""
    site = rng.normal(0, between_sites, sites)
    plans = np.stack([[2 + site, 1 + site], [1 + site, 2 + site]])
    return 1 + site / 2 + rng.normal(0, between_seeds, (seeds, 1)), plans


def test_score_over_seeds_and_sites():
    gained, plans = plans_and_agents(np.random.default_rng(1))
    value, low, high = metrics.score_interval(gained, plans)
    assert (value, low, high) == metrics.score_interval(gained, plans)
    assert low < value < high and value == pytest.approx(50, abs=5)
    assert metrics.score_interval(plans.max(axis=0).mean(axis=0)[None], plans)[0] == pytest.approx(100)
    assert metrics.score_interval(np.zeros((3, 100)), plans) == (0, 0, 0)
    assert np.isnan(metrics.score_interval(gained[:1], plans)[1:]).all()


def test_both_seeds_and_sites_widen_the_interval():
    def width(**changes):
        gained, _ = plans_and_agents(np.random.default_rng(1), **changes)
        _, low, high = metrics.score_interval(gained, None)
        return high - low

    # 4 standard errors: of 100 sites' halved deviation, of the IQM of ten seeds (1.2 times the variance of their mean)
    assert width(between_seeds=0.0) == pytest.approx(4 * 0.35 / 10, rel=0.2)
    assert width(between_sites=0.0) == pytest.approx(4 * 0.1 * np.sqrt(1.2 / 10), rel=0.4)
    assert width() > max(width(between_seeds=0.0), width(between_sites=0.0))


def test_the_best_plan_is_chosen_anew_on_every_drawn_set_of_sites():
    # each of two plans gains 1 on a half of the sites: on a set that has more of one half, that half's is the best
    half = np.repeat([1.0, 0.0], 50)
    plans = np.stack([half, 1 - half])[:, None, :]
    value, low, high = metrics.score_interval(np.full((4, 100), 0.5), plans)
    assert value == pytest.approx(100) and high < 100 + 1e-9 and low == pytest.approx(100 / (1 + 2 * 0.112), abs=1)


def test_welch_interval_by_hand():
    # means 2 and 4, variances of the means 1/3 and 4/3, so (5/3)^2 / ((1/9 + 16/9) / 2) = 50/17 degrees of freedom
    half_width = scipy.stats.t.ppf(0.975, 50 / 17) * (5 / 3) ** 0.5
    low, high = metrics.welch_interval([1, 2, 3], [2, 4, 6])
    assert (low, high) == pytest.approx((-2 - half_width, -2 + half_width))
    # a single value has no spread of its own
    mean, half_width = metrics.mean_interval([1, 2, 3])
    assert metrics.welch_interval([1, 2, 3], [5]) == pytest.approx((mean - 5 - half_width, mean - 5 + half_width))
    assert metrics.welch_interval([1, 1], [3, 3, 3]) == (-2, -2)


def test_a_difference_has_an_interval_of_four_standard_errors():
    rng = np.random.default_rng(3)
    first, second = (rng.normal(mean, 1, size=(1, 400)) for mean in (1.0, 0.0))
    value, low, high = metrics.difference_interval(first, second)
    assert value == pytest.approx((first - second).mean())
    assert high - low == pytest.approx(4 * (first - second).std() / 20, rel=0.05)
    first, second = (np.tile(rng.normal(size=(200, 1)), 3) for _ in range(2))  # of seeds alone
    _, low, high = metrics.difference_interval(first, second)
    assert high - low == pytest.approx(4 * np.sqrt(1.2 * 2 / 200), rel=0.15)


def test_seeds_that_tell_a_difference():
    values = np.array([-1.0, 1.0]) * 0.1 / np.sqrt(2)  # deviation 0.1
    # G*Power: two groups, d = 1, power 0.8, two-sided 5 %: 17 each
    assert metrics.seeds_to_tell(values, difference=0.1) == 17
    assert metrics.seeds_to_tell(values, difference=0.2) == 6
    assert metrics.seeds_to_tell([1.0, 1.0]) == 2 and np.isnan(metrics.seeds_to_tell([1.0]))
    assert 1000 < metrics.seeds_to_tell([-1.0, 1.0]) < 10_000 and metrics.seeds_to_tell([-9.0, 9.0]) == np.inf


def test_gains_of_sites_and_plans():
    table = evaluation([[1, 2], [3, 4]], [[5, 6], [7, 8]], [0.0, 1.0])
    table["scalarized_return"] = [5, 2, 7, 4]
    assert metrics.of_sites(table).tolist() == [3.5, 5.5]
    plans = pd.DataFrame(
        {"plan": ["a", "a", "b", "b"], "seed": [1, 0, 0, 1], "carbon_return": [1, 2, 3, 4], "thaw_return": 0}
    )
    cube = metrics.plans_of_sites(plans, np.array([(0, 1), (1, 0)]))
    assert cube.tolist() == [[[0, 0], [2, 1]], [[0, 0], [3, 4]]]


def test_numbers_of_evaluation_weights():
    assert [len(fronts.evaluation_weights(number)) for number in (2, 3, 4)] == [5, 15, 20]
    of_lattice = fronts.simplex_lattice(3, 4).max(axis=1).mean()
    assert fronts.expected_utility(np.eye(3), 15) == pytest.approx(of_lattice)


def test_interquartile_means_cut_a_quarter_at_either_end():
    assert metrics.iqm([0, 0, 1, 1, 1, 1, 100, 100]) == 1
    gained = np.array([[1.0] * 20] * 15 + [[-100.0] * 20])
    assert metrics.score_interval(gained, None) == pytest.approx((1, 1, 1))
    one_fails = np.array([[1.0] * 20] * 7 + [[-100.0] * 20])
    assert metrics.difference_interval(one_fails, np.zeros((8, 20)))[0] == pytest.approx(1)
