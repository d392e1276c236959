"""From stems to crowns and leaves: cover, the two species' shares, light use of old trees, leaf area of the day."""

from sim.demography import AGES, OLDEST
from sim.jit import compiled, phase
from sim.mathematics import exponential
from sim.physical_constants import SQUARE_METRES_PER_HECTARE
from sim.radiation import canopy_interception

LEAST_AREA = 1e-300  # m2 m-2; leafless crowns without wood have leaves of no area, which is not to be divided by


@compiled
def crown_factor(age, seedling, sapling, young, mature, old) -> float:
    """Crown area of a stem relative to a mature one, straight lines between the values at 3, 13, 30, 70, 101 years."""
    if age < 3:
        return seedling * age / 3.0
    if age < 13:
        return seedling + (sapling - seedling) * (age - 3.0) / 10.0
    if age < 30:
        return sapling + (young - sapling) * (age - 13.0) / 17.0
    if age < 70:
        return young + (mature - young) * (age - 30.0) / 40.0
    return mature + (old - mature) * (min(age, 101.0) - 70.0) / 31.0


@compiled
def leaf_out(day, start, spring_rate, fall, autumn_rate) -> float:
    """Share of the deciduous leaf area that is out: half on the start and the fall day, logistic in between."""
    spring = 1.0 / (1.0 + exponential(-spring_rate * (day + 1.0 - start)))
    autumn = 1.0 / (1.0 + exponential(autumn_rate * (day + 1.0 - fall)))
    return spring * autumn


@compiled
def leaf_share(depth, green, path) -> float:
    """Leaves' share of the light that a crown intercepts, where leaves hide the wood (Kucharik et al. 1998); depth :
    optical depth of leaves and wood; green : leaves' share of their area; path : in vertical thicknesses."""
    leaves = 1.0 - exponential(-green * depth * path)
    return leaves / max(1.0 - exponential(-depth * path), 1e-12)


@phase
def crown_areas(b, i):
    """Crown area, cover and light use of a lane's stand, from its stems by age (crowns overlap at random)."""
    s, p, w = b.s, b.p, b.w
    conifer = 0.0
    deciduous = 0.0
    for age in range(AGES):
        conifer_crown = crown_factor(
            age,
            p.crown_conifer_seedling[i],
            p.crown_conifer_sapling[i],
            p.crown_conifer_young[i],
            p.crown_conifer_mature[i],
            p.crown_conifer_old[i],
        )
        own_crown = crown_factor(
            age,
            p.crown_deciduous_seedling[i],
            p.crown_deciduous_sapling[i],
            p.crown_deciduous_young[i],
            p.crown_deciduous_mature[i],
            p.crown_deciduous_old[i],
        )
        deciduous_crown = own_crown if p.crown_development[i] > 0.0 else conifer_crown
        conifer += s.conifer_stems[age, i] * conifer_crown
        deciduous += s.deciduous_stems[age, i] * deciduous_crown
    old_conifer = s.conifer_stems[OLDEST, i] * p.crown_conifer_old[i]
    old_deciduous = s.deciduous_stems[OLDEST, i] * deciduous_crown  # the last age's
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


@phase
def leaves(b, day):
    """Leaf area and optical depths of the day."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        leaf = leaf_out(day, p.growth_start_day[i], p.growth_rate[i], p.fall_start_day[i], p.fall_rate[i])
        green_conifer = p.max_lai_conifer[i]
        green_deciduous = p.max_lai_deciduous[i] * leaf
        area_conifer = green_conifer + p.woody_area_index[i]
        wood_deciduous = p.woody_area_index[i] * p.woody_area_deciduous[i]
        area_deciduous = green_deciduous + p.max_lai_deciduous[i] * p.leafless_share[i] + wood_deciduous
        w.optical_conifer[i] = p.light_extinction[i] * area_conifer
        w.optical_deciduous[i] = p.light_extinction[i] * area_deciduous
        w.leaf_conifer[i] = leaf_share(w.optical_conifer[i], green_conifer / area_conifer, p.sky_path[i])
        w.leaf_deciduous[i] = leaf_share(
            w.optical_deciduous[i], green_deciduous / max(area_deciduous, LEAST_AREA), p.sky_path[i]
        )
        w.lai_conifer[i] = green_conifer * w.cover_conifer[i]
        w.lai_deciduous[i] = green_deciduous * w.cover_deciduous[i]
        # Branches catch less snow than light (aspen 13 %, Pomeroy et al. 1998): no more than the site's wood counts.
        snow_deciduous = area_deciduous - wood_deciduous + min(wood_deciduous, p.woody_area_index[i])
        w.snow_optical_deciduous[i] = p.light_extinction[i] * snow_deciduous
        w.snow_area[i] = w.cover_conifer[i] * area_conifer + w.cover_deciduous[i] * snow_deciduous


@phase
def sky_cover(b):
    """Shares of the sky that each species hides from the ground, for hemispheric light and longwave."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        w.sky_conifer[i], w.sky_deciduous[i] = canopy_interception(
            p.sky_path[i], w.crown_area[i], w.share_conifer[i], w.optical_conifer[i], w.optical_deciduous[i]
        )
        w.longwave_cover[i] = w.sky_conifer[i] + w.sky_deciduous[i]
