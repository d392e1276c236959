"""What is done once a day: weather, the canopy's structure, fire, litter; and the day's account at its end."""

import numpy as np

from sim.canopy import leaf_out, stress_ramp
from sim.carbon import litter_share
from sim.disturbance import fire
from sim.forcing import generated_weather, observed_weather, sun
from sim.jit import compiled, phase
from sim.mathematics import exponential
from sim.radiation import canopy_interception
from sim.snow import AIR_HEAT_CAPACITY, bulk_density, conductivity
from sim.weather import DAYS_PER_YEAR, season

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
        capacity = p.rain_capacity_mm[i] * w.snow_area[i] * p.interception[i]
        w.rain_capacity[i] = capacity
        w.per_rain_capacity[i] = 1.0 / capacity if capacity > 0.0 else 0.0

        crowns = w.cover_conifer[i] + w.cover_deciduous[i]
        w.trunk_air[i] = p.trunk_air_conductance[i] * p.woody_area_index[i] * crowns
        w.trunk_canopy[i] = p.trunk_canopy_conductance[i] * crowns
        w.trunk_ground[i] = p.trunk_ground_conductance[i] * crowns
        w.snow_density[i] = bulk_density(crowns, p.snow_density_sheltered[i], p.snow_density_open[i])
        w.snow_resistance[i] = 1.0 / (w.snow_density[i] * conductivity(w.snow_density[i]))
        w.snow_hiding[i] = 1.0 / (w.snow_density[i] * p.snow_cover_depth_m[i])
        w.temperature_stress_conifer[i] = stress_ramp(
            w.minimum_temperature[i], p.tmin_low_conifer[i], 1.0 / (p.tmin_high_conifer[i] - p.tmin_low_conifer[i])
        )
        w.temperature_stress_deciduous[i] = stress_ramp(
            w.minimum_temperature[i],
            p.tmin_low_deciduous[i],
            1.0 / (p.tmin_high_deciduous[i] - p.tmin_low_deciduous[i]),
        )
        wind_exchange(b, i, p.wind_speed_m_s[i])
        w.vapour_density[i] = w.air_density[i] * 0.622 / p.air_pressure_hpa[i]


@compiled
def wind_exchange(b, i, wind):
    """Exchange of a lane's ground [m s-1] and canopy [W m-2 K-1] with the air at a wind speed [m s-1]."""
    p, w = b.p, b.w
    crowns = w.cover_conifer[i] + w.cover_deciduous[i]
    snow = b.s.swe[i] > SNOW_DAY_MM
    sheltered = wind * (1.0 - p.wind_reduction[i] * crowns)
    # Loaded before they are chosen from: a conditional load keeps the loop from being vectorised.
    snow_wind, ground_wind, snow_log, ground_log = w.snow_wind[i], w.ground_wind[i], w.snow_log[i], w.ground_log[i]
    w.wind_below[i] = (snow_wind if snow else ground_wind) * sheltered
    w.ground_velocity[i] = (snow_log if snow else ground_log) * sheltered
    exchange = w.air_density[i] * AIR_HEAT_CAPACITY * (w.canopy_log[i] * wind)
    w.canopy_air[i] = max(exchange, p.minimum_conductance[i]) * max(w.longwave_cover[i], 1e-3)


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
        w.top_sum[i] = 0.0
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
        r.soil_top_temperature_c[i] += w.top_sum[i] / (steps * DAYS_PER_YEAR)
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
        row[23, i] = w.top_sum[i] / steps
