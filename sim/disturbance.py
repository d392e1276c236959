"""Fire and insects: their hazards, and what they do to a stand. Their dice are drawn before the year begins."""

from sim.deadwood import burn_deadwood, lay_down
from sim.demography import count_stand, fell, kill
from sim.jit import compiled, phase
from sim.mathematics import between
from sim.structure import crown_areas
from sim.weather import drought_index


@compiled
def fire_hazard(base, conifer, deciduous, flammability_conifer, flammability_deciduous, flammability_open) -> float:
    """Probability of fire on a summer day that is dry and warm enough, by the cover of each species; between the
    crowns the ground vegetation burns."""
    open_ground = 1.0 - conifer - deciduous
    return base * (
        conifer * flammability_conifer + deciduous * flammability_deciduous + open_ground * flammability_open
    )


@compiled
def ground_fuel(depth, equilibrium) -> float:
    """Share of the ground layer's fuel that is there: moss and litter grow back after a fire, up to that of open
    ground. depth, equilibrium : of the organic layer [m]."""
    return min(depth / equilibrium, 1.0) if equilibrium > 0.0 else 0.0


@compiled
def fire_weather(drought, temperature, threshold, temperature_threshold) -> bool:
    """Whether a day is dry and warm enough for fire."""
    return drought > threshold and temperature > temperature_threshold


@compiled
def outbreak_probability(base, winter_temperature, density, lethal, mild, reference_density) -> float:
    """Yearly probability of an insect outbreak: grows with a mild winter (overwintering) and with density."""
    survival = min(max((winter_temperature - lethal) / (mild - lethal), 0.0), 1.0)
    return base * survival * min(density / reference_density, 1.0)


@phase
def fire(b, day):
    """Drought index of the day, and a fire if dice, drought and warmth agree; at most one a year."""
    for i in range(len(b.s.swe)):
        dry(b, i)
        if ignites(b, day, i):
            burn(b, i)


@compiled
def dry(b, i):
    """Drought index of the day."""
    s, p, w, r = b.s, b.p, b.w, b.r
    s.drought[i] = drought_index(
        s.drought[i], w.mean_temperature[i], w.precipitation[i], s.swe[i], p.drought_evaporation[i]
    )
    r.drought_index[i] = max(r.drought_index[i], s.drought[i])


@compiled
def ignites(b, day, i) -> bool:
    """Whether a fire starts in a lane's stand, which has not burned this year."""
    s, p, w, r, d = b.s, b.p, b.w, b.r, b.d
    hazard = fire_hazard(
        p.fire_base_probability[i],
        w.cover_conifer[i],
        w.cover_deciduous[i],
        p.flammability_conifer[i],
        p.flammability_deciduous[i],
        p.flammability_open[i] * ground_fuel(s.organic_depth[i], p.organic_depth_open_m[i]),
    )
    summer = p.summer_start_day[i] <= day + 1 < p.summer_end_day[i]
    ready = fire_weather(s.drought[i], w.mean_temperature[i], p.fire_drought_threshold[i], p.fire_temperature_c[i])
    return summer and ready and p.fire[i] > 0.0 and r.fire_mortality[i] == 0.0 and d.fire_dice[day, i] < hazard


@phase
def burn(b, i):
    """A fire: trees, dead wood and organic layer burn in part; what is left of the trees is laid down."""
    s, p, w, r, d = b.s, b.p, b.w, b.r, b.d
    killed = between(p.fire_kill_low[i], p.fire_kill_high[i], d.fire_kill[i])
    conifers, deciduous = count_stand(b, i)
    w.stems_gain[i] -= killed * (conifers + deciduous)
    conifer, deciduous = fell(b, i, killed, killed)
    burned_conifer = p.fire_combusted_conifer[i] * conifer
    burned_deciduous = p.fire_combusted_deciduous[i] * deciduous
    burned = burned_conifer + burned_deciduous
    wood = burn_deadwood(b, i)
    share = between(p.fire_organic_low[i], p.fire_organic_high[i], d.fire_depth[i])
    depth = share * s.organic_depth[i]
    soil = min(depth * p.organic_carbon_density[i], share * s.soil_carbon[i])
    s.organic_depth[i] -= depth
    s.soil_carbon[i] -= soil
    lay_down(b, i, conifer, deciduous, burned_conifer, burned_deciduous)
    r.fire_mortality[i] = killed
    r.fire_mortality_kgc_m2[i] += conifer + deciduous - burned
    r.burned_trees_kgc_m2[i] += burned
    r.burned_soil_kgc_m2[i] += soil
    r.fire_loss_kgc_m2[i] += burned + wood + soil
    crown_areas(b, i)


@phase
def insects(b, i):
    """An outbreak, if dice, the calendar year's winter months and density agree; the dead are laid down."""
    p, w, r, d = b.p, b.w, b.r, b.d
    conifers, deciduous = count_stand(b, i)
    density = conifers + deciduous
    winter = w.winter_air[i] / w.winter_days[i] if w.winter_days[i] > 0.0 else 0.0
    probability = outbreak_probability(
        p.insect_base_probability[i], winter, density, p.insect_lethal_c[i], p.insect_mild_c[i], p.insect_density[i]
    )
    if not (p.insects[i] > 0.0 and d.insect_dice[i] < probability):
        return
    killed = kill(b, i, p.insect_mortality_rate[i], p.insect_deciduous[i] * p.insect_mortality_rate[i])
    r.insect_mortality[i] = killed / density if density > 0.0 else 0.0
