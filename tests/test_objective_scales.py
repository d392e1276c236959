"""Scales of objectives: a quick study, and its numbers by hand."""

import numpy as np
import pytest

from analysis import stored
from analysis.studies import objective_scales
from sim.task.timber import TIMBER_SCALE


def test_the_quick_study_by_hand(tmp_path, monkeypatch):
    monkeypatch.setattr(objective_scales.reference, "PLANS", ("12", "2", "24"))  # nothing, cut, plant
    monkeypatch.setattr(objective_scales.paths, "studies", lambda quick: tmp_path)
    records = []
    play = objective_scales.play
    monkeypatch.setattr(objective_scales, "play", lambda *args: records.append(play(*args)) or records[-1])
    for _ in range(2):  # the second finds the table
        objective_scales.main(objective_scales.Args(quick=True))
    (record,) = records
    table = stored.read(tmp_path / "objective_scales.csv")
    assert table.objective.tolist() == ["carbon", "thaw", "biodiversity", "timber", "timber", "timber"]
    finland = table[table.prices == "finland"].iloc[0]
    revenue = record["discounted_revenue_eur_ha"]  # the task's own, at Finnish prices
    assert revenue.shape == (3, 2, 3)
    assert finland.largest_eur_ha == pytest.approx(revenue.max(), rel=1e-6) and finland.largest_eur_ha > 0.0
    assert finland.smallest_eur_ha == pytest.approx(revenue.min(), rel=1e-6) and finland.smallest_eur_ha < 0.0
    returns = revenue.sum(axis=2) / TIMBER_SCALE
    by_site = [np.std(returns[:, site]) for site in range(2)]
    assert finland.spread == pytest.approx(np.sqrt(np.mean(np.square(by_site))), rel=1e-6)
    assert table.spread.min() > 0.0
