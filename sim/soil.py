"""Soil heat: moss and organic layer, two nodes that freeze by enthalpy, and the fixed boundary far below.

Enthalpy in J m-2 with 0 at thawed soil of 0 degC. The water that freezes is a property of the column, apart from
the bucket of `sim.water`. Where several functions divide by the freezing range, each multiplies by 1 / range: the
compiler makes one division of them all.
"""

import math

from sim.jit import compiled


@compiled
def temperature(enthalpy, thawed, frozen, latent, freezing_range) -> float:
    """Temperature [degC] of a node: thawed above 0, freezing over `freezing_range` [K] below 0, then frozen.

    thawed, frozen : heat capacities [J m-2 K-1]; latent : heat of the node's freezing water [J m-2].
    """
    bottom = -(latent + frozen * freezing_range)
    cold = enthalpy <= bottom
    capacity = thawed if enthalpy >= 0.0 else (frozen if cold else latent * (1.0 / freezing_range) + frozen)
    return (enthalpy - (bottom if cold else 0.0)) / capacity - (freezing_range if cold else 0.0)


@compiled
def enthalpy(node_temperature, thawed, frozen, latent, freezing_range) -> float:
    """Inverse of `temperature`."""
    if node_temperature >= 0.0:
        return thawed * node_temperature
    if node_temperature > -freezing_range:
        return (latent / freezing_range + frozen) * node_temperature
    return -(latent + frozen * freezing_range) + frozen * (node_temperature + freezing_range)


@compiled
def heat_capacity(node_temperature, thawed, frozen, latent, freezing_range) -> float:
    """Slope of enthalpy [J m-2 K-1], freezing included."""
    freezing = latent * (1.0 / freezing_range) + frozen
    return thawed if node_temperature >= 0.0 else (freezing if node_temperature > -freezing_range else frozen)


@compiled
def frozen_share(node_temperature, freezing_range) -> float:
    """Share of the water that is ice."""
    return min(max(-node_temperature * (1.0 / freezing_range), 0.0), 1.0)


@compiled
def conductivity(frozen, thawed_value, frozen_value) -> float:
    """Conductivity [W m-1 K-1] between thawed and frozen."""
    return thawed_value + (frozen_value - thawed_value) * frozen


@compiled
def in_series(first_depth, first, second_depth, second) -> float:
    """Conductance [W m-2 K-1] of two layers, one upon the other, from depths [m] and conductivities [W m-1 K-1]."""
    return first * second / (first_depth * second + second_depth * first)


@compiled
def organic_layer(depth, conifer, deciduous, depth_conifer, depth_deciduous, depth_open, growth, loss_years) -> float:
    """Depth of the organic layer [m] a year later, toward the equilibrium of the canopy above it."""
    equilibrium = conifer * depth_conifer + deciduous * depth_deciduous + (1.0 - conifer - deciduous) * depth_open
    gap = equilibrium - depth
    return depth + (min(gap, growth) if gap > 0.0 else gap / loss_years)


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
    surface,
    surface_inertia,
    ground_surface,
    deep,
    deep_inertia,
    surface_deep,
    deep_boundary,
    boundary,
):
    """Answer of trunk, ground and soil to the canopy within an implicit step, from the bottom up.

    Temperatures in degC at the start of the step, inertias (heat capacity / time step) and conductances in
    W m-2 K-1. Every node's balance is linear (the ground's emission about its old temperature), so each is a line
    in the temperature of the node above it; what remains is the canopy's own equation.
    Returns the coefficients (deep_base, deep_by_surface, surface_base, surface_by_ground, trunk_base,
    trunk_by_canopy, trunk_by_ground, ground_base, ground_by_emission, ground_by_canopy), the ground's stiffness
    [W m-2 K-1] and its inverse, `yielding`.
    """
    yielding = 1.0 / (deep_inertia + deep_boundary + surface_deep)
    deep_base = (deep_inertia * deep + deep_boundary * boundary) * yielding
    deep_by_surface = surface_deep * yielding

    yielding = 1.0 / (surface_inertia + ground_surface + surface_deep * (1.0 - deep_by_surface))
    surface_base = (surface_inertia * surface + surface_deep * deep_base) * yielding
    surface_by_ground = ground_surface * yielding

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
        + ground_surface * (1.0 - surface_by_ground)
    )
    yielding = 1.0 / stiffness
    ground_base = (
        ground_inertia * ground
        - ground_emissivity * (ground_emission - ground_emission_slope * ground)
        + trunk_ground * trunk_base
        + (ground_air * air + vapour_slope * ground)
        + ground_source
        + ground_surface * surface_base
    ) * yielding
    ground_by_emission = ground_emissivity * cover * yielding
    ground_by_canopy = trunk_ground * trunk_by_canopy * yielding
    return (
        deep_base,
        deep_by_surface,
        surface_base,
        surface_by_ground,
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
def thaw_depth(
    organic,
    warmth,
    seconds,
    deep,
    boundary,
    deep_node,
    boundary_depth,
    thawed_conductivity,
    frozen_conductivity,
    organic_conductivity,
    thawed_capacity,
    frozen_capacity,
    latent,
):
    """Active-layer depth [m], from the organic surface; down to the permafrost where that lies below the deep node.

    Stefan's: what a season's warmth at the ground [K s], `seconds` long, conducts through organic layer and thawed soil
    melts the water [latent, J m-3], warms thawed soil to half the mean temperature of its top, and goes on into soil
    as cold as the deep node in the year's mean (Carslaw and Jaeger 1959, 2.4: 2 dT sqrt(k C t / pi)).
    Capacities in J m-3 K-1.
    """
    if deep > 0.0:
        share = deep / (deep - boundary) if boundary < 0.0 else 1.0
        return organic + deep_node + share * (boundary_depth - deep_node)
    top = 0.5 * warmth / seconds if seconds > 0.0 else 0.0
    heat = latent + 0.5 * thawed_capacity * top
    cold = -2.0 * deep * math.sqrt(frozen_conductivity * frozen_capacity * seconds / math.pi)
    above = organic * thawed_conductivity / organic_conductivity
    linear = above * heat + 0.5 * cold
    square = linear * linear + 2.0 * heat * (thawed_conductivity * warmth - above * cold)
    front = (math.sqrt(max(square, 0.0)) - linear) / heat if heat > 0.0 else 0.0
    return organic + min(max(front, 0.0), boundary_depth)
