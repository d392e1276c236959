"""One sub-daily step of a block of stands, in order: air, light, snow and rain, temperatures, fluxes, closure.

Fluxes are computed once, at the temperatures of an implicit step, and then moved between stores. `balance` checks from
the stores alone that nothing was lost.
"""

from sim.balance import balance, note_stores
from sim.canopy import solve_canopy
from sim.carbon import move_carbon
from sim.evaporation import evaporation, ground_vapour
from sim.fluxes import move_heat_and_water
from sim.forcing import moisture
from sim.ground_heat import ground_temperatures
from sim.interception import rainfall
from sim.jit import compiled
from sim.response import answer_to_canopy
from sim.snowfall import any_snow, no_snow, snowfall
from sim.sunlight import any_sun, darkness, sunlight
from sim.water import drought_stress
from sim.wind import ground_exchange


@compiled
def simulate_step(b, seconds):
    """Advance a block by one step of `seconds`, in the weather that `sim.forcing.step_weather` has left in it."""
    begin_step(b, seconds)
    if any_sun(b):
        sunlight(b)
    else:
        darkness(b)
    snow = any_snow(b)
    if snow:
        snowfall(b, seconds)
    else:
        no_snow(b)
    rainfall(b)
    ground_exchange(b)
    evaporation(b, seconds)
    ground_vapour(b, seconds)
    answer_to_canopy(b, seconds)
    solve_canopy(b)
    move_heat_and_water(b, seconds)
    move_carbon(b, seconds)
    balance(b, seconds)


@compiled
def begin_step(b, seconds):
    """The stores before the step and the temperatures of the ground; the step's air and its soil's moisture."""
    for i in range(len(b.s.swe)):
        note_stores(b, i)
        ground_temperatures(b, i)
        moisture(b, i)
        drought_stress(b, i, seconds)
