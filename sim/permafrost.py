"""Thaw as the field measures it: thaw depth, heat and temperature of the upper ground, temperature of the permafrost.

Diagnostics of the year: nothing here acts on anything. The upper ground is the mineral soil to
`UPPER_GROUND_M`.
"""

import math

from sim.jit import compiled, phase
from sim.organic import organic_conductivities, organic_thickness
from sim.physical_constants import DAYS_PER_YEAR, LATENT_HEAT_FUSION
from sim.soil import boundary_temperature, enthalpy, temperature, where_it_freezes

UPPER_GROUND_M = 3.0


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
    melts the water [latent, J m-3], warms the thawed soil to a quarter of the ground's mean temperature over the
    season (its top has half of that, its mean half of the top's), and goes on into soil as cold as the deep node in
    the year's mean (Carslaw and Jaeger 1959, 2.4: 2 dT sqrt(k C t / pi)).
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
def upper_temperature(surface, deep, surface_depth) -> float:
    """Mean temperature of the upper ground [degC], of a surface node down to `surface_depth` [m] and the deep node."""
    share = min(surface_depth / UPPER_GROUND_M, 1.0)
    return share * surface + (1.0 - share) * deep


@compiled
def temperature_at(depth, top, surface, deep, boundary, surface_depth, deep_node, boundary_depth) -> float:
    """Temperature [degC] at a depth [m] of the mineral soil, on lines between the nodes' annual means.

    top : at its surface; the surface node's temperature stands at half its depth, the deep one's at `deep_node`. Below
    `boundary_depth` the boundary's temperature.
    """
    middle = 0.5 * surface_depth
    if depth < middle:
        return top + (surface - top) * max(depth, 0.0) / middle
    if depth < deep_node:
        return surface + (deep - surface) * (depth - middle) / (deep_node - middle)
    return deep + (boundary - deep) * min((depth - deep_node) / (boundary_depth - deep_node), 1.0)


@compiled
def upper_ground_heat(b, i) -> float:
    """Heat of the upper ground [J m-2], 0 where it is thawed and at 0 degC: the surface node's, and what the deep
    node's temperature says of the soil between it and `UPPER_GROUND_M`. The organic layer is left out: more of it would
    count as colder ground."""
    s, p, w = b.s, b.p, b.w
    depth = p.surface_soil_depth_m[i]
    thawed, frozen = p.soil_heat_capacity_thawed[i], p.soil_heat_capacity_frozen[i]
    frozen = where_it_freezes(p.soil_freezing[i], thawed, frozen)
    latent, span = w.surface_latent[i] / depth, p.soil_freezing_range_k[i]
    deep = temperature(s.deep_heat[i], w.deep_thawed[i], w.deep_frozen[i], w.deep_latent[i], span)
    below = max(UPPER_GROUND_M - depth, 0.0)
    return s.surface_heat[i] + below * enthalpy(deep, thawed, frozen, latent, span)


@phase
def add_upper_ground(b):
    """The day's part of the annual mean heat of the upper ground."""
    for i in range(len(b.s.swe)):
        b.r.upper_ground_heat_mj_m2[i] += 1e-6 * upper_ground_heat(b, i) / DAYS_PER_YEAR


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


@compiled
def note_thaw(b, i):
    """The year's thaw, into its record: from its warmth, its mean temperatures, and the heat at its end."""
    p, r = b.p, b.r
    depth = active_layer(b, i)
    surface, deep = r.surface_soil_temperature_c[i], r.deep_soil_temperature_c[i]
    r.active_layer_depth_m[i] = depth
    r.upper_ground_heat_end_mj_m2[i] = 1e-6 * upper_ground_heat(b, i)
    r.upper_ground_temperature_c[i] = upper_temperature(surface, deep, p.surface_soil_depth_m[i])
    r.permafrost_top_temperature_c[i] = temperature_at(
        depth - organic_thickness(b, i),
        r.soil_top_temperature_c[i],
        surface,
        deep,
        boundary_temperature(b, i),
        p.surface_soil_depth_m[i],
        p.deep_soil_node_m[i],
        p.boundary_depth_m[i],
    )
