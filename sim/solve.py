"""The temperatures of a step: conductances, the nodes' answer to the canopy, and Newton's method for the canopy."""

from sim.canopy import NEWTON_LIMIT, NEWTON_TOLERANCE, canopy_balance, newton_step
from sim.jit import compiled
from sim.radiation import black_body, black_body_slope, longwave_down
from sim.snow import (
    AIR_HEAT_CAPACITY,
    ICE_HEAT_CAPACITY,
    LATENT_HEAT_FUSION,
    LATENT_HEAT_SUBLIMATION,
    LATENT_HEAT_VAPORISATION,
    stability,
)
from sim.soil import conductivity, frozen_share, heat_capacity, in_series, respond_to_canopy, temperature
from sim.weather import (
    FREEZING_POINT_K,
    PSYCHROMETRIC_PER_HPA,
    SATURATION_AT_FREEZING_HPA,
    saturation_pressure,
    saturation_slope,
)


@compiled
def ground_exchange(b):
    """Exchange of the ground with the air [m s-1] at the start of the step."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        w.ground_exchange[i] = w.ground_velocity[i] * stability(
            s.ground[i],
            w.air[i],
            w.wind_below[i],
            p.ground_reference_height_m[i],
            p.stability_factor[i],
            p.instability_limit[i],
        )


@compiled
def snow_vapour(b, seconds):
    """Latent heat from lying snow at the start of the step, and its slope by the ground's temperature."""
    s, w = b.s, b.w
    for i in range(len(s.swe)):
        ice = min(s.ground[i], 0.0)  # snow that falls on a warm skin is at 0 degC
        over_ice = saturation_pressure(ice)
        # At 0 degC, no more vapour is exchanged within the step than snow lies there: the limit is on the conductance,
        # so that the ground's equation and what is moved agree.
        drying = max(abs(SATURATION_AT_FREEZING_HPA - w.humidity[i]), 1e-3)
        transfer = min(w.vapour_density[i] * w.ground_exchange[i], s.swe[i] / (seconds * drying))
        w.snow_latent[i] = LATENT_HEAT_SUBLIMATION * transfer * (over_ice - w.humidity[i])
        w.latent_slope[i] = LATENT_HEAT_SUBLIMATION * transfer * saturation_slope(ice, over_ice)


@compiled
def conductances(b, seconds):
    """Conductances at the start of the step, evaporation coefficients, and the nodes' answer to the canopy."""
    s, p, w = b.s, b.p, b.w
    per_second = 1.0 / seconds
    for i in range(len(s.swe)):
        slope = w.saturation_slope[i]
        equilibrium = slope / (slope + PSYCHROMETRIC_PER_HPA * p.air_pressure_hpa[i])
        wet_share = s.canopy_rain[i] * w.per_rain_capacity[i]
        dry = (1.0 - wet_share) * equilibrium * w.leaf_coefficient[i]
        wet = wet_share * equilibrium * p.priestley_taylor_wet[i]
        # Above 35 degC Priestley and Taylor's 1.26 would evaporate more than the net radiation.
        scale = 1.0 / max(dry + wet, 1.0)
        w.dry_coefficient[i] = dry * scale
        w.wet_coefficient[i] = wet * scale
        w.wet_limit[i] = LATENT_HEAT_VAPORISATION * per_second * s.canopy_rain[i]

        exchange = w.air_density[i] * AIR_HEAT_CAPACITY * w.ground_exchange[i]
        w.ground_conductance[i] = max(exchange, p.minimum_conductance[i])
        emission = black_body(s.ground[i] + FREEZING_POINT_K)
        emission_slope = black_body_slope(s.ground[i] + FREEZING_POINT_K)
        snow = s.swe[i] > 0.0
        ice = min(s.ground[i], 0.0)
        sky_and_canopy = longwave_down(w.sky[i], w.air_emission[i], w.longwave_cover[i])
        available = w.ground_sw[i] + p.ground_emissivity[i] * (sky_and_canopy - emission)
        thawed = w.air[i] > 0.0 and s.ground[i] > 0.0
        moist = min(p.priestley_taylor_ground[i] * equilibrium * w.water_stress[i], 1.0) if thawed else 0.0
        snow_latent = w.snow_latent[i]  # loaded first, as in `sim.day.wind_exchange`
        w.ground_latent[i] = snow_latent if snow else moist * max(available, 0.0)

        w.surface[i] = temperature(
            s.surface_heat[i], w.surface_thawed[i], w.surface_frozen[i], w.surface_latent[i], p.soil_freezing_range_k[i]
        )
        w.deep[i] = temperature(
            s.deep_heat[i], w.deep_thawed[i], w.deep_frozen[i], w.deep_latent[i], p.soil_freezing_range_k[i]
        )
        frozen_value = p.soil_conductivity[i] * w.frozen_ratio[i]
        # A node thicker than the front's daily reach freezes and thaws from above: its upper half is as the ground is.
        soil_upper = conductivity(
            frozen_share(s.ground[i], p.soil_freezing_range_k[i]), p.soil_conductivity[i], frozen_value
        )
        soil_lower = conductivity(
            frozen_share(w.surface[i], p.soil_freezing_range_k[i]), p.soil_conductivity[i], frozen_value
        )
        soil_deep = conductivity(
            frozen_share(w.deep[i], p.soil_freezing_range_k[i]), p.soil_conductivity[i], frozen_value
        )
        boundary = p.deep_boundary_temperature_k[i] - FREEZING_POINT_K
        soil_below = conductivity(
            frozen_share(0.5 * (w.deep[i] + boundary), p.soil_freezing_range_k[i]), p.soil_conductivity[i], frozen_value
        )
        organic = conductivity(
            frozen_share(0.5 * (s.ground[i] + w.surface[i]), p.soil_freezing_range_k[i]),
            p.organic_conductivity_thawed[i],
            p.organic_conductivity_frozen[i],
        )
        w.upper_soil[i] = w.half_surface[i] / soil_upper
        above_and_below = s.swe[i] * w.snow_resistance[i] + w.upper_soil[i]  # of the organic layer
        w.surface_conductance[i] = in_series(above_and_below, 1.0, s.organic_depth[i] * p.moss[i], organic)
        w.deep_conductance[i] = in_series(w.half_surface[i], soil_lower, w.above_deep_node[i], soil_deep)
        w.boundary_conductance[i] = soil_below * w.per_below_deep_node[i]

        surface_inertia = per_second * heat_capacity(
            w.surface[i], w.surface_thawed[i], w.surface_frozen[i], w.surface_latent[i], p.soil_freezing_range_k[i]
        )
        deep_inertia = per_second * heat_capacity(
            w.deep[i], w.deep_thawed[i], w.deep_frozen[i], w.deep_latent[i], p.soil_freezing_range_k[i]
        )
        (
            w.deep_base[i],
            w.deep_by_surface[i],
            w.surface_base[i],
            w.surface_by_ground[i],
            w.trunk_base[i],
            w.trunk_by_canopy[i],
            w.trunk_by_ground[i],
            w.ground_base[i],
            w.ground_by_emission[i],
            w.ground_by_canopy[i],
            stiffness,
            yielding,
        ) = respond_to_canopy(
            s.trunk[i],
            s.trunk_capacity[i] * per_second,
            w.trunk_canopy[i],
            w.trunk_air[i],
            w.trunk_ground[i],
            s.ground[i],
            (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * per_second,
            w.ground_conductance[i],
            w.ground_sw[i]
            + p.ground_emissivity[i] * (1.0 - w.longwave_cover[i]) * w.sky[i]
            - w.ground_latent[i]
            + w.latent_slope[i] * (ice - s.ground[i]),
            emission,
            emission_slope,
            w.latent_slope[i],
            p.ground_emissivity[i],
            w.longwave_cover[i],
            w.air[i],
            w.surface[i],
            surface_inertia,
            w.surface_conductance[i],
            w.deep[i],
            deep_inertia,
            w.deep_conductance[i],
            w.boundary_conductance[i],
            boundary,
        )
        # At 0 degC some snow sublimates and the rest can melt; beyond, its heat capacity and its vapour are gone.
        sublimating = (w.ground_latent[i] - w.latent_slope[i] * ice) * (seconds / LATENT_HEAT_SUBLIMATION)
        meltable = s.swe[i] - sublimating if snow else 0.0
        w.melt_span[i] = LATENT_HEAT_FUSION * max(meltable, 0.0) * (per_second * yielding)
        w.bare_gain[i] = stiffness / (stiffness - ICE_HEAT_CAPACITY * s.swe[i] * per_second - w.latent_slope[i])
        w.trial[i] = s.canopy[i]
        w.low[i] = w.air[i] - 100.0
        w.high[i] = w.air[i] + 300.0  # a few trees in calm air, and a low sun that shines on nothing else


@compiled
def newton_iteration(b):
    """Balance of the canopies at their trial temperatures; those that are off get another. Returns how many."""
    s, p, w = b.s, b.p, b.w
    moved = 0
    for i in range(len(s.swe)):
        trial, low, high = w.trial[i], w.low[i], w.high[i]
        residual, slope, by_emission, w.net[i], w.ground_new[i] = canopy_balance(
            trial,
            w.fixed[i],
            w.canopy_sw[i],
            w.sky[i],
            w.longwave_cover[i],
            p.ground_emissivity[i],
            s.ground[i],
            w.melt_span[i],
            w.bare_gain[i],
            w.ground_base[i],
            w.ground_by_emission[i],
            w.ground_by_canopy[i],
            w.trunk_base[i],
            w.trunk_by_canopy[i],
            w.trunk_by_ground[i],
            w.trunk_canopy[i],
            w.air[i],
            w.canopy_air[i],
            w.dry_coefficient[i],
            w.wet_coefficient[i],
            w.wet_limit[i],
        )
        off = abs(residual) > NEWTON_TOLERANCE  # not where it is no number: that stays, for closure to find
        proposal, low, high = newton_step(trial, residual, slope, by_emission, low, high)
        w.residual[i] = residual
        w.trial[i] = proposal if off else trial
        w.low[i] = low
        w.high[i] = high
        moved += 1 if off else 0
    return moved


@compiled
def solve_canopy(b):
    """Newton's method for all lanes together; a lane that has converged stays where it is."""
    iterations = 0
    while newton_iteration(b) > 0 and iterations < NEWTON_LIMIT:
        iterations += 1
