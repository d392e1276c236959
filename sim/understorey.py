"""Shrubs, herbs and moss below the trees and in the open: one leaf area everywhere, buried by snow.

They use the light that the trees leave, as conifers do but for their lower efficiency, and store no carbon: what they
gain is litter in the same step, as in a layer whose growth and litter are in balance. Their transpiration is part of
what the ground evaporates.
"""

from sim.jit import compiled, phase
from sim.mathematics import exponential
from sim.photosynthesis import photosynthesis
from sim.snow import snow_depth


@compiled
def above_snow(depth, height) -> float:
    """Share of the understorey that stands out of snow of this depth."""
    return max(1.0 - depth / height, 0.0)


@compiled
def absorbed_share(area, extinction, path) -> float:
    """Share of light from above that a closed layer of this leaf area absorbs (Beer-Lambert)."""
    return 1.0 - exponential(-extinction * area * path)


@phase
def understorey_light(b):
    """The day's efficiency of the understorey, per shortwave below the trees [kgC J-1]; snow of the morning."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        area = p.understorey_lai[i] * above_snow(snow_depth(b, i), p.understorey_height_m[i])
        w.efficiency_understorey[i] *= absorbed_share(area, p.light_extinction[i], p.sky_path[i])


@compiled
def assimilate_below(b, i, light):
    """Gross production of the understorey, from the light that passes the trees [W m-2]."""
    w = b.w
    stress = min(w.dry_air_conifer[i], w.water_stress[i])
    w.gpp_understorey[i] = photosynthesis(max(light, 0.0), w.efficiency_understorey[i], stress)
