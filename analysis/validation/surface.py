"""What lies on a stand's mineral soil, step by step: temperature of the organic layer, and the resistance of its humus.

The simulator puts out daily means. But frost by night and thaw by day do not cancel, for frozen soil conducts better
than thawed: what is to feel the same as the simulator's soil has to see every step.
"""

import functools

import numpy as np

import sim
from boreal_env import NO_CHANGE
from sim.account import clear_day, end_day
from sim.block import filled_block
from sim.day import begin_day
from sim.forcing import hour_angles, step_weather
from sim.jit import phase, specialised
from sim.physical_constants import SECONDS_PER_DAY
from sim.snow import settle_snow
from sim.spin_up import climate_draws
from sim.state import DAYS, DRAWS, daily_dtype
from sim.step import simulate_step
from sim.year import begin_year, end_year


@phase
def record_year(b, steps_per_day, no_weather, no_daily, surface):
    """`sim.year.simulate_year` under generated weather, which writes `surface`, shape (2, steps, lanes): temperature
    of the organic layer [degC] at each step's start and resistance of its lower half [m2 K W-1]."""
    begin_year(b)
    seconds = SECONDS_PER_DAY / steps_per_day
    hours = hour_angles(steps_per_day)
    for day in range(DAYS):
        begin_day(b, day, hours, no_weather)
        clear_day(b, day, no_daily)
        for t in range(steps_per_day):
            step_weather(b, t, hours, seconds, no_weather)
            simulate_step(b, seconds)
            for i in range(len(b.s.swe)):
                surface[0, day * steps_per_day + t, i] = b.w.organic[i]
                surface[1, day * steps_per_day + t, i] = 1.0 / b.w.surface_conductance[i] - b.w.upper_soil[i]
        settle_snow(b, steps_per_day)
        end_day(b, day, steps_per_day, no_daily)
    end_year(b)


@functools.cache
def kernel(lanes: int):
    """`record_year` for so many stands, compiled at its first call or loaded from the disk cache."""
    return specialised(record_year, f"{lanes}_recorded")


class RecordedStands(sim.Stands):
    """Stands that keep the surface of their last year.

    surface : temperature of the organic layer [degC] and resistance of its lower half [m2 K W-1] in each step,
    (2, stands, steps).
    """

    def climate_year(self) -> np.ndarray:
        """The surface of the climate's mean year, with which `start` brought soil and snow into balance."""
        mean = climate_draws()
        draws = [np.broadcast_to(mean.get(name, 0.0), DAYS if daily else 1) for name, (daily, *_) in DRAWS.items()]
        draws = np.tile(np.concatenate(draws), (self.number, 1))
        self._run(np.arange(self.number), draws, np.full(self.number, NO_CHANGE))
        return self.surface

    def _run(self, stands, draws, actions, *arguments, streams=None, **options):
        """The year as `sim.Stands` runs it, after a first time that records its surface, unless its steps are other
        than the stands'."""
        draws = self._draw(streams) if draws is None else draws
        if options.get("steps_per_day", self.steps_per_day) == self.steps_per_day:
            number = len(stands)
            block, _ = filled_block(
                number,
                self.parameters[stands],
                self.state[stands],
                draws,
                actions,
                first_cut_age=self.first_cut_age,
                products_decay=self.products_decay,
            )
            surface = np.zeros((2, DAYS * self.steps_per_day, number))
            nothing = np.zeros((0, 6, number)), np.zeros(0, daily_dtype(number))
            kernel(number)(block[0], self.steps_per_day, *nothing, surface)
            self.surface = np.ascontiguousarray(surface.transpose(0, 2, 1))
        return super()._run(stands, draws, actions, *arguments, **options)
