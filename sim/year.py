"""A year of a block of stands, in the order of the paper's Annual Simulation Timeline.

A pure function of parameters, state, action and the year's random draws, all in the block `b` (see `sim.state`).
"""

import math

import numpy as np

from sim.account import clear_year, write_record
from sim.canopy import aerodynamic_conductance
from sim.carbon import SECONDS_PER_YEAR, maintenance_rates
from sim.day import begin_day, end_day
from sim.demography import OLDEST, count, grow_older, kill, recruits, self_thinning
from sim.disturbance import between, disturb
from sim.jit import phase
from sim.management import conifers_to_cut, cut_oldest, feasible_change
from sim.snow import LATENT_HEAT_FUSION, ground_profile
from sim.soil import organic_layer
from sim.step import simulate_step, step_weather
from sim.structure import crown_areas
from sim.weather import DAYS_PER_YEAR

WATER_DENSITY = 1000.0  # kg m-3
LEAST_TRUNK_CAPACITY = 2000.0  # J m-2 K-1


@phase
def simulate_year(block, steps_per_day, days, observed, daily):
    """Advance a block of stands by a year, in place.

    block : array of one record `b` of `block_dtype(lanes)`, with parameters, state, the year's draws and action
    (`w.density_change` [stems ha-1] and `w.mix`) filled in; on return its state is the new state and `b.r` the annual
    record. (In an array, because numba takes a bare record's address from a description of all its fields, 0.07 ms.)
    steps_per_day : time steps a day; days : 365, or fewer for a partial forcing.
    observed : observed forcing, shape (days x steps_per_day, 6, lanes) with the columns of `sim.state.FORCING`, or
    shape (0, 6, lanes) for the weather generator.
    daily : output, shape (days, columns, lanes) as in `sim.state.DAILY`, or (0, columns, lanes) for none.
    """
    b = block[0]
    begin_year(b)
    seconds = 86400.0 / steps_per_day
    hours = hour_angles(steps_per_day)
    for day in range(days):
        today = observed[day * steps_per_day : (day + 1) * steps_per_day]
        begin_day(b, day, today)
        for t in range(steps_per_day):
            step_weather(b, t, hours, seconds, today)
            simulate_step(b, seconds)
        end_day(b, day, steps_per_day, daily)
    end_year(b)


@phase
def hour_angles(steps_per_day):
    """Cosine and sine of the hour angle at the middle of each step of a day, shape (steps, 2)."""
    hours = np.empty((steps_per_day, 2))
    for t in range(steps_per_day):
        angle = 2.0 * math.pi * ((t + 0.5) / steps_per_day - 0.5)
        hours[t, 0], hours[t, 1] = math.cos(angle), math.sin(angle)
    return hours


@phase
def begin_year(b):
    """1 and 2 of the timeline: the action, and what follows from the stand's structure."""
    for i in range(len(b.s.swe)):
        clear_year(b, i)
        manage(b, i)
        site_constants(b, i)
        crown_areas(b, i)
        grow_trunk(b, i)


@phase
def manage(b, i):
    """Plant or thin: seedlings of the wanted mix; or the oldest stems, so that the stand nears the mix."""
    s, p, w, r = b.s, b.p, b.w, b.r
    first_age = int(w.first_cut_age[i])
    conifers = count(s.conifer_stems, i, 0, OLDEST)
    deciduous = count(s.deciduous_stems, i, 0, OLDEST)
    harvestable_conifers = count(s.conifer_stems, i, first_age, OLDEST)
    harvestable_deciduous = count(s.deciduous_stems, i, first_age, OLDEST)
    r.harvestable_stems_ha[i] = harvestable_conifers + harvestable_deciduous
    change = feasible_change(w.density_change[i], conifers + deciduous, r.harvestable_stems_ha[i])
    if change > 0.0:
        s.conifer_stems[0, i] += change * w.mix[i]
        s.deciduous_stems[0, i] += change * (1.0 - w.mix[i])
        r.planted_stems_ha[i] = change
    elif change < 0.0:
        cut = -change
        cut_conifers = conifers_to_cut(cut, w.mix[i], conifers, deciduous, harvestable_conifers, harvestable_deciduous)
        young, mature = int(p.young_age_limit[i]), int(p.mature_age_limit[i])
        share_conifer = cut_oldest(
            s.conifer_stems,
            i,
            cut_conifers,
            first_age,
            young,
            mature,
            p.height_rate_conifer[i],
            p.height_shape_conifer[i],
            p.stem_carbon_exponent[i],
        )
        share_deciduous = cut_oldest(
            s.deciduous_stems,
            i,
            cut - cut_conifers,
            first_age,
            young,
            mature,
            p.height_rate_deciduous[i],
            p.height_shape_deciduous[i],
            p.stem_carbon_exponent[i],
        )
        harvest = share_conifer * s.conifer_biomass[i] + share_deciduous * s.deciduous_biomass[i]
        s.conifer_biomass[i] -= share_conifer * s.conifer_biomass[i]
        s.deciduous_biomass[i] -= share_deciduous * s.deciduous_biomass[i]
        stored = p.harvest_stored_share[i] * harvest
        s.products[i] += stored
        r.thinned_stems_ha[i] = cut
        r.harvest_kgc_m2[i] = harvest
        r.hwp_stored_kgc_m2[i] = stored
        r.harvest_emission_kgc_m2[i] = harvest - stored
    w.stems_gain[i] += change
    conifers = count(s.conifer_stems, i, 0, OLDEST)
    density = conifers + count(s.deciduous_stems, i, 0, OLDEST)
    r.density_after_action[i] = density
    r.conifer_fraction_after_action[i] = conifers / density if density > 0.0 else 0.0
    if density <= 0.0:
        # Without stems nothing lives: what biomass there was is litter.
        dead = s.conifer_biomass[i] + s.deciduous_biomass[i]
        s.conifer_biomass[i] = 0.0
        s.deciduous_biomass[i] = 0.0
        s.soil_carbon[i] += dead
        r.mortality_kgc_m2[i] += dead


@phase
def site_constants(b, i):
    """What the parameters fix for the year: angles, wind profiles, the soil nodes, slopes and rates."""
    p, w = b.p, b.w
    latitude = math.radians(p.latitude_deg[i])
    w.cos_latitude[i], w.sin_latitude[i] = math.cos(latitude), math.sin(latitude)
    warmest = 2.0 * math.pi * p.warmest_day[i] / DAYS_PER_YEAR
    w.cos_warmest[i], w.sin_warmest[i] = math.cos(warmest), math.sin(warmest)
    peak = 2.0 * math.pi * p.peak_diurnal_hour[i] / 24.0
    w.cos_peak[i], w.sin_peak[i] = math.cos(peak), math.sin(peak)
    aloft, height, ratio = p.canopy_reference_height_m[i], p.ground_reference_height_m[i], p.thermal_roughness_ratio[i]
    rough = p.soil_roughness_m[i]
    smooth = min(p.snow_roughness_m[i], rough)
    w.ground_log[i], w.ground_wind[i] = ground_profile(aloft, height, rough, ratio)
    w.snow_log[i], w.snow_wind[i] = ground_profile(aloft, height, smooth, ratio)
    w.canopy_log[i] = aerodynamic_conductance(
        1.0, p.canopy_roughness_m[i], p.canopy_reference_height_m[i], p.excess_resistance[i]
    )
    w.log_q10[i] = math.log(p.q10[i])
    w.leaf_rate[i], w.wood_rate[i] = maintenance_rates(
        p.base_respiration[i], p.maintenance_leaf_share[i], p.reference_lai[i], p.reference_biomass_kgc_m2[i]
    )
    w.soil_rate[i] = p.soil_respiration[i] / (p.reference_soil_carbon[i] * SECONDS_PER_YEAR)

    freezes = p.soil_freezing[i]
    surface = p.surface_soil_depth_m[i]
    deep = p.boundary_depth_m[i] - surface
    thawed = p.soil_heat_capacity_thawed[i]
    frozen = thawed + freezes * (p.soil_heat_capacity_frozen[i] - thawed)
    latent = freezes * LATENT_HEAT_FUSION * WATER_DENSITY * p.soil_freezing_water[i]
    w.surface_thawed[i], w.deep_thawed[i] = thawed * surface, thawed * deep
    w.surface_frozen[i], w.deep_frozen[i] = frozen * surface, frozen * deep
    w.surface_latent[i] = latent * surface
    # Far below its node the deep soil has nearly the boundary's temperature, and stays frozen or thawed.
    w.deep_latent[i] = latent * min(deep, 2.0 * (p.deep_soil_node_m[i] - surface))
    w.frozen_ratio[i] = 1.0 + freezes * (p.soil_frozen_conductivity_ratio[i] - 1.0)
    w.half_surface[i] = 0.5 * surface
    w.above_deep_node[i] = p.deep_soil_node_m[i] - surface
    w.per_below_deep_node[i] = 1.0 / (p.boundary_depth_m[i] - p.deep_soil_node_m[i])

    w.dryness_conifer[i] = 1.0 / (p.vpd_high_conifer_hpa[i] - p.vpd_low_hpa[i])
    w.dryness_deciduous[i] = 1.0 / (p.vpd_high_deciduous_hpa[i] - p.vpd_low_hpa[i])
    w.unloading_rate[i] = 1.0 / (3600.0 * p.snow_unloading_hours[i])


@phase
def grow_trunk(b, i):
    """Heat capacity of the trunks; wood that grew or went takes its heat along, a named flux."""
    s, p, r = b.s, b.p, b.r
    biomass = s.conifer_biomass[i] + s.deciduous_biomass[i]
    capacity = LEAST_TRUNK_CAPACITY + p.trunk_heat_per_carbon[i] * biomass
    r.growth_heat_mj_m2[i] = 1e-6 * (capacity - s.trunk_capacity[i]) * s.trunk[i]
    s.trunk_capacity[i] = capacity


@phase
def end_year(b):
    """4 of the timeline: insects, mortality, recruitment, ageing, the organic layer, products, the account."""
    for i in range(len(b.s.swe)):
        disturb(b, i)
        renew_stems(b, i)
        decay(b, i)
        write_record(b, i)


@phase
def renew_stems(b, i):
    """Background mortality and self-thinning, recruitment, ageing."""
    s, p, w, d = b.s, b.p, b.w, b.d
    conifers = count(s.conifer_stems, i, 0, OLDEST)
    density = conifers + count(s.deciduous_stems, i, 0, OLDEST)

    background = p.natural_mortality[i] * between(
        1.0 - p.mortality_spread[i], 1.0 + p.mortality_spread[i], d.mortality_dice[i]
    )
    crowding = self_thinning(
        density, p.max_natural_density[i], p.density_mortality_threshold[i], p.density_dependent_mortality[i]
    )
    conifers_die = min(background * p.mortality_conifer[i] + crowding, 1.0)
    deciduous_die = min(background * p.mortality_deciduous[i] + crowding, 1.0)
    kill(b, i, conifers_die, deciduous_die)

    new = recruits(density, p.max_natural_density[i], p.recruitment_rate[i])
    seed_source = conifers / density if density > 0.0 else 0.5
    s.conifer_stems[0, i] += new * seed_source
    s.deciduous_stems[0, i] += new * (1.0 - seed_source)
    w.stems_gain[i] += new
    grow_older(s.conifer_stems, i)
    grow_older(s.deciduous_stems, i)


@phase
def decay(b, i):
    """The organic layer moves toward its canopy's equilibrium; products decay if they have a half-life."""
    s, p, w, r = b.s, b.p, b.w, b.r
    s.organic_depth[i] = organic_layer(
        s.organic_depth[i],
        w.cover_conifer[i],
        w.cover_deciduous[i],
        p.organic_depth_conifer_m[i],
        p.organic_depth_deciduous_m[i],
        p.organic_depth_open_m[i],
        p.organic_growth_m_yr[i],
        p.organic_loss_years[i],
    )
    lost = s.products[i] * w.products_decay[i]
    s.products[i] -= lost
    r.hwp_decay_kgc_m2[i] = lost
