"""The study of constant plans under climate change."""

import numpy as np
import pandas as pd
import pytest

from analysis.studies import warming
from boreal_env import NO_CHANGE


def plans_of(**by_scenario):
    """Rows of two sites; by_scenario : action -> [(carbon, thaw) of each site]."""
    rows = [
        {"scenario": scenario, "site_seed": site, "action": action, "carbon_return": carbon, "thaw_return": thaw}
        for scenario, plans in by_scenario.items()
        for action, returns in plans.items()
        for site, (carbon, thaw) in enumerate(returns)
    ]
    return pd.DataFrame(rows).assign(clipped_thaw_years=5)


def test_fronts_and_best_plans():
    plans = plans_of(
        none={12: [(0.0, 0.0)] * 2, 20: [(2.0, -1.0)] * 2, 24: [(1.0, 1.0)] * 2},
        ssp585={12: [(0.0, -4.0)] * 2, 20: [(3.0, -3.0), (9.0, -3.0)], 24: [(1.0, -3.0)] * 2},
    )
    fronts = warming.fronts(plans)
    assert list(fronts["none"].index) == [24, 20] and list(fronts["ssp585"].index) == [20]
    best = warming.best_plans(plans)
    assert best.loc["none", ["best_0", "best_0.5", "best_1"]].tolist() == [24, 24, 20]
    assert best.loc["ssp585", "zero_thaw"] == -4.0 and best.clipped.tolist() == [0.1, 0.1]
    assert warming.moved_sites(plans)["ssp585"] == 1.0 and warming.moved_sites(plans)["none"] == 0.0


def test_the_warming_at_which_half_of_the_sites_are_lost():
    share = np.r_[np.full(20, 1.0), np.zeros(20)]
    years = pd.DataFrame({"scenario": "ssp585", "year": 2025 + np.arange(40), "warming_k": 1.0 + 0.1 * np.arange(40)})
    years = years.assign(lost=share, kept=1.0)
    found = warming.threshold(years, "lost")
    assert found == (pytest.approx(3.5), 2050)  # the mean of ten years is below a half after six without ice
    assert warming.threshold(years, "kept") is None


def test_deepening_is_of_sites_that_stay_frozen():
    rows = [("none", 1, 1.0, 1), ("none", 2, 1.0, 1), ("none", 3, 12.0, 0)]
    for scenario in warming.SCENARIOS:
        rows += [(scenario, 1, 1.4, 1), (scenario, 2, 12.0, 0), (scenario, 3, 12.0, 0)]
    names = ["scenario", "site_seed", "thaw_depth_after_76_m", "frozen_after_76"]
    found = warming.deepening(pd.DataFrame(rows, columns=names).assign(action=NO_CHANGE))
    assert found["median"].to_numpy() == pytest.approx(0.4) and (found.sites == 1).all() and (found.lost == 1).all()


def test_the_ground_that_no_plan_keeps():
    frozen = {"none": [(1, 1), (1, 1), (1, 1), (0, 1)]} | dict.fromkeys(
        warming.SCENARIOS, [(1, 1), (0, 1), (0, 0), (0, 0)]
    )
    rows = [
        (scenario, site, action, of_plans[k], -6.0 + 2.0 * site)
        for scenario, sites in frozen.items()
        for site, of_plans in enumerate(sites)
        for k, action in enumerate((NO_CHANGE, 24))
    ]
    names = ["scenario", "site_seed", "action", "frozen_after_76", "deep_after_76_c"]
    found = warming.lost_ground(pd.DataFrame(rows, columns=names)).loc["ssp245"]
    assert found.to_dict() == {"sites": 3, "lost": 1, "saved": 1, "coldest_lost": -2.0, "warmest_kept": -4.0}


def test_the_page_says_what_was_played(tmp_path):
    plans, years = warming.study(warming.Args(sites=2), 2, [NO_CHANGE, 24])
    assert len(plans) == 4 * 2 * 2 and len(years) == 4 * 2
    first = years[years.year == 2025].set_index("scenario")
    assert first.warming_k["none"] == 0.0 < first.warming_k["ssp245"] < first.warming_k["ssp585"]
    means = plans.groupby("scenario").thaw_return.mean()
    assert means["none"] > means["ssp585"]
    text = warming.page(plans, years)
    assert "Of the 2 sites" in text and "| ssp585 | 1.1 |" in text and "| ssp126 |" in text
    warming.draw(plans, years, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
