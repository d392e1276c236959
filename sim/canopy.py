"""Canopy: the energy balance that sets its temperature, and its solution.

The canopy stores no heat; its temperature is where radiation, sensible heat, evaporation, photosynthesis, snow and
the trunk balance. The ground and the trunk answer to it within the same step (`sim.response`), so that
all nodes exchange radiation at the same temperatures.
"""

from sim.jit import compiled
from sim.physical_constants import FREEZING_POINT_K, STEFAN_BOLTZMANN
from sim.radiation import black_body, black_body_slope, longwave_down, longwave_up

NEWTON_TOLERANCE = 1e-7  # W m-2
NEWTON_LIMIT = 60  # iterations; bisection alone would need 50


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


@compiled
def newton_iteration(b):
    """Balance of the canopies at their trial temperatures; those that are off get another. Returns how many."""
    s, p, w = b.s, b.p, b.w
    moved = 0
    for i in range(len(s.swe)):
        trial, low, high = w.trial[i], w.low[i], w.high[i]
        residual, slope, by_emission, w.net[i], w.ground_new[i] = canopy_balance(
            trial,
            w.fixed[i],
            w.canopy_sw[i],
            w.sky[i],
            w.longwave_cover[i],
            p.ground_emissivity[i],
            s.ground[i],
            w.melt_span[i],
            w.bare_gain[i],
            w.ground_base[i],
            w.ground_by_emission[i],
            w.ground_by_canopy[i],
            w.trunk_base[i],
            w.trunk_by_canopy[i],
            w.trunk_by_ground[i],
            w.trunk_canopy[i],
            w.air[i],
            w.canopy_air[i],
            w.dry_coefficient[i],
            w.wet_coefficient[i],
            w.wet_limit[i],
        )
        off = abs(residual) > NEWTON_TOLERANCE  # not where it is no number: that stays, for closure to find
        proposal, low, high = newton_step(trial, residual, slope, by_emission, low, high)
        w.residual[i] = residual
        w.trial[i] = proposal if off else trial
        w.low[i] = low
        w.high[i] = high
        moved += 1 if off else 0
    return moved


@compiled
def solve_canopy(b):
    """Newton's method for all lanes together; a lane that has converged stays where it is."""
    iterations = 0
    while newton_iteration(b) > 0 and iterations < NEWTON_LIMIT:
        iterations += 1
