"""Canopy: structure through the year, and the energy balance that sets its temperature.

The canopy stores no heat; its temperature is where radiation, sensible heat, evaporation, photosynthesis, snow and
the trunk balance. The ground and the trunk answer to it within the same step (`sim.soil.respond_to_canopy`), so that
all nodes exchange radiation at the same temperatures.
"""

import math

from sim.jit import compiled
from sim.mathematics import exponential
from sim.radiation import black_body, black_body_slope, longwave_down, longwave_up
from sim.snow import VON_KARMAN
from sim.weather import FREEZING_POINT_K, STEFAN_BOLTZMANN

NEWTON_TOLERANCE = 1e-7  # W m-2
NEWTON_LIMIT = 60  # iterations; bisection alone would need 50


@compiled
def crown_factor(age, seedling, sapling, young, mature, old) -> float:
    """Crown area of a stem relative to a mature one, straight lines between the values at 3, 13, 30, 70, 101 years."""
    if age < 3:
        return seedling * age / 3.0
    if age < 13:
        return seedling + (sapling - seedling) * (age - 3.0) / 10.0
    if age < 30:
        return sapling + (young - sapling) * (age - 13.0) / 17.0
    if age < 70:
        return young + (mature - young) * (age - 30.0) / 40.0
    return mature + (old - mature) * (min(age, 101.0) - 70.0) / 31.0


@compiled
def leaf_out(day, start, spring_rate, fall, autumn_rate) -> float:
    """Share of the deciduous leaf area that is out: half on the start and the fall day, logistic in between."""
    spring = 1.0 / (1.0 + exponential(-spring_rate * (day + 1.0 - start)))
    autumn = 1.0 / (1.0 + exponential(autumn_rate * (day + 1.0 - fall)))
    return spring * autumn


@compiled
def aerodynamic_conductance(wind, roughness, height, excess) -> float:
    """Conductance for heat [m s-1] between canopy and air, neutral logarithmic profile (Garratt 1992, Eq. 3.38)."""
    momentum = math.log(height / roughness + 1.0)
    return VON_KARMAN * VON_KARMAN * wind / (momentum * (momentum + excess))


@compiled
def stress_ramp(value, zero, slope) -> float:
    """Linear ramp, 0 at `zero`, up to 1; MOD17's scalars of minimum temperature and vapour pressure deficit."""
    return min(max((value - zero) * slope, 0.0), 1.0)


@compiled
def canopy_balance(
    canopy,
    fixed,
    shortwave_absorbed,
    sky,
    cover,
    ground_emissivity,
    ground,
    melt_span,
    bare_gain,
    ground_base,
    ground_by_emission,
    ground_by_canopy,
    trunk_base,
    trunk_by_canopy,
    trunk_by_ground,
    trunk_conductance,
    air,
    air_conductance,
    dry_coefficient,
    wet_coefficient,
    wet_limit,
):
    """Energy balance of the canopy at a trial temperature.

    canopy : trial canopy temperature [degC]; fixed : energy used by photosynthesis, snow melt and sublimation
    [W m-2]; ground : temperature of the ground at the start of the step [degC], about which its emission is
    linear; melt_span : how much warmer [K] the ground would be if its snow, all of which it takes to melt, were not
    there (0 without snow); bare_gain : how much more the ground answers once it has melted (1 without snow);
    ground_*, trunk_* : how the two answer to the canopy.
    dry_coefficient, wet_coefficient : evaporation per net radiation that is not used otherwise; wet_limit : the
    intercepted rain, as a flux.
    Returns (residual [W m-2], its slope [W m-2 K-1], its slope by the canopy's emission alone, net radiation, ground
    temperature [degC]).
    """
    kelvin = canopy + FREEZING_POINT_K
    emission = black_body(kelvin)
    ground_kelvin = ground + FREEZING_POINT_K
    ground_slope = black_body_slope(ground_kelvin)

    # In all sums here what is known last is added last: a single stand waits for each addition.
    free_ground = ground_base + ground_by_canopy * canopy + ground_by_emission * emission
    # Below 0 degC, at 0 degC while snow melts, above it when the last snow has melted within the step.
    new_ground = min(free_ground, 0.0) + bare_gain * max(free_ground - melt_span, 0.0)
    gain = 1.0 if free_ground <= 0.0 else (bare_gain if free_ground >= melt_span else 0.0)
    trunk = trunk_base + trunk_by_canopy * canopy + trunk_by_ground * new_ground

    up = longwave_up(
        black_body(ground_kelvin) + ground_slope * (new_ground - ground),
        longwave_down(sky, emission, cover),
        ground_emissivity,
    )
    net = shortwave_absorbed + cover * (sky - 2.0 * emission + up)

    available = max(net - fixed, 0.0)
    wet = wet_coefficient * available
    used = dry_coefficient if net > fixed else 0.0
    used += wet_coefficient if net > fixed and wet < wet_limit else 0.0

    latent = dry_coefficient * available + min(wet, wet_limit)
    residual = net - fixed - air_conductance * (canopy - air) - trunk_conductance * (canopy - trunk) - latent
    # Warmer ground gives the canopy longwave, and heat by the trunk.
    from_ground = ground_emissivity * ground_slope * cover * (1.0 - used) + trunk_conductance * trunk_by_ground
    reflected = (1.0 - ground_emissivity) * cover
    by_emission = cover * (reflected - 2.0) * (1.0 - used) + from_ground * (gain * ground_by_emission)
    by_canopy = from_ground * (gain * ground_by_canopy) - air_conductance - trunk_conductance * (1.0 - trunk_by_canopy)
    return residual, by_emission * black_body_slope(kelvin) + by_canopy, by_emission, net, new_ground


@compiled
def newton_step(trial, residual, slope, by_emission, low, high):
    """Next trial temperature and bracket: Newton's step, halved bracket where it would leave it (at kinks).

    But for kinks the residual is a line and `by_emission` times the fourth power of temperature. So its curvature is
    known, and the step is bent by it, to the third order: one step then mostly does what two would.
    """
    low = trial if residual > 0.0 else low
    high = trial if residual < 0.0 else high
    kelvin = trial + FREEZING_POINT_K
    inverse = 1.0 / slope
    third = 4.0 * STEFAN_BOLTZMANN * kelvin * by_emission * inverse
    second = 1.5 * kelvin * third
    step = -residual * inverse
    newton = trial + step - step * step * (second - step * (2.0 * second * second - third))
    inside = low < newton and newton < high
    proposal = newton if inside else 0.5 * (low + high)
    return proposal, low, high
