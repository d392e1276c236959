"""From stems to crowns: cover, the two species' shares, and the light use of old trees."""

from sim.canopy import crown_factor
from sim.demography import AGES, OLDEST
from sim.jit import compiled, phase
from sim.mathematics import exponential

SQUARE_METRES_PER_HECTARE = 1e4


@phase
def crown_areas(b, i):
    """Crown area, cover and light use of a lane's stand, from its stems by age (crowns overlap at random)."""
    s, p, w = b.s, b.p, b.w
    conifer = 0.0
    deciduous = 0.0
    for age in range(AGES):
        conifer += s.conifer_stems[age, i] * crown_factor(
            age,
            p.crown_conifer_seedling[i],
            p.crown_conifer_sapling[i],
            p.crown_conifer_young[i],
            p.crown_conifer_mature[i],
            p.crown_conifer_old[i],
        )
        if p.crown_development[i] > 0.0:
            factor = crown_factor(
                age,
                p.crown_deciduous_seedling[i],
                p.crown_deciduous_sapling[i],
                p.crown_deciduous_young[i],
                p.crown_deciduous_mature[i],
                p.crown_deciduous_old[i],
            )
        else:
            factor = crown_factor(
                age,
                p.crown_conifer_seedling[i],
                p.crown_conifer_sapling[i],
                p.crown_conifer_young[i],
                p.crown_conifer_mature[i],
                p.crown_conifer_old[i],
            )
        deciduous += s.deciduous_stems[age, i] * factor
    old_conifer = s.conifer_stems[OLDEST, i] * p.crown_conifer_old[i]
    old_deciduous = s.deciduous_stems[OLDEST, i] * factor  # the last age's
    w.light_use_conifer[i] = p.light_use_conifer[i] * _decline(old_conifer, conifer, p.light_use_old[i])
    w.light_use_deciduous[i] = p.light_use_deciduous[i] * _decline(old_deciduous, deciduous, p.light_use_old[i])

    conifer *= p.crown_area_conifer_m2[i] / SQUARE_METRES_PER_HECTARE
    deciduous *= p.crown_area_deciduous_m2[i] / SQUARE_METRES_PER_HECTARE
    w.crown_area[i] = conifer + deciduous
    w.share_conifer[i] = conifer / w.crown_area[i] if w.crown_area[i] > 0.0 else 0.0
    cover = 1.0 - exponential(-w.crown_area[i])
    w.cover_conifer[i] = cover * w.share_conifer[i]
    w.cover_deciduous[i] = cover * (1.0 - w.share_conifer[i])


@compiled
def _decline(old, all_crowns, light_use_old) -> float:
    """Light use relative to a stand without old trees, by the old trees' share of the crowns."""
    share = min(old / all_crowns, 1.0) if all_crowns > 0.0 else 0.0
    return 1.0 - share * (1.0 - light_use_old)
