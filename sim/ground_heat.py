"""Temperatures and conductances down the ground: snow, organic layer, two soil nodes, boundary."""

from sim.jit import compiled
from sim.organic import organic_conductivities, organic_temperature, organic_thickness
from sim.soil import boundary_temperature, conductivity, frozen_share, in_series, soil_temperatures


@compiled
def ground_temperatures(b, i):
    """A lane's organic layer and soil nodes at the start of the step [degC]."""
    soil_temperatures(b, i)
    b.w.organic[i] = organic_temperature(b, i)


@compiled
def ground_conductances(b, i):
    """Conductances of a lane between ground, nodes and boundary [W m-2 K-1], at the step's first temperatures."""
    s, p, w = b.s, b.p, b.w
    span = p.soil_freezing_range_k[i]
    thawed, frozen = p.soil_conductivity[i], p.soil_conductivity[i] * w.frozen_ratio[i]
    # A node thicker than the front's daily reach freezes and thaws from above: its upper half is as what lies on it is.
    upper = conductivity(frozen_share(w.organic[i], span), thawed, frozen)
    lower = conductivity(frozen_share(w.surface[i], span), thawed, frozen)
    deep = conductivity(frozen_share(w.deep[i], span), thawed, frozen)
    below = conductivity(frozen_share(0.5 * (w.deep[i] + boundary_temperature(b, i)), span), thawed, frozen)
    half = 0.5 * organic_thickness(b, i)
    moss, humus = organic_conductivities(b, i, s.organic_water[i], frozen_share(w.organic[i], span))
    w.upper_soil[i] = w.half_surface[i] / upper
    w.organic_conductance[i] = in_series(s.swe[i] * w.snow_resistance[i], 1.0, half, moss)
    w.surface_conductance[i] = in_series(half, humus, w.half_surface[i], upper)
    w.deep_conductance[i] = in_series(w.half_surface[i], lower, w.above_deep_node[i], deep)
    w.boundary_conductance[i] = below * w.per_below_deep_node[i]
