import numpy as np
import pandas as pd
import pytest
from scripts import run_script

import sim
from analysis import stored
from analysis.studies import open_loop, variance

SITE = open_loop.FIRST_SITE_SEED + 2


def test_additive_table_has_no_interactions():
    site, weather, policy = np.array([1.0, 4, 7, 20]), np.array([[0.0, 2], [1, 3], [5, 3], [4, 6]]), np.array([-3.0, 3])
    weather = weather - weather.mean(axis=1, keepdims=True)
    components = variance.variance_components(site[:, None, None] + weather[:, :, None] + policy)
    within = weather.var(axis=1, ddof=1).mean()
    assert components["site"] == pytest.approx(site.var(ddof=1) - within / 2)  # a site's mean has half of its weathers'
    assert components["weather"] == pytest.approx(within) and components["policy"] == pytest.approx(18)
    assert components[["site x policy", "weather x policy"]].abs().max() < 1e-12


def test_components_of_a_synthetic_table():
    true = {"site": 9.0, "weather": 1.5, "policy": 4.0, "site x policy": 2.0, "weather x policy": 1.0}
    sizes = (12, 10, 11)
    of = {"site": (0,), "weather": (0, 1), "policy": (2,), "site x policy": (0, 2), "weather x policy": (0, 1, 2)}
    generator = np.random.default_rng(0)
    estimates = []
    for _ in range(400):
        values = np.zeros(sizes)
        for name, component in true.items():
            shape = [size if axis in of[name] else 1 for axis, size in enumerate(sizes)]
            values = values + component**0.5 * generator.standard_normal(shape)
        estimates.append(variance.variance_components(values))
    estimates = pd.DataFrame(estimates)
    error = (estimates.mean() - pd.Series(true)) / (estimates.std() / 20)
    assert error.abs().max() < 4


def test_one_weather_a_site():
    """Two factors without repeats: the site's, the policy's, and what is left."""
    values = np.array([[[0.0, 2.0, 7.0]], [[1.0, 5.0, 3.0]]])
    components = variance.variance_components(values)
    # sums of squares 0, 21 and 13 with 1, 2 and 2 degrees of freedom
    expected = {"site": -6.5 / 3, "weather": 0, "policy": 2, "site x policy": 6.5, "weather x policy": 0}
    assert components.to_dict() == pytest.approx(expected)


def test_a_small_component_may_be_estimated_below_zero():
    # the sites' means are equal, which weathers alone would make unlikely
    values = np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None] + np.zeros(2)
    components = variance.variance_components(values)
    assert components["site"] == pytest.approx(-1) and components["weather"] == pytest.approx(2)


def test_objectives_are_compared_by_what_their_returns_vary_with():
    generator = np.random.default_rng(2)
    sites, weathers, policies = (generator.standard_normal(n) for n in (400, (400, 30), 30))
    parts = 3 * sites[:, None, None] + weathers[:, :, None] + policies
    one = variance.compared(np.stack([parts, 2 * parts], axis=-1))
    assert one["standard deviation, carbon"] == pytest.approx(np.sqrt(9 * sites.var() + 1 + 1), rel=0.2)
    assert one["thaw over carbon"] == pytest.approx(2) and one["thaw over carbon, decided"] == pytest.approx(2)
    both = weathers.var(axis=1, ddof=1).mean() + policies.var(ddof=1)
    assert one["decided on a site, carbon"] == pytest.approx(policies.var(ddof=1) / both)
    table = variance.with_intervals(np.stack([parts, 2 * parts], axis=-1)[:40]).set_index("quantity")
    assert table.loc["thaw over carbon"].tolist() == pytest.approx([2, 2, 2])
    spread = table.loc["standard deviation, carbon"]
    assert 0.8 * spread.value < spread.low < spread.value < spread.high < 1.2 * spread.value


def test_what_explains_the_sites():
    generator = np.random.default_rng(1)
    features = pd.DataFrame(generator.standard_normal((400, 2)), columns=["boundary_above_air_k", "snow_mm_day"])
    boundary, snow = features.to_numpy().T
    exact = variance.site_effect(3 * boundary - snow + 5, features)
    assert exact["both"] == pytest.approx(1) and exact["rest"] == pytest.approx(0)
    assert exact["boundary minus air"] == pytest.approx(0.9, abs=0.03)
    nothing = variance.site_effect(generator.standard_normal(400), features)
    assert nothing["rest"] == pytest.approx(1, abs=0.03)


@pytest.mark.slow
def test_a_tiny_design(tmp_path, monkeypatch):
    monkeypatch.setattr(variance, "YEARS", 2)
    variance.main(variance.Args(quick=True, output_dir=tmp_path))
    components = stored.read(tmp_path / "components.csv")
    assert components.groupby(["objective", "value"]).share.sum().to_numpy() == pytest.approx(np.ones(4))
    episodes = stored.read(tmp_path / "episodes.csv")
    assert len(episodes) == 4 * 2 * len(variance.POLICIES)
    unchanged = episodes[episodes.policy == "zero change"]
    assert (unchanged[["carbon_gain", "thaw_gain"]] == 0).all(axis=None)
    # a row in the middle carries the right labels
    row = episodes[(episodes.site == SITE) & (episodes.weather == 1) & (episodes.policy == "-50 half")].iloc[0]
    played = open_loop.play([sim.sample_site(SITE)], [open_loop.own_seeds(SITE, 1, 2)], [[7, 7]]).returns()[0]
    assert row[["carbon_return", "thaw_return"]].tolist() == pytest.approx(played, rel=1e-8)


def test_refusals():
    with pytest.raises(SystemExit, match="--sites >= 4"):
        run_script("analysis/studies/variance.py", "--sites", 1)
