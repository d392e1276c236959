"""What can be sold of a stem: sawlogs, pulpwood and energy wood, by its diameter."""

from sim.demography import AGES
from sim.jit import compiled
from sim.physical_constants import SQUARE_METRES_PER_HECTARE

PRODUCTS = ("sawlog", "pulpwood", "energy_wood")


@compiled
def stem_diameter(carbon, diameter, exponent) -> float:
    """Diameter [cm] of a stem of so much carbon [kgC], which is its power `exponent`; diameter : of a stem of 1 kgC."""
    return diameter * carbon ** (1.0 / exponent)


@compiled
def thicker_share(diameter, top) -> float:
    """Share of a stem that is thicker than `top`, if it is a cone; both in cm."""
    return 1.0 - (top / diameter) ** 3 if diameter > top else 0.0


@compiled
def standing_wood(stems, sizes, lane, unit, share, diameter, exponent, sawlog_top, pulpwood_top):
    """Sawlogs, pulpwood and energy wood of a species' standing stems [kgC m-2].

    sizes : relative carbon of a tree by age; unit : carbon of a tree of size 1 [kgC]; share : of it in the stem.
    """
    sawlog, pulpwood, energy_wood = 0.0, 0.0, 0.0
    for age in range(AGES):
        carbon = unit * sizes[age, lane]
        wood = stems[age, lane] * carbon * share / SQUARE_METRES_PER_HECTARE
        thickness = stem_diameter(carbon, diameter, exponent)
        of_sawlog = thicker_share(thickness, sawlog_top)
        of_pulpwood = max(thicker_share(thickness, pulpwood_top) - of_sawlog, 0.0)
        sawlog += wood * of_sawlog
        pulpwood += wood * of_pulpwood
        energy_wood += wood * (1.0 - of_sawlog - of_pulpwood)
    return sawlog, pulpwood, energy_wood
