"""What comes before the steps of a day, in order: weather, fire, leaves and all that hangs on them, litter."""

from sim.carbon import litter
from sim.disturbance import fire
from sim.evaporation import transpiring_leaves
from sim.forcing import generated_weather, observed_weather, sun
from sim.interception import canopy_capacities
from sim.jit import phase
from sim.photosynthesis import light_use
from sim.snow import snow_properties
from sim.structure import leaves, sky_cover
from sim.trunk import trunk_conductances
from sim.understorey import understorey_light
from sim.wind import day_wind


@phase
def begin_day(b, day, hours, observed):
    """Weather and structure of day 0 to 364. hours : `sim.forcing.hour_angles`; observed : the day's forcing
    (steps, 6, lanes), or (0, 6, lanes)."""
    sun(b, day)
    if observed.shape[0] > 0:
        observed_weather(b, observed)
    else:
        generated_weather(b, day)
    fire(b, day)
    leaves(b, day)
    sky_cover(b)
    light_use(b, hours, observed)
    transpiring_leaves(b)
    canopy_capacities(b)
    trunk_conductances(b)
    snow_properties(b)
    understorey_light(b)
    day_wind(b, day)
    litter(b, day)
