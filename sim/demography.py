"""Stems by species and year of age: classes, size, mortality, recruitment, ageing.

Stems are real numbers per hectare in arrays (AGES, lanes); the last row pools all beyond 100 years.
"""

from sim.jit import compiled, phase, uncompiled
from sim.mathematics import between, exponential

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
def class_ages(young_limit, mature_limit):
    """First age of each age class, and the number of ages: class k has ages [k] to [k + 1] - 1."""
    return 0, SEEDLING_LIMIT + 1, SAPLING_LIMIT + 1, young_limit + 1, mature_limit + 1, AGES


def first_ages(parameters: dict) -> tuple[int, ...]:
    """`class_ages` of a site, from its parameters by name."""
    return uncompiled(class_ages)(int(parameters["young_age_limit"]), int(parameters["mature_age_limit"]))


@compiled
def count_classes(stems, lane, ages):
    """Stems of each of the five age classes, whose `ages` are `class_ages`."""
    return (
        count(stems, lane, ages[0], ages[1] - 1),
        count(stems, lane, ages[1], ages[2] - 1),
        count(stems, lane, ages[2], ages[3] - 1),
        count(stems, lane, ages[3], ages[4] - 1),
        count(stems, lane, ages[4], ages[5] - 1),
    )


@compiled
def count_stand(b, i):
    """Conifers and deciduous stems of a lane [ha-1]."""
    return count(b.s.conifer_stems, i, 0, OLDEST), count(b.s.deciduous_stems, i, 0, OLDEST)


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


@compiled
def fell(b, i, conifers, deciduous):
    """Take shares of a lane's conifers and deciduous trees, of all ages alike, from the living, their carbon too.

    Returns the carbon of each species [kgC m-2], which the caller moves on and books.
    """
    s = b.s
    remove_share(s.conifer_stems, i, 0, OLDEST, conifers)
    remove_share(s.deciduous_stems, i, 0, OLDEST, deciduous)
    dead_conifers = conifers * s.conifer_biomass[i]
    dead_deciduous = deciduous * s.deciduous_biomass[i]
    s.conifer_biomass[i] -= dead_conifers
    s.deciduous_biomass[i] -= dead_deciduous
    return dead_conifers, dead_deciduous


@phase
def kill(b, i, conifers, deciduous):
    """Let shares of a lane's conifers and deciduous trees, of all ages alike, die; their carbon goes to the soil.

    Returns the stems that died [ha-1], which are booked.
    """
    s, w, r = b.s, b.w, b.r
    living_conifers, living_deciduous = count_stand(b, i)
    killed = conifers * living_conifers + deciduous * living_deciduous
    dead_conifers, dead_deciduous = fell(b, i, conifers, deciduous)
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


@phase
def renew_stems(b, i):
    """Background mortality and self-thinning, recruitment, ageing."""
    s, p, w, d = b.s, b.p, b.w, b.d
    conifers, deciduous = count_stand(b, i)
    density = conifers + deciduous
    background = p.natural_mortality[i] * between(
        1.0 - p.mortality_spread[i], 1.0 + p.mortality_spread[i], d.mortality_dice[i]
    )
    crowding = self_thinning(
        density, p.max_natural_density[i], p.density_mortality_threshold[i], p.density_dependent_mortality[i]
    )
    conifers_die = min(background * p.mortality_conifer[i] + crowding, 1.0)
    deciduous_die = min(background * p.mortality_deciduous[i] + crowding, 1.0)
    kill(b, i, conifers_die, deciduous_die)

    new = recruits(density, p.max_natural_density[i], p.recruitment_rate[i])
    seed_source = conifers / density if density > 0.0 else 0.5
    s.conifer_stems[0, i] += new * seed_source
    s.deciduous_stems[0, i] += new * (1.0 - seed_source)
    w.stems_gain[i] += new
    grow_older(s.conifer_stems, i)
    grow_older(s.deciduous_stems, i)
