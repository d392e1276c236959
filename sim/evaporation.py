"""Evaporation by net radiation (Priestley and Taylor 1972), of leaves, wet canopy and bare ground; vapour of snow."""

from sim.jit import compiled, phase
from sim.physical_constants import (
    FREEZING_POINT_K,
    LATENT_HEAT_SUBLIMATION,
    LATENT_HEAT_VAPORISATION,
    PSYCHROMETRIC_PER_HPA,
    VAPOUR_RATIO,
)
from sim.radiation import black_body, longwave_down
from sim.weather import SATURATION_AT_FREEZING_HPA, saturation_pressure, saturation_slope


@phase
def transpiring_leaves(b):
    """Coefficients of the day's transpiration, by the leaves' share of what the canopy intercepts and by how far they
    have acclimated; vapour density."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        cover = w.longwave_cover[i]
        inverse = 1.0 / cover if cover > 0.0 else 0.0
        inverse *= w.co2_stomata[i]
        conifer = p.priestley_taylor_conifer[i] * w.leaf_conifer[i] * w.ready_conifer[i]
        deciduous = p.priestley_taylor_deciduous[i] * w.leaf_deciduous[i] * w.ready_deciduous[i]
        w.transpiration_conifer[i] = conifer * w.sky_conifer[i] * inverse
        w.transpiration_deciduous[i] = deciduous * w.sky_deciduous[i] * inverse
        w.vapour_density[i] = w.air_density[i] * VAPOUR_RATIO / p.air_pressure_hpa[i]


@compiled
def open_stomata(b, i):
    """Coefficient of transpiration: stomata open in light and above freezing, and close as photosynthesis declines."""
    w = b.w
    # A lane in the dark is as in `sim.sunlight.darkness`, whatever its neighbours.
    open_stomata = 1.0 if w.air[i] > 0.0 and w.shortwave[i] > 0.0 else 0.0
    conifer = w.transpiration_conifer[i] * min(w.dry_air_conifer[i], w.water_stress[i])
    deciduous = w.transpiration_deciduous[i] * min(w.dry_air_deciduous[i], w.water_stress[i])
    w.leaf_coefficient[i] = (conifer + deciduous) * open_stomata


@compiled
def snow_vapour(b, seconds):
    """Latent heat from lying snow at the start of the step, and its slope by the ground's temperature."""
    s, w = b.s, b.w
    for i in range(len(s.swe)):
        ice = min(s.ground[i], 0.0)  # snow that falls on a warm skin is at 0 degC
        over_ice = saturation_pressure(ice)
        # At 0 degC, no more vapour is exchanged within the step than snow lies there: the limit is on the conductance,
        # so that the ground's equation and what is moved agree.
        drying = max(abs(SATURATION_AT_FREEZING_HPA - w.humidity[i]), 1e-3)
        transfer = min(w.vapour_density[i] * w.ground_exchange[i], s.swe[i] / (seconds * drying))
        w.snow_latent[i] = LATENT_HEAT_SUBLIMATION * transfer * (over_ice - w.humidity[i])
        w.latent_slope[i] = LATENT_HEAT_SUBLIMATION * transfer * saturation_slope(ice, over_ice)


@compiled
def evaporation(b, seconds):
    """Evaporation of leaves and wet canopy per net radiation, and the latent heat of the ground."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        slope = w.saturation_slope[i]
        equilibrium = slope / (slope + PSYCHROMETRIC_PER_HPA * p.air_pressure_hpa[i])
        wet_share = s.canopy_rain[i] * w.per_rain_capacity[i]
        dry = (1.0 - wet_share) * equilibrium * w.leaf_coefficient[i]
        wet = wet_share * equilibrium * p.priestley_taylor_wet[i]
        # Above 35 degC Priestley and Taylor's 1.26 would evaporate more than the net radiation.
        scale = 1.0 / max(dry + wet, 1.0)
        w.dry_coefficient[i] = dry * scale
        w.wet_coefficient[i] = wet * scale
        w.wet_limit[i] = LATENT_HEAT_VAPORISATION * (1.0 / seconds) * s.canopy_rain[i]

        sky_and_canopy = longwave_down(w.sky[i], w.air_emission[i], w.longwave_cover[i])
        emission = black_body(s.ground[i] + FREEZING_POINT_K)
        available = w.ground_sw[i] + p.ground_emissivity[i] * (sky_and_canopy - emission)
        thawed = w.air[i] > 0.0 and s.ground[i] > 0.0
        moist = min(p.priestley_taylor_ground[i] * equilibrium * w.water_stress[i], 1.0) if thawed else 0.0
        snow_latent = w.snow_latent[i]  # loaded first, as in `sim.wind.wind_exchange`
        w.ground_latent[i] = snow_latent if s.swe[i] > 0.0 else moist * max(available, 0.0)
