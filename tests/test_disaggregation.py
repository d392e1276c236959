"""Half-hours from days: what the day had is still there, and the sun and the warmth are where they should be."""

import math

import numpy as np
import pandas as pd
import pytest

import sim
from sim.io import disaggregation
from sim.io.disaggregation import DiurnalCycle, diurnal_cycle, half_hours

CYCLE = DiurnalCycle(half_range_per_shortwave=0.03, peak_hour=15.0)
LATITUDE = 65.0


def saturation(temperature):
    return np.vectorize(disaggregation.saturation_water)(temperature)


@pytest.fixture(scope="module")
def daily():
    days = pd.date_range("2012-01-01", "2012-12-31")
    season = np.cos(2.0 * math.pi * (days.day_of_year - 190) / 365.25)
    return pd.DataFrame(
        {
            "air_temperature_c": -3.0 + 18.0 * season,
            "vapour_pressure_deficit_hpa": 0.35 * saturation(-3.0 + 18.0 * season),
            "wind_speed_m_s": 2.5,
            "shortwave_w_m2": 110.0 + 105.0 * season,
            "longwave_w_m2": 260.0 + 60.0 * season,
            "precipitation_mm": np.where(days.day_of_year % 3 == 0, 4.0, 0.0),
        },
        index=days,
    )


@pytest.fixture(scope="module")
def hours(daily):
    return half_hours(daily, LATITUDE, CYCLE)


def test_daily_means_and_sums_are_those_of_the_record(daily, hours):
    kept = daily.drop(pd.Timestamp("2012-02-29"))
    mean = hours.groupby(hours.index.normalize()).mean()
    for name in ("air_temperature_c", "wind_speed_m_s", "shortwave_w_m2", "longwave_w_m2"):
        np.testing.assert_allclose(mean[name], kept[name], rtol=1e-12, atol=1e-9)
    total = hours["precipitation_mm"].groupby(hours.index.normalize()).sum()
    np.testing.assert_allclose(total, kept["precipitation_mm"], rtol=1e-12)


def test_mean_vapour_pressure_deficit_is_that_of_the_record(daily, hours):
    deficit = (
        (saturation(hours["air_temperature_c"]) * (1.0 - hours["relative_humidity"]))
        .groupby(hours.index.normalize())
        .mean()
    )
    dry = deficit.index[hours["relative_humidity"].groupby(hours.index.normalize()).max() < 1.0]
    assert len(dry) > 100
    np.testing.assert_allclose(deficit[dry], daily.loc[dry, "vapour_pressure_deficit_hpa"], rtol=1e-6)


def test_the_sun_is_highest_at_noon_and_night_is_dark(hours):
    june = hours.loc["2012-06-21", "shortwave_w_m2"]
    equinox = hours.loc["2012-03-20", "shortwave_w_m2"]
    assert june.idxmax().hour in (11, 12) and (june > 0.0).sum() > 40
    assert (equinox > 0.0).sum() == pytest.approx(24, abs=2)
    assert equinox.iloc[0] == 0.0


def test_a_day_without_sun_is_spread_evenly():
    shape = disaggregation.sun_shape(pd.DatetimeIndex(["2012-12-21"]), 70.0)
    np.testing.assert_array_equal(shape, 1.0)


def test_warmest_hour_and_range_are_those_of_the_cycle(daily, hours):
    day = hours.loc["2012-06-21", "air_temperature_c"]
    assert day.idxmax().hour in (14, 15)
    swing = CYCLE.half_range_per_shortwave * daily.loc["2012-06-21", "shortwave_w_m2"]
    assert (day.max() - day.min()) / 2.0 == pytest.approx(swing, rel=0.01)


def test_the_cycle_of_a_record_is_found_again(hours):
    found = diurnal_cycle(hours["air_temperature_c"], hours["shortwave_w_m2"])
    assert found.half_range_per_shortwave == pytest.approx(CYCLE.half_range_per_shortwave, rel=1e-6)
    assert found.peak_hour == pytest.approx(CYCLE.peak_hour, abs=1e-6)


def test_a_gap_and_an_impossible_deficit_name_column_and_day(daily):
    gappy = daily.copy()
    gappy.loc["2012-05-02", "wind_speed_m_s"] = np.nan
    with pytest.raises(ValueError, match="wind_speed_m_s is missing on 2012-05-02"):
        half_hours(gappy, LATITUDE, CYCLE)
    dry = daily.copy()
    dry.loc["2012-01-05", "vapour_pressure_deficit_hpa"] = 9.0
    with pytest.raises(ValueError, match="9 hPa on 2012-01-05 is too large"):
        half_hours(dry, LATITUDE, CYCLE)


def test_relative_humidity_is_that_of_the_days_temperature(daily):
    by_share = daily.drop(columns="vapour_pressure_deficit_hpa").assign(relative_humidity=0.8)
    by_pressure = by_share.assign(vapour_pressure_hpa=0.8 * saturation(daily.air_temperature_c))
    expected = half_hours(by_pressure.drop(columns="relative_humidity"), LATITUDE, CYCLE)
    pd.testing.assert_frame_equal(half_hours(by_share, LATITUDE, CYCLE), expected)


def test_days_in_the_columns_of_a_forcing_are_simulated_as_its_error_advises(daily):
    forcing = daily.drop(columns="vapour_pressure_deficit_hpa").assign(relative_humidity=0.8)
    with pytest.raises(ValueError, match=r"sim.half_hours\(forcing, latitude_deg\) makes half-hours of it"):
        sim.simulate(forcing=forcing)
    half_hours = sim.half_hours(forcing, LATITUDE)
    assert half_hours.attrs["site"]["latitude_deg"] == LATITUDE
    table = sim.simulate(forcing=half_hours, time_step_minutes=120)
    assert table.precipitation_mm.tolist() == pytest.approx([forcing.precipitation_mm.drop("2012-02-29").sum()])


@pytest.mark.parametrize(
    ("change", "latitude", "message"),
    [
        (lambda daily: None, LATITUDE, "daily record: a DataFrame with a DatetimeIndex is allowed"),
        (lambda daily: daily, 100, r"latitude_deg = 100: a number in \[.*\] is allowed"),
        (lambda daily: daily, None, r"latitude_deg = None: a number in \[.*\] is allowed"),
        (
            lambda daily: daily.set_axis(pd.date_range("2012-01-01", periods=len(daily), freq="h")),
            LATITUDE,
            "daily record: zero-based row 1 is of 2012-01-01 01:00:00; one row a day, at 00:00 and in order, is .*",
        ),
        (
            lambda daily: daily.drop(columns="vapour_pressure_deficit_hpa"),
            LATITUDE,
            "daily record: column relative_humidity is missing; needed: air_temperature_c, .*, vapour_pressure_hpa or "
            "vapour_pressure_deficit_hpa does too",
        ),
        (
            lambda daily: daily.drop(columns="vapour_pressure_deficit_hpa").assign(relative_humidity=70.0),
            LATITUDE,
            r"daily record: relative_humidity is 70 on 2012-01-01; \[0, 1.1\] is allowed \(is it in percent\?\)",
        ),
        (
            lambda daily: daily.assign(wind_speed_m_s="calm"),
            LATITUDE,
            "daily record: wind_speed_m_s has type .*; numbers are allowed",
        ),
        (
            lambda daily: daily.drop(daily.loc["2012-05"].index),
            LATITUDE,
            r"daily record: no row for 2012-05-01 \(31 days in all\)",
        ),
        (
            lambda daily: daily.tz_localize("Etc/GMT-1"),
            LATITUDE,
            "daily record: its dates have the time zone Etc/GMT-1; dates without one are allowed",
        ),
        (lambda daily: daily[:0], LATITUDE, "daily record: 0 rows, 29 February apart; one row a day is allowed"),
    ],
)
def test_what_is_no_daily_record_is_refused_in_one_line(daily, change, latitude, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        half_hours(change(daily), latitude)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("air_temperature_c", 273.0, r"\[-75, 50\] degC"),
        ("vapour_pressure_deficit_hpa", -6.0, r"\[-0.5, 80\] hPa"),
        ("vapour_pressure_hpa", -6.0, r"\(0, 13.3\] hPa is allowed at 4.3.* degC"),
        ("vapour_pressure_hpa", 600.0, r"\(0, 13.3\] hPa is allowed at 4.3.* degC"),  # in Pa
        ("wind_speed_m_s", -3.0, r"\[0, 60\] m s-1"),
        ("shortwave_w_m2", -50.0, r"\[0, 1500\] W m-2"),
        ("longwave_w_m2", np.inf, r"\[50, 600\] W m-2"),
        ("precipitation_mm", -5.0, r"\[0, 200\] mm"),
    ],
)
def test_a_value_beyond_its_limits_is_refused_by_column_and_day(daily, name, value, allowed):
    changed = daily.assign(vapour_pressure_hpa=0.7 * saturation(daily.air_temperature_c))
    changed = changed if name == "vapour_pressure_hpa" else changed.drop(columns="vapour_pressure_hpa")
    changed.loc["2012-05-02", name] = value
    with pytest.raises(ValueError, match=rf"^daily record: {name} is {value:g} on 2012-05-02; {allowed}"):
        half_hours(changed, LATITUDE, CYCLE)


def test_29_february_may_be_missing_or_wrong_and_vapour_a_little_above_saturation(daily, hours):
    pd.testing.assert_frame_equal(half_hours(daily.drop(pd.Timestamp("2012-02-29")), LATITUDE, CYCLE), hours)
    wrong = daily.copy()
    wrong.loc["2012-02-29", "longwave_w_m2"] = -9999.0
    pd.testing.assert_frame_equal(half_hours(wrong, LATITUDE, CYCLE), hours)
    damp = daily.assign(vapour_pressure_hpa=1.09 * saturation(daily.air_temperature_c))  # as at Sodankyla in November
    assert half_hours(damp, LATITUDE, CYCLE).relative_humidity.max() == 1.0


@pytest.mark.parametrize(
    ("slope", "hour", "message"),
    [
        (math.nan, 15.0, r"half_range_per_shortwave = nan: a number in \[0, 0.1\) is allowed"),
        (5.0, 15.0, "half_range_per_shortwave = 5.0: .*"),
        (-1.0, 15.0, "half_range_per_shortwave = -1.0: .*"),
        ("0.01", 15.0, "half_range_per_shortwave = '0.01': .*"),
        (True, 15.0, "half_range_per_shortwave = True: .*"),
        (0.01, 40.0, r"peak_hour = 40.0: a number in \[0, 24\) is allowed"),
        (0.01, 24.0, "peak_hour = 24.0: .*"),
    ],
)
def test_a_cycle_that_is_none_is_refused(slope, hour, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        DiurnalCycle(slope, hour)


def test_only_a_cycle_is_a_cycle(daily):
    with pytest.raises(ValueError, match="^diurnal_cycle: a sim.DiurnalCycle is allowed, got None$"):
        half_hours(daily, LATITUDE, None)


WHOLE_DAYS = "half-hours of whole days, from 00:00 on, are allowed"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda air, sun: (air.where(air.index != air.index[7]), sun),
            r"air is missing at 2012-01-01 03:30 \(1 of 17520",
        ),
        (lambda air, sun: (air, sun.where(air.index != air.index[7])), "shortwave is missing at 2012-01-01 03:30"),
        (lambda air, sun: (air, 0.0 * sun), "shortwave: it is 0 in all of 17520 rows; days with light are allowed"),
        (lambda air, sun: (air[:0], sun[:0]), f"air: 0 rows; {WHOLE_DAYS}"),
        (lambda air, sun: (sun, air), r"air is [\d.]+ at 2012-.*; \[-75, 50\] degC is allowed"),
        (lambda air, sun: (air, sun - 1.0), r"shortwave is -1 at 2012-.*; \[0, 1500\] W m-2 is allowed"),
        (lambda air, sun: (air[::2], sun[::2]), f"air: 8760 rows from 2012-01-01 00:00:00 on; {WHOLE_DAYS}"),
        (lambda air, sun: (air[:50], sun[:50]), f"air: 50 rows from .*; {WHOLE_DAYS}"),
        (lambda air, sun: (air[24:-24], sun[24:-24]), f"air: 17472 rows from 2012-01-01 12:00:00 on; {WHOLE_DAYS}"),
        (lambda air, sun: (air, sun[48:]), "shortwave: 17472 rows; the 17520 times of air are allowed"),
        (lambda air, sun: (air.tz_localize("UTC"), sun), "air: its times have the time zone UTC; solar time"),
        (lambda air, sun: (list(air), list(sun)), "air: a Series with a DatetimeIndex is allowed"),
        (lambda air, sun: (air, sun.astype(str)), "shortwave has type .*; numbers are allowed"),
    ],
)
def test_a_record_that_has_no_cycle_is_refused_by_argument(hours, change, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        diurnal_cycle(*change(hours["air_temperature_c"], hours["shortwave_w_m2"]))
