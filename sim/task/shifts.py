"""Sites outside the range that is sampled: how far a policy generalises, by one property or two at a time."""

from sim.spin_up import BOUNDARY

#: Shift -> range of site parameters, beside the sampled one (`sim/site_parameters.csv`); all else is the site's own.
SHIFTS = {
    "warmer_boundary": {BOUNDARY: (272.0, 274.0)},
    "warmer_air": {"mean_annual_temperature_c": (-5.0, -3.0)},
    "further_north": {"latitude_deg": (65.0, 69.0), "mean_annual_temperature_c": (-12.0, -10.0)},
    "calmer": {"wind_speed_m_s": (0.4, 1.0)},
    "less_snow": {"winter_snow_prob": (0.05, 0.15), "winter_snow_mm_day": (1.0, 3.0)},
}


def shifts_of(boundary: str = "sampled") -> tuple[str, ...]:
    """Shifts of a world: a boundary in balance is found, not given, so warmer air takes its place there."""
    left_out = "warmer_boundary" if boundary == "balanced" else "warmer_air"
    return tuple(name for name in SHIFTS if name != left_out)
