"""Fluxes of a step, at its temperatures, moved between the stores: what leaves one enters another.

Enthalpies and stores follow from the fluxes, never the other way round; so a snowpack that melts out or soil that
freezes within a step needs no correction.
"""

from sim.carbon import autotrophic, q10_factor
from sim.jit import compiled
from sim.radiation import black_body, black_body_slope, longwave_down, longwave_up
from sim.snow import ICE_HEAT_CAPACITY, LATENT_HEAT_FUSION, LATENT_HEAT_SUBLIMATION, LATENT_HEAT_VAPORISATION
from sim.water import runoff
from sim.weather import FREEZING_POINT_K


@compiled
def move_energy_and_water(b, seconds):
    """Fluxes at the step's temperatures, moved between the stores."""
    s, p, w, r = b.s, b.p, b.w, b.r
    per_second = 1.0 / seconds
    to_vapour = seconds / LATENT_HEAT_VAPORISATION  # mm per W m-2
    for i in range(len(s.swe)):
        canopy = w.trial[i]
        ground = w.ground_new[i]
        trunk = w.trunk_base[i] + w.trunk_by_canopy[i] * canopy + w.trunk_by_ground[i] * ground
        surface = w.surface_base[i] + w.surface_by_ground[i] * ground
        deep = w.deep_base[i] + w.deep_by_surface[i] * surface
        boundary = p.deep_boundary_temperature_k[i] - FREEZING_POINT_K

        emission = black_body(canopy + FREEZING_POINT_K)
        ground_kelvin = s.ground[i] + FREEZING_POINT_K
        ground_emission = black_body(ground_kelvin) + black_body_slope(ground_kelvin) * (ground - s.ground[i])
        down = longwave_down(w.sky[i], emission, w.longwave_cover[i])
        up = longwave_up(ground_emission, down, p.ground_emissivity[i])
        to_sky = (1.0 - w.longwave_cover[i]) * up + w.longwave_cover[i] * emission
        net_stand = w.shortwave[i] - w.reflected[i] + w.sky[i] - to_sky

        available = max(w.net[i] - w.fixed[i], 0.0)
        transpired = w.dry_coefficient[i] * available * to_vapour
        evaporated = min(w.wet_coefficient[i] * available, w.wet_limit[i]) * to_vapour
        canopy_heat = w.canopy_air[i] * (canopy - w.air[i])
        trunk_heat = w.trunk_air[i] * (trunk - w.air[i])
        ground_heat = w.ground_conductance[i] * (ground - w.air[i])
        canopy_to_trunk = w.trunk_canopy[i] * (canopy - trunk)
        trunk_to_ground = w.trunk_ground[i] * (trunk - ground)
        ground_to_surface = w.surface_conductance[i] * (ground - surface)
        surface_to_deep = w.deep_conductance[i] * (surface - deep)
        deep_to_boundary = w.boundary_conductance[i] * (deep - boundary)

        snow = s.swe[i] > 0.0
        latent = w.ground_latent[i] + w.latent_slope[i] * (min(ground, 0.0) - min(s.ground[i], 0.0))
        sublimated = min(latent * (seconds / LATENT_HEAT_SUBLIMATION), s.swe[i]) if snow else 0.0
        soil_evaporated = 0.0 if snow else latent * to_vapour
        latent = (LATENT_HEAT_SUBLIMATION * sublimated + LATENT_HEAT_VAPORISATION * soil_evaporated) * per_second

        # The ground's enthalpy: snow that sublimates takes its own sensible heat along; what would warm snow above
        # 0 degC melts it; what is left after the last snow warms the skin.
        carried = ICE_HEAT_CAPACITY * sublimated * s.ground[i]
        heat = (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * s.ground[i] - carried
        heat += seconds * (
            w.ground_sw[i]
            + p.ground_emissivity[i] * (down - ground_emission)
            - ground_heat
            - ground_to_surface
            + trunk_to_ground
            - latent
        )
        s.swe[i] -= sublimated
        melted = min(max(heat, 0.0) * (1.0 / LATENT_HEAT_FUSION), s.swe[i]) if snow else 0.0
        heat -= LATENT_HEAT_FUSION * melted
        s.swe[i] -= melted
        s.ground[i] = heat / (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i])

        w.soil_top[i] = surface + ground_to_surface * w.upper_soil[i]
        s.canopy[i] = canopy
        s.trunk[i] += seconds * (canopy_to_trunk - trunk_heat - trunk_to_ground) / s.trunk_capacity[i]
        s.surface_heat[i] += seconds * (ground_to_surface - surface_to_deep)
        s.deep_heat[i] += seconds * (surface_to_deep - deep_to_boundary)

        s.canopy_rain[i] = max(s.canopy_rain[i] - evaporated, 0.0)
        water = s.soil_water[i] + w.infiltration[i] + melted - transpired - soil_evaporated
        excess = runoff(water, p.max_water_content_mm[i])
        s.soil_water[i] = water - excess

        vapour = transpired + evaporated + sublimated + soil_evaporated + w.canopy_sublimation[i]
        sensible = canopy_heat + trunk_heat + ground_heat
        stored = 1000.0 * p.photosynthesis_energy[i] * (w.gpp_conifer[i] + w.gpp_deciduous[i])
        w.energy_gain[i] = (
            seconds * (net_stand - sensible - stored - deep_to_boundary)
            - LATENT_HEAT_VAPORISATION * vapour
            - LATENT_HEAT_FUSION * w.snow[i]
            + w.advected[i]
            - carried
        )
        w.water_gain[i] = w.precipitation_step[i] - vapour - excess

        all_latent = LATENT_HEAT_VAPORISATION * vapour + LATENT_HEAT_FUSION * (sublimated + w.canopy_sublimation[i])
        r.precipitation_mm[i] += w.precipitation_step[i]
        r.snowfall_mm[i] += w.snow[i]
        r.evapotranspiration_mm[i] += vapour
        r.transpiration_mm[i] += transpired
        r.sublimation_mm[i] += sublimated + w.canopy_sublimation[i]
        r.canopy_sublimation_mm[i] += w.canopy_sublimation[i]
        r.runoff_mm[i] += excess
        r.shortwave_mj_m2[i] += 1e-6 * seconds * w.shortwave[i]
        r.net_radiation_mj_m2[i] += 1e-6 * seconds * net_stand
        r.sensible_heat_mj_m2[i] += 1e-6 * seconds * sensible
        r.latent_heat_mj_m2[i] += 1e-6 * all_latent
        r.ground_shortwave_mj_m2[i] += 1e-6 * seconds * w.ground_sw[i]
        r.boundary_warming_mj_m2[i] += 1e-6 * seconds * max(deep_to_boundary, 0.0)
        r.boundary_cooling_mj_m2[i] += 1e-6 * seconds * max(-deep_to_boundary, 0.0)
        w.reflected_sum[i] += w.reflected[i]
        w.shortwave_sum[i] += w.shortwave[i]
        r.snow_heat_mj_m2[i] += 1e-6 * (w.advected[i] - carried)
        r.deep_heat_gain_mj_m2[i] += 1e-6 * seconds * (surface_to_deep - deep_to_boundary)
        w.soil_heat_sum[i] += 1e-6 * seconds * ground_to_surface
        w.thaw_warmth[i] += seconds * max(s.ground[i], 0.0)
        # A melting snowpack is at 0 degC but for round-off.
        w.thaw_seconds[i] += seconds if s.ground[i] > 1e-6 else 0.0
        w.air_sum[i] += w.air[i]
        w.canopy_sum[i] += canopy
        w.ground_sum[i] += s.ground[i]
        w.top_sum[i] += w.soil_top[i]
        w.surface_sum[i] += w.surface[i]
        w.deep_sum[i] += w.deep[i]
        r.canopy_residual_w_m2[i] = max(r.canopy_residual_w_m2[i], abs(w.residual[i]))


@compiled
def move_carbon(b, seconds):
    """Photosynthesis and respiration, moved between air, trees and soil."""
    s, p, w, r = b.s, b.p, b.w, b.r
    for i in range(len(s.swe)):
        before = s.conifer_biomass[i] + s.deciduous_biomass[i] + s.soil_carbon[i]
        warmth = q10_factor(w.air[i], p.respiration_reference_c[i], w.log_q10[i])
        conifer = warmth * (w.leaf_rate[i] * w.lai_conifer[i] + w.wood_rate[i] * s.conifer_biomass[i])
        deciduous = warmth * (w.leaf_rate[i] * w.lai_deciduous[i] + w.wood_rate[i] * s.deciduous_biomass[i])
        conifer = autotrophic(w.gpp_conifer[i], conifer, p.growth_respiration[i], s.conifer_biomass[i], seconds)
        deciduous = autotrophic(w.gpp_deciduous[i], deciduous, p.growth_respiration[i], s.deciduous_biomass[i], seconds)
        warmth = q10_factor(w.soil_top[i], p.respiration_reference_c[i], w.log_q10[i])
        soil = min(warmth * w.soil_rate[i] * seconds, 1.0) * s.soil_carbon[i]
        s.conifer_biomass[i] += w.gpp_conifer[i] * seconds - conifer
        s.deciduous_biomass[i] += w.gpp_deciduous[i] * seconds - deciduous
        s.soil_carbon[i] -= soil
        gross = (w.gpp_conifer[i] + w.gpp_deciduous[i]) * seconds
        after = s.conifer_biomass[i] + s.deciduous_biomass[i] + s.soil_carbon[i]
        failure = abs(after - before - (gross - conifer - deciduous - soil))
        r.carbon_residual_kgc_m2[i] = max(r.carbon_residual_kgc_m2[i], failure)
        r.gpp_kgc_m2[i] += gross
        r.autotrophic_respiration_kgc_m2[i] += conifer + deciduous
        r.heterotrophic_respiration_kgc_m2[i] += soil
