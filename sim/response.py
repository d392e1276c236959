"""How trunk, ground and soil answer to the canopy within an implicit step: each a line in the canopy's temperature."""

from sim.ground_heat import ground_conductances
from sim.jit import compiled
from sim.organic import organic_capacities
from sim.physical_constants import (
    AIR_HEAT_CAPACITY,
    FREEZING_POINT_K,
    ICE_HEAT_CAPACITY,
    LATENT_HEAT_FUSION,
    LATENT_HEAT_SUBLIMATION,
)
from sim.radiation import black_body, black_body_slope
from sim.snow import ground_capacity
from sim.soil import boundary_temperature, heat_capacity


@compiled
def respond_to_canopy(
    trunk,
    trunk_inertia,
    trunk_canopy,
    trunk_air,
    trunk_ground,
    ground,
    ground_inertia,
    ground_air,
    ground_source,
    ground_emission,
    ground_emission_slope,
    vapour_slope,
    ground_emissivity,
    cover,
    air,
    organic,
    organic_inertia,
    ground_organic,
    surface,
    surface_inertia,
    organic_surface,
    deep,
    deep_inertia,
    surface_deep,
    deep_boundary,
    boundary,
):
    """Answer of trunk, ground, organic layer and soil to the canopy within an implicit step, from the bottom up.

    Temperatures in degC at the start of the step, inertias (heat capacity / time step) and conductances in
    W m-2 K-1. Every node's balance is linear (the ground's emission about its old temperature), so each is a line
    in the temperature of the node above it; what remains is the canopy's own equation.
    Returns the coefficients (deep_base, deep_by_surface, surface_base, surface_by_organic, organic_base,
    organic_by_ground, trunk_base, trunk_by_canopy, trunk_by_ground, ground_base, ground_by_emission,
    ground_by_canopy), the ground's stiffness [W m-2 K-1] and its inverse, `yielding`.
    """
    yielding = 1.0 / (deep_inertia + deep_boundary + surface_deep)
    deep_base = (deep_inertia * deep + deep_boundary * boundary) * yielding
    deep_by_surface = surface_deep * yielding

    yielding = 1.0 / (surface_inertia + organic_surface + surface_deep * (1.0 - deep_by_surface))
    surface_base = (surface_inertia * surface + surface_deep * deep_base) * yielding
    surface_by_organic = organic_surface * yielding

    yielding = 1.0 / (organic_inertia + ground_organic + organic_surface * (1.0 - surface_by_organic))
    organic_base = (organic_inertia * organic + organic_surface * surface_base) * yielding
    organic_by_ground = ground_organic * yielding

    yielding = 1.0 / (trunk_inertia + trunk_canopy + trunk_air + trunk_ground)
    trunk_base = (trunk_inertia * trunk + trunk_air * air) * yielding
    trunk_by_canopy = trunk_canopy * yielding
    trunk_by_ground = trunk_ground * yielding

    # Here too what is known last is added last (see `sim.canopy.canopy_balance`).
    stiffness = (
        ground_inertia
        + ground_emissivity * ground_emission_slope
        + trunk_ground * (1.0 - trunk_by_ground)
        + ground_air
        + vapour_slope
        + ground_organic * (1.0 - organic_by_ground)
    )
    yielding = 1.0 / stiffness
    ground_base = (
        ground_inertia * ground
        - ground_emissivity * (ground_emission - ground_emission_slope * ground)
        + trunk_ground * trunk_base
        + (ground_air * air + vapour_slope * ground)
        + ground_source
        + ground_organic * organic_base
    ) * yielding
    ground_by_emission = ground_emissivity * cover * yielding
    ground_by_canopy = trunk_ground * trunk_by_canopy * yielding
    return (
        deep_base,
        deep_by_surface,
        surface_base,
        surface_by_organic,
        organic_base,
        organic_by_ground,
        trunk_base,
        trunk_by_canopy,
        trunk_by_ground,
        ground_base,
        ground_by_emission,
        ground_by_canopy,
        stiffness,
        yielding,
    )


@compiled
def answer_to_canopy(b, seconds):
    """The nodes' answer to the canopy, from the soil's conductances at the start of the step; where Newton starts."""
    s, p, w = b.s, b.p, b.w
    per_second = 1.0 / seconds
    for i in range(len(s.swe)):
        ground_conductances(b, i)
        exchange = w.air_density[i] * AIR_HEAT_CAPACITY * w.ground_exchange[i]
        w.ground_conductance[i] = max(exchange, p.minimum_conductance[i])
        snow = s.swe[i] > 0.0
        evaporating = min(s.ground[i], 0.0) if snow else s.ground[i]
        organic_thawed, organic_frozen, organic_latent = organic_capacities(b, i)
        organic_capacity = heat_capacity(
            w.organic[i], organic_thawed, organic_frozen, organic_latent, p.soil_freezing_range_k[i]
        )
        surface_capacity = heat_capacity(
            w.surface[i], w.surface_thawed[i], w.surface_frozen[i], w.surface_latent[i], p.soil_freezing_range_k[i]
        )
        deep_capacity = heat_capacity(
            w.deep[i], w.deep_thawed[i], w.deep_frozen[i], w.deep_latent[i], p.soil_freezing_range_k[i]
        )
        (
            w.deep_base[i],
            w.deep_by_surface[i],
            w.surface_base[i],
            w.surface_by_organic[i],
            w.organic_base[i],
            w.organic_by_ground[i],
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
            ground_capacity(s.swe[i], p.skin_heat_capacity[i]) * per_second,
            w.ground_conductance[i],
            w.ground_sw[i]
            + p.ground_emissivity[i] * (1.0 - w.longwave_cover[i]) * w.sky[i]
            - w.ground_latent[i]
            + w.latent_slope[i] * (evaporating - s.ground[i]),
            black_body(s.ground[i] + FREEZING_POINT_K),
            black_body_slope(s.ground[i] + FREEZING_POINT_K),
            w.latent_slope[i],
            p.ground_emissivity[i],
            w.longwave_cover[i],
            w.air[i],
            w.organic[i],
            per_second * organic_capacity,
            w.organic_conductance[i],
            w.surface[i],
            per_second * surface_capacity,
            w.surface_conductance[i],
            w.deep[i],
            per_second * deep_capacity,
            w.deep_conductance[i],
            w.boundary_conductance[i],
            boundary_temperature(b, i),
        )
        # At 0 degC some snow sublimates and the rest can melt; beyond, its heat capacity and its vapour are gone.
        sublimating = (w.ground_latent[i] - w.latent_slope[i] * evaporating) * (seconds / LATENT_HEAT_SUBLIMATION)
        meltable = s.swe[i] - sublimating if snow else 0.0
        w.melt_span[i] = LATENT_HEAT_FUSION * max(meltable, 0.0) * (per_second * yielding)
        w.trial[i] = s.canopy[i]
        w.low[i] = w.air[i] - 100.0
        w.high[i] = w.air[i] + 300.0  # a few trees in calm air, and a low sun that shines on nothing else
        gone = ICE_HEAT_CAPACITY * s.swe[i] * per_second + w.latent_slope[i] if snow else 0.0
        w.bare_gain[i] = stiffness / (stiffness - gone)
