"""Rain and snow held by the canopy. Stores in mm, fluxes in mm per step.

per_capacity : 1 / capacity, or 0 where nothing can be held; of the load, which several processes need.
"""

from sim.jit import compiled
from sim.mathematics import two_thirds_power

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
