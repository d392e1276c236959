"""Output as an xarray Dataset: the tables' numbers in other units, CF's attributes, and NetCDF that comes back."""

import json

import numpy as np
import pytest

import sim
from sim.io.dataset import PROFILE, VARIABLES
from sim.parameters import CONSTANTS
from sim.state import DAILY, RECORD

xarray = pytest.importorskip("xarray")
RUN = {"years": 2, "time_step_minutes": 120, "seed": 4, "hold_stand": True, "boundary": -1.0}


@pytest.fixture(scope="module")
def dataset():
    return sim.simulate(output="xarray", **RUN)


@pytest.fixture(scope="module")
def daily():
    return sim.simulate(output="daily", **RUN)


def test_numpys_integers_are_as_pythons(dataset):
    with_numpys = RUN | {name: np.int64(RUN[name]) for name in ("years", "time_step_minutes", "seed")}
    assert sim.simulate(output="xarray", **with_numpys).identical(dataset)


@pytest.mark.parametrize("columns", [RECORD, DAILY])
def test_every_column_has_a_meaning_of_its_own(columns):
    meanings = [meaning for _, meaning in columns.values()]
    assert len(set(meanings)) == len(meanings)
    assert not [m for m in meanings if m == "mean" or m.startswith(("part of", "of which", "the same"))]


def test_every_column_of_both_tables_is_there(dataset):
    assert {*VARIABLES, *PROFILE} == {*DAILY, "nee_kgc_m2"}
    assert {name for name in dataset if name.startswith("annual_")} == {
        f"annual_{name}" for name in (*RECORD, "nee_kgc_m2")
    }
    names = [name for name, *_ in VARIABLES.values()]
    assert len(set(names)) == len(names) and set(names) <= set(dataset)


def test_numbers_are_the_tables_in_units_of_alma(dataset, daily):
    seconds, flows = 86400.0, ("precipitation_mm", "evapotranspiration_mm", "runoff_mm")
    for column, (name, *_) in VARIABLES.items():
        values = dataset[name]
        if column in flows or column.endswith("_kgc_m2"):
            values = values * seconds
        elif column.endswith("_mj_m2"):
            values = values * seconds / 1e6
        elif column.endswith("_c"):
            values = values - 273.15
        np.testing.assert_allclose(values, daily[column], rtol=1e-12, atol=1e-10, err_msg=column)
    np.testing.assert_array_equal(dataset.time, daily.index)
    annual = sim.simulate(**RUN)
    np.testing.assert_array_equal(dataset.annual_active_layer_depth_m, annual.active_layer_depth_m)
    assert dataset.year.values.tolist() == [2025, 2026]


def test_the_soils_profile_is_at_the_depths_of_its_nodes(dataset, daily):
    constant = {name: CONSTANTS[name].low for name in ("surface_soil_depth_m", "deep_soil_node_m", "boundary_depth_m")}
    surface, deep, boundary = constant.values()
    assert dataset.depth.values.tolist() == [0.0, 0.5 * surface, deep, boundary]
    for k, name in enumerate(PROFILE):
        np.testing.assert_allclose(dataset.SoilTemp[:, k] - 273.15, daily[name], atol=1e-10)
    np.testing.assert_allclose(dataset.SoilTemp[:, 3], 272.15)
    middle = dataset.SoilTemp.sel(depth=[deep, boundary]).mean("depth")
    np.testing.assert_allclose(dataset.SoilTemp.interp(depth=0.5 * (deep + boundary)), middle)


def test_units_and_attributes_are_those_of_cf(dataset):
    assert dataset.attrs["Conventions"].startswith("CF-") and dataset.attrs["seed"] == 4
    assert '"latitude_deg"' in dataset.attrs["site"]
    found = json.loads(dataset.attrs["site"])["deep_boundary_temperature_k"]
    assert found == pytest.approx(float(dataset.SoilTemp[0, -1]))
    about = {
        "constants",
        "mechanisms",
        "weather",
        "boundary",
        "soil_carbon",
        "harvest_min_class",
        "hwp_half_life_years",
    }
    assert about <= set(dataset.attrs)
    for name, variable in dataset.data_vars.items():
        if name != "time_bnds":
            assert variable.attrs["units"] and variable.attrs["long_name"], name
            assert "kgC" not in variable.attrs["units"] and "stems" not in variable.attrs["units"], name
    assert dataset.GPP.attrs["standard_name"] == "gross_primary_productivity_of_biomass_expressed_as_carbon"
    assert "at the day's end" in dataset.SWE.attrs["comment"] and "cell_methods" not in dataset.SWE.attrs
    assert dataset.time.attrs["bounds"] == "time_bnds" and dataset.depth.attrs["positive"] == "down"


def test_netcdf_comes_back_and_is_the_same_bytes(dataset, tmp_path):
    pytest.importorskip("h5netcdf")
    for name in ("a.nc", "b.nc"):
        sim.simulate(output="xarray", **RUN).to_netcdf(tmp_path / name, engine="h5netcdf")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
    with xarray.open_dataset(tmp_path / "a.nc") as again:
        xarray.testing.assert_identical(again.load(), dataset)
        assert (again.time_bnds.diff("bnds").values == np.timedelta64(1, "D")).all()
