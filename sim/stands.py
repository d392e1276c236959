"""Stands stepped year by year: the Python side of the simulator.

Each stand is a row of five arrays (`ARRAYS`); a year's draws are made from its streams. A year copies up to
sixteen stands into the lanes of a block, calls the compiled kernel, and copies them back; blocks run on a pool of
threads. So any subset of stands can be stepped together, in any order, with the same bits; and stands that are alike in
all that a year depends on, as those of policies that have not parted yet, are simulated once.
"""

import os
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from numbers import Real

import numpy as np

from sim.block import BACKENDS, blocks, lanes_for, run_block
from sim.closure import check_closure
from sim.deadwood import deadwood_in_balance
from sim.demography import AGES, first_ages
from sim.draws import STREAMS, WORDS, Seeds, draw_slice, drawer, streams_of
from sim.management import NO_CHANGE, check_actions, first_cut_age
from sim.parameters import (
    SITE_PARAMETERS,
    brief,
    check_constants,
    check_mechanisms,
    check_name,
    check_noise,
    check_overrides,
    check_seed,
    check_site,
    check_weather,
    is_integer,
)
from sim.saved import check_array, check_keys
from sim.scenario import CO2, WITHOUT_SCENARIO, check_scenario
from sim.spin_up import (
    BOUNDARIES,
    BOUNDARY,
    DEADWOOD,
    INITIAL_RANGES,
    SOIL_CARBONS,
    SPIN_UP_STEPS_PER_DAY,
    SPIN_UP_YEARS,
    SPIN_UP_YEARS_OF_A_RECORD,
    boundary_in_balance,
    check_initial_ranges,
    check_stocks,
    climate_draws,
    deep_heat_limits,
    first_state,
    next_deep_heat,
    soil_carbon_in_balance,
)
from sim.state import (
    DAILY,
    DAYS,
    DRAWS_SIZE,
    FORCING,
    PARAMETER_NAMES,
    RECORD,
    RECORD_NAMES,
    STATE,
    STATE_NAMES,
    STATE_SIZE,
)

ARRAYS = ("parameters", "state", "record", "years", "streams")  # that `get_state` copies
SAVED = (*ARRAYS, "seeds")  # keys of `get_state`
DRAWN_AT_ONCE = 1024  # stands whose numbers a thread draws, where a GPU simulates them
LONGEST_STEP_MINUTES = 120  # beyond, the air is up to 2 K too warm
MOST_THREADS = 10_000  # so that a mistake of a thousandfold is named
MOST_STANDS = 10_000_000  # of 5 kB each
MOST_YEARS = 5_000


class Stands:
    """A number of stands, each with its own site, state and random streams.

    Parameters
    ----------
    number : stands.
    time_step_minutes : a divisor of a day's 1440 minutes, at most 120: with fewer steps the sun's warmth is misjudged.
    backend : "numba", "python" (the same source, interpreted), or "cuda" (on a GPU, see `sim.cuda`).
    constants : literature constants to override, name -> value (see `sim/constants.csv`).
    mechanisms : switches, name -> bool (see `sim.parameters.MECHANISMS`).
    weather : of the generator: "paper", or "observed", with the daily variability of the records.
    boundary : the fixed temperature below: "sampled", the site's, or "balanced", the one at which no heat flows through
        it below the first stand, whatever the site's (`parameters` have it from `start` on).
    soil_carbon : first soil carbon: "drawn", or "balanced", what the first stand's litter keeps up, where it is not
        given.
    scenario : climate change, year by year from the start on: None, a name of `sim.SCENARIOS`, or a path of your own
        (see `sim.scenario.check_scenario`). Spin-up is without it, and so is the boundary.
    hwp_half_life_years : half-life of wood products; None keeps them for ever, as the paper does.
    harvest_min_class : youngest age class that thinning may cut: "young", "mature" or "old".
    threads : threads for more than one block; None is one a core.

    Raises ValueError for a bad argument, `PhysicsError` from `step` when a balance does not close.
    """

    def __init__(
        self,
        number,
        *,
        time_step_minutes=30,
        backend="numba",
        constants=None,
        mechanisms=None,
        weather="paper",
        boundary="sampled",
        soil_carbon="drawn",
        scenario=None,
        hwp_half_life_years=None,
        harvest_min_class="young",
        threads=None,
    ):
        self.number = positive_integer("number of stands", number)
        if self.number > MOST_STANDS:
            raise ValueError(f"number of stands: at most {MOST_STANDS:,} are allowed at once, got {self.number:,}")
        minutes = positive_integer("time_step_minutes", time_step_minutes)
        if 1440 % minutes or minutes > LONGEST_STEP_MINUTES:
            raise ValueError(
                f"time_step_minutes = {minutes}: a divisor of 1440 is allowed, such as 10, 15, 30, 60, and at most "
                f"{LONGEST_STEP_MINUTES}"
            )
        if backend not in BACKENDS:
            raise ValueError(f"backend {backend!r}: allowed are {', '.join(BACKENDS)}")
        self.steps_per_day = 1440 // minutes
        self.backend = backend
        self.constants = check_constants(constants)
        self.mechanisms = check_mechanisms(mechanisms)
        self.weather = check_weather(weather)
        self.boundary = check_name("boundary", boundary, BOUNDARIES)
        self.soil_carbon = check_name("soil_carbon", soil_carbon, SOIL_CARBONS)
        self.scenario = check_scenario(scenario)
        if self.scenario is not None and CO2 in self.scenario.names and CO2 in (constants or {}):
            raise ValueError(f"constants: {CO2} follows the scenario; a value of your own is not allowed")
        self.harvest_min_class, self.hwp_half_life_years = harvest_min_class, hwp_half_life_years
        self.first_cut_age = first_cut_age(harvest_min_class, self.constants)
        self.products_decay = yearly_decay(hwp_half_life_years)
        self.threads = check_threads(threads)
        self.lanes = lanes_for(self.number, self.threads)
        self._run_block: Callable = partial(run_block, self.lanes, backend=backend)
        if backend == "cuda":
            from sim import cuda  # only where it is wanted: it needs an extra

            cuda.check_gpu()
            self.lanes = cuda.STANDS
            self._run_block = cuda.run_stands
        self._pool: ThreadPoolExecutor | None = None
        self._pool_of = os.getpid()

        self.parameters = np.zeros((self.number, len(PARAMETER_NAMES)))
        self.state = np.zeros((self.number, STATE_SIZE))
        self.record = np.zeros((self.number, len(RECORD)))
        self.seeds: list[Seeds | None] = [None] * self.number
        self.years = np.zeros(self.number, dtype=int)
        self.streams = np.zeros((self.number, len(STREAMS), WORDS), dtype=np.uint64)

    def start(self, stands, sites, seeds, initial=None, initial_ranges=None, observed=None) -> None:
        """Put stands at the beginning of an episode: draw their first state and spin it up.

        stands : indices; sites : for each, its parameters by name; seeds : for each, its `Seeds`;
        initial : position in `stands` -> dict of first stocks by record name, each checked for itself (that they go
        together `simulate` and the environment see to); initial_ranges : ranges that the first
        stocks are drawn from, name -> (low, high), instead of `sim.spin_up.INITIAL_RANGES`; observed : a year's
        forcing to spin up with, instead of generated weather (a part of a year is not used).
        """
        stands = self._indices(stands)
        ranges = {**INITIAL_RANGES, **check_initial_ranges(initial_ranges)}
        given = self._given(initial, len(stands))
        for what, values in (("sites", sites), ("seeds", seeds)):
            number = len(values) if hasattr(values, "__len__") else 0
            if number != len(stands):
                raise ValueError(f"{what}: a list of one for each of {len(stands)} stands is allowed, got {number}")
        for site, its_seeds in zip(sites, seeds, strict=True):
            check_site(site)
            check_noise({**site, **self.constants, **self.weather})
            check_seeds("seeds", its_seeds)
        if observed is not None:
            check_observed(observed, len(observed) if np.ndim(observed) else 0)
        for k, stand in enumerate(stands):
            self.seeds[stand] = seeds[k]
            self.years[stand] = 0
            self.streams[stand] = streams_of(seeds[k])
        # of stands that begin alike, the first is spun up, for all of them
        first: dict[tuple, int] = {}
        alike = [
            first.setdefault((tuple(sites[k].items()), seeds[k].start, tuple(given[k].items())), k)
            for k in range(len(stands))
        ]
        spun_up = list(first.values())
        for k in spun_up:
            values = {**sites[k], **self.constants, **self.mechanisms, **self.weather, **WITHOUT_SCENARIO}
            self.parameters[stands[k]] = [values[name] for name in PARAMETER_NAMES]
            generator = np.random.default_rng(seeds[k].start)
            self.state[stands[k]] = first_state(values, generator, given[k], ranges)
        whole_year = observed is not None and len(observed) == DAYS * self.steps_per_day
        found = np.array([[f"{name}_kgc_m2" not in given[k] for name in DEADWOOD] for k in spun_up])
        last_year = self._spin_up(stands[spun_up], found, observed if whole_year else None)
        if self.soil_carbon == "balanced":
            drawn = [i for i, k in enumerate(spun_up) if "soil_kgc_m2" not in given[k]]
            if drawn:
                self._balance_soil_carbon(stands[spun_up][drawn], last_year[drawn])
        for rows in (self.parameters, self.state):
            rows[stands] = rows[stands[alike]]

    def _balance_soil_carbon(self, stands, record) -> None:
        """First soil carbon that the litter keeps up; as drawn where there are no trees. record : of a year."""
        column = STATE_NAMES.index("soil_carbon")
        stocks = self.stocks(stands)
        names = ("soil_change_kgc_m2", "heterotrophic_respiration_kgc_m2", "deadwood_respiration_kgc_m2")
        change, respired, by_wood = (record[:, RECORD_NAMES.index(name)] for name in names)
        balanced = soil_carbon_in_balance(stocks["soil_kgc_m2"], change, respired - by_wood)
        trees = stocks["density_stems_ha"] > 0.0
        self.state[stands, column] = np.where(trees, balanced, stocks["soil_kgc_m2"])

    def _spin_up(self, stands, deadwood_found, observed=None) -> np.ndarray:
        """Bring soil, snow and water, and the boundary if it is to be, into balance, with the stand held as it is.

        deadwood_found : bool (stands, species), whose dead wood is to be what the stand's deaths keep up.
        Returns the last year's record.
        """
        first = self.state[stands].copy()
        deep, surface = STATE_NAMES.index("deep_heat"), RECORD_NAMES.index("surface_soil_temperature_c")
        deep_mean, boundary = RECORD_NAMES.index("deep_soil_temperature_c"), PARAMETER_NAMES.index(BOUNDARY)
        wood = [STATE_NAMES.index(name) for name in DEADWOOD]
        died, decayed = (
            [RECORD_NAMES.index(f"{name}_{flux}_kgc_m2") for name in DEADWOOD] for flux in ("input", "decay")
        )
        living = self.stocks(stands)["density_stems_ha"] > 0.0
        draws = np.zeros((len(stands), DRAWS_SIZE))
        for name, values in climate_draws(
            self.weather["weather_as_observed"], self.constants["temperature_persistence"]
        ).items():
            draws[:, draw_slice(name)] = values
        nothing = np.full(len(stands), NO_CHANGE)
        steps = self.steps_per_day if observed is not None else min(self.steps_per_day, SPIN_UP_STEPS_PER_DAY)
        heat_before = gain_before = None
        for year in range(SPIN_UP_YEARS if observed is None else SPIN_UP_YEARS_OF_A_RECORD):
            heat = self.state[stands, deep].copy()
            state, record = self._run(stands, draws, nothing, observed, steps_per_day=steps)
            self._check(stands, self.parameters[stands], state, record, "spin-up")
            balanced = deadwood_in_balance(first[:, wood], record[:, died], record[:, decayed])
            first[:, wood] = np.where(deadwood_found, balanced * living[:, None], first[:, wood])
            state[:, HELD_COLUMNS] = first[:, HELD_COLUMNS]
            gain = state[:, deep] - heat
            if year > 0:  # the first year only lays the snow
                sites = [dict(zip(PARAMETER_NAMES, self.parameters[stand], strict=True)) for stand in stands]
                limits = [deep_heat_limits(*pair) for pair in zip(sites, record[:, surface], strict=True)]
                state[:, deep] = next_deep_heat(heat, gain, heat_before, gain_before, np.array(limits))
                heat_before, gain_before = heat, gain
                if self.boundary == "balanced":
                    years = zip(sites, record[:, deep_mean], heat + 0.5 * gain, state[:, deep], strict=True)
                    self.parameters[stands, boundary] = [boundary_in_balance(*each) for each in years]
            self.state[stands] = state
        if self.boundary == "balanced":
            allowed, found = SITE_PARAMETERS[BOUNDARY], self.parameters[stands, boundary]
            beyond = stands[(found <= allowed.physical_low) | (found >= allowed.physical_high)]
            if len(beyond):
                ends = f"[{allowed.physical_low:g}, {allowed.physical_high:g}] K, so heat flows through it"
                warnings.warn(f"boundary='balanced': stand {beyond[0]} would need one outside of {ends}", stacklevel=4)
        return record

    def step(self, actions, stands=None, observed=None, days=DAYS, daily=False):
        """Advance stands by a year under the given actions.

        actions : integers in [0, 25), one a stand; stands : indices, all by default; observed : forcing
        (days x steps a day, 6) for all stands, or None; days : fewer than 365 for a partial forcing, of which the daily
        output is right, and the record of no use: it divides by 365, and deaths and recruits are a whole year's.
        Returns the annual record, shape (stands, columns of `RECORD_NAMES`); with `daily`, also the daily output,
        shape (stands, days, columns of `sim.state.DAILY`).
        """
        stands = np.arange(self.number) if stands is None else self._indices(stands)
        for stand in stands:
            if self.seeds[stand] is None:
                raise RuntimeError(f"stand {stand} has not been started")
        actions = check_actions(actions, len(stands))
        if positive_integer("days", days) > DAYS:
            raise ValueError(f"days = {days}: at most {DAYS} are allowed")
        if observed is not None:
            check_observed(observed, days * self.steps_per_day)
        parameters = self.parameters_of_year(stands)
        once, alike = self._alike(stands, actions, parameters)
        rows = np.empty((len(once), days, len(DAILY))) if daily else None
        streams = self.streams[stands[once]]
        state, record = self._run(
            stands[once], None, actions[once], observed, days, rows, parameters=parameters[once], streams=streams
        )
        self._check(stands[once], parameters[once], state, record, "year")
        if len(once) < len(stands):
            streams, state, record = streams[alike], state[alike], record[alike]
            rows = None if rows is None else rows[alike]
        self.streams[stands] = streams
        self.state[stands] = state
        self.record[stands] = record
        self.years[stands] += 1
        return (record, rows) if daily else record

    def _alike(self, stands, actions, parameters) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the first of stands that are alike in all that the year depends on; for each stand, its place
        among them."""
        each = np.arange(len(stands))
        keys: list[tuple] = list(zip(actions.tolist(), map(bytes, self.streams[stands]), strict=True))
        # the dearer, of those alone that are alike so far
        for more in (lambda k: parameters[k].tobytes(), lambda k: self.state[stands[k]].tobytes()):
            if len(set(keys)) == len(keys):
                return each, each
            number = Counter(keys)
            keys = [(*key, more(k)) if number[key] > 1 else key for k, key in enumerate(keys)]
        first: dict[tuple, int] = {}
        for k, key in enumerate(keys):
            each[k] = first.setdefault(key, k)
        return np.unique(each, return_inverse=True)

    def parameters_of_year(self, stands) -> np.ndarray:
        """`parameters` of stands (stands, fields), with what a scenario makes of the year to come."""
        parameters = self.parameters[stands]
        if self.scenario is not None:
            self.scenario.check_years(int(self.years[stands].max()) + 1)
            columns = [PARAMETER_NAMES.index(name) for name in self.scenario.names]
            parameters[:, columns] = self.scenario.values[self.years[stands]]
        return parameters

    def stocks(self, stands) -> dict[str, np.ndarray]:
        """Stems and carbon of stands now, by record name, shape (stands,); `age_classes` has shape (stands, 10)."""
        state = self.state[stands]
        stems = state[:, len(STATE) :].reshape(len(state), 2, AGES)
        classes = np.add.reduceat(stems, first_ages(self.constants)[:-1], axis=2).reshape(len(state), -1)
        density = stems.sum(axis=(1, 2))
        conifers = stems[:, 0].sum(axis=1)

        def column(name):
            return state[:, STATE_NAMES.index(name)]

        return {
            "density_stems_ha": density,
            "conifer_fraction": np.where(density > 0.0, conifers / np.where(density > 0.0, density, 1.0), 0.0),
            "biomass_kgc_m2": column("conifer_biomass") + column("deciduous_biomass"),
            "soil_kgc_m2": column("soil_carbon").copy(),
            "deadwood_kgc_m2": column("conifer_deadwood") + column("deciduous_deadwood"),
            "age_classes": classes,
        }

    def get_state(self) -> dict:
        """Everything that the future depends on, as a picklable dict."""
        return {
            **{name: getattr(self, name).copy() for name in ARRAYS},
            "seeds": list(self.seeds),
        }

    def check_state(self, state: dict) -> None:
        """ValueError for what is no `get_state` of as many stands."""
        what = "state of stands"
        check_keys(what, state, SAVED)
        if np.shape(state["years"]) != self.years.shape:
            raise ValueError(f"state of {np.size(state['years'])} stands given to {self.number}")
        for name in ARRAYS:
            low, high = (0, MOST_YEARS) if name == "years" else (-np.inf, np.inf)  # any bits are a stream's
            check_array(f"{what}: {name}", state[name], getattr(self, name), low, high)
        names = [*STATE_NAMES, *["stems"] * (STATE_SIZE - len(STATE_NAMES))]
        signed = [name in STATE and STATE[name][0] in ("degC", "J m-2") for name in names]
        wrong = np.argwhere((state["state"] < 0.0) & ~np.array(signed))
        if wrong.size:
            stand, column = wrong[0]
            value = state["state"][stand, column]
            raise ValueError(f"{what}: {names[column]}: 0 or more is allowed, got {value:g} in stand {stand}")
        if not isinstance(state["seeds"], list) or len(state["seeds"]) != self.number:
            raise ValueError(f"{what}: seeds: a list of {self.number} is allowed, got {brief(state['seeds'])}")
        for seeds, row, streams in zip(state["seeds"], state["parameters"], state["streams"], strict=True):
            if seeds is None:  # not started yet
                continue
            check_seeds(f"{what}: seeds", seeds)
            if not all(streams[:, -1] & np.uint64(1)):
                raise ValueError(f"{what}: streams: a PCG64's increment is odd, got {streams[:, -1].tolist()}")
            values = dict(zip(PARAMETER_NAMES, row.tolist(), strict=True))
            check_overrides({name: values[name] for name in SITE_PARAMETERS})
            check_constants({name: values[name] for name in self.constants})
            check_noise(values)

    def set_state(self, state: dict) -> None:
        """Continue from a `get_state` of as many stands; ValueError, and nothing done, for what is none.

        Constants, mechanisms and weather are the state's from then on, all else is as these stands have it.
        """
        self.check_state(state)
        for name in ARRAYS:
            setattr(self, name, state[name].copy())
        self.seeds = list(state["seeds"])

    def settings(self) -> dict:
        """The arguments, as plain values, by which an environment tells whether a state is its own."""
        scenario = self.scenario and {"names": self.scenario.names, "values": self.scenario.values.tolist()}
        return {
            "time_step_minutes": 1440 // self.steps_per_day,
            "constants": dict(self.constants),
            "mechanisms": dict(self.mechanisms),
            "weather": dict(self.weather),
            "boundary": self.boundary,
            "soil_carbon": self.soil_carbon,
            "scenario": scenario,
            "hwp_half_life_years": self.hwp_half_life_years,
            "harvest_min_class": self.harvest_min_class,
        }

    def _run(
        self,
        stands,
        draws,
        actions,
        observed=None,
        days=DAYS,
        daily=None,
        steps_per_day=None,
        parameters=None,
        streams=None,
    ):
        """The new states and records of a year: (stands, fields) each.

        draws : of the year, (stands, fields), or None to draw them from `streams`, each thread those of its stands;
        parameters : of the year, (stands, fields), or None for those without a scenario;
        streams : (stands, streams, words), left after what is drawn.
        """
        parameters = self.parameters[stands] if parameters is None else parameters
        state = np.empty((len(stands), STATE_SIZE))
        record = np.empty((len(stands), len(RECORD)))

        def run(chunk):
            rows = None if daily is None else daily[chunk]
            drawn = self._draw(streams[chunk]) if draws is None else draws[chunk]
            state[chunk], record[chunk] = self._run_block(
                parameters[chunk],
                self.state[stands[chunk]],
                drawn,
                actions[chunk],
                observed,
                days,
                rows,
                steps_per_day=steps_per_day or self.steps_per_day,
                first_cut_age=self.first_cut_age,
                products_decay=self.products_decay,
            )

        chunks = blocks(len(stands), self.lanes)
        if min(len(chunks), self.threads) == 1 or self.backend != "numba":
            for chunk in chunks:
                run(chunk)
        else:
            list(self._threads().map(run, chunks))
        return state, record

    def _indices(self, stands) -> np.ndarray:
        """Indices of stands, (n,). Raises ValueError for others, and for one that is there twice."""
        found = np.atleast_1d(np.asarray(stands))
        known = found.dtype.kind in "iu" and found.ndim == 1
        if not known or (found < 0).any() or (found >= self.number).any() or len(set(found.tolist())) < len(found):
            raise ValueError(f"stands: indices in [0, {self.number}), each once, are allowed, got {brief(stands)}")
        return found

    def _given(self, initial, number: int) -> list[dict]:
        """First stocks of so many stands. Raises ValueError for those of another, and for bad ones."""
        for position in initial or {}:
            if position not in range(number):
                raise ValueError(f"initial: positions in [0, {number}) are allowed, got {position!r}")
        return [check_stocks((initial or {}).get(k)) for k in range(number)]

    def _draw(self, streams) -> np.ndarray:
        """The random numbers of a year, (stands, fields), from the stands' streams, which are left after them."""
        draws = np.empty((len(streams), DRAWS_SIZE))
        draw = drawer(self.backend)
        parts = blocks(len(streams), DRAWN_AT_ONCE)
        if len(parts) == 1:
            draw(streams, draws)
        else:
            list(self._threads().map(lambda part: draw(streams[part], draws[part]), parts))
        return draws

    def _threads(self) -> ThreadPoolExecutor:
        """The threads, which wait where there is nothing to do; a forked process has none of its parent's."""
        if self._pool is None or self._pool_of != os.getpid():
            self._pool = ThreadPoolExecutor(self.threads, thread_name_prefix="stands")
            self._pool_of = os.getpid()
        return self._pool

    def close(self) -> None:
        """End the threads, which wait for work; another step begins them anew."""
        if self._pool is not None and self._pool_of == os.getpid():
            self._pool.shutdown()
        self._pool = None

    def __getstate__(self) -> dict:
        """What a copy has, or another process: all but the threads."""
        return self.__dict__ | {"_pool": None}

    def _check(self, stands, parameters, state, record, what) -> None:
        def describe(k):
            return f"{what} {self.years[stands[k]]} of stand {stands[k]}, {self.seeds[stands[k]]}"

        check_closure(state, record, parameters, describe)


#: Stocks that spin-up leaves as they were drawn, but for dead wood, which it finds.
HELD_IN_SPIN_UP = (
    "conifer_biomass",
    "deciduous_biomass",
    "soil_carbon",
    *DEADWOOD,
    "products",
    "organic_depth",
    "drought",
)

#: Columns of the state that a stand which is held keeps: these stocks, and the stems by age.
HELD_COLUMNS = [STATE_NAMES.index(name) for name in HELD_IN_SPIN_UP] + list(range(len(STATE), STATE_SIZE))


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def yearly_decay(half_life_years) -> float:
    """Share of wood products lost in a year; None is a half-life without end."""
    if half_life_years is None:
        return 0.0
    number = isinstance(half_life_years, Real) and not isinstance(half_life_years, (bool, np.bool_, np.timedelta64))
    if not number or not 0.1 <= half_life_years <= 1e4:
        raise ValueError(f"hwp_half_life_years: None or a number in [0.1, 10000] is allowed, got {half_life_years!r}")
    return 1.0 - 0.5 ** (1.0 / half_life_years)


def check_seeds(name: str, seeds) -> None:
    """Raise ValueError for what is no `Seeds` of seeds."""
    if not isinstance(seeds, Seeds):
        raise ValueError(f"{name}: sim.Seeds are allowed, as sim.episode_seeds gives them, got {brief(seeds)}")
    for stream, seed in seeds._asdict().items():
        check_seed(f"{name}: {stream}", seed)


def positive_integer(name, value) -> int:
    """A count that was given. Raises ValueError naming it."""
    if not is_integer(value) or value < 1:
        raise ValueError(f"{name}: a positive integer is allowed, got {value!r}")
    return int(value)


def check_observed(observed, steps: int) -> None:
    """Raise ValueError for what is no forcing of so many steps."""
    values = np.asarray(observed)
    if values.shape != (steps, len(FORCING)):
        raise ValueError(f"observed: numbers of shape {(steps, len(FORCING))} are allowed, got shape {values.shape}")
    if values.dtype.kind != "f" or not np.isfinite(values).all():
        raise ValueError(f"observed: finite floats are allowed, got {brief(observed)} of type {values.dtype}")


def check_threads(threads) -> int:
    """How many threads: one a core for None, else as many as were given. Raises ValueError for what no machine has."""
    if threads is None:
        return available_cores()
    if positive_integer("threads", threads) > MOST_THREADS:
        raise ValueError(f"threads: at most {MOST_THREADS} are allowed, got {threads}")
    return int(threads)
