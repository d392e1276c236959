"""The records of US-Prr, Sodankylä and the forest towers: units, known values, screening, forcing without gaps."""

import numpy as np
import pandas as pd
import pytest

from analysis.validation import climate_records, forest_towers, poker_flat, tower_comparison, towers
from sim.io import longwave
from sim.simulate import check_forcing


@pytest.fixture(scope="module")
def record():
    return poker_flat.record()


@pytest.fixture(scope="module")
def fluxes(record):
    return poker_flat.daily_fluxes(record)


def test_poker_flat_has_four_whole_years(record):
    assert record.index.equals(pd.date_range("2011-01-01", "2014-12-31", name="date"))
    assert record["TA_F"].mean() == pytest.approx(-2.70, abs=0.01)
    assert record["P_ERA"].notna().all()


def test_winter_precipitation_is_era_interims(record):
    weather = poker_flat.daily_weather(record)
    frost = record["TA_F"] < 0.0
    assert weather.loc[frost, "precipitation_mm"].sum() == pytest.approx(record.loc[frost, "P_ERA"].sum())
    assert weather.loc[~frost, "precipitation_mm"].sum() == pytest.approx(record.loc[~frost, "P_F"].sum())


def test_fluxes_of_poker_flat(fluxes):
    assert len(fluxes) == 4 * 365
    summer = fluxes[fluxes.index.month.isin([6, 7, 8])]
    assert summer["latent_heat_w_m2"].mean() == pytest.approx(41.1, abs=0.1)
    assert tower_comparison.energy_closure(fluxes, (6, 7, 8)) == pytest.approx(1.03, abs=0.01)
    assert fluxes["albedo"].dropna().between(0.0, 1.0).mean() > 0.99
    assert fluxes["net_radiation_w_m2_measured"].between(0.0, 1.0).all()


def test_forcing_of_poker_flat_drives_the_simulator():
    years, days = check_forcing(poker_flat.forcing(), 30, 4)
    assert len(years) == 4 and days == 365


def test_measured_spring_replaces_the_spread_one_but_for_precipitation():
    spread, measured = poker_flat.forcing(), poker_flat.forcing(measured_spring=True)
    spring = poker_flat.spring_weather()
    pd.testing.assert_frame_equal(measured.loc[spring.index, list(spring)], spring, check_index_type=False)
    pd.testing.assert_series_equal(measured["precipitation_mm"], spread["precipitation_mm"])
    pd.testing.assert_frame_equal(measured.loc["2012"], spread.loc["2012"])


def test_sun_of_the_spring_record_is_highest_at_noon():
    weather = poker_flat.spring_weather()
    hour = weather.index.hour + weather.index.minute / 60.0 + 0.25
    assert np.average(hour, weights=weather["shortwave_w_m2"]) == pytest.approx(12.0, abs=0.3)


def test_a_large_negative_shortwave_is_an_error():
    sun = pd.Series([-3.0, 20.0], index=pd.date_range("2013-03-01", periods=2, freq="30min"))
    assert poker_flat.without_offset(sun).tolist() == [0.0, 20.0]
    with pytest.raises(ValueError, match="shortwave of -40 W/m2 on 2013-03-01"):
        poker_flat.without_offset(sun - 37.0)


def test_daily_fluxes_add_carbon_and_average_heat():
    times = pd.date_range("2019-06-01", periods=96, freq="30min")
    half_hours = pd.DataFrame({"gpp_gc_m2": 0.1, "latent_heat_w_m2": 50.0}, index=times)
    half_hours["latent_heat_w_m2_measured"] = [True] * 60 + [False] * 36
    half_hours.loc[times[70], "gpp_gc_m2"] = np.nan
    daily = towers.daily_fluxes(half_hours)
    assert daily["gpp_gc_m2"].iloc[0] == pytest.approx(4.8) and np.isnan(daily["gpp_gc_m2"].iloc[1])
    assert daily["latent_heat_w_m2"].tolist() == [50.0, 50.0]
    assert daily["latent_heat_w_m2_measured"].tolist() == [1.0, 0.25]


def test_failed_partitionings_are_left_out():
    months = forest_towers.carbon_fluxes()
    january = months.loc[("CA-Man", 1994, 1)]
    assert january["gpp"] == pytest.approx(0.0) and january["nee"] == pytest.approx(24.957 / 31.0)
    assert months["gpp"].min() > -0.2 and months["reco"].min() > -0.2


def test_towers_near_the_climate_are_cold_and_undisturbed():
    near = forest_towers.near_climate()
    assert {"US-Prr", "US-Uaf", "CA-Man", "CA-Obs"} <= set(near)
    assert not {"CA-SF2", "US-Fcr", "US-Rpf", "CA-NS7", "FI-Hyy"} & set(near)


def test_annual_sums_are_of_whole_courses():
    """Of the aspen forest, the one that takes up most; a tower whose partitioning failed has no uptake."""
    sums = forest_towers.annual_sums()
    assert sums.gpp.idxmax() == forest_towers.ASPEN and 1.0 < sums.gpp.max() < 1.3
    assert np.isnan(sums.gpp["CA-Ojp"]) and sums.nee["CA-Ojp"] < -0.2


def test_halves_of_a_record_share_no_day():
    for climate in climate_records.records().values():
        even, odd = climate.halves()
        assert len(even) + len(odd) == len(climate.days) and even.index.intersection(odd.index).empty
        assert len(even) / len(climate.days) == pytest.approx(0.5, abs=0.01)


def test_cloud_term_of_an_overcast_sky_is_one():
    day = pd.DataFrame({"air_temperature_c": [-10.0], "vapour_pressure_hpa": [2.0]})
    black = climate_records.black_body(day["air_temperature_c"] + 273.15)
    clear = climate_records.clear_emissivity(day)
    assert climate_records.cloud_term(day.assign(longwave_w_m2=black)).iloc[0] == pytest.approx(1.0)
    assert climate_records.cloud_term(day.assign(longwave_w_m2=clear * black)).iloc[0] == pytest.approx(0.0)


@pytest.mark.parametrize("latitude", [0.0, 65.0])
def test_extraterrestrial_radiation_is_the_closed_integral_over_the_day(latitude):
    """Duffie and Beckman (1980), Eq. 1.10.3, on 21 March (declination near 0) and 21 June (near 23.4 degrees)."""
    for date in ("2013-03-21", "2013-06-21"):
        day = pd.Timestamp(date).day_of_year
        phi, delta = np.radians(latitude), np.radians(23.45) * np.sin(2.0 * np.pi * (284 + day) / 365.0)
        sunset = np.arccos(-np.tan(phi) * np.tan(delta))
        integral = sunset * np.sin(phi) * np.sin(delta) + np.cos(phi) * np.cos(delta) * np.sin(sunset)
        mean = 1361.0 * (1.0 + 0.033 * np.cos(2.0 * np.pi * day / 365.0)) * integral / np.pi
        found = longwave.extraterrestrial(pd.DatetimeIndex([date]), latitude)[0]
        assert found == pytest.approx(mean, rel=0.003)
