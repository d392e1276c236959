"""Photosynthesis by light use, and the stresses that reduce it. Fluxes in kgC m-2 s-1."""

from sim.jit import compiled, phase


@compiled
def photosynthesis(intercepted, leaf_share, efficiency, par_fraction, temperature_stress, vpd_stress, stress) -> float:
    """Gross production [kgC m-2 s-1] by light use (Monteith 1972; MOD17): intercepted shortwave [W m-2] x the
    leaves' share of it x efficiency [gC MJ-1], reduced by cold, dry air and dry soil."""
    return 1e-9 * par_fraction * intercepted * leaf_share * efficiency * temperature_stress * vpd_stress * stress


@compiled
def stress_ramp(value, zero, slope) -> float:
    """Linear ramp, 0 at `zero`, up to 1; MOD17's scalars of minimum temperature and vapour pressure deficit."""
    return min(max((value - zero) * slope, 0.0), 1.0)


@compiled
def dryness_slopes(b, i):
    """Slopes of the stress by dry air, for the year."""
    p, w = b.p, b.w
    w.dryness_conifer[i] = 1.0 / (p.vpd_high_conifer_hpa[i] - p.vpd_low_hpa[i])
    w.dryness_deciduous[i] = 1.0 / (p.vpd_high_deciduous_hpa[i] - p.vpd_low_hpa[i])


@phase
def cold_stress(b):
    """Stress by the day's minimum temperature."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        w.temperature_stress_conifer[i] = stress_ramp(
            w.minimum_temperature[i], p.tmin_low_conifer[i], 1.0 / (p.tmin_high_conifer[i] - p.tmin_low_conifer[i])
        )
        w.temperature_stress_deciduous[i] = stress_ramp(
            w.minimum_temperature[i],
            p.tmin_low_deciduous[i],
            1.0 / (p.tmin_high_deciduous[i] - p.tmin_low_deciduous[i]),
        )


@compiled
def dry_air_stress(b, i):
    """Stress of both species by the step's vapour pressure deficit."""
    p, w = b.p, b.w
    conifer = 1.0 - stress_ramp(w.deficit[i], p.vpd_low_hpa[i], w.dryness_conifer[i])
    deciduous = 1.0 - stress_ramp(w.deficit[i], p.vpd_low_hpa[i], w.dryness_deciduous[i])
    return conifer, deciduous


@compiled
def assimilate(b, i, light_conifer, light_deciduous, dry_conifer, dry_deciduous):
    """Gross production of both species, from the light that each intercepts [W m-2]."""
    p, w = b.p, b.w
    w.gpp_conifer[i] = photosynthesis(
        light_conifer,
        w.leaf_conifer[i],
        w.light_use_conifer[i],
        p.par_fraction[i],
        w.temperature_stress_conifer[i],
        dry_conifer,
        w.water_stress[i],
    )
    w.gpp_deciduous[i] = photosynthesis(
        light_deciduous,
        w.leaf_deciduous[i],
        w.light_use_deciduous[i],
        p.par_fraction[i],
        w.temperature_stress_deciduous[i],
        dry_deciduous,
        w.water_stress[i],
    )


@compiled
def energy_of_photosynthesis(b, i) -> float:
    """Light that is stored as carbon [W m-2]."""
    return 1000.0 * b.p.photosynthesis_energy[i] * (b.w.gpp_conifer[i] + b.w.gpp_deciduous[i])
