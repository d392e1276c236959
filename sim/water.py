"""Soil water: one bucket. Amounts in mm."""

from sim.jit import compiled

LARGEST_EVAPORATION = 4e-4  # mm s-1, the latent heat of 1000 W m-2


@compiled
def water_stress(water, capacity, threshold, seconds) -> float:
    """Share of unstressed evaporation and photosynthesis: 1 above `threshold` of capacity, 0 in dry soil.

    The ramp is longer by what one step can evaporate at the most, so that no step takes more than there is.
    """
    return min(water / (threshold * capacity + LARGEST_EVAPORATION * seconds), 1.0)


@compiled
def left_by_leaves(water, capacity, threshold, seconds) -> float:
    """Water [mm] that leaves cannot take within the step, by `water_stress`."""
    return water * (threshold * capacity) / (threshold * capacity + LARGEST_EVAPORATION * seconds)


@compiled
def runoff(water, capacity) -> float:
    """Water beyond capacity [mm]."""
    return max(water - capacity, 0.0)


@compiled
def drought_stress(b, i, seconds):
    """Stress by dry soil of the step."""
    s, p = b.s, b.p
    b.w.water_stress[i] = water_stress(s.soil_water[i], p.max_water_content_mm[i], p.water_stress_threshold[i], seconds)
