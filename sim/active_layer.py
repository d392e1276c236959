"""Depth of the year's thaw, from its warmth at the ground."""

import math

from sim.jit import compiled
from sim.organic import organic_conductivities, organic_thickness
from sim.physical_constants import LATENT_HEAT_FUSION
from sim.soil import boundary_temperature, where_it_freezes


@compiled
def thaw_depth(
    organic,
    organic_latent,
    organic_conductivity,
    warmth,
    seconds,
    deep,
    boundary,
    deep_node,
    boundary_depth,
    thawed_conductivity,
    frozen_conductivity,
    thawed_capacity,
    frozen_capacity,
    latent,
):
    """Active-layer depth [m], from the organic surface; down to the permafrost where that lies below the deep node.

    First the season melts the ice of the organic layer (organic_latent, J m-2), from above.

    Stefan's: what a season's warmth at the ground [K s], `seconds` long, conducts through organic layer and thawed soil
    melts the water [latent, J m-3], warms thawed soil to half the mean temperature of its top, and goes on into soil
    as cold as the deep node in the year's mean (Carslaw and Jaeger 1959, 2.4: 2 dT sqrt(k C t / pi)).
    Capacities in J m-3 K-1.
    """
    if deep > 0.0:
        share = deep / (deep - boundary) if boundary < 0.0 else 1.0
        return organic + deep_node + share * (boundary_depth - deep_node)
    if seconds <= 0.0:
        return 0.0
    to_melt_organic = 0.5 * organic_latent * organic / organic_conductivity
    if warmth <= to_melt_organic:
        return organic * math.sqrt(warmth / to_melt_organic)
    seconds *= 1.0 - to_melt_organic / warmth
    warmth -= to_melt_organic
    top = 0.5 * warmth / seconds
    heat = latent + 0.5 * thawed_capacity * top
    cold = -2.0 * deep * math.sqrt(frozen_conductivity * frozen_capacity * seconds / math.pi)
    above = organic * thawed_conductivity / organic_conductivity
    linear = above * heat + 0.5 * cold
    square = linear * linear + 2.0 * heat * (thawed_conductivity * warmth - above * cold)
    front = (math.sqrt(max(square, 0.0)) - linear) / heat if heat > 0.0 else 0.0
    return organic + min(max(front, 0.0), boundary_depth)


@compiled
def active_layer(b, i) -> float:
    """Active-layer depth of the year [m], from its warmth, the organic layer's water and the mean deep temperature."""
    p, w, r = b.p, b.w, b.r
    depth = organic_thickness(b, i)
    water = w.thaw_water[i] / w.thaw_seconds[i] if w.thaw_seconds[i] > 0.0 else 0.0
    moss, humus = organic_conductivities(b, i, water, 0.0)
    thawed = p.soil_heat_capacity_thawed[i]
    return thaw_depth(
        depth,
        p.soil_freezing[i] * LATENT_HEAT_FUSION * water,
        2.0 * moss * humus / (moss + humus),
        w.thaw_warmth[i],
        w.thaw_seconds[i],
        r.deep_soil_temperature_c[i],
        boundary_temperature(b, i),
        p.deep_soil_node_m[i],
        p.boundary_depth_m[i],
        p.soil_conductivity[i],
        p.soil_conductivity[i] * w.frozen_ratio[i],
        thawed,
        where_it_freezes(p.soil_freezing[i], thawed, p.soil_heat_capacity_frozen[i]),
        w.surface_latent[i] / p.surface_soil_depth_m[i],
    )
