"""A year of a block of stands, in the order of the paper's Annual Simulation Timeline.

It reads and writes nothing but the block `b` (parameters, state, action, the year's random draws: see `sim.state`), the
observed forcing and the daily output.
"""

from sim.account import clear_day, clear_year, end_day, write_record
from sim.carbon import decay_products, respiration_rates
from sim.day import begin_day
from sim.deadwood import decay_deadwood
from sim.demography import renew_stems, weigh_stems
from sim.disturbance import insects
from sim.forcing import hour_angles, site_angles, step_weather
from sim.interception import unloading_rates
from sim.jit import compiled, phase
from sim.management import manage
from sim.organic import renew_organic_layer
from sim.permafrost import add_upper_ground
from sim.photosynthesis import carbon_dioxide
from sim.physical_constants import SECONDS_PER_DAY
from sim.snow import settle_snow
from sim.soil import soil_nodes
from sim.step import simulate_step
from sim.structure import crown_areas
from sim.trunk import grow_trunk
from sim.wind import wind_profiles


@phase
def simulate_year(block, steps_per_day, days, observed, daily):
    """Advance a block of stands by a year, in place.

    block : array of one record `b` of `block_dtype(lanes)`, with parameters, state, the year's draws and action
    (`w.density_change` [stems ha-1] and `w.mix`) filled in; on return its state is the new state and `b.r` the annual
    record. (In an array, because numba takes a bare record's address from a description of all its fields, 0.07 ms.)
    steps_per_day : time steps a day; days : 365, or fewer for a partial forcing.
    observed : observed forcing, shape (days x steps_per_day, 6, lanes) with the columns of `sim.state.FORCING`, or
    shape (0, 6, lanes) for the weather generator.
    daily : output, an array of a record of `daily_dtype(lanes)` for each day, or of none.
    """
    advance(block[0], hour_angles(steps_per_day), days, observed, daily)


@compiled
def advance(b, hours, days, observed, daily):
    """The year itself; it makes no array, which a GPU could not. hours : `sim.forcing.hour_angles`, a row a step."""
    steps_per_day = len(hours)
    seconds = SECONDS_PER_DAY / steps_per_day
    begin_year(b)
    for day in range(days):
        today = observed[day * steps_per_day : (day + 1) * steps_per_day]
        begin_day(b, day, hours, today)
        clear_day(b, day, daily)
        for t in range(steps_per_day):
            step_weather(b, t, hours, seconds, today)
            simulate_step(b, seconds)
        settle_snow(b, steps_per_day)
        decay_deadwood(b, steps_per_day)
        end_day(b, day, steps_per_day, daily)
        add_upper_ground(b)
    end_year(b)


@phase
def begin_year(b):
    """1 and 2 of the timeline: the action, and what follows from the stand's structure."""
    for i in range(len(b.s.swe)):
        clear_year(b, i)
        weigh_stems(b, i)
        manage(b, i)
        site_angles(b, i)
        wind_profiles(b, i)
        respiration_rates(b, i)
        soil_nodes(b, i)
        carbon_dioxide(b, i)
        unloading_rates(b, i)
        crown_areas(b, i)
        grow_trunk(b, i)


@phase
def end_year(b):
    """4 and 5 of the timeline: insects, mortality, recruitment, ageing, the organic layer, products, the account."""
    for i in range(len(b.s.swe)):
        insects(b, i)
        renew_stems(b, i)
        renew_organic_layer(b, i)
        decay_products(b, i)
        write_record(b, i)
