"""Weather generator: one day's weather from the site's climate and the day's random draws.

Temperatures in degC, vapour pressures in hPa, fluxes in W m-2, precipitation in mm. The hourly cosine of
temperature and the sun's path are resolved at the model's step; all else holds for the day.
"""

import math

from sim.jit import compiled
from sim.mathematics import exponential
from sim.physical_constants import DAYS_PER_YEAR, FREEZING_POINT_K, GAS_CONSTANT

#: Saturation vapour pressure e = scale exp(a T / (T + b)), T in degC: scale [hPa], a, b [degC].
OVER_ICE = (6.1121, 22.587, 273.86)
OVER_WATER = (6.1094, 17.625, 243.04)
SATURATION_AT_FREEZING_HPA = OVER_ICE[0]
LARGEST_RAIN_GROWTH = 1.0  # logarithm
LARGEST_SWING = 1.0  # of a day's precipitation with its temperature anomaly, relative


@compiled
def saturation_pressure(temperature: float) -> float:
    """Saturation vapour pressure [hPa] over water above 0 degC, over ice below (Alduchov and Eskridge 1996)."""
    over_ice = temperature <= 0.0
    scale = OVER_ICE[0] if over_ice else OVER_WATER[0]
    a = OVER_ICE[1] if over_ice else OVER_WATER[1]
    b = OVER_ICE[2] if over_ice else OVER_WATER[2]
    return scale * exponential(a * temperature * (1.0 / (temperature + b)))


@compiled
def saturation_slope(temperature: float, saturation: float) -> float:
    """Derivative of `saturation_pressure` [hPa K-1], given its value."""
    over_ice = temperature <= 0.0
    a = OVER_ICE[1] if over_ice else OVER_WATER[1]
    b = OVER_ICE[2] if over_ice else OVER_WATER[2]
    inverse = 1.0 / (temperature + b)  # which `saturation_pressure` has too: one division for both
    return saturation * (a * b) * (inverse * inverse)


@compiled
def saturation_pressure_water(temperature: float) -> float:
    """Saturation vapour pressure [hPa] over (supercooled) water, to which relative humidity refers."""
    return OVER_WATER[0] * exponential(OVER_WATER[1] * temperature / (temperature + OVER_WATER[2]))


@compiled
def air_density(pressure_hpa, temperature) -> float:
    """Density of air [kg m-3]."""
    return 100.0 * pressure_hpa / (GAS_CONSTANT * (temperature + FREEZING_POINT_K))


@compiled
def season(day: int) -> int:
    """0 Dec-Feb, 1 Mar-May, 2 Jun-Aug, 3 Sep-Nov, for day 0 (1 January) to 364."""
    if day < 59 or day >= 334:
        return 0
    if day < 151:
        return 1
    if day < 243:
        return 2
    return 3


@compiled
def december_to_march(day: int) -> bool:
    """Whether a day belongs to the months of the winter albedo."""
    return season(day) == 0 or day < 90


@compiled
def of_season(day: int, winter: float, spring: float, summer: float, autumn: float) -> float:
    """The value of the day's season."""
    s = season(day)
    if s == 0:
        return winter
    if s == 1:
        return spring
    if s == 2:
        return summer
    return autumn


@compiled
def daily_mean_temperature(cosine, sine, cos_warmest, sin_warmest, annual_mean, amplitude, anomaly) -> float:
    """Daily mean air temperature [degC]: a seasonal cosine that peaks on the warmest day, and the day's anomaly.

    cosine, sine : of the day's angle in the year; cos_warmest, sin_warmest : of the warmest day's.
    """
    return annual_mean + amplitude * (cosine * cos_warmest + sine * sin_warmest) + anomaly


@compiled
def precipitation_season(
    day, temperature, summer_start, summer_end, spring_start, spring_end, autumn_start, autumn_end, snow_end, snow_start
) -> int:
    """0 snow season, 1 shoulder, 2 summer; where snow season and shoulder overlap, frost decides.

    Days that no window covers count as shoulder, so that no part of the year is without precipitation.
    """
    if summer_start <= day < summer_end:
        return 2
    in_snow_season = day < snow_end or day >= snow_start
    in_shoulder = spring_start <= day < spring_end or autumn_start <= day < autumn_end
    if in_snow_season and (temperature < 0.0 or not in_shoulder):
        return 0
    return 1


@compiled
def daily_precipitation(dice, amount, probability, mean, sensitivity, departure, swing) -> float:
    """Precipitation of the day [mm]: `mean` x an exponential deviate `amount` on a wet day, scaled by temperature.

    departure : degrees of a rainy day from its season's base temperature (convection), of a snow day from the
    climate's mean for the date. Beyond 2.7 times (15 degC at 0.07 per degree) rain grows no more: air that warm is
    outside the records that the sensitivity is from.
    swing : the part of the departure that is the day's anomaly, where anomalies are as large as on record:
    precipitation is linear in it, up to none and twice as much, so that the mean stays.
    """
    growth = exponential(min(sensitivity * (departure - swing), LARGEST_RAIN_GROWTH))
    growth *= 1.0 + min(max(sensitivity * swing, -LARGEST_SWING), LARGEST_SWING)
    return mean * amount * growth if dice < probability else 0.0


@compiled
def wet_day_factor(probability, factor) -> float:
    """How many times as often it is wet, with as much less on each wet day; never oftener than every day."""
    return min(factor, 1.0 / max(probability, 1e-9))


@compiled
def diurnal_amplitude(amplitude, precipitation, sensitivity, threshold, largest_reduction, smallest, sun) -> float:
    """Half-range of the day's temperature [degC], damped by rain and by a low sun (`sun`: share of full sun)."""
    reduction = min(largest_reduction, sensitivity * max(0.0, precipitation - threshold))
    return max(amplitude * (1.0 - reduction), min(smallest, amplitude)) * sun


@compiled
def hour_angle(step: int, steps_per_day: int) -> float:
    """Angle of the sun [rad] from its noon, at the middle of a step of the day."""
    return 2.0 * math.pi * ((step + 0.5) / steps_per_day - 0.5)


@compiled
def cos_zenith(constant, by_hour, cos_hour) -> float:
    """Cosine of the sun's zenith angle, 0 below the horizon, from the day's two coefficients."""
    return max(constant + by_hour * cos_hour, 0.0)


@compiled
def solar_declination(day: int) -> float:
    """Declination [rad] (Cooper 1969)."""
    return 0.40928 * math.sin(2.0 * math.pi * (284.0 + day + 1.0) / DAYS_PER_YEAR)


@compiled
def solar_distance_factor(day: int) -> float:
    """Squared mean over actual distance of the sun (Duffie and Beckman 1980, Eq. 1.4.1a)."""
    return 1.0 + 0.033 * math.cos(2.0 * math.pi * (day + 1.0) / DAYS_PER_YEAR)


@compiled
def diffuse_share(clearness: float) -> float:
    """Diffuse share of global radiation from the clearness index (Erbs, Klein and Duffie 1982, Eq. 1)."""
    k = clearness
    if k <= 0.22:
        return 1.0 - 0.09 * k
    if k <= 0.80:
        return 0.9511 - 0.1604 * k + 4.388 * k * k - 16.638 * k * k * k + 12.336 * k * k * k * k
    return 0.165


@compiled
def sky_emissivity(temperature: float, vapour_pressure: float, cloud: float) -> float:
    """All-sky emissivity: clear sky of Prata (1996, Eq. 16), clouds closing the share `cloud` of the rest."""
    w = 46.5 * vapour_pressure / (temperature + FREEZING_POINT_K)
    clear = 1.0 - (1.0 + w) * exponential(-math.sqrt(1.2 + 3.0 * w))
    return clear + (1.0 - clear) * cloud


@compiled
def snow_share(temperature: float) -> float:
    """Share of precipitation that falls as snow: all at 0 degC, none at 2 degC (FSM2)."""
    return min(max(1.0 - 0.5 * temperature, 0.0), 1.0)


@compiled
def drought_index(index, temperature, precipitation, swe, evaporation_per_degree) -> float:
    """Running precipitation deficit [mm] of the snow-free season: warmth dries, rain wets, snow resets to 0."""
    if swe > 0.0:
        return 0.0
    return max(0.0, index + evaporation_per_degree * max(temperature, 0.0) - precipitation)
