"""A year's random numbers are those of numpy's generators, bit for bit."""

import copy
import multiprocessing
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import sim
from sim import draws, stands
from sim.state import DAYS, DRAWS, DRAWS_SIZE

NUMBER = 300  # of whose half a million normal and exponential numbers some hundred are from beyond the ziggurats


def streams(number):
    return np.array([draws.streams_of(sim.episode_seeds(k)) for k in range(number)])


def of_numpy(weather, disturbance):
    """A year's numbers as numpy's generators draw them, in the order of `DRAWS`."""
    wind = np.random.Generator(np.random.PCG64())
    wind.bit_generator.state = weather.bit_generator.state
    wind.bit_generator.advance(draws.AHEAD)
    generators = {"weather": weather, "wind": wind, "disturbance": disturbance}
    values = []
    for daily, distribution, stream in DRAWS.values():
        draw = {"normal": "standard_normal", "exponential": "standard_exponential", "uniform": "random"}[distribution]
        values.append(getattr(generators[stream], draw)(DAYS if daily else 1))
    return np.concatenate(values)


def test_they_are_numpys_year_after_year():
    seeds = [sim.episode_seeds(k) for k in range(NUMBER)]
    generators = [(np.random.default_rng(s.weather), np.random.default_rng(s.disturbance)) for s in seeds]
    ours, drawn = streams(NUMBER), np.empty((NUMBER, DRAWS_SIZE))
    for _ in range(2):
        draws.drawer("numba")(ours, drawn)
        np.testing.assert_array_equal(drawn, [of_numpy(*each) for each in generators])
    normal, exponential = (drawn[:, draws.draw_slice(name)] for name in ("temperature_noise", "wet_amount"))
    assert abs(normal).max() > draws.NORMAL_TAIL and exponential.max() > draws.EXPONENTIAL_TAIL


def test_interpreted_they_are_the_same():
    """Also of stands with a number from beyond the ziggurats, in which numpy's own logarithm differs by a bit."""
    beyond = [0, 1756, 2075, 2184, 2200, 2428]
    results = []
    for backend in ("numba", "python"):
        ours = np.array([draws.streams_of(sim.episode_seeds(k)) for k in beyond])
        drawn = np.empty((len(beyond), DRAWS_SIZE))
        draws.drawer(backend)(ours, drawn)
        results.append((ours, drawn))
    for compiled, interpreted in zip(*results, strict=True):
        np.testing.assert_array_equal(compiled, interpreted)


def test_threads_that_come_together_make_one():
    draws.made.cache_clear()
    with ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(draws.drawer, ["numba", "cuda"] * 8))) == 1


def test_stands_are_copied_and_forked_after_their_threads_have_worked(monkeypatch):
    monkeypatch.setattr(stands, "DRAWN_AT_ONCE", 2)
    five = sim.Stands(5, threads=2)
    five.streams[:] = streams(5)
    five._draw(five.streams)
    copied = pickle.loads(pickle.dumps(five))
    expected = copied._draw(copied.streams)
    again = copy.deepcopy(five)
    np.testing.assert_array_equal(again._draw(again.streams), expected)
    if "fork" in multiprocessing.get_all_start_methods():
        fork = multiprocessing.get_context("fork")
        here, there = fork.Pipe()
        child = fork.Process(target=lambda: there.send(five._draw(five.streams)), daemon=True)
        child.start()
        assert here.poll(60)
        np.testing.assert_array_equal(here.recv(), expected)


def test_threads_draw_what_one_does(monkeypatch):
    results = []
    for at_once in (5, 2):
        monkeypatch.setattr(stands, "DRAWN_AT_ONCE", at_once)
        five = sim.Stands(5, threads=2)
        five.streams[:] = streams(5)
        results.append((five._draw(five.streams), five.streams))
    for alone, together in zip(*results, strict=True):
        np.testing.assert_array_equal(alone, together)


def test_a_stream_that_is_none_is_refused():
    one = sim.Stands(1, time_step_minutes=120)
    state = one.get_state() | {"seeds": [sim.episode_seeds(0)], "streams": streams(1) - np.uint64(1)}
    state["parameters"] = np.array(
        [[{**sim.sample_site(0), **one.constants}.get(name, 0.0) for name in stands.PARAMETER_NAMES]]
    )
    with pytest.raises(ValueError, match="streams: a PCG64's increment is odd"):
        one.set_state(state)
