import numpy as np
import pandas as pd
import pytest
from scripts import run_script

from analysis import stored
from analysis.studies import constant_plans, mechanism_pairs, site_warming
from cleanrl_style.protocol import reference


def test_a_pair_differs_in_its_one_thing(monkeypatch):
    chosen = [name for name in mechanism_pairs.PAIRS if name.startswith(("conifer fraction", "growing season by"))]
    monkeypatch.setattr(mechanism_pairs, "PAIRS", {name: mechanism_pairs.PAIRS[name] for name in chosen})
    monkeypatch.setattr(mechanism_pairs, "OFF", (mechanism_pairs.ALL_ON, "interception"))
    both = mechanism_pairs.study(sites=2, years=2)
    assert both.groupby(["off", "pair"]).size().tolist() == [2] * 4
    table = both[both.off == mechanism_pairs.ALL_ON].set_index("pair")
    climate, conifers = (table.loc[name] for name in chosen)
    assert (climate.upper_growing_season_days > climate.lower_growing_season_days).all()
    # the same weather: the air is the same whatever stands in it
    assert (conifers.upper_growing_season_days == conifers.lower_growing_season_days).all()
    assert (conifers.upper_winter_albedo < conifers.lower_winter_albedo).all()
    assert table.site_seed.nunique() == 2
    np.testing.assert_array_equal(
        mechanism_pairs.effects(both, chosen[0], "peak_swe_mm"), climate.upper_peak_swe_mm - climate.lower_peak_swe_mm
    )
    bare = both[both.off == "interception"].set_index("pair").loc[chosen[0]]
    assert (bare.lower_peak_swe_mm > climate.lower_peak_swe_mm).all()  # no tree catches snow


def test_drawn_episodes_are_of_both_kinds():
    episodes = pd.DataFrame({"site_seed": range(20), "selected": [0] * 5 + [1] * 15})
    drawn = site_warming.drawn_episodes(episodes, seed=1, each=8)
    assert drawn.selected.value_counts().to_dict() == {1: 8, 0: 5}
    assert drawn.site_seed.is_unique
    assert drawn.equals(site_warming.drawn_episodes(episodes, seed=1, each=8))
    assert not drawn.equals(site_warming.drawn_episodes(episodes, seed=2, each=8))


@pytest.mark.slow
def test_a_study_is_made_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(reference, "PLANS", ("12", "24"))
    monkeypatch.setattr(reference, "cache_folder", lambda: tmp_path / "cache" / "kernels")
    monkeypatch.setattr(reference, "shipped", lambda env_id: tmp_path / "none")
    monkeypatch.setattr(constant_plans.paths, "studies", lambda quick: tmp_path)
    monkeypatch.setattr(stored.provenance, "physics_name", lambda: "physics")
    constant_plans.main(constant_plans.Args(quick=True))
    table = stored.read(tmp_path / "constant_plans.csv")
    environments = (*constant_plans.ENVIRONMENTS, "boreal-timber-v0")
    assert table.groupby("env_id").size().to_dict() == dict.fromkeys(environments, 4)
    seeds = [set(rows.seed) for _, rows in table.groupby("env_id")]
    assert all(one == seeds[0] for one in seeds) and len(seeds[0]) == 2
    constant_plans.main(constant_plans.Args(quick=True))
    assert "is finished" in capsys.readouterr().out


def test_site_warming_needs_the_curriculum(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="ppo_curriculum.py --seed 1"):
        run_script("analysis/studies/site_warming.py")
