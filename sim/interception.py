"""Rain and snow held by the canopy. Stores in mm, fluxes in mm per step.

per_capacity : 1 / capacity, or 0 where nothing can be held; of the load, which several processes need.
"""

from sim.jit import compiled, phase
from sim.mathematics import exponential, two_thirds_power
from sim.physical_constants import (
    FREEZING_POINT_K,
    LATENT_HEAT_FUSION,
    LATENT_HEAT_SUBLIMATION,
    PSYCHROMETRIC_OVER_ICE_PER_HPA,
    SECONDS_PER_HOUR,
)
from sim.radiation import black_body

LEAST_MELTING_LOAD = 0.05  # share of capacity; the last snow melts as fast as this much, not ever more slowly


@compiled
def snow_capacity(temperature, plant_area, warm, cold) -> float:
    """Snow the canopy can hold [mm]: `warm` per plant area at -1 degC and above, `cold` at -10 degC and below."""
    share = min(max((-1.0 - temperature) * (1.0 / 9.0), 0.0), 1.0)
    return plant_area * (warm + (cold - warm) * share)


@compiled
def intercepted(fall, store, capacity, per_capacity, efficiency) -> float:
    """What stays in the canopy: the closer to capacity, the less (Hedstrom and Pomeroy 1998, Eq. 4, per step)."""
    room = max(capacity - store, 0.0)
    return min(efficiency * fall * (room * per_capacity), room)


@compiled
def snow_sublimation(
    store, per_capacity, exposure, net, heat_transfer, deficit, slope, psychrometric, latent_heat, seconds
) -> float:
    """Sublimation of intercepted snow [mm per step] (Penman 1948, over ice) from the exposed share of the canopy that
    it covers, the power 2/3 of its load (FSM2).

    net : net radiation of the canopy at air temperature [W m-2]; heat_transfer : conductance to the air
    [W m-2 K-1]; deficit, slope : of vapour pressure over ice [hPa, hPa K-1]; psychrometric : constant [hPa K-1].
    """
    covered = two_thirds_power(min(store * per_capacity, 1.0))
    demand = (slope * max(net, 0.0) + heat_transfer * max(deficit, 0.0)) / (slope + psychrometric)
    return min(exposure * covered * demand * (seconds / latent_heat), store)


@compiled
def snow_melt(store, per_capacity, air, air_conductance, latent_heat, seconds) -> float:
    """Melt of intercepted snow [mm per step] by the sensible heat of air above 0 degC.

    Gated on the air's temperature: gated on the canopy's own, its energy balance would have no root.
    """
    load = min(max(store * per_capacity, LEAST_MELTING_LOAD), 1.0) if per_capacity > 0.0 else 1.0
    return min(load * air_conductance * max(air, 0.0) * (seconds / latent_heat), store)


@compiled
def unloaded(store, capacity, melted, rate, per_melt, seconds) -> float:
    """Snow that falls from the canopy [mm per step]: slowly in the cold (`rate` [s-1]), with melt, and
    all beyond capacity."""
    creep = store * rate * seconds
    return min(max(creep + per_melt * melted, store - capacity), store)


@compiled
def unloading_rates(b, i):
    """Rate at which cold snow falls from the canopy [s-1], for the year."""
    b.w.unloading_rate[i] = 1.0 / (SECONDS_PER_HOUR * b.p.snow_unloading_hours[i])


@phase
def canopy_capacities(b):
    """How much of the day's snowfall the canopy can catch, and how much rain it holds."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        # Snow lands on shoots rather than on needles, and sees less plant area than light does.
        thinner = p.snow_extinction_factor[i]
        caught = w.cover_conifer[i] * (1.0 - exponential(-w.optical_conifer[i] * thinner)) + w.cover_deciduous[i] * (
            1.0 - exponential(-w.snow_optical_deciduous[i] * thinner)
        )
        w.snow_efficiency[i] = caught * p.interception[i]
        capacity = p.rain_capacity_mm[i] * w.snow_area[i] * p.interception[i]
        w.rain_capacity[i] = capacity
        w.per_rain_capacity[i] = 1.0 / capacity if capacity > 0.0 else 0.0


@compiled
def catch_snow(b, i, seconds) -> float:
    """Snow caught, sublimated, melted and shed by a lane's canopy; returns what reaches the ground [mm]."""
    s, p, w = b.s, b.p, b.w
    capacity = snow_capacity(w.air[i], w.snow_area[i], p.snow_capacity_warm_mm[i], p.snow_capacity_cold_mm[i])
    per_capacity = 1.0 / capacity if capacity > 0.0 else 0.0
    caught = intercepted(w.snow[i], s.canopy_snow[i], capacity, per_capacity, w.snow_efficiency[i])
    store = s.canopy_snow[i] + caught
    ground_emission = black_body(s.ground[i] + FREEZING_POINT_K)
    net = w.canopy_sw[i] + w.longwave_cover[i] * (w.sky[i] + ground_emission - 2.0 * w.air_emission[i])
    lost = snow_sublimation(
        store,
        per_capacity,
        p.sublimation_exposure[i],
        net,
        w.canopy_air[i],
        w.deficit[i],
        w.saturation_slope[i],
        PSYCHROMETRIC_OVER_ICE_PER_HPA * p.air_pressure_hpa[i],
        LATENT_HEAT_SUBLIMATION,
        seconds,
    )
    store -= lost
    melted = snow_melt(store, per_capacity, w.air[i], w.canopy_air[i], LATENT_HEAT_FUSION, seconds)
    store -= melted
    fallen = unloaded(store, capacity, melted, w.unloading_rate[i], p.snow_unloading_melt[i], seconds)
    s.canopy_snow[i] = store - fallen
    w.canopy_sublimation[i] = lost
    w.canopy_melt[i] = melted
    w.fixed[i] += (LATENT_HEAT_SUBLIMATION * lost + LATENT_HEAT_FUSION * melted) * (1.0 / seconds)
    return w.snow[i] - caught + fallen


@compiled
def rainfall(b):
    """Rain and melt held by the canopy; what drips or falls through reaches the soil."""
    s, w = b.s, b.w
    for i in range(len(s.swe)):
        held = intercepted(w.rain[i], s.canopy_rain[i], w.rain_capacity[i], w.per_rain_capacity[i], w.longwave_cover[i])
        wet = s.canopy_rain[i] + held + w.canopy_melt[i]
        drip = max(wet - w.rain_capacity[i], 0.0)
        s.canopy_rain[i] = wet - drip
        w.infiltration[i] = w.rain[i] - held + drip
