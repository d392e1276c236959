"""Respiration, litter and decay: carbon moved between air, trees, soil and products. Pools in kgC m-2."""

import math

from sim.jit import compiled, phase
from sim.mathematics import exponential
from sim.physical_constants import DAYS_PER_YEAR, SECONDS_PER_YEAR


@compiled
def q10_factor(temperature, reference, log_q10) -> float:
    """Q10 response of respiration (van 't Hoff 1898)."""
    return exponential(log_q10 * 0.1 * (temperature - reference))


@compiled
def maintenance_rates(base, leaf_share, reference_leaf_area, reference_biomass) -> tuple[float, float]:
    """Maintenance respiration at the reference temperature, per leaf area [kgC s-1] and per biomass [s-1], of which the
    reference stand, whose rate is `base` [kgC m-2 yr-1], has `leaf_share` in its leaves."""
    rate = base / SECONDS_PER_YEAR
    return rate * leaf_share / reference_leaf_area, rate * (1.0 - leaf_share) / reference_biomass


@compiled
def autotrophic(gross, maintained, growth_share, biomass, seconds) -> float:
    """Autotrophic respiration [kgC m-2 per step]: maintenance and the cost of growth, never more than is there."""
    demand = maintained + growth_share * max(gross - maintained, 0.0)
    return min(demand * seconds, gross * seconds + biomass)


@compiled
def litter_share(day, fall, window, seasonality) -> float:
    """Share of the year's litter that falls on this day: `seasonality` of it in the autumn window."""
    start = min(max(fall - 15.0, 0.0), DAYS_PER_YEAR - window)
    inside = start <= day < start + window
    return seasonality / window if inside else (1.0 - seasonality) / (DAYS_PER_YEAR - window)


@compiled
def respiration_rates(b, i):
    """Rates of the year at the reference temperature, and the logarithm of their Q10."""
    p, w = b.p, b.w
    w.log_q10[i] = math.log(p.q10[i])
    w.leaf_rate[i], w.wood_rate[i] = maintenance_rates(
        p.base_respiration[i], p.maintenance_leaf_share[i], p.reference_lai[i], p.reference_biomass_kgc_m2[i]
    )
    w.soil_rate[i] = p.soil_respiration[i] / (p.reference_soil_carbon[i] * SECONDS_PER_YEAR)


@phase
def litter(b, day):
    """Litter of the day, from trees to soil."""
    s, p, r = b.s, b.p, b.r
    for i in range(len(s.swe)):
        share = p.litterfall_fraction[i] * litter_share(
            day, p.fall_start_day[i], p.litter_window_days[i], p.litterfall_seasonality[i]
        )
        conifer = min(share, 1.0) * s.conifer_biomass[i]
        deciduous = min(share * p.deciduous_litter_ratio[i], 1.0) * s.deciduous_biomass[i]
        s.conifer_biomass[i] -= conifer
        s.deciduous_biomass[i] -= deciduous
        s.soil_carbon[i] += conifer + deciduous
        r.litterfall_kgc_m2[i] += conifer + deciduous


@compiled
def move_carbon(b, seconds):
    """Photosynthesis and respiration, moved between air, trees and soil; the understorey's gain is litter at once."""
    s, p, w, r = b.s, b.p, b.w, b.r
    for i in range(len(s.swe)):
        before = s.conifer_biomass[i] + s.deciduous_biomass[i] + s.soil_carbon[i]
        warmth = q10_factor(w.air[i], p.respiration_reference_c[i], w.log_q10[i])
        conifer = warmth * (w.leaf_rate[i] * w.lai_conifer[i] + w.wood_rate[i] * s.conifer_biomass[i])
        deciduous = warmth * (w.leaf_rate[i] * w.lai_deciduous[i] + w.wood_rate[i] * s.deciduous_biomass[i])
        conifer = autotrophic(w.gpp_conifer[i], conifer, p.growth_respiration[i], s.conifer_biomass[i], seconds)
        deciduous = autotrophic(w.gpp_deciduous[i], deciduous, p.growth_respiration[i], s.deciduous_biomass[i], seconds)
        warmth = q10_factor(w.soil_top[i], p.respiration_reference_c[i], w.log_q10[i])
        soil = min(warmth * w.soil_rate[i] * seconds, 1.0) * s.soil_carbon[i]
        s.conifer_biomass[i] += w.gpp_conifer[i] * seconds - conifer
        s.deciduous_biomass[i] += w.gpp_deciduous[i] * seconds - deciduous
        below = w.gpp_understorey[i] * seconds
        below_litter = p.understorey_carbon_use[i] * below
        below_respired = below - below_litter
        s.soil_carbon[i] += below_litter - soil
        gross = (w.gpp_conifer[i] + w.gpp_deciduous[i]) * seconds + below
        after = s.conifer_biomass[i] + s.deciduous_biomass[i] + s.soil_carbon[i]
        failure = abs(after - before - (gross - conifer - deciduous - below_respired - soil))
        r.carbon_residual_kgc_m2[i] = max(r.carbon_residual_kgc_m2[i], failure)
        r.gpp_kgc_m2[i] += gross
        r.autotrophic_respiration_kgc_m2[i] += conifer + deciduous + below_respired
        r.understorey_gpp_kgc_m2[i] += below
        r.understorey_litter_kgc_m2[i] += below_litter
        r.heterotrophic_respiration_kgc_m2[i] += soil


@compiled
def decay_products(b, i):
    """A year's loss of wood products, if they have a half-life."""
    s, w, r = b.s, b.w, b.r
    lost = s.products[i] * w.products_decay[i]
    s.products[i] -= lost
    r.hwp_decay_kgc_m2[i] = lost
