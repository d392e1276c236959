"""The tower records: units, known values of the year, and refusal of gaps."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from analysis.validation import towers


@pytest.fixture(scope="module")
def tower():
    return towers.SE_SVB


@pytest.fixture(scope="module")
def record(tower):
    return towers.read(tower)


@pytest.fixture(scope="module")
def forcing(record, tower):
    return towers.forcing(record, tower)


@pytest.fixture(scope="module")
def fluxes(record, tower):
    return towers.fluxes(record, tower)


def test_forcing_is_one_gapless_year_in_the_simulators_columns(forcing):
    assert tuple(forcing.columns) == towers.FORCING_COLUMNS
    assert forcing.index.equals(pd.date_range("2019-01-01", periods=365 * 48, freq="30min", name="time"))
    assert np.isfinite(forcing.to_numpy()).all()


@pytest.mark.parametrize(
    ("column", "low", "high", "mean"),
    [
        ("air_temperature_c", -22.2, 30.0, 2.47),
        ("relative_humidity", 0.16, 1.0, 0.770),
        ("wind_speed_m_s", 0.0, 20.0, 2.93),
        ("shortwave_w_m2", 0.0, 931.0, 106.2),
        ("longwave_w_m2", 150.0, 420.0, 285.2),
        ("precipitation_mm", 0.0, 9.0, 591.3 / (365 * 48)),
    ],
)
def test_units_and_known_values_of_2019(forcing, column, low, high, mean):
    assert low <= forcing[column].min() and forcing[column].max() <= high
    assert forcing[column].mean() == pytest.approx(mean, rel=2e-3)


def test_annual_fluxes_of_2019(fluxes):
    assert fluxes["gpp_gc_m2"].sum() == pytest.approx(899, abs=1)
    assert fluxes["latent_heat_w_m2"].mean() * 365 * 0.0864 == pytest.approx(740, abs=1)
    assert fluxes["net_radiation_w_m2"].mean() == pytest.approx(51.1, abs=0.1)


def test_flags_tell_measured_from_filled(fluxes):
    assert fluxes["latent_heat_w_m2_measured"].mean() == pytest.approx(0.482, abs=0.001)
    assert fluxes["gpp_gc_m2_measured"].mean() == pytest.approx(0.520, abs=0.001)
    assert (~fluxes["net_radiation_w_m2_measured"]).sum() == 224
    assert fluxes.loc[fluxes["net_radiation_w_m2_measured"], "net_radiation_w_m2"].notna().all()


def test_sun_is_highest_at_noon_in_the_index(forcing):
    hour = forcing.index.hour + forcing.index.minute / 60 + 0.25
    centre = np.average(hour, weights=forcing["shortwave_w_m2"])
    assert centre == pytest.approx(12.0, abs=0.25)


def test_time_is_shifted_to_the_nearest_interval_of_solar_time(tower):
    """At 147.49 W on UTC-9 the half-hour to 00:30 begins at 23:10 solar time; 23:00 is the nearest."""
    stamps = pd.date_range("2013-03-01 00:30", periods=48, freq="30min")
    columns = [column for column, _ in tower.forcing.values()]
    record = pd.DataFrame(1.0, index=stamps, columns=columns)
    alaska = replace(tower, longitude_deg=-147.49, utc_offset_h=-9.0)
    assert towers.forcing(record, alaska).index[0] == pd.Timestamp("2013-02-28 23:00")


def test_gap_in_the_weather_names_column_and_time(record, tower):
    gappy = record.copy()
    gappy.loc["2019-06-03 12:00":"2019-06-03 13:00", "SWin_Wm2"] = np.nan
    message = r"shortwave_w_m2 is missing at 2019-06-03 12:00 \(3 intervals in all\)"
    with pytest.raises(ValueError, match=message):
        towers.forcing(gappy, tower)


def test_missing_row_names_its_time(record, tower):
    with pytest.raises(ValueError, match="missing at 2019-06-03 12:00"):
        towers.forcing(record.drop(pd.Timestamp("2019-06-03 12:00")), tower)


def test_repeated_row_is_refused(record, tower):
    with pytest.raises(ValueError, match="twice or out of order"):
        towers.forcing(pd.concat([record.iloc[:2], record.iloc[1:]]), tower)


def test_leap_day_is_left_out(tower):
    stamps = pd.date_range("2020-01-01", periods=366 * 48, freq="30min")
    columns = [column for column, _ in tower.forcing.values()]
    weather = towers.forcing(pd.DataFrame(1.0, index=stamps, columns=columns), tower)
    assert len(weather) == 365 * 48
    assert not ((weather.index.month == 2) & (weather.index.day == 29)).any()
