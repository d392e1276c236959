"""Stems by species and year of age: classes, size, mortality, recruitment, ageing.

Stems are real numbers per hectare in arrays (AGES, lanes); the last row pools all beyond 100 years.
"""

from sim.jit import compiled, phase
from sim.mathematics import exponential

AGES = 102
OLDEST = AGES - 1
SEEDLING_LIMIT = 5
SAPLING_LIMIT = 20
AGE_CLASSES = ("seedling", "sapling", "young", "mature", "old")


@compiled
def count(stems, lane, youngest, oldest) -> float:
    """Stems of ages `youngest` to `oldest`, both included."""
    total = 0.0
    for age in range(youngest, oldest + 1):
        total += stems[age, lane]
    return total


@compiled
def relative_height(age, rate, shape) -> float:
    """Height relative to a very old tree (Hegyi 1981): (1 - exp(-rate age))^shape."""
    return (1.0 - exponential(-rate * age)) ** shape


@compiled
def stem_weight(age, rate, shape, exponent) -> float:
    """Carbon of a stem relative to a very old one: a power of its relative height."""
    return relative_height(max(age, 1), rate, shape) ** exponent


@compiled
def total_weight(stems, lane, youngest, oldest, rate, shape, exponent) -> float:
    """Stems of an age range, each counted by its relative carbon."""
    total = 0.0
    for age in range(youngest, oldest + 1):
        total += stems[age, lane] * stem_weight(age, rate, shape, exponent)
    return total


@compiled
def remove_share(stems, lane, youngest, oldest, share):
    """Remove a share of the stems of an age range, in place."""
    for age in range(youngest, oldest + 1):
        stems[age, lane] -= share * stems[age, lane]


@phase
def kill(b, i, conifers, deciduous):
    """Let shares of a lane's conifers and deciduous trees, of all ages alike, die; their carbon goes to the soil.

    Returns the stems that died [ha-1], which are booked.
    """
    s, w, r = b.s, b.w, b.r
    killed = conifers * count(s.conifer_stems, i, 0, OLDEST) + deciduous * count(s.deciduous_stems, i, 0, OLDEST)
    remove_share(s.conifer_stems, i, 0, OLDEST, conifers)
    remove_share(s.deciduous_stems, i, 0, OLDEST, deciduous)
    dead_conifers = conifers * s.conifer_biomass[i]
    dead_deciduous = deciduous * s.deciduous_biomass[i]
    s.conifer_biomass[i] -= dead_conifers
    s.deciduous_biomass[i] -= dead_deciduous
    s.soil_carbon[i] += dead_conifers + dead_deciduous
    w.stems_gain[i] -= killed
    r.mortality_kgc_m2[i] += dead_conifers + dead_deciduous
    return killed


@compiled
def self_thinning(density, largest_density, threshold, rate) -> float:
    """Share of stems that crowding kills in a year: 0 below `threshold` of the largest density, `rate` at it."""
    crowding = (density / largest_density - threshold) / (1.0 - threshold)
    return rate * max(crowding, 0.0)


@compiled
def recruits(density, largest_density, rate) -> float:
    """New seedlings of a year [stems ha-1], limited by the space that is left."""
    return rate * largest_density * max(1.0 - density / largest_density, 0.0)


@compiled
def grow_older(stems, lane):
    """One year passes: every stem moves up an age, in place."""
    stems[OLDEST, lane] += stems[OLDEST - 1, lane]
    for age in range(OLDEST - 1, 0, -1):
        stems[age, lane] = stems[age - 1, lane]
    stems[0, lane] = 0.0
