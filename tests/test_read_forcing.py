"""Records of towers and reanalyses as forcing: each format gives the weather it was made of, what is filled is flagged,
and what cannot be right is refused in a line that names the row and the column."""

import functools
import re

import numpy as np
import pandas as pd
import pytest
import records
from records import ALASKA, SWEDEN

import sim
from analysis.validation import climate_records, poker_flat, tower_report
from sim.io.check import check_forcing
from sim.io.disaggregation import FOREST_CYCLE
from sim.io.forcing import FLAGS
from sim.state import FORCING

UTC = {name: SWEDEN[name] for name in ("latitude_deg", "longitude_deg")}
NAMES = list(FORCING)


@functools.cache
def as_it_is():
    """What the record of `tower` is read as, for all that must be read as the same; nobody changes it."""
    return sim.read_forcing(tower(), **SWEDEN)


@functools.cache
def year_of_days():
    """The first year of Poker Flat's days."""
    return sim.read_forcing(pd.read_csv(records.POKER_FLAT, nrows=365), **ALASKA)


def flags(forcing, name):
    return forcing[f"{name}_flag"].to_numpy()


@pytest.fixture(scope="module")
def weather():
    return records.measured()


# ----------------------------------------------------------------------------------------------------- the formats


@pytest.mark.parametrize(
    "ending, packing", [(".csv", None), (".csv.gz", "gzip"), (".csv.GZ", "gzip"), (".csv", "gzip")]
)
def test_fluxnet_gives_the_weather_it_was_made_of(tmp_path, weather, ending, packing):
    records.fluxnet().to_csv(tmp_path / f"tower{ending}", index=False, compression=packing)
    forcing = sim.read_forcing(tmp_path / f"tower{ending}", **SWEDEN)
    assert list(forcing)[:6] == NAMES and forcing.index.equals(weather.index)
    np.testing.assert_allclose(forcing[NAMES], weather, rtol=0, atol=1e-12)
    assert flags(forcing, "air_temperature_c").sum() == 48  # those that the source filled
    assert not forcing[[f"{name}_flag" for name in NAMES[1:]]].any().any()
    assert forcing.attrs["site"]["latitude_deg"] == SWEDEN["latitude_deg"]
    assert forcing.attrs["site"]["mean_annual_temperature_c"] == pytest.approx(weather.air_temperature_c.mean())
    assert "air_temperature_c: TA_F [degC]; 0.27 % filled by its source" in forcing.attrs["report"]


def test_icos_gives_the_weather_it_was_made_of(weather):
    forcing = sim.read_forcing(records.icos(), **SWEDEN)
    np.testing.assert_allclose(forcing[NAMES], weather, rtol=0, atol=1e-12)


def test_ameriflux_has_sensors_at_positions_comments_and_no_longwave(tmp_path, weather):
    path = tmp_path / "AMF_SE-Svb_BASE_HH_1-5.csv"
    path.write_text("# Site: SE-Svb\n# Version: 1-5\n" + records.ameriflux().to_csv(index=False))
    forcing = sim.read_forcing(path, **SWEDEN)
    np.testing.assert_array_equal(forcing.air_temperature_c, weather.air_temperature_c)  # the highest sensor
    lit = weather.shortwave_w_m2 > 2.0
    np.testing.assert_allclose(forcing.shortwave_w_m2[lit], weather.shortwave_w_m2[lit] - 2.0, atol=1e-9)
    assert (forcing.shortwave_w_m2[~lit] == 0.0).all()
    assert set(flags(forcing, "shortwave_w_m2")) == {0, 5} and set(flags(forcing, "longwave_w_m2")) == {4}
    with pytest.raises(ValueError, match=r"BASE_HH_1-5.csv, line 1004 .*TA_1_1_1 is missing \(3 of 17520"):
        path.write_text("# Site\n# Version\n" + records.with_gaps(records.ameriflux()).to_csv(index=False))
        sim.read_forcing(path, **SWEDEN)


@pytest.mark.parametrize("since_midnight", [True, False])
def test_era5_land_by_the_hour(weather, since_midnight):
    forcing = sim.read_forcing(records.era5_land(since_midnight=since_midnight), **UTC)
    assert len(forcing) == 365 * 24
    for name in ("shortwave_w_m2", "longwave_w_m2", "wind_speed_m_s", "air_temperature_c"):
        np.testing.assert_allclose(forcing[name].mean(), weather[name].mean(), rtol=0.002)
    assert forcing.precipitation_mm.sum() == pytest.approx(weather.precipitation_mm.sum(), rel=1e-3)
    hour = np.average(forcing.index.hour + 0.5, weights=forcing.shortwave_w_m2)
    assert hour == pytest.approx(12.0, abs=0.5)
    corr = np.corrcoef(forcing.shortwave_w_m2[1:-1], weather.shortwave_w_m2.resample("h").mean()[1:-1])[0, 1]
    assert corr > 0.95
    humidity = forcing.relative_humidity.resample("D").mean() - weather.relative_humidity.resample("D").mean()
    assert humidity.abs().max() < 0.05
    for name, error in (("air_temperature_c", 0.1), ("relative_humidity", 0.01)):  # an hour off is several times that
        assert (forcing[name] - weather[name].resample("h").mean()).abs().mean() < error, name


def test_days_are_those_of_the_disaggregator():
    forcing = sim.read_forcing(records.POKER_FLAT, **ALASKA)
    daily = poker_flat.daily_weather(poker_flat.record()).assign(precipitation_mm=poker_flat.record()["P_F"])
    expected = sim.half_hours(daily, ALASKA["latitude_deg"])
    assert forcing.index.equals(expected.index) and len(forcing) == 4 * 365 * 48
    np.testing.assert_allclose(forcing[NAMES], expected[NAMES], rtol=1e-9, atol=1e-9)
    filled = (poker_flat.record()["P_F_QC"] < 1.0).to_numpy()
    kept = poker_flat.record().index != "2012-02-29"
    np.testing.assert_array_equal(flags(forcing, "precipitation_mm")[::48] == 1, filled[kept])


def test_era5_land_by_the_day():
    forcing = sim.read_forcing(records.era5_daily(), latitude_deg=64.256)
    expected = records.measured().resample("D").mean()
    found = forcing[NAMES].resample("D").mean()
    for name in ("air_temperature_c", "shortwave_w_m2", "longwave_w_m2", "wind_speed_m_s", "precipitation_mm"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-9)


def test_a_dataset_of_one_place(tmp_path):
    xarray = pytest.importorskip("xarray")
    table = records.era5_land(100).set_index("valid_time")
    dataset = xarray.Dataset.from_dataframe(table).expand_dims(latitude=[64.3], longitude=[19.8])
    expected = sim.read_forcing(records.era5_land(100), **UTC)
    pd.testing.assert_frame_equal(sim.read_forcing(dataset, **UTC), expected)
    dataset.to_netcdf(tmp_path / "era5.nc")
    pd.testing.assert_frame_equal(sim.read_forcing(tmp_path / "era5.nc", **UTC), expected)
    twice = xarray.concat([dataset, dataset], "latitude")
    with pytest.raises(ValueError, match="the dataset has 2 values of latitude; choose one"):
        sim.read_forcing(twice, **UTC)


def dataset(units, change=None, made=records.fluxnet):
    """A record as xarray has it, with attributes of units."""
    xarray = pytest.importorskip("xarray")
    table = tower(change, made=made).drop(columns="TIMESTAMP_END", errors="ignore")
    time = table.columns[0]
    table[time] = pd.to_datetime(table[time].astype(str))
    whole = xarray.Dataset.from_dataframe(table.set_index(time))
    for name, unit in units.items():
        whole[name].attrs["units"] = unit
    return whole


def kelvin(table):
    return table.assign(TA_F=table.TA_F + KELVIN, TA_ERA=table.TA_ERA + KELVIN)


@pytest.mark.parametrize(
    ("units", "change"),
    [
        ({"TA_F": "K", "TA_ERA": "kelvin"}, kelvin),
        ({"WS_F": "knot"}, lambda t: t.assign(WS_F=t.WS_F * 3600 / 1852)),
        ({"VPD_F": "kPa", "LW_IN_F": "W/m2"}, lambda t: t.assign(VPD_F=t.VPD_F / 10)),
        ({"P_F": "kg m-2 s-1"}, lambda t: t.assign(P_F=t.P_F / 1800)),
        ({"WS_F": "m/s", "TA_F": "celsius", "SW_IN_F": "W m**-2", "LW_IN_F": "W m⁻²", "VPD_F": "mbar"}, None),
        (
            {"WS_F": "m s^-1", "TA_F": "degrees_Celsius", "SW_IN_F": "W/m^2", "LW_IN_F": "W.m-2", "P_F": "kg m**-2"},
            None,
        ),
        ({"WS_F": "", "WD": "degree", "NEE_VUT_REF": "umol m-2 s-1"}, None),
    ],
)
def test_the_units_of_a_datasets_own_attributes_are_those_of_its_values(units, change):
    forcing = sim.read_forcing(dataset(units, change), **SWEDEN)
    np.testing.assert_allclose(forcing[NAMES], as_it_is()[NAMES], rtol=1e-9, atol=1e-9)


def test_the_units_of_era5_land_are_known_and_those_of_the_caller_come_first():
    units = {"t2m": "K", "d2m": "K", "ssrd": "J m**-2", "strd": "J m**-2", "tp": "m", "u10": "m s**-1", "sp": "Pa"}
    forcing = sim.read_forcing(dataset(units, made=records.era5_land), **UTC)
    pd.testing.assert_frame_equal(forcing, sim.read_forcing(records.era5_land(200), **UTC))
    said = sim.read_forcing(dataset({"TA_F": "K"}), units={"TA_F": "degC"}, **SWEDEN)
    pd.testing.assert_frame_equal(said, as_it_is())


@pytest.mark.parametrize(
    ("units", "message"),
    [
        (
            {"WS_F": "furlong"},
            "WS_F has the attribute units 'furlong'; allowed for wind_speed: m s-1, .*'WS_F': '..'}$",
        ),
        ({"VPD_F": "%"}, "VPD_F has the attribute units '%'; allowed for humidity: hPa, kPa, Pa; if it is wrong, say "),
    ],
)
def test_an_attribute_that_is_no_unit_of_its_column_is_refused(units, message):
    with pytest.raises(ValueError, match=f"^the dataset: {message}"):
        sim.read_forcing(dataset(units), **SWEDEN)


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ({"latitude": 50.0}, "latitude_deg = 64.256: the dataset is of 50; within 1 degree of it is allowed"),
        ({"lat": [50.0]}, "latitude_deg = 64.256: the dataset is of 50; .*"),
        ({"latitude": 64.3, "longitude": 120.0}, "longitude_deg = 19.774: the dataset is of 120; .*"),
        ({"latitude": 64.3, "longitude": 19.8 + 360.0}, None),
    ],
)
def test_a_dataset_of_another_place_is_refused(place, message):
    there = dataset({})
    for name, value in place.items():
        there = there.expand_dims({name: value}) if isinstance(value, list) else there.assign_coords({name: value})
    if message is None:
        assert len(sim.read_forcing(there, **SWEDEN)) == 200 * 48
    else:
        with pytest.raises(ValueError, match=f"^{message}$"):
            sim.read_forcing(there, **SWEDEN)


@pytest.mark.parametrize("calendar", ["noleap", "360_day", "standard"])
def test_calendars_of_climate_models_are_refused_by_name(tmp_path, calendar):
    xarray = pytest.importorskip("xarray")
    days = pd.read_csv(records.POKER_FLAT).drop(columns="TIMESTAMP").astype(float)[:365]
    time = ("time", np.arange(365), {"units": "days since 2011-01-01", "calendar": calendar})
    xarray.Dataset({name: ("time", days[name]) for name in days}, {"time": time}).to_netcdf(tmp_path / "climate.nc")
    if calendar == "standard":
        assert len(sim.read_forcing(tmp_path / "climate.nc", **ALASKA)) == 365 * 48
    else:
        message = (
            f"climate.nc: time is of the calendar '{calendar}'; allowed are standard, gregorian, proleptic_gregorian"
        )
        with pytest.raises(ValueError, match=message):
            sim.read_forcing(tmp_path / "climate.nc", **ALASKA)


@pytest.mark.parametrize("name", ["Tair", "TS_F_MDS_1"])
def test_a_column_of_ones_own_has_its_quality_beside_it(name):
    table = tower(lambda t: t.rename(columns={"TA_F": name, "TA_F_QC": f"{name}_QC"}))
    forcing = sim.read_forcing(table, columns={"air_temperature": name}, units={name: "degC"}, **SWEDEN)
    assert flags(forcing, "air_temperature_c").sum() == 48


def test_names_and_units_of_ones_own(weather):
    table = records.icos().rename(columns={"TA": "Tair", "RH": "rh", "TIMESTAMP_START": "begin"})
    table = table.drop(columns="TIMESTAMP_END").assign(Tair=table["Tair"] + 273.15)
    columns = {"air_temperature": "Tair", "humidity": "rh", "time_start": "begin"}
    forcing = sim.read_forcing(table, columns=columns, units={"Tair": "K", "rh": "%"}, **SWEDEN)
    np.testing.assert_allclose(forcing[NAMES], weather, rtol=0, atol=1e-9)


# ---------------------------------------------------------------------------------------------------- times, years


def test_times_with_a_zone_are_converted(weather):
    table = records.icos()
    start = pd.to_datetime(table["TIMESTAMP_START"].astype(str)).dt.tz_localize("Etc/GMT-1")
    for times in (start, start.astype(str), start.dt.tz_convert("America/New_York")):
        zoned = table.drop(columns="TIMESTAMP_END").assign(TIMESTAMP_START=times)
        pd.testing.assert_frame_equal(sim.read_forcing(zoned, **UTC)[NAMES], weather, check_freq=False)
    with pytest.raises(ValueError, match="utc_offset_h: the record's times have a time zone already"):
        sim.read_forcing(table.assign(TIMESTAMP_START=start), **SWEDEN)


def days_with(name, times):
    """A year of days of Poker Flat with a column of times that is made of their dates."""
    table = pd.read_csv(records.POKER_FLAT, nrows=365)
    date = pd.to_datetime(table.pop("TIMESTAMP").astype(str))
    return table.assign(**{name: times(date)})


NEXT = pd.Timedelta(days=1)
STAMPS = {
    "ends that are said": ("end", lambda date: (date + NEXT).dt.strftime("%Y-%m-%d"), {"time_end": "end"}),
    "ends by their name": ("TIMESTAMP_END", lambda date: (date + NEXT).dt.strftime("%Y%m%d%H%M"), None),
    "24:00": ("TIMESTAMP", lambda date: date.dt.strftime("%Y-%m-%d 24:00"), None),
    "2400": ("TIMESTAMP", lambda date: date.dt.strftime("%Y%m%d2400"), None),
    "23:59": ("TIMESTAMP_END", lambda date: date.dt.strftime("%Y-%m-%d 23:59"), None),
    "noon": ("middle", lambda date: date + NEXT / 2, {"time_middle": "middle"}),
    "east of Greenwich": ("TIMESTAMP", lambda date: date.dt.tz_localize("Etc/GMT-1"), None),
    "east of Greenwich, as text": ("TIMESTAMP", lambda date: date.dt.strftime("%Y-%m-%dT00:00:00+01:00"), None),
    "west of Greenwich": ("TIMESTAMP", lambda date: date.dt.tz_localize("Etc/GMT+9"), None),
    "with summer time": ("TIMESTAMP", lambda date: date.dt.tz_localize("Europe/Stockholm"), None),
}


@pytest.mark.parametrize(("name", "times", "columns"), STAMPS.values(), ids=STAMPS)
def test_a_day_keeps_its_date_however_it_is_stamped(name, times, columns):
    forcing = sim.read_forcing(days_with(name, times), columns=columns, **ALASKA)
    pd.testing.assert_frame_equal(forcing, year_of_days(), check_freq=False)


def test_what_solar_time_leaves_of_a_day_repeats_the_day_beside_it(weather):
    east = {**SWEDEN, "longitude_deg": SWEDEN["longitude_deg"] + 90.0, "utc_offset_h": 7.0}
    table = records.icos()
    times = pd.to_datetime(table["TIMESTAMP_START"].astype(str)) + pd.Timedelta(minutes=30)
    table = table.assign(TIMESTAMP_START=times.dt.strftime("%Y%m%d%H%M"))  # the year begins at 00:00 by the clock
    forcing = sim.read_forcing(table.drop(columns="TIMESTAMP_END"), **east)
    assert forcing.index[0] == pd.Timestamp("2019-01-01") and len(forcing) == 365 * 48
    assert flags(forcing, "air_temperature_c").tolist() == [6] + [0] * (365 * 48 - 1)
    assert forcing.air_temperature_c.iloc[0] == forcing.air_temperature_c.iloc[48]


def middles(table):
    return pd.to_datetime(table["TIMESTAMP_START"].astype(str)) + pd.Timedelta(minutes=15)


def test_times_may_be_the_middles_of_intervals(weather):
    table = records.icos().drop(columns="TIMESTAMP_END").assign(TIMESTAMP_START=lambda t: middles(t).astype(str))
    said = sim.read_forcing(table, columns={"time_middle": "TIMESTAMP_START"}, **SWEDEN)
    np.testing.assert_allclose(said[NAMES], weather, rtol=0, atol=1e-12)
    for arguments in ({}, {"gaps": "fill"}):
        message = (
            r"row 0: TIMESTAMP_START is 2018-12-31 23:45, 15 minutes off .* say columns={'time_middle': 'TIMESTAMP"
        )
        with pytest.raises(ValueError, match=message):
            sim.read_forcing(table, **arguments, **SWEDEN)
    both = {"time_middle": "TIMESTAMP_START", "time_end": "TIMESTAMP_START"}
    with pytest.raises(ValueError, match="columns: one of .* is allowed, got time_end, time_middle"):
        sim.read_forcing(table, columns=both, **SWEDEN)
    seven = table.assign(TIMESTAMP_START=(middles(table) - pd.Timedelta(minutes=23)).astype(str))
    with pytest.raises(ValueError, match=r"23:37, 7 minutes off .* full intervals are allowed$"):
        sim.read_forcing(seven, **SWEDEN)


def test_the_report_has_the_shift_and_what_it_leaves_and_all_is_100_percent():
    report = sim.read_forcing(records.fluxnet(90).assign(TA_F_QC=2), **SWEDEN).attrs["report"]
    assert "air_temperature_c: TA_F [degC]; 100 % filled by its source" in report
    assert any(
        "moved by +30 minutes" in line and "is +19.1 from" in line and "-10.9 are left" in line for line in report
    )


def test_the_report_has_what_wrong_units_would_show():
    report = sim.read_forcing(records.icos(), **SWEDEN).attrs["report"]
    numbers = next(line for line in report if line.startswith("in numbers"))
    assert re.search(r"wind 2.9\d? m s-1.*precipitation 591 mm a year, [34]\d % of it below 0 degC", numbers), numbers
    assert any(re.search(r"the middle of the light is [+-]\d+ from solar noon", line) for line in report)


@pytest.mark.parametrize("unit", ["°C", "deg C", "celsius"])
def test_units_are_known_by_their_usual_spellings(unit):
    table = records.icos(60).rename(columns={"TA": "air"})
    named = {"columns": {"air_temperature": "air"}, **SWEDEN}
    found = sim.read_forcing(table, units={"air": unit}, **named)
    pd.testing.assert_frame_equal(found, sim.read_forcing(table, units={"air": "degC"}, **named))


def test_years_are_chosen_and_29_february_is_dropped():
    forcing = sim.read_forcing(records.POKER_FLAT, years=(2012, 2013), **ALASKA)
    assert len(forcing) == 2 * 365 * 48 and "29 February was dropped in 1 year" in forcing.attrs["report"]
    assert len(sim.read_forcing(records.POKER_FLAT, years=2012, **ALASKA)) == 365 * 48
    part = sim.read_forcing(records.icos(90), **SWEDEN)
    assert len(part) == 90 * 48 and "mean_annual_temperature_c" not in part.attrs["site"]


def test_a_record_may_lack_29_february():
    days = pd.read_csv(records.POKER_FLAT)
    without = days[days["TIMESTAMP"] != 20120229]
    lacking, whole = (sim.read_forcing(table, **ALASKA) for table in (without, days))
    pd.testing.assert_frame_equal(lacking[NAMES], whole[NAMES])
    assert lacking.attrs["site"] == pytest.approx(whole.attrs["site"], rel=0.01)
    with pytest.raises(ValueError, match=r"no row for 2012-02-28 after the table, zero-based row 422"):
        sim.read_forcing(days[days["TIMESTAMP"] != 20120228], **ALASKA)


# ------------------------------------------------------------------------------------------------------- filling


def test_gaps_are_filled_and_flagged(weather):
    table = records.with_gaps(records.ameriflux())
    forcing = sim.read_forcing(table, gaps="fill", **SWEDEN)
    assert np.flatnonzero(flags(forcing, "air_temperature_c")).tolist() == [1000, 1001, 3000]
    assert np.flatnonzero(np.isin(flags(forcing, "relative_humidity"), (2, 3))).tolist() == [*range(2000, 2048), 3000]
    ends = weather.air_temperature_c.iloc[[999, 1002]].to_numpy()
    np.testing.assert_allclose(forcing.air_temperature_c.iloc[1000:1002], ends[0] + np.diff(ends) * [1 / 3, 2 / 3])
    days = forcing.relative_humidity.to_numpy().reshape(-1, 48)
    day, measured = 2000 // 48, np.array(table["RH_1_1_1"] / 100.0)
    assert days[day + 1, 0] == pytest.approx(
        np.mean([measured[48 * (day + 1 + k)] for k in range(-7, 8) if k]), rel=0.02
    )
    assert forcing[NAMES].notna().all().all() and forcing[NAMES[0]].iloc[4000] == weather[NAMES[0]].iloc[4000]


def test_gaps_are_filled_by_the_records_own_reanalysis_first():
    table = records.fluxnet()
    table.loc[5000:5100, "TA_F"] = -9999
    forcing = sim.read_forcing(table, gaps="fill", **SWEDEN)
    np.testing.assert_allclose(forcing.air_temperature_c.iloc[5000:5101], table["TA_ERA"].iloc[5000:5101])
    assert (flags(forcing, "air_temperature_c")[5000:5101] == 7).all()
    assert any("filled here: by the reanalysis" in line for line in forcing.attrs["report"])


@pytest.mark.parametrize(
    ("value", "message"),
    [(270.0, r"TA_ERA is 270 degC; \[-75, 50\] degC is allowed"), (30.0, r"TA_F is 30 degC from .* without a change")],
)
def test_what_a_reanalysis_fills_is_looked_at(value, message):
    table = records.fluxnet()
    table.loc[480:980, "TA_F"], table.loc[480:980, "TA_ERA"] = -9999, value  # January
    with pytest.raises(ValueError, match=message):
        sim.read_forcing(table, gaps="fill", **SWEDEN)


def test_every_flag_has_a_meaning():
    assert list(FLAGS) == list(range(8))


@pytest.mark.parametrize("name", ["SE-Svb", "US-Prr", "FI-Sod"])
def test_computed_longwave_is_near_the_measured(name):
    """Within what such formulas are good for: 20 W m-2 of bias, 25 by the day (Crawford and Duchon 1999: 8 and 25)."""
    from sim.io.longwave import cloud_cover, longwave

    climate = climate_records.records()[name]
    days = climate.days[["air_temperature_c", "vapour_pressure_hpa", "shortwave_w_m2", "longwave_w_m2"]].dropna()
    cloud = cloud_cover(days.index, days["shortwave_w_m2"].to_numpy(), climate.latitude_deg)
    found = longwave(days["air_temperature_c"].to_numpy(), days["vapour_pressure_hpa"].to_numpy(), cloud)
    error = found - days["longwave_w_m2"]
    assert abs(error.mean()) < 20.0 and (error**2).mean() ** 0.5 < 25.0
    assert np.corrcoef(found, days["longwave_w_m2"])[0, 1] > 0.9


def test_longwave_of_a_gap_is_computed():
    table = records.icos()
    table.loc[8000:8100, "LW_IN"] = -9999
    forcing = sim.read_forcing(table, gaps="fill", **SWEDEN)
    assert (flags(forcing, "longwave_w_m2") == 4).sum() == 101
    error = forcing.longwave_w_m2 - records.measured().longwave_w_m2
    assert (error.drop(error.index[8000:8101]) == 0.0).all() and error.abs().max() < 80.0


def test_longwave_of_a_short_gap_lies_on_a_line():
    table = records.icos()
    before, after = table.loc[[7999, 8006], "LW_IN"]
    table.loc[8000:8005, "LW_IN"] = -9999
    forcing = sim.read_forcing(table, gaps="fill", **SWEDEN)
    filled = forcing.longwave_w_m2[flags(forcing, "longwave_w_m2") == 2]
    np.testing.assert_allclose(filled, np.linspace(before, after, 8)[1:-1])


def test_the_cycle_of_a_day_is_the_one_of_svartberget(weather):
    found = sim.diurnal_cycle(weather["air_temperature_c"], weather["shortwave_w_m2"])
    assert found.half_range_per_shortwave == pytest.approx(FOREST_CYCLE.half_range_per_shortwave, rel=5e-3)
    assert found.peak_hour == pytest.approx(FOREST_CYCLE.peak_hour, abs=0.05)
    assert tower_report._spring_cycle().half_range_per_shortwave == pytest.approx(0.027, abs=5e-4)


# ------------------------------------------------------------------------------------------------------- refusals


def tower(change=None, days=200, made=records.fluxnet, **columns):
    """A record with something wrong."""
    table = made(days).assign(**columns)
    return table if change is None else change(table)


def with_value(name, value, row=3000, **more):
    def change(table):
        table = table.astype({name: object}) if isinstance(value, str) else table
        table.loc[row, name] = value
        return table

    return lambda: tower(change, **more)


def with_times(change, rows):
    """The record with the times of some rows changed by a function of them."""

    def changed(table):
        table = table.drop(columns="TIMESTAMP_END").astype({"TIMESTAMP_START": object})
        table.loc[rows, "TIMESTAMP_START"] = change(table.loc[rows, "TIMESTAMP_START"])
        return table

    return lambda: tower(changed)


def era5(change, days=200):
    return lambda: change(records.era5_land(days))


KELVIN = 273.15
BAD = {
    "a row in kelvin": (
        with_value("TA_F", 268.4),
        r"zero-based row 3000 \(2019-03-04 11:30\): TA_F is 268.4 degC; \[-75, 50\] degC is allowed$",
    ),
    "all in kelvin": (lambda: tower(TA_F=270.0), r"row 0 .*TA_F is 270 degC.*units={'TA_F': 'K'}"),
    "Celsius for kelvin": (
        era5(lambda t: t.assign(t2m=t.t2m - KELVIN)),
        r"row 0 .*t2m is -?[\d.]+ K, which is -2[\d.]+ degC; .*say units={'t2m': 'degC'}",
    ),
    "VPD in kPa": (
        lambda: tower(lambda t: t.assign(VPD_F=t.VPD_F / 10)),
        r"VPD_F in hPa: relative humidity is above \d+ %",
    ),
    "starts that are ends": (
        lambda: tower(
            lambda t: t.rename(columns={"TIMESTAMP_START": "TIMESTAMP_END", "TIMESTAMP_END": "TIMESTAMP_START"})
        ),
        r"row 0: TIMESTAMP_END 2018-12-31 23:30 is not after TIMESTAMP_START 2019-01-01 00:00",
    ),
    "VPD in Pa": (
        lambda: tower(lambda t: t.assign(VPD_F=t.VPD_F * 100)),
        r"row \d+ .*VPD_F is [\d.]+ hPa; .*say units={'VPD_F': 'Pa'}",
    ),
    "pressure in hPa": (
        lambda: tower(PA_F=973.0),
        r"PA_F is 973 kPa, which is 9730 hPa; \[500, 1100\] hPa is allowed; if it is in hPa",
    ),
    "pressure in Pa": (era5(lambda t: t.assign(sp=973.0)), r"sp is 973 Pa, which is 9.73 hPa.*if it is in hPa"),
    "humidity as a share": (
        lambda: tower(lambda t: t.assign(RH=t.RH / 100), made=records.icos),
        r"2019: RH in %: 8\d % of it would be set to the limits .*; it would be usual in '1': units={'RH': '1'}; unu",
    ),
    "humidity of 140 %": (
        with_value("RH", 140.0, made=records.icos),
        r"row 3000 .*RH is 140 %, which is 1.4; \[0, 1.1\] is allowed",
    ),
    "negative light": (
        with_value("SW_IN_F", -50.0),
        r"row 3000 .*SW_IN_F is -50 W m-2; \[-10, 1500\] W m-2 is allowed",
    ),
    "too much light": (with_value("SW_IN_F", 2500.0), r"row 3000 .*SW_IN_F is 2500 W m-2"),
    "light in kW": (
        lambda: tower(lambda t: t.assign(SW_IN_F=t.SW_IN_F / 1000)),
        r"SW_IN_F in W m-2: a clear day has 0\.0\d+ %",
    ),
    "light by photons": (
        lambda: tower(lambda t: t.assign(SW_IN_F=t.SW_IN_F * 1.6)),
        r"SW_IN_F.*: a clear day has 1\d\d %",
    ),
    "light for photosynthesis": (
        lambda: tower(lambda t: t.assign(SW_IN_F=t.SW_IN_F * 0.45), days=365),
        r"SW_IN_F.*: a clear day has 3\d.*at latitude 64.256 on its date, where 60 to 85 are usual",
    ),
    "winter for summer": (
        lambda: tower(lambda t: t.assign(TA=-t.TA), days=365, made=records.icos),
        r"2019: TA is highest around day 1\d of the year; days 160 to 235 are usual; unusual='take'",
    ),
    "the air of other months": (
        lambda: tower(lambda t: t.assign(TA=np.roll(t.TA, 48 * 60)), days=365, made=records.icos),
        r"2019: TA is highest around day 2[56]\d of the year",
    ),
    "net longwave": (lambda: tower(LW_IN_F=-60.0), r"row 0 .*LW_IN_F is -60 W m-2; \[50, 600\]"),
    "a negative wind": (with_value("WS_F", -1.0), r"row 3000 .*WS_F is -1 m s-1; \[0, 60\]"),
    "negative rain": (with_value("P_F", -2.0), r"row 3000 .*P_F is -2 mm; \[-0.1, 200\]"),
    "rain in metres": (
        lambda: tower(lambda t: t.assign(P_F=t.P_F / 1000), days=365),
        r"P_F in mm: precipitation is 0.591 mm a year",
    ),
    "rain in millimetres": (
        era5(lambda t: t.assign(tp=t.tp * 1000)),
        r"row \d+ .*tp grows by [\d.]+ m, which is [\d.]+ mm; .*say units={'tp': 'mm'}",
    ),
    "rain by the day": (
        lambda: tower(lambda t: t.assign(P_F=t.P_F * 48), days=365),
        r"row \d+ .*P_F is [\d.]+ mm; .*if it is in mm d-1, say units={'P_F': 'mm d-1'}",
    ),
    "gentle rain by the day": (
        lambda: tower(P_F=2.0, days=365),
        r"P_F in mm: precipitation is 3.5e\+04 mm a year; .* would be usual in 'mm d-1': units={'P_F': 'mm d-1'}; unu",
    ),
    "light with an offset": (
        lambda: tower(lambda t: t.assign(SW_IN_F=t.SW_IN_F - 50.0)),
        r"SW_IN_F is -[\d.]+ W m-2; \[-10, 1500\] W m-2 is allowed$",
    ),
    "light by photons, strong": (
        lambda: tower(lambda t: t.assign(SW_IN_F=t.SW_IN_F * 2.02)),
        r"SW_IN_F is [\d.]+ W m-2; \[-10, 1500\] W m-2 is allowed$",
    ),
    "text": (with_value("WS_F", "calm"), r"row 3000: WS_F is 'calm'; a number is allowed"),
    "truth values": (
        lambda: tower(lambda t: t.assign(P_F=t.P_F > 0)),
        r"row 0.*: P_F is .*False.*; a number is allowed",
    ),
    "no temperature": (
        lambda: tower(lambda t: t.drop(columns=["TA_F", "TA_ERA"])),
        r"no column for air temperature: none of TA_F, TA_F_MDS, .*columns={'air_temperature': '..'}; the record has T",
    ),
    "nothing but -9999": (
        lambda: tower(made=records.icos, TA=-9999),
        r"no number for air temperature: TA is empty, or -9999, in every row; .*columns={'air_temperature': '..'}",
    ),
    "a gap": (with_value("SW_IN_F", np.nan), r"row 3000 .*SW_IN_F is missing \(1 of 9600 in all\); gaps='fill'"),
    "a missing row": (
        lambda: tower(lambda t: t.drop(index=3000)),
        r"no row for 2019-03-04 12:00 solar time after the table, zero-based row 2999 \(1 of 9600",
    ),
    "an hour twice, at the end of summer time": (
        with_times(lambda t: t - np.where(t % 10000 < 100, 7700, 100), range(5000, 5010)),
        r"row 5000: 2019-04-15 02:30 is there twice, first in the table, zero-based row 4998",
    ),
    "rows out of order": (
        lambda: tower(lambda t: pd.concat([t[48:96], t[:48], t[96:]], ignore_index=True)),
        r"row 48: 2018-12-31 23:30 follows 2019-01-02 23:00; times have to increase",
    ),
    "a row off the grid": (
        with_times(lambda t: t + 7, [3000]),
        r"row 3000: 2019-03-04 11:37 is not on .*grid of 30 minutes",
    ),
    "a time that is none": (
        with_times(lambda t: ["2019-13-45"], [3000]),
        r"row 3000: TIMESTAMP_START is '2019-13-45'; a time as",
    ),
    "a time without minutes": (
        with_times(lambda t: t // 100, range(9600)),
        r"row 0: TIMESTAMP_START is 2018123123; a time as 201906031230 or 2019-06-03 12:30 is allowed$",
    ),
    "a row without minutes": (
        with_times(lambda t: t // 100, [3000]),
        r"row 3000: TIMESTAMP_START is 2019030411; a time as",
    ),
    "times of a spreadsheet": (
        with_times(lambda t: ["43800.52083"], [3000]),
        r"'43800.52083'; .*a count: read it by pandas, .* by pd.to_datetime\(.., unit='D', origin='1899-12-30'\)",
    ),
    "a time in dashes, of days first": (with_times(lambda t: ["31-12-19 12:00"], [3000]), r"of days or months first"),
    "a time of days first": (
        with_times(lambda t: ["31.12.2019 12:00"], [3000]),
        r"row 3000: TIMESTAMP_START is '31.12.2019 12:00'; .*of days or months first: read it by pandas",
    ),
    "an index that is a column, too": (
        lambda: tower(lambda t: t.set_index("TIMESTAMP_START", drop=False)),
        "forcing: the table: TIMESTAMP_START is there twice, as the index and as a column",
    ),
    "a time that is missing": (
        with_times(lambda t: [None], [3000]),
        r"row 3000: TIMESTAMP_START is (None|nan); a time as",
    ),
    "times of three hours": (
        lambda: tower(lambda t: t[::6]),
        r"a row every 180 minutes; a day, or a divisor of it of at most",
    ),
    "months": (lambda: tower(lambda t: t[:: 48 * 31], days=365), r"a row every 31 days"),
    "a start in June": (
        lambda: tower(lambda t: t[48 * 151 :], days=365),
        r"from 2019-06-01 to 2019-12-31; it has no whole year; it has to start on 1 January",
    ),
    "one row": (lambda: tower(lambda t: t[:1]), r"1 rows; whole days"),
    "TIMESTAMP of half-hours": (
        lambda: tower(lambda t: t.drop(columns="TIMESTAMP_END").rename(columns={"TIMESTAMP_START": "TIMESTAMP"})),
        r"whether TIMESTAMP is an interval's start or its end is not clear; say columns={'time_start': 'TIMESTAMP'}",
    ),
    "no times": (
        lambda: tower(lambda t: t.drop(columns=["TIMESTAMP_START", "TIMESTAMP_END"])),
        r"no column of times: none of",
    ),
    "sensors that are not told apart": (
        lambda: tower(lambda t: t.rename(columns={"TA_1_1_1": "TA_2_2_1"}), made=records.ameriflux),
        r"TA_2_2_1, TA_1_2_1 could be air_temperature; name one: columns={'air_temperature': 'TA_2_2_1'}",
    ),
    "sums that fall": (
        era5(lambda t: t.assign(ssrd=t.ssrd.where(t.index != 3000, 0.0))),
        r"row 3000 \(2019-05-05 23:00\): ssrd grows by -[\d.e+]+ J m-2, which is -[\d.]+ W m-2; \[-10, 1500\]",
    ),
    "an array": (lambda: np.zeros((3, 3)), r"a file, a DataFrame or a Dataset is allowed, got ndarray"),
    "no file": (lambda: "nowhere.csv", r"there is no file nowhere.csv"),
    "name too long": (lambda: "a" * 300, r"there is no file a{300}"),
}


def test_a_clock_of_summer_time_is_refused():
    table = records.fluxnet()
    summer = pd.to_datetime(table.TIMESTAMP_START.astype(str)).dt.month.isin(range(4, 11))
    table["SW_IN_F"] = np.where(summer, table.SW_IN_F.shift(2, fill_value=0.0), table.SW_IN_F)
    with pytest.raises(ValueError, match=r"middle of its light 0.9 hours later in summer than in winter"):
        sim.read_forcing(table, **SWEDEN | {"utc_offset_h": 1.5})


@pytest.mark.parametrize(("make", "message"), BAD.values(), ids=BAD)
def test_a_bad_record_is_refused_in_one_line(make, message):
    source = make()
    place = UTC if isinstance(source, pd.DataFrame) and "t2m" in source else SWEDEN
    with pytest.raises(ValueError, match=message) as refusal:
        sim.read_forcing(source, **place)
    assert "\n" not in str(refusal.value)


BAD_ARGUMENTS = {
    "a clock of eight hours off": (
        {"utc_offset_h": 9.0},
        r"middle of its light 8.0 hours before solar noon; utc_offset_h = 9",
    ),
    "a clock of an hour off": ({"utc_offset_h": 2.0}, r"middle of its light 1.\d hours before solar noon"),
    "no clock": (
        {"utc_offset_h": None},
        r"utc_offset_h is needed: .* without summer time; by the record's sun it is 1",
    ),
    "no longitude": ({"longitude_deg": None}, r"longitude_deg is needed"),
    "longitude of 0 to 360": ({"longitude_deg": 212.5}, r"longitude_deg = 212.5: a number in \[-180, 180\]"),
    "latitude of the tropics": ({"latitude_deg": 3.0}, r"latitude_deg = 3.0: a number in \[45, 72\]"),
    "unknown way with gaps": ({"gaps": "ignore"}, r"gaps 'ignore': allowed are refuse, fill"),
    "gaps of a year": ({"longest_gap_days": 365}, r"longest_gap_days = 365: a number in \[0, 28\]"),
    "unknown quantity": ({"columns": {"rain": "P_F"}}, r"unknown quantity 'rain'; allowed: air_temperature, humidity"),
    "unknown column": (
        {"columns": {"air_temperature": "TA_G"}},
        r"no column 'TA_G' for air_temperature; did you mean TA_F",
    ),
    "columns of another type": ({"columns": ["TA_F"]}, r"columns: a dict of names is allowed, got list"),
    "unit of no column": ({"units": {"TA": "K"}}, r"units: the record has no column 'TA'"),
    "unknown unit": ({"units": {"TA_F": "R"}}, r"units: TA_F in 'R'; allowed for air_temperature: degC, K"),
    "unit of what is not used": ({"units": {"WD": "deg"}}, r"units: WD is not used; used are LW_IN_F"),
    "column without a unit": (
        {"columns": {"wind_speed": "WD"}},
        r"units are not known; say units={'WD': ..}: WD in m s-1, km h-1",
    ),
    "a list for a column": (
        {"columns": {"humidity": ["RH"]}},
        r"columns: a text for 'humidity' is allowed, got \['RH'\]",
    ),
    "years of another record": (
        {"years": 2020},
        r"years = 2020: the record is from 2019-01-01 to 2019-07-19; it has no whole",
    ),
    "years of text": ({"years": "2019"}, r"years: a year or \(first, last\) is allowed, got '2019'"),
    "unknown way with what is unusual": ({"unusual": "keep"}, r"unusual 'keep': allowed are refuse, take"),
    "cycle of another type": ({"diurnal_cycle": 3.0}, r"diurnal_cycle: a sim.DiurnalCycle is allowed, got 3.0"),
}


@pytest.mark.parametrize(("arguments", "message"), BAD_ARGUMENTS.values(), ids=BAD_ARGUMENTS)
def test_a_bad_argument_is_refused_in_one_line(arguments, message):
    with pytest.raises(ValueError, match=message) as refusal:
        sim.read_forcing(tower(), **{**SWEDEN, **arguments})
    assert "\n" not in str(refusal.value)


OWN = {
    "air_temperature": ("Tair", "degC"),
    "humidity": ("dry", "hPa"),
    "wind_speed": ("u", "m s-1"),
    "shortwave": ("sun", "W m-2"),
    "longwave": ("sky", "W m-2"),
    "precipitation": ("rain", "mm"),
}


def own(factors=None, units=None, of_ours=None, **more):
    """A record of names of one's own, its columns multiplied or otherwise changed, and its units said."""
    names = dict(zip(("TA_F", "VPD_F", "WS_F", "SW_IN_F", "LW_IN_F", "P_F"), OWN.values(), strict=True))
    table = records.fluxnet()[["TIMESTAMP_START", *names]].rename(columns={k: name for k, (name, _) in names.items()})
    for name, factor in (factors or {}).items():
        table[name] *= factor
    if of_ours:
        table[of_ours[0]] = of_ours[1](table[of_ours[0]])
    columns = {quantity: name for quantity, (name, _) in OWN.items()}
    return sim.read_forcing(table, columns=columns, units={**dict(OWN.values()), **(units or {})}, **more, **SWEDEN)


UNITS = {
    "VPD in kPa": ("dry", 0.1, r"dry in hPa: relative humidity is above 93 % .*; it would be usual in 'kPa'", "kPa"),
    "light in MJ": (
        "sun",
        0.0018,
        r"sun in W m-2: a clear day has 0.1\d+ %.*; it would be usual in 'MJ m-2'",
        "MJ m-2",
    ),
    "rain in m": (
        "rain",
        0.001,
        r"rain in mm: precipitation is 0.591 mm a year; .*; it would be usual in 'm' or .*'rain': 'm'}",
        "m",
    ),
    "rain by the hour": ("rain", 10.0, r"rain in mm: precipitation is 5.91e\+03 mm a year; ", None),
}


@pytest.mark.parametrize("name, factor, message, unit", UNITS.values(), ids=UNITS)
def test_a_unit_that_is_said_is_not_believed_against_the_whole_column(weather, name, factor, message, unit):
    with pytest.raises(ValueError, match=rf"2019: {message}.*; unusual='take' takes it as it is$") as refused:
        own({name: factor})
    assert "\n" not in str(refused.value)
    if unit:
        said = own({name: factor}, {name: unit})
        np.testing.assert_allclose(said[NAMES], weather, rtol=1e-9, atol=1e-9)


def test_what_is_unusual_is_taken_where_the_caller_says_so_and_by_simulate_too():
    taken = own({"dry": 0.1, "rain": 0.001}, unusual="take")
    assert taken.relative_humidity.min() > 0.85
    lines = [line for line in taken.attrs["report"] if line.startswith("unusual, and taken as it is: ")]
    assert [line.split(": ")[2] for line in lines] == ["dry in hPa", "rain in mm"] and len(taken.attrs["unusual"]) == 2
    assert check_forcing(taken, 30, 1)[1] == 365
    taken.attrs.clear()
    with pytest.raises(ValueError, match="precipitation_mm is 0.591 mm a year"):
        check_forcing(taken, 30, 1)
    assert own().attrs["unusual"] == []


def column(name, change, rows=slice(None), made=records.icos):
    """The year with rows of a column changed by a function of them."""
    table = made()
    table.loc[rows, name] = change(table.loc[rows, name])
    return table


def still(name, value, first, days, made=records.icos):
    return column(name, lambda _: value, slice(first, first + 48 * days - 1), made)


UNUSUAL = {
    "humidity beyond saturation": (
        lambda: column("RH", lambda v: np.minimum(1.12 * v, 109.0)),
        r"2019: RH in %: [23]\d % of it would be set to the limits of relative humidity; allowed units are %, 1",
    ),
    "a winter's humidity as a share": (
        lambda: column("RH", lambda v: v / 100)[: 48 * 60],
        r"RH in %: [78]\d % of it would be set to .*; it would be usual in '1': units={'RH': '1'}",
    ),
    "noise of a gauge": (
        lambda: column("P", lambda v: v - 0.05 * (v.index % 10 == 0)),
        r"P is below 0 in (9|10)[\d.]* % of its intervals",
    ),
    "outgoing longwave": (
        lambda: records.icos().assign(LW_IN=lambda t: 0.98 * 5.67e-8 * (t.TA + 273.15) ** 4),
        r"LW_IN in W m-2: the sky gives 98 % of what a black body .*; 65 to 95 are usual",
    ),
    "a dim sky": (lambda: still("LW_IN", 100.0, 0, 365), r"LW_IN in W m-2: the sky gives 30.\d %"),
    "a bright sky": (lambda: still("LW_IN", 599.0, 0, 365), r"LW_IN in W m-2: the sky gives 182 %"),
    "a sky that is the same": (
        lambda: still("LW_IN", 300.0, 0, 365),
        r"LW_IN is 300 W m-2 from 2019-01-01 00:00 solar time on for 365 days without a change; .* at most 5;",
    ),
    "wind of parts": (
        era5(lambda t: t.assign(u10=4.0 * t.u10, v10=4.0 * t.v10), days=60),
        r"u10 in m s-1: wind is [\d.]+ m s-1 in the mean",
    ),
    "wind of the hour": (
        lambda: column("WS", lambda v: 2.5 * v),
        r"wind is 7.3\d m s-1 .*; it would be usual in 'km h-1' or 'knot' or 'mph': units={'WS': 'km h-1'}",
    ),
    "no wind": (lambda: still("WS", 0.0, 0, 365), r"WS is 0 m s-1 from 2019-01-01 .* for 365 days"),
    "rain in inches": (
        lambda: column("P", lambda v: v / 25.4),
        r"P in mm: precipitation is 23.3 mm a year; \[100, 5000\] is usual; it would be usual in 'cm' or 'in': ",
    ),
    "air that stands still": (
        lambda: still("TA", -3.2, 1000, 3),
        r"the table: TA is -3.2 degC from 2019-01-21 20:00 solar time on for 3 days without a change; .* most 2;",
    ),
    "humidity that stands still": (lambda: still("RH", 80.0, 1000, 11), r"RH is 0.8 from 2019-01-21 .* for 11 days"),
    "a deficit that stands still": (
        lambda: still("VPD_F", 3.0, 8000, 11, records.fluxnet),
        r"VPD_F is 3 hPa from 2019-06-16 .* for 11 days",
    ),
    "saturated for a season": (lambda: still("RH", 100.0, 0, 31), r"RH is 1 from 2019-01-01 .* for 31 .* at most 30;"),
    "a dark June": (lambda: still("SW_IN", 0.0, 8000, 20), r"SW_IN is 0 W m-2 from 2019-06-16 .* for 20 days"),
    "a gauge without snow": (
        lambda: records.icos().assign(P=lambda t: t.P.where(t.TA > 0.0, 0.0)),
        r"2019: P has 0 mm on the \d+ days below -5 degC, where 0.05 mm a day are the least that is usual: rain with",
    ),
    "three dark days": (
        lambda: still("SW_IN", 0.0, 8000, 3),
        r"SW_IN is 0 W m-2 from 2019-06-16 .* for 3.* days .* at most 1;",
    ),
    "no humidity": (lambda: still("RH", 0.0, 8000, 2), r"RH is 0 from 2019-06-16 .* for 2 days .* at most 1;"),
    "no rain": (lambda: still("P", 0.0, 3000, 130), r"P is 0 mm from 2019-03-04 .* for 13\d days .* at most 120"),
    "weather of a fortnight ago": (
        lambda: records.icos().assign(
            **{c: np.roll(records.icos()[c], 48 * 14) for c in ("TA", "RH", "SW_IN", "LW_IN")}
        ),
        r"2019: SW_IN has the hours of daylight of latitude 64, 15 days after their dates there, where latitude",
    ),
    "the sun at midnight": (
        lambda: still("SW_IN", 1400.0, 8016, 1 / 48),
        r"SW_IN is 1400 W m-2 at 2019-06-17 00:00 solar time, where the sun above the atmosphere gives [\d.]+; 1 of ",
    ),
    "summer in January": (
        lambda: still("TA", 49.0, 700, 1 / 48),
        r"TA is 49 degC at 2019-01-15 14:00 solar time, where the days around have -11.2 in the median; 1 of 17520 ",
    ),
    "January in July": (lambda: still("TA", -74.0, 9500, 1 / 48), r"TA is -74 degC at 2019-07-17 22:00 .* have 13.5 "),
}


@pytest.mark.parametrize(("make", "message"), UNUSUAL.values(), ids=UNUSUAL)
def test_what_no_weather_and_no_sensor_gives_is_refused_and_may_be_taken(make, message):
    table = make()
    place = UTC if "t2m" in table else SWEDEN
    with pytest.raises(ValueError, match=message) as refused:
        sim.read_forcing(table, **place)
    line = str(refused.value)
    assert "\n" not in line and line.endswith("; unusual='take' takes it as it is")
    taken = sim.read_forcing(table, unusual="take", **place).attrs["unusual"]
    assert taken[0] == line.removesuffix("; unusual='take' takes it as it is")


@pytest.mark.parametrize(
    "make",
    [
        lambda: still("RH", 100.0, 0, 20),  # fog, or a sensor that is wet
        lambda: still("SW_IN", 0.0, 48 * 340, 20),  # December
        lambda: column("SW_IN", lambda v: v - 9.0, slice(0, 48 * 30)).assign(SW_IN=lambda t: t.SW_IN.clip(lower=-9.0)),
        lambda: still("P", 0.0, 3000, 60),
    ],
)
def test_what_weather_and_sensors_give_is_read(make):
    assert sim.read_forcing(make(), **SWEDEN).attrs["unusual"] == []


@pytest.mark.parametrize(
    ("latitude", "message"),
    [
        (56.0, "hours of daylight of latitude 64, where latitude_deg is 56"),
        (70.0, "where the sun above|sunlight above"),
    ],
)
def test_half_hours_of_another_latitude_are_refused(latitude, message):
    with pytest.raises(ValueError, match=message):
        sim.read_forcing(records.icos(), **SWEDEN | {"latitude_deg": latitude})


def test_days_of_another_latitude_are_refused():
    with pytest.raises(ValueError, match="ssrd has the brightest days of latitude 6[3-6].*, where latitude_deg is 50"):
        sim.read_forcing(records.era5_daily(), latitude_deg=50.0)


def test_only_the_years_that_are_wanted_have_to_be_right():
    table = pd.read_csv(records.POKER_FLAT)
    table.loc[table.TIMESTAMP // 10000 == 2014, "WS_F"] = 0.0
    with pytest.raises(ValueError, match="WS_F is 0 m s-1 from 2014-01-01 on for 365 days"):
        sim.read_forcing(table, **ALASKA)
    assert len(sim.read_forcing(table, years=(2011, 2013), **ALASKA)) == 3 * 365 * 48


@pytest.mark.parametrize(
    "name, factor, message",
    [
        ("VPD_F", 0.1, "2013: VPD_F in hPa: relative humidity is above"),
        ("SW_IN_F", 0.0864, "2013: SW_IN_F in W m-2: a clear day has"),
        ("P_F", 0.001, "2013: P_F in mm: precipitation is 0."),
    ],
)
def test_another_unit_in_a_year_of_several_is_refused(name, factor, message):
    table = pd.read_csv(records.POKER_FLAT)
    table.loc[table.TIMESTAMP.astype(str).str.replace("-", "").str[:4] == "2013", name] *= factor
    with pytest.raises(ValueError, match=message):
        sim.read_forcing(table, **ALASKA)


def test_no_unit_makes_light_of_what_is_none():
    with pytest.raises(ValueError, match=r"SW_IN_F in J m-2: a clear day has 0.\d+ % .*; it would be usual in 'W m-2'"):
        sim.read_forcing(tower(), units={"SW_IN_F": "J m-2"}, **SWEDEN)


@pytest.mark.parametrize(
    "name, unit, of_ours",
    [
        ("Tair", "degF", lambda v: 1.8 * v + 32.0),
        ("u", "km h-1", lambda v: 3.6 * v),
        ("u", "knot", lambda v: v / 0.514444),
        ("u", "mph", lambda v: v / 0.44704),
        ("rain", "cm", lambda v: v / 10.0),
        ("rain", "in", lambda v: v / 25.4),
    ],
)
def test_units_of_the_weather_service(weather, name, unit, of_ours):
    np.testing.assert_allclose(own(of_ours=(name, of_ours), units={name: unit})[NAMES], weather, rtol=2e-6, atol=1e-9)


def test_fahrenheit_and_km_an_hour_are_named_where_a_value_is_beyond_its_limits():
    with pytest.raises(ValueError, match=r"TA is [\d.]+ degC; .*; if it is in degF, say units={'TA': 'degF'}"):
        sim.read_forcing(column("TA", lambda v: 1.8 * v + 32.0), **SWEDEN)
    with pytest.raises(ValueError, match=r"WS is 64.8108 m s-1; .*; if it is in km h-1, say units={'WS': 'km h-1'}"):
        sim.read_forcing(column("WS", lambda v: 3.6 * v), **SWEDEN)


@pytest.mark.parametrize("unit, factor", [("mm d-1", 48.0), ("mm h-1", 2.0)])
def test_rain_may_be_a_rate(unit, factor):
    rate = tower(lambda t: t.assign(P_F=t.P_F * factor))
    forcing = sim.read_forcing(rate, units={"P_F": unit}, **SWEDEN)
    np.testing.assert_allclose(forcing.precipitation_mm, as_it_is().precipitation_mm)


def test_rain_by_the_day_is_refused_of_a_forcing_of_ones_own(weather):
    with pytest.raises(
        ValueError, match=r"precipitation_mm is 3.5e\+04 mm a year in 2019; .* 5000\] is allowed .*30 minutes"
    ):
        check_forcing(weather.assign(precipitation_mm=2.0), 30, 1)


def test_a_year_that_is_missing_between_others_is_a_gap():
    table = records.era5_daily()
    table = pd.concat([table, table.assign(valid_time=table.valid_time + pd.Timedelta(days=731))])
    # 29 February is no part of it
    for gaps, message in (("refuse", "no row for 2020-01-01 after"), ("fill", "from 2020-01-01 00:00 on for 365 days")):
        with pytest.raises(ValueError, match=message):
            sim.read_forcing(table, latitude_deg=SWEDEN["latitude_deg"], gaps=gaps)


def test_a_gap_that_is_too_long_is_refused():
    table = tower(lambda t: t.drop(index=range(4000, 4960)))
    message = r"TA_F is missing from 2019-03-25 08:00 on for 20 days; gaps of up to longest_gap_days = 14 are filled"
    with pytest.raises(ValueError, match=message):
        sim.read_forcing(table.drop(columns="TA_ERA"), gaps="fill", **SWEDEN)


BAD_FILES = {
    "nothing": ("", r"line 1: a row of column names is needed, got nothing"),
    "no names": (
        "201901010000,1.5,-2\n201901010030,1,2\n",
        r"line 1: a row of column names is needed, got numbers, 2019",
    ),
    "columns apart by blanks": ("time TA RH\n20190101 1 2\n", r"line 1: columns separated by comma, semicolon or tab"),
    "a column twice": ("TIMESTAMP,TA_F,TA_F\n20190101,1,1\n", r"line 1: column TA_F is there twice"),
    "nothing but names": ("TIMESTAMP,TA_F,VPD_F,WS_F,SW_IN_F,P_F\n", r"tower.csv: 0 rows; whole days"),
    "decimal commas": (
        "TIMESTAMP;TA_F;VPD_F;WS_F;SW_IN_F;P_F\n20190101;1,5;1;1;1;0\n20190102;1,5;1;1;1;0\n",
        r"line 2: TA_F is '1,5'; a number with a decimal point is allowed",
    ),
    "fewer fields than names": (
        "TIMESTAMP,TA_F,VPD_F\n20190101,1\n",
        r"tower.csv: fields for the header's 3 names are needed",
    ),
    "names of no one": ("date,t,q\n20190101,1,1\n", r"tower.csv: no column for air temperature: none of TA_F"),
    "decimal commas between commas": (
        "TIMESTAMP,TA_F,VPD_F,WS_F,SW_IN_F,P_F\n20190101,1,5,1,1,10,0\n",
        r"line 2: 7 fields; the header has 6 names \(lines above the names have to be removed, or begin with #\)",
    ),
    "days before months": (
        "TIMESTAMP,TA_F,VPD_F,WS_F,SW_IN_F,P_F\n01.02.2019,1,1,1,10,0\n02.02.2019,1,1,1,10,0\n",
        r"line 2: TIMESTAMP is '01.02.2019'; a time as 201906031230 or 2019-06-03 12:30 is allowed",
    ),
    "a row of units": (
        "TIMESTAMP,TA_F,VPD_F,WS_F,SW_IN_F,P_F\nyyyy,degC,hPa,m s-1,W m-2,mm\n20190101,1,1,1,10,0\n",
        r"line 2: TIMESTAMP is 'yyyy'; .* is allowed; rows of units below the names have to be removed",
    ),
    "a stray quote": (
        'TIMESTAMP,TA_F,VPD_F,WS_F,SW_IN_F,P_F\n20190101,1,1,1,10,0\n"20190102,1,1,1,10,0\n20190103,1,1,1,10,0\n',
        r"^forcing: tower.csv, line 3: a quote is opened and not closed in its line$",
    ),
    "an empty line": (
        "# tower\nTIMESTAMP,TA_F,VPD_F,WS_F,SW_IN_F,P_F\n20190101,1,1,1,10,0\n\n20190102,1,1,1,10,0\n",
        r"line 4: TIMESTAMP is nan",
    ),
}


def test_the_file_of_a_campbell_logger(tmp_path):
    table = records.icos(90).drop(columns="TIMESTAMP_START").rename(columns={"TIMESTAMP_END": "TIMESTAMP"})
    table["TIMESTAMP"] = pd.to_datetime(table["TIMESTAMP"].astype(str)).astype(str)
    rows = table.astype({"PA": object}).assign(PA="NAN").to_csv(index=False, header=False)
    names = ",".join(f'"{name}"' for name in table)
    kinds = ",".join(['""'] * len(table.columns))
    head = f'"TOA5","Svb","CR1000","1","CR1000.Std.32","CPU:a.CR1","1","Met",1,2,3,4\n{names}\n{kinds}\n{kinds}\n'
    (tmp_path / "logger.dat").write_text(head + rows)
    end = {"columns": {"time_end": "TIMESTAMP"}}
    forcing = sim.read_forcing(tmp_path / "logger.dat", **end, **SWEDEN)
    np.testing.assert_allclose(forcing[NAMES], records.measured().iloc[: 48 * 90], rtol=0, atol=1e-12)
    (tmp_path / "logger.dat").write_text(head.replace('"', "") + rows.replace("-", "x", 1))
    with pytest.raises(ValueError, match=r"logger.dat, line 5: TIMESTAMP is '2019x01-01 00:00"):
        sim.read_forcing(tmp_path / "logger.dat", **end, **SWEDEN)


@pytest.mark.parametrize("form", ["%Y%m%d%H%M", "%Y-%m-%d %H:%M", "%Y-%m-%dT%H:%M:%S"])
def test_24_00_is_0_00_of_the_next_day(weather, form):
    table = records.icos().drop(columns="TIMESTAMP_START")
    ends = pd.to_datetime(table["TIMESTAMP_END"].astype(str))
    midnight = ends == ends.dt.normalize()
    before = (ends - pd.Timedelta(days=1)).dt.strftime(form.replace("%H", "24"))
    table["TIMESTAMP_END"] = ends.dt.strftime(form).where(~midnight, before)
    pd.testing.assert_frame_equal(sim.read_forcing(table, **SWEDEN)[NAMES], weather, check_freq=False)


@pytest.mark.parametrize("step", [1, 2])
def test_an_hour_twice_in_autumn_is_said_to_be_of_summer_time(step):
    table = records.icos().drop(columns="TIMESTAMP_END")[::step]
    times = pd.to_datetime(table["TIMESTAMP_START"].astype(str)).dt.floor(f"{30 * step}min")
    summer = times.dt.tz_localize("Etc/GMT-1").dt.tz_convert("Europe/Stockholm").dt.tz_localize(None)
    table["TIMESTAMP_START"] = summer.astype(str)
    table = table[summer >= "2019-06-01"]
    with pytest.raises(
        ValueError, match=r"2019-10-27 02:00 is there twice, .*; a clock of summer time has an hour twic"
    ):
        sim.read_forcing(table, **SWEDEN)


@pytest.mark.parametrize(("text", "message"), BAD_FILES.values(), ids=BAD_FILES)
def test_a_bad_file_is_refused_by_its_line(tmp_path, text, message):
    (tmp_path / "tower.csv").write_text(text)
    with pytest.raises(ValueError, match=message):
        sim.read_forcing(tmp_path / "tower.csv", **ALASKA)


def test_a_file_that_is_not_utf8_is_refused_by_its_line(tmp_path):
    (tmp_path / "tower.csv").write_bytes(b"# tower\nTIMESTAMP,TA_F,T \xb0C\n20190101,1,1\n")
    with pytest.raises(ValueError, match="tower.csv, line 2: byte 0xb0 is not UTF-8; save the file as UTF-8"):
        sim.read_forcing(tmp_path / "tower.csv", **ALASKA)


@pytest.mark.parametrize("name", ["tower.csv.gz", "tower.nc"])
def test_a_file_that_is_not_what_its_name_says_is_named_in_one_line(tmp_path, name):
    if name.endswith(".nc"):
        pytest.importorskip("xarray")
    (tmp_path / name).write_text("TIMESTAMP,TA_F\n")
    with pytest.raises(ValueError, match=rf"^forcing: {name}: (no NetCDF file|it cannot be unpacked)") as refused:
        sim.read_forcing(tmp_path / name, **ALASKA)
    assert "\n" not in str(refused.value)


def test_half_a_packed_file_is_refused(tmp_path):
    path = tmp_path / "tower.csv.gz"
    records.fluxnet(10).to_csv(path, index=False)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(ValueError, match="^forcing: tower.csv.gz: it cannot be unpacked"):
        sim.read_forcing(path, **SWEDEN)


def test_a_column_twice_in_memory_is_refused():
    table = records.fluxnet(10)
    with pytest.raises(ValueError, match="^forcing: the table: column TA_F is there twice$"):
        sim.read_forcing(pd.concat([table, table[["TA_F"]]], axis=1), **SWEDEN)


@pytest.mark.parametrize("name", ["tower.zip", "tower.ZIP"])
def test_another_kind_of_file_is_refused(tmp_path, name):
    (tmp_path / name).write_bytes(b"PK")
    with pytest.raises(ValueError, match=rf"{name}: a CSV file \(also .gz\) or a NetCDF file .*unpack or export"):
        sim.read_forcing(tmp_path / name, **ALASKA)
