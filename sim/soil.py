"""Mineral soil: two nodes that freeze by enthalpy, and the fixed boundary far below.

Enthalpy in J m-2 with 0 at thawed soil of 0 degC. The water that freezes is a property of the column, apart from
the bucket of `sim.water`. Where several functions divide by the freezing range, each multiplies by 1 / range: the
compiler makes one division of them all.
"""

from sim.jit import compiled
from sim.physical_constants import FREEZING_POINT_K, LATENT_HEAT_FUSION, WATER_DENSITY


@compiled
def where_it_freezes(freezes, thawed, frozen) -> float:
    """A property of frozen soil: the thawed soil's where freezing is switched off (`freezes` 0)."""
    return thawed + freezes * (frozen - thawed)


@compiled
def node_capacities(freezes, surface_depth, deep_node, boundary_depth, thawed, frozen, freezing_water):
    """Heat capacities thawed and frozen [J m-2 K-1] and latent heat [J m-2] of the surface node and of the deep node.

    freezes : 1, or 0 where freezing is switched off; thawed, frozen : heat capacities [J m-3 K-1];
    freezing_water : share of the soil's volume.
    """
    frozen = where_it_freezes(freezes, thawed, frozen)
    latent = freezes * LATENT_HEAT_FUSION * WATER_DENSITY * freezing_water
    deep_depth = boundary_depth - surface_depth
    # Far below its node the deep soil has nearly the boundary's temperature, and stays frozen or thawed.
    freezing_depth = min(deep_depth, 2.0 * (deep_node - surface_depth))
    surface = thawed * surface_depth, frozen * surface_depth, latent * surface_depth
    deep = thawed * deep_depth, frozen * deep_depth, latent * freezing_depth
    return surface, deep


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
    sensible = (thawed if node_temperature >= 0.0 else frozen) * node_temperature
    return sensible + latent * max(min(node_temperature, 0.0) / freezing_range, -1.0)


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
def soil_nodes(b, i):
    """Capacities and distances of the two nodes, for the year."""
    p, w = b.p, b.w
    surface, deep = node_capacities(
        p.soil_freezing[i],
        p.surface_soil_depth_m[i],
        p.deep_soil_node_m[i],
        p.boundary_depth_m[i],
        p.soil_heat_capacity_thawed[i],
        p.soil_heat_capacity_frozen[i],
        p.soil_freezing_water[i],
    )
    w.surface_thawed[i], w.surface_frozen[i], w.surface_latent[i] = surface
    w.deep_thawed[i], w.deep_frozen[i], w.deep_latent[i] = deep
    w.frozen_ratio[i] = where_it_freezes(p.soil_freezing[i], 1.0, p.soil_frozen_conductivity_ratio[i])
    w.half_surface[i] = 0.5 * p.surface_soil_depth_m[i]
    w.above_deep_node[i] = p.deep_soil_node_m[i] - p.surface_soil_depth_m[i]
    w.per_below_deep_node[i] = 1.0 / (p.boundary_depth_m[i] - p.deep_soil_node_m[i])


@compiled
def boundary_temperature(b, i) -> float:
    """Temperature of the boundary far below [degC]."""
    return b.p.deep_boundary_temperature_k[i] - FREEZING_POINT_K


@compiled
def soil_temperatures(b, i):
    """A lane's two nodes at the start of the step."""
    s, w = b.s, b.w
    span = b.p.soil_freezing_range_k[i]
    w.surface[i] = temperature(s.surface_heat[i], w.surface_thawed[i], w.surface_frozen[i], w.surface_latent[i], span)
    w.deep[i] = temperature(s.deep_heat[i], w.deep_thawed[i], w.deep_frozen[i], w.deep_latent[i], span)
