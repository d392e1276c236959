"""Heat and water of a step, at its temperatures, moved between the stores: what leaves one enters another.

Enthalpies and stores follow from the fluxes, never the other way round; so a snowpack that melts out or soil that
freezes within a step needs no correction. Fluxes are in W m-2, water in mm per step.
"""

from typing import NamedTuple

from sim.account import add_step, total_sensible, total_vapour
from sim.jit import compiled
from sim.organic import warm_organic_layer, wet_organic_layer
from sim.photosynthesis import energy_of_photosynthesis
from sim.physical_constants import (
    FREEZING_POINT_K,
    ICE_HEAT_CAPACITY,
    LATENT_HEAT_FUSION,
    LATENT_HEAT_SUBLIMATION,
    LATENT_HEAT_VAPORISATION,
)
from sim.radiation import black_body, black_body_slope, longwave_down, longwave_up
from sim.snow import ground_capacity
from sim.soil import boundary_temperature
from sim.water import runoff


class Heat(NamedTuple):
    """Sensible heat that flows in a step, from the first to the second [W m-2]."""

    canopy_to_air: float
    trunk_to_air: float
    ground_to_air: float
    canopy_to_trunk: float
    trunk_to_ground: float
    ground_to_organic: float
    organic_to_surface: float
    surface_to_deep: float
    deep_to_boundary: float


class Vapour(NamedTuple):
    """Water that evaporates in a step [mm], but for what sublimates from the canopy."""

    leaves: float
    wet_canopy: float
    snow: float
    floor: float


@compiled
def move_heat_and_water(b, seconds):
    """Move a step's heat and water between the stores; what crossed the stand's boundary is noted and accounted for."""
    w = b.w
    for i in range(len(b.s.swe)):
        net_radiation, ground_longwave = radiate(b, i)
        heat = conduct(b, i)
        vapour = evaporate(b, i, seconds)
        melted, carried = warm_ground(b, i, ground_longwave, heat, vapour, seconds)
        warm_soil_and_trunk(b, i, heat, seconds)
        from_layer = w.layer_share[i] * vapour.floor
        drained, carried_by_water = wet_organic_layer(b, i, w.infiltration[i], melted, from_layer)
        excess = fill_soil(b, i, vapour, drained - (vapour.floor - from_layer))
        advected = w.advected[i] - carried + carried_by_water
        cross_boundary(b, i, net_radiation, heat, vapour, excess, advected, seconds)
        add_step(b, i, net_radiation, heat, vapour, excess, advected, seconds)


@compiled
def radiate(b, i):
    """Net radiation of the stand, and the longwave that the ground gains."""
    s, p, w = b.s, b.p, b.w
    emission = black_body(w.trial[i] + FREEZING_POINT_K)
    kelvin = s.ground[i] + FREEZING_POINT_K
    ground_emission = black_body(kelvin) + black_body_slope(kelvin) * (w.ground_new[i] - s.ground[i])
    down = longwave_down(w.sky[i], emission, w.longwave_cover[i])
    up = longwave_up(ground_emission, down, p.ground_emissivity[i])
    to_sky = (1.0 - w.longwave_cover[i]) * up + w.longwave_cover[i] * emission
    net_radiation = w.shortwave[i] - w.reflected[i] + w.sky[i] - to_sky
    return net_radiation, p.ground_emissivity[i] * (down - ground_emission)


@compiled
def conduct(b, i):
    """Heat between the nodes, and to the air; the temperature at the top of the mineral soil."""
    w = b.w
    canopy, ground = w.trial[i], w.ground_new[i]
    trunk = w.trunk_base[i] + w.trunk_by_canopy[i] * canopy + w.trunk_by_ground[i] * ground
    organic = w.organic_base[i] + w.organic_by_ground[i] * ground
    surface = w.surface_base[i] + w.surface_by_organic[i] * organic
    deep = w.deep_base[i] + w.deep_by_surface[i] * surface
    heat = Heat(
        w.canopy_air[i] * (canopy - w.air[i]),
        w.trunk_air[i] * (trunk - w.air[i]),
        w.ground_conductance[i] * (ground - w.air[i]),
        w.trunk_canopy[i] * (canopy - trunk),
        w.trunk_ground[i] * (trunk - ground),
        w.organic_conductance[i] * (ground - organic),
        w.surface_conductance[i] * (organic - surface),
        w.deep_conductance[i] * (surface - deep),
        w.boundary_conductance[i] * (deep - boundary_temperature(b, i)),
    )
    w.surface_new[i] = surface
    w.soil_top[i] = surface + heat.organic_to_surface * w.upper_soil[i]
    return heat


@compiled
def evaporate(b, i, seconds):
    """Water that leaves the leaves, the wet canopy, and the snow or else the floor of moss and understorey."""
    s, w = b.s, b.w
    to_vapour = seconds / LATENT_HEAT_VAPORISATION  # mm per W m-2
    available = max(w.net[i] - w.fixed[i], 0.0)
    snow = s.swe[i] > 0.0
    new, old, floor_water = w.ground_new[i], s.ground[i], w.floor_water[i]  # loaded before they are chosen from
    latent = w.ground_latent[i] + w.latent_slope[i] * (min(new, 0.0) - min(old, 0.0) if snow else new - old)
    return Vapour(
        w.dry_coefficient[i] * available * to_vapour,
        min(w.wet_coefficient[i] * available, w.wet_limit[i]) * to_vapour,
        min(latent * (seconds / LATENT_HEAT_SUBLIMATION), s.swe[i]) if snow else 0.0,
        0.0 if snow else min(latent * to_vapour, floor_water),
    )


@compiled
def warm_ground(b, i, longwave, heat, vapour, seconds):
    """The ground's enthalpy: snow that sublimates takes its own sensible heat along; what would warm snow above
    0 degC melts it; what is left after the last snow warms the skin. Returns the melt [mm] and the heat taken along
    [J m-2]."""
    s, p, w = b.s, b.p, b.w
    snow = s.swe[i] > 0.0
    latent = (LATENT_HEAT_SUBLIMATION * vapour.snow + LATENT_HEAT_VAPORISATION * vapour.floor) * (1.0 / seconds)
    carried = ICE_HEAT_CAPACITY * vapour.snow * s.ground[i]
    enthalpy = ground_capacity(s.swe[i], p.skin_heat_capacity[i]) * s.ground[i] - carried
    enthalpy += seconds * (
        w.ground_sw[i] + longwave - heat.ground_to_air - heat.ground_to_organic + heat.trunk_to_ground - latent
    )
    left = s.swe[i] - vapour.snow
    melted = min(max(enthalpy, 0.0) * (1.0 / LATENT_HEAT_FUSION), left) if snow else 0.0
    s.swe[i] = left - melted
    s.ground[i] = (enthalpy - LATENT_HEAT_FUSION * melted) / ground_capacity(s.swe[i], p.skin_heat_capacity[i])
    return melted, carried


@compiled
def warm_soil_and_trunk(b, i, heat, seconds):
    """Canopy, trunk, organic layer and soil take what reaches them."""
    s, w = b.s, b.w
    s.canopy[i] = w.trial[i]
    s.trunk[i] += seconds * (heat.canopy_to_trunk - heat.trunk_to_air - heat.trunk_to_ground) / s.trunk_capacity[i]
    gained = seconds * (heat.ground_to_organic - heat.organic_to_surface)
    passed = warm_organic_layer(b, i, gained, w.surface_new[i], w.ground_new[i])
    s.surface_heat[i] += seconds * (heat.organic_to_surface - heat.surface_to_deep) + passed
    s.deep_heat[i] += seconds * (heat.surface_to_deep - heat.deep_to_boundary)


@compiled
def fill_soil(b, i, vapour, gained) -> float:
    """Water of canopy and soil, with what the soil gained from above; returns what the bucket cannot hold."""
    s = b.s
    s.canopy_rain[i] = max(s.canopy_rain[i] - vapour.wet_canopy, 0.0)
    water = max(s.soil_water[i] + gained - vapour.leaves, 0.0)
    excess = runoff(water, b.p.max_water_content_mm[i])
    s.soil_water[i] = water - excess
    return excess


@compiled
def cross_boundary(b, i, net_radiation, heat, vapour, excess, advected, seconds):
    """What energy and water the stand gained through its boundary."""
    w = b.w
    all_vapour = total_vapour(b, i, vapour)
    growth = energy_of_photosynthesis(b, i)
    w.energy_gain[i] = (
        seconds * (net_radiation - total_sensible(heat) - growth - heat.deep_to_boundary)
        - LATENT_HEAT_VAPORISATION * all_vapour
        - LATENT_HEAT_FUSION * w.snow[i]
        + advected
    )
    w.water_gain[i] = w.precipitation_step[i] - all_vapour - excess
