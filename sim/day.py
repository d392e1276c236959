"""What is done once a day: weather, the canopy's structure, fire, litter; and the day's account at its end."""
import math

import numpy as np

from sim.canopy import leaf_out, stress_ramp
from sim.carbon import litter_share
from sim.demography import OLDEST, count, remove_share
from sim.disturbance import between, fire_hazard, fire_weather
from sim.jit import phase
from sim.mathematics import exponential
from sim.radiation import canopy_interception
from sim.snow import AIR_HEAT_CAPACITY, bulk_density, conductivity
from sim.structure import crown_areas
from sim.weather import (
    DAYS_PER_YEAR,
    FREEZING_POINT_K,
    SOLAR_CONSTANT,
    daily_mean_temperature,
    daily_precipitation,
    diffuse_share,
    diurnal_amplitude,
    drought_index,
    of_season,
    precipitation_season,
    saturation_pressure_water,
    season,
    sky_emissivity,
    solar_declination,
    solar_distance_factor,
)

WET_DAY_MM = 1.0
GROWING_SEASON_C = 5.0
SNOW_DAY_MM = 1.0
SPRING_ENDS = 212  # day of year after which remaining snow is not spring's


@phase
def begin_day(b, day, observed):
    """Weather and structure of day 0 to 364. observed : the day's forcing (steps, 6, lanes), or (0, 6, lanes)."""
    sun(b, day)
    if observed.shape[0] > 0:
        observed_weather(b, observed)
    else:
        generated_weather(b, day)
    for i in range(len(b.s.swe)):
        fire(b, day, i)
    canopy_structure(b, day)
    litter(b, day)
    clear_day(b)


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
    """The day's weather from the site's climate and the day's draws."""
    p, w, d = b.p, b.w, b.d
    angle = 2.0 * math.pi * (day + 0.5) / DAYS_PER_YEAR
    cosine, sine = math.cos(angle), math.sin(angle)
    first = day == 0
    for i in range(len(b.s.swe)):
        spread = p.daily_noise_std_c[i] * d.temperature_noise[day, i]
        memory = p.temperature_persistence[i]
        w.anomaly[i] = spread if first else memory * w.anomaly[i] + math.sqrt(1.0 - memory * memory) * spread
        temperature = daily_mean_temperature(
            cosine, sine, w.cos_warmest[i], w.sin_warmest[i],
            p.mean_annual_temperature_c[i], p.seasonal_amplitude_c[i], w.anomaly[i],
        )  # fmt: skip
        kind = precipitation_season(
            day + 1, temperature, p.summer_start_day[i], p.summer_end_day[i],
            p.spring_shoulder_start_day[i], p.spring_shoulder_end_day[i],
            p.autumn_shoulder_start_day[i], p.autumn_shoulder_end_day[i],
            p.snow_season_end_day[i], p.snow_season_start_day[i],
        )  # fmt: skip
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
        # Rain follows the temperature of the season; snowfall that of the day's weather: cold spells are dry, but
        # January is not drier than November.
        departure = w.anomaly[i] * p.snowfall_limit[i] if winter else temperature - base
        scale = 1.0 + p.snowfall_limit[i] * (p.snowfall_scale[i] - 1.0)
        mean = mean * scale if winter else mean
        precipitation = daily_precipitation(
            d.wet_dice[day, i], d.wet_amount[day, i], probability, mean, sensitivity, departure
        )
        wet = precipitation >= WET_DAY_MM

        dry_humidity = of_season(
            day, p.humidity_dry_winter[i], p.humidity_dry_spring[i], p.humidity_dry_summer[i], p.humidity_dry_autumn[i]
        )
        wet_humidity = of_season(
            day, p.humidity_wet_winter[i], p.humidity_wet_spring[i], p.humidity_wet_summer[i], p.humidity_wet_autumn[i]
        )
        humidity = min(max(p.relative_humidity[i] + (wet_humidity if wet else dry_humidity), 0.05), 1.0)
        w.vapour[i] = humidity * saturation_pressure_water(temperature)

        dry_clearness = of_season(
            day, p.clearness_dry_winter[i], p.clearness_dry_spring[i],
            p.clearness_dry_summer[i], p.clearness_dry_autumn[i],
        )  # fmt: skip
        wet_clearness = of_season(
            day, p.clearness_wet_winter[i], p.clearness_wet_spring[i],
            p.clearness_wet_summer[i], p.clearness_wet_autumn[i],
        )  # fmt: skip
        clearness = wet_clearness if wet else dry_clearness
        dry_cloud = of_season(
            day, p.cloud_dry_winter[i], p.cloud_dry_spring[i], p.cloud_dry_summer[i], p.cloud_dry_autumn[i]
        )
        wet_cloud = of_season(
            day, p.cloud_wet_cold[i], p.cloud_wet_warm[i], p.cloud_wet_warm[i], p.cloud_wet_cold[i]
        )  # fmt: skip
        w.emissivity[i] = sky_emissivity(temperature, w.vapour[i], wet_cloud if wet else dry_cloud)
        w.top_of_canopy[i] = clearness * w.extraterrestrial[i]
        w.diffuse[i] = diffuse_share(clearness)

        noon = min(max(w.sun_a[i] + w.sun_b[i], 0.0) / p.diurnal_full_sun[i], 1.0)
        w.amplitude[i] = diurnal_amplitude(
            p.diurnal_amplitude_c[i], precipitation, p.rain_diurnal_sensitivity[i], p.rain_diurnal_threshold_mm[i],
            p.max_diurnal_reduction[i], p.min_diurnal_amplitude_c[i], noon,
        )  # fmt: skip
        w.mean_temperature[i] = temperature
        w.minimum_temperature[i] = temperature - w.amplitude[i]
        w.precipitation[i] = precipitation
        w.air_density[i] = 100.0 * p.air_pressure_hpa[i] / (287.05 * (temperature + FREEZING_POINT_K))


@phase
def observed_weather(b, observed):
    """What the day's processes need from an observed day: its mean, minimum, precipitation and clearness."""
    p, w = b.p, b.w
    steps = observed.shape[0]
    for i in range(len(b.s.swe)):
        mean, minimum, precipitation, received, possible = 0.0, 1e3, 0.0, 0.0, 0.0
        for t in range(steps):
            mean += observed[t, 0, i] / steps
            minimum = min(minimum, observed[t, 0, i])
            precipitation += observed[t, 5, i]
            received += observed[t, 3, i]
            hour_angle = 2.0 * math.pi * ((t + 0.5) / steps - 0.5)
            possible += w.extraterrestrial[i] * max(w.sun_a[i] + w.sun_b[i] * math.cos(hour_angle), 0.0)
        w.mean_temperature[i] = mean
        w.minimum_temperature[i] = minimum
        w.precipitation[i] = precipitation
        w.diffuse[i] = diffuse_share(min(received / possible, 1.0)) if possible > 0.0 else 1.0
        w.air_density[i] = 100.0 * p.air_pressure_hpa[i] / (287.05 * (mean + FREEZING_POINT_K))


@phase
def canopy_structure(b, day):
    """Leaf area, optical depths and exchange coefficients of the day."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        leaf = leaf_out(day, p.growth_start_day[i], p.growth_rate[i], p.fall_start_day[i], p.fall_rate[i])
        green_conifer = p.max_lai_conifer[i]
        green_deciduous = p.max_lai_deciduous[i] * leaf
        area_conifer = green_conifer + p.woody_area_index[i]
        area_deciduous = green_deciduous + p.max_lai_deciduous[i] * p.leafless_share[i] + p.woody_area_index[i]
        w.optical_conifer[i] = p.light_extinction[i] * area_conifer
        w.optical_deciduous[i] = p.light_extinction[i] * area_deciduous
        w.leaf_conifer[i] = green_conifer / area_conifer
        w.leaf_deciduous[i] = green_deciduous / area_deciduous
        w.lai_conifer[i] = green_conifer * w.cover_conifer[i]
        w.lai_deciduous[i] = green_deciduous * w.cover_deciduous[i]
        w.snow_area[i] = w.cover_conifer[i] * area_conifer + w.cover_deciduous[i] * area_deciduous

        sky_conifer, sky_deciduous = canopy_interception(
            p.sky_path[i], w.crown_area[i], w.share_conifer[i], w.optical_conifer[i], w.optical_deciduous[i]
        )
        cover = sky_conifer + sky_deciduous
        w.sky_conifer[i] = sky_conifer
        w.sky_deciduous[i] = sky_deciduous
        w.longwave_cover[i] = cover
        inverse = 1.0 / cover if cover > 0.0 else 0.0
        w.transpiration_conifer[i] = p.priestley_taylor_conifer[i] * w.leaf_conifer[i] * sky_conifer * inverse
        w.transpiration_deciduous[i] = p.priestley_taylor_deciduous[i] * w.leaf_deciduous[i] * sky_deciduous * inverse

        # Snow lands on shoots rather than on needles, and sees less plant area than light does.
        thinner = p.snow_extinction_factor[i]
        caught = w.cover_conifer[i] * (1.0 - exponential(-w.optical_conifer[i] * thinner)) + w.cover_deciduous[i] * (
            1.0 - exponential(-w.optical_deciduous[i] * thinner)
        )
        w.snow_efficiency[i] = caught * p.interception[i]
        w.rain_capacity[i] = p.rain_capacity_mm[i] * w.snow_area[i] * p.interception[i]

        crowns = w.cover_conifer[i] + w.cover_deciduous[i]
        w.trunk_air[i] = p.trunk_air_conductance[i] * p.woody_area_index[i] * crowns
        w.trunk_canopy[i] = p.trunk_canopy_conductance[i] * crowns
        w.trunk_ground[i] = p.trunk_ground_conductance[i] * crowns
        w.snow_density[i] = bulk_density(crowns, p.snow_density_sheltered[i], p.snow_density_open[i])
        w.snow_conductivity[i] = conductivity(w.snow_density[i])
        w.temperature_stress_conifer[i] = stress_ramp(
            w.minimum_temperature[i], p.tmin_low_conifer[i], p.tmin_high_conifer[i]
        )
        w.temperature_stress_deciduous[i] = stress_ramp(
            w.minimum_temperature[i], p.tmin_low_deciduous[i], p.tmin_high_deciduous[i]
        )
        wind_exchange(b, i, p.wind_speed_m_s[i])
        w.vapour_density[i] = w.air_density[i] * 0.622 / p.air_pressure_hpa[i]


@phase
def wind_exchange(b, i, wind):
    """Exchange velocities of a lane at a wind speed [m s-1]."""
    p, w = b.p, b.w
    crowns = w.cover_conifer[i] + w.cover_deciduous[i]
    w.wind_below[i] = wind * (1.0 - p.wind_reduction[i] * crowns)
    w.ground_velocity[i] = (w.snow_log[i] if b.s.swe[i] > SNOW_DAY_MM else w.ground_log[i]) * w.wind_below[i]
    w.canopy_velocity[i] = w.canopy_log[i] * wind
    exchange = w.air_density[i] * AIR_HEAT_CAPACITY * w.canopy_velocity[i]
    w.canopy_air[i] = exchange * max(w.longwave_cover[i], 1e-3)


@phase
def fire(b, day, i):
    """Drought index of the day, and a fire if dice, drought and warmth agree; at most one a year."""
    s, p, w, r, d = b.s, b.p, b.w, b.r, b.d
    s.drought[i] = drought_index(
        s.drought[i], w.mean_temperature[i], w.precipitation[i], s.swe[i], p.drought_evaporation[i]
    )
    r.drought_index[i] = max(r.drought_index[i], s.drought[i])
    hazard = fire_hazard(
        p.fire_base_probability[i], w.cover_conifer[i], w.cover_deciduous[i],
        p.flammability_conifer[i], p.flammability_deciduous[i],
    )  # fmt: skip
    summer = p.summer_start_day[i] <= day + 1 < p.summer_end_day[i]
    ready = fire_weather(s.drought[i], w.mean_temperature[i], p.fire_drought_threshold[i], p.fire_temperature_c[i])
    if not (summer and ready and p.fire[i] > 0.0 and r.fire_mortality[i] == 0.0 and d.fire_dice[day, i] < hazard):
        return
    killed = between(p.fire_kill_low[i], p.fire_kill_high[i], d.fire_kill[i])
    w.burnt_stems[i] = killed * (count(s.conifer_stems, i, 0, OLDEST) + count(s.deciduous_stems, i, 0, OLDEST))
    remove_share(s.conifer_stems, i, 0, OLDEST, killed)
    remove_share(s.deciduous_stems, i, 0, OLDEST, killed)
    conifer, deciduous = killed * s.conifer_biomass[i], killed * s.deciduous_biomass[i]
    burned = p.fire_combusted_conifer[i] * conifer + p.fire_combusted_deciduous[i] * deciduous
    s.conifer_biomass[i] -= conifer
    s.deciduous_biomass[i] -= deciduous
    share = between(p.fire_organic_low[i], p.fire_organic_high[i], d.fire_depth[i])
    depth = share * s.organic_depth[i]
    soil = min(depth * p.organic_carbon_density[i], share * s.soil_carbon[i])
    s.organic_depth[i] -= depth
    s.soil_carbon[i] += conifer + deciduous - burned - soil
    r.fire_mortality[i] = killed
    r.fire_mortality_kgc_m2[i] += conifer + deciduous - burned
    r.fire_loss_kgc_m2[i] += burned + soil
    crown_areas(b, i)


@phase
def litter(b, day):
    """Litter of the day, from trees to soil."""
    s, p, r = b.s, b.p, b.r
    for i in range(len(s.swe)):
        share = p.litterfall_fraction[i] * litter_share(
            day, p.fall_start_day[i], p.litter_window_days[i], p.litterfall_seasonality[i]
        )
        conifer = min(share, 1.0) * s.conifer_biomass[i]
        deciduous = min(share * p.deciduous_litter_ratio[i], 1.0) * s.deciduous_biomass[i]
        s.conifer_biomass[i] -= conifer
        s.deciduous_biomass[i] -= deciduous
        s.soil_carbon[i] += conifer + deciduous
        r.litterfall_kgc_m2[i] += conifer + deciduous


@phase
def clear_day(b):
    """Remember the year's sums at the start of the day; the day's account is what is added to them."""
    w, r = b.w, b.r
    for i in range(len(b.s.swe)):
        w.gpp_before[i] = r.gpp_kgc_m2[i]
        w.ra_before[i] = r.autotrophic_respiration_kgc_m2[i]
        w.rh_before[i] = r.heterotrophic_respiration_kgc_m2[i]
        w.sw_before[i] = r.shortwave_mj_m2[i]
        w.net_before[i] = r.net_radiation_mj_m2[i]
        w.sensible_before[i] = r.sensible_heat_mj_m2[i]
        w.latent_before[i] = r.latent_heat_mj_m2[i]
        w.et_before[i] = r.evapotranspiration_mm[i]
        w.runoff_before[i] = r.runoff_mm[i]
        w.boundary_before[i] = r.boundary_warming_mj_m2[i] - r.boundary_cooling_mj_m2[i]
        w.reflected_sum[i] = 0.0
        w.shortwave_sum[i] = 0.0
        w.soil_heat_sum[i] = 0.0
        w.air_sum[i] = 0.0
        w.canopy_sum[i] = 0.0
        w.ground_sum[i] = 0.0
        w.surface_sum[i] = 0.0
        w.deep_sum[i] = 0.0


@phase
def end_day(b, day, steps, daily):
    """Add the day to the year's account, and write its row of `daily` (365, columns, lanes) if that is wanted."""
    s, w, r = b.s, b.w, b.r
    summer = 1.0 if season(day) == 2 else 0.0
    december_to_march = 1.0 if day < 90 or day >= 334 else 0.0
    december_to_february = 1.0 if season(day) == 0 else 0.0
    spring = day < SPRING_ENDS
    for i in range(len(s.swe)):
        air = w.air_sum[i] / steps
        w.summer_up[i] += summer * w.reflected_sum[i]
        w.summer_down[i] += summer * w.shortwave_sum[i]
        w.winter_up[i] += december_to_march * w.reflected_sum[i]
        w.winter_down[i] += december_to_march * w.shortwave_sum[i]
        w.winter_air[i] += december_to_february * air
        w.winter_days[i] += december_to_february
        r.growing_season_days[i] += 1.0 if air > GROWING_SEASON_C else 0.0
        snowy = s.swe[i] > SNOW_DAY_MM
        r.snow_days[i] += 1.0 if snowy else 0.0
        r.snow_off_doy[i] = day + 2.0 if snowy and spring else r.snow_off_doy[i]
        r.peak_swe_mm[i] = max(r.peak_swe_mm[i], s.swe[i])
        r.max_lai[i] = max(r.max_lai[i], w.lai_conifer[i] + w.lai_deciduous[i])
        r.air_temperature_c[i] += air / DAYS_PER_YEAR
        r.ground_temperature_c[i] += w.ground_sum[i] / (steps * DAYS_PER_YEAR)
        r.surface_soil_temperature_c[i] += w.surface_sum[i] / (steps * DAYS_PER_YEAR)
        r.deep_soil_temperature_c[i] += w.deep_sum[i] / (steps * DAYS_PER_YEAR)
    if daily.shape[0] > 0:
        write_day(b, steps, daily[day])


@phase
def write_day(b, steps, row):
    """One row of daily output, columns as in `sim.state.DAILY`."""
    s, w, r = b.s, b.w, b.r
    for i in range(len(s.swe)):
        row[0, i] = w.air_sum[i] / steps
        row[1, i] = w.precipitation[i]
        row[2, i] = r.gpp_kgc_m2[i] - w.gpp_before[i]
        row[3, i] = r.autotrophic_respiration_kgc_m2[i] - w.ra_before[i]
        row[4, i] = r.heterotrophic_respiration_kgc_m2[i] - w.rh_before[i]
        row[5, i] = r.shortwave_mj_m2[i] - w.sw_before[i]
        row[6, i] = r.net_radiation_mj_m2[i] - w.net_before[i]
        row[7, i] = r.sensible_heat_mj_m2[i] - w.sensible_before[i]
        row[8, i] = r.latent_heat_mj_m2[i] - w.latent_before[i]
        row[9, i] = w.soil_heat_sum[i]
        row[10, i] = r.boundary_warming_mj_m2[i] - r.boundary_cooling_mj_m2[i] - w.boundary_before[i]
        row[11, i] = r.evapotranspiration_mm[i] - w.et_before[i]
        row[12, i] = r.runoff_mm[i] - w.runoff_before[i]
        row[13, i] = s.swe[i]
        row[14, i] = s.canopy_snow[i]
        row[15, i] = s.soil_water[i]
        row[16, i] = w.canopy_sum[i] / steps
        row[17, i] = w.ground_sum[i] / steps
        row[18, i] = w.surface_sum[i] / steps
        row[19, i] = w.deep_sum[i] / steps
        row[20, i] = w.reflected_sum[i] / w.shortwave_sum[i] if w.shortwave_sum[i] > 0.0 else np.nan
        row[21, i] = w.lai_conifer[i] + w.lai_deciduous[i]
        row[22, i] = s.organic_depth[i]
