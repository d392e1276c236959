"""Stems by species and year of age: classes, size, mortality, recruitment, ageing.

Stems are real numbers per hectare in arrays (AGES, lanes); the last row pools all beyond 100 years.
"""

from sim.deadwood import lay_down
from sim.jit import compiled, phase, uncompiled
from sim.mathematics import between, exponential
from sim.physical_constants import SQUARE_METRES_PER_HECTARE

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


@phase
def weigh_stems(b, i):
    """Carbon of a lane's stems by species and age, relative to a very old one: it holds for the year."""
    p, w = b.p, b.w
    exponent = p.stem_carbon_exponent[i]
    for age in range(AGES):
        w.conifer_size[age, i] = stem_weight(age, p.height_rate_conifer[i], p.height_shape_conifer[i], exponent)
        w.deciduous_size[age, i] = stem_weight(age, p.height_rate_deciduous[i], p.height_shape_deciduous[i], exponent)


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
    """Let shares of a lane's conifers and deciduous trees, of all ages alike, die; they are laid down.

    Returns the stems that died [ha-1], which are booked.
    """
    living_conifers, living_deciduous = count_stand(b, i)
    killed = conifers * living_conifers + deciduous * living_deciduous
    dead_conifers, dead_deciduous = fell(b, i, conifers, deciduous)
    bury(b, i, killed, dead_conifers, dead_deciduous)
    return killed


@compiled
def bury(b, i, stems, conifer, deciduous):
    """Book dead stems [ha-1], and give their species' carbon [kgC m-2] to dead wood and soil."""
    lay_down(b, i, conifer, deciduous, 0.0, 0.0)
    b.w.stems_gain[i] -= stems
    b.r.dead_stems_ha[i] += stems
    b.r.mortality_kgc_m2[i] += conifer + deciduous


@compiled
def weaken(stems, sizes, lane, deaths, suppressed):
    """Let so many stems of a species die, small ones first, in place: how likely a stem's death is falls with its size
    as 1 / (suppressed + size), and no age loses more than all its stems.

    sizes : carbon of a stem by age, which never falls with age. Returns the stems that died, and their share of the
    species' carbon.
    """
    number, hazard, carbon = 0.0, 0.0, 0.0
    for age in range(AGES):
        number += stems[age, lane]
        hazard += stems[age, lane] / (suppressed + sizes[age, lane])
        carbon += stems[age, lane] * sizes[age, lane]
    if number <= 0.0:
        return 0.0, 0.0
    left = deaths
    doomed = 0  # ages below this one die out; the smallest do so first
    while doomed < AGES and left >= hazard * (suppressed + sizes[doomed, lane]):
        left = max(left - stems[doomed, lane], 0.0)
        hazard = max(hazard - stems[doomed, lane] / (suppressed + sizes[doomed, lane]), 0.0)
        doomed += 1
    died, lost = 0.0, 0.0
    for age in range(AGES):
        share = 1.0 if age < doomed else min(left / (hazard * (suppressed + sizes[age, lane])), 1.0)
        dies = share * stems[age, lane]
        stems[age, lane] -= dies
        died += dies
        lost += dies * sizes[age, lane]
    return died, min(lost / carbon, 1.0)


@compiled
def background_deaths(stems, sizes, lane, rate, suppressed, reference) -> float:
    """Stems of a species that die in a year without crowding [ha-1]: of the reference size the share `rate`, of others
    more or less as 1 / (suppressed + size), whoever stands beside them."""
    deaths = 0.0
    for age in range(AGES):
        deaths += stems[age, lane] * min(rate * (suppressed + reference) / (suppressed + sizes[age, lane]), 1.0)
    return deaths


@phase
def kill_small(b, i, conifers, deciduous):
    """Let so many of a lane's stems of each species die [ha-1], small ones first; they are laid down."""
    s, p, w = b.s, b.p, b.w
    suppressed = p.suppressed_stem_size[i]
    died, lost = weaken(s.conifer_stems, w.conifer_size, i, conifers, suppressed)
    carbon = lost * s.conifer_biomass[i]
    s.conifer_biomass[i] -= carbon
    bury(b, i, died, carbon, 0.0)
    died, lost = weaken(s.deciduous_stems, w.deciduous_size, i, deciduous, suppressed)
    carbon = lost * s.deciduous_biomass[i]
    s.deciduous_biomass[i] -= carbon
    bury(b, i, died, 0.0, carbon)


@compiled
def reference_stems(stems, sizes, lane, biomass, reference_kgc, exponent) -> float:
    """Stems of the reference size that a species' stems crowd like [ha-1]: Reineke's (1933) index, summed over stems,
    each counted as its carbon over the reference to a power. biomass [kgC m-2], reference_kgc [kgC]."""
    whole, crowding = 0.0, 0.0
    for age in range(AGES):
        if stems[age, lane] > 0.0:
            whole += stems[age, lane] * sizes[age, lane]
            crowding += stems[age, lane] * sizes[age, lane] ** exponent
    if whole <= 0.0:
        return 0.0
    return crowding * (SQUARE_METRES_PER_HECTARE * biomass / whole / reference_kgc) ** exponent


@phase
def crowding_stems(b, i):
    """Both species' stems of a lane as stems of the reference size [ha-1]."""
    s, p, w = b.s, b.p, b.w
    reference, exponent = p.reference_stem_kgc[i], p.crowding_exponent[i]
    conifers = reference_stems(s.conifer_stems, w.conifer_size, i, s.conifer_biomass[i], reference, exponent)
    return conifers + reference_stems(
        s.deciduous_stems, w.deciduous_size, i, s.deciduous_biomass[i], reference, exponent
    )


@compiled
def self_thinning(density, largest_density, threshold, rate) -> float:
    """Share of stems that crowding kills in a year: 0 below `threshold` of the largest density, `rate` at it.

    density : stems of the reference size that the stand's crowd like [ha-1], at which size the largest density holds.
    """
    crowding = (density / largest_density - threshold) / (1.0 - threshold)
    return rate * max(crowding, 0.0)


@compiled
def recruits(density, cover, largest_density, rate, per_stem) -> float:
    """New seedlings of a year [stems ha-1]: a share of the young stems that fill open ground, where no crown shades it;
    at most up to the largest density. per_stem : young stems in the place of one of the reference size."""
    return min(rate * per_stem * largest_density * (1.0 - cover), max(largest_density - density, 0.0))


@compiled
def grow_older(stems, lane):
    """One year passes: every stem moves up an age, in place."""
    stems[OLDEST, lane] += stems[OLDEST - 1, lane]
    for age in range(OLDEST - 1, 0, -1):
        stems[age, lane] = stems[age - 1, lane]
    stems[0, lane] = 0.0


@phase
def renew_stems(b, i):
    """Background mortality and self-thinning of small stems first, recruitment in gaps, ageing."""
    s, p, w, d = b.s, b.p, b.w, b.d
    conifers, deciduous = count_stand(b, i)
    density = conifers + deciduous
    background = p.natural_mortality[i] * between(
        1.0 - p.mortality_spread[i], 1.0 + p.mortality_spread[i], d.mortality_dice[i]
    )
    crowding = self_thinning(
        crowding_stems(b, i),
        p.max_natural_density[i],
        p.density_mortality_threshold[i],
        p.density_dependent_mortality[i],
    )
    suppressed, reference = p.suppressed_stem_size[i], p.reference_stem_size[i]
    conifers_die = background_deaths(
        s.conifer_stems, w.conifer_size, i, background * p.mortality_conifer[i], suppressed, reference
    )
    deciduous_die = background_deaths(
        s.deciduous_stems, w.deciduous_size, i, background * p.mortality_deciduous[i], suppressed, reference
    )
    kill_small(
        b, i, min(conifers_die + crowding * conifers, conifers), min(deciduous_die + crowding * deciduous, deciduous)
    )

    cover = w.cover_conifer[i] + w.cover_deciduous[i]
    new = recruits(density, cover, p.max_natural_density[i], p.recruitment_rate[i], p.recruits_per_stem[i])
    seed_source = conifers / density if density > 0.0 else 0.5
    s.conifer_stems[0, i] += new * seed_source
    s.deciduous_stems[0, i] += new * (1.0 - seed_source)
    w.stems_gain[i] += new
    b.r.recruited_stems_ha[i] = new
    grow_older(s.conifer_stems, i)
    grow_older(s.deciduous_stems, i)
