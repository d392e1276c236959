"""The account of a step, a day and a year: sums, means, extremes, stocks, and what failed to close."""

import math

from sim.demography import class_ages, count_classes, count_stand
from sim.jit import compiled, phase
from sim.permafrost import note_thaw
from sim.physical_constants import DAYS_PER_YEAR, LATENT_HEAT_FUSION, LATENT_HEAT_VAPORISATION
from sim.snow import SNOW_DAY_MM, snow_depth
from sim.weather import december_to_march, season

GROWING_SEASON_C = 5.0
SPRING_ENDS = 212  # day of year after which remaining snow is not spring's


@phase
def clear_year(b, i):
    """Note the year's first stocks and clear its running sums; the record itself comes in as zeros."""
    s, w = b.s, b.w
    w.biomass_before[i] = s.conifer_biomass[i] + s.deciduous_biomass[i]
    w.soil_before[i] = s.soil_carbon[i]
    w.deadwood_before[i] = s.conifer_deadwood[i] + s.deciduous_deadwood[i]
    w.products_before[i] = s.products[i]
    conifers, deciduous = count_stand(b, i)
    w.stems_before[i] = conifers + deciduous
    w.stems_gain[i] = 0.0
    w.summer_up[i] = 0.0
    w.summer_down[i] = 0.0
    w.winter_up[i] = 0.0
    w.winter_down[i] = 0.0
    w.winter_air[i] = 0.0
    w.winter_days[i] = 0.0
    w.thaw_warmth[i] = 0.0
    w.thaw_seconds[i] = 0.0
    w.thaw_water[i] = 0.0


@phase
def clear_day(b, day, daily):
    """Clear the day's sums; of what the year adds up, the day's row of `daily` keeps the sums before the day."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.reflected_sum[i] = 0.0
        w.shortwave_sum[i] = 0.0
        w.soil_heat_sum[i] = 0.0
        w.air_sum[i] = 0.0
        w.canopy_sum[i] = 0.0
        w.ground_sum[i] = 0.0
        w.top_sum[i] = 0.0
        w.organic_sum[i] = 0.0
        w.surface_sum[i] = 0.0
        w.deep_sum[i] = 0.0
    if len(daily) > 0:
        note_sums(b, daily[day])


@phase
def note_sums(b, row):
    """The year's sums before the day, in the columns of `sim.state.DAILY` that are what the day adds to them."""
    r = b.r
    for i in range(len(b.s.swe)):
        row.gpp_kgc_m2[i] = r.gpp_kgc_m2[i]
        row.autotrophic_respiration_kgc_m2[i] = r.autotrophic_respiration_kgc_m2[i]
        row.heterotrophic_respiration_kgc_m2[i] = r.heterotrophic_respiration_kgc_m2[i]
        row.shortwave_mj_m2[i] = r.shortwave_mj_m2[i]
        row.net_radiation_mj_m2[i] = r.net_radiation_mj_m2[i]
        row.sensible_heat_mj_m2[i] = r.sensible_heat_mj_m2[i]
        row.latent_heat_mj_m2[i] = r.latent_heat_mj_m2[i]
        row.boundary_heat_mj_m2[i] = r.boundary_warming_mj_m2[i] - r.boundary_cooling_mj_m2[i]
        row.evapotranspiration_mm[i] = r.evapotranspiration_mm[i]
        row.runoff_mm[i] = r.runoff_mm[i]


@compiled
def total_sensible(heat) -> float:
    """Sensible heat to the air [W m-2], of a `sim.fluxes.Heat`."""
    return heat.canopy_to_air + heat.trunk_to_air + heat.ground_to_air


@compiled
def total_vapour(b, i, vapour) -> float:
    """All vapour of a step [mm], of a `sim.fluxes.Vapour` and of the canopy's snow."""
    return vapour.leaves + vapour.wet_canopy + vapour.snow + vapour.floor + b.w.canopy_sublimation[i]


@compiled
def add_step(b, i, net_radiation, heat, vapour, excess, advected, seconds):
    """Add the step's fluxes and temperatures of a lane to the account.

    heat, vapour : `sim.fluxes.Heat` and `Vapour`; excess : runoff [mm]; advected : heat that water and snow
    brought, less what they took along [J m-2].
    """
    s, w, r = b.s, b.w, b.r
    all_vapour = total_vapour(b, i, vapour)
    sublimated = vapour.snow + w.canopy_sublimation[i]
    r.precipitation_mm[i] += w.precipitation_step[i]
    r.snowfall_mm[i] += w.snow[i]
    r.evapotranspiration_mm[i] += all_vapour
    r.transpiration_mm[i] += vapour.leaves
    r.floor_evaporation_mm[i] += vapour.floor
    r.sublimation_mm[i] += sublimated
    r.canopy_sublimation_mm[i] += w.canopy_sublimation[i]
    r.runoff_mm[i] += excess
    r.shortwave_mj_m2[i] += 1e-6 * seconds * w.shortwave[i]
    r.net_radiation_mj_m2[i] += 1e-6 * seconds * net_radiation
    r.sensible_heat_mj_m2[i] += 1e-6 * seconds * total_sensible(heat)
    r.latent_heat_mj_m2[i] += 1e-6 * (LATENT_HEAT_VAPORISATION * all_vapour + LATENT_HEAT_FUSION * sublimated)
    r.ground_shortwave_mj_m2[i] += 1e-6 * seconds * w.ground_sw[i]
    r.boundary_warming_mj_m2[i] += 1e-6 * seconds * max(heat.deep_to_boundary, 0.0)
    r.boundary_cooling_mj_m2[i] += 1e-6 * seconds * max(-heat.deep_to_boundary, 0.0)
    r.advected_heat_mj_m2[i] += 1e-6 * advected
    r.deep_heat_gain_mj_m2[i] += 1e-6 * seconds * (heat.surface_to_deep - heat.deep_to_boundary)
    w.reflected_sum[i] += w.reflected[i]
    w.shortwave_sum[i] += w.shortwave[i]
    w.soil_heat_sum[i] += 1e-6 * seconds * heat.ground_to_organic
    w.thaw_warmth[i] += seconds * max(s.ground[i], 0.0)
    # A melting snowpack is at 0 degC but for round-off.
    thawing = seconds if s.ground[i] > 1e-6 else 0.0
    w.thaw_seconds[i] += thawing
    w.thaw_water[i] += thawing * s.organic_water[i]
    w.air_sum[i] += w.air[i]
    w.canopy_sum[i] += s.canopy[i]
    w.ground_sum[i] += s.ground[i]
    w.top_sum[i] += w.soil_top[i]
    w.organic_sum[i] += w.organic[i]
    w.surface_sum[i] += w.surface[i]
    w.deep_sum[i] += w.deep[i]
    r.canopy_residual_w_m2[i] = max(r.canopy_residual_w_m2[i], abs(w.residual[i]))


@phase
def end_day(b, day, steps, daily):
    """Add the day to the year's account, and write its row of `daily` if that is wanted."""
    s, w, r = b.s, b.w, b.r
    summer = 1.0 if season(day) == 2 else 0.0
    winter = 1.0 if december_to_march(day) else 0.0
    december_to_february = 1.0 if season(day) == 0 else 0.0
    spring = day < SPRING_ENDS
    for i in range(len(s.swe)):
        air = w.air_sum[i] / steps
        w.summer_up[i] += summer * w.reflected_sum[i]
        w.summer_down[i] += summer * w.shortwave_sum[i]
        w.winter_up[i] += winter * w.reflected_sum[i]
        w.winter_down[i] += winter * w.shortwave_sum[i]
        w.winter_air[i] += december_to_february * air
        w.winter_days[i] += december_to_february
        r.growing_season_days[i] += 1.0 if air > GROWING_SEASON_C else 0.0
        snowy = s.swe[i] > SNOW_DAY_MM
        r.snow_days[i] += 1.0 if snowy else 0.0
        r.snow_off_doy[i] = day + 2.0 if snowy and spring else r.snow_off_doy[i]
        r.peak_swe_mm[i] = max(r.peak_swe_mm[i], s.swe[i])
        r.peak_snow_depth_m[i] = max(r.peak_snow_depth_m[i], snow_depth(b, i))
        r.max_lai[i] = max(r.max_lai[i], w.lai_conifer[i] + w.lai_deciduous[i])
        r.air_temperature_c[i] += air / DAYS_PER_YEAR
        r.ground_temperature_c[i] += w.ground_sum[i] / (steps * DAYS_PER_YEAR)
        r.soil_top_temperature_c[i] += w.top_sum[i] / (steps * DAYS_PER_YEAR)
        r.surface_soil_temperature_c[i] += w.surface_sum[i] / (steps * DAYS_PER_YEAR)
        r.deep_soil_temperature_c[i] += w.deep_sum[i] / (steps * DAYS_PER_YEAR)
    if len(daily) > 0:
        write_day(b, steps, daily[day])


@phase
def write_day(b, steps, row):
    """A day's row of daily output, columns as in `sim.state.DAILY`."""
    s, w, r = b.s, b.w, b.r
    for i in range(len(s.swe)):
        row.air_temperature_c[i] = w.air_sum[i] / steps
        row.precipitation_mm[i] = w.precipitation[i]
        row.gpp_kgc_m2[i] = r.gpp_kgc_m2[i] - row.gpp_kgc_m2[i]
        row.autotrophic_respiration_kgc_m2[i] = (
            r.autotrophic_respiration_kgc_m2[i] - row.autotrophic_respiration_kgc_m2[i]
        )
        row.heterotrophic_respiration_kgc_m2[i] = (
            r.heterotrophic_respiration_kgc_m2[i] - row.heterotrophic_respiration_kgc_m2[i]
        )
        row.shortwave_mj_m2[i] = r.shortwave_mj_m2[i] - row.shortwave_mj_m2[i]
        row.net_radiation_mj_m2[i] = r.net_radiation_mj_m2[i] - row.net_radiation_mj_m2[i]
        row.sensible_heat_mj_m2[i] = r.sensible_heat_mj_m2[i] - row.sensible_heat_mj_m2[i]
        row.latent_heat_mj_m2[i] = r.latent_heat_mj_m2[i] - row.latent_heat_mj_m2[i]
        row.ground_heat_mj_m2[i] = w.soil_heat_sum[i]
        row.boundary_heat_mj_m2[i] = (
            r.boundary_warming_mj_m2[i] - r.boundary_cooling_mj_m2[i] - row.boundary_heat_mj_m2[i]
        )
        row.evapotranspiration_mm[i] = r.evapotranspiration_mm[i] - row.evapotranspiration_mm[i]
        row.runoff_mm[i] = r.runoff_mm[i] - row.runoff_mm[i]
        row.swe_mm[i] = s.swe[i]
        row.canopy_snow_mm[i] = s.canopy_snow[i]
        row.soil_water_mm[i] = s.soil_water[i]
        row.canopy_temperature_c[i] = w.canopy_sum[i] / steps
        row.ground_temperature_c[i] = w.ground_sum[i] / steps
        row.surface_soil_temperature_c[i] = w.surface_sum[i] / steps
        row.deep_soil_temperature_c[i] = w.deep_sum[i] / steps
        row.albedo[i] = w.reflected_sum[i] / w.shortwave_sum[i] if w.shortwave_sum[i] > 0.0 else math.nan
        row.lai[i] = w.lai_conifer[i] + w.lai_deciduous[i]
        row.organic_layer_m[i] = s.organic_depth[i]
        row.soil_top_temperature_c[i] = w.top_sum[i] / steps
        row.snow_depth_m[i] = snow_depth(b, i)
        row.organic_water_mm[i] = s.organic_water[i]
        row.organic_temperature_c[i] = w.organic_sum[i] / steps


@phase
def write_record(b, i):
    """5 of the timeline: stocks at the year's end, means, and what the year failed to close."""
    s, p, w, r = b.s, b.p, b.w, b.r
    conifers, deciduous = count_stand(b, i)
    density = conifers + deciduous
    r.density_stems_ha[i] = density
    r.conifer_fraction[i] = conifers / density if density > 0.0 else 0.0
    ages = class_ages(int(p.young_age_limit[i]), int(p.mature_age_limit[i]))
    (
        r.conifer_seedling_stems_ha[i],
        r.conifer_sapling_stems_ha[i],
        r.conifer_young_stems_ha[i],
        r.conifer_mature_stems_ha[i],
        r.conifer_old_stems_ha[i],
    ) = count_classes(s.conifer_stems, i, ages)
    (
        r.deciduous_seedling_stems_ha[i],
        r.deciduous_sapling_stems_ha[i],
        r.deciduous_young_stems_ha[i],
        r.deciduous_mature_stems_ha[i],
        r.deciduous_old_stems_ha[i],
    ) = count_classes(s.deciduous_stems, i, ages)

    r.biomass_kgc_m2[i] = s.conifer_biomass[i] + s.deciduous_biomass[i]
    r.soil_kgc_m2[i] = s.soil_carbon[i]
    r.conifer_deadwood_kgc_m2[i] = s.conifer_deadwood[i]
    r.deciduous_deadwood_kgc_m2[i] = s.deciduous_deadwood[i]
    r.hwp_kgc_m2[i] = s.products[i]
    r.biomass_change_kgc_m2[i] = r.biomass_kgc_m2[i] - w.biomass_before[i]
    r.soil_change_kgc_m2[i] = r.soil_kgc_m2[i] - w.soil_before[i]
    deadwood_change = s.conifer_deadwood[i] + s.deciduous_deadwood[i] - w.deadwood_before[i]
    kept = deadwood_change + s.products[i] - w.products_before[i]
    r.net_carbon_change_kgc_m2[i] = r.biomass_change_kgc_m2[i] + r.soil_change_kgc_m2[i] + kept
    crossed = (
        r.gpp_kgc_m2[i]
        - r.autotrophic_respiration_kgc_m2[i]
        - r.heterotrophic_respiration_kgc_m2[i]
        - r.fire_loss_kgc_m2[i]
        - r.harvest_emission_kgc_m2[i]
        - r.hwp_decay_kgc_m2[i]
    )
    r.annual_carbon_residual_kgc_m2[i] = abs(r.net_carbon_change_kgc_m2[i] - crossed)
    r.stems_residual_ha[i] = abs(density - w.stems_before[i] - w.stems_gain[i])
    r.summer_albedo[i] = w.summer_up[i] / w.summer_down[i] if w.summer_down[i] > 0.0 else math.nan
    r.winter_albedo[i] = w.winter_up[i] / w.winter_down[i] if w.winter_down[i] > 0.0 else math.nan
    r.organic_layer_m[i] = s.organic_depth[i]
    r.crown_cover[i] = w.cover_conifer[i] + w.cover_deciduous[i]
    note_thaw(b, i)
