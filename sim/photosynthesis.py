"""Photosynthesis by light use: PRELES (Makela et al. 2008; Peltoniemi et al. 2015). Fluxes in kgC m-2 s-1.

PRELES is a model of the day: its efficiency follows from the day's light above the canopy, the day's mean deficit and a
temperature that lags behind the air. So it is found once a day and holds for its steps. Then a day's photosynthesis is
what PRELES gives for it, and nothing is raised to a power within a step.
"""

import math

from sim.jit import compiled, phase
from sim.mathematics import exponential
from sim.physical_constants import MJ_PER_DAY, PHOTONS_PER_MEGAJOULE
from sim.weather import cos_zenith, saturation_pressure, saturation_pressure_water

CO2_REFERENCE_PPM = 380.0
HALF_WAY = math.sqrt(0.5)  # Chebyshev's two points: of a wave, their mean is the day's, but for its fourth power
KPA_PER_HPA = 0.1


@compiled
def photosynthesis(intercepted, efficiency, stress) -> float:
    """Gross production [kgC m-2 s-1] by light use (Monteith 1972): intercepted shortwave [W m-2] x the day's efficiency
    [kgC J-1], reduced by dry air or dry soil."""
    return efficiency * intercepted * stress


@compiled
def light_saturation(photons, saturation) -> float:
    """Efficiency in the day's light above the canopy [mol m-2 day-1], relative to that in little light."""
    return 1.0 / (saturation * photons + 1.0)


@compiled
def acclimated(acclimation, temperature, days) -> float:
    """Acclimated temperature [degC] after a day with this mean (Makela et al. 2004)."""
    return acclimation + (temperature - acclimation) / days


@compiled
def readiness(acclimation, start, span) -> float:
    """Share of full efficiency that the acclimated temperature allows."""
    return min(max((acclimation - start) / span, 0.0), 1.0)


@compiled
def dry_air(deficit_hpa, sensitivity) -> float:
    """Share of full efficiency that the day's mean vapour pressure deficit allows."""
    return exponential(-sensitivity * KPA_PER_HPA * deficit_hpa)


@compiled
def co2_response(ppm, gain) -> float:
    """Photosynthesis or transpiration relative to that in 380 ppm of carbon dioxide."""
    return max(1.0 + gain * math.log(ppm / CO2_REFERENCE_PPM), 0.0)


@compiled
def carbon_dioxide(b, i):
    """Responses to carbon dioxide, for the year."""
    p, w = b.p, b.w
    w.co2_growth[i] = co2_response(p.co2_ppm[i], p.co2_photosynthesis[i])
    w.co2_stomata[i] = co2_response(p.co2_ppm[i], p.co2_transpiration[i])


@compiled
def generated_day(b, hours):
    """Photons above the canopy [mol m-2 day-1] and mean vapour pressure deficit [hPa] of a generated day."""
    p, w = b.p, b.w
    lanes = len(b.s.swe)
    for i in range(lanes):
        w.photons[i] = 0.0
    for t in range(len(hours)):
        for i in range(lanes):
            w.photons[i] += cos_zenith(w.sun_a[i], w.sun_b[i], hours[t, 0])
    for i in range(lanes):
        w.photons[i] *= p.par_fraction[i] * (PHOTONS_PER_MEGAJOULE * MJ_PER_DAY / len(hours)) * w.top_of_canopy[i]
        swing = HALF_WAY * w.amplitude[i]
        warm = saturation_pressure(w.mean_temperature[i] + swing) - w.vapour[i]
        cold = saturation_pressure(w.mean_temperature[i] - swing) - w.vapour[i]
        w.mean_deficit[i] = 0.5 * (max(warm, 0.0) + max(cold, 0.0))


@compiled
def observed_day(b, observed):
    """The same of an observed day."""
    p, w = b.p, b.w
    steps = observed.shape[0]
    for i in range(len(b.s.swe)):
        sun, deficit = 0.0, 0.0
        for t in range(steps):
            air = observed[t, 0, i]
            sun += observed[t, 3, i]
            deficit += max(saturation_pressure(air) - observed[t, 1, i] * saturation_pressure_water(air), 0.0)
        w.photons[i] = p.par_fraction[i] * (PHOTONS_PER_MEGAJOULE * MJ_PER_DAY / steps) * sun
        w.mean_deficit[i] = deficit / steps


@phase
def light_use(b, hours, observed):
    """The day's efficiency of leaves and understorey, per shortwave that they intercept [kgC J-1].

    hours, observed : as of `sim.forcing.step_weather`.
    """
    s, p, w = b.s, b.p, b.w
    if observed.shape[0] > 0:
        observed_day(b, observed)
    else:
        generated_day(b, hours)
    for i in range(len(s.swe)):
        s.acclimation[i] = acclimated(s.acclimation[i], w.mean_temperature[i], p.acclimation_days[i])
        w.ready_conifer[i] = readiness(
            s.acclimation[i], p.acclimation_start_conifer_c[i], p.acclimation_span_conifer_k[i]
        )
        w.ready_deciduous[i] = readiness(
            s.acclimation[i], p.acclimation_start_deciduous_c[i], p.acclimation_span_deciduous_k[i]
        )
        w.dry_air_conifer[i] = dry_air(w.mean_deficit[i], p.dry_air_conifer[i])
        w.dry_air_deciduous[i] = dry_air(w.mean_deficit[i], p.dry_air_deciduous[i])
        # mol MJ-1 x gC mol-1, and kgC J-1 from gC MJ-1
        light = 1e-9 * PHOTONS_PER_MEGAJOULE * p.par_fraction[i] * w.co2_growth[i]
        conifer = light * w.ready_conifer[i] * light_saturation(w.photons[i], p.light_saturation_conifer[i])
        deciduous = light * w.ready_deciduous[i] * light_saturation(w.photons[i], p.light_saturation_deciduous[i])
        w.efficiency_conifer[i] = conifer * w.light_use_conifer[i] * w.leaf_conifer[i]
        w.efficiency_deciduous[i] = deciduous * w.light_use_deciduous[i] * w.leaf_deciduous[i]
        w.efficiency_understorey[i] = conifer * p.light_use_understorey[i]


@compiled
def assimilate(b, i, light_conifer, light_deciduous):
    """Gross production of both species, from the light that each intercepts [W m-2]."""
    w = b.w
    w.gpp_conifer[i] = photosynthesis(
        light_conifer, w.efficiency_conifer[i], min(w.dry_air_conifer[i], w.water_stress[i])
    )
    w.gpp_deciduous[i] = photosynthesis(
        light_deciduous, w.efficiency_deciduous[i], min(w.dry_air_deciduous[i], w.water_stress[i])
    )


@compiled
def energy_stored(gross, per_gram) -> float:
    """Light [W m-2] that a gross production [kgC m-2 s-1] stores as carbon, `per_gram` [J gC-1]."""
    return 1000.0 * per_gram * gross


@compiled
def energy_of_photosynthesis(b, i) -> float:
    """Light that trees and understorey store as carbon [W m-2]."""
    gross = b.w.gpp_conifer[i] + b.w.gpp_deciduous[i] + b.w.gpp_understorey[i]
    return energy_stored(gross, b.p.photosynthesis_energy[i])
