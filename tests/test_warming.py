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


def test_deepening_is_of_sites_that_stay_frozen():
    rows = [("none", 1, 1.0, 1), ("none", 2, 1.0, 1), ("none", 3, 12.0, 0)]
    for scenario in warming.SCENARIOS:
        rows += [(scenario, 1, 1.4, 1), (scenario, 2, 12.0, 0), (scenario, 3, 12.0, 0)]
    names = ["scenario", "site_seed", "thaw_depth_after_76_m", "frozen_after_76"]
    found = warming.deepening(pd.DataFrame(rows, columns=names).assign(action=NO_CHANGE))
    assert found["median"].to_numpy() == pytest.approx(0.4) and found.share.to_numpy() == pytest.approx(0.4)
    assert (found.sites == 1).all() and (found.lost == 0.5).all()


def test_the_ground_that_no_plan_keeps():
    """Sites of -6, -3 and -1 degC; one of 1 degC thaws without a scenario, and does not count."""
    frozen = {"none": [(1, 1), (1, 1), (1, 1), (0, 1)]} | dict.fromkeys(
        warming.SCENARIOS, [(1, 1), (0, 1), (0, 0), (1, 1)]
    )
    rows = [
        (scenario, site, action, of_plans[k], of_plans[k], (-6.0, -3.0, -1.0, 1.0)[site])
        for scenario, sites in frozen.items()
        for site, of_plans in enumerate(sites)
        for k, action in enumerate((NO_CHANGE, 24))
    ]
    plans = pd.DataFrame(
        rows, columns=["scenario", "site_seed", "action", "frozen_after_50", "frozen_after_76", "deep_after_76_c"]
    )
    years = pd.concat(
        pd.DataFrame({"scenario": name, "year": 2025 + np.arange(76), "warming_k": k * np.arange(76) / 75.0})
        for k, name in enumerate((warming.NONE, *warming.SCENARIOS))
    )
    table, ground = warming.kept(plans, years), warming.always_frozen(plans)
    assert table.warming_k.is_monotonic_increasing and len(ground) == 3
    assert table["first"].tolist().count(2065) == 3 and set(table["last"]) == {2074, 2100}
    assert (table[["no_change", "some_plan", "no_plan", *warming.GROUND_NAMES]] == [1, 2, 1, 1, 1, 0]).all(axis=None)
    cold, _, warm = warming.answer(table, ground).splitlines()
    assert "even 2.8 K does not. Of 1 sites" in cold and "for all of them keeps 1, 1, 1." in cold
    assert "between 0.0 and 0.9 K. Of 1 sites some plan keeps 0" in warm


def test_the_page_says_what_was_played(tmp_path):
    plans, years = warming.study(warming.Args(sites=2), 2, [NO_CHANGE, 24])
    assert len(plans) == 4 * 2 * 2 and len(years) == 4 * 2
    first = years[years.year == 2025].set_index("scenario")
    assert first.warming_k["none"] == 0.0 < first.warming_k["ssp245"] < first.warming_k["ssp585"]
    means = plans.groupby("scenario").thaw_return.mean()
    assert means["none"] > means["ssp585"]
    text = warming.page(plans, years)
    assert "| 1.1 | ssp585, 2025-2026 |" in text and "of the 2 sites are frozen in 2025-2026" in text
    warming.draw(plans, years, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
