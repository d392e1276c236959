"""All the random numbers of a year, drawn before it begins: always as many, whatever the stand does.

A stand has two streams of numpy's PCG64 (O'Neill 2014), and its numbers are those of `numpy.random.Generator`, bit for
bit on x86-64; elsewhere numpy's own compiler may round the rarest otherwise. They are drawn here, in compiled code,
because threads that call numpy's generators wait for each other for Python's lock (docs/performance.md). Normal and
exponential numbers are by ziggurats (Marsaglia and Tsang 2000), whose tables numba has from numpy; they are no public
part of numba, and tests/test_draws.py tells if they ever change.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from numba.np.random import _constants as ziggurat

from sim.jit import MAKING, alone, compiled, made_ready, specialised, uncompiled
from sim.parameters import check_seed
from sim.state import DAYS, DRAWS, DRAWS_SIZE


class Seeds(NamedTuple):
    """Seeds of an episode's independent random streams."""

    start: int
    weather: int
    disturbance: int


def episode_seeds(seed: int) -> Seeds:
    """Seeds of an episode's start, weather and disturbance, from one integer in [0, 2^63); ValueError for another."""
    seed = check_seed("seed", seed)
    return Seeds(*(int(s) for s in np.random.SeedSequence(seed).generate_state(3, np.uint64) >> np.uint64(1)))


MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645  # of PCG64
#: Streams of a stand, in the order of `streams_of`.
STREAMS = ("weather", "disturbance")
WORDS = 4  # of a stream, 64 bits each: the high and the low word of the state, those of the increment


def streams_of(seeds: Seeds) -> np.ndarray:
    """A stand's streams at the start of an episode, uint64 (streams, words)."""
    states = (np.random.PCG64(getattr(seeds, name)).state["state"] for name in STREAMS)
    return np.array([[*words(state["state"]), *words(state["inc"])] for state in states])


def words(number: int) -> tuple[np.uint64, np.uint64]:
    """The high and the low 64 bits of a number of 128."""
    return np.uint64(number >> 64), np.uint64(number & (2**64 - 1))


def jump(steps: int) -> tuple[int, int]:
    """(a, b) such that a state x with increment c becomes a x + b c (mod 2^128) in so many steps."""
    a, b, multiplier, increment = 1, 0, MULTIPLIER, 1
    while steps:
        if steps & 1:
            a, b = a * multiplier % 2**128, (b * multiplier + increment) % 2**128
        multiplier, increment = multiplier**2 % 2**128, (multiplier + 1) * increment % 2**128
        steps >>= 1
    return a, b


#: How far ahead of the weather's stream the wind's is: (golden ratio - 1) 2^128 draws, as PCG64's own `jumped`.
AHEAD = 0x9E3779B97F4A7C15F39CC0605CEDC835

STEP_HIGH, STEP_LOW = words(MULTIPLIER)
(JUMP_HIGH, JUMP_LOW), (SHIFT_HIGH, SHIFT_LOW) = map(words, jump(AHEAD))
ONE, THREE, EIGHT, ELEVEN, LOW_BITS = map(np.uint64, (1, 3, 8, 11, 2**32 - 1))
HALF, FULL, TOP, LAYER, MANTISSA = map(np.uint64, (32, 64, 58, 255, 2**52 - 1))
NORMAL_TAIL, NORMAL_INVERSE_TAIL = ziggurat.ziggurat_nor_r, ziggurat.ziggurat_nor_inv_r
EXPONENTIAL_TAIL = ziggurat.ziggurat_exp_r
NORMAL_WIDTH, NORMAL_EDGE, NORMAL_HEIGHT = ziggurat.wi_double, ziggurat.ki_double, ziggurat.fi_double
EXPONENTIAL_WIDTH, EXPONENTIAL_EDGE, EXPONENTIAL_HEIGHT = ziggurat.we_double, ziggurat.ke_double, ziggurat.fe_double


@compiled
def product(a_high, a_low, b_high, b_low):
    """The product of two numbers of 128 bits, modulo 2^128, as its high and low word."""
    a0, a1, b0, b1 = a_low & LOW_BITS, a_low >> HALF, b_low & LOW_BITS, b_low >> HALF
    middle = a1 * b0 + (a0 * b0 >> HALF)
    other = a0 * b1 + (middle & LOW_BITS)
    carried = a1 * b1 + (middle >> HALF) + (other >> HALF)
    return carried + a_high * b_low + a_low * b_high, a_low * b_low


@compiled
def total(a_high, a_low, b_high, b_low):
    """The sum of two numbers of 128 bits, modulo 2^128, as its high and low word."""
    low = a_low + b_low
    return a_high + b_high + np.uint64(low < a_low), low


@compiled
def next_bits(stream):
    """The stream's next 64 random bits: a step, then the words' exclusive or, rotated (XSL-RR)."""
    high, low = product(stream[0], stream[1], STEP_HIGH, STEP_LOW)
    high, low = total(high, low, stream[2], stream[3])
    stream[0], stream[1] = high, low
    bits, turn = high ^ low, high >> TOP
    return (bits >> turn) | (bits << ((FULL - turn) & (FULL - ONE)))  # a shift by 64 is undefined


@compiled
def uniform(stream):
    """From [0, 1)."""
    return np.float64(next_bits(stream) >> ELEVEN) * 2.0**-53


@compiled
def normal(stream):
    """Of mean 0 and standard deviation 1. Which bits are layer, sign and place, also the tail's, is numpy's choice."""
    while True:
        bits = next_bits(stream)
        layer = bits & LAYER
        bits >>= EIGHT
        place = (bits >> ONE) & MANTISSA
        x = np.float64(place) * NORMAL_WIDTH[layer]
        if bits & ONE:
            x = -x
        if place < NORMAL_EDGE[layer]:
            return x
        if layer == 0:
            while True:
                beyond = -NORMAL_INVERSE_TAIL * math.log1p(-uniform(stream))
                height = -math.log1p(-uniform(stream))
                if height + height > beyond * beyond:
                    return -(NORMAL_TAIL + beyond) if (place >> EIGHT) & ONE else NORMAL_TAIL + beyond
        outer, inner = NORMAL_HEIGHT[layer], NORMAL_HEIGHT[layer - ONE]
        if (inner - outer) * uniform(stream) + outer < math.exp(-0.5 * x * x):
            return x


@compiled
def exponential(stream):
    """Of mean 1."""
    while True:
        bits = next_bits(stream) >> THREE
        layer = bits & LAYER
        place = bits >> EIGHT
        x = np.float64(place) * EXPONENTIAL_WIDTH[layer]
        if place < EXPONENTIAL_EDGE[layer]:
            return x
        if layer == 0:
            return EXPONENTIAL_TAIL - math.log1p(-uniform(stream))
        outer, inner = EXPONENTIAL_HEIGHT[layer], EXPONENTIAL_HEIGHT[layer - ONE]
        if (inner - outer) * uniform(stream) + outer < math.exp(-x):
            return x


@compiled
def draw_years(streams, draws):
    """Fill rows with a year's random numbers in the order of `sim.state.DRAWS`, and leave the streams after them.

    streams : uint64 (stands, streams, words); draws : (stands, `DRAWS_SIZE`). The wind's are from where the weather's
    stream would be after `AHEAD` draws, so that the rest of the weather is the same whether the wind varies or not, and
    no stream has to be kept for it.
    """
    wind = np.empty(WORDS, np.uint64)
    for k in range(len(streams)):
        weather, disturbance = streams[k, 0], streams[k, 1]
        ahead = product(weather[0], weather[1], JUMP_HIGH, JUMP_LOW)
        shift = product(weather[2], weather[3], SHIFT_HIGH, SHIFT_LOW)
        wind[0], wind[1] = total(ahead[0], ahead[1], shift[0], shift[1])
        wind[2], wind[3] = weather[2], weather[3]
        for n in range(DAYS):
            draws[k, n] = normal(weather)
        for n in range(DAYS, 2 * DAYS):
            draws[k, n] = uniform(weather)
        for n in range(2 * DAYS, 3 * DAYS):
            draws[k, n] = exponential(weather)
        for n in range(3 * DAYS, 4 * DAYS):
            draws[k, n] = normal(wind)
        for n in range(4 * DAYS, DRAWS_SIZE):
            draws[k, n] = uniform(disturbance)


def drawer(backend: str):
    """`draw_years`, compiled or loaded; of the `python` backend interpreted."""
    with MAKING:  # of the threads that come together one makes it
        return interpreted() if backend == "python" else made()


@functools.cache
def interpreted():
    """`draw_years` as plain Python."""
    return np.errstate(over="ignore")(uncompiled(draw_years))


@functools.cache
def made():
    """Compiled or loaded."""
    nothing = np.empty((0, len(STREAMS), WORDS), np.uint64), np.empty((0, DRAWS_SIZE))
    with alone("draws"):
        return made_ready(specialised(draw_years, "draws"), *nothing)


def draw_slice(wanted: str) -> slice:
    """Where a draw stands in a row of `draw_years`."""
    first = 0
    for name, (daily, *_) in DRAWS.items():
        size = DAYS if daily else 1
        if name == wanted:
            return slice(first, first + size)
        first += size
    raise KeyError(wanted)
