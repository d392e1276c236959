"""Process functions against values from the literature, limits, and cases worked out by hand."""

import importlib
import math
import re
from pathlib import Path
from statistics import NormalDist
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba.core.dispatcher import Dispatcher
from pytest import approx

import sim
import sim.canopy
import sim.carbon
import sim.demography
import sim.disturbance
import sim.evaporation
import sim.interception
import sim.management
import sim.mathematics
import sim.organic
import sim.permafrost
import sim.photosynthesis
import sim.radiation
import sim.response
import sim.snow
import sim.soil
import sim.structure
import sim.understorey
import sim.water
import sim.weather
import sim.wind
from sim.demography import AGES, OLDEST
from sim.jit import uncompiled


def plain(module):
    """The module's process functions as the interpreter runs them, which spares the tests their compilation."""
    return SimpleNamespace(**{k: uncompiled(v) if isinstance(v, Dispatcher) else v for k, v in vars(module).items()})


canopy, carbon, demography = map(plain, (sim.canopy, sim.carbon, sim.demography))
disturbance, evaporation, organic = map(plain, (sim.disturbance, sim.evaporation, sim.organic))
interception, management, mathematics = map(plain, (sim.interception, sim.management, sim.mathematics))
photosynthesis, radiation, response = map(plain, (sim.photosynthesis, sim.radiation, sim.response))
permafrost, snow, soil, structure = map(plain, (sim.permafrost, sim.snow, sim.soil, sim.structure))
understorey = plain(sim.understorey)
water, weather, wind = map(plain, (sim.water, sim.weather, sim.wind))

share = st.floats(0.0, 1.0)


def day_of_year(day):
    """Days are counted from 0."""
    return day - 1


# ------------------------------------------------------------------------------------------------ mathematics


@given(st.floats(-690.0, 690.0))
def test_exponential(x):
    assert mathematics.exponential(x) == approx(math.exp(x), rel=1e-15)


def test_exponential_beyond_its_range_is_its_limit():
    assert mathematics.exponential(-1e4) == mathematics.exponential(-700.0) < 1e-300
    assert mathematics.exponential(1e4) == mathematics.exponential(700.0) > 1e300


# ---------------------------------------------------------------------------------------------------- weather


@pytest.mark.parametrize(
    ("celsius", "hpa"), [(0.0, 6.11), (10.0, 12.27), (20.0, 23.37), (30.0, 42.43), (-10.0, 2.599), (-20.0, 1.032)]
)
def test_saturation_pressure_of_the_smithsonian_tables(celsius, hpa):
    assert weather.saturation_pressure(celsius) == approx(hpa, rel=3e-3)


def test_saturation_is_lower_over_ice_than_over_supercooled_water():
    assert weather.saturation_pressure_water(-10.0) == approx(2.863, rel=3e-3)
    for celsius in (-40.0, -20.0, -5.0):
        assert weather.saturation_pressure(celsius) < weather.saturation_pressure_water(celsius)


@pytest.mark.parametrize("celsius", [-40.0, -3.0, 4.0, 25.0])
def test_saturation_slope_is_the_derivative(celsius):
    step = 1e-4
    rise = weather.saturation_pressure(celsius + step) - weather.saturation_pressure(celsius - step)
    slope = weather.saturation_slope(celsius, weather.saturation_pressure(celsius))
    assert slope == approx(rise / (2.0 * step), rel=1e-6)


def test_saturation_slope_of_fao_56():
    assert weather.saturation_slope(20.0, weather.saturation_pressure(20.0)) == approx(1.447, rel=3e-3)


def test_sky_emissivity_of_prata():
    assert weather.sky_emissivity(15.0, 0.0, 0.0) == approx(1.0 - math.exp(-math.sqrt(1.2)))  # a dry sky: 0.666
    assert weather.sky_emissivity(15.0, 10.0, 0.0) == approx(0.776, abs=1e-3)
    assert weather.sky_emissivity(15.0, 10.0, 1.0) == 1.0
    assert weather.sky_emissivity(15.0, 10.0, 0.5) == approx(0.888, abs=1e-3)


@pytest.mark.parametrize(
    ("clearness", "diffuse"), [(0.0, 1.0), (0.22, 0.980), (0.5, 0.659), (0.7, 0.244), (0.85, 0.165)]
)
def test_diffuse_share_of_erbs(clearness, diffuse):
    assert weather.diffuse_share(clearness) == approx(diffuse, abs=2e-3)


@pytest.mark.parametrize(("day", "degrees"), [(172, 23.45), (355, -23.45), (81, 0.0), (265, 0.0)])
def test_declination_of_solstices_and_equinoxes(day, degrees):
    assert math.degrees(weather.solar_declination(day_of_year(day))) == approx(degrees, abs=1.1)


def test_the_sun_is_nearest_in_january():
    assert weather.solar_distance_factor(day_of_year(3)) == approx(1.033, abs=1e-3)
    assert weather.solar_distance_factor(day_of_year(184)) == approx(0.967, abs=1e-3)


def test_seasons_begin_with_their_months():
    starts = {1: 0, 60: 1, 152: 2, 244: 3, 335: 0}
    for day, expected in starts.items():
        assert weather.season(day_of_year(day)) == expected
    assert [weather.season(day_of_year(day)) for day in (59, 151, 243, 334)] == [0, 1, 2, 3]
    assert [weather.of_season(day, 10, 20, 30, 40) for day in (0, 100, 200, 300)] == [10, 20, 30, 40]


def test_the_year_is_warmest_on_the_warmest_day():
    warmest = 2.0 * math.pi * 194 / 365
    for day, expected in ((194, 14.0), (194 + 182.5, -30.0), (194 + 91.25, -8.0)):
        angle = 2.0 * math.pi * day / 365
        sun = math.cos(angle), math.sin(angle), math.cos(warmest), math.sin(warmest)
        assert weather.daily_mean_temperature(*sun, -8.0, 22.0, 0.0) == approx(expected)
        assert weather.daily_mean_temperature(*sun, -8.0, 22.0, -3.0) == approx(expected - 3.0)


@pytest.mark.parametrize(
    ("day", "celsius", "kind"),
    [
        (200, 15, 2),
        (150, -1, 2),
        (30, -20, 0),
        (30, 5, 0),
        (100, -1, 0),
        (100, 1, 1),
        (130, -1, 1),
        (280, -1, 0),
        (280, 1, 1),
        (340, 1, 0),
    ],
)
def test_precipitation_season(day, celsius, kind):
    windows = (150, 250, 90, 150, 250, 300, 120, 270)
    assert weather.precipitation_season(day, celsius, *windows) == kind


def test_daily_precipitation():
    assert weather.daily_precipitation(0.2, 1.0, 0.2, 10.0, 0.1, 0.0, 0.0) == 0.0
    assert weather.daily_precipitation(0.1, 0.5, 0.2, 10.0, 0.1, 0.0, 0.0) == approx(5.0)
    assert weather.daily_precipitation(0.1, 0.5, 0.2, 10.0, 0.1, -10.0, 0.0) == approx(5.0 / math.e)
    # Large anomalies: in a straight line, from none to twice as much, about what the season gives.
    for swing, factor in ((-20.0, 0.0), (-5.0, 0.5), (0.0, 1.0), (5.0, 1.5), (20.0, 2.0)):
        amount = weather.daily_precipitation(0.1, 0.5, 0.2, 10.0, 0.1, swing - 10.0, swing)
        assert amount == approx(5.0 / math.e * factor)


def test_oftener_wet_but_never_oftener_than_every_day():
    assert weather.wet_day_factor(0.1, 3.0) == 3.0
    assert weather.wet_day_factor(0.5, 3.0) == approx(2.0)
    assert weather.wet_day_factor(0.0, 3.0) == 3.0


def test_a_varying_wind_keeps_its_mean():
    shares = (np.arange(2000) + 0.5) / 2000
    speeds = np.array([wind.daily_wind(3.0, 0.38, NormalDist().inv_cdf(share)) for share in shares])
    assert speeds.mean() == approx(3.0, rel=1e-3)
    assert speeds.std() / speeds.mean() == approx(math.sqrt(math.exp(0.38**2) - 1.0), rel=0.01)
    assert wind.daily_wind(3.0, 0.0, 1.7) == 3.0


def test_rain_damps_the_diurnal_range():
    damping = (0.15, 1.0, 0.5, 1.2)
    assert weather.diurnal_amplitude(6.0, 0.0, *damping, 1.0) == 6.0
    assert weather.diurnal_amplitude(6.0, 3.0, *damping, 1.0) == approx(6.0 * 0.7)
    assert weather.diurnal_amplitude(6.0, 50.0, *damping, 1.0) == approx(3.0)
    assert weather.diurnal_amplitude(2.0, 50.0, *damping, 1.0) == approx(1.2)
    assert weather.diurnal_amplitude(6.0, 0.0, *damping, 0.25) == approx(1.5)


def test_snow_share():
    assert [weather.snow_share(t) for t in (-5.0, 0.0, 1.0, 2.0, 9.0)] == [1.0, 1.0, 0.5, 0.0, 0.0]


def test_drought_index():
    assert weather.drought_index(10.0, 15.0, 0.0, 0.0, 0.2) == approx(13.0)
    assert weather.drought_index(10.0, 15.0, 5.0, 0.0, 0.2) == approx(8.0)
    assert weather.drought_index(10.0, 15.0, 50.0, 0.0, 0.2) == 0.0
    assert weather.drought_index(10.0, -15.0, 0.0, 0.0, 0.2) == 10.0
    assert weather.drought_index(10.0, 15.0, 0.0, 0.1, 0.2) == 0.0


# -------------------------------------------------------------------------------------------------- radiation


def test_path_through_the_canopy():
    assert radiation.path_length(1.0, 0.65, 6.0) == 1.0
    assert radiation.path_length(0.325, 0.65, 6.0) == approx(2.0)
    assert radiation.path_length(0.01, 0.65, 6.0) == radiation.path_length(0.0, 0.65, 6.0) == 6.0


def test_beer_lambert_limits():
    assert radiation.canopy_interception(1.0, 0.0, 0.5, 2.0, 2.0) == (0.0, 0.0)
    closed = radiation.canopy_interception(1.5, 1e3, 1.0, 0.6 * 4.0, 9.9)
    assert closed == approx((1.0 - math.exp(-0.6 * 4.0 * 1.5), 0.0))
    opaque = radiation.canopy_interception(2.0, 0.7, 0.25, 1e3, 1e3)
    assert opaque == approx((0.25 * (1.0 - math.exp(-1.4)), 0.75 * (1.0 - math.exp(-1.4))))


@given(st.floats(1.0, 20.0), st.floats(0.0, 20.0), share, st.floats(0.0, 20.0), st.floats(0.0, 20.0))
def test_no_more_light_is_intercepted_than_comes(path, crowns, conifers, first, second):
    one, other = radiation.canopy_interception(path, crowns, conifers, first, second)
    assert one >= 0.0 and other >= 0.0 and one + other <= 1.0


@given(st.floats(0.0, 1400.0), share, share, share, share, share, share, share, st.floats(0.0, 0.95))
def test_shortwave_closes(incoming, diffuse, beam, beam_conifer, sky, sky_conifer, conifer, deciduous, ground):
    intercepted = (beam * beam_conifer, beam * (1.0 - beam_conifer), sky * sky_conifer, sky * (1.0 - sky_conifer))
    absorbed, below, reflected, *caught = radiation.shortwave(
        incoming, diffuse, *intercepted, conifer, deciduous, ground
    )
    assert absorbed + below + reflected == approx(incoming, rel=1e-14, abs=1e-12)
    assert min(absorbed, below, reflected, *caught) >= -1e-12 * incoming
    assert sum(caught) == approx(incoming * ((1.0 - diffuse) * beam + diffuse * sky), rel=1e-12, abs=1e-12)


def test_shortwave_limits():
    bare = radiation.shortwave(100.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.8)
    assert bare == approx((0.0, 20.0, 80.0, 0.0, 0.0))
    closed = radiation.shortwave(100.0, 0.3, 1.0, 0.0, 1.0, 0.0, 0.1, 0.2, 0.8)
    assert closed == approx((90.0, 0.0, 10.0, 100.0, 0.0))
    # A canopy with gaps over snow, light going up and down: of 40 up, .5 leave by gaps, .45 are absorbed, .05 return.
    half = radiation.shortwave(100.0, 1.0, 0.5, 0.0, 0.5, 0.0, 0.1, 0.2, 0.8)
    series = sum(50.0 * (0.8 * 0.05) ** n for n in range(30))
    assert half == approx((45.0 + 0.8 * 0.45 * series, 0.2 * series, 5.0 + 0.8 * 0.5 * series, 50.0, 0.0))


def test_black_body():
    assert radiation.black_body(273.15) == approx(315.66, abs=0.05)
    step = 1e-3
    rise = (radiation.black_body(280.0 + step) - radiation.black_body(280.0 - step)) / (2.0 * step)
    assert radiation.black_body_slope(280.0) == approx(rise, rel=1e-8)


@given(share, st.floats(0.9, 1.0))
def test_longwave_of_an_isothermal_world_cancels(cover, emissivity):
    emission = radiation.black_body(270.0)
    down = radiation.longwave_down(emission, emission, cover)
    assert down == approx(emission)
    assert radiation.longwave_up(emission, down, emissivity) == approx(emission)


def test_longwave_limits():
    assert radiation.longwave_down(200.0, 300.0, 0.0) == 200.0
    assert radiation.longwave_down(200.0, 300.0, 1.0) == 300.0
    assert radiation.longwave_up(300.0, 200.0, 1.0) == 300.0
    assert radiation.longwave_up(300.0, 200.0, 0.98) == approx(298.0)


# ------------------------------------------------------------------------------------------------------- snow


@pytest.mark.parametrize(("density", "expected"), [(100.0, 0.0464), (217.0, 0.0711), (300.0, 0.1260), (400.0, 0.2513)])
def test_snow_conductivity_of_sturm(density, expected):
    assert snow.conductivity(density) == approx(expected, abs=1e-4)


def test_density_of_fresh_snow():
    pahaut = (109.0, 6.0, 26.0, 50.0)
    assert snow.fresh_density(0.0, 0.0, *pahaut) == 109.0
    assert snow.fresh_density(-5.0, 4.0, *pahaut) == approx(109.0 - 30.0 + 52.0)
    assert snow.fresh_density(-30.0, 1.0, *pahaut) == 50.0


def test_depths_of_old_and_fresh_snow_add_up():
    density = snow.mixed_density(60.0, 240.0, 5.0, 50.0)
    assert 65.0 / density == approx(60.0 / 240.0 + 5.0 / 50.0)
    assert snow.mixed_density(0.0, 240.0, 5.0, 50.0) == approx(50.0)
    assert snow.mixed_density(0.0, 240.0, 0.0, 50.0) == 240.0


ANDERSON = (3.7e7, 0.081, 0.018, 2.8e-6, 0.042, 0.046, 150.0)


def test_snow_settles_under_weight_warmth_and_less_when_dense():
    def gain(swe=60.0, density=150.0, celsius=-8.0):
        return snow.settling(swe, density, celsius, *ANDERSON)

    assert gain(swe=0.0) == approx(2.8e-6 * math.exp(-0.042 * 8.0))
    assert gain(swe=0.0, density=250.0) == approx(gain(swe=0.0) * math.exp(-4.6))
    assert gain(swe=120.0) - gain(swe=60.0) == approx(gain(swe=60.0) - gain(swe=0.0))
    assert gain(celsius=0.0) > gain(celsius=-8.0) > gain(density=250.0)


def test_a_taiga_snowpack_is_as_dense_as_measured():
    """60 mm in five months at -8 degC: Sturm et al. (2010) have 217 kg m-3 for the taiga, standard deviation 56."""
    density, swe = 60.0, 0.0
    for _ in range(150):
        density = snow.mixed_density(swe, density, 0.4, 60.0)
        swe += 0.4
        density *= 1.0 + 86400.0 * snow.settling(swe, density, -8.0, *ANDERSON)
    assert 160.0 < density < 275.0


ALBEDO = (0.85, 0.7, 0.5, 1000.0, 100.0, 10.0, 1800.0)  # fresh, cold, old, hours cold and melting, refreshing, step


@given(st.floats(0.5, 0.85), st.floats(-40.0, 0.0), st.floats(0.0, 50.0))
def test_snow_albedo_stays_between_old_and_fresh(albedo, celsius, snowfall):
    assert 0.5 - 1e-12 <= snow.snow_albedo(albedo, celsius, snowfall, *ALBEDO) <= 0.85 + 1e-12


def test_snow_albedo_ages_to_old_and_is_renewed_by_snowfall():
    cold = melting = 0.85
    for _ in range(2 * 100):  # 100 hours
        cold = snow.snow_albedo(cold, -5.0, 0.0, *ALBEDO)
        melting = snow.snow_albedo(melting, 0.0, 0.0, *ALBEDO)
    assert melting == approx(0.5 + 0.35 * math.exp(-1.0), abs=1e-3)
    assert cold == approx(0.7 + 0.15 * math.exp(-0.1), abs=1e-3)
    assert snow.snow_albedo(0.6, -5.0, 0.0, *ALBEDO) == approx(0.6)  # frost does not brighten what has melted
    assert snow.snow_albedo(0.5, -5.0, 10.0, *ALBEDO) == approx(0.675, abs=1e-3)
    assert snow.snow_albedo(0.5, -5.0, 1e6, *ALBEDO) == approx(0.85, abs=1e-3)


def test_snow_hides_the_ground():
    per_mm = 1.0 / (250.0 * 0.1)  # hidden from 10 cm on
    assert snow.surface_albedo(0.0, per_mm, 0.8, 0.2) == approx(0.2)
    assert snow.surface_albedo(12.5, per_mm, 0.8, 0.2) == approx(0.5)  # 12.5 mm of water in 5 cm of snow
    assert snow.surface_albedo(25.0, per_mm, 0.8, 0.2) == snow.surface_albedo(90.0, per_mm, 0.8, 0.2) == approx(0.8)


def test_ground_profile():
    exchange, share = wind.ground_profile(10.0, 2.0, 0.001, 0.1)
    assert exchange == approx(0.16 / (math.log(10.0 / 0.001) * math.log(2.0 / 0.0001)))
    assert share == approx(math.log(2.0 / 0.001) / math.log(10.0 / 0.001))


@given(st.floats(1e-300, 1e6))
def test_two_thirds_power(x):
    assert mathematics.two_thirds_power(np.float64(x)) == approx(x ** (2.0 / 3.0), rel=2e-15)


def test_two_thirds_power_of_nothing():
    assert mathematics.two_thirds_power(np.float64(0.0)) == 0.0


def test_stability():
    assert wind.stability(-5.0, -5.0, 2.0, 2.0, 10.0, 3.0) == 1.0
    richardson = 9.81 * 2.0 * 5.0 / (273.15 * 4.0)
    assert wind.stability(-5.0, 0.0, 2.0, 2.0, 10.0, 3.0) == approx(1.0 / (1.0 + 10.0 * richardson))
    assert wind.stability(5.0, 0.0, 2.0, 2.0, 10.0, 3.0) == approx(math.sqrt(1.0 + 10.0 * richardson))
    assert wind.stability(40.0, 0.0, 0.3, 2.0, 10.0, 3.0) == 3.0


# ------------------------------------------------------------------------------------------------------- soil

NODE = (1.15e6, 0.85e6, 4.342e7, 1.0)  # 0.5 m of soil: capacities thawed and frozen, latent heat, freezing range


@given(st.floats(-60.0, 40.0))
def test_temperature_inverts_enthalpy(celsius):
    assert soil.temperature(soil.enthalpy(celsius, *NODE), *NODE) == approx(celsius, rel=1e-12, abs=1e-12)


@given(st.floats(-2e8, 1e8))
def test_enthalpy_inverts_temperature(heat):
    assert soil.enthalpy(soil.temperature(heat, *NODE), *NODE) == approx(heat, rel=1e-12, abs=1e-5)


def test_freezing_takes_the_latent_heat():
    assert soil.enthalpy(0.0, *NODE) == 0.0
    assert soil.enthalpy(1.0, *NODE) == approx(1.15e6)
    assert soil.enthalpy(-1.0, *NODE) == approx(-(4.342e7 + 0.85e6))
    assert soil.enthalpy(-3.0, *NODE) - soil.enthalpy(-2.0, *NODE) == approx(-0.85e6)
    assert soil.temperature(-0.5 * (4.342e7 + 0.85e6), *NODE) == approx(-0.5)


@pytest.mark.parametrize("celsius", [-7.0, -0.4, 3.0])
def test_soil_heat_capacity_is_the_slope_of_enthalpy(celsius):
    step = 1e-4
    rise = soil.enthalpy(celsius + step, *NODE) - soil.enthalpy(celsius - step, *NODE)
    assert soil.heat_capacity(celsius, *NODE) == approx(rise / (2.0 * step), rel=1e-6)


def test_frozen_share_and_conductivity():
    assert [soil.frozen_share(t, 2.0) for t in (3.0, 0.0, -0.5, -2.0, -9.0)] == [0.0, 0.0, 0.25, 1.0, 1.0]
    assert soil.conductivity(0.0, 1.0, 1.4) == 1.0
    assert soil.conductivity(0.5, 1.0, 1.4) == approx(1.2)


def test_organic_layer_grows_slowly_and_decays_when_its_canopy_is_gone():
    depths = (0.165, 0.075, 0.08, 0.002, 15.0)
    assert organic.organic_growth(0.165, 1.0, 0.0, *depths) == approx(0.165)
    assert organic.organic_growth(0.05, 1.0, 0.0, *depths) == approx(0.052)
    assert organic.organic_growth(0.1645, 1.0, 0.0, *depths) == approx(0.165)
    assert organic.organic_growth(0.165, 0.0, 0.0, *depths) == approx(0.165 - 0.085 / 15.0)
    assert organic.organic_growth(0.12, 0.5, 0.5, *depths) == approx(0.12)


def test_thaw_depth_of_stefan():
    latent, warmth, days = 86.8e6, 8.0 * 86400.0 * 120, 86400.0 * 120
    rest = (-3.0, 2.5, 12.0, 1.2, 1.7)  # boundary, deep node, boundary's depth, conductivities

    def thaw(organic, ice, warmth, deep, *capacities, rest=rest, seconds=days):
        return permafrost.thaw_depth(organic, ice, 0.2, warmth, seconds, deep, *rest, *capacities, latent)

    # Without moss, cold soil or heat capacity: sqrt(2 k T t / L).
    assert thaw(0.0, 0.0, warmth, 0.0, 0.0, 0.0) == approx(math.sqrt(2.4 * warmth / latent), rel=1e-12)
    # What goes in is what melts, warms and goes on: k T t = (above + X / 2) (heat X + cold).
    depth = thaw(0.1, 0.0, warmth, -2.0, 2.3e6, 1.7e6) - 0.1
    heat, cold = latent + 2.3e6 * 2.0, 4.0 * math.sqrt(1.7 * 1.7e6 * days / math.pi)
    assert (0.1 * 1.2 / 0.2 + 0.5 * depth) * (heat * depth + cold) == approx(1.2 * warmth, rel=1e-12)
    assert 0.8 < depth < 1.0
    # Ice of the organic layer melts first, by Stefan's formula; what is left of the season thaws the soil.
    ice, enough = 20e6, 0.5 * 20e6 * 0.1 / 0.2
    assert thaw(0.1, ice, 0.25 * enough, -2.0, 2.3e6, 1.7e6) == approx(0.05)
    assert thaw(0.1, ice, enough, -2.0, 2.3e6, 1.7e6) == approx(0.1)
    later = thaw(0.1, 0.0, warmth - enough, -2.0, 2.3e6, 1.7e6, seconds=days * (1.0 - enough / warmth))
    assert thaw(0.1, ice, warmth, -2.0, 2.3e6, 1.7e6) == approx(later)
    assert thaw(0.1, ice, 0.0, -2.0, 2.3e6, 1.7e6, seconds=0.0) == 0.0
    # A deep node that is thawed: permafrost begins on the line from it to the boundary.
    assert thaw(0.1, ice, warmth, 1.0, 2.3e6, 1.7e6) == approx(0.1 + 2.5 + 9.5 / 4.0)
    assert thaw(0.1, ice, warmth, 1.0, 2.3e6, 1.7e6, rest=(2.0, *rest[1:])) == approx(12.1)


def test_organic_soil_conducts_by_what_fills_its_pores():
    assert organic.wet_conductivity(0.0, 0.05, 0.54) == 0.05
    assert organic.wet_conductivity(0.4, 0.05, 0.54) == approx(0.246)
    assert organic.wet_conductivity(1.3, 0.05, 0.54) == 0.54


def test_what_the_organic_layer_does_not_hold_drains_unless_it_is_ice():
    assert organic.drained(30.0, 0.0, 45.0) == 0.0
    assert organic.drained(60.0, 0.0, 45.0) == approx(15.0)
    assert organic.drained(60.0, 0.9, 45.0) == approx(6.0)
    assert organic.drained(60.0, 1.0, 45.0) == 0.0


def test_melt_that_seeps_into_a_frozen_layer_freezes_and_warms_it():
    """Its enthalpy stays, its water grows: so its temperature rises by the heat of fusion."""
    layer = (1.0, 0.15, 1.75e5)
    cold = soil.enthalpy(-8.0, *organic.layer_capacities(*layer, 40.0), 1.0)
    warmed = soil.temperature(cold, *organic.layer_capacities(*layer, 42.0), 1.0)
    capacity = 1.75e5 * 0.15 + 2100.0 * 41.0
    assert warmed + 8.0 == approx(2.0 * 3.34e5 / capacity, rel=0.1)


def test_moss_gives_vapour_as_air_and_wetness_let_it():
    assert evaporation.moss_conductance(0.01, 0.0, 300.0) == 0.0
    assert evaporation.moss_conductance(0.01, 1.0, 300.0) == approx(1.0 / (100.0 + 300.0))
    assert evaporation.moss_conductance(0.01, 0.5, 300.0) == approx(1.0 / (100.0 + 1200.0))


def test_upper_ground_by_hand():
    assert permafrost.upper_temperature(-1.0, -4.0, 1.0) == approx(-3.0)
    profile = (2.0, -1.0, -4.0, -2.0, 1.0, 2.5, 12.0)  # top, surface, deep, boundary; their depths
    for depth, expected in ((-0.1, 2.0), (0.0, 2.0), (0.25, 0.5), (0.5, -1.0), (1.5, -2.5), (2.5, -4.0), (7.25, -3.0)):
        assert permafrost.temperature_at(depth, *profile) == approx(expected)
    assert permafrost.temperature_at(12.0, *profile) == permafrost.temperature_at(40.0, *profile) == approx(-2.0)


def test_nodes_answer_to_the_canopy_as_their_implicit_balances_say():
    """The elimination from the bottom up against a general solver of the same five equations."""
    generator = np.random.default_rng(0)
    for _ in range(20):
        (trunk, ground, moss, surface, deep, air, boundary, canopy_now) = generator.uniform(-20.0, 20.0, 8)
        (trunk_inertia, ground_inertia, moss_inertia, surface_inertia, deep_inertia) = generator.uniform(1.0, 900.0, 5)
        (canopy_trunk, trunk_air, trunk_ground, ground_air, vapour, ground_moss, moss_surface, surface_deep, below) = (
            generator.uniform(0.0, 30.0, 9)
        )
        source, emission, slope, emissivity, cover = *generator.uniform(0.0, 400.0, 2), 4.6, 0.97, generator.random()
        canopy_emission = generator.uniform(200.0, 400.0)
        (
            deep_base,
            deep_by_surface,
            surface_base,
            surface_by_moss,
            moss_base,
            moss_by_ground,
            trunk_base,
            trunk_by_canopy,
            trunk_by_ground,
            ground_base,
            ground_by_emission,
            ground_by_canopy,
            stiffness,
            yielding,
        ) = response.respond_to_canopy(
            trunk,
            trunk_inertia,
            canopy_trunk,
            trunk_air,
            trunk_ground,
            ground,
            ground_inertia,
            ground_air,
            source,
            emission,
            slope,
            vapour,
            emissivity,
            cover,
            air,
            moss,
            moss_inertia,
            ground_moss,
            surface,
            surface_inertia,
            moss_surface,
            deep,
            deep_inertia,
            surface_deep,
            below,
            boundary,
        )
        new_ground = ground_base + ground_by_emission * canopy_emission + ground_by_canopy * canopy_now
        new_moss = moss_base + moss_by_ground * new_ground
        new_surface = surface_base + surface_by_moss * new_moss
        new = [
            trunk_base + trunk_by_canopy * canopy_now + trunk_by_ground * new_ground,
            new_ground,
            new_moss,
            new_surface,
            deep_base + deep_by_surface * new_surface,
        ]
        # Inertia x change = heat in - heat out, for trunk, ground, organic layer, surface and deep soil.
        matrix = np.array(
            [
                [trunk_inertia + canopy_trunk + trunk_air + trunk_ground, -trunk_ground, 0.0, 0.0, 0.0],
                [
                    -trunk_ground,
                    ground_inertia + emissivity * slope + ground_air + vapour + trunk_ground + ground_moss,
                    -ground_moss,
                    0.0,
                    0.0,
                ],
                [0.0, -ground_moss, moss_inertia + ground_moss + moss_surface, -moss_surface, 0.0],
                [0.0, 0.0, -moss_surface, surface_inertia + moss_surface + surface_deep, -surface_deep],
                [0.0, 0.0, 0.0, -surface_deep, deep_inertia + surface_deep + below],
            ]
        )
        right = [
            trunk_inertia * trunk + canopy_trunk * canopy_now + trunk_air * air,
            ground_inertia * ground
            + source
            + emissivity * (cover * canopy_emission - emission + slope * ground)
            + ground_air * air
            + vapour * ground,
            moss_inertia * moss,
            surface_inertia * surface,
            deep_inertia * deep + below * boundary,
        ]
        np.testing.assert_allclose(new, np.linalg.solve(matrix, right), rtol=1e-9, atol=1e-9)
        assert yielding == 1.0 / stiffness
        assert yielding == approx(np.linalg.inv(matrix)[1, 1])  # warming of the ground per W m-2 into it


# ----------------------------------------------------------------------------------------------------- canopy


def test_crowns_grow_along_straight_lines():
    factors = (0.1, 0.5, 0.9, 1.0, 0.8)
    known = {0: 0.0, 3: 0.1, 8: 0.3, 13: 0.5, 30: 0.9, 50: 0.95, 70: 1.0, 101: 0.8}
    for age, expected in known.items():
        assert structure.crown_factor(age, *factors) == approx(expected)


def test_leaves_come_and_go():
    leaf = [structure.leaf_out(day_of_year(day), 140.0, 0.12, 270.0, 0.12) for day in range(1, 366)]
    assert leaf[139] == approx(0.5, abs=1e-6) and leaf[269] == approx(0.5, abs=1e-6)
    assert leaf[204] > 0.99 and max(leaf[:60]) < 1e-3 and max(leaf[340:]) < 1e-3
    assert leaf[139 + 10] == approx(1.0 / (1.0 + math.exp(-1.2)), abs=1e-5)


def test_aerodynamic_conductance():
    log = math.log(10.0 / 1.5 + 1.0)
    assert wind.aerodynamic_conductance(3.0, 1.5, 10.0, 2.0) == approx(0.4**2 * 3.0 / (log * (log + 2.0)))
    assert wind.aerodynamic_conductance(0.0, 1.5, 10.0, 2.0) == 0.0


@pytest.mark.parametrize("melt_span", [0.0, 2.0, 1e3], ids=["no snow", "melts out", "deep snow"])
@pytest.mark.parametrize("trial", [-15.0, 2.0, 18.0])
def test_slope_of_the_canopy_balance_is_its_derivative(trial, melt_span):
    def balance(t):
        return canopy.canopy_balance(
            t,
            12.0,
            250.0,
            280.0,
            0.7,
            0.98,
            1.0,
            melt_span,
            1.3,
            1.5,
            0.01,
            0.05,
            0.4,
            0.3,
            0.2,
            1.4,
            6.0,
            25.0,
            0.4,
            0.1,
            8.0,
        )

    step = 1e-4
    residual, slope, by_emission, net, _ = balance(trial)
    assert slope == approx((balance(trial + step)[0] - balance(trial - step)[0]) / (2.0 * step), rel=1e-6)
    assert slope < 0.0 < net
    bend = (balance(trial + step)[1] - balance(trial - step)[1]) / (2.0 * step)
    assert by_emission * 12.0 * 5.670374419e-8 * (trial + 273.15) ** 2 == approx(bend, rel=1e-6)


def test_melting_snow_holds_the_ground_at_zero_until_it_is_gone():
    def ground(base, melt_span, bare_gain):
        return canopy.canopy_balance(
            2.0,
            0.0,
            250.0,
            280.0,
            0.7,
            0.98,
            0.0,
            melt_span,
            bare_gain,
            base,
            0.0,
            0.0,
            0.4,
            0.3,
            0.2,
            1.4,
            6.0,
            25.0,
            0.4,
            0.1,
            8.0,
        )[4]

    assert [ground(base, 3.0, 1.5) for base in (-4.0, 0.0, 2.0, 3.0, 5.0)] == [-4.0, 0.0, 0.0, 0.0, 3.0]
    assert [ground(base, 0.0, 1.0) for base in (-4.0, 0.0, 5.0)] == [-4.0, 0.0, 5.0]


def test_newton_takes_the_middle_where_its_step_leaves_the_bracket():
    assert canopy.newton_step(1.0, 4.0, -2.0, 0.0, -100.0, 100.0) == (3.0, 1.0, 100.0)
    assert canopy.newton_step(1.0, -4.0, -2.0, 0.0, -100.0, 100.0) == (-1.0, -100.0, 1.0)
    assert canopy.newton_step(1.0, 4.0, -0.001, 0.0, -100.0, 100.0) == (50.5, 1.0, 100.0)


def test_newton_knows_the_curvature_of_the_emission():
    """Where the residual is a line and an emission, one step leaves an error of its fourth power."""
    emission, root = radiation.black_body, 3.0

    def missed(trial):
        residual = 20.0 * (root - trial) + 1.5 * (emission(root + 273.15) - emission(trial + 273.15))
        slope = -20.0 - 1.5 * radiation.black_body_slope(trial + 273.15)
        return abs(canopy.newton_step(trial, residual, slope, -1.5, -100.0, 100.0)[0] - root)

    assert missed(2.0) < 1e-8
    assert missed(1.0) == approx(16.0 * missed(2.0), rel=0.1)


# ----------------------------------------------------------------------------------------------------- carbon


def preles_gpp(photons, absorbed, deficit_kpa, acclimation):
    """A day of PRELES as published, gC m-2, with the parameters of Minunno et al. (2016) in 380 ppm."""
    season = min(max(acclimation + 3.063, 0.0) / 17.72, 1.0)
    return 0.7457 * photons * absorbed * season * math.exp(-0.1027 * deficit_kpa) / (0.03673 * photons + 1.0)


@pytest.mark.parametrize("celsius", [-8.0, 2.0, 14.0])
def test_a_day_of_photosynthesis_is_that_of_preles(celsius):
    """The steps of a day add up to what PRELES has for it, whatever the course of the light."""
    light = np.maximum(np.sin(np.linspace(-1.0, 4.0, 48)), 0.0) * 600.0
    rows = np.tile([celsius, 0.6, 2.0, 0.0, 300.0, 0.0], (48, 1))
    rows[:, 3] = light
    constants = {name: [constant.low] for name, constant in sim.CONSTANTS.items()} | {"co2_ppm": [380.0]}
    state = SimpleNamespace(swe=[0.0], acclimation=[celsius])
    work = {"mean_temperature": [celsius], "water_stress": [1.0], "leaf_conifer": [0.9], "leaf_deciduous": [0.9]}
    work |= {f"light_use_{species}": constants[f"light_use_{species}"] for species in ("conifer", "deciduous")}
    answers = "co2_growth co2_stomata ready_conifer ready_deciduous dry_air_conifer dry_air_deciduous gpp_conifer"
    answers += " efficiency_conifer efficiency_deciduous efficiency_understorey gpp_deciduous photons mean_deficit"
    work |= {name: [0.0] for name in answers.split()}
    b = SimpleNamespace(p=SimpleNamespace(**constants), s=state, w=SimpleNamespace(**work))
    photosynthesis.carbon_dioxide(b, 0)
    photosynthesis.light_use(b, np.zeros((48, 2)), rows[:, :, None])
    gross = 0.0
    for shortwave in light:
        photosynthesis.assimilate(b, 0, 0.8 * shortwave, 0.0)
        gross += 1800.0 * b.w.gpp_conifer[0]
    photons = 4.57e-6 * 0.45 * 1800.0 * light.sum()
    deficit = 0.1 * (weather.saturation_pressure(celsius) - 0.6 * weather.saturation_pressure_water(celsius))
    assert 1000.0 * gross == approx(preles_gpp(photons, 0.8 * 0.9, max(deficit, 0.0), celsius), rel=1e-12)


def test_light_use_of_a_day():
    assert [photosynthesis.readiness(v, -3.0, 18.0) for v in (-20.0, -3.0, 6.0, 15.0, 20.0)] == [0, 0, 0.5, 1, 1]
    assert photosynthesis.light_saturation(0.0, 0.04) == 1.0
    assert photosynthesis.light_saturation(25.0, 0.04) == approx(0.5)
    assert photosynthesis.dry_air(10.0, 0.1) == approx(math.exp(-0.1))
    assert photosynthesis.co2_response(380.0, 0.5) == 1.0
    assert photosynthesis.co2_response(760.0, 0.5) == approx(1.0 + 0.5 * math.log(2.0))
    state = 0.0
    for _ in range(1000):
        state = photosynthesis.acclimated(state, 12.0, 10.93)
    assert state == approx(12.0)
    assert photosynthesis.acclimated(0.0, 10.93, 10.93) == approx(1.0)


def test_the_understorey_is_buried_by_snow():
    assert [understorey.above_snow(depth, 0.25) for depth in (0.0, 0.125, 0.25, 1.0)] == [1.0, 0.5, 0.0, 0.0]
    assert understorey.absorbed_share(0.0, 0.6, 1.2) == 0.0
    assert understorey.absorbed_share(1.0, 0.6, 1.2) == approx(1.0 - math.exp(-0.72))


def test_leaves_hide_the_wood():
    assert structure.leaf_share(2.4, 1.0, 1.0) == 1.0
    assert structure.leaf_share(2.4, 0.0, 1.0) == 0.0
    assert structure.leaf_share(0.0, 0.9, 1.0) == 0.0
    assert structure.leaf_share(1e-6, 0.8, 1.0) == approx(0.8, rel=1e-5)  # thin crowns: as their areas are
    assert 0.95 < structure.leaf_share(3.0, 0.8, 1.0) < 1.0


def test_q10():
    assert carbon.q10_factor(10.0, 10.0, math.log(2.0)) == approx(1.0)
    assert carbon.q10_factor(20.0, 10.0, math.log(2.0)) == approx(2.0)
    assert carbon.q10_factor(-10.0, 10.0, math.log(2.0)) == approx(0.25)


def test_maintenance_of_the_reference_stand_is_its_base_rate():
    leaf, wood = carbon.maintenance_rates(0.35, 0.9, 4.0, 5.0)
    assert 365.0 * 86400.0 * (4.0 * leaf + 5.0 * wood) == approx(0.35)
    assert 365.0 * 86400.0 * 5.0 * wood == approx(0.035)


def test_autotrophic_respiration_costs_growth_and_never_more_than_there_is():
    assert carbon.autotrophic(10.0, 4.0, 0.2, 100.0, 1.0) == approx(4.0 + 0.2 * 6.0)
    assert carbon.autotrophic(0.0, 4.0, 0.2, 100.0, 1.0) == approx(4.0)
    assert carbon.autotrophic(1.0, 4.0, 0.2, 0.5, 1.0) == approx(1.5)


@pytest.mark.parametrize("fall", [210.0, 270.0, 310.0, 360.0])
def test_litter_of_all_days_is_the_years(fall):
    shares = [carbon.litter_share(day, fall, 45.0, 0.75) for day in range(365)]
    assert sum(shares) == approx(1.0)
    assert sum(s for s in shares if s > 1.0 / 365.0) == approx(0.75)


# ----------------------------------------------------------------------------------------------- interception


def test_snow_capacity():
    assert interception.snow_capacity(0.0, 4.0, 4.4, 6.0) == approx(17.6)
    assert interception.snow_capacity(-5.5, 4.0, 4.4, 6.0) == approx(20.8)
    assert interception.snow_capacity(-30.0, 4.0, 4.4, 6.0) == approx(24.0)


@given(st.floats(0.0, 50.0), st.floats(0.0, 30.0), st.floats(0.0, 30.0, allow_subnormal=False), share)
def test_no_more_is_intercepted_than_falls_and_fits(fall, store, capacity, efficiency):
    per_capacity = 1.0 / capacity if capacity > 0.0 else 0.0
    held = interception.intercepted(fall, store, capacity, per_capacity, efficiency)
    assert 0.0 <= held <= fall
    assert held <= max(capacity - store, 0.0) + 1e-12


def test_interception_shrinks_as_the_canopy_fills():
    assert interception.intercepted(1.0, 0.0, 10.0, 0.1, 0.6) == approx(0.6)
    assert interception.intercepted(1.0, 5.0, 10.0, 0.1, 0.6) == approx(0.3)
    assert interception.intercepted(1.0, 10.0, 10.0, 0.1, 0.6) == 0.0
    assert interception.intercepted(1.0, 0.0, 0.0, 0.0, 0.6) == 0.0


def test_sublimation_of_intercepted_snow():
    penman = (3.0 * 50.0 + 20.0 * 1.0) / (3.0 + 0.65)
    mm = interception.snow_sublimation(5.0, 0.1, 0.6, 50.0, 20.0, 1.0, 3.0, 0.65, 2.834e6, 1800.0)
    assert mm == approx(0.6 * 0.5 ** (2.0 / 3.0) * penman / 2.834e6 * 1800.0)
    assert interception.snow_sublimation(1e-5, 1e5, 0.6, 50.0, 20.0, 1.0, 3.0, 0.65, 2.834e6, 1800.0) == 1e-5
    assert interception.snow_sublimation(5.0, 0.1, 0.6, -50.0, 20.0, -1.0, 3.0, 0.65, 2.834e6, 1800.0) == 0.0
    assert interception.snow_sublimation(0.0, 0.0, 0.6, 50.0, 20.0, 1.0, 3.0, 0.65, 2.834e6, 1800.0) == 0.0


def test_melt_and_unloading_of_intercepted_snow():
    assert interception.snow_melt(5.0, 0.1, -2.0, 20.0, 3.34e5, 1800.0) == 0.0
    assert interception.snow_melt(5.0, 0.1, 2.0, 20.0, 3.34e5, 1800.0) == approx(0.5 * 40.0 / 3.34e5 * 1800.0)
    assert interception.snow_melt(1e-6, 0.1, 9.0, 20.0, 3.34e5, 1800.0) == 1e-6
    slowly = 1.0 / (240.0 * 3600.0)
    assert interception.unloaded(2.4, 10.0, 0.0, slowly, 0.4, 3600.0) == approx(0.01)
    assert interception.unloaded(2.4, 10.0, 1.0, slowly, 0.4, 3600.0) == approx(0.41)
    assert interception.unloaded(12.0, 10.0, 0.0, slowly, 0.4, 3600.0) == approx(2.0)
    assert interception.unloaded(1.0, 10.0, 9.0, slowly, 0.4, 3600.0) == 1.0


def test_soil_bucket():
    ramp = 50.0 + water.LARGEST_EVAPORATION * 1800.0
    stresses = [water.water_stress(share * ramp, 100.0, 0.5, 1800.0) for share in (0.0, 0.5, 1.0, 1.5)]
    assert stresses == approx([0.0, 0.5, 1.0, 1.0])
    assert water.runoff(90.0, 100.0) == 0.0 and water.runoff(130.0, 100.0) == 30.0


@given(st.floats(0.0, 500.0), st.floats(20.0, 500.0), st.floats(0.05, 1.0), st.sampled_from([600.0, 1800.0, 7200.0]))
def test_no_step_evaporates_more_than_there_is(held, capacity, threshold, seconds):
    largest = water.LARGEST_EVAPORATION * seconds
    assert water.water_stress(held, capacity, threshold, seconds) * largest <= held


# ------------------------------------------------------------------------------------------------- demography


def stems(**by_age):
    """One lane of stems, from keywords such as age30=100."""
    array = np.zeros((AGES, 1))
    for name, number in by_age.items():
        array[int(name.removeprefix("age")), 0] = number
    return array


def test_stems_grow_older_and_the_oldest_are_pooled():
    trees = stems(age0=5.0, age5=10.0, age20=20.0, age100=7.0, age101=3.0)
    demography.grow_older(trees, 0)
    np.testing.assert_array_equal(trees, stems(age1=5.0, age6=10.0, age21=20.0, age101=10.0))


def test_a_planted_tree_is_young_after_21_years_and_old_after_101():
    trees = stems(age0=100.0)
    for years in range(1, 111):
        demography.grow_older(trees, 0)
        assert demography.count(trees, 0, 21, OLDEST) == (100.0 if years >= 21 else 0.0)
        assert demography.count(trees, 0, 101, OLDEST) == (100.0 if years >= 101 else 0.0)


def test_count_includes_both_ends():
    assert demography.count(stems(age5=1.0, age6=2.0, age20=4.0, age21=8.0), 0, 6, 20) == 6.0


def test_trees_grow_toward_their_full_height():
    heights = [demography.relative_height(age, 0.0215, 1.2243) for age in range(0, 400, 10)]
    assert heights[0] == 0.0 and np.all(np.diff(heights) > 0.0) and 0.99 < heights[-1] < 1.0
    assert demography.relative_height(50.0, 0.02, 1.0) == approx(1.0 - math.exp(-1.0))
    assert demography.stem_weight(50, 0.02, 1.0, 2.0) == approx((1.0 - math.exp(-1.0)) ** 2)


def test_self_thinning_and_recruitment():
    assert demography.self_thinning(1000.0, 2000.0, 0.8, 0.035) == 0.0
    assert demography.self_thinning(1800.0, 2000.0, 0.8, 0.035) == approx(0.0175)
    assert demography.self_thinning(2000.0, 2000.0, 0.8, 0.035) == approx(0.035)
    assert demography.recruits(0.0, 0.0, 2000.0, 0.01, 4.0) == approx(80.0)
    assert demography.recruits(500.0, 0.75, 2000.0, 0.01, 4.0) == approx(20.0)  # in the gaps
    assert demography.recruits(1990.0, 0.5, 2000.0, 0.01, 4.0) == approx(10.0)  # up to the largest density
    assert demography.recruits(2500.0, 0.5, 2000.0, 0.01, 4.0) == 0.0


SIZES = np.array([[demography.stem_weight(age, 0.0215, 1.2243, 2.5)] for age in range(AGES)])


def test_crowding_counts_stems_by_their_size():
    """Reineke's rule: stems twice as thick crowd like 3.04 times as many, seedlings hardly."""
    trees, kgc = stems(age70=1000.0), 60.0
    biomass = 1000.0 * kgc * 1e-4
    assert demography.reference_stems(trees, SIZES, 0, biomass, kgc, 0.642) == approx(1000.0)
    thicker = demography.reference_stems(trees, SIZES, 0, biomass * 2.0**2.5, kgc, 0.642)
    assert thicker == approx(1000.0 * 2.0**1.605)
    seedlings = trees + stems(age3=5000.0)
    assert demography.reference_stems(seedlings, SIZES, 0, biomass, kgc, 0.642) == approx(1000.0, rel=0.05)
    assert demography.reference_stems(stems(), SIZES, 0, 0.0, kgc, 0.642) == 0.0


def test_small_stems_die_first():
    trees = stems(age5=1000.0, age30=500.0, age101=200.0)
    before = trees.copy()
    died, lost = demography.weaken(trees, SIZES, 0, 50.0, 0.05)
    assert died == approx(50.0) and before.sum() - trees.sum() == approx(50.0)
    share = 1.0 - trees[[5, 30, 101], 0] / before[[5, 30, 101], 0]
    chances = 1.0 / (0.05 + SIZES[[5, 30, 101], 0])
    np.testing.assert_allclose(share / share[0], chances / chances[0])
    assert lost == approx(((before - trees) * SIZES).sum() / (before * SIZES).sum())
    assert lost < 0.25 * 50.0 / 1700.0


def test_seedlings_beside_it_do_not_keep_an_old_tree_alive():
    old = stems(age80=400.0)
    alone = demography.background_deaths(old, SIZES, 0, 0.025, 0.05, 0.06)
    assert alone == approx(400.0 * 0.025 * 0.11 / (0.05 + SIZES[80, 0]))
    planted = stems(age80=400.0, age0=100.0)
    before = planted.copy()
    demography.weaken(planted, SIZES, 0, demography.background_deaths(planted, SIZES, 0, 0.025, 0.05, 0.06), 0.05)
    assert before[80, 0] - planted[80, 0] == approx(alone)


def test_an_age_loses_no_more_than_its_stems():
    trees = stems(age5=10.0, age30=500.0, age101=200.0)
    died, lost = demography.weaken(trees, SIZES, 0, 400.0, 0.05)
    assert died == approx(400.0) and trees[5, 0] == 0.0 < trees[30, 0] and 0.0 < lost < 1.0
    died, lost = demography.weaken(trees, SIZES, 0, trees.sum(), 0.05)
    assert died == approx(310.0) and trees.sum() == approx(0.0, abs=1e-9) and lost == approx(1.0)
    assert demography.weaken(stems(), SIZES, 0, 0.0, 0.05) == (0.0, 0.0)


@given(st.lists(st.floats(0.0, 5000.0), min_size=6, max_size=6), share, st.floats(0.001, 10.0))
def test_as_many_stems_die_as_should(numbers, dying, suppressed):
    trees = stems(**{f"age{age}": number for age, number in zip((0, 1, 12, 40, 80, 101), numbers, strict=True)})
    before = trees.copy()
    died, lost = demography.weaken(trees, SIZES, 0, dying * before.sum(), suppressed)
    round_off = 1e-12 * (1.0 + before.sum())
    assert died == approx(dying * before.sum(), rel=1e-9, abs=round_off)
    assert (before - trees).sum() == approx(died, rel=1e-9, abs=round_off)
    assert trees.min() >= 0.0 and 0.0 <= lost <= 1.0
    left = np.divide(trees, before, out=np.ones_like(trees), where=before > 1e-6)
    assert (np.diff(left[before[:, 0] > 1e-6, 0]) >= -1e-9).all()  # the larger, the likelier to live


def test_hazards():
    assert disturbance.fire_hazard(0.0003, 0.5, 0.25, 1.0, 0.2, 0.4) == approx(0.0003 * 0.65)
    assert disturbance.ground_fuel(0.02, 0.08) == approx(0.25) and disturbance.ground_fuel(0.2, 0.08) == 1.0
    assert disturbance.ground_fuel(0.0, 0.0) == 0.0
    assert disturbance.fire_weather(31.0, 13.0, 30.0, 12.0)
    assert not disturbance.fire_weather(30.0, 13.0, 30.0, 12.0)
    assert not disturbance.fire_weather(31.0, 12.0, 30.0, 12.0)
    assert [mathematics.between(2.0, 4.0, u) for u in (0.0, 0.5, 1.0)] == [2.0, 3.0, 4.0]
    assert disturbance.outbreak_probability(0.04, -50.0, 1000.0, -40.0, -20.0, 1000.0) == 0.0
    assert disturbance.outbreak_probability(0.04, -30.0, 500.0, -40.0, -20.0, 1000.0) == approx(0.01)
    assert disturbance.outbreak_probability(0.04, 0.0, 9000.0, -40.0, -20.0, 1000.0) == approx(0.04)


# ------------------------------------------------------------------------------------------------- management


@pytest.mark.parametrize(
    ("cut", "mix", "conifers", "deciduous", "harvestable", "expected"),
    [
        (100.0, 0.5, 300.0, 300.0, (300.0, 300.0), 50.0),  # stays at one half: equal shares
        (100.0, 0.5, 400.0, 200.0, (400.0, 200.0), 100.0),  # 400 of 600 toward one half: conifers only
        (100.0, 0.5, 320.0, 280.0, (320.0, 280.0), 70.0),  # 250 and 250 remain
        (100.0, 1.0, 300.0, 300.0, (300.0, 300.0), 0.0),
        (100.0, 0.0, 300.0, 300.0, (300.0, 300.0), 100.0),
        (100.0, 0.0, 60.0, 540.0, (60.0, 540.0), 60.0),  # no more conifers than there are
        (100.0, 0.0, 300.0, 300.0, (40.0, 300.0), 40.0),  # than may be cut
        (100.0, 1.0, 300.0, 300.0, (300.0, 20.0), 80.0),  # the other species cannot give the rest
    ],
)
def test_which_species_is_thinned(cut, mix, conifers, deciduous, harvestable, expected):
    assert management.conifers_to_cut(cut, mix, conifers, deciduous, *harvestable) == approx(expected)


@given(share, st.floats(0.0, 1500.0), st.floats(0.0, 1500.0), share, share, st.floats(0.0, 100.0))
def test_thinning_comes_as_near_to_the_mix_as_it_can(mix, conifers, deciduous, reach, other_reach, cut):
    harvestable = (reach * conifers, other_reach * deciduous)
    cut = min(cut, sum(harvestable))
    chosen = management.conifers_to_cut(cut, mix, conifers, deciduous, *harvestable)
    assert -1e-9 <= chosen <= harvestable[0] + 1e-9 and cut - chosen <= harvestable[1] + 1e-9
    remaining = conifers + deciduous - cut
    if remaining > 1.0:

        def distance(cut_conifers):
            return abs((conifers - cut_conifers) / remaining - mix)

        options = np.linspace(max(cut - harvestable[1], 0.0), min(cut, harvestable[0]), 21)
        assert distance(chosen) <= min(distance(option) for option in options) + 1e-9


FORM = (demography.class_ages(40, 100), 0.0215, 1.2243, 2.5)  # ages, height rate and shape, carbon exponent


def test_the_oldest_class_is_cut_first():
    trees = stems(age10=100.0, age30=50.0, age70=40.0, age101=30.0)
    management.cut_oldest(trees, 0, 50.0, 21, *FORM)
    np.testing.assert_allclose(trees, stems(age10=100.0, age30=50.0, age70=20.0, age101=0.0), atol=1e-9)
    management.cut_oldest(trees, 0, 50.0, 21, *FORM)
    np.testing.assert_allclose(trees, stems(age10=100.0, age30=20.0), atol=1e-9)


def test_within_a_class_all_ages_are_cut_alike():
    trees = stems(age41=10.0, age60=20.0, age100=30.0)
    management.cut_oldest(trees, 0, 30.0, 21, *FORM)
    np.testing.assert_allclose(trees, stems(age41=5.0, age60=10.0, age100=15.0))


@pytest.mark.parametrize(
    ("first_age", "left"), [(21, {}), (41, {"age30": 50.0}), (101, {"age30": 50.0, "age70": 40.0})]
)
def test_classes_below_the_youngest_allowed_are_never_cut(first_age, left):
    trees = stems(age20=100.0, age30=50.0, age70=40.0, age101=30.0)
    available = demography.count(trees, 0, first_age, OLDEST)
    management.cut_oldest(trees, 0, available, first_age, *FORM)
    np.testing.assert_allclose(trees, stems(age20=100.0, **left), atol=1e-9)


def test_old_trees_carry_more_carbon_than_young_ones():
    trees = stems(age10=100.0, age101=100.0)
    cut = management.cut_oldest(trees, 0, 100.0, 21, *FORM)
    young, old = (demography.stem_weight(age, *FORM[1:]) for age in (10, 101))
    assert cut == approx(old / (old + young))
    assert cut > 0.95


def test_no_trees_no_carbon():
    assert management.cut_oldest(stems(), 0, 0.0, 21, *FORM) == 0.0


def test_decoding_of_actions():
    change, mix = management.decode(np.arange(25))
    assert change.tolist() == [c for c in (-100.0, -50.0, 0.0, 50.0, 100.0) for _ in range(5)]
    assert mix.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0] * 5


# ---------------------------------------------------------------------------------------------------- the document


def test_the_document_names_functions_that_exist():
    text = (Path(__file__).parents[1] / "docs" / "model.md").read_text()
    names = set(re.findall(r"`sim\.(\w+)\.(\w+)", text))
    assert len(names) > 50
    assert [name for name in names if not hasattr(importlib.import_module(f"sim.{name[0]}"), name[1])] == []
