"""Many sites at once: a table or a grid of sites, in lockstep on all cores or on a Ray cluster, into one zarr store.

The table is played in chunks, each as `Episodes` of the environment, so that a stand of a region gives the bits that
it gives alone. A chunk is written when it is finished: what is killed goes on there, to the same bytes.
"""

import difflib
import hashlib
import inspect
import json
import math
import os
import re
import shutil
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd

import sim
from sim.block import compiling, is_compiled, lanes_for
from sim.executor import HERE, each
from sim.management import NUM_ACTIONS, as_array, check_actions
from sim.parameters import check_name, check_seed
from sim.spin_up import BOUNDARY, CLASS_NAMES, INITIAL_LIMITS, LARGEST_STEM_KGC, check_initial
from sim.stands import check_threads
from sim.state import RECORD
from sim.task.actions import NO_CHANGE
from sim.task.episodes import ARGUMENTS, DEFAULT_YEARS, Episodes
from sim.task.preference import check_weights

try:
    import fcntl
except ImportError:  # Windows, where a store is not locked
    fcntl = None  # type: ignore[assignment]

#: What is kept of the annual record, where nothing else is asked for.
VARIABLES = (
    "density_stems_ha",
    "conifer_fraction",
    "planted_stems_ha",
    "thinned_stems_ha",
    "biomass_kgc_m2",
    "soil_kgc_m2",
    "net_carbon_change_kgc_m2",
    "active_layer_depth_m",
    "deep_soil_temperature_c",
    "boundary_warming_mj_m2",
    "boundary_cooling_mj_m2",
    "peak_snow_depth_m",
    "fire_mortality",
)
OTHERS = ("middle", "sampled")

#: Arguments of an environment that a table of sites leaves no room for.
NOT_OF_MANY = ("mode", "years", "site_seed", "fixed_preference", "parameter_overrides", "record_years")

#: Arguments of the world that a policy was trained in, and may have to be told again.
WORLD = ("weather", "boundary", "soil_carbon", "scenario")

PROBES = 256
CHUNK_STAND_YEARS, LARGEST_CHUNK = 51_200, 4096  # a chunk: half a minute on two cores, and 0.2 GB
TELL_SECONDS = 10.0

LATITUDE, LONGITUDE, SEED = "latitude_deg", "longitude_deg", "seed"
DENSITY, BIOMASS = "density_stems_ha", "biomass_kgc_m2"
#: Columns that a table of sites may have: name -> (low, high, unit).
COLUMNS = {
    **{name: (p.physical_low, p.physical_high, p.unit) for name, p in sim.SITE_PARAMETERS.items()},
    **{name: (low, high, "") for name, (low, high) in INITIAL_LIMITS.items()},
    LONGITUDE: (-180.0, 360.0, "degE"),
    SEED: (0, 2**63 - 1, ""),
}


def simulate_many(
    sites,
    actions=NO_CHANGE,
    *,
    path=None,
    years: int = DEFAULT_YEARS,
    seed: int = 0,
    others: str = "middle",
    preference=0.5,
    variables=VARIABLES,
    label: str | None = None,
    overwrite: bool = False,
    threads: int | None = None,
    address: str = HERE,
    progress: bool = True,
    **arguments,
):
    """Simulate a stand on each of many sites; needs xarray and zarr (`pip install -e ".[region]"`).

    Parameters
    ----------
    sites : DataFrame, a row a site: `latitude_deg`, and any other site parameters (`sim/site_parameters.csv`), first
        stocks (as `initial` of `sim.simulate`), `longitude_deg` and `seed` as further columns. `sim.sites_on_grid`
        makes one of a latitude-longitude grid.
    actions : integer in [0, 25) for every year (12 changes nothing); a yearly plan, shape (years,), or one for each
        site, shape (sites, years); or a policy: a function of observations (n, d) and valid actions (n, 25), and of
        accrued returns (n, objectives) if it asks for a third, which gives actions (n,) or their probabilities (n, 25),
        of which the largest is taken. It has no memory. One of `cleanrl_style.protocol.load_policy` is such.
    path : zarr store to write; the same command goes on where it was killed. None keeps everything in memory.
    seed : of first state, weather and disturbances of row k is seed + k, unless the table has a column `seed`.
    others : site parameters that the table lacks: "middle" of their ranges, or "sampled" as an episode samples them.
    preference : that a policy observes, a number or weights.
    variables : columns of the annual record to keep; the rewards, `carbon_reward` and so on, are among them.
    label : what the store says of the actions (None: the plan, or the policy's name and a hash of what it does). A
        store of another label is not gone on with.
    overwrite : start over where `path` holds another simulation.
    threads : of this process (None: one a core). address : "none", this process; "local", Ray on this machine; else of
        a Ray cluster, see `sim.executor.each`.
    progress : whether a line every ten seconds says how far it is.
    arguments : of `boreal_env.BorealEnv`, such as weather, boundary, soil_carbon, scenario, constants.

    Returns
    -------
    xarray.Dataset of `variables` (stand, year), float32, with units, `action`, and the table's columns as coordinates;
    read from the store as it is used. Its bytes hang neither on threads nor on address.

    Raises
    ------
    ValueError naming row, column, value and what is allowed; `sim.PhysicsError` if a balance does not close.
    """
    for package in ("xarray", "zarr"):
        if find_spec(package) is None:
            raise ValueError(f'simulate_many needs {package}: pip install -e ".[region]"')
    table = check_sites(sites, others, seed)
    one = check_world(years, threads, arguments, table)
    chosen, label = check_choice(actions, label, len(table), one)
    tell_of_training(actions, arguments)
    size = chunk_size(len(table), one.years)
    plan = Plan(
        table=table,
        actions=chosen,
        years=one.years,
        weights=check_weights(preference, len(one.objective_names)),
        others=others,
        variables=check_variables(variables, one.history_names),
        arguments=arguments,
        size=size,
        threads=check_threads(threads) if address == HERE else 1,
    )
    with Store(path, plan, label, overwrite) as store:
        lanes = lanes_for(size, plan.threads)
        if progress and store.waiting and one.stands.backend == "numba" and not is_compiled(lanes):
            print(compiling(lanes), flush=True)
        tell = Progress(plan, store.waiting) if progress else None
        parts = (plan.part(k) for k in store.waiting)
        for number, played in each(play, parts, workers=1 if address == HERE else None, address=address):
            store.write(store.waiting[number], played)
            if tell:
                tell(store.waiting[number])
        return store.dataset()


# ---------------------------------------------------------------------------------------------------------------
# What is simulated
# ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Plan:
    """A checked simulation, or a chunk of one."""

    table: pd.DataFrame
    actions: Any  # a policy, or integers (sites, years)
    years: int
    weights: np.ndarray
    others: str
    variables: tuple[str, ...]
    arguments: dict
    size: int  # sites of a chunk
    threads: int

    @property
    def chunks(self) -> int:
        """How many there are."""
        return math.ceil(len(self.table) / self.size)

    def rows(self, k: int) -> slice:
        """Sites of chunk k."""
        return slice(k * self.size, min((k + 1) * self.size, len(self.table)))

    def part(self, k: int) -> "Plan":
        """Chunk k alone."""
        actions = self.actions if callable(self.actions) else self.actions[self.rows(k)]
        return Plan(**{**vars(self), "table": self.table.iloc[self.rows(k)], "actions": actions})


def play(part: Plan) -> dict[str, np.ndarray]:
    """A chunk from its first to its last year: `action`, int8, and the variables, float32, (sites, years) each."""
    number = len(part.table)
    episodes = Episodes(number, threads=part.threads, years=part.years, **part.arguments)
    given = part.table.to_dict("records")
    sites = [{name: row[name] for name in row if name in sim.SITE_PARAMETERS} for row in given]
    if part.others == "middle":
        sites = [sim.middle_site(site) for site in sites]
    initial = {k: {name: row[name] for name in row if name in INITIAL_LIMITS} for k, row in enumerate(given)}
    draws = [(row[SEED], row[SEED], part.weights) for row in given]
    episodes.begin(np.arange(number), draws, [part.weights] * number, sites, initial)
    taken = np.empty((number, part.years), np.int8)
    returns = np.zeros((number, len(part.weights)))
    for year in range(part.years):
        if callable(part.actions):
            taken[:, year] = choose(part.actions, episodes.observations(), episodes.action_masks(), returns)
        else:
            taken[:, year] = part.actions[:, year]
        try:
            returns += episodes.advance(taken[:, year])
        except sim.PhysicsError as error:
            error.add_note(f"stand 0 of this message is row {part.table.index[0]} of the sites")
            raise
    columns = [episodes.history_names.index(name) for name in part.variables]
    values = episodes.history[:, :, columns].astype(np.float32)
    return {name: values[:, :, k] for k, name in enumerate(part.variables)} | {"action": taken}


def choose(policy: Callable, observations: np.ndarray, masks: np.ndarray, returns: np.ndarray) -> np.ndarray:
    """A policy's actions (n,); ValueError if it gives something else."""
    third = [returns.copy()] if asks_for_returns(policy) else []
    answer = np.asarray(policy(observations, masks, *third))
    if answer.shape == masks.shape:
        if not np.isfinite(answer).all():
            raise ValueError("policy: finite probabilities of actions are allowed, got NaN or infinity")
        return answer.argmax(axis=1)
    return check_actions(answer, len(masks))


def asks_for_returns(policy: Callable) -> bool:
    """Whether a policy has a third argument that it cannot do without."""
    by_place = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    arguments = inspect.signature(policy).parameters.values()
    return sum(one.kind in by_place and one.default is one.empty for one in arguments) > 2


class Progress:
    """A line every ten seconds that says how far it is."""

    def __init__(self, plan: Plan, waiting: list[int]):
        self.plan, self.begun, self.told = plan, time.monotonic(), -math.inf
        self.left = sum(map(self._sites, waiting))
        self.first = self.left

    def _sites(self, k: int) -> int:
        rows = self.plan.rows(k)
        return rows.stop - rows.start

    def __call__(self, k: int) -> None:
        """Chunk k is done."""
        self.left -= self._sites(k)
        now = time.monotonic()
        if now - self.told < TELL_SECONDS and self.left:
            return
        self.told = now
        total, rate = len(self.plan.table), (self.first - self.left) / (now - self.begun)
        print(
            f"{total - self.left:,}/{total:,} stands, {rate * self.plan.years:,.0f} stand-years/s, "
            f"{self.left / rate / 60:.1f} min left",
            flush=True,
        )


def chunk_size(sites: int, years: int) -> int:
    """Sites of a chunk: all chunks but the last have as many, and the last hardly fewer."""
    most = min(max(CHUNK_STAND_YEARS // years, 16), LARGEST_CHUNK)
    return math.ceil(sites / math.ceil(sites / most))


# ---------------------------------------------------------------------------------------------------------------
# What is checked
# ---------------------------------------------------------------------------------------------------------------


def check_sites(sites, others: str, seed: int) -> pd.DataFrame:
    """A table of sites with a column `seed`; ValueError names row, column, value and what is allowed."""
    check_name("others", others, OTHERS)
    if not isinstance(sites, pd.DataFrame):
        raise ValueError(
            f"sites: a DataFrame with a row a site is allowed, got {type(sites).__name__}; sim.sites_on_grid makes one"
        )
    if not len(sites):
        raise ValueError("sites: the table has no row; at least one site is needed")
    for name in sites.columns:
        if name not in COLUMNS:
            begun = [column for column in COLUMNS if column.startswith(str(name).lower())]
            near = begun[:3] or difflib.get_close_matches(str(name).lower(), COLUMNS, n=3)
            raise ValueError(
                f"sites: unknown column {name!r}; "
                + (f"did you mean {', '.join(near)}? " if near else "")
                + "allowed are names of sim/site_parameters.csv, first stocks (initial= of sim.simulate), "
                f"{LONGITUDE} and {SEED}"
            )
    if not sites.columns.is_unique:
        raise ValueError(f"sites: column {sites.columns[sites.columns.duplicated()][0]!r} is there twice")
    if LATITUDE not in sites:
        raise ValueError(f"sites: column {LATITUDE} is missing; every site needs its latitude")
    table = pd.DataFrame({name: check_column(sites[name], *COLUMNS[name]) for name in sites.columns})
    check_initial({name: table[name].iloc[0] for name in table if name in INITIAL_LIMITS and name != BIOMASS})
    check_biomass(table, sites.index)
    if SEED not in table:
        last = check_seed("seed", seed) + len(table) - 1
        if last >= 2**63:
            raise ValueError(f"seed = {seed}: row k gets seed + k, so at most 2^63 - {len(table)} is allowed")
        table[SEED] = np.arange(seed, last + 1)
    return table.reset_index(drop=True)


def row_of(index: pd.Index, k: int) -> str:
    """Row k, as an error names it."""
    return f"zero-based row {k}" if index.equals(pd.RangeIndex(len(index))) else f"row {index[k]}"


def check_biomass(table: pd.DataFrame, index: pd.Index) -> None:
    """Refuse first biomass of no stems, or of more than `LARGEST_STEM_KGC` a stem."""
    by_class = [name for name in CLASS_NAMES if name in table]
    if BIOMASS not in table or not (by_class or DENSITY in table):
        return
    stems = table[by_class].sum(axis=1) if by_class else table[DENSITY]
    most = stems * LARGEST_STEM_KGC * 1e-4
    wrong = (table[BIOMASS] > most).to_numpy()
    if wrong.any():
        k = int(wrong.argmax())
        raise ValueError(
            f"sites: {row_of(index, k)}, column {BIOMASS} is {table[BIOMASS].iloc[k]:g}; of {stems.iloc[k]:g} stems/ha "
            f"at most {most.iloc[k]:.4g} kgC/m2 is allowed, {LARGEST_STEM_KGC:g} kgC a stem"
        )


def check_column(column: pd.Series, low: float, high: float, unit: str) -> np.ndarray:
    """The numbers of a column, all within its limits."""
    whole = column.name == SEED
    numbers = pd.to_numeric(column, errors="coerce")
    values = numbers.to_numpy(float, na_value=np.nan)
    wrong = ~((values >= low) & (values <= high))
    if whole:
        wrong |= values % 1 != 0
    if column.dtype.kind in "bc":  # truth values, complex numbers
        wrong[:] = True
    if wrong.any():
        k = int(wrong.argmax())
        value = "missing" if pd.isna(column.iloc[k]) else f"{column.iloc[k]}"
        kind = "an integer" if whole else "a number"
        raise ValueError(
            f"sites: {row_of(column.index, k)}, column {column.name} is {value}; "
            f"{kind} in [{low:g}, {high:g}]{f' {unit}' if unit not in ('', '1') else ''} is allowed"
        )
    return numbers.to_numpy(np.int64) if whole else values


def check_world(years: int, threads: int | None, arguments: dict, table: pd.DataFrame) -> Episodes:
    """One episode of the world that the arguments name, to ask it for names."""
    for name in arguments:
        if name not in ARGUMENTS or name in NOT_OF_MANY:
            allowed = (other for other in ARGUMENTS if other not in NOT_OF_MANY)
            raise ValueError(f"unknown argument {name!r}; allowed: {', '.join(allowed)}")
    for name, how in ((BOUNDARY, "boundary"), ("soil_kgc_m2", "soil_carbon")):
        if arguments.get(how) == "balanced" and name in table:
            raise ValueError(f"sites: column {name}: {how}='balanced' finds it; values of your own are not allowed")
    return Episodes(1, threads=threads, years=years, **arguments)


def tell_of_training(policy, arguments: dict) -> None:
    """Warn of a policy that was trained in a world of which the arguments say nothing."""
    env_id = getattr(policy, "env_id", None)
    trained = gym.registry[env_id].kwargs if env_id in gym.registry else {}
    unsaid = [f"{name}={trained[name]!r}" for name in WORLD if name in trained and name not in arguments]
    if unsaid:
        what = f"policy {policy.name!r} was trained with {', '.join(unsaid)}"
        warnings.warn(f"{what}; here the defaults are taken, unless you say others", stacklevel=3)


def check_choice(actions, label: str | None, sites: int, one: Episodes) -> tuple[Any, str]:
    """A policy, or actions (sites, years); and what the store says of them. one : an episode of their world."""
    if callable(actions):
        observed = len(one.observation_space.low)
        size = getattr(actions, "size", observed)
        if size != observed:
            raise ValueError(
                f"policy {getattr(actions, 'name', '')!r} is of another world: it observes {size} entries, here are "
                f"{observed}; give the arguments of its training, such as objectives and observation_groups"
            )
        try:
            inspect.signature(actions).bind(*range(2 + asks_for_returns(actions)))
        except TypeError as error:
            allowed = "a function of observations and valid actions, and of returns if it asks for them, is allowed"
            raise ValueError(f"policy: {allowed}; {error}") from None
        done = digest(choose(actions, *probes(one)).astype(np.int64))
        name = getattr(actions, "__qualname__", type(actions).__qualname__)
        return actions, label or f"{getattr(actions, '__module__', '')}.{name} {done}"
    if isinstance(actions, str):
        raise ValueError(f"actions {actions!r}: a policy is allowed, which cleanrl_style.protocol.load_policy loads")
    given = as_array(actions)
    if given.shape not in ((), (one.years,), (sites, one.years)):
        raise ValueError(
            f"actions of shape {given.shape}: an action, a plan of shape ({one.years},) or ({sites}, {one.years}), "
            "or a policy is allowed"
        )
    check_actions(given.ravel(), given.size)
    plans = np.broadcast_to(given.astype(np.int8), (sites, one.years))
    return plans, label or (str(given) if given.ndim == 0 else f"plan {digest(given.astype(np.int64))}")


def probes(one: Episodes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Observations, masks and returns, always the same, by which policies are told apart."""
    space = one.observation_space
    shares = np.random.default_rng(0).random((PROBES, len(space.low)), np.float32)
    observations = space.low + shares * (space.high - space.low)
    return observations, np.ones((PROBES, NUM_ACTIONS), bool), np.zeros((PROBES, len(one.objective_names)))


def check_variables(variables, names) -> tuple[str, ...]:
    """Columns of the annual record, each once."""
    if isinstance(variables, str) or not np.iterable(variables) or not len(tuple(variables)):
        raise ValueError(f"variables: a sequence of names is allowed, got {variables!r}")
    for name in variables:
        check_name("variable", name, names)
    return tuple(dict.fromkeys(variables))


def digest(*arrays: np.ndarray) -> str:
    """Hash of arrays."""
    found = hashlib.sha256()
    for values in arrays:
        found.update(repr(values.shape).encode() + np.ascontiguousarray(values).tobytes())
    return found.hexdigest()[:16]


def without_addresses(value) -> str:
    """What an argument is, in words that are the same in every process."""
    return re.sub(r" at 0x[0-9a-f]+", "", repr(value))


def simulator() -> str:
    """Hash of the simulator's source and tables."""
    found, folder = hashlib.sha256(), Path(sim.__file__).parent
    for path in sorted([*folder.rglob("*.py"), *folder.rglob("*.csv")]):
        found.update(path.read_bytes())
    return found.hexdigest()[:16]


# ---------------------------------------------------------------------------------------------------------------
# Where it goes
# ---------------------------------------------------------------------------------------------------------------


class Store:
    """A zarr store that is written chunk by chunk, and is there under its name when all are.

    Meanwhile `<path>.partial` has it, and a file for each chunk that is written. A context: it holds a lock meanwhile.
    """

    def __init__(self, path, plan: Plan, label: str, overwrite: bool):
        if path is not None and not (isinstance(path, (str, os.PathLike)) and Path(path).name):
            raise ValueError(f"path {path!r}: the name of a folder is allowed")
        if path is not None and Path(path).suffix in (".nc", ".csv"):
            raise ValueError(
                f"path {path}: a zarr store is written, such as region.zarr; `.to_netcdf` makes NetCDF of it"
            )
        self.plan = plan
        self.settings = {
            "simulator": simulator(),
            "sites": digest(*(plan.table[name].to_numpy() for name in plan.table)) + f", {len(plan.table)}",
            "columns": list(plan.table),
            "actions": label,
            "years": plan.years,
            "others": plan.others,
            "preference": plan.weights.tolist(),
            "variables": list(plan.variables),
            "arguments": {name: without_addresses(value) for name, value in sorted(plan.arguments.items())},
        }
        self.path: Any = None if path is None else Path(path)
        self.partial: Any = None if path is None else Path(path).with_name(Path(path).name + ".partial")
        self.overwrite = overwrite
        self.group: Any = None
        self.lock: Any = None
        self.waiting = list(range(plan.chunks))

    def __enter__(self) -> "Store":
        import zarr

        if self.path is None:
            self.group = self._create(zarr.storage.MemoryStore())
            return self
        data, written = self.partial / "data.zarr", self.partial / "written"
        if self.path.exists():
            there = settings_of(self.path)
            if not self.overwrite:
                self._compare(there)
                self.waiting = []
                if not data.exists():  # killed after its last act but one
                    shutil.rmtree(self.partial, ignore_errors=True)
                return self
        try:
            self.partial.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ValueError(f"path {self.path}: cannot write there ({error.strerror})") from error
        self.lock = locked(self.partial / "lock", self.path)
        try:
            if self.overwrite:
                for old in (written, self.path):
                    shutil.rmtree(old, ignore_errors=True)
            if written.exists():
                self._compare(settings_of(data))
                self.waiting = [k for k in self.waiting if not (written / str(k)).exists()]
                self.group = zarr.open_group(data, mode="r+")
            else:  # killed before it was whole, or new
                shutil.rmtree(data, ignore_errors=True)
                self.group = self._create(data)
                written.mkdir()
        except BaseException:
            self.lock.close()
            raise
        return self

    def __exit__(self, kind, error, trace) -> None:
        if self.lock is not None:
            if self.path.exists():
                shutil.rmtree(self.partial)
            self.lock.close()

    def _compare(self, there: dict) -> None:
        """Refuse to go on with another simulation."""
        for name, value in json.loads(json.dumps(self.settings)).items():
            if there.get(name) != value:
                raise ValueError(
                    f"{self.path} holds another simulation: {name} {there.get(name)} there, {value} now "
                    "(overwrite=True starts over)"
                )

    def _create(self, store):
        """An empty store with its coordinates."""
        import zarr

        plan, number = self.plan, len(self.plan.table)
        attributes = {
            "title": "Stands of the BoreaRL simulator, one a site",
            "settings": json.dumps(self.settings),
            "coordinates": " ".join(map(coordinate, plan.table)),
        }
        group = zarr.create_group(store, zarr_format=3, attributes=attributes)
        for name in plan.table:
            values = plan.table[name].to_numpy()
            units = {"units": COLUMNS[name][2]} if COLUMNS[name][2] else {}
            group.create_array(
                coordinate(name), data=values, chunks=(number,), dimension_names=("stand",), attributes=units
            )
        group.create_array("year", data=np.arange(plan.years), chunks=(plan.years,), dimension_names=("year",))
        for name in (*plan.variables, "action"):
            unit, meaning = RECORD.get(name, ("1", name.replace("_", " ")))
            group.create_array(
                name,
                shape=(number, plan.years),
                chunks=(plan.size, plan.years),
                dtype="int8" if name == "action" else "float32",
                dimension_names=("stand", "year"),
                attributes={"units": unit, "long_name": meaning},
            )
        return group

    def write(self, k: int, played: dict[str, np.ndarray]) -> None:
        """Write chunk k, and then that it is written."""
        for name, values in played.items():
            self.group[name][self.plan.rows(k)] = values
        if self.path is not None:
            (self.partial / "written" / str(k)).touch()

    def dataset(self):
        """The finished store."""
        import xarray

        if self.path is not None and not self.path.exists():
            os.replace(self.partial / "data.zarr", self.path)
        store = self.group.store if self.path is None else self.path
        return xarray.open_zarr(store, consolidated=False, chunks=None, decode_timedelta=False)


def settings_of(folder: Path) -> dict:
    """What a store was made by; ValueError if it is none of ours."""
    import zarr

    try:
        return json.loads(zarr.open_group(folder, mode="r").attrs["settings"])
    except (OSError, KeyError, ValueError) as error:
        raise ValueError(f"{folder}: no store of simulate_many; name another path") from error


def locked(path: Path, store: Path):
    """A file that no other process holds; ValueError if one does."""
    file = open(path, "w")
    if fcntl is not None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            raise ValueError(f"{store}: another process is at work on it") from None
    return file


def coordinate(column: str) -> str:
    """What the store calls a column of the table: first stocks are not taken for those of the years."""
    return f"initial_{column}" if column in INITIAL_LIMITS else column
