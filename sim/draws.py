"""All the random numbers of a year, drawn before it begins: always as many, whatever the stand does."""

from typing import NamedTuple

import numpy as np

from sim.parameters import brief, check_seed
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


#: How far ahead of the weather's stream the wind's is: (golden ratio - 1) 2^128 draws, as PCG64's own `jumped`.
AHEAD = 0x9E3779B97F4A7C15F39CC0605CEDC835


def draw_year(weather, disturbance) -> np.ndarray:
    """A year's random numbers in the order of `sim.state.DRAWS`: always as many, whatever the stand does.

    The wind's are from where the weather's stream would be after `AHEAD` draws, so that the rest of the weather is the
    same whether the wind varies or not, and no stream has to be kept for it.
    """
    start = weather.bit_generator.state
    values = []
    for daily, distribution, stream in DRAWS.values():
        size = DAYS if daily else 1
        if stream == "wind":
            values.append(_draw_ahead(weather, start, distribution, size))
        else:
            values.append(_draw(weather if stream == "weather" else disturbance, distribution, size))
    return np.concatenate(values)


def _draw(generator, distribution, size):
    if distribution == "normal":
        return generator.standard_normal(size)
    if distribution == "exponential":
        return generator.standard_exponential(size)
    return generator.random(size)


def _draw_ahead(generator, start, distribution, size):
    """Draws from `AHEAD` of a start, after which the generator goes on where it was: a second one would cost as much
    time as all else that is drawn."""
    here = generator.bit_generator.state
    try:
        generator.bit_generator.state = start
        generator.bit_generator.advance(AHEAD)
        return _draw(generator, distribution, size)
    finally:
        generator.bit_generator.state = here


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
    try:
        generator.bit_generator.state = state
    except (TypeError, ValueError, KeyError, OverflowError):
        raise ValueError(f"state of a generator: that of a PCG64 is allowed, got {brief(state)}") from None
    return generator
