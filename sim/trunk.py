"""The trunks: a store of heat between air, canopy and ground."""

from sim.jit import compiled, phase

LEAST_TRUNK_CAPACITY = 2000.0  # J m-2 K-1


@compiled
def grow_trunk(b, i):
    """Heat capacity of the trunks; wood that grew or went takes its heat along, a named flux."""
    s, p, r = b.s, b.p, b.r
    biomass = s.conifer_biomass[i] + s.deciduous_biomass[i]
    capacity = LEAST_TRUNK_CAPACITY + p.trunk_heat_per_carbon[i] * biomass
    r.growth_heat_mj_m2[i] = 1e-6 * (capacity - s.trunk_capacity[i]) * s.trunk[i]
    s.trunk_capacity[i] = capacity


@phase
def trunk_conductances(b):
    """Conductances of the day between the trunks and air, canopy and ground [W m-2 K-1]."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        crowns = w.cover_conifer[i] + w.cover_deciduous[i]
        w.trunk_air[i] = p.trunk_air_conductance[i] * p.woody_area_index[i] * crowns
        w.trunk_canopy[i] = p.trunk_canopy_conductance[i] * crowns
        w.trunk_ground[i] = p.trunk_ground_conductance[i] * crowns
