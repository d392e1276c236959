"""One sub-daily step of a block of stands, in order: air, light, snow and rain, temperatures, fluxes, closure.

Fluxes are computed once, at the temperatures of an implicit step, and then moved between stores. `balance` checks from
the stores alone that nothing was lost.
"""

from sim.arrival import any_snow, any_sun, darkness, no_snow, rainfall, snowfall, sunlight
from sim.day import wind_exchange
from sim.jit import compiled
from sim.radiation import black_body
from sim.snow import ICE_HEAT_CAPACITY, LATENT_HEAT_FUSION
from sim.solve import conductances, ground_exchange, snow_vapour, solve_canopy
from sim.transfer import move_carbon, move_energy_and_water
from sim.water import water_stress
from sim.weather import FREEZING_POINT_K, saturation_pressure, saturation_pressure_water, saturation_slope, snow_share


@compiled
def simulate_step(b, seconds):
    """Advance a block by one step of `seconds`, in the weather that `step_weather` has left in it."""
    stores_before(b, seconds)
    if any_sun(b):
        sunlight(b)
    else:
        darkness(b)
    snow = any_snow(b)
    if snow:
        snowfall(b, seconds)
    else:
        no_snow(b)
    rainfall(b)
    ground_exchange(b)
    if snow:
        snow_vapour(b, seconds)
    conductances(b, seconds)
    solve_canopy(b)
    move_energy_and_water(b, seconds)
    move_carbon(b, seconds)
    balance(b, seconds)


@compiled
def step_weather(b, t, hours, seconds, observed):
    """Weather of a step. It is apart from the step because it alone takes arrays, whose references are counted.

    t : number of the step in its day; hours : cosine and sine of the hour angle at the middle of each step of a day,
    shape (steps, 2); observed : the day's forcing (steps, 6, lanes), or (0, 6, lanes) for none.
    """
    if observed.shape[0] > 0:
        observed_air(b, observed[t], hours[t, 0])
    else:
        generated_air(b, hours[t, 0], hours[t, 1], seconds)


@compiled
def generated_air(b, cos_hour, sin_hour, seconds):
    """Sun, air temperature, longwave and precipitation of the step, from the day's generated weather."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.cos_zenith[i] = max(w.sun_a[i] + w.sun_b[i] * cos_hour, 0.0)
        w.shortwave[i] = w.top_of_canopy[i] * w.cos_zenith[i]
        w.air[i] = w.mean_temperature[i] + w.amplitude[i] * (cos_hour * w.cos_peak[i] + sin_hour * w.sin_peak[i])
        w.air_emission[i] = black_body(w.air[i] + FREEZING_POINT_K)
        w.sky[i] = w.emissivity[i] * w.air_emission[i]
        w.precipitation_step[i] = w.precipitation[i] * (seconds / 86400.0)


@compiled
def observed_air(b, row, cos_hour):
    """The same from observation; row : (6, lanes), columns as in `sim.state.FORCING`."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.cos_zenith[i] = max(w.sun_a[i] + w.sun_b[i] * cos_hour, 0.0)
        w.shortwave[i] = row[3, i]
        w.air[i] = row[0, i]
        w.vapour[i] = row[1, i] * saturation_pressure_water(row[0, i])
        w.air_emission[i] = black_body(row[0, i] + FREEZING_POINT_K)
        w.sky[i] = row[4, i]
        w.precipitation_step[i] = row[5, i]
        wind_exchange(b, i, row[2, i])


@compiled
def stores_before(b, seconds):
    """Saturation, rain and snow of the step, drought stress, and what is stored before it."""
    s, p, w = b.s, b.p, b.w
    for i in range(len(s.swe)):
        saturation = saturation_pressure(w.air[i])
        w.saturation_slope[i] = saturation_slope(w.air[i], saturation)
        # The vapour of the day's mean is more than a cold night's air can hold: the rest is dew and fog, not followed.
        w.humidity[i] = min(w.vapour[i], saturation)
        w.deficit[i] = saturation - w.humidity[i]
        w.snow[i] = w.precipitation_step[i] * snow_share(w.air[i])
        w.rain[i] = w.precipitation_step[i] - w.snow[i]
        w.water_stress[i] = water_stress(
            s.soil_water[i], p.max_water_content_mm[i], p.water_stress_threshold[i], seconds
        )
        ice = s.swe[i] + s.canopy_snow[i]
        w.energy_before[i] = (
            s.trunk_capacity[i] * s.trunk[i]
            + (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * s.ground[i]
            + s.surface_heat[i]
            + s.deep_heat[i]
            - LATENT_HEAT_FUSION * ice
        )
        w.water_before[i] = ice + s.canopy_rain[i] + s.soil_water[i]


@compiled
def balance(b, seconds):
    """Whether the stores changed by what crossed the stand's boundary, energy and water."""
    s, p, w, r = b.s, b.p, b.w, b.r
    for i in range(len(s.swe)):
        ice = s.swe[i] + s.canopy_snow[i]
        energy = (
            s.trunk_capacity[i] * s.trunk[i]
            + (ICE_HEAT_CAPACITY * s.swe[i] + p.skin_heat_capacity[i]) * s.ground[i]
            + s.surface_heat[i]
            + s.deep_heat[i]
            - LATENT_HEAT_FUSION * ice
        )
        water = ice + s.canopy_rain[i] + s.soil_water[i]
        energy_failure = abs(energy - w.energy_before[i] - w.energy_gain[i]) * (1.0 / seconds)
        water_failure = abs(water - w.water_before[i] - w.water_gain[i])
        r.energy_residual_w_m2[i] = max(r.energy_residual_w_m2[i], energy_failure)
        r.water_residual_mm[i] = max(r.water_residual_mm[i], water_failure)
