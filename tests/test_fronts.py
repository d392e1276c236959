import numpy as np
import pandas as pd
import pytest
from scripts import run_script

from analysis import stored
from analysis.studies import fronts, genes, nsga2, open_loop

TINY = genes.Budget(population=8, generations=2, weathers=1, report_weathers=2)


def table_of(plans: dict, kind: str) -> pd.DataFrame:
    """Two weathers of plans given as actions -> (carbon, thaw, conifers planted of 100)."""
    rows = [
        {
            "kind": kind,
            "actions": actions,
            "weather": weather,
            "carbon_return": carbon + weather,
            "thaw_return": thaw - weather,
            **dict.fromkeys(fronts.STAND, 100.0),
            "planted_conifers_ha": conifers,
        }
        for actions, (carbon, thaw, conifers) in plans.items()
        for weather in (4, 5)
    ]
    return pd.DataFrame(rows)


FOUND = {"24 24": (1, 4, 100), "20 20": (3, 1, 0), "24 20": (2, 3, 50), "20 24": (1, 3, 50)}
CONSTANT = {"12 12": (0, 0, 0), "22 22": (2, 2, 50), "2 2": (-1, -1, 0)}


def hand_case() -> pd.DataFrame:
    return pd.concat([table_of(FOUND, "front"), table_of(CONSTANT, "constant")], ignore_index=True)


def test_genes_are_blocks_of_actions():
    assert genes.plans([[4, 0, 2, 2]], block_years=3, years=5).tolist() == [[20, 20, 20, 12, 12]]
    constant = genes.plans(genes.constant_genes(3), 1, 3)
    assert (constant == constant[:, :1]).all()
    assert sorted(constant[:, 0]) == sorted({*range(10), 12, *range(15, 25)})


def test_search_finds_a_known_front():
    """Blocks of conifers against blocks of deciduous trees planted: only full planting is not dominated."""

    def objectives(searched):
        pairs = searched.reshape(len(searched), -1, 2)
        planting = pairs[:, :, 0] == 4
        return np.column_stack([(planting & (pairs[:, :, 1] == mix)).sum(axis=1) for mix in (4, 0)])

    budget = genes.Budget(population=24, generations=30, weathers=1, report_weathers=1)
    found = objectives(nsga2.search(objectives, 4, budget, seed=1))
    assert {tuple(point) for point in found} == {(k, 4 - k) for k in range(5)}


def test_equal_plans_have_equal_genes():
    seen = []

    def objectives(searched):
        seen.append(list(map(tuple, searched)))
        return np.column_stack([searched.sum(axis=1), -searched[:, 0]])

    nsga2.search(objectives, 2, genes.Budget(8, 5, 1, 1), seed=1)
    assert all(len(set(generation)) == len(generation) for generation in seen)
    assert all(gene[k + 1] == genes.HALF for gene in sum(seen, []) for k in (0, 2) if gene[k] == genes.UNCHANGED)


def test_front_gains_and_ends_of_a_hand_case():
    gains = fronts.with_gains(hand_case())
    assert (gains[gains.actions == "12 12"][fronts.GAINS] == 0).all(axis=None)
    front = fronts.plan_means(gains, "front")
    assert front.index.tolist() == ["24 24", "24 20", "20 20"]
    assert front.conifer_share.tolist() == [1, 0.5, 0]
    summary = fronts.summarise(hand_case())
    assert (summary["carbon_extent"], summary["thaw_extent"], summary["points"]) == (2, 3, 3)
    assert (summary["thaw_end_carbon_gain"], summary["carbon_end_thaw_gain"]) == (1, 1)
    assert (summary["zero_carbon"], summary["zero_thaw"]) == (5, -5)


def test_ends_are_measured_on_other_weathers_than_they_are_chosen_on():
    table = hand_case()
    better = (table.actions == "20 24") & (table.weather == 5)  # the best of either return, but where none is chosen
    table.loc[better, ["carbon_return", "thaw_return"]] = [20.0, 20.0]
    summary = fronts.summarise(table)
    assert (summary["carbon_extent"], summary["thaw_extent"]) == (2, 3)
    table.loc[table.actions.isin(["24 24"]) & (table.weather == 5), "thaw_return"] = -20.0
    assert fronts.summarise(table)["thaw_extent"] < 0  # chance alone made it an end


def test_timing_share():
    front, constant = np.array([(1, 4), (2, 3), (3, 1)]), np.array([(2, 2)])
    # from zero change: 4 + 3 + 1 = 8 by the front, 4 by the constant plan
    assert fronts.timing_share(front, constant) == pytest.approx(0.5)
    # from (0, -1): another row of 3 for the front and of 2 for the constant plans
    assert fronts.timing_share(front, np.array([(2, 2), (0, -1)])) == pytest.approx(1 - 6 / 11)


@pytest.mark.slow
def test_a_tiny_front_can_be_repeated_and_is_reported_on_other_weathers():
    site = open_loop.FIRST_SITE_SEED
    table = fronts.study(site, TINY, seed=1, years=6)
    pd.testing.assert_frame_equal(table, fronts.study(site, TINY, seed=1, years=6))
    assert set(table.weather) == {1, 2}
    assert (table.actions.str.split().str.len() == 2).all()


def test_mechanisms_are_switched_off():
    budget = TINY._replace(generations=1, report_weathers=1)
    on, off = (
        fronts.study(open_loop.FIRST_SITE_SEED, budget, seed=1, years=1, mechanisms=switches)
        for switches in (None, {"moss": False})
    )
    on, off = (of[of.kind == "constant"].thaw_return.to_numpy() for of in (on, off))
    assert (on != off).all()


@pytest.mark.slow
def test_a_finished_front_is_not_searched_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(fronts, "QUICK", TINY)
    monkeypatch.setattr(fronts, "YEARS", 6)
    fronts.main(fronts.Args(quick=True, sites=1, output_dir=tmp_path))
    before = stored.read(tmp_path / "summary.csv")
    monkeypatch.setattr(fronts, "study", None)
    fronts.main(fronts.Args(quick=True, sites=1, output_dir=tmp_path))
    assert "1 of 1 fronts are there" in capsys.readouterr().out
    pd.testing.assert_frame_equal(stored.read(tmp_path / "summary.csv"), before)
    with pytest.raises(TypeError):  # another search's seed: the stored front is not taken for it
        fronts.main(fronts.Args(quick=True, sites=1, output_dir=tmp_path, seed=2))


def test_refusals(capsys):
    with pytest.raises(SystemExit, match="--sites 401: 1 to 400 are"):
        run_script("analysis/studies/fronts.py", "--sites", 401)
