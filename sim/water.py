"""Soil water: one bucket. Amounts in mm."""
from sim.jit import compiled


@compiled
def water_stress(water, capacity, threshold) -> float:
    """Share of unstressed evaporation and photosynthesis: 1 above `threshold` of capacity, 0 in dry soil."""
    return min(water / (threshold * capacity), 1.0)


@compiled
def runoff(water, capacity) -> float:
    """Water beyond capacity [mm]."""
    return max(water - capacity, 0.0)
