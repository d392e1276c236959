"""Heat and water of a step, at its temperatures, moved between the stores: what leaves one enters another.

Enthalpies and stores follow from the fluxes, never the other way round; so a snowpack that melts out or soil that
freezes within a step needs no correction. Fluxes are in W m-2, water in mm per step.
"""

from sim.jit import compiled
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


@compiled
def move_heat_and_water(b, seconds):
    """Move a step's heat and water between the stores, and note what crossed the stand's boundary."""
    for i in range(len(b.s.swe)):
        ground_longwave = radiate(b, i)
        evaporate(b, i, seconds)
        conduct(b, i)
        ground_latent = dry_ground(b, i, seconds)
        warm_ground(b, i, ground_longwave, ground_latent, seconds)
        warm_soil_and_trunk(b, i, seconds)
        fill_soil(b, i)
        cross_boundary(b, i, seconds)


@compiled
def radiate(b, i) -> float:
    """Net radiation of the stand; returns the longwave that the ground gains."""
    s, p, w = b.s, b.p, b.w
    emission = black_body(w.trial[i] + FREEZING_POINT_K)
    kelvin = s.ground[i] + FREEZING_POINT_K
    ground_emission = black_body(kelvin) + black_body_slope(kelvin) * (w.ground_new[i] - s.ground[i])
    down = longwave_down(w.sky[i], emission, w.longwave_cover[i])
    up = longwave_up(ground_emission, down, p.ground_emissivity[i])
    to_sky = (1.0 - w.longwave_cover[i]) * up + w.longwave_cover[i] * emission
    w.net_stand[i] = w.shortwave[i] - w.reflected[i] + w.sky[i] - to_sky
    return p.ground_emissivity[i] * (down - ground_emission)


@compiled
def evaporate(b, i, seconds):
    """Water that leaves by leaves and from the wet canopy."""
    w = b.w
    to_vapour = seconds / LATENT_HEAT_VAPORISATION  # mm per W m-2
    available = max(w.net[i] - w.fixed[i], 0.0)
    w.transpired[i] = w.dry_coefficient[i] * available * to_vapour
    w.evaporated[i] = min(w.wet_coefficient[i] * available, w.wet_limit[i]) * to_vapour


@compiled
def conduct(b, i):
    """Sensible heat to the air, and heat between the nodes."""
    w = b.w
    canopy, ground = w.trial[i], w.ground_new[i]
    trunk = w.trunk_base[i] + w.trunk_by_canopy[i] * canopy + w.trunk_by_ground[i] * ground
    surface = w.surface_base[i] + w.surface_by_ground[i] * ground
    deep = w.deep_base[i] + w.deep_by_surface[i] * surface
    canopy_to_air = w.canopy_air[i] * (canopy - w.air[i])
    w.trunk_to_air[i] = w.trunk_air[i] * (trunk - w.air[i])
    w.ground_to_air[i] = w.ground_conductance[i] * (ground - w.air[i])
    w.sensible[i] = canopy_to_air + w.trunk_to_air[i] + w.ground_to_air[i]
    w.canopy_to_trunk[i] = w.trunk_canopy[i] * (canopy - trunk)
    w.trunk_to_ground[i] = w.trunk_ground[i] * (trunk - ground)
    w.ground_to_surface[i] = w.surface_conductance[i] * (ground - surface)
    w.surface_to_deep[i] = w.deep_conductance[i] * (surface - deep)
    w.deep_to_boundary[i] = w.boundary_conductance[i] * (deep - boundary_temperature(b, i))
    w.soil_top[i] = surface + w.ground_to_surface[i] * w.upper_soil[i]


@compiled
def dry_ground(b, i, seconds) -> float:
    """Water that leaves the ground or its snow; returns the latent heat that it takes."""
    s, w = b.s, b.w
    snow = s.swe[i] > 0.0
    latent = w.ground_latent[i] + w.latent_slope[i] * (min(w.ground_new[i], 0.0) - min(s.ground[i], 0.0))
    w.sublimated[i] = min(latent * (seconds / LATENT_HEAT_SUBLIMATION), s.swe[i]) if snow else 0.0
    w.soil_evaporated[i] = 0.0 if snow else latent * (seconds / LATENT_HEAT_VAPORISATION)
    return (LATENT_HEAT_SUBLIMATION * w.sublimated[i] + LATENT_HEAT_VAPORISATION * w.soil_evaporated[i]) * (
        1.0 / seconds
    )


@compiled
def warm_ground(b, i, longwave, latent, seconds):
    """The ground's enthalpy: snow that sublimates takes its own sensible heat along; what would warm snow above
    0 degC melts it; what is left after the last snow warms the skin."""
    s, p, w = b.s, b.p, b.w
    snow = s.swe[i] > 0.0
    w.carried[i] = ICE_HEAT_CAPACITY * w.sublimated[i] * s.ground[i]
    heat = ground_capacity(s.swe[i], p.skin_heat_capacity[i]) * s.ground[i] - w.carried[i]
    heat += seconds * (
        w.ground_sw[i] + longwave - w.ground_to_air[i] - w.ground_to_surface[i] + w.trunk_to_ground[i] - latent
    )
    s.swe[i] -= w.sublimated[i]
    w.melted[i] = min(max(heat, 0.0) * (1.0 / LATENT_HEAT_FUSION), s.swe[i]) if snow else 0.0
    heat -= LATENT_HEAT_FUSION * w.melted[i]
    s.swe[i] -= w.melted[i]
    s.ground[i] = heat / ground_capacity(s.swe[i], p.skin_heat_capacity[i])


@compiled
def warm_soil_and_trunk(b, i, seconds):
    """Canopy, trunk and soil take what reaches them."""
    s, w = b.s, b.w
    s.canopy[i] = w.trial[i]
    s.trunk[i] += seconds * (w.canopy_to_trunk[i] - w.trunk_to_air[i] - w.trunk_to_ground[i]) / s.trunk_capacity[i]
    s.surface_heat[i] += seconds * (w.ground_to_surface[i] - w.surface_to_deep[i])
    s.deep_heat[i] += seconds * (w.surface_to_deep[i] - w.deep_to_boundary[i])


@compiled
def fill_soil(b, i):
    """Water of canopy and soil; what the bucket cannot hold runs off."""
    s, p, w = b.s, b.p, b.w
    s.canopy_rain[i] = max(s.canopy_rain[i] - w.evaporated[i], 0.0)
    water = s.soil_water[i] + w.infiltration[i] + w.melted[i] - w.transpired[i] - w.soil_evaporated[i]
    w.runoff[i] = runoff(water, p.max_water_content_mm[i])
    s.soil_water[i] = water - w.runoff[i]


@compiled
def cross_boundary(b, i, seconds):
    """What energy and water the stand gained through its boundary."""
    w = b.w
    w.vapour_lost[i] = (
        w.transpired[i] + w.evaporated[i] + w.sublimated[i] + w.soil_evaporated[i] + w.canopy_sublimation[i]
    )
    w.energy_gain[i] = (
        seconds * (w.net_stand[i] - w.sensible[i] - energy_of_photosynthesis(b, i) - w.deep_to_boundary[i])
        - LATENT_HEAT_VAPORISATION * w.vapour_lost[i]
        - LATENT_HEAT_FUSION * w.snow[i]
        + w.advected[i]
        - w.carried[i]
    )
    w.water_gain[i] = w.precipitation_step[i] - w.vapour_lost[i] - w.runoff[i]
