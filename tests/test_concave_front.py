"""The study of a front that a weighted sum misses, on three plans that are known."""

import pandas as pd
import pytest

from analysis.studies import concave_front
from cleanrl_style import protocol

RETURNS = {"12": (0.0, 0.0), "24": (0.0, 4.0), "22": (1.7, 1.7), "20": (4.0, 0.0), "4": (1.0, 1.0)}
PLANS = pd.DataFrame(
    [{"plan": plan, "seed": 0, "carbon_return": c + 5, "thaw_return": t - 9} for plan, (c, t) in RETURNS.items()]
)


def test_the_middle_is_chebyshev_s_alone(monkeypatch):
    monkeypatch.setattr(concave_front.reference, "reference_returns", lambda task, seeds: PLANS)
    monkeypatch.setattr(concave_front, "ideal_point", lambda task: (9.0, -5.0))
    front, choices = concave_front.study(protocol.Task.of("boreal-site-specific-v0"), [0])
    assert front.plan.tolist() == ["24", "22", "20"] and front.carbon_gain.tolist() == pytest.approx([0, 1.7, 4])
    assert front.linear.iloc[1] == 0 and (front.linear.iloc[[0, 2]] > 40).all() and (front.chebyshev > 20).all()
    figure = concave_front.draw(front, choices, "three plans")
    left, right = figure.axes
    assert len(left.texts) == 3 and len(right.lines) == 2


def test_another_environment_is_refused(tmp_path):
    with pytest.raises(SystemExit, match="--env-id toy_env:toy-v0: a boreal environment is allowed"):
        concave_front.main(concave_front.Args(env_id="toy_env:toy-v0", path=tmp_path / "front.png"))
