"""What reaches canopy and ground in a step: light, snow and rain, phase by phase over the lanes of a block."""

from sim.canopy import stress_ramp
from sim.carbon import photosynthesis
from sim.interception import intercepted, snow_capacity, snow_melt, snow_sublimation, unloaded
from sim.jit import compiled
from sim.radiation import black_body, canopy_interception, path_length, shortwave
from sim.snow import (
    ICE_HEAT_CAPACITY,
    LATENT_HEAT_FUSION,
    LATENT_HEAT_SUBLIMATION,
    LATENT_HEAT_VAPORISATION,
    snow_albedo,
    surface_albedo,
)
from sim.weather import FREEZING_POINT_K, PSYCHROMETRIC_PER_HPA

PSYCHROMETRIC_OVER_ICE = PSYCHROMETRIC_PER_HPA * LATENT_HEAT_VAPORISATION / LATENT_HEAT_SUBLIMATION


@compiled
def any_sun(b):
    """Whether shortwave reaches any lane."""
    for i in range(len(b.s.swe)):
        if b.w.shortwave[i] > 0.0:
            return True
    return False


@compiled
def sunlight(b):
    """Shortwave absorbed by canopy and ground, and photosynthesis."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        path = path_length(w.cos_zenith[i], p.slant_path[i], p.slant_path_max[i])
        beam_conifer, beam_deciduous = canopy_interception(
            path, w.crown_area[i], w.share_conifer[i], w.optical_conifer[i], w.optical_deciduous[i]
        )
        ground = surface_albedo(s.swe[i], w.snow_hiding[i], s.albedo[i], p.ground_albedo[i])
        w.canopy_sw[i], w.ground_sw[i], w.reflected[i], light_conifer, light_deciduous = shortwave(
            w.shortwave[i],
            w.diffuse[i],
            beam_conifer,
            beam_deciduous,
            w.sky_conifer[i],
            w.sky_deciduous[i],
            p.albedo_conifer[i],
            p.albedo_deciduous[i],
            ground,
        )
        stress = w.water_stress[i]
        dry_conifer = 1.0 - stress_ramp(w.deficit[i], p.vpd_low_hpa[i], w.dryness_conifer[i])
        dry_deciduous = 1.0 - stress_ramp(w.deficit[i], p.vpd_low_hpa[i], w.dryness_deciduous[i])
        w.gpp_conifer[i] = photosynthesis(
            light_conifer,
            w.leaf_conifer[i],
            w.light_use_conifer[i],
            p.par_fraction[i],
            w.temperature_stress_conifer[i],
            dry_conifer,
            stress,
        )
        w.gpp_deciduous[i] = photosynthesis(
            light_deciduous,
            w.leaf_deciduous[i],
            w.light_use_deciduous[i],
            p.par_fraction[i],
            w.temperature_stress_deciduous[i],
            dry_deciduous,
            stress,
        )
        w.fixed[i] = 1000.0 * p.photosynthesis_energy[i] * (w.gpp_conifer[i] + w.gpp_deciduous[i])

        # Stomata open in light and above freezing; a lane in the dark is as in `darkness`, whatever its neighbours.
        open_stomata = 1.0 if w.air[i] > 0.0 and w.shortwave[i] > 0.0 else 0.0
        conifer = w.transpiration_conifer[i] * dry_conifer * w.temperature_stress_conifer[i]
        deciduous = w.transpiration_deciduous[i] * dry_deciduous * w.temperature_stress_deciduous[i]
        w.leaf_coefficient[i] = (conifer + deciduous) * stress * open_stomata


@compiled
def darkness(b):
    """The same at night."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.canopy_sw[i] = 0.0
        w.ground_sw[i] = 0.0
        w.reflected[i] = 0.0
        w.gpp_conifer[i] = 0.0
        w.gpp_deciduous[i] = 0.0
        w.fixed[i] = 0.0
        w.leaf_coefficient[i] = 0.0


@compiled
def any_snow(b):
    """Whether snow falls or lies in any lane, in the canopy or on the ground."""
    s, w = b.s, b.w
    total = 0.0
    for i in range(len(s.swe)):
        total += w.snow[i] + s.canopy_snow[i] + s.swe[i]
    return not total <= 0.0  # a lane that is not a number leaves the others their snow


@compiled
def snowfall(b, seconds):
    """Snow caught, sublimated, melted and shed by the canopy; what falls to the ground."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        capacity = snow_capacity(w.air[i], w.snow_area[i], p.snow_capacity_warm_mm[i], p.snow_capacity_cold_mm[i])
        per_capacity = 1.0 / capacity if capacity > 0.0 else 0.0
        caught = intercepted(w.snow[i], s.canopy_snow[i], capacity, per_capacity, w.snow_efficiency[i])
        store = s.canopy_snow[i] + caught
        ground_emission = black_body(s.ground[i] + FREEZING_POINT_K)
        net = w.canopy_sw[i] + w.longwave_cover[i] * (w.sky[i] + ground_emission - 2.0 * w.air_emission[i])
        lost = snow_sublimation(
            store,
            per_capacity,
            p.sublimation_exposure[i],
            net,
            w.canopy_air[i],
            w.deficit[i],
            w.saturation_slope[i],
            PSYCHROMETRIC_OVER_ICE * p.air_pressure_hpa[i],
            LATENT_HEAT_SUBLIMATION,
            seconds,
        )
        store -= lost
        melted = snow_melt(store, per_capacity, w.air[i], w.canopy_air[i], LATENT_HEAT_FUSION, seconds)
        store -= melted
        fallen = unloaded(store, capacity, melted, w.unloading_rate[i], p.snow_unloading_melt[i], seconds)
        s.canopy_snow[i] = store - fallen
        w.canopy_sublimation[i] = lost
        w.canopy_melt[i] = melted
        w.fixed[i] += (LATENT_HEAT_SUBLIMATION * lost + LATENT_HEAT_FUSION * melted) * (1.0 / seconds)

        # Snow reaches the ground as cold as the air; the heat it brings is the heat its mass gains.
        ground_snow = w.snow[i] - caught + fallen
        w.advected[i] = ICE_HEAT_CAPACITY * ground_snow * min(w.air[i], 0.0)
        heat = (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * s.ground[i] + w.advected[i]
        s.swe[i] += ground_snow
        mixed = heat / (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i])
        s.ground[i] = mixed if ground_snow > 0.0 else s.ground[i]
        aged = snow_albedo(
            s.albedo[i],
            s.ground[i],
            ground_snow,
            p.snow_albedo_fresh[i],
            p.snow_albedo_cold[i],
            p.snow_albedo_old[i],
            p.snow_albedo_cold_hours[i],
            p.snow_albedo_melt_hours[i],
            p.snow_albedo_refresh_mm[i],
            seconds,
        )
        s.albedo[i] = aged if s.swe[i] > 0.0 else p.snow_albedo_fresh[i]


@compiled
def no_snow(b):
    """The same without any snow, which then gives off no vapour either (see `sim.solve.snow_vapour`)."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.canopy_sublimation[i] = 0.0
        w.canopy_melt[i] = 0.0
        w.advected[i] = 0.0
        w.snow_latent[i] = 0.0
        w.latent_slope[i] = 0.0
        b.s.albedo[i] = b.p.snow_albedo_fresh[i]


@compiled
def rainfall(b):
    """Rain and melt held by the canopy; what drips or falls through reaches the soil."""
    s, w = b.s, b.w
    for i in range(len(s.swe)):
        held = intercepted(w.rain[i], s.canopy_rain[i], w.rain_capacity[i], w.per_rain_capacity[i], w.longwave_cover[i])
        wet = s.canopy_rain[i] + held + w.canopy_melt[i]
        drip = max(wet - w.rain_capacity[i], 0.0)
        s.canopy_rain[i] = wet - drip
        w.infiltration[i] = w.rain[i] - held + drip
