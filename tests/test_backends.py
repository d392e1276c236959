"""One physics: interpreted or compiled, one stand or many in lockstep, in any order, in one go or resumed."""

import pickle
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas as pd
import pytest
from numba.core.dispatcher import Dispatcher

import sim
from sim import block
from sim.block import kernel
from sim.state import DAILY_NAMES
from sim.task.episodes import BALANCED_WORLD

NUMBER = 19
MINUTES = 120


def start(number=NUMBER, **kwargs):
    """Stands on sites of their own, of which every third burns, and every other starts dense and old."""
    stands = sim.Stands(number, **{"time_step_minutes": MINUTES, **kwargs})
    begin(stands, range(number))
    return stands


def begin(stands, seeds):
    burning = {"fire_base_probability": 0.05, "fire_drought_threshold": 0.0, "insect_base_probability": 1.0}
    old = {"density_stems_ha": 900.0, "conifer_fraction": 0.5, "biomass_kgc_m2": 8.0, "oldest_age_years": 120.0}
    sites = [sim.sample_site(k, burning if k % 3 == 0 else None) for k in seeds]
    initial = {i: old for i, k in enumerate(seeds) if k % 2 == 0}
    stands.start(np.arange(len(sites)), sites, [sim.episode_seeds(k) for k in seeds], initial)


def action_of(seed, year):
    return np.random.default_rng([seed, year]).integers(0, 25)


def play(stands, seeds, years=2):
    """Records (years, stands, columns) under actions that belong to the seed, and the final state."""
    seeds = list(seeds)
    records = [stands.step(np.array([action_of(k, year) for k in seeds])) for year in range(years)]
    return np.array(records), stands.state.copy()


@pytest.fixture(scope="module")
def lockstep():
    return play(start(), range(NUMBER))


def difference(a, b):
    """Largest difference, relative to the larger of 1e-6 and the value; where one is NaN the other has to be."""
    assert np.array_equal(np.isnan(a), np.isnan(b))
    return np.nanmax(np.abs(a - b) / np.maximum(np.abs(b), 1e-6))


# ------------------------------------------------------------------------------------------ the two backends


@pytest.mark.parametrize(
    ("seed", "action"), [(0, 24), (1, 0), (2, 4), (4, 10)], ids=["burnt-planted", "thinned", "thinned-old", "mixed"]
)
def test_a_year_is_the_same_interpreted_and_compiled(seed, action):
    compiled = sim.Stands(1, time_step_minutes=MINUTES)
    begin(compiled, [seed])
    interpreted = sim.Stands(1, time_step_minutes=MINUTES, backend="python")
    interpreted.set_state(compiled.get_state())
    expected, expected_days = compiled.step(np.array([action]), daily=True)
    record, days = interpreted.step(np.array([action]), daily=True)
    residuals = [i for i, name in enumerate(sim.RECORD_NAMES) if "residual" in name]
    keep = np.delete(np.arange(len(sim.RECORD_NAMES)), residuals)
    assert difference(record[:, keep], expected[:, keep]) <= 1e-9
    assert difference(days, expected_days) <= 1e-9
    assert difference(interpreted.state, compiled.state) <= 1e-9


def test_a_world_in_balance_is_the_same_alone_in_lockstep_and_interpreted():
    everyone, alone = start(5, **BALANCED_WORLD), sim.Stands(1, time_step_minutes=MINUTES, **BALANCED_WORLD)
    begin(alone, [3])
    np.testing.assert_array_equal(alone.parameters[0], everyone.parameters[3])
    np.testing.assert_array_equal(alone.state[0], everyone.state[3])
    interpreted = sim.Stands(1, time_step_minutes=MINUTES, backend="python")
    interpreted.set_state(alone.get_state())
    expected = alone.step(np.array([24]))
    np.testing.assert_array_equal(everyone.step(np.full(5, 24))[3], expected[0])
    kept = [i for i, name in enumerate(sim.RECORD_NAMES) if "residual" not in name]
    assert difference(interpreted.step(np.array([24]))[:, kept], expected[:, kept]) <= 1e-9


def test_observed_weather_is_the_same_interpreted_and_compiled():
    days, steps = 40, 24 * 60 // MINUTES
    index = pd.date_range("2019-01-01", periods=days * steps, freq=f"{MINUTES}min")
    hour = index.hour.to_numpy()
    generator = np.random.default_rng(0)
    forcing = pd.DataFrame(
        {
            "air_temperature_c": 6.0 * np.sin(2.0 * np.pi * (hour - 9.0) / 24.0)
            + generator.normal(0.0, 3.0, len(index)),
            "relative_humidity": generator.uniform(0.3, 1.0, len(index)),
            "wind_speed_m_s": generator.uniform(0.0, 12.0, len(index)),
            "shortwave_w_m2": np.maximum(400.0 * np.sin(2.0 * np.pi * (hour - 6.0) / 24.0), 0.0),
            "longwave_w_m2": generator.uniform(180.0, 330.0, len(index)),
            "precipitation_mm": generator.exponential(0.3, len(index)),
        },
        index=index,
    )
    stand = sim.Stands(1, time_step_minutes=MINUTES)
    begin(stand, [2])
    observed = forcing.to_numpy()
    interpreted = sim.Stands(1, time_step_minutes=MINUTES, backend="python")
    interpreted.set_state(stand.get_state())
    expected, expected_days = stand.step(np.array([12]), observed=observed, days=days, daily=True)
    _, got = interpreted.step(np.array([12]), observed=observed, days=days, daily=True)
    assert difference(got, expected_days) <= 1e-9
    assert expected[0, sim.RECORD_NAMES.index("snowfall_mm")] > 10.0
    assert expected_days[0, :, DAILY_NAMES.index("gpp_kgc_m2")].sum() > 0.0


def test_the_interpreted_backend_steps_lanes_too():
    seeds = range(8)  # from eight stands on they are lanes of a block
    compiled = start(8, time_step_minutes=1440)
    interpreted = sim.Stands(8, time_step_minutes=1440, backend="python")
    interpreted.set_state(compiled.get_state())
    actions = np.array([action_of(k, 0) for k in seeds])
    assert difference(interpreted.step(actions), compiled.step(actions)) <= 1e-9


# --------------------------------------------------------------------------- one stand, lockstep, order, blocks


@pytest.mark.parametrize("seed", [0, 7, 15, 16, 18])
def test_one_stand_alone_equals_lockstep_to_the_bit(lockstep, seed):
    alone = sim.Stands(1, time_step_minutes=MINUTES)
    begin(alone, [seed])
    records, state = play(alone, [seed])
    np.testing.assert_array_equal(records[:, 0], lockstep[0][:, seed])
    np.testing.assert_array_equal(state[0], lockstep[1][seed])


@pytest.mark.parametrize("overcast", [False, True])
def test_night_at_one_latitude_is_the_same_beside_day_at_another(overcast):
    """Under a warm overcast sky a canopy gains longwave at night; it may not transpire because others have sun."""
    constants = {name: 1.0 for name in sim.CONSTANTS if name.startswith("cloud_")} if overcast else None
    sites = [
        sim.middle_site({"latitude_deg": float(deg), "mean_annual_temperature_c": 0.0, "diurnal_amplitude_c": 8.0})
        for deg in np.linspace(45.0, 72.0, 16)
    ]
    together = sim.Stands(16, time_step_minutes=60, constants=constants)
    together.start(np.arange(16), sites, [sim.episode_seeds(k) for k in range(16)])
    record = together.step(np.full(16, 12))
    alone = sim.Stands(1, time_step_minutes=60, constants=constants)
    for k in range(16):
        alone.start([0], [sites[k]], [sim.episode_seeds(k)])
        np.testing.assert_array_equal(alone.step(np.array([12]))[0], record[k], err_msg=f"stand {k}")


def test_the_test_stands_burn_thin_and_plant(lockstep):
    table = pd.DataFrame(lockstep[0].reshape(-1, len(sim.RECORD_NAMES)), columns=sim.RECORD_NAMES)
    for name in ("fire_mortality", "insect_mortality", "thinned_stems_ha", "planted_stems_ha"):
        assert (table[name] > 0.0).sum() >= 2, name


def test_the_order_of_stands_does_not_matter(lockstep):
    order = np.random.default_rng(3).permutation(NUMBER).tolist()
    stands = sim.Stands(NUMBER, time_step_minutes=MINUTES)
    begin(stands, order)
    records, state = play(stands, order)
    np.testing.assert_array_equal(records, lockstep[0][:, order])
    np.testing.assert_array_equal(state, lockstep[1][order])


@pytest.mark.parametrize(("threads", "lanes"), [(1, 16), (3, 8), (5, 4)])
def test_the_number_of_threads_does_not_matter(lockstep, threads, lanes):
    assert sim.Stands(NUMBER, threads=threads).lanes == lanes
    records, state = play(start(threads=threads), range(NUMBER))
    np.testing.assert_array_equal(records, lockstep[0])
    np.testing.assert_array_equal(state, lockstep[1])


@pytest.mark.parametrize(
    ("stands", "threads", "lanes"),
    [(1, 1, 1), (1, 8, 1), (2, 1, 4), (2, 2, 1), (7, 8, 1), (7, 2, 4), (8, 8, 4), (8, 2, 4), (8, 1, 8)]
    + [(9, 2, 8), (16, 2, 8), (17, 2, 16), (32, 2, 16), (128, 16, 8), (1000, 2, 16)],
)
def test_lanes_give_every_thread_its_share(stands, threads, lanes):
    assert block.lanes_for(stands, threads) == lanes
    assert sum(len(range(stands)[part]) for part in block.blocks(stands, lanes)) == stands


@pytest.mark.parametrize("parts", [((0, 3), (3, 19)), ((0, 17), (17, 19)), ((0, 9), (9, 18), (18, 19))], ids=str)
def test_block_boundaries_do_not_matter(lockstep, parts):
    stands = start()
    for year in range(2):
        for low, high in reversed(parts):
            which = np.arange(low, high)
            record = stands.step(np.array([action_of(k, year) for k in which]), stands=which)
            np.testing.assert_array_equal(record, lockstep[0][year, low:high])
    np.testing.assert_array_equal(stands.state, lockstep[1])


def test_starting_one_stand_anew_leaves_the_others_alone(lockstep):
    stands = start()
    first, _ = play(stands, range(NUMBER), years=1)
    stands.start([5], [sim.sample_site(99)], [sim.episode_seeds(99)])
    others = np.delete(np.arange(NUMBER), 5)
    record = stands.step(np.array([action_of(k, 1) for k in others]), stands=others)
    np.testing.assert_array_equal(record, lockstep[0][1, others])


# ---------------------------------------------------------------------------------------- seeds and resuming


def test_same_seed_same_bytes(lockstep):
    records, state = play(start(), range(NUMBER))
    assert records.tobytes() == lockstep[0].tobytes() and state.tobytes() == lockstep[1].tobytes()


def test_same_table_from_simulate():
    def table(seed):
        return sim.simulate({"q10": 2.0}, [24, 0], seed=seed, years=2, time_step_minutes=MINUTES)

    assert table(7).to_csv() == table(7).to_csv()
    assert table(7).to_csv() != table(8).to_csv()


@pytest.mark.parametrize("backend", ["numba", "python"])
def test_a_run_resumes_from_its_state(backend):
    number, minutes = (NUMBER, MINUTES) if backend == "numba" else (1, 1440)
    seeds = range(number)
    whole = start(number, time_step_minutes=minutes, backend=backend)
    play(whole, seeds, years=1)
    saved = pickle.dumps(whole.get_state())
    resumed = sim.Stands(number, time_step_minutes=minutes, backend=backend)
    resumed.set_state(pickle.loads(saved))
    np.testing.assert_array_equal(resumed.record, whole.record)
    assert resumed.seeds == whole.seeds
    assert resumed.years.tolist() == [1] * number
    for expected, got in zip(play(whole, seeds), play(resumed, seeds), strict=True):
        np.testing.assert_array_equal(got, expected)


def test_a_saved_state_does_not_change_as_the_run_goes_on():
    stands = start(2)
    saved = stands.get_state()
    before = pickle.dumps(saved)
    play(stands, range(2))
    assert pickle.dumps(saved) == before


def test_a_state_of_another_number_of_stands_is_refused():
    with pytest.raises(ValueError, match="2 stands given to 3"):
        sim.Stands(3).set_state(start(2).get_state())


# -------------------------------------------------------------------------------------------- the disk cache


def compiled_functions(dispatcher, found=None):
    """A compiled function and all that it calls."""
    found = set() if found is None else found
    if dispatcher not in found:
        found.add(dispatcher)
        source = dispatcher.py_func
        for name in source.__code__.co_names:
            if isinstance(source.__globals__.get(name), Dispatcher):
                compiled_functions(source.__globals__[name], found)
    return found


def test_threads_that_come_together_make_one_kernel(monkeypatch):
    """numba's cache folder is a setting of the process: two at once would write the kernel into the working folder."""
    made, both = [], threading.Barrier(2)

    def slow(function, name):
        made.append(name)
        time.sleep(0.1)
        return lambda *arguments: None

    monkeypatch.setattr(block, "_MADE", {})
    monkeypatch.setattr(block, "specialised", slow)
    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(lambda _: (both.wait(), kernel(16))[1], range(2))
    assert first is second and made == ["16_lanes"]


def test_kernels_for_other_numbers_of_lanes_have_no_name_in_common():
    """numba names compiled code by counters of the compiling process: cached by two processes, functions of one name
    would be taken for each other in a third that loads two kernels, and give zeros or a crash."""
    names = [{f.py_func.__qualname__ for f in compiled_functions(kernel(lanes))} for lanes in block.KERNELS]
    assert len(set.union(*names)) == sum(map(len, names)) > 50 * len(block.KERNELS)


def test_a_stand_that_has_not_been_started_is_refused():
    with pytest.raises(RuntimeError, match="stand 0 has not been started"):
        sim.Stands(1).step(np.array([12]))
