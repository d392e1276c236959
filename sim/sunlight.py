"""Sunlight in a step: what canopy and ground absorb of it, and what leaves do with it."""

from sim.evaporation import open_stomata
from sim.jit import compiled
from sim.photosynthesis import assimilate, energy_stored
from sim.radiation import canopy_interception, path_length, shortwave
from sim.snow import surface_albedo
from sim.understorey import assimilate_below


@compiled
def any_sun(b):
    """Whether shortwave reaches any lane."""
    for i in range(len(b.s.swe)):
        if b.w.shortwave[i] > 0.0:
            return True
    return False


@compiled
def sunlight(b):
    """Shortwave absorbed by canopy and ground, photosynthesis, and how far stomata open. What the understorey stores of
    the light is no more the ground's."""
    p, w = b.p, b.w
    for i in range(len(b.s.swe)):
        light_conifer, light_deciduous = absorb(b, i)
        assimilate(b, i, light_conifer, light_deciduous)
        assimilate_below(b, i, w.shortwave[i] - light_conifer - light_deciduous)
        w.fixed[i] = energy_stored(w.gpp_conifer[i] + w.gpp_deciduous[i], p.photosynthesis_energy[i])
        w.ground_sw[i] -= energy_stored(w.gpp_understorey[i], p.photosynthesis_energy[i])
        open_stomata(b, i)


@compiled
def absorb(b, i):
    """Shortwave absorbed and reflected; returns what each species intercepts from above [W m-2]."""
    s, p, w = b.s, b.p, b.w
    path = path_length(w.cos_zenith[i], p.slant_path[i], p.slant_path_max[i])
    beam_conifer, beam_deciduous = canopy_interception(
        path, w.crown_area[i], w.share_conifer[i], w.optical_conifer[i], w.optical_deciduous[i]
    )
    ground = surface_albedo(s.swe[i], w.snow_hiding[i], s.albedo[i], p.ground_albedo[i])
    w.canopy_sw[i], w.ground_sw[i], w.reflected[i], light_conifer, light_deciduous = shortwave(
        w.shortwave[i],
        w.diffuse[i],
        beam_conifer,
        beam_deciduous,
        w.sky_conifer[i],
        w.sky_deciduous[i],
        p.albedo_conifer[i],
        p.albedo_deciduous[i],
        ground,
    )
    return light_conifer, light_deciduous


@compiled
def darkness(b):
    """The same at night."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.canopy_sw[i] = 0.0
        w.ground_sw[i] = 0.0
        w.reflected[i] = 0.0
        w.gpp_conifer[i] = 0.0
        w.gpp_deciduous[i] = 0.0
        w.gpp_understorey[i] = 0.0
        w.fixed[i] = 0.0
        w.leaf_coefficient[i] = 0.0
