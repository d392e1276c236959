"""One step of a stand written a second time, from docs/model.md and the two parameter tables alone.

Plain scalar code in the order of that page, a small function for each process, with its section. It shares nothing with
`sim/`: exponentials are the C library's, and the temperatures come from false position on the canopy's, with a dense
solve of the other four. tests/test_reference_step.py compares it with the kernel.

Throughout, `p` is a namespace of all rows of the two tables and of the mechanisms, `s` one of `sim.state.STATE` and of
the stems by year of age. Entries: `generated_weather` or `observed_weather`, then `prepare_day`, then `take_step`.
"""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

STEFAN_BOLTZMANN = 5.670374419e-8  # W m-2 K-4
FREEZING_K = 273.15
SOLAR_CONSTANT = 1361.0  # W m-2
GRAVITY = 9.81  # m s-2
VON_KARMAN = 0.4
GAS_CONSTANT = 287.05  # J kg-1 K-1, of dry air
AIR_HEAT = 1005.0  # J kg-1 K-1
PSYCHROMETRIC = 1005.0 / (0.622 * 2.5e6)  # K-1, times the air pressure
VAPOUR_RATIO = 0.622  # molar masses of water and air
ICE_HEAT = 2100.0  # J kg-1 K-1
FUSION = 3.34e5  # J kg-1
VAPORISATION = 2.5e6  # J kg-1
SUBLIMATION = FUSION + VAPORISATION
WATER_DENSITY = 1000.0  # kg m-3
WATER_HEAT = 4180.0  # J kg-1 K-1
YEAR_S = 365.0 * 86400.0

SPECIES = ("conifer", "deciduous")
CLASSES = ("seedling", "sapling", "young", "mature", "old")
CLASS_AGES = (3, 13, 30, 70, 101)


def of(p, name, species, unit=""):
    """The species' value of a parameter that both have."""
    return getattr(p, f"{name}_{species}{unit}")


def ramp(value, zero, one):
    """0 up to `zero`, 1 from `one` on, a straight line between; `one` may be the lower end."""
    return min(max((value - zero) / (one - zero), 0.0), 1.0)


# ------------------------------------------------------------------------------------------------------ 3. weather


def saturation_pressure_water(celsius):
    """Saturation vapour pressure over water [hPa]."""
    return 6.1094 * math.exp(17.625 * celsius / (celsius + 243.04))


def saturation_pressure(celsius):
    """The same, over ice below 0 degC."""
    if celsius <= 0.0:
        return 6.1121 * math.exp(22.587 * celsius / (celsius + 273.86))
    return saturation_pressure_water(celsius)


def saturation_slope(celsius):
    """Derivative of `saturation_pressure` [hPa K-1]."""
    a, b = (22.587, 273.86) if celsius <= 0.0 else (17.625, 243.04)
    return saturation_pressure(celsius) * a * b / (celsius + b) ** 2


def sun(p, day, hour_angle):
    """Sine of the sun's height (0 at night), and extraterrestrial sunlight across the beam [W m-2]."""
    number = day + 1
    declination = 0.40928 * math.sin(2.0 * math.pi * (284 + number) / 365.0)
    distance = 1.0 + 0.033 * math.cos(2.0 * math.pi * number / 365.0)
    latitude = math.radians(p.latitude_deg)
    up = math.sin(latitude) * math.sin(declination)
    across = math.cos(latitude) * math.cos(declination)
    return max(up + across * math.cos(hour_angle), 0.0), SOLAR_CONSTANT * distance


def diffuse_share(k):
    """Diffuse share of shortwave at a clearness."""
    if k <= 0.22:
        return 1.0 - 0.09 * k
    if k <= 0.8:
        return 0.9511 - 0.1604 * k + 4.388 * k**2 - 16.638 * k**3 + 12.336 * k**4
    return 0.165


def season(day):
    """Meteorological season."""
    month_starts = (0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334)
    month = sum(day >= start for start in month_starts)
    return ("winter", "spring", "summer", "autumn")[month % 12 // 3]


def daily_mean_temperature(p, day, anomaly):
    """degC."""
    angle = 2.0 * math.pi * (day + 0.5 - p.warmest_day) / 365.0
    return p.mean_annual_temperature_c + p.seasonal_amplitude_c * math.cos(angle) + anomaly


def warming(p, day):
    """K that a scenario adds, to the day's mean after its precipitation."""
    angle = 2.0 * math.pi * (day + 0.5 - p.warmest_day) / 365.0
    return p.warming_k + p.warming_amplitude_k * math.cos(angle)


def temperature_anomaly(p, day, yesterday, noise):
    """The day's departure from the season [K]; nothing is remembered from the year before."""
    spread = p.daily_noise_std_c
    if p.weather_as_observed:
        spread *= getattr(p, f"noise_factor_{season(day)}")
    if day == 0:
        return spread * noise
    memory = p.temperature_persistence
    return memory * yesterday + math.sqrt(1.0 - memory**2) * spread * noise


def daily_precipitation(p, day, celsius, anomaly, dice, amount):
    """mm."""
    number = day + 1
    in_shoulder = (
        p.spring_shoulder_start_day <= number < p.spring_shoulder_end_day
        or p.autumn_shoulder_start_day <= number < p.autumn_shoulder_end_day
    )
    in_snow_season = number < p.snow_season_end_day or number >= p.snow_season_start_day
    swing = anomaly
    if p.summer_start_day <= number < p.summer_end_day:
        probability, mean, sensitivity = p.summer_rain_prob, p.summer_rain_mm_day, p.summer_precip_temp_sensitivity
        departure = celsius - p.summer_precip_base_temp_c
    elif in_snow_season and (celsius < 0.0 or not in_shoulder):
        probability, sensitivity = p.winter_snow_prob, p.winter_precip_temp_sensitivity
        mean = p.winter_snow_mm_day * (p.snowfall_scale if p.snowfall_limit else 1.0)
        departure = swing = anomaly if p.snowfall_limit else 0.0
    else:
        probability, mean = p.shoulder_rain_prob, p.shoulder_rain_mm_day
        sensitivity = p.shoulder_precip_temp_sensitivity
        departure = celsius - p.shoulder_precip_base_temp_c
    if not p.weather_as_observed:
        return mean * amount * math.exp(min(sensitivity * departure, 1.0)) if dice < probability else 0.0
    # Oftener and less at a time; with the anomaly in a straight line from none to twice as much.
    often = p.wet_day_factor if probability * p.wet_day_factor < 1.0 else 1.0 / probability
    growth = math.exp(min(sensitivity * (departure - swing), 1.0)) * min(max(1.0 + sensitivity * swing, 0.0), 2.0)
    return mean / often * amount * growth if dice < probability * often else 0.0


def diurnal_amplitude(p, day, precipitation):
    """K."""
    reduction = p.rain_diurnal_sensitivity * max(0.0, precipitation - p.rain_diurnal_threshold_mm)
    damped = p.diurnal_amplitude_c * (1.0 - min(p.max_diurnal_reduction, reduction))
    floor = min(p.min_diurnal_amplitude_c, p.diurnal_amplitude_c)
    noon, _ = sun(p, day, 0.0)
    return max(damped, floor) * min(noon / p.diurnal_full_sun, 1.0)


def sky_emissivity(celsius, vapour, cloud):
    """Of clear sky, and of the share of it that clouds close."""
    w = 46.5 * vapour / (celsius + FREEZING_K)
    clear = 1.0 - (1.0 + w) * math.exp(-math.sqrt(1.2 + 3.0 * w))
    return clear + (1.0 - clear) * cloud


def air_density(p, celsius):
    """kg m-3, of the day."""
    return 100.0 * p.air_pressure_hpa / (GAS_CONSTANT * (celsius + FREEZING_K))


def daily_wind(p, deviate):
    """Wind speed of a day [m s-1], with a logarithm that is normal, and the site's mean."""
    spread = p.wind_spread if p.weather_as_observed else 0.0
    return p.wind_speed_m_s * math.exp(spread * deviate) / math.exp(spread**2 / 2.0)


def generated_weather(p, day, yesterday, noise, dice, amount, windiness):
    """A day's weather from its draws; `yesterday` is the temperature anomaly of the day before."""
    anomaly = temperature_anomaly(p, day, yesterday, noise)
    mean = daily_mean_temperature(p, day, anomaly)
    precipitation = p.precipitation_factor * daily_precipitation(p, day, mean, anomaly, dice, amount)
    mean += warming(p, day)
    amplitude = diurnal_amplitude(p, day, precipitation)
    wet, quarter = "wet" if precipitation >= 1.0 else "dry", season(day)
    humidity = min(max(p.relative_humidity + getattr(p, f"humidity_{wet}_{quarter}"), 0.05), 1.0)
    vapour = humidity * saturation_pressure_water(mean)
    half_year = "warm" if quarter in ("spring", "summer") else "cold"
    cloud = getattr(p, f"cloud_wet_{half_year}" if wet == "wet" else f"cloud_dry_{quarter}")
    clearness = getattr(p, f"clearness_{wet}_{quarter}")
    if p.weather_as_observed and wet == "dry":
        clearness = getattr(p, f"clearness_observed_dry_{quarter}")
        if quarter in ("summer", "autumn"):
            cloud = getattr(p, f"cloud_observed_dry_{quarter}")
    return SimpleNamespace(
        anomaly=anomaly,
        mean=mean,
        amplitude=amplitude,
        precipitation=precipitation,
        vapour=vapour,
        emissivity=sky_emissivity(mean, vapour, cloud),
        clearness=clearness,
        diffuse=diffuse_share(clearness),
        wind=daily_wind(p, windiness),
        rows=None,
    )


def observed_weather(p, day, rows):
    """A day's weather from an observed forcing, shape (steps, columns of `sim.state.FORCING`)."""
    suns = [sun(p, day, hour_angle(step, len(rows))) for step in range(len(rows))]
    possible = sum(sine * extraterrestrial for sine, extraterrestrial in suns)
    clearness = min(rows[:, 3].sum() / possible, 1.0) if possible > 0.0 else 0.0
    return SimpleNamespace(mean=rows[:, 0].mean(), diffuse=diffuse_share(clearness), rows=rows)


def hour_angle(step, steps_per_day):
    """Of the middle of a step, 0 at noon."""
    return 2.0 * math.pi * ((step + 0.5) / steps_per_day - 0.5)


def generated_air(p, today, step, steps_per_day):
    """Temperature, vapour, wind, shortwave, longwave and precipitation of a step."""
    weather, angle = today.weather, hour_angle(step, steps_per_day)
    celsius = weather.mean + weather.amplitude * math.cos(angle - 2.0 * math.pi * p.peak_diurnal_hour / 24.0)
    sine, extraterrestrial = sun(p, today.number, angle)
    return SimpleNamespace(
        celsius=celsius,
        vapour=weather.vapour,
        wind=weather.wind,
        shortwave=weather.clearness * extraterrestrial * sine,
        longwave=weather.emissivity * black_body(celsius),
        precipitation=weather.precipitation / steps_per_day,
    )


def observed_air(row):
    """The same from observation."""
    celsius, humidity, wind, shortwave, longwave, precipitation = row.tolist()
    return SimpleNamespace(
        celsius=celsius,
        vapour=humidity * saturation_pressure_water(celsius),
        wind=wind,
        shortwave=shortwave,
        longwave=longwave,
        precipitation=precipitation,
    )


def snow_share(celsius):
    """Share of precipitation that falls as snow."""
    return min(max(1.0 - celsius / 2.0, 0.0), 1.0)


def air_of_step(p, today, step, steps_per_day):
    """The air, and the rain and snow that fall from it."""
    rows = today.weather.rows
    air = generated_air(p, today, step, steps_per_day) if rows is None else observed_air(rows[step])
    air.saturated = saturation_pressure(air.celsius)
    air.vapour = min(air.vapour, air.saturated)
    air.deficit = air.saturated - air.vapour
    air.slope = saturation_slope(air.celsius)
    air.gamma = PSYCHROMETRIC * p.air_pressure_hpa
    air.snow = air.precipitation * snow_share(air.celsius)
    air.rain = air.precipitation - air.snow
    air.sine, _ = sun(p, today.number, hour_angle(step, steps_per_day))
    return air


# --------------------------------------------------------------------------------------- 4. structure of the stand


def crown_factors(p, species):
    """Crown area of a stem of each year of age, relative to a mature one."""
    curve = species if p.crown_development else "conifer"
    values = [getattr(p, f"crown_{curve}_{name}") for name in CLASSES]
    return np.interp(np.arange(102), (0, *CLASS_AGES), (0.0, *values))


def crowns(p, s, species):
    """Crown area per ground area, and the share of it in trees beyond 100 years."""
    areas = 1e-4 * of(p, "crown_area", species, "_m2") * getattr(s, f"{species}_stems")
    areas = areas * crown_factors(p, species)
    return areas.sum(), (areas[101] / areas.sum() if areas.sum() > 0.0 else 0.0)


def leaf_out(p, day):
    """Share of the deciduous leaves that is out."""
    number = day + 1
    spring = 1.0 / (1.0 + math.exp(-p.growth_rate * (number - p.growth_start_day)))
    return spring / (1.0 + math.exp(p.fall_rate * (number - p.fall_start_day)))


def structure(p, s, day):
    """Crowns, cover, leaves and optical depths."""
    out = leaf_out(p, day)
    leaf = {"conifer": p.max_lai_conifer, "deciduous": out * p.max_lai_deciduous}
    wood = {"conifer": p.woody_area_index, "deciduous": p.woody_area_deciduous * p.woody_area_index}
    bare = {"conifer": wood["conifer"], "deciduous": p.leafless_share * p.max_lai_deciduous + wood["deciduous"]}
    stand = SimpleNamespace(
        share={}, covered={}, leaf_share={}, depth={}, snow_depth={}, lai={}, light_use={}, plant_area=0.0
    )
    area = {species: crowns(p, s, species) for species in SPECIES}
    stand.crowns = sum(crown for crown, _ in area.values())
    stand.cover = 1.0 - math.exp(-stand.crowns)
    for species in SPECIES:
        crown, old_share = area[species]
        plant = leaf[species] + bare[species]
        stand.share[species] = crown / stand.crowns if stand.crowns > 0.0 else 0.0
        stand.covered[species] = stand.share[species] * stand.cover
        lit = [1.0 - math.exp(-p.light_extinction * area * p.sky_path) for area in (leaf[species], plant)]
        stand.leaf_share[species] = lit[0] / max(lit[1], 1e-12)
        stand.depth[species] = p.light_extinction * plant
        stand.lai[species] = leaf[species] * stand.covered[species]
        stand.light_use[species] = of(p, "light_use", species) * (1.0 - old_share * (1.0 - p.light_use_old))
        catching = plant - max(wood[species] - p.woody_area_index, 0.0)
        stand.snow_depth[species] = p.light_extinction * catching
        stand.plant_area += catching * stand.covered[species]
    return stand


def prepare_day(p, s, day, weather, steps_per_day):
    """What holds for the day: weather, its mean light [W m-2] and deficit [kPa], structure, density of the air, and
    the snow that lies in the morning."""
    rows = weather.rows
    if rows is None:
        suns = [sun(p, day, hour_angle(step, steps_per_day)) for step in range(steps_per_day)]
        shortwave = weather.clearness * np.mean([sine * extraterrestrial for sine, extraterrestrial in suns])
        swings = weather.amplitude * np.cos([math.pi / 4.0, 3.0 * math.pi / 4.0])
        deficits = [saturation_pressure(weather.mean + swing) - weather.vapour for swing in swings]
    else:
        shortwave = rows[:, 3].mean()
        deficits = [
            saturation_pressure(celsius) - humidity * saturation_pressure_water(celsius)
            for celsius, humidity in rows[:, :2]
        ]
    return SimpleNamespace(
        number=day,
        weather=weather,
        shortwave=shortwave,
        deficit_kpa=0.1 * np.mean([max(deficit, 0.0) for deficit in deficits]),
        stand=structure(p, s, day),
        air_density=air_density(p, weather.mean),
        snow=s.swe,
        snow_density=s.snow_density,
    )


def acclimated(p, before, weather):
    """Acclimated temperature of the day, from that of the day before [degC]."""
    return before + (weather.mean - before) / p.acclimation_days


# --------------------------------------------------------------------------------------------------- 5. radiation


def canopy_interception(stand, species, path):
    """Share of the light that a species intercepts on a path."""
    gaps = 1.0 - math.exp(-stand.crowns * path)
    return stand.share[species] * gaps * (1.0 - math.exp(-stand.depth[species] * path))


def path_length(p, sine):
    """Of the beam through the canopy; the longest at night."""
    return min(p.slant_path_max, max(1.0, p.slant_path / sine)) if sine > 0.0 else p.slant_path_max


def surface_albedo(p, s, density):
    """Of the ground under its snow."""
    return p.ground_albedo + (s.albedo - p.ground_albedo) * min(s.swe / density / p.snow_cover_depth_m, 1.0)


def shortwave(p, air, diffuse, stand, ground_albedo):
    """Intercepted by species, absorbed by canopy and ground, reflected [W m-2]; the canopy's cover for sky light."""
    path = path_length(p, air.sine)
    sky = {species: canopy_interception(stand, species, p.sky_path) for species in SPECIES}
    beam = {species: canopy_interception(stand, species, path) for species in SPECIES}
    intercepted = {
        species: air.shortwave * ((1.0 - diffuse) * beam[species] + diffuse * sky[species]) for species in SPECIES
    }
    cover = sum(sky.values())
    albedo_below = sum(of(p, "albedo", species) * sky[species] for species in SPECIES)
    below = (air.shortwave - sum(intercepted.values())) / (1.0 - ground_albedo * albedo_below)
    ground = (1.0 - ground_albedo) * below
    canopy = sum((1.0 - of(p, "albedo", species)) * intercepted[species] for species in SPECIES)
    canopy += ground_albedo * below * (cover - albedo_below)
    return SimpleNamespace(
        sky=sky,
        cover=cover,
        intercepted=intercepted,
        canopy=canopy,
        ground=ground,
        reflected=air.shortwave - ground - canopy,
    )


def black_body(celsius):
    """W m-2."""
    return STEFAN_BOLTZMANN * (celsius + FREEZING_K) ** 4


def longwave_down(sky, cover, canopy):
    """Longwave below a canopy of this temperature [W m-2]."""
    return (1.0 - cover) * sky + cover * black_body(canopy)


def canopy_net_radiation(absorbed, sky, up, cover, canopy):
    """R_c [W m-2]."""
    return absorbed + cover * (sky + up - 2.0 * black_body(canopy))


# -------------------------------------------------------------------------- 6. turbulent exchange and evaporation


def canopy_exchange(p, air, today, cover):
    """h_c [W m-2 K-1]."""
    log = math.log(p.canopy_reference_height_m / p.canopy_roughness_m + 1.0)
    velocity = VON_KARMAN**2 * air.wind / (log * (log + p.excess_resistance))
    return max(today.air_density * AIR_HEAT * velocity, p.minimum_conductance) * max(cover, 1e-3)


def ground_roughness(p, s, today):
    """m."""
    snow = today.snow if today.weather.rows is None else s.swe
    return min(p.snow_roughness_m, p.soil_roughness_m) if snow > 1.0 else p.soil_roughness_m


def wind_below_canopy(p, air, today):
    """m s-1, were it at the height of the wind."""
    return air.wind * (1.0 - p.wind_reduction * today.stand.cover)


def floor_wind(p, s, air, today):
    """m s-1, near the ground."""
    roughness = ground_roughness(p, s, today)
    share = math.log(p.ground_reference_height_m / roughness) / math.log(p.canopy_reference_height_m / roughness)
    return wind_below_canopy(p, air, today) * share


def ground_exchange(p, s, air, today, ground):
    """h_g before its floor [W m-2 K-1]. `ground` : temperature with the fresh snow mixed in."""
    roughness = ground_roughness(p, s, today)
    aloft, height = p.canopy_reference_height_m, p.ground_reference_height_m
    wind, low_wind = wind_below_canopy(p, air, today), floor_wind(p, s, air, today)
    richardson = GRAVITY * height * (air.celsius - ground) / ((air.celsius + FREEZING_K) * max(low_wind**2, 1e-6))
    if richardson > 0.0:
        stability = 1.0 / (1.0 + p.stability_factor * richardson)
    else:
        stability = min(math.sqrt(1.0 - p.stability_factor * richardson), p.instability_limit)
    logs = math.log(aloft / roughness) * math.log(height / (p.thermal_roughness_ratio * roughness))
    return today.air_density * AIR_HEAT * wind * VON_KARMAN**2 / logs * stability


def water_stress(p, s, seconds):
    """f_w."""
    return min(1.0, s.soil_water / (p.water_stress_threshold * p.max_water_content_mm + 4e-4 * seconds))


def openness(p, s, today, species, seconds):
    """f_E: dry air or dry soil, whichever limits more."""
    dry_air = math.exp(-of(p, "dry_air", species) * today.deficit_kpa)
    return min(dry_air, water_stress(p, s, seconds))


def readiness(p, s, species):
    """f_S."""
    start, span = of(p, "acclimation_start", species, "_c"), of(p, "acclimation_span", species, "_k")
    return ramp(s.acclimation, start, start + span)


def co2_response(p, gain):
    """Of photosynthesis or transpiration."""
    return max(1.0 + gain * (math.log(p.co2_ppm) - math.log(380.0)), 0.0)


def equilibrium(air):
    """Lambda of Priestley and Taylor."""
    return air.slope / (air.slope + air.gamma)


def evaporation_coefficients(p, s, air, today, rays, wet, seconds):
    """Shares of the canopy's available energy that leaves transpire and that dry the rain, if it lasts."""
    dry = 0.0
    if air.celsius > 0.0 and air.shortwave > 0.0 and rays.cover > 0.0:
        leaves = sum(
            of(p, "priestley_taylor", species)
            * today.stand.leaf_share[species]
            * rays.sky[species]
            / rays.cover
            * openness(p, s, today, species, seconds)
            * readiness(p, s, species)
            for species in SPECIES
        )
        dry = (1.0 - wet) * equilibrium(air) * co2_response(p, p.co2_transpiration) * leaves
    wetted = wet * equilibrium(air) * p.priestley_taylor_wet
    both = max(dry + wetted, 1.0)
    return dry / both, wetted / both


def water_left_by_leaves(p, s, seconds):
    """Water of the bucket that the floor can have [mm]."""
    dry = p.water_stress_threshold * p.max_water_content_mm
    return s.soil_water * dry / (dry + 4e-4 * seconds)


def floor_conductance(p, air, today, exchange, wetness, water, ground, seconds):
    """For vapour, of the thawed moss floor [mm s-1 hPa-1], at most such that its water lasts the step."""
    if ground <= 0.0 or wetness**2 <= 0.0:
        return 0.0
    resistance = today.air_density * AIR_HEAT / exchange + p.moss_resistance / wetness**2
    conductance = today.air_density * VAPOUR_RATIO / p.air_pressure_hpa / resistance
    drying = abs(saturation_pressure(ground) - air.vapour) + 30.0 * saturation_slope(ground)
    return min(conductance, water / (seconds * max(drying, 1e-3)))


def snow_conductance(p, air, exchange, snow, seconds):
    """Of the snow's surface [mm s-1 hPa-1], at most such that snow at 0 degC lasts the step."""
    conductance = VAPOUR_RATIO / p.air_pressure_hpa * exchange / AIR_HEAT
    return min(conductance, snow / (seconds * max(abs(6.1121 - air.vapour), 1e-3)))


# ----------------------------------------------------------------- 8. snow and rain in the canopy, snow on the ground


def intercepted(fall, store, capacity, efficiency):
    """Rain or snow that the canopy catches [mm]."""
    if store >= capacity:
        return 0.0
    return min(efficiency * fall * (1.0 - store / capacity), capacity - store)


def snow_efficiency(p, stand):
    """c."""
    return p.interception * sum(
        stand.covered[species] * (1.0 - math.exp(-p.snow_extinction_factor * stand.snow_depth[species]))
        for species in SPECIES
    )


def snow_capacity(p, stand, celsius):
    """mm."""
    warm, cold = p.snow_capacity_warm_mm, p.snow_capacity_cold_mm
    return stand.plant_area * (warm + (cold - warm) * ramp(celsius, -1.0, -10.0))


def snow_sublimation(p, air, store, capacity, net_radiation, exchange, seconds):
    """Of canopy snow [mm]."""
    if capacity <= 0.0:
        return 0.0
    over_ice = air.gamma * VAPORISATION / SUBLIMATION
    rate = (air.slope * max(net_radiation, 0.0) + exchange * max(air.deficit, 0.0)) / (air.slope + over_ice)
    covered = min(store / capacity, 1.0) ** (2.0 / 3.0)
    return min(p.sublimation_exposure * covered * rate / SUBLIMATION * seconds, store)


def snow_melt(air, store, capacity, exchange, seconds):
    """Of canopy snow [mm]."""
    load = max(min(store / capacity, 1.0), 0.05) if capacity > 0.0 else 1.0
    return min(exchange * max(air.celsius, 0.0) * load / FUSION * seconds, store)


def unloaded(p, store, capacity, melted, seconds):
    """Canopy snow that falls to the ground [mm]."""
    falls = store * seconds / (3600.0 * p.snow_unloading_hours) + p.snow_unloading_melt * melted
    return min(max(falls, store - capacity), store)


def canopy_snow(p, s, air, today, rays, exchange, seconds):
    """Snow in the canopy after the step, and what left it [mm]."""
    capacity = snow_capacity(p, today.stand, air.celsius)
    caught = intercepted(air.snow, s.canopy_snow, capacity, snow_efficiency(p, today.stand))
    net = canopy_net_radiation(rays.canopy, air.longwave, black_body(s.ground), rays.cover, air.celsius)
    store = s.canopy_snow + caught
    sublimated = snow_sublimation(p, air, store, capacity, net, exchange, seconds)
    store -= sublimated
    melted = snow_melt(air, store, capacity, exchange, seconds)
    store -= melted
    fallen = unloaded(p, store, capacity, melted, seconds)
    return SimpleNamespace(
        store=store - fallen, sublimated=sublimated, melted=melted, to_ground=air.snow - caught + fallen
    )


def canopy_rain(p, s, air, today, cover, melted):
    """Rain held [mm], the filled share of the store, and what reaches the soil [mm]."""
    capacity = p.rain_capacity_mm * today.stand.plant_area * p.interception
    store = s.canopy_rain + intercepted(air.rain, s.canopy_rain, capacity, cover) + melted
    held = min(store, capacity)
    return held, (held / capacity if capacity > 0.0 else 0.0), s.canopy_rain + air.rain + melted - held


def fresh_snow_density(p, air, wind):
    """kg m-3."""
    density = p.snow_density_fresh + p.snow_density_fresh_per_c * air.celsius
    return max(density + p.snow_density_fresh_by_wind * math.sqrt(wind), p.snow_density_least)


def snow_density(s, fallen, fresh):
    """Of the pack with the snow that fell on it [kg m-3]: mass over depth."""
    depth = s.swe / s.snow_density + fallen / fresh
    return (s.swe + fallen) / depth if depth > 0.0 else s.snow_density


def settled_density(p, s, day_mean, organic):
    """The pack's density [kg m-3] after a day, whose surface was so warm in the mean [degC]."""
    frost = max(-(day_mean + organic) / 2.0, 0.0)
    viscosity = p.snow_viscosity * math.exp(
        p.snow_viscosity_by_cold * frost + p.snow_viscosity_by_density * s.snow_density
    )
    too_dense = max(s.snow_density - p.snow_metamorphism_density, 0.0)
    metamorphism = p.snow_metamorphism * math.exp(
        -p.snow_metamorphism_by_cold * frost - p.snow_metamorphism_by_density * too_dense
    )
    gain = 86400.0 * (GRAVITY * s.swe / 2.0 / viscosity + metamorphism)
    return min(s.snow_density + gain * s.snow_density, p.snow_density_largest)


def snow_conductivity(density):
    """W m-1 K-1."""
    r = density / 1000.0
    return 0.023 + 0.234 * r if r < 0.156 else 0.138 - 1.01 * r + 3.233 * r**2


def snow_albedo(p, s, ground, snowfall, snow, seconds):
    """After the step; snow that is to come is fresh."""
    if snow <= 0.0:
        return p.snow_albedo_fresh
    melting = ground > -0.01
    hours = p.snow_albedo_melt_hours if melting else p.snow_albedo_cold_hours
    old = p.snow_albedo_old if melting else min(s.albedo, p.snow_albedo_cold)
    ageing, renewal = seconds / (3600.0 * hours), snowfall / p.snow_albedo_refresh_mm
    return (s.albedo + ageing * old + renewal * p.snow_albedo_fresh) / (1.0 + ageing + renewal)


# ------------------------------------------------------------------------------------------------- 10. ground heat


@dataclass(frozen=True)
class SoilNode:
    """A soil node: thickness [m], heat capacities [J m-2 K-1], heat of freezing [J m-2], its range [K]."""

    thickness: float
    thawed: float
    frozen: float
    latent: float
    freezing_range: float

    @property
    def freezing(self):
        """Heat capacity within the range of freezing."""
        return self.latent / self.freezing_range + self.frozen

    def temperature(self, heat):
        """degC at an enthalpy [J m-2]."""
        if heat >= 0.0:
            return heat / self.thawed
        all_frozen = -(self.latent + self.frozen * self.freezing_range)
        if heat > all_frozen:
            return heat / self.freezing
        return -self.freezing_range + (heat - all_frozen) / self.frozen

    def heat(self, celsius):
        """Enthalpy [J m-2] at a temperature."""
        if celsius >= 0.0:
            return self.thawed * celsius
        if celsius > -self.freezing_range:
            return self.freezing * celsius
        return -(self.latent + self.frozen * self.freezing_range) + self.frozen * (celsius + self.freezing_range)

    def heat_capacity(self, heat):
        """Slope of enthalpy over temperature."""
        if heat >= 0.0:
            return self.thawed
        return self.freezing if heat > -(self.latent + self.frozen * self.freezing_range) else self.frozen


def soil_nodes(p):
    """Surface and deep soil."""
    thawed = p.soil_heat_capacity_thawed
    frozen = p.soil_heat_capacity_frozen if p.soil_freezing else thawed
    latent = FUSION * WATER_DENSITY * p.soil_freezing_water if p.soil_freezing else 0.0
    thicknesses = (p.surface_soil_depth_m, p.boundary_depth_m - p.surface_soil_depth_m)
    freezing = (thicknesses[0], min(thicknesses[1], 2.0 * (p.deep_soil_node_m - p.surface_soil_depth_m)))
    return [
        SoilNode(z, thawed * z, frozen * z, latent * wet, p.soil_freezing_range_k)
        for z, wet in zip(thicknesses, freezing, strict=True)
    ]


def frozen_share(p, celsius):
    """Share of the water that is ice."""
    return ramp(celsius, 0.0, -p.soil_freezing_range_k)


def soil_conductivity(p, celsius):
    """W m-1 K-1."""
    ratio = p.soil_frozen_conductivity_ratio if p.soil_freezing else 1.0
    return p.soil_conductivity * (1.0 + (ratio - 1.0) * frozen_share(p, celsius))


def organic_thickness(p, s):
    """m, litter at the least."""
    return max(p.moss * s.organic_depth, 0.01)


def organic_node(p, s, water):
    """The organic layer with so much water [mm]."""
    z = organic_thickness(p, s)
    dry = z * p.organic_heat_capacity_dry
    thawed = dry + WATER_HEAT * water
    frozen = dry + ICE_HEAT * water if p.soil_freezing else thawed
    return SoilNode(z, thawed, frozen, FUSION * water if p.soil_freezing else 0.0, p.soil_freezing_range_k)


def organic_water_held(p, s):
    """Against drainage [mm], by moss and by humus."""
    half = WATER_DENSITY * organic_thickness(p, s) / 2.0
    return half * p.moss_water_held, half * p.humus_water_held


def organic_resistances(p, s, celsius):
    """Of the moss and of the humus below it [m2 K W-1]."""
    held = organic_water_held(p, s)
    half = organic_thickness(p, s) / 2.0
    for mine in held:
        filled = min(s.organic_water * mine / sum(held) / (WATER_DENSITY * p.organic_porosity * half), 1.0)
        frozen = p.organic_conductivity_saturated_frozen if p.soil_freezing else p.organic_conductivity_saturated
        ice = frozen_share(p, celsius)
        wet = p.organic_conductivity_saturated * (1.0 - ice) + frozen * ice
        yield half / (p.organic_conductivity_dry * (1.0 - filled) + wet * filled)


def ground_conductances(p, s, nodes, organic, surface, deep, snow, density):
    """g_go, g_o1, g_12, g_2b [W m-2 K-1]."""
    half = nodes[0].thickness / 2.0
    moss, humus = organic_resistances(p, s, organic)
    boundary = p.deep_boundary_temperature_k - FREEZING_K
    to_deep = (p.deep_soil_node_m - p.surface_soil_depth_m) / soil_conductivity(p, deep)
    snow_resistance = snow / density / snow_conductivity(density)
    return (
        1.0 / (snow_resistance + moss),
        1.0 / (humus + half / soil_conductivity(p, organic)),
        1.0 / (half / soil_conductivity(p, surface) + to_deep),
        soil_conductivity(p, 0.5 * (deep + boundary)) / (p.boundary_depth_m - p.deep_soil_node_m),
    )


# ----------------------------------------------------------------------------------------------- 7. energy balance


class EnergyBalance:
    """The six balances as functions of the temperatures [degC] at the end of the step.

    Its fields are what is known before: forcing, conductances, heat capacities, temperatures at the start.
    """

    def __init__(self, **known):
        self.__dict__.update(known)

    def ground_emission(self, ground):
        """W m-2, linear about the temperature at the start."""
        start = black_body(self.ground_start)
        return start + 4.0 * start / (self.ground_start + FREEZING_K) * (ground - self.ground_start)

    def longwave_up(self, canopy, ground):
        """W m-2, above the ground."""
        down = longwave_down(self.sky, self.cover, canopy)
        return self.emissivity * self.ground_emission(ground) + (1.0 - self.emissivity) * down

    def canopy(self, canopy, trunk, ground):
        """Net radiation, sensible heat, transpiration, evaporation of rain, what is left over [W m-2]."""
        up = self.longwave_up(canopy, ground)
        net = canopy_net_radiation(self.canopy_shortwave, self.sky, up, self.cover, canopy)
        sensible = self.h_canopy * (canopy - self.air)
        available = max(net - self.growth - self.canopy_snow, 0.0)
        dry, wet = self.dry * available, min(self.wet * available, self.wet_limit)
        rest = net - sensible - dry - wet - self.growth - self.canopy_snow - self.g_ct * (canopy - trunk)
        return net, sensible, dry, wet, rest

    def ground_vapour(self, ground):
        """Vapour that leaves snow or floor [mm s-1], linear in the temperature of the ice or of the moss."""
        warmest = 0.0 if self.snow > 0.0 else math.inf
        start = min(self.ground_start, warmest)
        pressure = saturation_pressure(start) + saturation_slope(start) * (min(ground, warmest) - start)
        return self.vapour_conductance * (pressure - self.vapour)

    def ground(self, canopy, ground):
        """Net radiation, sensible and latent heat [W m-2]."""
        net = self.ground_shortwave
        net += self.emissivity * (longwave_down(self.sky, self.cover, canopy) - self.ground_emission(ground))
        latent = (SUBLIMATION if self.snow > 0.0 else VAPORISATION) * self.ground_vapour(ground)
        return net, self.h_ground * (ground - self.air), latent

    def gains(self, canopy, trunk, ground, organic, surface, deep):
        """Heat gained by trunk, ground (what melts snow included), organic layer, surface and deep soil [W m-2]."""
        net, sensible, latent = self.ground(canopy, ground)
        down_trunk = self.g_tg * (trunk - ground)
        return (
            self.g_ct * (canopy - trunk) - self.h_trunk * (trunk - self.air) - down_trunk,
            net - sensible - latent + down_trunk - self.g_go * (ground - organic),
            self.g_go * (ground - organic) - self.g_o1 * (organic - surface),
            self.g_o1 * (organic - surface) - self.g_12 * (surface - deep),
            self.g_12 * (surface - deep) - self.g_2b * (deep - self.boundary),
        )

    def below(self, canopy):
        """Temperatures of trunk, ground, organic layer, surface and deep soil under a canopy of this temperature.

        The ground is below 0 degC, at 0 degC while snow melts, or above it once all that has not sublimated melted.
        """
        if self.snow > 0.0:
            cold = self._solve(canopy, -1.0, lambda ground: (ground, (self.skin + ICE_HEAT * self.snow) * ground))
            if cold[1] <= 0.0:
                return cold
            meltable = self.snow - self.seconds * self.ground_vapour(0.0)
            trunk, melt, *below = self._solve(canopy, 0.0, lambda melt: (0.0, FUSION * melt))
            if melt <= meltable:
                return trunk, 0.0, *below
        else:
            meltable = 0.0
        return self._solve(canopy, 0.0, lambda ground: (ground, self.skin * ground + FUSION * meltable))

    def _solve(self, canopy, guess, ground_of):
        """Dense solution of the five balances, linear in trunk, one unknown of the ground, and the nodes below it.

        ground_of : unknown -> temperature of the ground, and its heat [J m-2] with that of the snow it has melted.
        """

        def imbalance(trunk, unknown, organic, surface, deep):
            ground, heat = ground_of(unknown)
            stored = (
                self.trunk_capacity * (trunk - self.trunk_start),
                heat - self.ground_heat,
                self.organic_capacity * (organic - self.organic_start),
                self.surface_capacity * (surface - self.surface_start),
                self.deep_capacity * (deep - self.deep_start),
            )
            gains = self.gains(canopy, trunk, ground, organic, surface, deep)
            return [gain - heat / self.seconds for gain, heat in zip(gains, stored, strict=True)]

        start = np.array([self.trunk_start, guess, self.organic_start, self.surface_start, self.deep_start])
        values = np.array([imbalance(*point) for point in (start, *(start + np.eye(5)))])
        return start - np.linalg.solve((values[1:] - values[0]).T, values[0])

    def rest(self, canopy):
        """What the canopy has left over at this temperature [W m-2], all below it in balance; falls with it."""
        trunk, ground, *_ = self.below(canopy)
        return self.canopy(canopy, trunk, ground)[-1]

    def solve(self):
        """Temperatures of canopy, trunk, ground, organic layer and soil; the canopy's by false position (Illinois)."""
        low, high = self.air - 150.0, self.air + 150.0
        at_low, at_high = self.rest(low), self.rest(high)
        if at_low == at_high:  # no trees, no wind
            return self.air, *self.below(self.air)
        last = 0.0
        while low < (canopy := (low * at_high - high * at_low) / (at_high - at_low)) < high:
            rest = self.rest(canopy)
            if abs(rest) < 1e-11:
                break
            # The end that stays for a second time counts half, or the other would creep.
            if rest > 0.0:
                low, at_low, at_high = canopy, rest, at_high / 2.0 if last > 0.0 else at_high
            else:
                high, at_high, at_low = canopy, rest, at_low / 2.0 if last < 0.0 else at_low
            last = rest
        return canopy, *self.below(canopy)


# ----------------------------------------------------------------------------------------------------- 11. carbon


def photons(p, shortwave):
    """mol m-2 s-1 in shortwave [W m-2]."""
    return 4.57e-6 * p.par_fraction * shortwave


def light_use_of_day(p, s, today, species):
    """gC mol-1, before dry air or soil; s : state after the morning."""
    saturated = 1.0 + of(p, "light_saturation", species) * 86400.0 * photons(p, today.shortwave)
    return co2_response(p, p.co2_photosynthesis) * readiness(p, s, species) / saturated


def photosynthesis(p, s, today, rays, species, seconds):
    """GPP [kgC m-2 s-1]."""
    absorbed = photons(p, rays.intercepted[species]) * today.stand.leaf_share[species]
    efficiency = today.stand.light_use[species] * light_use_of_day(p, s, today, species)
    return 1e-3 * absorbed * efficiency * openness(p, s, today, species, seconds)


def understorey_photosynthesis(p, s, air, today, rays, seconds):
    """The same of the understorey, where it is out of the morning's snow."""
    depth = today.snow / today.snow_density
    area = p.understorey_lai * max(1.0 - depth / p.understorey_height_m, 0.0)
    below = max(air.shortwave - sum(rays.intercepted.values()), 0.0)
    absorbed = photons(p, below) * (1.0 - math.exp(-p.light_extinction * p.sky_path * area))
    efficiency = p.light_use_understorey * light_use_of_day(p, s, today, "conifer")
    return 1e-3 * absorbed * efficiency * openness(p, s, today, "conifer", seconds)


def q10_factor(p, celsius):
    """Warming's factor on respiration."""
    return p.q10 ** ((celsius - p.respiration_reference_c) / 10.0)


def autotrophic_respiration(p, air, lai, biomass, gpp, seconds):
    """kgC m-2 s-1, at most what the trees have."""
    leaves, wood = lai / p.reference_lai, biomass / p.reference_biomass_kgc_m2
    size = p.maintenance_leaf_share * leaves + (1.0 - p.maintenance_leaf_share) * wood
    maintenance = p.base_respiration / YEAR_S * size * q10_factor(p, air.celsius)
    return min(maintenance + p.growth_respiration * max(gpp - maintenance, 0.0), gpp + biomass / seconds)


def top_of_mineral_soil(p, conductivity, surface, into_soil):
    """Temperature [degC] at the end of the step. `into_soil` : heat flux [W m-2]."""
    return surface + p.surface_soil_depth_m / 2.0 / conductivity * into_soil


def heterotrophic_respiration(p, s, top):
    """kgC m-2 s-1, at the temperature of the top of the mineral soil."""
    return p.soil_respiration / YEAR_S * s.soil_carbon / p.reference_soil_carbon * q10_factor(p, top)


# ------------------------------------------------------------------------------------------------------ 12. stems


def relative_sizes(p, species):
    """Carbon of a stem of each year of age, relative to a very old one; a seedling's is that of one year."""
    years = np.maximum(np.arange(102), 1)
    height = (1.0 - np.exp(-of(p, "height_rate", species) * years)) ** of(p, "height_shape", species)
    return height**p.stem_carbon_exponent


def reineke_stems(p, s):
    """Stems of the reference size that the stand crowds like [ha-1]."""
    crowding = 0.0
    for species in SPECIES:
        stems, sizes = getattr(s, f"{species}_stems"), relative_sizes(p, species)
        if stems.sum() > 0.0:
            kgc = 1e4 * getattr(s, f"{species}_biomass") / (stems @ sizes) * sizes  # of a stem
            crowding += stems @ (kgc / p.reference_stem_kgc) ** p.crowding_exponent
    return crowding


def deaths_by_age(p, stems, sizes, number):
    """Stems of each age that die when so many do: in proportion to 1 / (c + size), found by bisection on the level."""
    chance = 1.0 / (p.suppressed_stem_size + sizes)
    low, high = 0.0, 1e3
    while high - low > 1e-13 * high:
        level = 0.5 * (low + high)
        low, high = (level, high) if stems @ np.minimum(level * chance, 1.0) < number else (low, level)
    return stems * np.minimum(high * chance, 1.0)


def renew_stems(p, s):
    """A year's end without insects, in a year of mean mortality: stems of both species, the carbon that died, and what
    share of each species' it was.

    The crowns of `s` are those that recruits come up under.
    """
    density = sum(getattr(s, f"{species}_stems").sum() for species in SPECIES)
    crowding = max(reineke_stems(p, s) / p.max_natural_density - p.density_mortality_threshold, 0.0)
    self_thinning = p.density_dependent_mortality * crowding / (1.0 - p.density_mortality_threshold)
    gaps = math.exp(-sum(crowns(p, s, species)[0] for species in SPECIES))
    recruits = p.recruitment_rate * p.recruits_per_stem * p.max_natural_density * gaps
    recruits = min(recruits, max(p.max_natural_density - density, 0.0))
    renewed, dead, shares = {}, 0.0, {}
    for species in SPECIES:
        stems, sizes = getattr(s, f"{species}_stems"), relative_sizes(p, species)
        hazard = p.natural_mortality * of(p, "mortality", species)
        hazard *= (p.suppressed_stem_size + p.reference_stem_size) / (p.suppressed_stem_size + sizes)
        number = min(stems @ np.minimum(hazard, 1.0) + self_thinning * stems.sum(), stems.sum())
        die = deaths_by_age(p, stems, sizes, number)
        shares[species] = die @ sizes / (stems @ sizes) if stems.sum() > 0.0 else 0.0
        dead += shares[species] * getattr(s, f"{species}_biomass")
        left = stems - die
        left[0] += recruits * (stems.sum() / density if density > 0.0 else 0.5)
        renewed[species] = np.array([0.0, *left[:100], left[100] + left[101]])
    return renewed, dead, shares


# ------------------------------------------------------------------------------------------------------- the step


def take_step(p, s, today, step, steps_per_day):
    """A step of the day `today` (`prepare_day`), from state `s`; steps are counted from 0.

    Returns the new state and the step's fluxes as dicts, with names and units of `sim.state.STATE`, and of
    `sim.state.RECORD` and `sim.state.DAILY`; temperatures among the fluxes are those that go into the means.
    """
    seconds = 86400.0 / steps_per_day
    stand = today.stand
    air = air_of_step(p, today, step, steps_per_day)
    rays = shortwave(p, air, today.weather.diffuse, stand, surface_albedo(p, s, today.snow_density))
    gpp = {species: photosynthesis(p, s, today, rays, species, seconds) for species in SPECIES}
    gpp_below = understorey_photosynthesis(p, s, air, today, rays, seconds)
    stored_below = 1000.0 * p.photosynthesis_energy * gpp_below

    h_canopy = canopy_exchange(p, air, today, rays.cover)
    aloft = canopy_snow(p, s, air, today, rays, h_canopy, seconds)
    rain_held, wet, to_soil = canopy_rain(p, s, air, today, rays.cover, aloft.melted)
    snow = s.swe + aloft.to_ground
    heat = (p.skin_heat_capacity + ICE_HEAT * s.swe) * s.ground + ICE_HEAT * aloft.to_ground * min(air.celsius, 0.0)
    ground_start = heat / (p.skin_heat_capacity + ICE_HEAT * snow)

    nodes = soil_nodes(p)
    surface_start, deep_start = nodes[0].temperature(s.surface_heat), nodes[1].temperature(s.deep_heat)
    h_ground = ground_exchange(p, s, air, today, ground_start)
    dry, wetted = evaporation_coefficients(p, s, air, today, rays, wet, seconds)
    organic_start = organic_node(p, s, s.organic_water).temperature(s.organic_heat)
    thawed_share = 1.0 - frozen_share(p, organic_start) * p.soil_freezing
    moss_water = s.organic_water * thawed_share
    soil_reach = water_left_by_leaves(p, s, seconds)
    g_go, g_o1, g_12, g_2b = ground_conductances(
        p, s, nodes, organic_start, surface_start, deep_start, snow, today.snow_density
    )
    if snow > 0.0:
        vapour_conductance = snow_conductance(p, air, h_ground, snow, seconds)
    else:
        wetness = min(moss_water / sum(organic_water_held(p, s)), 1.0)
        exchange = max(h_ground, p.minimum_conductance)
        floor_water = moss_water + soil_reach
        vapour_conductance = floor_conductance(p, air, today, exchange, wetness, floor_water, ground_start, seconds)
    balance = EnergyBalance(
        seconds=seconds,
        air=air.celsius,
        vapour=air.vapour,
        sky=air.longwave,
        cover=rays.cover,
        emissivity=p.ground_emissivity,
        canopy_shortwave=rays.canopy,
        ground_shortwave=rays.ground - stored_below,
        growth=1000.0 * p.photosynthesis_energy * sum(gpp.values()),
        canopy_snow=(FUSION * aloft.melted + SUBLIMATION * aloft.sublimated) / seconds,
        dry=dry,
        wet=wetted,
        wet_limit=VAPORISATION * rain_held / seconds,
        vapour_conductance=vapour_conductance,
        h_canopy=h_canopy,
        h_ground=max(h_ground, p.minimum_conductance),
        h_trunk=p.trunk_air_conductance * p.woody_area_index * stand.cover,
        g_ct=p.trunk_canopy_conductance * stand.cover,
        g_tg=p.trunk_ground_conductance * stand.cover,
        g_go=g_go,
        g_o1=g_o1,
        g_12=g_12,
        g_2b=g_2b,
        boundary=p.deep_boundary_temperature_k - FREEZING_K,
        snow=snow,
        skin=p.skin_heat_capacity,
        ground_heat=heat,
        ground_start=ground_start,
        trunk_capacity=s.trunk_capacity,
        trunk_start=s.trunk,
        organic_capacity=organic_node(p, s, s.organic_water).heat_capacity(s.organic_heat),
        organic_start=organic_start,
        surface_capacity=nodes[0].heat_capacity(s.surface_heat),
        surface_start=surface_start,
        deep_capacity=nodes[1].heat_capacity(s.deep_heat),
        deep_start=deep_start,
    )
    canopy, trunk, ground, organic, surface, deep = balance.solve()

    # Fluxes at these temperatures, and the stores that follow from them.
    canopy_net, canopy_sensible, transpiration, rain_latent, _ = balance.canopy(canopy, trunk, ground)
    ground_net, ground_sensible, ground_latent = balance.ground(canopy, ground)
    _, ground_gain, organic_gain, surface_gain, deep_gain = balance.gains(canopy, trunk, ground, organic, surface, deep)
    into_boundary = g_2b * (deep - balance.boundary)
    transpired, dried = seconds * transpiration / VAPORISATION, seconds * rain_latent / VAPORISATION
    vapour = seconds * balance.ground_vapour(ground) if snow > 0.0 else 0.0
    evaporated = 0.0 if snow > 0.0 else min(seconds * ground_latent / VAPORISATION, moss_water + soil_reach)
    sensible = canopy_sensible + balance.h_trunk * (trunk - air.celsius) + ground_sensible
    latent = transpiration + rain_latent + ground_latent + SUBLIMATION * aloft.sublimated / seconds

    not_evaporated = 0.0 if snow > 0.0 else ground_latent - VAPORISATION * evaporated / seconds
    heat += seconds * (ground_gain + not_evaporated) - ICE_HEAT * vapour * ground_start
    melted = min(max(heat, 0.0) / FUSION, snow - vapour)
    snow_left = snow - vapour - melted
    from_moss = evaporated * moss_water / (moss_water + soil_reach) if moss_water > 0.0 else 0.0
    organic_water = max(s.organic_water + to_soil + melted - from_moss, 0.0)
    layer = organic_node(p, s, s.organic_water)
    coldest, warmest = (layer.heat(pick(organic_start, surface, ground)) for pick in (min, max))
    organic_heat = min(max(s.organic_heat + seconds * organic_gain, coldest), warmest)
    passed = s.organic_heat + seconds * organic_gain - organic_heat
    organic_heat += WATER_HEAT * (to_soil * max(air.celsius, 0.0) - from_moss * max(organic_start, 0.0))
    organic_now = organic_node(p, s, organic_water).temperature(organic_heat)
    liquid = organic_water * (1.0 - frozen_share(p, organic_now) * p.soil_freezing)
    beyond = max(organic_water - sum(organic_water_held(p, s)), 0.0)
    drained = min(beyond, liquid)
    water = s.soil_water + drained - transpired - (evaporated - from_moss)
    runoff = max(water - p.max_water_content_mm, 0.0)
    biomass = {species: getattr(s, f"{species}_biomass") for species in SPECIES}
    respiration = {
        species: autotrophic_respiration(p, air, stand.lai[species], biomass[species], gpp[species], seconds)
        for species in SPECIES
    }
    top = top_of_mineral_soil(p, soil_conductivity(p, organic_start), surface, g_o1 * (organic - surface))
    decay = heterotrophic_respiration(p, s, top)

    state = {
        "conifer_biomass": s.conifer_biomass + seconds * (gpp["conifer"] - respiration["conifer"]),
        "deciduous_biomass": s.deciduous_biomass + seconds * (gpp["deciduous"] - respiration["deciduous"]),
        "soil_carbon": s.soil_carbon + seconds * (p.understorey_carbon_use * gpp_below - decay),
        "products": s.products,
        "organic_depth": s.organic_depth,
        "canopy": canopy,
        "trunk": trunk,
        "trunk_capacity": s.trunk_capacity,
        "ground": (heat - FUSION * melted) / (p.skin_heat_capacity + ICE_HEAT * snow_left),
        "organic_heat": organic_heat - WATER_HEAT * drained * max(organic_now, 0.0),
        "organic_water": organic_water - drained,
        "surface_heat": s.surface_heat + seconds * surface_gain + passed,
        "deep_heat": s.deep_heat + seconds * deep_gain,
        "swe": snow_left,
        "snow_density": snow_density(s, aloft.to_ground, fresh_snow_density(p, air, floor_wind(p, s, air, today))),
        "albedo": snow_albedo(p, s, ground_start, aloft.to_ground, snow, seconds),
        "canopy_rain": rain_held - dried,
        "canopy_snow": aloft.store,
        "soil_water": water - runoff,
        "drought": s.drought,
        "acclimation": s.acclimation,
    }
    megajoules = 1e-6 * seconds
    fluxes = {
        "gpp_kgc_m2": seconds * (sum(gpp.values()) + gpp_below),
        "autotrophic_respiration_kgc_m2": seconds
        * (sum(respiration.values()) + (1.0 - p.understorey_carbon_use) * gpp_below),
        "understorey_gpp_kgc_m2": seconds * gpp_below,
        "understorey_litter_kgc_m2": seconds * p.understorey_carbon_use * gpp_below,
        "heterotrophic_respiration_kgc_m2": seconds * decay,
        "precipitation_mm": air.precipitation,
        "snowfall_mm": air.snow,
        "evapotranspiration_mm": transpired + dried + evaporated + vapour + aloft.sublimated,
        "transpiration_mm": transpired,
        "floor_evaporation_mm": evaporated,
        "runoff_mm": runoff,
        "sublimation_mm": vapour + aloft.sublimated,
        "canopy_sublimation_mm": aloft.sublimated,
        "shortwave_mj_m2": megajoules * air.shortwave,
        "net_radiation_mj_m2": megajoules * (canopy_net + ground_net + stored_below),
        "sensible_heat_mj_m2": megajoules * sensible,
        "latent_heat_mj_m2": megajoules * latent,
        "ground_heat_mj_m2": megajoules * g_go * (ground - organic),
        "ground_shortwave_mj_m2": megajoules * (rays.ground - stored_below),
        "boundary_warming_mj_m2": megajoules * max(into_boundary, 0.0),
        "boundary_cooling_mj_m2": megajoules * max(-into_boundary, 0.0),
        "deep_heat_gain_mj_m2": megajoules * deep_gain,
        "boundary_heat_mj_m2": megajoules * into_boundary,
        "albedo": rays.reflected / air.shortwave if air.shortwave > 0.0 else math.nan,
        "lai": sum(stand.lai.values()),
        "air_temperature_c": air.celsius,
        "canopy_temperature_c": canopy,
        "ground_temperature_c": state["ground"],
        "soil_top_temperature_c": top,
        "organic_temperature_c": organic_start,
        "organic_water_mm": state["organic_water"],
        "snow_depth_m": state["swe"] / state["snow_density"],
        "surface_soil_temperature_c": surface_start,
        "deep_soil_temperature_c": deep_start,
    }
    return state, fluxes
