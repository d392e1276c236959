"""Shortwave and longwave between sky, canopy and ground, in closed form: what one absorbs, another has lost.

Fluxes in W m-2 of ground area, transmissivities and albedos as shares.
"""

from sim.jit import compiled
from sim.mathematics import exponential
from sim.physical_constants import STEFAN_BOLTZMANN


@compiled
def path_length(cos_zenith: float, slant_path: float, longest: float) -> float:
    """Path of the direct beam through the canopy, in units of the vertical path."""
    return min(longest, max(1.0, slant_path / max(cos_zenith, 1e-3)))


@compiled
def canopy_interception(path, crown_area, share_conifer, optical_conifer, optical_deciduous):
    """Shares of a beam intercepted by conifer and by deciduous crowns (Beer-Lambert through gaps and leaves).

    path : length through the canopy, in vertical paths; crown_area : crown area per ground area [m2 m-2];
    share_conifer : conifers' share of it; optical_* : extinction coefficient x plant area of a crown.
    """
    crowns = 1.0 - exponential(-crown_area * path)
    conifer = crowns * share_conifer * (1.0 - exponential(-optical_conifer * path))
    deciduous = crowns * (1.0 - share_conifer) * (1.0 - exponential(-optical_deciduous * path))
    return conifer, deciduous


@compiled
def shortwave(
    incoming,
    diffuse,
    beam_conifer,
    beam_deciduous,
    sky_conifer,
    sky_deciduous,
    albedo_conifer,
    albedo_deciduous,
    ground_albedo,
):
    """Shortwave absorbed by canopy and ground, reflected to the sky, and intercepted from above by each species.

    beam_*, sky_* : intercepted shares of direct and of hemispheric light. Light reflected by the ground meets the
    canopy as hemispheric light; the series of reflections between the two is summed in closed form.
    Returns (canopy, ground, reflected, intercepted_conifer, intercepted_deciduous).
    """
    direct = 1.0 - diffuse
    conifer = incoming * (direct * beam_conifer + diffuse * sky_conifer)
    deciduous = incoming * (direct * beam_deciduous + diffuse * sky_deciduous)
    canopy_up = albedo_conifer * conifer + albedo_deciduous * deciduous
    transmitted = incoming - conifer - deciduous
    canopy_down = albedo_conifer * sky_conifer + albedo_deciduous * sky_deciduous
    below = transmitted / (1.0 - ground_albedo * canopy_down)
    ground_up = ground_albedo * below
    gap = 1.0 - sky_conifer - sky_deciduous
    canopy = (conifer + deciduous - canopy_up) + ground_up * (sky_conifer + sky_deciduous - canopy_down)
    return canopy, below - ground_up, canopy_up + ground_up * gap, conifer, deciduous


@compiled
def longwave_down(sky, canopy_emission, canopy_cover) -> float:
    """Longwave reaching the ground: sky through the gaps, and the canopy."""
    return (1.0 - canopy_cover) * sky + canopy_cover * canopy_emission


@compiled
def longwave_up(ground_emission, below_canopy, emissivity) -> float:
    """Longwave leaving the ground: its emission, and what it reflects."""
    return emissivity * ground_emission + (1.0 - emissivity) * below_canopy


@compiled
def black_body(kelvin: float) -> float:
    """Stefan-Boltzmann emission [W m-2]."""
    square = kelvin * kelvin
    return STEFAN_BOLTZMANN * square * square


@compiled
def black_body_slope(kelvin: float) -> float:
    """Its derivative [W m-2 K-1]."""
    return 4.0 * STEFAN_BOLTZMANN * kelvin * (kelvin * kelvin)
