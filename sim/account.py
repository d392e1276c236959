"""The year's account: stocks at its beginning and end, means, and what it failed to close."""

import math

from sim.demography import OLDEST, SAPLING_LIMIT, SEEDLING_LIMIT, count
from sim.jit import phase
from sim.soil import thaw_depth
from sim.weather import FREEZING_POINT_K


@phase
def clear_year(b, i):
    """Note the year's first stocks and clear its running sums; the record itself comes in as zeros."""
    s, w = b.s, b.w
    w.biomass_before[i] = s.conifer_biomass[i] + s.deciduous_biomass[i]
    w.soil_before[i] = s.soil_carbon[i]
    w.products_before[i] = s.products[i]
    w.stems_before[i] = count(s.conifer_stems, i, 0, OLDEST) + count(s.deciduous_stems, i, 0, OLDEST)
    w.stems_gain[i] = 0.0
    w.summer_up[i] = 0.0
    w.summer_down[i] = 0.0
    w.winter_up[i] = 0.0
    w.winter_down[i] = 0.0
    w.winter_air[i] = 0.0
    w.winter_days[i] = 0.0
    w.thaw_warmth[i] = 0.0
    w.thaw_seconds[i] = 0.0


@phase
def write_record(b, i):
    """5 of the timeline: stocks at the year's end, means, and what the year failed to close."""
    s, p, w, r = b.s, b.p, b.w, b.r
    young, mature = int(p.young_age_limit[i]), int(p.mature_age_limit[i])
    conifers = count(s.conifer_stems, i, 0, OLDEST)
    density = conifers + count(s.deciduous_stems, i, 0, OLDEST)
    r.density_stems_ha[i] = density
    r.conifer_fraction[i] = conifers / density if density > 0.0 else 0.0
    r.conifer_seedling_stems_ha[i] = count(s.conifer_stems, i, 0, SEEDLING_LIMIT)
    r.conifer_sapling_stems_ha[i] = count(s.conifer_stems, i, SEEDLING_LIMIT + 1, SAPLING_LIMIT)
    r.conifer_young_stems_ha[i] = count(s.conifer_stems, i, SAPLING_LIMIT + 1, young)
    r.conifer_mature_stems_ha[i] = count(s.conifer_stems, i, young + 1, mature)
    r.conifer_old_stems_ha[i] = count(s.conifer_stems, i, mature + 1, OLDEST)
    r.deciduous_seedling_stems_ha[i] = count(s.deciduous_stems, i, 0, SEEDLING_LIMIT)
    r.deciduous_sapling_stems_ha[i] = count(s.deciduous_stems, i, SEEDLING_LIMIT + 1, SAPLING_LIMIT)
    r.deciduous_young_stems_ha[i] = count(s.deciduous_stems, i, SAPLING_LIMIT + 1, young)
    r.deciduous_mature_stems_ha[i] = count(s.deciduous_stems, i, young + 1, mature)
    r.deciduous_old_stems_ha[i] = count(s.deciduous_stems, i, mature + 1, OLDEST)

    r.biomass_kgc_m2[i] = s.conifer_biomass[i] + s.deciduous_biomass[i]
    r.soil_kgc_m2[i] = s.soil_carbon[i]
    r.hwp_kgc_m2[i] = s.products[i]
    r.biomass_change_kgc_m2[i] = r.biomass_kgc_m2[i] - w.biomass_before[i]
    r.soil_change_kgc_m2[i] = r.soil_kgc_m2[i] - w.soil_before[i]
    products_change = s.products[i] - w.products_before[i]
    r.net_carbon_change_kgc_m2[i] = r.biomass_change_kgc_m2[i] + r.soil_change_kgc_m2[i] + products_change
    crossed = (
        r.gpp_kgc_m2[i]
        - r.autotrophic_respiration_kgc_m2[i]
        - r.heterotrophic_respiration_kgc_m2[i]
        - r.fire_loss_kgc_m2[i]
        - r.harvest_emission_kgc_m2[i]
        - r.hwp_decay_kgc_m2[i]
    )
    r.annual_carbon_residual_kgc_m2[i] = abs(r.net_carbon_change_kgc_m2[i] - crossed)
    r.stems_residual_ha[i] = abs(density - w.stems_before[i] - w.stems_gain[i])
    r.summer_albedo[i] = w.summer_up[i] / w.summer_down[i] if w.summer_down[i] > 0.0 else math.nan
    r.winter_albedo[i] = w.winter_up[i] / w.winter_down[i] if w.winter_down[i] > 0.0 else math.nan
    r.organic_layer_m[i] = s.organic_depth[i]
    freezes = p.soil_freezing[i]
    thawed, frozen = p.soil_heat_capacity_thawed[i], p.soil_heat_capacity_frozen[i]
    r.active_layer_depth_m[i] = thaw_depth(
        s.organic_depth[i] * p.moss[i],
        w.thaw_warmth[i],
        w.thaw_seconds[i],
        r.deep_soil_temperature_c[i],
        p.deep_boundary_temperature_k[i] - FREEZING_POINT_K,
        p.deep_soil_node_m[i],
        p.boundary_depth_m[i],
        p.soil_conductivity[i],
        p.soil_conductivity[i] * w.frozen_ratio[i],
        p.organic_conductivity_thawed[i],
        thawed,
        thawed + freezes * (frozen - thawed),
        w.surface_latent[i] / p.surface_soil_depth_m[i],
    )
