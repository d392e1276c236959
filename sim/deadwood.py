"""Dead wood: stems of dead trees by species, which decay, burn, and turn to soil. Pools in kgC m-2."""

import numpy as np

from sim.carbon import q10_factor
from sim.jit import compiled, phase
from sim.physical_constants import DAYS_PER_YEAR

MOST_DEADWOOD = 60.0  # kgC m-2 of a species, that a stand may start with


@compiled
def wood_of_dead(carbon, burned, stem_share) -> float:
    """Dead wood that trees of so much carbon leave: their stems, unless more than the rest of them burned."""
    return min(stem_share * carbon, carbon - burned)


@phase
def lay_down(b, i, conifer, deciduous, burned_conifer, burned_deciduous):
    """Give what dead trees leave to dead wood and soil: the stems to dead wood, leaves and branches to the soil.

    conifer, deciduous : carbon of the trees that died; burned_* : part of it that has burned.
    """
    s, p, r = b.s, b.p, b.r
    conifer_wood = wood_of_dead(conifer, burned_conifer, p.stem_share_conifer[i])
    deciduous_wood = wood_of_dead(deciduous, burned_deciduous, p.stem_share_deciduous[i])
    litter = conifer - burned_conifer - conifer_wood + (deciduous - burned_deciduous - deciduous_wood)
    s.conifer_deadwood[i] += conifer_wood
    s.deciduous_deadwood[i] += deciduous_wood
    s.soil_carbon[i] += litter
    r.conifer_deadwood_input_kgc_m2[i] += conifer_wood
    r.deciduous_deadwood_input_kgc_m2[i] += deciduous_wood
    r.dead_litter_kgc_m2[i] += litter


@phase
def decay_deadwood(b, steps):
    """Decay of a day at its mean air temperature: a part is respired, the rest becomes soil. steps : of the day."""
    s, p, w, r = b.s, b.p, b.w, b.r
    for i in range(len(s.swe)):
        warmth = q10_factor(w.air_sum[i] / steps, p.respiration_reference_c[i], w.log_q10[i]) / DAYS_PER_YEAR
        conifer = min(warmth * p.deadwood_decay_conifer[i], 1.0) * s.conifer_deadwood[i]
        deciduous = min(warmth * p.deadwood_decay_deciduous[i], 1.0) * s.deciduous_deadwood[i]
        respired = p.deadwood_respired_share[i] * (conifer + deciduous)
        s.conifer_deadwood[i] -= conifer
        s.deciduous_deadwood[i] -= deciduous
        s.soil_carbon[i] += conifer + deciduous - respired
        r.conifer_deadwood_decay_kgc_m2[i] += conifer
        r.deciduous_deadwood_decay_kgc_m2[i] += deciduous
        r.deadwood_respiration_kgc_m2[i] += respired
        r.heterotrophic_respiration_kgc_m2[i] += respired


@compiled
def burn_deadwood(b, i) -> float:
    """Let a fire burn its share of the dead wood that lies there; returns it, which the caller books as lost."""
    s, p, r = b.s, b.p, b.r
    conifer = p.fire_combusted_deadwood[i] * s.conifer_deadwood[i]
    deciduous = p.fire_combusted_deadwood[i] * s.deciduous_deadwood[i]
    s.conifer_deadwood[i] -= conifer
    s.deciduous_deadwood[i] -= deciduous
    r.conifer_deadwood_burned_kgc_m2[i] += conifer
    r.deciduous_deadwood_burned_kgc_m2[i] += deciduous
    return conifer + deciduous


def deadwood_in_balance(deadwood, wood_died, decayed) -> np.ndarray:
    """Dead wood that decays as fast as wood dies, up to `MOST_DEADWOOD`: stems die at a year's end, and decay is in
    proportion to the stock.

    deadwood : at the start of the year just run; wood_died, decayed : in that year; all of one shape.
    """
    balanced = wood_died * deadwood / np.where(decayed > 0.0, decayed, 1.0)
    return np.where(decayed > 0.0, np.minimum(balanced, MOST_DEADWOOD), 0.0)
