"""One sub-daily step of a block of stands, phase by phase.

Fluxes are computed once, at the temperatures of the implicit step, and then moved: what leaves one store enters
another. Enthalpies and stores follow from the fluxes, never the other way round; so a snowpack that melts out or
soil that freezes within a step needs no correction. `balance` checks this from the stores alone.
"""
from sim.canopy import NEWTON_LIMIT, NEWTON_TOLERANCE, canopy_balance, newton_step, stress_ramp
from sim.carbon import SECONDS_PER_YEAR, autotrophic, maintenance, photosynthesis, q10_factor
from sim.day import wind_exchange
from sim.interception import intercepted, snow_capacity, snow_melt, snow_sublimation, unloaded
from sim.jit import phase
from sim.radiation import (
    black_body,
    black_body_slope,
    canopy_interception,
    longwave_down,
    longwave_up,
    path_length,
    shortwave,
)
from sim.snow import (
    AIR_HEAT_CAPACITY,
    ICE_HEAT_CAPACITY,
    LATENT_HEAT_FUSION,
    LATENT_HEAT_SUBLIMATION,
    LATENT_HEAT_VAPORISATION,
    snow_albedo,
    stability,
    surface_albedo,
)
from sim.soil import conductivity, frozen_share, heat_capacity, respond_to_canopy, temperature
from sim.water import runoff, water_stress
from sim.weather import (
    FREEZING_POINT_K,
    PSYCHROMETRIC_PER_HPA,
    SATURATION_AT_FREEZING_HPA,
    saturation_pressure,
    saturation_pressure_water,
    saturation_slope,
    snow_share,
)

PSYCHROMETRIC_OVER_ICE = PSYCHROMETRIC_PER_HPA * LATENT_HEAT_VAPORISATION / LATENT_HEAT_SUBLIMATION


@phase
def simulate_step(b, t, cos_hour, sin_hour, sun_up, seconds, observed):
    """Advance a block by one step of `seconds`.

    t : number of the step in its day; cos_hour, sin_hour : of the hour angle at the middle of the step; sun_up :
    whether any lane may have sun; observed : the day's forcing (steps, 6, lanes), or (0, 6, lanes) for none.
    """
    if observed.shape[0] > 0:
        observed_air(b, observed[t])
    else:
        generated_air(b, cos_hour, sin_hour, seconds)
    stores_before(b)
    if sun_up:
        sunlight(b, t, cos_hour, seconds, observed)
    else:
        darkness(b)
    if any_snow(b):
        snowfall(b, seconds)
    else:
        no_snow(b)
    rainfall(b)
    conductances(b, seconds)
    solve_canopy(b)
    move_energy_and_water(b, seconds)
    move_carbon(b, seconds)
    balance(b, seconds)


@phase
def generated_air(b, cos_hour, sin_hour, seconds):
    """Air temperature, longwave and precipitation of the step, from the day's generated weather."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.air[i] = w.mean_temperature[i] + w.amplitude[i] * (cos_hour * w.cos_peak[i] + sin_hour * w.sin_peak[i])
        w.sky[i] = w.emissivity[i] * black_body(w.air[i] + FREEZING_POINT_K)
        w.precipitation_step[i] = w.precipitation[i] * (seconds / 86400.0)


@phase
def observed_air(b, row):
    """The same from observation; row : (6, lanes), columns as in `sim.state.FORCING`."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.air[i] = row[0, i]
        w.vapour[i] = row[1, i] * saturation_pressure_water(row[0, i])
        w.sky[i] = row[4, i]
        w.precipitation_step[i] = row[5, i]
        wind_exchange(b, i, row[2, i])


@phase
def stores_before(b):
    """Saturation, rain and snow of the step, and what is stored before it."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        w.saturation[i] = saturation_pressure(w.air[i])
        # The vapour of the day's mean is more than a cold night's air can hold: the rest is dew and fog, not followed.
        w.humidity[i] = min(w.vapour[i], w.saturation[i])
        w.deficit[i] = w.saturation[i] - w.humidity[i]
        w.snow[i] = w.precipitation_step[i] * snow_share(w.air[i])
        w.rain[i] = w.precipitation_step[i] - w.snow[i]
        ice = s.swe[i] + s.canopy_snow[i]
        w.energy_before[i] = (
            s.trunk_capacity[i] * s.trunk[i]
            + (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * s.ground[i]
            + s.surface_heat[i]
            + s.deep_heat[i]
            - LATENT_HEAT_FUSION * ice
        )
        w.water_before[i] = ice + s.canopy_rain[i] + s.soil_water[i]


@phase
def any_snow(b):
    """Whether snow falls or lies in any lane, in the canopy or on the ground."""
    s, w = b.s, b.w
    total = 0.0
    for i in range(len(s.swe)):
        total += w.snow[i] + s.canopy_snow[i] + s.swe[i]
    return total > 0.0


@phase
def snowfall(b, seconds):
    """Snow caught, sublimated, melted and shed by the canopy; what falls to the ground."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        capacity = snow_capacity(w.air[i], w.snow_area[i], p.snow_capacity_warm_mm[i], p.snow_capacity_cold_mm[i])
        caught = intercepted(w.snow[i], s.canopy_snow[i], capacity, w.snow_efficiency[i])
        store = s.canopy_snow[i] + caught
        ground_emission = black_body(s.ground[i] + FREEZING_POINT_K)
        air_emission = black_body(w.air[i] + FREEZING_POINT_K)
        net = w.canopy_sw[i] + w.longwave_cover[i] * (w.sky[i] + ground_emission - 2.0 * air_emission)
        lost = snow_sublimation(
            store, capacity, p.sublimation_exposure[i], net, w.canopy_air[i], w.deficit[i],
            saturation_slope(w.air[i], w.saturation[i]), PSYCHROMETRIC_OVER_ICE * p.air_pressure_hpa[i],
            LATENT_HEAT_SUBLIMATION, seconds,
        )  # fmt: skip
        store -= lost
        melted = snow_melt(store, capacity, w.air[i], w.canopy_air[i], LATENT_HEAT_FUSION, seconds)
        store -= melted
        fallen = unloaded(store, capacity, melted, p.snow_unloading_hours[i], p.snow_unloading_melt[i], seconds)
        s.canopy_snow[i] = store - fallen
        w.canopy_sublimation[i] = lost
        w.canopy_melt[i] = melted
        w.fixed[i] += (LATENT_HEAT_SUBLIMATION * lost + LATENT_HEAT_FUSION * melted) / seconds

        # Snow reaches the ground as cold as the air; the heat it brings is the heat its mass gains.
        ground_snow = w.snow[i] - caught + fallen
        w.advected[i] = ICE_HEAT_CAPACITY * ground_snow * min(w.air[i], 0.0)
        heat = (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * s.ground[i] + w.advected[i]
        s.swe[i] += ground_snow
        mixed = heat / (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i])
        s.ground[i] = mixed if ground_snow > 0.0 else s.ground[i]
        aged = snow_albedo(
            s.albedo[i], s.ground[i], ground_snow, p.snow_albedo_fresh[i], p.snow_albedo_old[i],
            p.snow_albedo_cold_hours[i], p.snow_albedo_melt_hours[i], p.snow_albedo_refresh_mm[i], seconds,
        )  # fmt: skip
        s.albedo[i] = aged if s.swe[i] > 0.0 else p.snow_albedo_fresh[i]


@phase
def no_snow(b):
    """The same without any snow."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.canopy_sublimation[i] = 0.0
        w.canopy_melt[i] = 0.0
        w.advected[i] = 0.0
        b.s.albedo[i] = b.p.snow_albedo_fresh[i]


@phase
def rainfall(b):
    """Rain and melt held by the canopy; what drips or falls through reaches the soil."""
    s, w = b.s, b.w
    for i in range(len(s.swe)):
        held = intercepted(w.rain[i], s.canopy_rain[i], w.rain_capacity[i], w.longwave_cover[i])
        wet = s.canopy_rain[i] + held + w.canopy_melt[i]
        drip = max(wet - w.rain_capacity[i], 0.0)
        s.canopy_rain[i] = wet - drip
        w.infiltration[i] = w.rain[i] - held + drip


@phase
def sunlight(b, t, cos_hour, seconds, observed):
    """Shortwave absorbed by canopy and ground, and photosynthesis."""
    s, p, w = b.s, b.p, b.w
    if observed.shape[0] > 0:
        for i in range(len(s.swe)):
            w.shortwave[i] = observed[t, 3, i]
    else:
        for i in range(len(s.swe)):
            w.shortwave[i] = w.top_of_canopy[i] * max(w.sun_a[i] + w.sun_b[i] * cos_hour, 0.0)
    for i in range(len(s.swe)):
        cos_zenith = max(w.sun_a[i] + w.sun_b[i] * cos_hour, 0.0)
        path = path_length(cos_zenith, p.slant_path[i], p.slant_path_max[i])
        beam_conifer, beam_deciduous = canopy_interception(
            path, w.crown_area[i], w.share_conifer[i], w.optical_conifer[i], w.optical_deciduous[i]
        )
        ground = surface_albedo(
            s.swe[i], w.snow_density[i], p.snow_cover_depth_m[i], s.albedo[i], p.ground_albedo[i]
        )  # fmt: skip
        w.canopy_sw[i], w.ground_sw[i], w.reflected[i], light_conifer, light_deciduous = shortwave(
            w.shortwave[i], w.diffuse[i], beam_conifer, beam_deciduous, w.sky_conifer[i], w.sky_deciduous[i],
            p.albedo_conifer[i], p.albedo_deciduous[i], ground,
        )  # fmt: skip
        stress = water_stress(s.soil_water[i], p.max_water_content_mm[i], p.water_stress_threshold[i], seconds)
        dry_conifer = 1.0 - stress_ramp(w.deficit[i], p.vpd_low_hpa[i], p.vpd_high_conifer_hpa[i])
        dry_deciduous = 1.0 - stress_ramp(w.deficit[i], p.vpd_low_hpa[i], p.vpd_high_deciduous_hpa[i])
        w.gpp_conifer[i] = photosynthesis(
            light_conifer, w.leaf_conifer[i], w.light_use_conifer[i], p.par_fraction[i],
            w.temperature_stress_conifer[i], dry_conifer, stress,
        )  # fmt: skip
        w.gpp_deciduous[i] = photosynthesis(
            light_deciduous, w.leaf_deciduous[i], w.light_use_deciduous[i], p.par_fraction[i],
            w.temperature_stress_deciduous[i], dry_deciduous, stress,
        )  # fmt: skip
        w.fixed[i] = 1000.0 * p.photosynthesis_energy[i] * (w.gpp_conifer[i] + w.gpp_deciduous[i])

        # Stomata open in light and above freezing; a lane in the dark is as in `darkness`, whatever its neighbours.
        open_stomata = 1.0 if w.air[i] > 0.0 and w.shortwave[i] > 0.0 else 0.0
        conifer = w.transpiration_conifer[i] * dry_conifer * w.temperature_stress_conifer[i]
        deciduous = w.transpiration_deciduous[i] * dry_deciduous * w.temperature_stress_deciduous[i]
        w.leaf_coefficient[i] = (conifer + deciduous) * stress * open_stomata


@phase
def darkness(b):
    """The same at night."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.shortwave[i] = 0.0
        w.canopy_sw[i] = 0.0
        w.ground_sw[i] = 0.0
        w.reflected[i] = 0.0
        w.gpp_conifer[i] = 0.0
        w.gpp_deciduous[i] = 0.0
        w.fixed[i] = 0.0
        w.leaf_coefficient[i] = 0.0


@phase
def conductances(b, seconds):
    """Conductances at the start of the step, evaporation coefficients, and the nodes' answer to the canopy."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        slope = saturation_slope(w.air[i], w.saturation[i])
        equilibrium = slope / (slope + PSYCHROMETRIC_PER_HPA * p.air_pressure_hpa[i])
        wet_share = s.canopy_rain[i] / w.rain_capacity[i] if w.rain_capacity[i] > 0.0 else 0.0
        dry = (1.0 - wet_share) * equilibrium * w.leaf_coefficient[i]
        wet = wet_share * equilibrium * p.priestley_taylor_wet[i]
        # Above 35 degC Priestley and Taylor's 1.26 would evaporate more than the net radiation.
        all_of_it = max(dry + wet, 1.0)
        w.dry_coefficient[i] = dry / all_of_it
        w.wet_coefficient[i] = wet / all_of_it
        w.wet_limit[i] = LATENT_HEAT_VAPORISATION * s.canopy_rain[i] / seconds

        velocity = w.ground_velocity[i] * stability(
            s.ground[i], w.air[i], w.wind_below[i], p.ground_reference_height_m[i],
            p.stability_factor[i], p.instability_limit[i],
        )  # fmt: skip
        w.ground_conductance[i] = max(w.air_density[i] * AIR_HEAT_CAPACITY * velocity, p.minimum_conductance[i])

        emission = black_body(s.ground[i] + FREEZING_POINT_K)
        emission_slope = black_body_slope(s.ground[i] + FREEZING_POINT_K)
        snow = s.swe[i] > 0.0
        ice = min(s.ground[i], 0.0)  # snow that falls on a warm skin is at 0 degC
        over_ice = saturation_pressure(ice)
        ice_slope = saturation_slope(ice, over_ice)
        # No more snow than there is can sublimate within the step, even at 0 degC: the limit is on the conductance,
        # so that the ground's equation and what is moved agree.
        drying = max(SATURATION_AT_FREEZING_HPA - w.humidity[i], 1e-3)
        transfer = min(w.vapour_density[i] * velocity, s.swe[i] / (seconds * drying))
        stress = water_stress(s.soil_water[i], p.max_water_content_mm[i], p.water_stress_threshold[i], seconds)
        sky_and_canopy = longwave_down(w.sky[i], black_body(w.air[i] + FREEZING_POINT_K), w.longwave_cover[i])
        available = w.ground_sw[i] + p.ground_emissivity[i] * (sky_and_canopy - emission)
        moist = p.priestley_taylor_ground[i] * equilibrium * stress if w.air[i] > 0.0 else 0.0
        w.ground_latent[i] = (
            LATENT_HEAT_SUBLIMATION * transfer * (over_ice - w.humidity[i]) if snow else moist * max(available, 0.0)
        )
        w.latent_slope[i] = LATENT_HEAT_SUBLIMATION * transfer * ice_slope if snow else 0.0

        w.surface[i] = temperature(
            s.surface_heat[i], w.surface_thawed[i], w.surface_frozen[i], w.surface_latent[i], p.soil_freezing_range_k[i]
        )
        w.deep[i] = temperature(
            s.deep_heat[i], w.deep_thawed[i], w.deep_frozen[i], w.deep_latent[i], p.soil_freezing_range_k[i]
        )
        frozen_value = p.soil_conductivity[i] * w.frozen_ratio[i]
        soil_surface = conductivity(
            frozen_share(w.surface[i], p.soil_freezing_range_k[i]), p.soil_conductivity[i], frozen_value
        )
        soil_deep = conductivity(
            frozen_share(w.deep[i], p.soil_freezing_range_k[i]), p.soil_conductivity[i], frozen_value
        )
        organic = conductivity(
            frozen_share(0.5 * (s.ground[i] + w.surface[i]), p.soil_freezing_range_k[i]),
            p.organic_conductivity_thawed[i],
            p.organic_conductivity_frozen[i],
        )
        w.surface_conductance[i] = 1.0 / (
            s.swe[i] / (w.snow_density[i] * w.snow_conductivity[i])
            + s.organic_depth[i] * p.moss[i] / organic
            + w.half_surface[i] / soil_surface
        )
        w.deep_conductance[i] = 1.0 / (w.half_surface[i] / soil_surface + w.half_deep[i] / soil_deep)
        w.boundary_conductance[i] = soil_deep / w.deep_to_boundary[i]

        surface_inertia = (
            heat_capacity(
                w.surface[i], w.surface_thawed[i], w.surface_frozen[i], w.surface_latent[i], p.soil_freezing_range_k[i]
            )
            / seconds
        )
        deep_inertia = (
            heat_capacity(w.deep[i], w.deep_thawed[i], w.deep_frozen[i], w.deep_latent[i], p.soil_freezing_range_k[i])
            / seconds
        )
        (
            w.deep_base[i], w.deep_by_surface[i], w.surface_base[i], w.surface_by_ground[i], w.trunk_base[i],
            w.trunk_by_canopy[i], w.trunk_by_ground[i], w.ground_base[i], w.ground_by_emission[i],
            w.ground_by_canopy[i], stiffness,
        ) = respond_to_canopy(
            s.trunk[i], s.trunk_capacity[i] / seconds, w.trunk_canopy[i], w.trunk_air[i], w.trunk_ground[i],
            s.ground[i], (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) / seconds, w.ground_conductance[i],
            w.ground_sw[i] + p.ground_emissivity[i] * (1.0 - w.longwave_cover[i]) * w.sky[i]
            - w.ground_latent[i] + w.latent_slope[i] * (ice - s.ground[i]),
            emission, emission_slope, w.latent_slope[i], p.ground_emissivity[i], w.longwave_cover[i], w.air[i],
            w.surface[i], surface_inertia, w.surface_conductance[i],
            w.deep[i], deep_inertia, w.deep_conductance[i], w.boundary_conductance[i],
            p.deep_boundary_temperature_k[i] - FREEZING_POINT_K,
        )  # fmt: skip
        # At 0 degC some snow sublimates and the rest can melt; beyond, its heat capacity and its vapour are gone.
        sublimating = (w.ground_latent[i] - w.latent_slope[i] * ice) * seconds / LATENT_HEAT_SUBLIMATION
        meltable = s.swe[i] - sublimating if snow else 0.0
        w.melt_span[i] = LATENT_HEAT_FUSION * max(meltable, 0.0) / (seconds * stiffness)
        w.bare_gain[i] = stiffness / (stiffness - ICE_HEAT_CAPACITY * s.swe[i] / seconds - w.latent_slope[i])
        w.trial[i] = s.canopy[i]
        w.low[i] = w.air[i] - 100.0
        w.high[i] = w.air[i] + 100.0


@phase
def canopy_residual(b):
    """Residual of the canopy's balance at the trial temperatures; returns whether any lane is still off."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        w.residual[i], w.slope[i], w.net[i], w.ground_new[i] = canopy_balance(
            w.trial[i], w.fixed[i], w.canopy_sw[i], w.sky[i], w.longwave_cover[i], p.ground_emissivity[i],
            s.ground[i], w.melt_span[i], w.bare_gain[i],
            w.ground_base[i], w.ground_by_emission[i], w.ground_by_canopy[i],
            w.trunk_base[i], w.trunk_by_canopy[i], w.trunk_by_ground[i], w.trunk_canopy[i],
            w.air[i], w.canopy_air[i], w.dry_coefficient[i], w.wet_coefficient[i], w.wet_limit[i],
        )  # fmt: skip
    off = 0.0
    for i in range(len(s.swe)):
        off += 0.0 if abs(w.residual[i]) <= NEWTON_TOLERANCE else 1.0
    return off > 0.0


@phase
def solve_canopy(b):
    """Newton's method for all lanes together; a lane that has converged stays where it is."""
    w = b.w
    iterations = 0
    while canopy_residual(b) and iterations < NEWTON_LIMIT:
        for i in range(len(w.trial)):
            proposal, low, high = newton_step(w.trial[i], w.residual[i], w.slope[i], w.low[i], w.high[i])
            off = abs(w.residual[i]) > NEWTON_TOLERANCE
            w.trial[i] = proposal if off else w.trial[i]
            w.low[i] = low
            w.high[i] = high
        iterations += 1


@phase
def move_energy_and_water(b, seconds):
    """Fluxes at the step's temperatures, moved between the stores."""
    s, p, w, r = b.s, b.p, b.w, b.r
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
        transpired = w.dry_coefficient[i] * available * seconds / LATENT_HEAT_VAPORISATION
        evaporated = min(w.wet_coefficient[i] * available, w.wet_limit[i]) * seconds / LATENT_HEAT_VAPORISATION
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
        sublimated = min(latent * seconds / LATENT_HEAT_SUBLIMATION, s.swe[i]) if snow else 0.0
        soil_evaporated = 0.0 if snow else latent * seconds / LATENT_HEAT_VAPORISATION
        latent = (LATENT_HEAT_SUBLIMATION * sublimated + LATENT_HEAT_VAPORISATION * soil_evaporated) / seconds

        # The ground's enthalpy: snow that sublimates takes its own sensible heat along; what would warm snow above
        # 0 degC melts it; what is left after the last snow warms the skin.
        carried = ICE_HEAT_CAPACITY * sublimated * s.ground[i]
        heat = (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * s.ground[i] - carried
        heat += seconds * (
            w.ground_sw[i] + p.ground_emissivity[i] * (down - ground_emission)
            - ground_heat - latent + trunk_to_ground - ground_to_surface
        )  # fmt: skip
        s.swe[i] -= sublimated
        melted = min(max(heat, 0.0) / LATENT_HEAT_FUSION, s.swe[i]) if snow else 0.0
        heat -= LATENT_HEAT_FUSION * melted
        s.swe[i] -= melted
        s.ground[i] = heat / (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i])

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
        r.deep_heat_gain_mj_m2[i] += 1e-6 * seconds * (surface_to_deep - deep_to_boundary)
        w.soil_heat_sum[i] += 1e-6 * seconds * ground_to_surface
        w.thaw_heat[i] += seconds * max(surface_to_deep, 0.0) if w.surface[i] > 0.0 else 0.0
        w.air_sum[i] += w.air[i]
        w.canopy_sum[i] += canopy
        w.ground_sum[i] += s.ground[i]
        w.surface_sum[i] += w.surface[i]
        w.deep_sum[i] += w.deep[i]
        w.surface_max[i] = max(w.surface_max[i], w.surface[i])
        r.canopy_residual_w_m2[i] = max(r.canopy_residual_w_m2[i], abs(w.residual[i]))


@phase
def move_carbon(b, seconds):
    """Photosynthesis and respiration, moved between air, trees and soil."""
    s, p, w, r = b.s, b.p, b.w, b.r
    for i in range(len(s.swe)):
        before = s.conifer_biomass[i] + s.deciduous_biomass[i] + s.soil_carbon[i]
        warmth = q10_factor(w.air[i], p.respiration_reference_c[i], w.log_q10[i])
        conifer = warmth * maintenance(
            p.base_respiration[i], w.lai_conifer[i], s.conifer_biomass[i],
            p.maintenance_leaf_share[i], p.reference_lai[i], p.reference_biomass_kgc_m2[i],
        )  # fmt: skip
        deciduous = warmth * maintenance(
            p.base_respiration[i], w.lai_deciduous[i], s.deciduous_biomass[i],
            p.maintenance_leaf_share[i], p.reference_lai[i], p.reference_biomass_kgc_m2[i],
        )  # fmt: skip
        conifer = autotrophic(w.gpp_conifer[i], conifer, p.growth_respiration[i], s.conifer_biomass[i], seconds)
        deciduous = autotrophic(
            w.gpp_deciduous[i], deciduous, p.growth_respiration[i], s.deciduous_biomass[i], seconds
        )
        soil = (
            p.soil_respiration[i] * s.soil_carbon[i] / (p.reference_soil_carbon[i] * SECONDS_PER_YEAR) * seconds
            * q10_factor(w.surface[i], p.respiration_reference_c[i], w.log_q10[i])
        )  # fmt: skip
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


@phase
def balance(b, seconds):
    """Whether the stores changed by what crossed the stand's boundary, energy and water."""
    s, p, w, r = b.s, b.p, b.w, b.r
    for i in range(len(s.swe)):
        ice = s.swe[i] + s.canopy_snow[i]
        energy = (
            s.trunk_capacity[i] * s.trunk[i]
            + (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * s.ground[i]
            + s.surface_heat[i]
            + s.deep_heat[i]
            - LATENT_HEAT_FUSION * ice
        )
        water = ice + s.canopy_rain[i] + s.soil_water[i]
        energy_failure = abs(energy - w.energy_before[i] - w.energy_gain[i]) / seconds
        water_failure = abs(water - w.water_before[i] - w.water_gain[i])
        r.energy_residual_w_m2[i] = max(r.energy_residual_w_m2[i], energy_failure)
        r.water_residual_mm[i] = max(r.water_residual_mm[i], water_failure)
