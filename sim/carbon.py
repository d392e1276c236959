"""Photosynthesis, respiration, litter. Fluxes in kgC m-2 per second or per day, pools in kgC m-2."""

from sim.jit import compiled
from sim.mathematics import exponential

SECONDS_PER_YEAR = 365.0 * 86400.0


@compiled
def photosynthesis(intercepted, leaf_share, efficiency, par_fraction, temperature_stress, vpd_stress, stress) -> float:
    """Gross production [kgC m-2 s-1] by light use (Monteith 1972; MOD17): intercepted shortwave [W m-2] x the
    leaves' share of it x efficiency [gC MJ-1], reduced by cold, dry air and dry soil."""
    return 1e-9 * par_fraction * intercepted * leaf_share * efficiency * temperature_stress * vpd_stress * stress


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
    start = min(max(fall - 15.0, 0.0), 365.0 - window)
    inside = start <= day < start + window
    return seasonality / window if inside else (1.0 - seasonality) / (365.0 - window)
