"""The sun and the weather of a day and of its steps, generated from the site's climate or observed."""

import math

import numpy as np

from sim.jit import compiled, phase
from sim.mathematics import between
from sim.physical_constants import DAYS_PER_YEAR, FREEZING_POINT_K, SECONDS_PER_DAY, SOLAR_CONSTANT
from sim.radiation import black_body
from sim.weather import (
    air_density,
    cos_zenith,
    daily_mean_temperature,
    daily_precipitation,
    diffuse_share,
    diurnal_amplitude,
    hour_angle,
    of_season,
    precipitation_season,
    saturation_pressure,
    saturation_pressure_water,
    saturation_slope,
    sky_emissivity,
    snow_share,
    solar_declination,
    solar_distance_factor,
    wet_day_factor,
)
from sim.wind import wind_exchange

WET_DAY_MM = 1.0


@compiled
def site_angles(b, i):
    """Latitude, warmest day and warmest hour as angles, for the year."""
    p, w = b.p, b.w
    latitude = math.radians(p.latitude_deg[i])
    w.cos_latitude[i], w.sin_latitude[i] = math.cos(latitude), math.sin(latitude)
    warmest = 2.0 * math.pi * p.warmest_day[i] / DAYS_PER_YEAR
    w.cos_warmest[i], w.sin_warmest[i] = math.cos(warmest), math.sin(warmest)
    peak = 2.0 * math.pi * p.peak_diurnal_hour[i] / 24.0
    w.cos_peak[i], w.sin_peak[i] = math.cos(peak), math.sin(peak)


@phase
def hour_angles(steps_per_day):
    """Cosine and sine of the hour angle at the middle of each step of a day, shape (steps, 2)."""
    hours = np.empty((steps_per_day, 2))
    for t in range(steps_per_day):
        angle = hour_angle(t, steps_per_day)
        hours[t, 0], hours[t, 1] = math.cos(angle), math.sin(angle)
    return hours


@phase
def sun(b, day):
    """Coefficients of the cosine of the zenith angle: a + b cos(hour angle)."""
    w = b.w
    declination = solar_declination(day)
    sine, cosine = math.sin(declination), math.cos(declination)
    distance = solar_distance_factor(day)
    for i in range(len(b.s.swe)):
        w.sun_a[i] = w.sin_latitude[i] * sine
        w.sun_b[i] = w.cos_latitude[i] * cosine
        w.extraterrestrial[i] = SOLAR_CONSTANT * distance


@phase
def generated_weather(b, day):
    """The day's weather from the site's climate, the day's draws and how much warmer and wetter the year is.

    Precipitation is that of the site's climate, times the year's factor: what comes with warming is in the factor.
    """
    p, w, d = b.p, b.w, b.d
    angle = 2.0 * math.pi * (day + 0.5) / DAYS_PER_YEAR
    cosine, sine = math.cos(angle), math.sin(angle)
    first = day == 0
    for i in range(len(b.s.swe)):
        as_observed = p.weather_as_observed[i]
        larger = of_season(
            day,
            p.noise_factor_winter[i],
            p.noise_factor_spring[i],
            p.noise_factor_summer[i],
            p.noise_factor_autumn[i],
        )
        spread = p.daily_noise_std_c[i] * between(1.0, larger, as_observed) * d.temperature_noise[day, i]
        memory = p.temperature_persistence[i]
        w.anomaly[i] = spread if first else memory * w.anomaly[i] + math.sqrt(1.0 - memory * memory) * spread
        # the day's temperature with its anomaly, before the scenario's warming
        climate = daily_mean_temperature(
            cosine,
            sine,
            w.cos_warmest[i],
            w.sin_warmest[i],
            p.mean_annual_temperature_c[i],
            p.seasonal_amplitude_c[i],
            w.anomaly[i],
        )
        kind = precipitation_season(
            day + 1,
            climate,
            p.summer_start_day[i],
            p.summer_end_day[i],
            p.spring_shoulder_start_day[i],
            p.spring_shoulder_end_day[i],
            p.autumn_shoulder_start_day[i],
            p.autumn_shoulder_end_day[i],
            p.snow_season_end_day[i],
            p.snow_season_start_day[i],
        )
        winter, shoulder = kind == 0, kind == 1
        probability = p.summer_rain_prob[i]
        mean = p.summer_rain_mm_day[i]
        sensitivity = p.summer_precip_temp_sensitivity[i]
        base = p.summer_precip_base_temp_c[i]
        probability = p.shoulder_rain_prob[i] if shoulder else probability
        mean = p.shoulder_rain_mm_day[i] if shoulder else mean
        sensitivity = p.shoulder_precip_temp_sensitivity[i] if shoulder else sensitivity
        base = p.shoulder_precip_base_temp_c[i] if shoulder else base
        probability = p.winter_snow_prob[i] if winter else probability
        mean = p.winter_snow_mm_day[i] if winter else mean
        sensitivity = p.winter_precip_temp_sensitivity[i] if winter else sensitivity
        # Rain follows how much warmer the day is than its season's base; snowfall only the day's anomaly: cold spells
        # are dry, but January is not drier than November.
        departure = w.anomaly[i] * p.snowfall_limit[i] if winter else climate - base
        scale = 1.0 + p.snowfall_limit[i] * (p.snowfall_scale[i] - 1.0)
        mean = mean * scale if winter else mean
        oftener = between(1.0, wet_day_factor(probability, p.wet_day_factor[i]), as_observed)
        swing = as_observed * w.anomaly[i] * (p.snowfall_limit[i] if winter else 1.0)
        precipitation = p.precipitation_factor[i] * daily_precipitation(
            d.wet_dice[day, i],
            d.wet_amount[day, i],
            probability * oftener,
            mean / oftener,
            sensitivity,
            departure,
            swing,
        )
        wet = precipitation >= WET_DAY_MM
        # warming is a cosine of the same seasons, on top of that
        temperature = daily_mean_temperature(
            cosine,
            sine,
            w.cos_warmest[i],
            w.sin_warmest[i],
            p.warming_k[i],
            p.warming_amplitude_k[i],
            climate,
        )

        dry_humidity = of_season(
            day, p.humidity_dry_winter[i], p.humidity_dry_spring[i], p.humidity_dry_summer[i], p.humidity_dry_autumn[i]
        )
        wet_humidity = of_season(
            day, p.humidity_wet_winter[i], p.humidity_wet_spring[i], p.humidity_wet_summer[i], p.humidity_wet_autumn[i]
        )
        humidity = min(max(p.relative_humidity[i] + (wet_humidity if wet else dry_humidity), 0.05), 1.0)
        w.vapour[i] = humidity * saturation_pressure_water(temperature)

        dry_clearness = of_season(
            day,
            p.clearness_dry_winter[i],
            p.clearness_dry_spring[i],
            p.clearness_dry_summer[i],
            p.clearness_dry_autumn[i],
        )
        observed_clearness = of_season(
            day,
            p.clearness_observed_dry_winter[i],
            p.clearness_observed_dry_spring[i],
            p.clearness_observed_dry_summer[i],
            p.clearness_observed_dry_autumn[i],
        )
        dry_clearness = between(dry_clearness, observed_clearness, as_observed)
        wet_clearness = of_season(
            day,
            p.clearness_wet_winter[i],
            p.clearness_wet_spring[i],
            p.clearness_wet_summer[i],
            p.clearness_wet_autumn[i],
        )
        clearness = wet_clearness if wet else dry_clearness
        dry_cloud = of_season(
            day, p.cloud_dry_winter[i], p.cloud_dry_spring[i], p.cloud_dry_summer[i], p.cloud_dry_autumn[i]
        )
        observed_cloud = of_season(
            day,
            p.cloud_dry_winter[i],
            p.cloud_dry_spring[i],
            p.cloud_observed_dry_summer[i],
            p.cloud_observed_dry_autumn[i],
        )
        dry_cloud = between(dry_cloud, observed_cloud, as_observed)
        wet_cloud = of_season(day, p.cloud_wet_cold[i], p.cloud_wet_warm[i], p.cloud_wet_warm[i], p.cloud_wet_cold[i])
        w.emissivity[i] = sky_emissivity(temperature, w.vapour[i], wet_cloud if wet else dry_cloud)
        w.top_of_canopy[i] = clearness * w.extraterrestrial[i]
        w.diffuse[i] = diffuse_share(clearness)

        noon = min(cos_zenith(w.sun_a[i], w.sun_b[i], 1.0) / p.diurnal_full_sun[i], 1.0)
        w.amplitude[i] = diurnal_amplitude(
            p.diurnal_amplitude_c[i],
            precipitation,
            p.rain_diurnal_sensitivity[i],
            p.rain_diurnal_threshold_mm[i],
            p.max_diurnal_reduction[i],
            p.min_diurnal_amplitude_c[i],
            noon,
        )
        w.mean_temperature[i] = temperature
        w.precipitation[i] = precipitation
        w.air_density[i] = air_density(p.air_pressure_hpa[i], temperature)


@phase
def observed_weather(b, observed):
    """What the day's processes need from an observed day: its mean, precipitation and clearness."""
    p, w = b.p, b.w
    steps = observed.shape[0]
    for i in range(len(b.s.swe)):
        mean, precipitation, received, possible = 0.0, 0.0, 0.0, 0.0
        for t in range(steps):
            mean += observed[t, 0, i] / steps
            precipitation += observed[t, 5, i]
            received += observed[t, 3, i]
            possible += w.extraterrestrial[i] * cos_zenith(w.sun_a[i], w.sun_b[i], math.cos(hour_angle(t, steps)))
        w.mean_temperature[i] = mean
        w.precipitation[i] = precipitation
        w.diffuse[i] = diffuse_share(min(received / possible, 1.0)) if possible > 0.0 else 1.0
        w.air_density[i] = air_density(p.air_pressure_hpa[i], mean)


@compiled
def step_weather(b, t, hours, seconds, observed):
    """Weather of a step. It is apart from the step because it alone takes arrays, whose references are counted.

    t : number of the step in its day; hours : cosine and sine of the hour angle at the middle of each step of a day,
    shape (steps, 2); observed : the day's forcing (steps, 6, lanes), or (0, 6, lanes) for none.
    """
    if observed.shape[0] > 0:
        observed_air(b, observed[t], hours[t, 0])
    else:
        generated_air(b, hours[t, 0], hours[t, 1], seconds)


@compiled
def generated_air(b, cos_hour, sin_hour, seconds):
    """Sun, air temperature, longwave and precipitation of the step, from the day's generated weather."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.cos_zenith[i] = cos_zenith(w.sun_a[i], w.sun_b[i], cos_hour)
        w.shortwave[i] = w.top_of_canopy[i] * w.cos_zenith[i]
        w.air[i] = w.mean_temperature[i] + w.amplitude[i] * (cos_hour * w.cos_peak[i] + sin_hour * w.sin_peak[i])
        w.air_emission[i] = black_body(w.air[i] + FREEZING_POINT_K)
        w.sky[i] = w.emissivity[i] * w.air_emission[i]
        w.precipitation_step[i] = w.precipitation[i] * (seconds / SECONDS_PER_DAY)


@compiled
def observed_air(b, row, cos_hour):
    """The same from observation; row : (6, lanes), columns as in `sim.state.FORCING`."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.cos_zenith[i] = cos_zenith(w.sun_a[i], w.sun_b[i], cos_hour)
        w.shortwave[i] = row[3, i]
        w.air[i] = row[0, i]
        w.vapour[i] = row[1, i] * saturation_pressure_water(row[0, i])
        w.air_emission[i] = black_body(row[0, i] + FREEZING_POINT_K)
        w.sky[i] = row[4, i]
        w.precipitation_step[i] = row[5, i]
        wind_exchange(b, i, row[2, i])


@compiled
def moisture(b, i):
    """Humidity of the step's air, and its precipitation as rain and snow."""
    w = b.w
    saturation = saturation_pressure(w.air[i])
    w.saturation_slope[i] = saturation_slope(w.air[i], saturation)
    # The vapour of the day's mean is more than a cold night's air can hold: the rest is dew and fog, not followed.
    w.humidity[i] = min(w.vapour[i], saturation)
    w.deficit[i] = saturation - w.humidity[i]
    w.snow[i] = w.precipitation_step[i] * snow_share(w.air[i])
    w.rain[i] = w.precipitation_step[i] - w.snow[i]
