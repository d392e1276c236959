"""Fire and insects: hazards and shares. Their dice are drawn before the year begins."""
from sim.jit import compiled


@compiled
def fire_hazard(base, conifer, deciduous, flammability_conifer, flammability_deciduous) -> float:
    """Probability of fire on a summer day that is dry and warm enough, by the cover of each species."""
    return base * (conifer * flammability_conifer + deciduous * flammability_deciduous)


@compiled
def fire_weather(drought, temperature, threshold, temperature_threshold) -> bool:
    """Whether a day is dry and warm enough for fire."""
    return drought > threshold and temperature > temperature_threshold


@compiled
def between(low, high, uniform) -> float:
    """Even draw between two values."""
    return low + (high - low) * uniform


@compiled
def outbreak_probability(base, winter_temperature, density, lethal, mild, reference_density) -> float:
    """Yearly probability of an insect outbreak: grows with a mild winter (overwintering) and with density."""
    survival = min(max((winter_temperature - lethal) / (mild - lethal), 0.0), 1.0)
    return base * survival * min(density / reference_density, 1.0)
