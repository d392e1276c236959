"""Snow on the ground: albedo, insulation, exchange with the air. The snow node is the snow's surface; its whole
depth lies between it and the soil. Without snow the node is the ground's skin of moss and litter."""

import math

from sim.jit import compiled
from sim.weather import FREEZING_POINT_K

ICE_HEAT_CAPACITY = 2100.0  # J kg-1 K-1
LATENT_HEAT_FUSION = 3.34e5  # J kg-1
LATENT_HEAT_VAPORISATION = 2.5e6  # J kg-1
LATENT_HEAT_SUBLIMATION = LATENT_HEAT_FUSION + LATENT_HEAT_VAPORISATION
AIR_HEAT_CAPACITY = 1005.0  # J kg-1 K-1
GRAVITY = 9.81  # m s-2
VON_KARMAN = 0.4
MELTING_FROM_C = -0.01  # a melting pack is at 0 degC only to rounding


@compiled
def bulk_density(cover, sheltered, exposed) -> float:
    """Snow density [kg m-3] between a closed canopy's and the open's."""
    return exposed + (sheltered - exposed) * cover


@compiled
def conductivity(density: float) -> float:
    """Thermal conductivity of snow [W m-1 K-1] (Sturm et al. 1997, Eq. 4)."""
    r = 0.001 * density
    light = 0.023 + 0.234 * r
    dense = 0.138 - 1.01 * r + 3.233 * r * r
    return light if r < 0.156 else dense


@compiled
def snow_albedo(albedo, temperature, snowfall, fresh, cold, old, cold_hours, melt_hours, refresh, seconds) -> float:
    """Albedo after a step: falls toward `cold`, or faster toward `old` while melting; snowfall [mm] renews it (times of
    FSM2, limits of CLASS, Verseghy 1991)."""
    melting = temperature > MELTING_FROM_C
    hours = melt_hours if melting else cold_hours
    limit = old if melting else min(albedo, cold)
    # Weights of the old albedo, of the limit and of fresh snow; all times `refresh` x the time, for a single division.
    staying = 3600.0 * hours * refresh
    ageing = seconds * refresh
    renewal = snowfall * (3600.0 * hours)
    return (staying * albedo + ageing * limit + renewal * fresh) / (staying + ageing + renewal)


@compiled
def surface_albedo(swe, hidden_per_mm, snow, ground) -> float:
    """Albedo of the ground, with snow hiding `hidden_per_mm` of it, at most all (FSM2)."""
    hidden = min(swe * hidden_per_mm, 1.0)
    return ground + (snow - ground) * hidden


@compiled
def ground_profile(wind_height, height, roughness, thermal_ratio) -> tuple[float, float]:
    """Logarithmic profile over the ground: exchange velocity per wind speed at `wind_height`, and that wind's share at
    `height`, where air temperature holds (FSM2). Heat has `thermal_ratio` of the roughness length of momentum."""
    aloft = math.log(wind_height / roughness)
    exchange = VON_KARMAN * VON_KARMAN / (aloft * math.log(height / (thermal_ratio * roughness)))
    return exchange, math.log(height / roughness) / aloft


@compiled
def stability(surface, air, wind_below, height, damping, limit) -> float:
    """Factor on turbulent exchange: 1 / (1 + 10 Ri) over a cold surface (Price and Dunne 1976), and its counterpart
    sqrt(1 + 10 |Ri|), limited, over a warm one. wind_below : at `height`."""
    shear = (air + FREEZING_POINT_K) * max(wind_below * wind_below, 1e-6)
    buoyancy = damping * GRAVITY * height * (air - surface)  # 10 Ri is their ratio
    factor = (shear + max(-buoyancy, 0.0)) / (shear + max(buoyancy, 0.0))
    return factor if buoyancy > 0.0 else min(math.sqrt(factor), limit)
