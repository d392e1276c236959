"""The map of what a policy plants, in small."""

import numpy as np
import pandas as pd
import pytest

from analysis import document_results, stored
from analysis.studies import boreal_map

pytest.importorskip("zarr")


def test_known_places_are_land_and_sea():
    places = {"Jakutsk": (129.7, 62.0, True), "Fairbanks": (-147.7, 64.8, True), "Bothnia": (20.0, 62.5, False)}
    places |= {
        "Hudson Bay": (-85.0, 60.0, False),
        "Chukotka": (179.0, 67.0, True),
        "Greenland Sea": (-5.0, 70.0, False),
    }
    longitude, latitude, land = map(np.array, zip(*places.values(), strict=True))
    assert boreal_map.on_land(longitude, latitude).tolist() == land.tolist()


@pytest.mark.slow
def test_the_map_of_a_strategy(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    args = boreal_map.Args("plus_100", preference=0.25, quick=True)
    boreal_map.main(args)
    table = stored.read(tmp_path / "results/quick/studies/boreal_map.csv")
    assert len(table) > 40 and table.latitude_deg.between(56, 65).all()
    assert (table.planted_stems_ha_yr == 100.0).all() and (table.conifer_share == 0.5).all()
    assert table.carbon_change_kgc_m2.abs().max() > 0 and table.notna().all(axis=None)
    out = capsys.readouterr().out
    assert "At a carbon weight of 0.25 the policy plants 100 stems/ha a year, 50% of them conifers." in out
    figure = tmp_path / "results/quick/studies/boreal_map.png"
    first = figure.read_bytes()
    figure.unlink()
    boreal_map.main(boreal_map.Args(redraw=True, quick=True))
    assert figure.read_bytes() == first
    (tmp_path / "results/studies").mkdir()
    (tmp_path / "results/quick/studies/boreal_map.csv").rename(tmp_path / "results/studies/boreal_map.csv")
    assert "In the last 3 of 3 years thaw is" in document_results.section(None, "boreal_map")


def test_cells_lie_where_their_stands_are():
    table = pd.DataFrame({"latitude_deg": [56.5, 64.5], "longitude_deg": [-179.0, 177.0], "value": [1.0, 2.0]})
    *corners, values = boreal_map.cell_values(table, "value", 1.0)
    assert values.shape == (9, 179 + 1) and corners[0].shape == (10, 181)
    assert values.compressed().tolist() == [1.0, 2.0] and values[0, 0] == 1.0 and values[8, 178] == 2.0


def test_what_is_not_there_cannot_be_drawn_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="--redraw: no results/studies/boreal_map.csv yet"):
        boreal_map.main(boreal_map.Args(redraw=True))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"spacing": 0.0}, "--spacing 0: above 0 to 4 degrees is allowed"),
        ({"spacing": 20.0}, "--spacing 20: above 0 to 4 degrees is allowed"),
        ({"env_id": "boreal-timber-v0"}, "--env-id boreal-timber-v0: it has more than two objectives"),
        ({"env_id": "boreal-site-v0"}, "--env-id boreal-site-v0: "),
    ],
)
def test_what_no_map_can_be_of_ends_the_script(given, message):
    with pytest.raises(SystemExit, match=message):
        boreal_map.main(boreal_map.Args("plus_100", **given))


def test_unknown_policies_end_the_script(tmp_path):
    with pytest.raises(
        SystemExit, match="--policy nobody: neither the folder .* a fixed strategy is zero_change, plus_100"
    ):
        boreal_map.main(boreal_map.Args("nobody"))
