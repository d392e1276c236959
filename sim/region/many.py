"""Many sites at once: a table or a grid of sites, in lockstep on all cores or on a Ray cluster, into one zarr store.

The table is played in chunks, each as `Episodes` of the environment, so that a stand of a region gives the bits that
it gives alone. A chunk is written when it is finished: what is killed goes on there, to the same bytes.
"""

import inspect
import math
import time
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd

import sim
from sim.block import compiling, is_compiled, lanes_for
from sim.executor import HERE, check_address, each
from sim.management import NUM_ACTIONS, as_array, check_actions
from sim.parameters import check_name
from sim.region.plan import Plan
from sim.region.site_table import SEED, check_noise_of, check_sites
from sim.region.store import Store, code_of, digest, name_of
from sim.spin_up import BOUNDARY, INITIAL_LIMITS
from sim.stands import check_threads
from sim.task.actions import NO_CHANGE
from sim.task.episodes import ARGUMENTS, DEFAULT_YEARS, Episodes
from sim.task.preference import check_weights

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
#: Arguments of an environment that a table of sites leaves no room for.
NOT_OF_MANY = ("mode", "years", "site_seed", "fixed_preference", "parameter_overrides", "record_years", "record_steps")

#: Arguments of the world that a policy was trained in, and may have to be told again.
WORLD = ("weather", "boundary", "soil_carbon", "scenario")

PROBES, MOST_PROBED = 256, 5.0  # observations and returns, the latter up to so much, by which policies are told apart
CHUNK_STAND_YEARS, LARGEST_CHUNK = 51_200, 4096  # a chunk: half a minute on two cores, and 0.2 GB
TELL_SECONDS = 10.0


def simulate_many(
    sites,
    actions=NO_CHANGE,
    *,
    path=None,
    years: int = DEFAULT_YEARS,
    seed: int = 0,
    others: str = "middle",
    preference=None,
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
    actions : integer in [0, 25) for every year (12 and None change nothing); a yearly plan, shape (years,), or one for
        each site, shape (sites, years); or a policy: a function of observations (n, d) and valid actions (n, 25), and
        of accrued returns (n, objectives) if it asks for a third, which gives actions (n,) or their probabilities
        (n, 25), of which the largest is taken. It has no memory. One of `cleanrl_style.protocol.load_policy` is such.
    path : zarr store to write; the same command goes on where it was killed. None keeps everything in memory.
    seed : of first state, weather and disturbances of row k is seed + k, unless the table has a column `seed`.
    others : site parameters that the table lacks: "middle" of their ranges, or "sampled" as an episode samples them.
    preference : that a policy observes, a number or weights (None: all equal).
    variables : columns of the annual record to keep; the rewards, `carbon_reward` and so on, are among them.
    label : what the store says of the actions (None: the plan, or the policy's name and a hash of what it does). A
        store of another label is not gone on with.
    overwrite : start over, whatever `path` holds; what was killed goes on by the same command without it.
    threads : of this process (None: one a core).
    address : "none", this process; "local", Ray on this machine; else of a Ray cluster, see `sim.executor.each`.
    progress : whether a line every ten seconds says how far it is.
    arguments : of `boreal_env.BorealEnv`, such as weather, boundary, soil_carbon, scenario, constants.

    Returns
    -------
    xarray.Dataset of `variables` (stand, year), float32, with units, `action`, and the table's columns as coordinates,
    first stocks as `initial_<name>`. It is read from the store as it is used. Its bytes hang neither on threads nor on
    address.

    Raises
    ------
    ValueError naming row, column, value and what is allowed; `sim.PhysicsError` if a balance does not close;
    ImportError without xarray or zarr.
    """
    for package in ("xarray", "zarr"):
        if find_spec(package) is None:
            raise ImportError(f'simulate_many needs {package}: pip install -e ".[region]"')
    for name, value in (("overwrite", overwrite), ("progress", progress)):
        if not isinstance(value, (bool, np.bool_)):
            raise ValueError(f"{name}: True or False is allowed, got {value!r}")
    check_address(address)
    table = check_sites(sites, others, seed)
    one = check_world(years, threads, arguments, table)
    check_noise_of(table, sites.index, one.stands)
    chosen, label = check_choice(actions, label, len(table), one)
    tell_of_training(actions, arguments)
    size, objectives = chunk_size(len(table), one.years), len(one.objective_names)
    plan = Plan(
        table=table,
        actions=chosen,
        years=one.years,
        weights=check_weights(preference, objectives)
        if preference is not None
        else np.full(objectives, 1 / objectives),
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
# What is checked, beside the sites
# ---------------------------------------------------------------------------------------------------------------


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
        return actions, label or f"{name_of(actions)} {done} {code_of(actions)}"
    if isinstance(actions, str):
        raise ValueError(f"actions {actions!r}: a policy is allowed, which cleanrl_style.protocol.load_policy loads")
    given = as_array(NO_CHANGE if actions is None else actions)
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
    returns = np.random.default_rng(1).uniform(-MOST_PROBED, MOST_PROBED, (PROBES, len(one.objective_names)))
    return observations, np.ones((PROBES, NUM_ACTIONS), bool), returns


def check_variables(variables, names) -> tuple[str, ...]:
    """Columns of the annual record, each once."""
    wanted = () if isinstance(variables, str) or not np.iterable(variables) else tuple(variables)
    if not wanted:
        raise ValueError(f"variables: a sequence of names is allowed, got {variables!r}")
    for name in wanted:
        check_name("variable", name, names)
    return tuple(dict.fromkeys(wanted))
