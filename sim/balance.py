"""Whether a step closes: the stores before and after it, against what crossed the stand's boundary."""

from sim.jit import compiled
from sim.physical_constants import LATENT_HEAT_FUSION
from sim.snow import ground_capacity


@compiled
def stored_energy(b, i) -> float:
    """Energy of trunks, ground and soil [J m-2]; ice has less of it than water, by its heat of fusion."""
    s = b.s
    return (
        s.trunk_capacity[i] * s.trunk[i]
        + ground_capacity(s.swe[i], b.p.skin_heat_capacity[i]) * s.ground[i]
        + s.organic_heat[i]
        + s.surface_heat[i]
        + s.deep_heat[i]
        - LATENT_HEAT_FUSION * (s.swe[i] + s.canopy_snow[i])
    )


@compiled
def stored_water(b, i) -> float:
    """Water of canopy, snow, organic layer and soil [mm]."""
    s = b.s
    return s.swe[i] + s.canopy_snow[i] + s.canopy_rain[i] + s.organic_water[i] + s.soil_water[i]


@compiled
def note_stores(b, i):
    """What is stored in a lane before the step."""
    b.w.energy_before[i] = stored_energy(b, i)
    b.w.water_before[i] = stored_water(b, i)


@compiled
def balance(b, seconds):
    """Whether the stores changed by what crossed the stand's boundary, energy and water."""
    w, r = b.w, b.r
    for i in range(len(b.s.swe)):
        energy_failure = abs(stored_energy(b, i) - w.energy_before[i] - w.energy_gain[i]) * (1.0 / seconds)
        water_failure = abs(stored_water(b, i) - w.water_before[i] - w.water_gain[i])
        r.energy_residual_w_m2[i] = max(r.energy_residual_w_m2[i], energy_failure)
        r.water_residual_mm[i] = max(r.water_residual_mm[i], water_failure)
