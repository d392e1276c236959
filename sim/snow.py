"""Snow on the ground: density, albedo, insulation. The snow node is the snow's surface; its whole depth lies between
it and the organic layer. Without snow the node is the ground's skin of moss and litter."""

import math

from sim.jit import compiled, phase
from sim.mathematics import exponential
from sim.physical_constants import GRAVITY, ICE_HEAT_CAPACITY, SECONDS_PER_DAY, SECONDS_PER_HOUR

SNOW_DAY_MM = 1.0  # of snow, less than which is none to a day's wind and to the record
MELTING_FROM_C = -0.01  # a melting pack is at 0 degC only to rounding


@compiled
def fresh_density(air, wind, at_freezing, per_degree, by_wind, least) -> float:
    """Density of falling snow [kg m-3], by air temperature [degC] and wind [m s-1] (Pahaut 1976; Vionnet et al. 2012,
    Eq. 1)."""
    return max(at_freezing + per_degree * air + by_wind * math.sqrt(wind), least)


@compiled
def mixed_density(swe, density, snowfall, fresh) -> float:
    """Density [kg m-3] of the pack with the snow that fell [mm]: their depths add up."""
    depths = swe * fresh + snowfall * density
    return (swe + snowfall) * density * fresh / depths if depths > 0.0 else density


@compiled
def settling(
    swe, density, temperature, viscosity, stiffer_cold, stiffer_dense, rate, slower_cold, slower_dense, metamorphism
) -> float:
    """Relative gain of density [s-1]: under the weight of half the pack, and by metamorphism, which slows beyond a
    density (Anderson 1976; as in FSM2, Essery 2015). temperature : of the snow [degC]."""
    weight = 0.5 * GRAVITY * swe
    stiffness = viscosity * exponential(stiffer_dense * density - stiffer_cold * temperature)
    dense = max(density - metamorphism, 0.0)
    return weight / stiffness + rate * exponential(slower_cold * temperature - slower_dense * dense)


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
    staying = SECONDS_PER_HOUR * hours * refresh
    ageing = seconds * refresh
    renewal = snowfall * (SECONDS_PER_HOUR * hours)
    return (staying * albedo + ageing * limit + renewal * fresh) / (staying + ageing + renewal)


@compiled
def surface_albedo(swe, hidden_per_mm, snow, ground) -> float:
    """Albedo of the ground, with snow hiding `hidden_per_mm` of it, at most all (FSM2)."""
    hidden = min(swe * hidden_per_mm, 1.0)
    return ground + (snow - ground) * hidden


@compiled
def ground_capacity(swe, skin) -> float:
    """Heat capacity [J m-2 K-1] of the ground's node: its snow and its skin."""
    return ICE_HEAT_CAPACITY * swe + skin


@phase
def snow_properties(b):
    """The day's snow: its resistance to heat, and how much of it hides the ground."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        w.snow_resistance[i] = 1.0 / (s.snow_density[i] * conductivity(s.snow_density[i]))
        w.snow_hiding[i] = 1.0 / (s.snow_density[i] * p.snow_cover_depth_m[i])


@phase
def settle_snow(b, steps):
    """A day of settling, at the mean of the snow's surface over the day and of the organic layer below it.

    steps : time steps of the day.
    """
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        gain = settling(
            s.swe[i],
            s.snow_density[i],
            min(0.5 * (w.ground_sum[i] / steps + w.organic[i]), 0.0),
            p.snow_viscosity[i],
            p.snow_viscosity_by_cold[i],
            p.snow_viscosity_by_density[i],
            p.snow_metamorphism[i],
            p.snow_metamorphism_by_cold[i],
            p.snow_metamorphism_by_density[i],
            p.snow_metamorphism_density[i],
        )
        settled = min(s.snow_density[i] * (1.0 + SECONDS_PER_DAY * gain), p.snow_density_largest[i])
        fresh = p.snow_density_fresh[i]
        s.snow_density[i] = settled if s.swe[i] > 0.0 else fresh  # of the snow that is to come


@compiled
def snow_depth(b, i) -> float:
    """Depth of a lane's snow [m]."""
    return b.s.swe[i] / b.s.snow_density[i]


@compiled
def lay_snow(b, i, ground_snow, seconds):
    """Add snow [mm] to a lane's ground; it is as cold as the air, and the heat it brings is the heat its mass gains."""
    s, p, w = b.s, b.p, b.w
    w.advected[i] = ICE_HEAT_CAPACITY * ground_snow * min(w.air[i], 0.0)
    heat = ground_capacity(s.swe[i], p.skin_heat_capacity[i]) * s.ground[i] + w.advected[i]
    fresh = fresh_density(
        w.air[i],
        w.wind_below[i],
        p.snow_density_fresh[i],
        p.snow_density_fresh_per_c[i],
        p.snow_density_fresh_by_wind[i],
        p.snow_density_least[i],
    )
    s.snow_density[i] = mixed_density(s.swe[i], s.snow_density[i], ground_snow, fresh)
    s.swe[i] += ground_snow
    mixed = heat / ground_capacity(s.swe[i], p.skin_heat_capacity[i])
    s.ground[i] = mixed if ground_snow > 0.0 else s.ground[i]
    aged = snow_albedo(
        s.albedo[i],
        s.ground[i],
        ground_snow,
        p.snow_albedo_fresh[i],
        p.snow_albedo_cold[i],
        p.snow_albedo_old[i],
        p.snow_albedo_cold_hours[i],
        p.snow_albedo_melt_hours[i],
        p.snow_albedo_refresh_mm[i],
        seconds,
    )
    s.albedo[i] = aged if s.swe[i] > 0.0 else p.snow_albedo_fresh[i]
