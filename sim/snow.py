"""Snow on the ground: albedo, insulation, exchange with the air. The snow node is the snow's surface; its whole
depth lies between it and the soil. Without snow the node is the ground's skin of moss and litter."""

from sim.jit import compiled, phase
from sim.physical_constants import ICE_HEAT_CAPACITY, SECONDS_PER_HOUR

SNOW_DAY_MM = 1.0  # of snow, less than which is none to a day's wind and to the record
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
    """Density of the day's snow, its resistance to heat, and how much of it hides the ground."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        crowns = w.cover_conifer[i] + w.cover_deciduous[i]
        w.snow_density[i] = bulk_density(crowns, p.snow_density_sheltered[i], p.snow_density_open[i])
        w.snow_resistance[i] = 1.0 / (w.snow_density[i] * conductivity(w.snow_density[i]))
        w.snow_hiding[i] = 1.0 / (w.snow_density[i] * p.snow_cover_depth_m[i])


@compiled
def lay_snow(b, i, ground_snow, seconds):
    """Add snow [mm] to a lane's ground; it is as cold as the air, and the heat it brings is the heat its mass gains."""
    s, p, w = b.s, b.p, b.w
    w.advected[i] = ICE_HEAT_CAPACITY * ground_snow * min(w.air[i], 0.0)
    heat = ground_capacity(s.swe[i], p.skin_heat_capacity[i]) * s.ground[i] + w.advected[i]
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
