"""Evaporation: of leaves and wet canopy by net radiation (Priestley and Taylor 1972), of moss and snow by vapour
pressure."""

from sim.jit import compiled, phase
from sim.organic import liquid_water, wetness
from sim.physical_constants import (
    AIR_HEAT_CAPACITY,
    LATENT_HEAT_SUBLIMATION,
    LATENT_HEAT_VAPORISATION,
    PSYCHROMETRIC_PER_HPA,
    VAPOUR_RATIO,
)
from sim.water import left_by_leaves
from sim.weather import SATURATION_AT_FREEZING_HPA, saturation_pressure, saturation_slope

FLOOR_WARMING_K = 30.0  # within a step, that the floor's water lasts


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
def moss_conductance(exchange, wetness, resistance) -> float:
    """Conductance for vapour [m s-1] between moss and air: the air's exchange, and in series with it the moss's, whose
    resistance climbs sharply with drying (Bond-Lamberty et al. 2010). resistance : of wet moss [s m-1]."""
    open_share = wetness * wetness
    return exchange * open_share / (open_share + exchange * resistance) if open_share > 0.0 else 0.0


@compiled
def ground_vapour(b, seconds):
    """Latent heat from lying snow, or else from the thawed moss floor, at the start of the step; its slope by the
    ground's temperature."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        snow = s.swe[i] > 0.0
        surface = min(s.ground[i], 0.0) if snow else s.ground[i]  # snow that falls on a warm skin is at 0 degC
        saturated = saturation_pressure(surface)
        # The windless exchange moves vapour off the moss, too: it stands for eddies that reach the floor in gusts.
        exchange = max(w.ground_exchange[i], p.minimum_conductance[i] / (w.air_density[i] * AIR_HEAT_CAPACITY))
        # All is loaded before it is chosen from, as in `sim.wind.wind_exchange`.
        moss = moss_conductance(exchange, wetness(b, i), p.moss_resistance[i])
        moss = moss if s.ground[i] > 0.0 else 0.0
        conductance = w.ground_exchange[i] if snow else moss
        # Roots of the understorey and capillary rise tie the layer to the soil below it: both give, by what they have.
        layer = liquid_water(b, i)
        soil = left_by_leaves(s.soil_water[i], p.max_water_content_mm[i], p.water_stress_threshold[i], seconds)
        w.floor_water[i] = layer + soil
        w.layer_share[i] = layer / (layer + soil) if layer > 0.0 else 0.0
        # No more vapour is exchanged within the step than there is water, by snow at 0 degC or by a floor that warms:
        # the limit is on the conductance, so that the ground's equation and what is moved agree.
        store = s.swe[i] if snow else w.floor_water[i]
        slope = saturation_slope(surface, saturated)
        drying = abs((SATURATION_AT_FREEZING_HPA if snow else saturated) - w.humidity[i])
        drying = max(drying + (0.0 if snow else FLOOR_WARMING_K * slope), 1e-3)
        transfer = min(w.vapour_density[i] * conductance, store / (seconds * drying))
        heat = LATENT_HEAT_SUBLIMATION if snow else LATENT_HEAT_VAPORISATION
        w.ground_latent[i] = heat * transfer * (saturated - w.humidity[i])
        w.latent_slope[i] = heat * transfer * slope


@compiled
def evaporation(b, seconds):
    """Evaporation of leaves and wet canopy per net radiation."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        slope = w.saturation_slope[i]
        equilibrium = slope / (slope + PSYCHROMETRIC_PER_HPA * p.air_pressure_hpa[i])
        wet_share = s.canopy_rain[i] * w.per_rain_capacity[i]
        dry = (1.0 - wet_share) * equilibrium * w.leaf_coefficient[i]
        wet = wet_share * equilibrium * p.priestley_taylor_wet[i]
        # Above 30 degC Priestley and Taylor's 1.26 would evaporate more than the net radiation.
        scale = 1.0 / max(dry + wet, 1.0)
        w.dry_coefficient[i] = dry * scale
        w.wet_coefficient[i] = wet * scale
        w.wet_limit[i] = LATENT_HEAT_VAPORISATION * (1.0 / seconds) * s.canopy_rain[i]
