"""All the random numbers of a year, drawn before it begins: always as many, whatever the stand does."""

from typing import NamedTuple

import numpy as np

from sim.parameters import check_seed
from sim.state import DAYS, DRAWS


class Seeds(NamedTuple):
    """Seeds of an episode's independent random streams."""

    start: int
    weather: int
    disturbance: int


def episode_seeds(seed: int) -> Seeds:
    """Seeds of an episode's start, weather and disturbance, from one integer."""
    seed = check_seed("seed", seed)
    return Seeds(*(int(s) for s in np.random.SeedSequence(seed).generate_state(3, np.uint64) >> np.uint64(1)))


def draw_year(weather, disturbance) -> np.ndarray:
    """A year's random numbers in the order of `sim.state.DRAWS`: always as many, whatever the stand does.

    The wind's are from where the weather's stream would be after 2^127 draws, so that the rest of the weather is the
    same whether the wind varies or not, and no stream has to be kept for it.
    """
    wind = np.random.Generator(weather.bit_generator.jumped())
    streams = {"weather": weather, "disturbance": disturbance, "wind": wind}
    values = []
    for daily, distribution, stream in DRAWS.values():
        generator = streams[stream]
        size = DAYS if daily else 1
        if distribution == "normal":
            values.append(generator.standard_normal(size))
        elif distribution == "exponential":
            values.append(generator.standard_exponential(size))
        else:
            values.append(generator.random(size))
    return np.concatenate(values)


def draw_slice(wanted: str) -> slice:
    """Where a draw stands in what `draw_year` returns."""
    first = 0
    for name, (daily, *_) in DRAWS.items():
        size = DAYS if daily else 1
        if name == wanted:
            return slice(first, first + size)
        first += size
    raise KeyError(wanted)


def restored_generator(state):
    """A generator in the given state of its bit generator; None for None."""
    if state is None:
        return None
    generator = np.random.default_rng(0)
    generator.bit_generator.state = state
    return generator
