"""Wind and turbulent exchange with the air: over the ground, and of the canopy."""

import math

from sim.jit import compiled, phase
from sim.mathematics import exponential
from sim.physical_constants import AIR_HEAT_CAPACITY, FREEZING_POINT_K, GRAVITY, VON_KARMAN
from sim.snow import SNOW_DAY_MM


@compiled
def ground_profile(wind_height, height, roughness, thermal_ratio) -> tuple[float, float]:
    """Logarithmic profile over the ground: exchange velocity per wind speed at `wind_height`, and that wind's share at
    `height`, where air temperature holds (FSM2). Heat has `thermal_ratio` of the roughness length of momentum."""
    aloft = math.log(wind_height / roughness)
    exchange = VON_KARMAN * VON_KARMAN / (aloft * math.log(height / (thermal_ratio * roughness)))
    return exchange, math.log(height / roughness) / aloft


@compiled
def aerodynamic_conductance(wind, roughness, height, excess) -> float:
    """Conductance for heat [m s-1] between canopy and air, neutral logarithmic profile (Garratt 1992, Eq. 3.38)."""
    momentum = math.log(height / roughness + 1.0)
    return VON_KARMAN * VON_KARMAN * wind / (momentum * (momentum + excess))


@compiled
def stability(surface, air, wind_below, height, damping, limit) -> float:
    """Factor on turbulent exchange: 1 / (1 + 10 Ri) over a cold surface (Price and Dunne 1976), and its counterpart
    sqrt(1 + 10 |Ri|), limited, over a warm one. wind_below : at `height`."""
    shear = (air + FREEZING_POINT_K) * max(wind_below * wind_below, 1e-6)
    buoyancy = damping * GRAVITY * height * (air - surface)  # 10 Ri is their ratio
    factor = (shear + max(-buoyancy, 0.0)) / (shear + max(buoyancy, 0.0))
    return factor if buoyancy > 0.0 else min(math.sqrt(factor), limit)


@compiled
def wind_profiles(b, i):
    """Profiles of the year over bare ground, over snow and above the canopy, per wind speed."""
    p, w = b.p, b.w
    aloft, height, ratio = p.canopy_reference_height_m[i], p.ground_reference_height_m[i], p.thermal_roughness_ratio[i]
    rough = p.soil_roughness_m[i]
    smooth = min(p.snow_roughness_m[i], rough)
    w.ground_log[i], w.ground_wind[i] = ground_profile(aloft, height, rough, ratio)
    w.snow_log[i], w.snow_wind[i] = ground_profile(aloft, height, smooth, ratio)
    w.canopy_log[i] = aerodynamic_conductance(1.0, p.canopy_roughness_m[i], aloft, p.excess_resistance[i])


@compiled
def wind_exchange(b, i, wind):
    """Exchange of a lane's ground [m s-1] and canopy [W m-2 K-1] with the air at a wind speed [m s-1]."""
    p, w = b.p, b.w
    crowns = w.cover_conifer[i] + w.cover_deciduous[i]
    snow = b.s.swe[i] > SNOW_DAY_MM
    sheltered = wind * (1.0 - p.wind_reduction[i] * crowns)
    # Loaded before they are chosen from: a conditional load keeps the loop from being vectorised.
    snow_wind, ground_wind, snow_log, ground_log = w.snow_wind[i], w.ground_wind[i], w.snow_log[i], w.ground_log[i]
    w.wind_below[i] = (snow_wind if snow else ground_wind) * sheltered
    w.ground_velocity[i] = (snow_log if snow else ground_log) * sheltered
    exchange = w.air_density[i] * AIR_HEAT_CAPACITY * (w.canopy_log[i] * wind)
    w.canopy_air[i] = max(exchange, p.minimum_conductance[i]) * max(w.longwave_cover[i], 1e-3)


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
def daily_wind(mean, spread, noise) -> float:
    """Wind speed of a day [m s-1]: log-normal about the site's mean, from a normal deviate; spread : of the log."""
    return mean * exponential(spread * (noise - 0.5 * spread))


@phase
def day_wind(b, day):
    """Exchange with the air at the day's wind speed; an observed wind sets it anew in every step."""
    p, w, d = b.p, b.w, b.d
    for i in range(len(b.s.swe)):
        spread = p.wind_spread[i] * p.weather_as_observed[i]
        w.wind[i] = daily_wind(p.wind_speed_m_s[i], spread, d.wind_noise[day, i])
        wind_exchange(b, i, w.wind[i])
