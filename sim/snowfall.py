"""Snow in a step, from the air through the canopy to the ground."""

from sim.interception import catch_snow
from sim.jit import compiled
from sim.snow import lay_snow


@compiled
def any_snow(b):
    """Whether snow falls or lies in any lane, in the canopy or on the ground."""
    s, w = b.s, b.w
    total = 0.0
    for i in range(len(s.swe)):
        total += w.snow[i] + s.canopy_snow[i] + s.swe[i]
    return not total <= 0.0  # a lane that is not a number leaves the others their snow


@compiled
def snowfall(b, seconds):
    """Snow caught, sublimated, melted and shed by the canopy; what falls to the ground."""
    for i in range(len(b.s.swe)):
        ground_snow = catch_snow(b, i, seconds)
        lay_snow(b, i, ground_snow, seconds)


@compiled
def no_snow(b):
    """The same without any snow."""
    w = b.w
    for i in range(len(b.s.swe)):
        w.canopy_sublimation[i] = 0.0
        w.canopy_melt[i] = 0.0
        w.advected[i] = 0.0
        b.s.albedo[i] = b.p.snow_albedo_fresh[i]
