"""The organic layer: moss, litter and humus on the mineral soil, a node with heat, water and ice of its own.

Rain and melt wet it first; what it cannot hold drains into the bucket of `sim.water`. Its water freezes by enthalpy,
which is 0 at 0 degC and thawed, as the soil's. So melt that seeps into a frozen layer and freezes there warms it by its
heat of fusion; rain brings the air's warmth, and water that drains or evaporates takes the layer's along.
"""

from sim.jit import compiled
from sim.physical_constants import (
    ICE_HEAT_CAPACITY,
    LATENT_HEAT_FUSION,
    WATER_DENSITY,
    WATER_HEAT_CAPACITY,
)
from sim.soil import conductivity, enthalpy, frozen_share, temperature, where_it_freezes

LEAST_DEPTH_M = 0.01  # of litter, where neither moss nor humus is


@compiled
def organic_thickness(b, i) -> float:
    """Thickness of a lane's organic layer [m]."""
    return max(b.s.organic_depth[i] * b.p.moss[i], LEAST_DEPTH_M)


@compiled
def layer_capacities(freezes, depth, dry, water):
    """Heat capacities thawed and frozen [J m-2 K-1] and latent heat [J m-2] of a layer.

    freezes : 1, or 0 where freezing is switched off; depth [m]; dry : heat capacity without water [J m-3 K-1];
    water : [mm].
    """
    thawed = dry * depth + WATER_HEAT_CAPACITY * water
    frozen = where_it_freezes(freezes, thawed, dry * depth + ICE_HEAT_CAPACITY * water)
    return thawed, frozen, freezes * LATENT_HEAT_FUSION * water


@compiled
def wet_conductivity(filled, dry, saturated) -> float:
    """Conductivity [W m-1 K-1] of organic soil: a straight line from dry to saturated (Farouki 1981; CLM, Lawrence and
    Slater 2008). filled : share of the pores."""
    return dry + (saturated - dry) * min(filled, 1.0)


@compiled
def organic_growth(depth, conifer, deciduous, depth_conifer, depth_deciduous, depth_open, growth, loss_years) -> float:
    """Depth of the organic layer [m] a year later, toward the equilibrium of the canopy above it."""
    equilibrium = conifer * depth_conifer + deciduous * depth_deciduous + (1.0 - conifer - deciduous) * depth_open
    gap = equilibrium - depth
    return depth + (min(gap, growth) if gap > 0.0 else gap / loss_years)


@compiled
def renew_organic_layer(b, i):
    """A year of growth or loss of the organic layer, which comes and goes dry and at 0 degC."""
    s, p, w = b.s, b.p, b.w
    s.organic_depth[i] = organic_growth(
        s.organic_depth[i],
        w.cover_conifer[i],
        w.cover_deciduous[i],
        p.organic_depth_conifer_m[i],
        p.organic_depth_deciduous_m[i],
        p.organic_depth_open_m[i],
        p.organic_growth_m_yr[i],
        p.organic_loss_years[i],
    )


@compiled
def organic_capacities(b, i):
    """`layer_capacities` of a lane, with the water that it has now."""
    p = b.p
    return layer_capacities(
        p.soil_freezing[i], organic_thickness(b, i), p.organic_heat_capacity_dry[i], b.s.organic_water[i]
    )


@compiled
def organic_temperature(b, i) -> float:
    """Temperature of a lane's organic layer now [degC]."""
    thawed, frozen, latent = organic_capacities(b, i)
    return temperature(b.s.organic_heat[i], thawed, frozen, latent, b.p.soil_freezing_range_k[i])


@compiled
def organic_conductivities(b, i, water, ice):
    """Conductivities of the moss above and the humus below [W m-1 K-1], which share the water as they hold it.

    water : of the whole layer [mm]; ice : share of it.
    """
    p = b.p
    # Twice their shares of the water, since each has half of the pores.
    in_humus = 2.0 * p.humus_water_held[i] / (p.moss_water_held[i] + p.humus_water_held[i])
    filled = water / (WATER_DENSITY * p.organic_porosity[i] * organic_thickness(b, i))
    dry, thawed = p.organic_conductivity_dry[i], p.organic_conductivity_saturated[i]
    frozen = where_it_freezes(p.soil_freezing[i], thawed, p.organic_conductivity_saturated_frozen[i])
    saturated = conductivity(ice, thawed, frozen)
    return wet_conductivity((2.0 - in_humus) * filled, dry, saturated), wet_conductivity(
        in_humus * filled, dry, saturated
    )


@compiled
def water_held(b, i) -> float:
    """Water that a lane's organic layer holds against drainage [mm]: half of it is moss, half humus."""
    return 0.5 * WATER_DENSITY * (b.p.moss_water_held[i] + b.p.humus_water_held[i]) * organic_thickness(b, i)


@compiled
def liquid_water(b, i) -> float:
    """Water of a lane's organic layer that is not ice [mm], at the start of the step."""
    p = b.p
    ice = p.soil_freezing[i] * frozen_share(b.w.organic[i], p.soil_freezing_range_k[i])
    return b.s.organic_water[i] * (1.0 - ice)


@compiled
def wetness(b, i) -> float:
    """Liquid water of a lane's organic layer, as a share of what it holds against drainage, at most 1."""
    return min(liquid_water(b, i) / water_held(b, i), 1.0)


@compiled
def warm_organic_layer(b, i, gained, below, above) -> float:
    """Let a lane's organic layer gain heat [J m-2]; returns what it passes on to the soil.

    below, above : temperatures of soil and ground at the step's end [degC]. A layer that starts to freeze or has just
    frozen gains or loses more in the step than its heat capacity of the start says. What would warm or cool it beyond
    its neighbours and its own start, which no conduction can, passes through.
    """
    s, w = b.s, b.w
    thawed, frozen, latent = organic_capacities(b, i)
    span = b.p.soil_freezing_range_k[i]
    low, high = min(w.organic[i], min(below, above)), max(w.organic[i], max(below, above))
    heat = s.organic_heat[i] + gained
    kept = min(max(heat, enthalpy(low, thawed, frozen, latent, span)), enthalpy(high, thawed, frozen, latent, span))
    s.organic_heat[i] = kept
    return heat - kept


@compiled
def drained(water, frozen, held) -> float:
    """Water that drains [mm]: of all beyond what the layer holds, what is liquid."""
    return min(max(water - held, 0.0), water * (1.0 - frozen))


@compiled
def wet_organic_layer(b, i, rain, melted, evaporated):
    """Let rain and melt into a lane's organic layer, and evaporation and drainage out of it, each with its heat.

    Amounts in mm. Returns what drains, and the heat that water brought, less what it took along [J m-2].
    """
    s, p, w = b.s, b.p, b.w
    before = max(w.organic[i], 0.0)
    brought = WATER_HEAT_CAPACITY * (max(w.air[i], 0.0) * rain - before * evaporated)
    water = max(s.organic_water[i] + (rain + melted - evaporated), 0.0)
    s.organic_water[i] = water
    s.organic_heat[i] += brought
    now = organic_temperature(b, i)
    ice = p.soil_freezing[i] * frozen_share(now, p.soil_freezing_range_k[i])
    away = drained(water, ice, water_held(b, i))
    taken = WATER_HEAT_CAPACITY * max(now, 0.0) * away
    s.organic_water[i] = water - away
    s.organic_heat[i] -= taken
    return away, brought - taken
