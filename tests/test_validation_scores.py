"""Skill by hand, verdicts of bands, and the interval of a count."""

import math

import pytest

from analysis.validation.scores import Band, poisson_interval, skill


def test_skill_by_hand():
    s = skill([2.0, 4.0, 9.0, 1.0], [1.0, 5.0, 6.0, float("nan")])
    assert s.bias == pytest.approx((1.0 - 1.0 + 3.0) / 3.0)
    assert s.rmse == pytest.approx(math.sqrt((1.0 + 1.0 + 9.0) / 3.0))
    # deviations from the means 5 and 4: (-3, -1, 4) and (-3, 1, 2)
    assert s.r == pytest.approx((9.0 - 1.0 + 8.0) / math.sqrt(26.0 * 14.0))
    assert s.pairs == 3


def test_skill_without_a_pair_is_nan():
    s = skill([1.0, float("nan")], [float("nan"), 2.0])
    assert s.pairs == 0 and math.isnan(s.bias) and math.isnan(s.rmse) and math.isnan(s.r)


@pytest.mark.parametrize(
    ("value", "verdict"), [(0.39, "MISS, low"), (0.4, "in"), (0.6, "in"), (0.8, "in"), (0.81, "MISS, high")]
)
def test_a_band_contains_its_ends(value, verdict):
    assert Band(0.4, 0.8).verdict(value) == verdict


def test_share_of_a_sample_within_a_band():
    assert Band(0.0, 1.0).share_within([-1.0, 0.0, 0.5, 2.0]) == 0.5


def test_a_band_refuses_nan_and_a_reversed_range():
    with pytest.raises(ValueError, match="got NaN"):
        Band(0.0, 1.0).verdict(float("nan"))
    with pytest.raises(ValueError, match="reversed: 2 > 1"):
        Band(2.0, 1.0)


@pytest.mark.parametrize(("events", "low", "high"), [(0, 0.0, 3.689), (1, 0.0253, 5.572), (10, 4.795, 18.390)])
def test_poisson_interval_is_the_published_one(events, low, high):
    """Garwood (1936)'s limits."""
    assert poisson_interval(events) == pytest.approx((low, high), rel=1e-3)
