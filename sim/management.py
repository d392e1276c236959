"""The forester's action at the start of a year: planting and thinning.

One rule says what part of an action can be carried out, `feasible_change`. The year's transition makes that part and
records it; the action mask is where it is the whole (`sim.task.actions`); the penalty of an ineffective action is for
the share that it leaves undone, `missed_share` (`sim.task.objectives`).
"""

import reprlib

import numpy as np

from sim.assortment import standing_wood
from sim.demography import (
    AGE_CLASSES,
    OLDEST,
    bury,
    class_ages,
    count,
    count_stand,
    first_ages,
    remove_share,
    total_weight,
)
from sim.jit import compiled, phase
from sim.physical_constants import SQUARE_METRES_PER_HECTARE

DENSITY_CHANGES = (-100.0, -50.0, 0.0, 50.0, 100.0)  # stems ha-1
CONIFER_MIXES = (0.0, 0.25, 0.5, 0.75, 1.0)
NUM_ACTIONS = len(DENSITY_CHANGES) * len(CONIFER_MIXES)
_CHANGES, _MIXES = np.array(DENSITY_CHANGES), np.array(CONIFER_MIXES)
LEAST_DENSITY = 150.0  # stems ha-1 that thinning leaves
LARGEST_DENSITY = 2000.0  # stems ha-1 that planting reaches
# the action that stands for neither planting nor cutting
NO_CHANGE = DENSITY_CHANGES.index(0.0) * len(CONIFER_MIXES) + CONIFER_MIXES.index(0.5)
NEGLIGIBLE_STEMS = 0.01  # stems ha-1; a smaller shortfall counts as done


def indices(actions) -> tuple[np.ndarray, np.ndarray]:
    """Places in `DENSITY_CHANGES` and `CONIFER_MIXES` of integer actions, a = 5 x density index + mix index."""
    return np.divmod(np.asarray(actions), len(CONIFER_MIXES))


def decode(actions) -> tuple[np.ndarray, np.ndarray]:
    """Density change [stems ha-1] and conifer share of integer actions."""
    density, mix = indices(actions)
    return _CHANGES[density], _MIXES[mix]


def as_array(actions) -> np.ndarray:
    """Actions as an array. Raises ValueError for rows of unequal length, and where some are masked."""
    what = f"integers in [0, {NUM_ACTIONS}) are allowed"
    if np.ma.is_masked(actions):
        raise ValueError(f"actions {reprlib.repr(actions)}: some are masked; {what}")
    try:
        return np.asarray(actions)
    except ValueError:
        raise ValueError(f"actions {reprlib.repr(actions)}: rows of unequal length; {what}") from None


def check_actions(actions, number, of="stands") -> np.ndarray:
    """Actions as integers, shape (number,), one for each of so many stands or years. Raises ValueError naming the first
    that is not in [0, 25)."""
    values = as_array(actions)
    if values.shape != (number,):
        raise ValueError(f"actions of shape {values.shape}: one integer for each of {number} {of} is allowed")
    if values.dtype.kind not in "iu":
        wrong = next((value for value in values.tolist() if value not in range(NUM_ACTIONS)), values.tolist()[0])
        raise ValueError(f"action {wrong!r} of type {values.dtype}: integers in [0, {NUM_ACTIONS}) are allowed")
    wrong = values[(values < 0) | (values >= NUM_ACTIONS)]
    if wrong.size:
        raise ValueError(f"action {wrong[0]}: integers in [0, {NUM_ACTIONS}) are allowed")
    return values


def first_cut_age(harvest_min_class: str, constants: dict) -> int:
    """Youngest age that thinning may cut, from the name of its age class."""
    ages = dict(zip(AGE_CLASSES[2:], first_ages(constants)[2:], strict=False))
    if not isinstance(harvest_min_class, str) or harvest_min_class not in ages:
        raise ValueError(f"harvest_min_class {harvest_min_class!r}: allowed are {', '.join(ages)}")
    return ages[harvest_min_class]


@compiled
def feasible_change(change, density, harvestable) -> float:
    """The part of a density change that can be made, all in stems ha-1: numbers when compiled, or else arrays too."""
    can_plant = np.maximum(LARGEST_DENSITY - density, 0.0)
    can_cut = np.minimum(harvestable, np.maximum(density - LEAST_DENSITY, 0.0))
    return np.maximum(np.minimum(change, can_plant), -can_cut)


def missed_share(change, made):
    """Share of a density change that was not made; a shortfall below `NEGLIGIBLE_STEMS` counts as done."""
    shortfall = np.abs(change - made)
    return np.where(shortfall < NEGLIGIBLE_STEMS, 0.0, shortfall / np.maximum(np.abs(change), 1.0))


@compiled
def conifers_to_cut(cut, mix, conifers, deciduous, harvestable_conifers, harvestable_deciduous) -> float:
    """Conifers among `cut` stems, so that the remaining stand comes as near as it can to the conifer share `mix`."""
    wanted = conifers - mix * (conifers + deciduous - cut)
    return min(max(wanted, cut - harvestable_deciduous, 0.0), cut, harvestable_conifers)


@compiled
def cut_oldest(stems, lane, cut, first_age, ages, rate, shape, exponent) -> float:
    """Cut stems of one species, oldest class first, in place; returns the share of the species' carbon cut.

    first_age : the youngest age that may be cut; ages : first ages of the classes, `sim.demography.class_ages`.
    """
    whole = total_weight(stems, lane, 0, OLDEST, rate, shape, exponent)
    removed = 0.0
    left = cut
    oldest = OLDEST
    for youngest in (ages[4], ages[3], first_age):
        youngest = max(youngest, first_age)
        available = count(stems, lane, youngest, oldest) if youngest <= oldest else 0.0
        if left > 0.0 and available > 0.0:
            share = min(left / available, 1.0)
            removed += share * total_weight(stems, lane, youngest, oldest, rate, shape, exponent)
            remove_share(stems, lane, youngest, oldest, share)
            left -= share * available
        oldest = youngest - 1
    return min(removed / whole, 1.0) if whole > 0.0 else 0.0


@phase
def manage(b, i):
    """Plant or thin: seedlings of the wanted mix; or the oldest stems, so that the stand nears the mix."""
    w, r = b.w, b.r
    conifers, deciduous = count_stand(b, i)
    first_age = int(w.first_cut_age[i])
    harvestable_conifers = count(b.s.conifer_stems, i, first_age, OLDEST)
    harvestable_deciduous = count(b.s.deciduous_stems, i, first_age, OLDEST)
    r.harvestable_stems_ha[i] = harvestable_conifers + harvestable_deciduous
    change = feasible_change(w.density_change[i], conifers + deciduous, r.harvestable_stems_ha[i])
    if change > 0.0:
        plant(b, i, change)
    elif change < 0.0:
        cut = -change
        cut_conifers = conifers_to_cut(cut, w.mix[i], conifers, deciduous, harvestable_conifers, harvestable_deciduous)
        thin(b, i, cut_conifers, cut - cut_conifers)
        r.thinned_stems_ha[i] = cut
    w.stems_gain[i] += change
    conifers, deciduous = count_stand(b, i)
    density = conifers + deciduous
    r.density_after_action[i] = density
    r.conifer_fraction_after_action[i] = conifers / density if density > 0.0 else 0.0
    if density <= 0.0:
        bury_last(b, i)


@compiled
def plant(b, i, stems):
    """Plant seedlings of the wanted mix [stems ha-1]."""
    s, w = b.s, b.w
    s.conifer_stems[0, i] += stems * w.mix[i]
    s.deciduous_stems[0, i] += stems * (1.0 - w.mix[i])
    b.r.planted_stems_ha[i] = stems


@phase
def thin(b, i, conifers, deciduous):
    """Cut so many stems of each species [ha-1]; a part of their carbon is stored in products, the rest lost."""
    s, p, w, r = b.s, b.p, b.w, b.r
    unit_conifer = tree_unit(s.conifer_stems, w.conifer_size, i, s.conifer_biomass[i])
    unit_deciduous = tree_unit(s.deciduous_stems, w.deciduous_size, i, s.deciduous_biomass[i])
    before_conifer, before_deciduous = stand_wood(b, i, unit_conifer, unit_deciduous)
    first_age = int(w.first_cut_age[i])
    ages = class_ages(int(p.young_age_limit[i]), int(p.mature_age_limit[i]))
    exponent = p.stem_carbon_exponent[i]
    share_conifer = cut_oldest(
        s.conifer_stems, i, conifers, first_age, ages, p.height_rate_conifer[i], p.height_shape_conifer[i], exponent
    )
    share_deciduous = cut_oldest(
        s.deciduous_stems,
        i,
        deciduous,
        first_age,
        ages,
        p.height_rate_deciduous[i],
        p.height_shape_deciduous[i],
        exponent,
    )
    after_conifer, after_deciduous = stand_wood(b, i, unit_conifer, unit_deciduous)
    r.conifer_sawlog_kgc_m2[i] = max(before_conifer[0] - after_conifer[0], 0.0)
    r.conifer_pulpwood_kgc_m2[i] = max(before_conifer[1] - after_conifer[1], 0.0)
    r.conifer_energy_wood_kgc_m2[i] = max(before_conifer[2] - after_conifer[2], 0.0)
    r.deciduous_sawlog_kgc_m2[i] = max(before_deciduous[0] - after_deciduous[0], 0.0)
    r.deciduous_pulpwood_kgc_m2[i] = max(before_deciduous[1] - after_deciduous[1], 0.0)
    r.deciduous_energy_wood_kgc_m2[i] = max(before_deciduous[2] - after_deciduous[2], 0.0)
    harvest = share_conifer * s.conifer_biomass[i] + share_deciduous * s.deciduous_biomass[i]
    s.conifer_biomass[i] -= share_conifer * s.conifer_biomass[i]
    s.deciduous_biomass[i] -= share_deciduous * s.deciduous_biomass[i]
    stored = p.harvest_stored_share[i] * harvest
    s.products[i] += stored
    r.harvest_kgc_m2[i] = harvest
    r.hwp_stored_kgc_m2[i] = stored
    r.harvest_emission_kgc_m2[i] = harvest - stored


@compiled
def tree_unit(stems, sizes, lane, biomass) -> float:
    """Carbon of a tree of relative size 1 [kgC], of a species whose trees have so much biomass [kgC m-2]."""
    whole = 0.0
    for age in range(OLDEST + 1):
        whole += stems[age, lane] * sizes[age, lane]
    return SQUARE_METRES_PER_HECTARE * biomass / whole if whole > 0.0 else 0.0


@phase
def stand_wood(b, i, unit_conifer, unit_deciduous):
    """Sawlogs, pulpwood and energy wood of each species that stand now [kgC m-2]; unit_* : see `standing_wood`."""
    s, p, w = b.s, b.p, b.w
    diameter, exponent = p.stem_diameter_cm[i], p.stem_carbon_exponent[i]
    conifer = standing_wood(
        s.conifer_stems,
        w.conifer_size,
        i,
        unit_conifer,
        p.stem_share_conifer[i],
        diameter,
        exponent,
        p.sawlog_top_conifer_cm[i],
        p.pulpwood_top_cm[i],
    )
    deciduous = standing_wood(
        s.deciduous_stems,
        w.deciduous_size,
        i,
        unit_deciduous,
        p.stem_share_deciduous[i],
        diameter,
        exponent,
        p.sawlog_top_deciduous_cm[i],
        p.pulpwood_top_cm[i],
    )
    return conifer, deciduous


@compiled
def bury_last(b, i):
    """Without stems nothing lives: what biomass there was is laid down."""
    s = b.s
    conifer, deciduous = s.conifer_biomass[i], s.deciduous_biomass[i]
    s.conifer_biomass[i] = 0.0
    s.deciduous_biomass[i] = 0.0
    bury(b, i, 0.0, conifer, deciduous)
