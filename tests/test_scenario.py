"""Climate change: the published paths, a user's own, and what they do to a stand."""

from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from playing import NAN, quick, quick_vector

import sim
from analysis import make_scenarios
from sim.scenario import COLUMNS, FIRST_YEAR, check_scenario
from sim.task.episodes import BALANCED_WORLD

SITE = {"mean_annual_temperature_c": -9.0}
PATHS = {name: pd.DataFrame(table) for name, table in sim.SCENARIOS.items()}


def simulate(scenario=None, **kwargs):
    arguments = {"years": 3, "boundary": "balanced", "mechanisms": {"fire": False}, "time_step_minutes": 120} | kwargs
    return sim.simulate(SITE, 12, seed=1, scenario=scenario, **arguments).reset_index(drop=True)


def path(years=3, **columns):
    """A path that changes nothing but the columns given."""
    same = {"warming_k": 0.0, "warming_amplitude_k": 0.0, "precipitation_factor": 1.0, "co2_ppm": 395.0}
    return {name: np.full(years, value) for name, value in (same | columns).items()}


@pytest.fixture(scope="module")
def unchanged():
    return simulate()


# ---------------------------------------------------------------------------------------- the published paths


def test_the_paths_are_of_the_published_size():
    """Warming against AR6's global means and its North Asia, carbon dioxide against Meinshausen et al.'s Table."""
    assert list(PATHS) == ["ssp126", "ssp245", "ssp585"]
    for name, warming, ppm in (("ssp126", (1.5, 2.2), 446), ("ssp245", (2.8, 4.0), 603), ("ssp585", (5.6, 7.6), 1135)):
        table = PATHS[name]
        assert list(table.year) == list(range(2015, 2101))
        last = table[table.year.between(2081, 2100)]
        assert warming[0] < last.warming_k.mean() < warming[1]
        assert round(table.co2_ppm.iloc[-1]) == ppm
        assert (last.precipitation_factor.between(1.05, 1.35) & (last.warming_amplitude_k < 0.0)).all()


def test_the_document_has_the_ratios_of_the_table():
    ratios, amplitudes = [], []
    for name, table in PATHS.items():
        world = make_scenarios.world_warming(name)
        ratios.append(f"{table.warming_k.sum() / world.sum():.2f}")
        amplitudes.append(f"{table.warming_amplitude_k.sum() / table.warming_k.sum():.2f}")
    text = " ".join((Path(sim.__file__).parent.parent / "docs" / "model.md").read_text(encoding="utf-8").split())
    assert "(medians: {}, {} and {}; $w_A = {}$, ${}$ and ${}\\,w$".format(*ratios, *amplitudes) in text


@pytest.mark.parametrize(
    "text, message",
    [
        (None, "--concentrations .*ppm.csv: .*No such file"),
        ("", "--concentrations .*ppm.csv: No columns to parse from file"),
        ("Scenario,Variable\n", "--concentrations .*ppm.csv: it has no column Region"),
        (
            f"Scenario,Region,Variable,{','.join(map(str, range(2015, 2101)))}\n",
            "--atlas .*nowhere: a folder with CMIP6_",
        ),
    ],
)
def test_paths_are_made_of_what_is_there(text, message, tmp_path):
    ppm = tmp_path / "ppm.csv"
    if text is not None:
        ppm.write_text(text)
    with pytest.raises(SystemExit, match=f"^error: {message}"):
        make_scenarios.main(make_scenarios.Args(tmp_path / "nowhere", ppm))


def test_a_stand_starts_in_the_first_year_of_a_path():
    table = PATHS["ssp585"].set_index("year")
    by_hand = {name: dict(table[name].loc[FIRST_YEAR : FIRST_YEAR + 2]) for name in COLUMNS}
    pd.testing.assert_frame_equal(simulate("ssp585"), simulate(by_hand))
    own = PATHS["ssp585"].query("year >= @FIRST_YEAR").drop(columns="year")
    pd.testing.assert_frame_equal(simulate("ssp585"), simulate(own))


def test_a_path_keeps_its_years():
    """Whatever has them, what is before a stand's first year is left out."""
    table = PATHS["ssp585"]
    by_year = table.set_index("year")
    expected = check_scenario("ssp585").values
    for own in (
        table,
        by_year,
        table.set_index(pd.PeriodIndex(table.year.astype(str), freq="Y")).drop(columns="year"),
        {name: dict(by_year[name]) for name in COLUMNS},
        {name: list(table[name]) for name in ("year", *COLUMNS)},
        {name: by_year[name] for name in COLUMNS},
        by_year.set_axis(by_year.index.astype(str)),
        by_year.rename_axis("Year"),
        table.assign(year=pd.to_datetime(table.year.astype(str))),
    ):
        np.testing.assert_array_equal(check_scenario(own).values, expected)


def test_a_dataset_keeps_its_years():
    pytest.importorskip("xarray")
    by_year = PATHS["ssp585"].set_index("year")
    dated = by_year.set_axis(pd.to_datetime(by_year.index.astype(str)).rename("time"))
    dataset = by_year.to_xarray()
    for own in (dataset, {name: dataset[name] for name in COLUMNS}, dated.to_xarray()):
        np.testing.assert_array_equal(check_scenario(own).values, check_scenario("ssp585").values)


# ------------------------------------------------------------------------------------------- what a path does


def test_a_path_that_changes_nothing_gives_the_same_bytes(unchanged):
    pd.testing.assert_frame_equal(simulate(path()), unchanged, check_exact=True)


def test_the_first_years_are_warmer_and_wetter_by_what_the_path_says(unchanged):
    changed = simulate("ssp245")
    expected = PATHS["ssp245"].query("year >= @FIRST_YEAR").iloc[:3].reset_index(drop=True)
    difference = changed.air_temperature_c - unchanged.air_temperature_c
    np.testing.assert_allclose(difference, expected.warming_k, atol=1e-9)
    ratio = changed.precipitation_mm / unchanged.precipitation_mm
    np.testing.assert_allclose(ratio, expected.precipitation_factor, rtol=1e-9)


def test_winters_warm_more_where_the_amplitude_is_negative(unchanged):
    days = {"output": "daily", "years": 1}
    difference = simulate(path(1, warming_k=3.0, warming_amplitude_k=-1.0), **days) - simulate(**days)
    warming = difference.air_temperature_c.to_numpy()
    assert warming.mean() == pytest.approx(3.0) and warming[:31].mean() > 3.8 and warming[181:212].mean() < 2.2


def test_warming_thaws_deeper_and_carbon_dioxide_feeds(unchanged):
    warmer, fed = simulate(path(warming_k=3.0)), simulate(path(co2_ppm=600.0))
    assert (warmer.active_layer_depth_m > unchanged.active_layer_depth_m + 0.05).all()
    assert (warmer.boundary_warming_mj_m2 >= unchanged.boundary_warming_mj_m2).all()
    gain = fed.gpp_kgc_m2[0] / unchanged.gpp_kgc_m2[0]
    assert 1.05 < gain < 1.0 + 0.5 * np.log(600.0 / 395.0) / (1.0 + 0.5 * np.log(395.0 / 380.0)) + 0.02
    np.testing.assert_array_equal(fed.precipitation_mm, unchanged.precipitation_mm)


def test_the_ground_starts_in_balance_with_the_past():
    """Neither the first state nor the boundary knows what comes."""
    states = []
    for scenario in (None, "ssp585"):
        stands = sim.Stands(1, time_step_minutes=120, scenario=scenario, **BALANCED_WORLD)
        stands.start([0], [sim.sample_site(3)], [sim.episode_seeds(3)])
        states.append((stands.parameters.tobytes(), stands.state.tobytes()))
    assert states[0] == states[1]


# --------------------------------------------------------------------------------- alone, in lockstep, resumed


def test_a_path_is_the_same_alone_in_lockstep_resumed_and_interpreted():
    def stands(number, **kwargs):
        return sim.Stands(number, time_step_minutes=120, scenario="ssp585", threads=1, **kwargs)

    everyone, alone = stands(3), stands(1)
    sites, seeds = [sim.sample_site(k) for k in range(3)], [sim.episode_seeds(k) for k in range(3)]
    everyone.start([0, 1, 2], sites, seeds)
    alone.start([0], sites[2:], seeds[2:])
    resumed, interpreted = stands(1), stands(1, backend="python")
    for year in range(2):
        if year == 1:
            resumed.set_state(alone.get_state())
            interpreted.set_state(alone.get_state())
        record = everyone.step(np.full(3, 24))
        np.testing.assert_array_equal(alone.step([24])[0], record[2])
    np.testing.assert_array_equal(resumed.step([24])[0], record[2])
    kept = [i for i, name in enumerate(sim.RECORD_NAMES) if "residual" not in name]
    np.testing.assert_allclose(interpreted.step([24])[0, kept], record[2, kept], rtol=1e-9, atol=1e-9)


# -------------------------------------------------------------------------------------------- the environment


def test_the_warming_id_is_the_balanced_one_under_ssp245():
    warming, balanced = (gym.make(f"boreal-{name}-v0").unwrapped._episodes for name in ("warming", "balanced"))
    assert warming.stands.scenario.until == "ssp245 is from 2025 to 2100" and balanced.stands.scenario is None
    assert warming.reward == balanced.reward and warming.observation_names == balanced.observation_names


def test_an_agent_sees_the_sites_own_climate_and_the_year():
    envs = [quick_vector(2, scenario=scenario, **BALANCED_WORLD) for scenario in (None, "ssp585")]
    before = [one.reset(seed=5)[0] for one in envs]
    np.testing.assert_array_equal(*before)
    after = [one.step([24, 24])[0] for one in envs]
    names = envs[0].observation_names
    same = [i for i, name in enumerate(names) if name.startswith("site_") or name in ("year", "latitude")]
    np.testing.assert_array_equal(after[0][:, same], after[1][:, same])
    assert (after[0] != after[1]).any() and after[1] in envs[1].observation_space


# --------------------------------------------------------------------------------------------------- refusals


BAD = {
    "name": ("ssp370", r"scenario 'ssp370': allowed are None, ssp126, ssp245, ssp585, or a dict or DataFrame"),
    "number": (4.5, r"scenario 4.5: allowed are None, ssp126"),
    "column": ({"warming": [1.0] * 4}, r"unknown column 'warming' of the scenario; allowed: year, warming_k, "),
    "nothing": ({}, r"the scenario has no column; allowed: warming_k"),
    "one number": ({"warming_k": 1.0}, r"scenario warming_k: a number for each year is allowed, got 1.0"),
    "text": ({"warming_k": [1.0, "a", 1.0, 1.0]}, r"scenario warming_k: a number for each year is allowed, got 'a'$"),
    "short": ({"warming_k": [1.0] * 3}, r"years = 4: the scenario has 3 years, so at most 3 are allowed"),
    "unequal": ({"warming_k": [1.0] * 4, "co2_ppm": [400] * 5}, r"columns are not equally long: .*: 4.*: 5"),
    "gap": ({"warming_k": [1.0, 1.0, NAN, 1.0]}, r"scenario warming_k = nan in 2027: \[-10, 15\] K is allowed"),
    "absurd": ({"warming_k": [1.0, 150.0, 1.0, 1.0]}, r"scenario warming_k = 150 in 2026: \[-10, 15\] K"),
    "negative co2": ({"co2_ppm": [-400.0] * 4}, r"scenario co2_ppm = -400 in 2025: \[200, 1500\] ppm"),
    "negative rain": ({"precipitation_factor": [-0.1] * 4}, r"precipitation_factor = -0.1 in 2025: \[0.3, 3\]"),
    "years apart": (
        {"warming_k": {2025: 1, 2027: 1, 2028: 1, 2029: 1}},
        r"have to follow each other, got 2027 after 2025",
    ),
    "years to come": ({"warming_k": {2030 + k: 1.0 for k in range(60)}}, r"years are 2030 to 2089; 2025 is needed"),
    "years of text": ({"warming_k": [1.0], "year": ["now"]}, r"its years have to be integers, got 'now'"),
    "index of names": (pd.Series([1.0], ["now"], name="warming_k").to_frame(), r"years have to be integers, got 'now'"),
    "index of rows with a name": (
        pd.DataFrame({"warming_k": [1.0]}, pd.Index([0], name="row")),
        r"its years are 0 to 0; 2025 is needed, too",
    ),
    "masked": ({"warming_k": np.ma.array([1.0] * 4, mask=[0, 1, 0, 0])}, r"a number for each year .* got a masked one"),
    "two kinds of years": (
        {"year": [2025, 2026], "co2_ppm": pd.Series([400.0, 400.0], [2000, 2001])},
        r"scenario co2_ppm: its own years are others than those of the column year",
    ),
    "years of another length": ({"warming_k": [1.0] * 4, "year": [2025]}, r"4 values of 1 years; a value each"),
}


@pytest.mark.parametrize(("scenario", "message"), BAD.values(), ids=BAD)
@pytest.mark.parametrize("door", [quick, lambda scenario: simulate(scenario, years=4)], ids=["environment", "simulate"])
def test_a_bad_path_is_refused_in_one_line(door, scenario, message):
    with pytest.raises(ValueError, match=message) as error:
        door(scenario=scenario)
    assert "\n" not in str(error.value)


def test_no_year_beyond_the_path():
    for door in (lambda **kwargs: quick(**kwargs), simulate):
        with pytest.raises(ValueError, match=r"years = 77: the scenario ssp126 is from 2025 to 2100, so at most 76"):
            door(scenario="ssp126", years=77)
    stands = sim.Stands(1, time_step_minutes=240, scenario={"co2_ppm": [400.0]})
    stands.start([0], [sim.middle_site()], [sim.episode_seeds(0)])
    stands.step([12])
    with pytest.raises(ValueError, match=r"years = 2: the scenario has 1 years"):
        stands.step([12])


def test_what_a_path_cannot_go_with():
    with pytest.raises(ValueError, match=r"constants: co2_ppm follows the scenario"):
        quick(scenario="ssp245", constants={"co2_ppm": 500.0})
    days = pd.DataFrame(0.0, index=pd.date_range("2001-01-01", periods=12, freq="2h"), columns=sim.state.FORCING)
    with pytest.raises(ValueError, match=r"scenario: only generated weather can change"):
        simulate("ssp245", forcing=days, years=1)
