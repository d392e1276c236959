"""Many sites at once: each as it is alone, in any chunks, killed or not; bad tables named by row and column."""

import glob
import os

import numpy as np
import pandas as pd
import pytest

import boreal_env
import sim
from cleanrl_style.protocol import reference
from sim.block import LANES
from sim.region import many, store
from sim.region.store import in_words

pytest.importorskip("zarr")
xarray = pytest.importorskip("xarray")

COARSE = {"time_step_minutes": 1440, "threads": 1, "progress": False}  # days of one step: chunks in a tenth of a second
NUMBER, YEARS = 36, 3


@pytest.fixture(autouse=True)
def one_kernel(monkeypatch):
    """For few stands, too: lanes change no bit (tests/test_backends.py)."""
    monkeypatch.setattr("sim.stands.lanes_for", lambda number, threads: LANES)


@pytest.fixture
def chunks_of_twelve(monkeypatch):
    monkeypatch.setattr(many, "LARGEST_CHUNK", 16)


def table(number=NUMBER):
    rows = np.arange(number)
    return pd.DataFrame(
        {
            "latitude_deg": 56.0 + 9.0 * rows / number,
            "wind_speed_m_s": 2.0 + 0.1 * rows,
            "density_stems_ha": 50.0 * rows,
        }
    )


def plan(number=NUMBER, years=YEARS):
    return np.random.default_rng(1).integers(25, size=(number, years))


def bytes_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_stand_of_a_table_is_what_it_is_alone(chunks_of_twelve):
    sites = table()
    found = sim.simulate_many(sites, plan(), years=YEARS, seed=7, boundary="balanced", **COARSE)
    assert dict(found.sizes) == {"stand": NUMBER, "year": YEARS} and found.year[0] == 2025
    assert found.initial_density_stems_ha.attrs["units"] == "ha-1"
    assert found.latitude_deg.attrs["units"] == "degrees_north"
    assert set(found.coords) == {"latitude_deg", "wind_speed_m_s", "initial_density_stems_ha", "seed", "year"}
    assert found.active_layer_depth_m.units == "m" and "thaw" in found.active_layer_depth_m.long_name
    for k in (0, 17, NUMBER - 1):
        site = sites.loc[k, ["latitude_deg", "wind_speed_m_s"]].to_dict()
        alone = sim.simulate(
            site,
            plan()[k],
            seed=7 + k,
            years=YEARS,
            initial={"density_stems_ha": 50.0 * k},
            boundary="balanced",
            time_step_minutes=1440,
        )
        for name in many.VARIABLES:
            np.testing.assert_array_equal(found[name][k], alone[name].astype(np.float32), err_msg=name)


def test_a_policy_sees_what_an_environment_shows():
    """Other parameters sampled and first stocks drawn: the table has the latitude alone."""
    seen = []

    def policy(observations, masks, returns):
        seen.append((observations, masks, returns))
        return np.eye(25)[masks.argmax(axis=1)]

    sites = pd.DataFrame({"latitude_deg": [58.0, 61.0, 64.0], "seed": [5, 6, 7]})
    found = sim.simulate_many(
        sites, policy, years=2, others="sampled", preference=0.25, variables=("carbon_reward", "thaw_reward"), **COARSE
    )
    _, (first, masks, nothing), (second, _, returns) = seen  # the first call tells policies apart
    assert (first[:, 0] == 0.25).all() and masks.dtype == bool and not nothing.any()
    np.testing.assert_array_equal(found.action[:, 0], masks.argmax(axis=1))
    rewards = np.column_stack([found.carbon_reward[:, 0], found.thaw_reward[:, 0]])
    np.testing.assert_array_equal(returns, rewards)
    names = list(boreal_env.OBSERVATION_NAMES)
    site = sim.sample_site(6, {"latitude_deg": 61.0})
    shares = sim.scale_site(site).astype(np.float32)
    np.testing.assert_allclose(first[1, names.index(f"site_{sim.OBSERVED_SITE_PARAMETERS[0]}") :], shares, rtol=1e-6)


def test_a_policy_that_ships_is_taken_as_it_is_loaded():
    pytest.importorskip("torch")
    from cleanrl_style.protocol import load_policy

    policy = load_policy("ppo_group-balanced")
    found = sim.simulate_many(table(2), policy, years=2, others="sampled", **boreal_env.BALANCED_WORLD, **COARSE)
    assert (found.planted_stems_ha > 0).any()
    with pytest.warns(UserWarning, match="was trained with weather='observed', boundary='balanced', soil_carbon='bal"):
        sim.simulate_many(table(2), policy, years=1, **COARSE)
    with pytest.raises(ValueError, match="'ppo_group-balanced' is of another world: it observes 105 entries, here are"):
        sim.simulate_many(table(2), policy, years=2, observation_groups=("state",), **COARSE)


def test_a_fixed_strategy_and_wrong_answers():
    from baselines_heuristic import plus_100, target_density

    sites = table(3)
    for module in (plus_100, target_density):
        found = sim.simulate_many(sites, module.policy, years=2, **COARSE)
        assert found.planted_stems_ha.max() == 100.0
    with pytest.raises(ValueError, match="25"):
        sim.simulate_many(sites, lambda observations, masks: np.full(len(masks), 25), **COARSE)
    with pytest.raises(ValueError, match="policy: finite probabilities"):
        sim.simulate_many(sites, lambda observations, masks: masks * np.nan, **COARSE)
    with pytest.raises(ValueError, match="a function of observations and valid actions"):
        sim.simulate_many(sites, lambda observations: np.zeros(len(observations), int), **COARSE)


@pytest.mark.parametrize("where", ["creation", "play", "write", "end"])
def test_killed_and_resumed_is_as_never_killed(where, chunks_of_twelve, tmp_path, monkeypatch):
    owner, name, moment = {
        "creation": (many.Store, "_create", 1),
        "play": (many, "play", 3),
        "write": (many.Store, "write", 2),
        "end": (many.Store, "dataset", 1),
    }[where]
    true, calls = getattr(owner, name), []

    def failing(*args):
        calls.append(args)
        if len(calls) < moment:
            return true(*args)
        if where == "creation":
            true(*args)
        if where == "write":
            args[0].group["action"][args[0].plan.rows(args[1])] = 3  # half a chunk is there
        raise KeyboardInterrupt

    def simulate(name):
        return sim.simulate_many(table(), plan(), path=tmp_path / name, years=YEARS, **COARSE)

    with monkeypatch.context() as patched:
        patched.setattr(owner, name, failing)
        with pytest.raises(KeyboardInterrupt):
            simulate("killed.zarr")
    assert not (tmp_path / "killed.zarr").exists()
    played = []
    monkeypatch.setattr(many, "play", lambda part, play=many.play: played.append(part) or play(part))
    resumed = simulate("killed.zarr")
    assert len(played) == {"creation": 3, "play": 1, "write": 2, "end": 0}[where]
    simulate("whole.zarr")
    assert bytes_of(tmp_path / "killed.zarr") == bytes_of(tmp_path / "whole.zarr")
    assert not list(tmp_path.glob("*.partial"))
    assert resumed.action.to_numpy().tolist() == plan().tolist()


def test_objectives_with_prices_have_units_and_need_no_preference():
    world = {"objectives": ("carbon", "thaw", "timber"), "timber": "finland"}
    variables = ("timber_m3_ha", "net_revenue_eur_ha", "timber_reward", "gpp_kgc_m2")
    found = sim.simulate_many(table(2), None, years=1, variables=variables, **world, **COARSE)
    assert [found[name].units for name in variables] == ["m3 ha-1", "EUR ha-1", "1", "kg m-2"]
    assert (found.action == boreal_env.NO_CHANGE).all()
    with pytest.raises(ValueError, match="unknown argument 'record_steps'"):
        sim.simulate_many(table(2), years=1, record_steps=True, **COARSE)


@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="says which files are open")
def test_what_is_removed_is_closed_before(tmp_path, monkeypatch):
    """NFS keeps an open file under another name in the folder, which then cannot be removed."""
    unlink, removed = store.Path.unlink, []

    def closed(path, *args, **kwargs):
        if path.name == "lock":
            held = [os.path.realpath(one) for one in glob.glob("/proc/self/fd/*")]
            removed.append(str(path) in held)
        unlink(path, *args, **kwargs)

    monkeypatch.setattr(store.Path, "unlink", closed)
    sim.simulate_many(table(2), 12, path=tmp_path / "a.zarr", years=1, **COARSE)
    assert removed == [False] and [path.name for path in tmp_path.iterdir()] == ["a.zarr"]


def test_another_simulation_is_not_gone_on_with(tmp_path):
    path = tmp_path / "region.zarr"
    sites = table(2)
    sim.simulate_many(sites, path=path, years=1, **COARSE)
    sim.simulate_many(sites, path=path, years=1, **COARSE)  # it is finished
    with pytest.raises(ValueError, match=r"region.zarr holds another simulation: actions 12 there, 13 now"):
        sim.simulate_many(sites, 13, path=path, years=1, **COARSE)
    with pytest.raises(ValueError, match="another simulation: sites"):
        sim.simulate_many(sites + 0.5, path=path, years=1, **COARSE)
    found = sim.simulate_many(sites, 13, path=path, years=1, overwrite=True, **COARSE)
    assert (found.action == 13).all()
    (tmp_path / "other").mkdir()
    with pytest.raises(ValueError, match="no store of simulate_many"):
        sim.simulate_many(sites, path=tmp_path / "other", years=1, **COARSE)


def test_what_is_simulated_is_told_apart_by_all_of_it(tmp_path):
    path, prices = pd.DataFrame({"year": np.arange(2025, 2101), "warming_k": 0.0}), tmp_path / "prices.csv"
    hot = path.assign(warming_k=np.where(np.arange(76) // 10 == 3, 12.0, 0.0))
    prices.write_text("value\n1")
    earlier = in_words(str(prices))
    prices.write_text("value\n2")
    assert earlier != in_words(str(prices)) == in_words(str(prices))

    def until(year):
        return lambda observations, masks: observations[:, 1] < year

    gain, loss = (boreal_env.Objective("mine", f) for f in (lambda y: y["a"] / 5, lambda y: -y["a"] / 5))
    pairs = (
        (path, hot),
        (dict(path), dict(hot)),
        (hot.to_numpy(), path.to_numpy()),
        (until(1), until(2)),
        (gain, loss),
    )
    for one, other in pairs:
        assert in_words(one) != in_words(other)

    def recursive(year):
        return year in {"a", "b"} or (year > 0 and recursive(year - 1))

    assert in_words(until(1)) == in_words(until(1)) and in_words(recursive) == in_words(recursive)
    assert in_words({"b", "a"}) == in_words({"a", "b"}) == "['a', 'b']"
    assert in_words(path) == in_words(path.copy())
    assert len(in_words(path)) < 250


def test_variables_may_come_one_by_one():
    wanted = (name for name in sim.RECORD_NAMES if name.startswith("biomass"))
    found = sim.simulate_many(table(2), variables=wanted, years=1, **COARSE)
    assert set(found.data_vars) == {"biomass_kgc_m2", "biomass_change_kgc_m2", "action"}


@pytest.mark.parametrize("name", ["latitude_deg/c/0", "biomass_kgc_m2/c/0/0", "biomass_kgc_m2/zarr.json"])
def test_a_store_that_is_cut_is_named(name, tmp_path):
    path = tmp_path / "region.zarr"
    sim.simulate_many(table(2), path=path, years=1, **COARSE)
    data = (path / name).read_bytes()
    (path / name).write_bytes(data[: len(data) // 2])
    with pytest.raises(ValueError, match=rf"^{path} is damaged \(.*\); overwrite=True starts over"):
        sim.simulate_many(table(2), path=path, years=1, **COARSE)
    sim.simulate_many(table(2), path=path, years=1, overwrite=True, **COARSE)
    assert (path / name).read_bytes() == data


def test_chunks_are_of_one_size_and_bounded():
    assert many.chunk_size(100_000, 50) <= 1024 and many.chunk_size(20_000, 2) <= many.LARGEST_CHUNK
    assert many.chunk_size(5, 50) == 5 and many.chunk_size(1025, 50) == 513 and many.chunk_size(100, 1000) <= 51


@pytest.mark.parametrize(
    "change, message",
    [
        (
            {"latitude_deg": [60.0, np.nan]},
            "zero-based row 1, column latitude_deg is missing; a number in [45, 72] degN",
        ),
        (
            {"wind_speed_m_s": [3.0, 99.0]},
            "zero-based row 1, column wind_speed_m_s is 99.0; a number in [0.3, 15] m s-1",
        ),
        (
            {"relative_humidity": [70.0, 0.7]},
            "zero-based row 0, column relative_humidity is 70.0; a number in [0.2, 1] is",
        ),
        ({"wind_speed_m_s": [3.0, "calm"]}, "zero-based row 1, column wind_speed_m_s is calm; a number"),
        ({"latitude": [60.0, 61.0]}, "sites: unknown column 'latitude'; did you mean latitude_deg"),
        ({"lat": [60.0, 61.0]}, "sites: unknown column 'lat'; did you mean latitude_deg? allowed are names of"),
        (
            {"density_stems_ha": [-1.0, 0.0]},
            "zero-based row 0, column density_stems_ha is -1.0; a number in [0, 10000]",
        ),
        (
            {"wind_speed_m_s": pd.array([3.0, None], dtype="Float64")},
            "zero-based row 1, column wind_speed_m_s is missing",
        ),
        ({"seed": [1, 1.5]}, "zero-based row 1, column seed is 1.5; an integer"),
        (
            {"deep_boundary_temperature_k": [270.0, 271.0]},
            "sites: column deep_boundary_temperature_k: boundary='balanced' finds it",
        ),
        (
            {"conifer_old_stems_ha": [1.0, 1.0], "density_stems_ha": [1.0, 1.0]},
            "density_stems_ha = 1: conifer_old_stems_ha is given too",
        ),
        (
            {"density_stems_ha": [400.0, 0.0], "biomass_kgc_m2": 4.0},
            "zero-based row 1, column biomass_kgc_m2 is 4; of 0 stems/ha at most 0 kgC/m2 is allowed",
        ),
        (
            {"conifer_old_stems_ha": [900.0, 1.0], "biomass_kgc_m2": 4.0},
            "zero-based row 1, column biomass_kgc_m2 is 4; of 1 stems/ha at most 0.012 kgC/m2 is allowed",
        ),
    ],
)
def test_bad_tables(change, message):
    sites = pd.DataFrame({"latitude_deg": [60.0, 61.0]}).assign(**change)
    with pytest.raises(ValueError) as error:
        sim.simulate_many(sites, boundary="balanced", **COARSE)
    assert message in str(error.value)


def test_rows_are_named_as_the_table_names_them():
    sites = pd.DataFrame({"latitude_deg": [60.0, 10.0]}, index=["Hyytiälä", "Nairobi"])
    with pytest.raises(ValueError, match="sites: row Nairobi, column latitude_deg is 10.0"):
        sim.simulate_many(sites, **COARSE)


@pytest.mark.parametrize(
    "sites, arguments, message",
    [
        ([60.0], {}, "sites: a DataFrame .* got list; sim.sites_on_grid makes one"),
        (pd.DataFrame({"latitude_deg": []}), {}, "no row"),
        (pd.DataFrame({"wind_speed_m_s": [3.0]}), {}, "column latitude_deg is missing"),
        (table(2), {"actions": 25}, "25"),
        (
            table(2),
            {"actions": [12, 12, 12]},
            r"actions of shape \(3,\): an action, a plan of shape \(50,\) or \(2, 50\)",
        ),
        (table(2), {"variables": ("thaw",)}, "variable 'thaw': allowed are"),
        (table(2), {"others": "random"}, "others 'random': allowed are middle, sampled"),
        (table(2), {"mode": "generalist"}, "unknown argument 'mode'; allowed: time_step_minutes"),
        (table(2), {"years": 0}, "years"),
        (table(2), {"threads": 0}, "threads: a positive integer is allowed, got 0"),
        (table(2), {"preference": 2.0}, "preference"),
        (table(2), {"seed": -1}, "seed"),
        (table(2), {"overwrite": "no"}, "overwrite: True or False is allowed, got 'no'"),
        (table(2), {"progress": "no"}, "progress: True or False is allowed, got 'no'"),
    ],
)
def test_bad_arguments(sites, arguments, message):
    with pytest.raises(ValueError, match=message):
        sim.simulate_many(sites, **{**COARSE, **arguments})


# ------------------------------------------------------------------------------------------------------- the grid


def test_a_grid_goes_from_north_west_on():
    found = sim.sites_on_grid([60.0, 61.0], [20.0, 30.0, 40.0])
    assert found.to_numpy().tolist() == [[lat, lon] for lat in (61.0, 60.0) for lon in (20.0, 30.0, 40.0)]


def climate(**variables):
    return xarray.Dataset(variables, coords={"lat": [65.0, 60.0, 55.0], "lon": [0.0, 120.0, 240.0]})


def test_points_beside_the_date_line_take_the_nearest_across_it():
    lon = np.arange(-180.0, 180.0, 2.5)
    values = np.tile(np.linspace(1.0, 1.9, len(lon)), (2, 1))
    noise = xarray.Dataset({"daily_noise_std_c": (("lat", "lon"), values)}, coords={"lat": [60.0, 65.0], "lon": lon})
    found = sim.sites_on_grid([60.0], [179.9, 177.0, -179.9], climate=noise)
    assert found.daily_noise_std_c.tolist() == pytest.approx([1.0, 1.9, 1.0])


def test_gridded_climate(tmp_path):
    """Monthly means of a cosine give its mean and half-range; sea is left out; longitudes go either way round."""
    days = (np.arange(365 * 24) + 0.5) / (365 * 24)
    wave = -3.0 - 20.0 * np.cos(2 * np.pi * (days - 0.05))
    months = wave.reshape(12, -1).mean(axis=1)
    warmer = np.arange(9.0).reshape(3, 3)
    warmer[0, 1] = np.nan
    air = (("month", "lat", "lon"), months[:, None, None] + warmer)
    humidity = (("lat", "lon"), 0.6 + 0.01 * warmer)
    file = climate(air_temperature_c=air, relative_humidity=humidity)
    found = sim.sites_on_grid([60.0, 65.0], [-120.0, 1.0, 119.0], climate=file)
    assert found[["latitude_deg", "longitude_deg"]].to_numpy().tolist() == [
        [65.0, -120.0],
        [65.0, 1.0],
        [60.0, -120.0],
        [60.0, 1.0],
        [60.0, 119.0],
    ]
    np.testing.assert_allclose(found.mean_annual_temperature_c, -3.0 + np.array([2, 0, 5, 3, 4]), atol=1e-9)
    np.testing.assert_allclose(found.seasonal_amplitude_c, 20.0, rtol=1e-4)
    np.testing.assert_allclose(found.relative_humidity, 0.6 + 0.01 * np.array([2, 0, 5, 3, 4]))
    file.to_zarr(tmp_path / "climate.zarr", zarr_format=2)
    again = sim.sites_on_grid([60.0, 65.0], [-120.0, 1.0, 119.0], climate=tmp_path / "climate.zarr")
    pd.testing.assert_frame_equal(again[list(found)], found)


@pytest.mark.parametrize(
    "file, message",
    [
        (
            climate(tas=(("lat", "lon"), np.zeros((3, 3)))),
            "unknown variable 'tas'; allowed: air_temperature_c of twelve",
        ),
        (climate(air_temperature_c=(("m", "lat", "lon"), np.full((12, 3, 3), 270.0))), "is it in kelvin"),
        (climate(air_temperature_c=(("lat", "lon"), np.zeros((3, 3)))), "twelve months, latitude, longitude"),
        (climate(relative_humidity=(("lat", "lon"), np.full((3, 3), np.nan))), "every point of the grid is missing"),
        (
            xarray.Dataset({"relative_humidity": ("lat", [0.7])}, coords={"lat": [60.0]}),
            "no coordinate longitude or lon",
        ),
        (climate().assign_coords(lat=[65.0, 60.0, 60.0]), "coordinate lat has 60 twice"),
        (climate().assign_coords(lat=[65.0, 60.0, np.nan]), "coordinate lat has a value that is missing"),
        (climate(relative_humidity=(("lat", "lon"), np.full((3, 3), "damp"))), "has type <U4; numbers are allowed"),
        (5, "climate: a path or an xarray.Dataset is allowed, got int"),
        (
            climate(air_temperature_c=(("m", "lat", "lon"), np.tile(np.r_[1, 1, np.nan, [1] * 9], (3, 3, 1)).T)),
            "air_temperature_c of latitude 60, longitude 20 lacks month 3; all twelve, or none",
        ),
    ],
)
def test_bad_climate(file, message):
    with pytest.raises(ValueError, match=message):
        sim.sites_on_grid([60.0], [20.0], climate=file)


def test_a_climate_file_that_cannot_be_read(tmp_path):
    (tmp_path / "text.nc").write_text("no NetCDF")
    for name, message in (("none.nc", "climate: there is no file .*none.nc"), ("text.nc", "text.nc cannot be read")):
        with pytest.raises(ValueError, match=message) as error:
            sim.sites_on_grid([60.0], [20.0], climate=tmp_path / name)
        assert "\n" not in str(error.value)


def test_a_grid_beyond_its_climate():
    file = climate(relative_humidity=(("lat", "lon"), np.full((3, 3), 0.7)))
    with pytest.raises(ValueError, match=r"latitude_deg = 72 lies outside the file's \[55, 65\]"):
        sim.sites_on_grid([72.0], [20.0], climate=file)


def test_where_no_store_can_be(tmp_path):
    with pytest.raises(ValueError, match="path 5: the name of a folder is allowed"):
        sim.simulate_many(table(2), 12, years=1, path=5)
    with pytest.raises(ValueError, match=r"path .*x.nc: a zarr store is written"):
        sim.simulate_many(table(2), 12, years=1, path=tmp_path / "x.nc")
    with pytest.raises(ValueError, match="path '': the name of a folder is allowed"):
        sim.simulate_many(table(2), 12, years=1, path="")
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match="path .*file/region.zarr: cannot write there"):
        sim.simulate_many(table(2), 12, years=1, path=tmp_path / "file" / "region.zarr")


def test_a_grid_has_each_point_once():
    with pytest.raises(ValueError, match="longitude_deg: each meridian once is allowed, and -180 is 180"):
        sim.sites_on_grid([60.0], [-180.0, 180.0])
    with pytest.raises(ValueError, match="longitude_deg: each meridian once is allowed"):
        sim.sites_on_grid([60.0], [-90.0, 0.0, 270.0])
    with pytest.raises(ValueError, match=r"latitude_deg: each number once is allowed, got \[56, 56\]"):
        sim.sites_on_grid([56, 56], [1])


def test_a_text_longer_than_a_files_name_is_no_file():
    """A policy's docstring is a constant of its code, and an argument may be any text."""
    text = "plants where there is room " * 12
    assert in_words(text).startswith(repr(text)[:100])
    assert reference.is_plain(text)
