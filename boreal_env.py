"""BoreaRL: managing a boreal stand for carbon and for permafrost, as a mo-gymnasium environment.

`import boreal_env` registers `boreal-generalist-v0`, `boreal-site-specific-v0` and `boreal-balanced-v0`.
The file reads top to bottom: observation, action mask, reward, episodes, the environment, the vector environment.
"""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from numbers import Real

import gymnasium as gym
import numpy as np
from gymnasium.spaces import Box, Discrete
from gymnasium.utils import EzPickle
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

import sim
from sim.block import compile_kernels
from sim.demography import AGE_CLASSES
from sim.management import (
    CONIFER_MIXES,
    DENSITY_CHANGES,
    LARGEST_DENSITY,
    LEAST_DENSITY,
    NEGLIGIBLE_STEMS,
    NUM_ACTIONS,
    check_actions,
    decode,
)
from sim.parameters import check_overrides, check_seed
from sim.spin_up import check_initial_ranges

MODES = ("generalist", "site_specific")
THAW_FORMULATIONS = ("asymmetric", "contrast", "raw_degree_days")
NO_CHANGE = 12  # the action that neither plants nor thins
DEFAULT_YEARS = 50

# ---------------------------------------------------------------------------------------------------------------
# Observation: index for index the paper's detailed table
# ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Observed:
    """One entry of the observation: (value + shift) / scale, with the physical limits of the value."""

    name: str
    group: str
    unit: str
    shift: float
    scale: float
    low: float
    high: float


_STOCK, _CHANGE = 200.0, 100.0  # kgC m-2, beyond what a boreal stand can hold or move in a year


def _site_limits(name):
    return sim.SITE_PARAMETERS[name].physical_low, sim.SITE_PARAMETERS[name].physical_high


def _observation_table() -> tuple[Observed, ...]:
    latitude, mean, amplitude = (
        _site_limits(n) for n in ("latitude_deg", "mean_annual_temperature_c", "seasonal_amplitude_c")
    )
    start, fall = _site_limits("growth_start_day"), _site_limits("fall_start_day")
    table = [
        Observed("preference", "preference", "1", 0, 1, 0, 1),
        Observed("year", "state", "yr", 0, 50, 0, 1000),
        Observed("density", "state", "stems ha-1", 0, 1500, 0, 15000),
        Observed("conifer_fraction", "state", "1", 0, 1, 0, 1),
        Observed("carbon_stock", "state", "kgC m-2", 0, 50, 0, 2 * _STOCK),
        Observed("latitude", "climate", "degN", -50, 20, *latitude),
        Observed("mean_annual_temperature", "climate", "degC", 10, 20, *mean),
        Observed("seasonal_amplitude", "climate", "degC", 0, 30, *amplitude),
        Observed("growth_start_day", "climate", "day of year", 0, 365, *start),
        Observed("fall_start_day", "climate", "day of year", 0, 365, *fall),
        Observed("growing_season_length", "climate", "day", 0, 200, fall[0] - start[1], fall[1] - start[0]),
    ]
    for name, unit, scale, high in (
        ("fire_mortality", "1", 1, 1),
        ("insect_mortality", "1", 1, 1),
        ("drought_index", "mm", 100, 1e4),
    ):
        table += [Observed(f"{name}_{ago}", "disturbance", unit, 0, scale, 0, high) for ago in ("1yr", "2yr")]
    table += [
        Observed("biomass_change", "carbon", "kgC m-2", 0.5, 1.0, -_CHANGE, _CHANGE),
        Observed("soil_change", "carbon", "kgC m-2", 0.2, 0.4, -_CHANGE, _CHANGE),
        Observed("total_change", "carbon", "kgC m-2", 0.7, 1.4, -_CHANGE, _CHANGE),
        Observed("natural_mortality", "carbon", "kgC m-2", 0, 0.5, 0, _CHANGE),
        Observed("litterfall", "carbon", "kgC m-2", 0, 2.0, 0, _CHANGE),
        Observed("thinning_loss", "carbon", "kgC m-2", 0.5, 1.0, 0, _CHANGE),
        Observed("products_stored", "carbon", "kgC m-2", 0, 0.5, 0, _CHANGE),
        Observed("density_action", "management", "index", 0, 4, 0, 4),
        Observed("mix_action", "management", "index", 0, 4, 0, 4),
        Observed("density_change", "management", "stems ha-1", 100, 200, -100, 100),
        Observed("mix_change", "management", "1", 0, 1, -1, 1),
    ]
    table += [
        Observed(f"{species}_{age}", "age", "1", 0, 1, 0, 1)
        for species in ("conifer", "deciduous")
        for age in AGE_CLASSES
    ]
    table += [
        Observed("biomass", "stocks", "kgC m-2", 0, 50, 0, _STOCK),
        Observed("soil", "stocks", "kgC m-2", 0, 50, 0, _STOCK),
        Observed("biomass_limit_penalty", "penalties", "1", 0, 0.5, 0, 100),
        Observed("soil_limit_penalty", "penalties", "1", 0, 0.5, 0, 100),
        Observed("density_penalty", "penalties", "1", 0, 1.0, 0, 100),
    ]
    for name in sim.OBSERVED_SITE_PARAMETERS:
        p = sim.SITE_PARAMETERS[name]
        table.append(Observed(f"site_{name}", "site", p.unit, -p.low, p.high - p.low, p.physical_low, p.physical_high))
    return tuple(table)


OBSERVATION = _observation_table()
OBSERVATION_NAMES = tuple(entry.name for entry in OBSERVATION)
OBSERVATION_GROUPS = tuple(dict.fromkeys(entry.group for entry in OBSERVATION))
_SHIFT = np.array([entry.shift for entry in OBSERVATION])
_SCALE = np.array([entry.scale for entry in OBSERVATION])
_AGE = slice(OBSERVATION_NAMES.index("conifer_seedling"), OBSERVATION_NAMES.index("deciduous_old") + 1)
_PENALTIES = slice(OBSERVATION_NAMES.index("biomass_limit_penalty"), OBSERVATION_NAMES.index("density_penalty") + 1)
_SITE = slice(OBSERVATION_NAMES.index(f"site_{sim.OBSERVED_SITE_PARAMETERS[0]}"), len(OBSERVATION))
_CLIMATE = ("latitude_deg", "mean_annual_temperature_c", "seasonal_amplitude_c", "growth_start_day", "fall_start_day")
_COLUMN = {name: i for i, name in enumerate(sim.RECORD_NAMES)}


#: Entries of the observation that are columns of the annual record, by index.
_RECORDED = {
    11: "fire_mortality",
    13: "insect_mortality",
    15: "drought_index",
    17: "biomass_change_kgc_m2",
    18: "soil_change_kgc_m2",
    19: "net_carbon_change_kgc_m2",
    20: "mortality_kgc_m2",
    21: "litterfall_kgc_m2",
    22: "harvest_kgc_m2",
    23: "hwp_stored_kgc_m2",
}
_RECORDED_ENTRIES, _RECORDED_COLUMNS = np.array([(i, _COLUMN[name]) for i, name in _RECORDED.items()]).T


def observation_space(entries: Sequence[int], largest_penalties: Sequence[float] = (0.0, 0.0, 0.0)) -> Box:
    """Box of the given entries of the table, with bounds from physical limits, widened for float32 rounding.

    largest_penalties : of biomass, soil and density, which a user's constants can raise above the table's limits.
    """
    limits = np.array([(entry.low, entry.high) for entry in OBSERVATION])
    limits[_PENALTIES, 1] = np.maximum(limits[_PENALTIES, 1], largest_penalties)
    low, high = ((limits + _SHIFT[:, None]) / _SCALE[:, None])[entries].T
    margin = 1e-4 * (high - low)
    return Box((low - margin).astype(np.float32), (high + margin).astype(np.float32), dtype=np.float32)


def sample_site_observations(site_seeds: Sequence[int]) -> np.ndarray:
    """The 62 site entries of the observation for sites with these seeds, shape (n, 62), float32."""
    return np.array([sim.scale_site(sim.sample_site(seed)) for seed in site_seeds], dtype=np.float32)


# ---------------------------------------------------------------------------------------------------------------
# Action: 5 x density index + mix index
# ---------------------------------------------------------------------------------------------------------------


def action_masks(observations: np.ndarray, harvest_min_class: str = "young") -> np.ndarray:
    """Valid actions of observations: those whose whole density change can be made, and so cost no penalty.

    observations : (n, 43) or (n, 105), all groups of a mode; a reduced observation does not say which columns it has,
    but `env.action_masks()` knows. harvest_min_class : "young", "mature" or "old". Returns bool, shape (n, 25).
    """
    _check_choice("harvest_min_class", harvest_min_class, AGE_CLASSES[2:])
    observations = np.atleast_2d(np.asarray(observations, dtype=float))
    if observations.ndim != 2 or observations.shape[1] not in (_SITE.start, _SITE.stop):
        raise ValueError(
            f"observations of shape {observations.shape}: (n, {_SITE.start}) or (n, {_SITE.stop}), all groups of a mode"
            ", are allowed; env.action_masks() works with any observation_groups"
        )
    if not np.isfinite(observations[:, 2]).all() or not np.isfinite(observations[:, _AGE]).all():
        raise ValueError("observations: finite densities and age fractions are allowed, got NaN or infinity")
    density = observations[:, 2] * 1500.0
    fractions = observations[:, _AGE].reshape(-1, 2, len(AGE_CLASSES))
    harvestable = density * fractions[:, :, AGE_CLASSES.index(harvest_min_class) :].sum(axis=(1, 2))
    return valid_actions(density, harvestable)


def valid_actions(density: np.ndarray, harvestable: np.ndarray) -> np.ndarray:
    """Actions whose whole density change can be made, bool, shape (n, 25).

    density, harvestable : stems, and those of an age that may be cut [stems ha-1], shape (n,).
    """
    changes = np.array(DENSITY_CHANGES)
    small = 0.5 * NEGLIGIBLE_STEMS
    planting = density[:, None] + changes < LARGEST_DENSITY - small
    cuttable = np.minimum(harvestable, density - LEAST_DENSITY)[:, None]
    valid = np.where(changes > 0.0, planting, -changes <= cuttable + small) | (changes == 0.0)
    return np.repeat(valid, len(CONIFER_MIXES), axis=1)


# ---------------------------------------------------------------------------------------------------------------
# Reward: [carbon, thaw]
# ---------------------------------------------------------------------------------------------------------------


#: Carbon scale [kgC m-2 yr-1] at which both returns vary equally between policies of one site, as measured by
#: `analysis/studies/measure_balance.py`.
BALANCED_CARBON_SCALE = 1.4
ROUND_OFF_STEMS = 1e-6  # stems ha-1; planting up to the limit reaches it but for less


@dataclass(frozen=True)
class Reward:
    """Constants of the reward; the defaults are the paper's."""

    carbon_scale: float = 2.0  # kgC m-2 yr-1
    stock_bonus: float = 0.0
    stock_scale: float = 50.0  # kgC m-2
    product_bonus: float = 0.0
    product_scale: float = 1.0  # kgC m-2
    biomass_limit: float = 15.0  # kgC m-2
    soil_limit: float = 20.0  # kgC m-2
    limit_penalty: float = 0.5
    density_limit: float = 2000.0  # stems ha-1
    density_penalty: float = 1.0
    ineffective_penalty: float = 0.5
    thaw_scale: float = 40.0  # MJ m-2 yr-1
    warming_weight: float = 2.5

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            positive = field.name.endswith(("scale", "limit"))
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not np.isfinite(value):
                raise ValueError(f"reward {field.name}: a finite number is allowed, got {value!r}")
            if value < 0.0 or (positive and value == 0.0):
                raise ValueError(
                    f"reward {field.name} = {value}: a {'positive' if positive else 'non-negative'} number is allowed"
                )

    def largest_penalties(self) -> tuple[float, float, float]:
        """Of biomass, soil and density, at the largest stocks that can be observed."""
        biomass, soil = (max(_STOCK / limit - 1.0, 0.0) for limit in (self.biomass_limit, self.soil_limit))
        return self.limit_penalty * biomass, self.limit_penalty * soil, self.density_penalty

    @staticmethod
    def of(values, balanced: bool = False) -> "Reward":
        """A Reward from a Reward, a dict of constants to change, or None; balanced : from which carbon scale."""
        default = Reward(carbon_scale=BALANCED_CARBON_SCALE) if balanced else Reward()
        if values is None or isinstance(values, Reward):
            return values or default
        if not isinstance(values, dict):
            raise ValueError(f"reward: a Reward or a dict of its constants is allowed, got {type(values).__name__}")
        allowed = [field.name for field in fields(Reward)]
        unknown = [name for name in values if name not in allowed]
        if unknown:
            raise ValueError(f"unknown reward constant {unknown[0]!r}; allowed: {', '.join(allowed)}")
        return replace(default, **values)


def reward_components(record: np.ndarray, density_change: np.ndarray, reward: Reward) -> dict[str, np.ndarray]:
    """Parts of the carbon reward of a year, each shape (n,); see `carbon_reward`.

    record : annual records (n, columns of `sim.RECORD_NAMES`); density_change : what was asked for [stems ha-1].
    The change and the bonuses are clipped; `components_clipped` is what that cut off, all three together.
    """

    def column(name):
        return record[:, _COLUMN[name]]

    biomass, soil = column("biomass_kgc_m2"), column("soil_kgc_m2")
    change = column("net_carbon_change_kgc_m2") / reward.carbon_scale
    stock = (biomass + soil) / reward.stock_scale
    products = column("hwp_stored_kgc_m2") / reward.product_scale
    gains = {
        "carbon_change": np.clip(change, -1.0, 1.0),
        "stock_bonus": reward.stock_bonus * np.clip(stock, 0.0, 1.0),
        "product_bonus": reward.product_bonus * np.clip(products, 0.0, 1.0),
    }
    unclipped = change + reward.stock_bonus * stock + reward.product_bonus * products
    over_biomass = np.maximum(biomass - reward.biomass_limit, 0.0)
    over_soil = np.maximum(soil - reward.soil_limit, 0.0)
    crowded = column("density_after_action") >= reward.density_limit - ROUND_OFF_STEMS
    made = column("planted_stems_ha") - column("thinned_stems_ha")
    shortfall = np.abs(density_change - made)
    missed = np.where(shortfall < NEGLIGIBLE_STEMS, 0.0, shortfall / np.maximum(np.abs(density_change), 1.0))
    return {
        **gains,
        "components_clipped": unclipped - sum(gains.values()),
        "biomass_limit_penalty": reward.limit_penalty * over_biomass / reward.biomass_limit,
        "soil_limit_penalty": reward.limit_penalty * over_soil / reward.soil_limit,
        "density_penalty": reward.density_penalty * crowded,
        "ineffective_penalty": reward.ineffective_penalty * missed,
    }


def carbon_reward(components: dict[str, np.ndarray]) -> np.ndarray:
    """Carbon reward before its final clip to [-1, 1]: change and bonuses less penalties."""
    c = components
    gains = c["carbon_change"] + c["stock_bonus"] + c["product_bonus"]
    limits = c["biomass_limit_penalty"] + c["soil_limit_penalty"]
    return gains - limits - c["density_penalty"] - c["ineffective_penalty"]


def thaw_reward(cooling: np.ndarray, warming: np.ndarray, reward: Reward, formulation: str) -> np.ndarray:
    """Thaw reward before its final clip, from heat out of and into the boundary [MJ m-2 yr-1]."""
    if formulation == "contrast":
        both = cooling + warming
        return np.where(both > 0.0, (cooling - warming) / np.where(both > 0.0, both, 1.0), 0.0)
    weight = reward.warming_weight if formulation == "asymmetric" else 1.0
    return (cooling - weight * warming) / reward.thaw_scale


#: Columns that the environment adds to the annual record.
REWARD_COLUMNS = (
    "carbon_change",
    "stock_bonus",
    "product_bonus",
    "components_clipped",
    "biomass_limit_penalty",
    "soil_limit_penalty",
    "density_penalty",
    "ineffective_penalty",
    "carbon_clipped",
    "thaw_clipped",
    "carbon_reward",
    "thaw_reward",
)


def rewards_of_year(record: np.ndarray, actions: np.ndarray, reward: Reward, formulation: str) -> dict[str, np.ndarray]:
    """Both rewards of a year and the parts they are made of: `REWARD_COLUMNS`, each shape (n,).

    record : annual records (n, columns of `sim.RECORD_NAMES`); actions : what was asked for, integers (n,);
    formulation : of the thaw reward, one of `THAW_FORMULATIONS`.
    """
    components = reward_components(record, decode(actions)[0], reward)
    carbon = carbon_reward(components)
    cooling, warming = (record[:, _COLUMN[f"boundary_{way}_mj_m2"]] for way in ("cooling", "warming"))
    thaw = thaw_reward(cooling, warming, reward, formulation)
    carbon_rewarded, thaw_rewarded = np.clip(carbon, -1.0, 1.0), np.clip(thaw, -1.0, 1.0)
    return {
        **components,
        "carbon_clipped": carbon - carbon_rewarded,
        "thaw_clipped": thaw - thaw_rewarded,
        "carbon_reward": carbon_rewarded,
        "thaw_reward": thaw_rewarded,
    }


#: Columns of the annual record with the rewards.
HISTORY_NAMES = (*sim.RECORD_NAMES, *REWARD_COLUMNS)
PAPER_OBJECTIVES = ("carbon", "thaw")


@dataclass(frozen=True)
class Objective:
    """An objective of your own, beside the paper's "carbon" and "thaw".

    value : function of the year's record to rewards (n,). The record is a dict of read-only columns (n,): those of
    `HISTORY_NAMES` and of objectives before this one. For worker processes and pickling, a function at the top level
    of a module. low, high : limits of the reward; values are clipped to them. The record gets the columns
    `<name>_reward` and `<name>_clipped` (what was cut off), the last step's info `<name>_return`.
    """

    name: str
    value: Callable[[dict[str, np.ndarray]], np.ndarray]
    low: float = -1.0
    high: float = 1.0

    def __post_init__(self):
        taken = (*PAPER_OBJECTIVES, "components")
        if not isinstance(self.name, str) or not self.name.isidentifier() or self.name in taken:
            raise ValueError(f"objective name {self.name!r}: an identifier is allowed, not {', '.join(taken)}")
        if not callable(self.value):
            raise ValueError(f"objective {self.name}: a function of the year's record is allowed, got {self.value!r}")
        limits = (self.low, self.high)
        if not all(isinstance(x, Real) and np.isfinite(x) for x in limits) or self.low >= self.high:
            raise ValueError(f"objective {self.name}: finite limits low < high are allowed, got {limits}")

    def columns(self, year: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """`<name>_clipped` and `<name>_reward` of a year, each shape (n,)."""
        shown = {name: column.view() for name, column in year.items()}
        for column in shown.values():
            column.flags.writeable = False
        value = np.asarray(self.value(shown), dtype=float)
        number = len(year["carbon_reward"])
        if value.shape != (number,) or not np.isfinite(value).all():
            raise ValueError(f"objective {self.name}: {number} finite numbers are allowed, got {value}")
        reward = np.clip(value, self.low, self.high)
        return {f"{self.name}_clipped": value - reward, f"{self.name}_reward": reward}


def check_objectives(objectives: Sequence) -> tuple:
    """Objectives of an environment: names of the paper's, and `Objective`s, each once."""
    if isinstance(objectives, str) or not np.iterable(objectives) or not len(objectives):
        raise ValueError(f"objectives: a sequence of {', '.join(PAPER_OBJECTIVES)} and Objective, got {objectives!r}")
    for objective in objectives:
        if not isinstance(objective, Objective):
            _check_choice("objective", objective, PAPER_OBJECTIVES)
    names = objective_names(objectives)
    if len(set(names)) < len(names):
        raise ValueError(f"objectives {', '.join(names)}: each is allowed once")
    return tuple(objectives)


def objective_names(objectives: Sequence) -> list[str]:
    """Names of objectives, in the order of the reward vector."""
    return [objective.name if isinstance(objective, Objective) else objective for objective in objectives]


# ---------------------------------------------------------------------------------------------------------------
# Episodes: what one environment and many in lockstep share
# ---------------------------------------------------------------------------------------------------------------


class _Episodes:
    """`number` episodes side by side. Arguments are those of `BorealEnv`, checked here."""

    def __init__(
        self,
        number,
        *,
        mode="generalist",
        years=DEFAULT_YEARS,
        time_step_minutes=30,
        backend="numba",
        thaw_formulation="asymmetric",
        fixed_preference=None,
        site_seed=None,
        parameter_overrides=None,
        initial_ranges=None,
        hwp_half_life_years=None,
        harvest_min_class="young",
        reward=None,
        balanced=False,
        objectives=PAPER_OBJECTIVES,
        mechanisms=None,
        constants=None,
        observation_groups=None,
        record_years=False,
    ):
        _check_choice("mode", mode, MODES)
        _check_choice("thaw_formulation", thaw_formulation, THAW_FORMULATIONS)
        if isinstance(years, bool) or not isinstance(years, (int, np.integer)) or not 1 <= years <= 1000:
            raise ValueError(f"years: an integer in [1, 1000] is allowed, got {years!r}")
        if fixed_preference is not None:
            fixed_preference = check_preference(fixed_preference, "fixed_preference")
        if site_seed is not None:
            check_seed("site_seed", site_seed)
        for name, value in (("balanced", balanced), ("record_years", record_years)):
            if not isinstance(value, (bool, np.bool_)):
                raise ValueError(f"{name}: True or False is allowed, got {value!r}")
        self.number, self.mode, self.years = number, mode, int(years)
        self.thaw_formulation, self.fixed_preference = thaw_formulation, fixed_preference
        sim.middle_site(parameter_overrides)
        self.site_seed, self.parameter_overrides = site_seed, dict(parameter_overrides or {})
        self.initial_ranges = check_initial_ranges(initial_ranges)
        self.harvest_min_class = harvest_min_class
        self.reward = Reward.of(reward, bool(balanced))
        objectives = check_objectives(objectives)
        self.objective_names = objective_names(objectives)
        self.own_objectives = [objective for objective in objectives if isinstance(objective, Objective)]
        self.history_names = HISTORY_NAMES + tuple(
            f"{objective.name}_{what}" for objective in self.own_objectives for what in ("clipped", "reward")
        )
        self.reward_columns = [self.history_names.index(f"{name}_reward") for name in self.objective_names]
        limits = [(o.low, o.high) if isinstance(o, Objective) else (-1.0, 1.0) for o in objectives]
        self.reward_space = Box(*np.array(limits, dtype=np.float32).T, dtype=np.float32)
        self.record_years = bool(record_years)
        self.stands = sim.Stands(
            number,
            time_step_minutes=time_step_minutes,
            backend=backend,
            constants=constants,
            mechanisms=mechanisms,
            hwp_half_life_years=hwp_half_life_years,
            harvest_min_class=harvest_min_class,
        )
        if isinstance(observation_groups, str) or not np.iterable(observation_groups or ()):
            raise ValueError(f"observation_groups: a sequence of names is allowed, got {observation_groups!r}")
        groups = OBSERVATION_GROUPS if observation_groups is None else tuple(observation_groups)
        for group in groups:
            _check_choice("observation group", group, OBSERVATION_GROUPS)
        if len(set(groups)) < len(groups):
            raise ValueError(f"observation_groups {', '.join(groups)}: each is allowed once")
        if mode == "site_specific":
            groups = tuple(group for group in groups if group != "site")
        self.entries = [i for i, entry in enumerate(OBSERVATION) if entry.group in groups]
        if not self.entries:
            raise ValueError(f"observation_groups = {observation_groups!r}: nothing is left to observe in mode {mode}")
        self.observation_names = tuple(OBSERVATION_NAMES[i] for i in self.entries)
        self.observation_space = observation_space(self.entries, self.reward.largest_penalties())
        self.preference = np.zeros(number)
        self.site_seeds = np.zeros(number, dtype=np.int64)
        self.episode_seeds = np.zeros(number, dtype=np.int64)
        self.year = np.zeros(number, dtype=int)
        self.running = np.zeros(number, dtype=bool)
        self.history = np.zeros((number, self.years, len(self.history_names)))
        self._observation = np.zeros((number, len(OBSERVATION)))

    def draw(self, generator: np.random.Generator) -> tuple[int, int, float]:
        """Site seed, episode seed and preference of an episode: always three draws."""
        return int(generator.integers(2**31)), int(generator.integers(2**62)), float(generator.random())

    def begin(self, indices, draws, preferences, sites) -> None:
        """Start episodes. draws : for each, `draw`'s result; preferences, sites : for each, given values or None."""
        chosen, seeds, given = [], [], {}
        for k, i in enumerate(indices):
            site_seed, episode_seed, preference = draws[k]
            overrides = {**self.parameter_overrides, **(sites[k] or {})}
            if self.mode == "site_specific":
                # A fixed world: one site, one start, one weather, one set of disturbance dice.
                overrides.setdefault("daily_noise_std_c", 0.0)
                episode_seed = 0 if self.site_seed is None else self.site_seed
                given[k] = {n: 0.5 * (a + b) for n, (a, b) in {**sim.INITIAL_RANGES, **self.initial_ranges}.items()}
            if self.site_seed is not None:
                site_seed = self.site_seed
            fixed_middle = self.mode == "site_specific" and self.site_seed is None
            chosen.append(sim.middle_site(overrides) if fixed_middle else sim.sample_site(site_seed, overrides))
            seeds.append(sim.episode_seeds(episode_seed))
            self.site_seeds[i] = -1 if fixed_middle else site_seed
            self.episode_seeds[i] = episode_seed
            wanted = self.fixed_preference if preferences[k] is None else preferences[k]
            self.preference[i] = preference if wanted is None else wanted
        self.stands.start(indices, chosen, seeds, given, self.initial_ranges)
        self.year[indices] = 0
        self.running[indices] = True
        self.history[indices] = 0.0
        self._observe_start(np.asarray(indices), chosen)

    def advance(self, actions) -> np.ndarray:
        """A year for all episodes; returns float32 rewards (number, objectives)."""
        if not self.running.all():
            stopped = int(np.argmin(self.running))
            raise RuntimeError(f"step on episode {stopped} that is not running: call reset first")
        actions = check_actions(actions, self.number)
        record = self.stands.step(actions)
        parts = rewards_of_year(record, actions, self.reward, self.thaw_formulation)
        for objective in self.own_objectives:
            parts |= objective.columns(dict(zip(sim.RECORD_NAMES, record.T, strict=True)) | parts)
        added = np.array([parts[name] for name in self.history_names[record.shape[1] :]])
        year = np.concatenate([record, added.T], axis=1)
        self.history[np.arange(self.number), self.year] = year
        self.year = self.year + 1
        self.running = self.year < self.years
        self._observe_year(record, actions, parts)
        return year.take(self.reward_columns, axis=1).astype(np.float32)

    def observations(self) -> np.ndarray:
        """Fresh float32 observations, shape (number, entries)."""
        self._observation[:, 0] = self.preference
        return self._observation[:, self.entries].astype(np.float32)

    def action_masks(self) -> np.ndarray:
        """Actions that can be carried out in full, bool, shape (number, 25)."""
        self.check_begun("action_masks")
        return action_masks(self._observation.astype(np.float32), self.harvest_min_class)

    def check_begun(self, what: str) -> None:
        """Refuse what needs a stand before the first reset."""
        fresh = ~self.running & (self.year == 0)
        if fresh.any():
            raise RuntimeError(f"{what} of episode {int(np.argmax(fresh))} that has not begun: call reset first")

    def final_info(self, i: int) -> dict:
        """Totals of a finished episode."""
        years = dict(zip(self.history_names, self.history[i, : self.year[i]].T, strict=True))

        def mean(name):
            return float(years[name].mean())

        names = (*PAPER_OBJECTIVES, *(objective.name for objective in self.own_objectives))
        info = {
            **{f"{name}_return": float(years[f"{name}_reward"].sum()) for name in names},
            "site_seed": int(self.site_seeds[i]),
            "episode_seed": int(self.episode_seeds[i]),
            "preference": float(self.preference[i]),
            "final_density": float(years["density_stems_ha"][-1]),
            "mean_density": mean("density_stems_ha"),
            "final_conifer_fraction": float(years["conifer_fraction"][-1]),
            "mean_conifer_fraction": mean("conifer_fraction"),
            **{name: mean(name) for name in ("growing_season_days", "latent_heat_mj_m2", "ground_shortwave_mj_m2")},
        }
        if self.record_years:
            record = {name: column.copy() for name, column in years.items()}
            info["years"] = {"year": np.arange(1, self.year[i] + 1), **record}
        return info

    def _observe_start(self, indices, sites) -> None:
        """Observation of a fresh stand: history of an unchanged one."""
        stocks = self.stands.stocks(indices)
        values = np.zeros((len(indices), len(OBSERVATION)))
        values[:, 5:10] = [[site[name] for name in _CLIMATE] for site in sites]
        values[:, 10] = values[:, 9] - values[:, 8]
        values[:, 24] = DENSITY_CHANGES.index(0.0)
        values[:, 25] = np.abs(stocks["conifer_fraction"][:, None] - np.array(CONIFER_MIXES)).argmin(axis=1)
        self._fill_stand(values, stocks)
        scaled = (values + _SHIFT) / _SCALE
        scaled[:, _SITE] = [sim.scale_site(site) for site in sites]
        self._observation[indices] = scaled

    def _observe_year(self, record, actions, components) -> None:
        """Observation after a year; what was last year's becomes the year before's."""
        values = np.zeros((self.number, len(OBSERVATION)))
        values[:, 1] = self.year
        values[:, _RECORDED_ENTRIES] = record[:, _RECORDED_COLUMNS]
        values[:, 24], values[:, 25] = actions // 5, actions % 5
        values[:, 26] = record[:, _COLUMN["planted_stems_ha"]] - record[:, _COLUMN["thinned_stems_ha"]]
        values[:, 27] = record[:, _COLUMN["conifer_fraction_after_action"]] - self._observation[:, 3]
        values[:, _PENALTIES] = np.array([components[name] for name in OBSERVATION_NAMES[_PENALTIES]]).T
        self._fill_stand(values, self.stands.stocks(np.arange(self.number)))
        scaled = (values + _SHIFT) / _SCALE
        scaled[:, 5:11] = self._observation[:, 5:11]
        scaled[:, _SITE] = self._observation[:, _SITE]
        scaled[:, 12:17:2] = self._observation[:, 11:16:2]
        self._observation = scaled

    @staticmethod
    def _fill_stand(values, stocks) -> None:
        """Stand and stocks, in their own units."""
        density = stocks["density_stems_ha"]
        values[:, 2], values[:, 3] = density, stocks["conifer_fraction"]
        values[:, 38], values[:, 39] = stocks["biomass_kgc_m2"], stocks["soil_kgc_m2"]
        values[:, 4] = values[:, 38] + values[:, 39]
        values[:, _AGE] = stocks["age_classes"] / np.where(density > 0.0, density, 1.0)[:, None]

    def get_state(self) -> dict:
        """All that the future depends on."""
        names = ("preference", "site_seeds", "episode_seeds", "year", "running", "history", "_observation")
        state = {name: getattr(self, name).copy() for name in names}
        return {"mode": self.mode, "stands": self.stands.get_state(), **state}

    def set_state(self, state: dict) -> None:
        """Continue from `get_state`."""
        there, here = (
            (kind, *history.shape) for kind, history in ((state["mode"], state["history"]), (self.mode, self.history))
        )
        if there != here:
            raise ValueError(f"state of (mode, episodes, years, columns of the record) {there} given to {here}")
        self.stands.set_state(state["stands"])
        for name, value in state.items():
            if name not in ("mode", "stands"):
                setattr(self, name, value.copy())


def check_preference(value, what: str = "preference") -> float:
    """A preference weight of the carbon objective, in [0, 1]."""
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if not number or not 0.0 <= value <= 1.0:
        raise ValueError(f"{what}: a number in [0, 1] is allowed, got {value!r}")
    return abs(float(value))  # 0.0 for -0.0


def check_reset_options(options: dict | None, extra: Sequence[str] = ()) -> dict:
    """Options of `reset`: "preference" and "site" (and what the vector environment adds)."""
    allowed = ("preference", "site", *extra)
    if options is not None and not isinstance(options, dict):
        raise ValueError(f"reset options: a dict is allowed, got {type(options).__name__}")
    for name in options or {}:
        if name not in allowed:
            raise ValueError(f"unknown reset option {name!r}; allowed: {', '.join(allowed)}")
    return dict(options or {})


def check_saved(state: dict, kind: str) -> None:
    """A dict that `get_state` of the same kind of environment, "single" or "vector", gave."""
    keys = {"single": ["episodes", "generator"], "vector": ["episodes", "generators"]}
    got = sorted(state, key=str) if isinstance(state, dict) else type(state).__name__
    for other in keys:
        if got == keys[other] != keys[kind]:
            raise ValueError(f"state of a {other} environment given to a {kind} one")
    if got != keys[kind]:
        raise ValueError(f"state: a dict of {', '.join(keys[kind])} from get_state is allowed, got {got}")


ARGUMENTS = tuple(name for name in inspect.signature(_Episodes).parameters if name != "number")


def _known(arguments: dict) -> dict:
    """Arguments of an environment, all of which it has."""
    for name in arguments:
        if name not in ARGUMENTS:
            raise ValueError(f"unknown argument {name!r}; allowed: {', '.join(ARGUMENTS)}, render_mode")
    return arguments


def _check_choice(what, value, allowed) -> None:
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"{what} {value!r}: allowed are {', '.join(allowed)}")


def warm_up(num_envs: int = 1) -> None:
    """Compile the physics for `num_envs` stands in lockstep, or load it from the disk cache.

    Called before worker processes are forked (with 1: each has one stand), it saves each of them the compilation.
    """
    compile_kernels(num_envs)


# ---------------------------------------------------------------------------------------------------------------
# The environment
# ---------------------------------------------------------------------------------------------------------------


class BorealEnv(gym.Env, EzPickle):
    """
    ## Description
    A boreal stand on permafrost is managed for 50 years: each year a forester plants or thins, then the stand's
    energy, water and carbon are simulated at a half-hourly step. Two objectives: store carbon, and keep heat out of
    the permafrost.

    ## Observation Space
    `Box` of 105 values (generalist) or 43 (site-specific, without the 62 site parameters), float32;
    `boreal_env.OBSERVATION` has the name, unit, normalisation and limits of each, `observation_names` the names of
    those that this environment gives. The first is the preference for carbon; pairs of years have the last year first;
    age fractions are of all stems.

    ## Action Space
    `Discrete(25)`: action = 5 x density index + mix index; density changes (-100, -50, 0, 50, 100) stems/ha, conifer
    mixes (0, 0.25, 0.5, 0.75, 1). Planting adds seedlings of that mix; thinning cuts the oldest class first, so that
    the remaining stand nears the mix. `action_masks()` says which actions can be carried out in full; the others are
    legal, do what can be done, and cost a penalty. The density penalty is another: a stand at or above
    `density_limit` after the action costs it whatever the action, valid or not.

    ## Reward Space
    `Box(-1, 1, (2,))`: [carbon, thaw]. Carbon: net change of biomass, soil and wood products over `carbon_scale`,
    less penalties. Thaw: heat out of the permafrost boundary, less 2.5 times heat into it, over 40 MJ/m2. Another
    objective is a function of the year's record: `objectives=("carbon", "thaw", Objective("timber", value, 0, 1))`.

    ## Starting State
    Site, first stocks and ages, weather and preference are drawn anew in generalist mode, and are fixed in
    site-specific mode (but the preference). Soil, snow and water are spun up.

    ## Episode Termination
    After 50 years the episode is terminated: nothing is worth anything beyond.

    ## Arguments
    - `mode`: "generalist" or "site_specific"
    - `years`: length of an episode (50)
    - `time_step_minutes`: any divisor of 1440 (30)
    - `backend`: "numba" or "python" (the same source, interpreted)
    - `thaw_formulation`: "asymmetric", "contrast" or "raw_degree_days"
    - `fixed_preference`: weight of carbon in [0, 1] instead of a drawn one
    - `site_seed`: one site (`sim.sample_site(site_seed)`) instead of a new one each episode
    - `parameter_overrides`: site parameter -> value or (low, high), see `sim/site_parameters.csv`; nothing else of the
      site changes, but with `latitude_deg` the mean annual temperature, which is drawn around its latitude's
    - `initial_ranges`: first stock -> (low, high), see `sim.INITIAL_RANGES`; biomass is at most 120 kgC a stem
    - `hwp_half_life_years`: half-life of wood products (None: for ever)
    - `harvest_min_class`: youngest class that may be cut: "young", "mature" or "old"
    - `reward`: a `Reward`, or a dict of the constants to change
    - `balanced`: whether `carbon_scale`, unless `reward` gives it, is 1.4 (`boreal-balanced-v0`) instead of 2
    - `objectives`: of the reward vector, "carbon", "thaw" and any `Objective` of your own
    - `mechanisms`: switches of the physics, see `sim.MECHANISMS`
    - `constants`: literature constants to override, see `sim/constants.csv`
    - `observation_groups`: groups of the observation to keep, of `boreal_env.OBSERVATION_GROUPS`, whose order they keep
    - `record_years`: put the annual record into the last step's info, as `info["years"]`
    - `render_mode`: "rgb_array" or None

    ## Reset and Step
    `reset(seed=, options={"preference": w, "site": {name: value}})`; seeds are at most 2^63 - 1, here and everywhere.
    `info` is empty but for the last step, where it has the episode's totals. Bad values raise ValueError, a step before
    reset or after the end RuntimeError.

    ## Saving
    `get_state()` has everything that the future depends on, the running episode and the generators; `set_state` gives
    it to another environment with the same arguments. `pickle` and `copy.deepcopy` keep the arguments alone: their copy
    has to be reset, or given the state.

    ## Credits
    After BoreaRL (Dsouza et al. 2025, arXiv 2509.19846).
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 5}

    def __init__(self, *, render_mode: str | None = None, **kwargs):
        EzPickle.__init__(self, render_mode=render_mode, **kwargs)
        if render_mode is not None:
            _check_choice("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self._episodes = _Episodes(1, **_known(kwargs))
        self.observation_space = self._episodes.observation_space
        self.observation_names = self._episodes.observation_names
        self.action_space = Discrete(NUM_ACTIONS)
        self.reward_space = self._episodes.reward_space
        self.reward_dim = len(self._episodes.objective_names)

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Start an episode. options: "preference" (weight of carbon) and "site" (parameter -> value)."""
        options = check_reset_options(options)
        preference, site = options.get("preference"), options.get("site")
        preference = None if preference is None else check_preference(preference)
        sim.middle_site(site)
        super().reset(seed=None if seed is None else check_seed("seed", seed))
        self._episodes.begin([0], [self._episodes.draw(self.np_random)], [preference], [site])
        return self._episodes.observations()[0], {}

    def step(self, action):
        """One year under `action`, an integer in [0, 25)."""
        values = np.asarray(action)
        if values.size != 1:
            raise ValueError(f"action {action!r}: one integer in [0, {NUM_ACTIONS}) is allowed")
        reward = self._episodes.advance(values.reshape(1))[0]
        terminated = not bool(self._episodes.running[0])
        info = self._episodes.final_info(0) if terminated else {}
        return self._episodes.observations()[0], reward, terminated, False, info

    def action_masks(self) -> np.ndarray:
        """Actions that can be carried out in full, bool, shape (25,)."""
        return self._episodes.action_masks()[0]

    def render(self):
        """A picture of the stand, uint8 (height, width, 3), with `render_mode="rgb_array"`; otherwise None."""
        if self.render_mode is None:
            return None
        self._episodes.check_begun("picture")
        from sim.task.picture import draw_stand

        return draw_stand(self._episodes, 0)

    def get_state(self) -> dict:
        """Everything the future depends on, generators included; picklable."""
        return {"episodes": self._episodes.get_state(), "generator": self.np_random.bit_generator.state}

    def set_state(self, state: dict) -> None:
        """Continue from `get_state`."""
        check_saved(state, "single")
        self._episodes.set_state(state["episodes"])
        self.np_random.bit_generator.state = state["generator"]


# ---------------------------------------------------------------------------------------------------------------
# The vector environment: all stands in lockstep, one compiled call, all cores
# ---------------------------------------------------------------------------------------------------------------


class BorealVectorEnv(VectorEnv, EzPickle):
    """`num_envs` environments in lockstep, without worker processes; arguments as for `BorealEnv`.

    With the same seeds and actions it gives the trajectories of `num_envs` single environments. Episodes that end
    start anew within the step (`AutoresetMode.SAME_STEP`); infos then have `final_obs` and `final_info`.
    `reset(options={"preference": one or a sequence, "site": one dict or a sequence, "reset_mask": bool array})`, where
    only stands of the mask start anew.

    `group_size` neighbours share site, start, weather and disturbance dice in every episode, not the preference: all
    but that are drawn from the seed of a group's first stand. The options "site" and "reset_mask" have to be the same
    within a group.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(self, num_envs: int = 1, *, group_size: int = 1, render_mode: str | None = None, **kwargs):
        EzPickle.__init__(self, num_envs, group_size=group_size, render_mode=render_mode, **kwargs)
        if render_mode is not None:
            raise ValueError(f"render_mode {render_mode!r}: the vector environment draws nothing; None is allowed")
        for name, value in (("num_envs", num_envs), ("group_size", group_size)):
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
                raise ValueError(f"{name}: a positive integer is allowed, got {value!r}")
        if num_envs % group_size:
            raise ValueError(f"group_size = {group_size}: a divisor of num_envs = {num_envs} is allowed")
        self.num_envs, self.group_size = int(num_envs), int(group_size)
        self._episodes = _Episodes(self.num_envs, **_known(kwargs))
        self.single_observation_space = self._episodes.observation_space
        self.observation_names = self._episodes.observation_names
        self.single_action_space = Discrete(NUM_ACTIONS)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.reward_space = self._episodes.reward_space
        self.reward_dim = len(self._episodes.objective_names)
        self._generators: list[np.random.Generator] | None = None

    def reset(self, *, seed=None, options: dict | None = None):
        """Start episodes. seed : an integer (environment i gets seed + i), or one integer or None for each."""
        self._check_open()
        options = check_reset_options(options, ("reset_mask",))
        mask = np.ones(self.num_envs, bool) if options.get("reset_mask") is None else options["reset_mask"]
        mask = np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ValueError(f"reset_mask: {self.num_envs} booleans, at least one True, are allowed, got {mask!r}")
        preferences = _spread("preference", options.get("preference"), self.num_envs)
        preferences = [None if value is None else check_preference(value) for value in preferences]
        sites = _spread("site", options.get("site"), self.num_envs)
        self._check_groups("site", [check_overrides(site) for site in sites])
        self._check_groups("reset_mask", mask.tolist())
        if isinstance(seed, (int, np.integer)) and not isinstance(seed, bool):
            if check_seed("seed", seed) > 2**63 - self.num_envs:
                raise ValueError(f"seed = {seed}: stand i gets seed + i, so at most 2^63 - {self.num_envs} is allowed")
            seed = [int(seed) + i for i in range(self.num_envs)]
        seeds = _spread("seed", seed, self.num_envs)
        if self._generators is None:
            self._generators = [np.random.default_rng() for _ in range(self.num_envs)]
        for i, value in enumerate(seeds):
            if value is not None and mask[i]:
                self._generators[i] = gym.utils.seeding.np_random(check_seed("seed", value))[0]
        self._begin(np.flatnonzero(mask), preferences, sites)
        return self._episodes.observations(), {}

    def step(self, actions):
        """A year of every stand under `actions`, integers (num_envs,)."""
        self._check_open()
        rewards = self._episodes.advance(actions)
        ended = ~self._episodes.running
        infos: dict = {}
        observations = self._episodes.observations()
        if ended.any():
            indices = np.flatnonzero(ended)
            for i in indices:
                final = {"final_info": self._episodes.final_info(i), "final_obs": observations[i].copy()}
                infos = self._add_info(infos, final, i)
            nothing = [None] * self.num_envs
            self._begin(indices, nothing, nothing)
            observations = self._episodes.observations()
        return observations, rewards, ended, np.zeros(self.num_envs, bool), infos

    def action_masks(self) -> np.ndarray:
        """Actions that can be carried out in full, bool, shape (num_envs, 25)."""
        return self._episodes.action_masks()

    def call(self, name: str, *args, **kwargs) -> tuple:
        """A method of every environment, as with gymnasium's AsyncVectorEnv: here `action_masks` only."""
        _check_choice("method", name, ("action_masks",))
        return tuple(self.action_masks())

    def get_state(self) -> dict:
        """Everything the future depends on, generators included; picklable."""
        generators = self._generators and [g.bit_generator.state for g in self._generators]
        return {"episodes": self._episodes.get_state(), "generators": generators}

    def set_state(self, state: dict) -> None:
        """Continue from `get_state`."""
        check_saved(state, "vector")
        self._episodes.set_state(state["episodes"])
        self._generators = state["generators"] and [np.random.default_rng(0) for _ in range(self.num_envs)]
        for generator, value in zip(self._generators or [], state["generators"] or [], strict=True):
            generator.bit_generator.state = value

    def _check_open(self) -> None:
        if self.closed:
            raise gym.error.ClosedEnvironmentError("the vector environment is closed: make another")

    def _check_groups(self, what: str, values: list) -> None:
        """Refuse reset options that differ between the members of a group."""
        for first in range(0, self.num_envs, self.group_size):
            group = values[first : first + self.group_size]
            if any(value != group[0] for value in group):
                last = first + self.group_size - 1
                raise ValueError(f"{what}: the same for stands {first} to {last}, a group, is allowed, got {group}")

    def _begin(self, indices, preferences, sites) -> None:
        draws = [self._episodes.draw(self._generators[i]) for i in indices]
        if self.group_size > 1:
            leaders = {}
            for k, i in enumerate(indices):
                site_seed, episode_seed, _ = leaders.setdefault(i // self.group_size, draws[k])
                draws[k] = (site_seed, episode_seed, draws[k][2])
        self._episodes.begin(indices, draws, [preferences[i] for i in indices], [sites[i] for i in indices])


def _spread(name, value, number) -> list:
    """One value for each environment, from one for all or a sequence."""
    if value is None or isinstance(value, dict) or np.ndim(value) == 0:
        return [value] * number
    if isinstance(value, str) or len(value) != number:
        raise ValueError(f"{name}: one value or {number} are allowed, got {len(value)}")
    return list(value)


# ---------------------------------------------------------------------------------------------------------------
# Registration
# ---------------------------------------------------------------------------------------------------------------
for _name, _kwargs in {
    "boreal-generalist-v0": {"mode": "generalist"},
    "boreal-site-specific-v0": {"mode": "site_specific"},
    "boreal-balanced-v0": {"mode": "generalist", "balanced": True},
}.items():
    gym.register(
        id=_name,
        entry_point="boreal_env:BorealEnv",
        vector_entry_point="boreal_env:BorealVectorEnv",
        disable_env_checker=True,  # it warns at every vector reward
        kwargs=_kwargs,
    )
