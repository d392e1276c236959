"""What is rewarded: the paper's two objectives, [carbon, thaw], thaw as the field measures it, and a user's own."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from numbers import Real

import numpy as np

import sim
from sim.management import decode, missed_share
from sim.parameters import check_name
from sim.task.biodiversity import biodiversity_reward
from sim.task.timber import timber_reward

#: What the thaw reward counts, see `boreal_env.thaw_reward`; the paper's is the first.
THAW_FORMULATIONS = ("asymmetric", "contrast", "raw_degree_days")
COLUMN = {name: i for i, name in enumerate(sim.RECORD_NAMES)}

#: Carbon scale [kgC m-2 yr-1] at which both returns vary equally between the policies worth choosing, as measured by
#: `analysis/studies/measure_balance.py`.
BALANCED_CARBON_SCALE = 1.8
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

    def largest_penalties(self, biomass: float, soil: float) -> dict[str, float]:
        """Penalties, by their name in the record, at such stocks [kgC m-2] and at any density."""
        return {
            "biomass_limit_penalty": self.limit_penalty * max(biomass / self.biomass_limit - 1.0, 0.0),
            "soil_limit_penalty": self.limit_penalty * max(soil / self.soil_limit - 1.0, 0.0),
            "density_penalty": self.density_penalty,
        }

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
        return record[:, COLUMN[name]]

    biomass, soil = column("biomass_kgc_m2"), column("soil_kgc_m2")
    change = column("net_carbon_change_kgc_m2") / reward.carbon_scale
    deadwood = column("conifer_deadwood_kgc_m2") + column("deciduous_deadwood_kgc_m2")
    stock = (biomass + deadwood + soil) / reward.stock_scale
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
    return {
        **gains,
        "components_clipped": unclipped - sum(gains.values()),
        "biomass_limit_penalty": reward.limit_penalty * over_biomass / reward.biomass_limit,
        "soil_limit_penalty": reward.limit_penalty * over_soil / reward.soil_limit,
        "density_penalty": reward.density_penalty * crowded,
        "ineffective_penalty": reward.ineffective_penalty * missed_share(density_change, made),
    }


def carbon_reward(components: dict[str, np.ndarray]) -> np.ndarray:
    """Carbon reward before its final clip to [-1, 1]: change and bonuses less penalties."""
    c = components
    gains = c["carbon_change"] + c["stock_bonus"] + c["product_bonus"]
    limits = c["biomass_limit_penalty"] + c["soil_limit_penalty"]
    return gains - limits - c["density_penalty"] - c["ineffective_penalty"]


def thaw_reward(cooling: np.ndarray, warming: np.ndarray, reward: Reward, formulation: str) -> np.ndarray:
    """Thaw reward before its final clip, from heat out of and into the boundary [MJ m-2 yr-1].

    formulation : one of `THAW_FORMULATIONS`. Raises ValueError for another.
    """
    check_name("thaw_formulation", formulation, THAW_FORMULATIONS)
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

    record : annual records (n, columns of `sim.RECORD_NAMES`)
    actions : what was asked for, integers (n,)
    formulation : of the thaw reward, one of `THAW_FORMULATIONS`
    """
    components = reward_components(record, decode(actions)[0], reward)
    carbon = carbon_reward(components)
    cooling, warming = (record[:, COLUMN[f"boundary_{way}_mj_m2"]] for way in ("cooling", "warming"))
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
#: Objectives of the paper, in the order of its reward vector.
PAPER_OBJECTIVES = ("carbon", "thaw")


MOST_REWARD = 1e38  # that float32 holds


@dataclass(frozen=True)
class Objective:
    """An objective of your own, beside the paper's "carbon" and "thaw".

    value : function of the year's record to rewards (n,). The record is a dict of read-only columns (n,): those of
    `HISTORY_NAMES`, with prices of `TIMBER_COLUMNS`, and of objectives before this one. For worker processes and
    pickling, a function at the top level of a module. low, high : limits of the reward; values are clipped to them. The
    record gets the columns `<name>_reward` and `<name>_clipped` (what was cut off), the last step's info
    `<name>_return`.
    """

    name: str
    value: Callable[[dict[str, np.ndarray]], np.ndarray]
    low: float = -1.0
    high: float = 1.0

    def __post_init__(self):
        taken = (*PAPER_OBJECTIVES, "components", "scalarized")
        # gymnasium's infos have a mask `_<name>` beside every name
        if not isinstance(self.name, str) or not self.name.isidentifier() or self.name in taken or self.name[0] == "_":
            allowed = f"an identifier is allowed, without _ at its front, not {', '.join(taken)}"
            raise ValueError(f"objective name {self.name!r}: {allowed}")
        if not callable(self.value):
            raise ValueError(f"objective {self.name}: a function of the year's record is allowed, got {self.value!r}")
        limits = (self.low, self.high)
        if not all(isinstance(x, Real) and abs(x) <= MOST_REWARD for x in limits) or self.low >= self.high:
            allowed = f"finite limits low < high, at most {MOST_REWARD:g} either way, are allowed"
            raise ValueError(f"objective {self.name}: {allowed}, got {limits}")

    def columns(self, year: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """`<name>_clipped` and `<name>_reward` of a year, each shape (n,)."""
        shown = {name: column.view() for name, column in year.items()}
        for column in shown.values():
            column.flags.writeable = False
        try:
            value = np.asarray(self.value(shown))
        except KeyError as error:
            error.add_note(f"objective {self.name}: columns of the record are {', '.join(shown)}")
            raise
        number = len(year["carbon_reward"])
        if value.shape != (number,) or value.dtype.kind not in "biuf" or not np.isfinite(value).all():
            raise ValueError(f"objective {self.name}: an array of {number} finite numbers is allowed, got {value!r}")
        value = value.astype(float)
        reward = np.clip(value, self.low, self.high)
        return {f"{self.name}_clipped": value - reward, f"{self.name}_reward": reward}


#: Thaw depth [m] at which "active_layer" gives nothing; twice that gives -1.
THAW_DEPTH_SCALE_M = 1.0

#: Heat of the upper 3 m [MJ m-2] that "permafrost_heat" counts in: 3 m of soil frozen at about -2 degC hold twice as
#: much less than thawed soil, and give 1, thawed soil of 0 degC gives -1.
UPPER_GROUND_HEAT_SCALE = 135.0


def shallow_thaw(year: dict[str, np.ndarray]) -> np.ndarray:
    """How shallow the year's thaw was: 1 for none, 0 for `THAW_DEPTH_SCALE_M`."""
    return 1.0 - year["active_layer_depth_m"] / THAW_DEPTH_SCALE_M


def frozen_ground(year: dict[str, np.ndarray]) -> np.ndarray:
    """How frozen the upper 3 m were in the year's mean: 1 for all, -1 for not at all."""
    return -1.0 - year["upper_ground_heat_mj_m2"] / UPPER_GROUND_HEAT_SCALE


#: Thaw as the field measures it.
FIELD_OBJECTIVES = {
    "active_layer": Objective("active_layer", shallow_thaw),
    "permafrost_heat": Objective("permafrost_heat", frozen_ground),
}

TIMBER = Objective("timber", timber_reward)

#: All objectives that can be asked for by name, beside the paper's.
READY_OBJECTIVES = {
    **FIELD_OBJECTIVES,
    "timber": TIMBER,
    "biodiversity": Objective("biodiversity", biodiversity_reward, low=0.0),
}


def check_objectives(objectives: Sequence) -> tuple:
    """Objectives of an environment, each once: the paper's as names, all others as `Objective`s.

    objectives : names (of the paper's, or of `READY_OBJECTIVES`) and `Objective`s. Raises ValueError for any other.
    """
    allowed = (*PAPER_OBJECTIVES, *READY_OBJECTIVES)
    # a set has no order, and the reward vector would change its own from process to process
    if isinstance(objectives, (str, dict, set, frozenset)) or not np.iterable(objectives) or not len(objectives):
        raise ValueError(f"objectives: a list or tuple of {', '.join(allowed)} and Objective, got {objectives!r}")
    for objective in objectives:
        if not isinstance(objective, Objective):
            check_name("objective", objective, allowed)
    objectives = [READY_OBJECTIVES.get(o, o) if isinstance(o, str) else o for o in objectives]
    names = objective_names(objectives)
    if len(set(names)) < len(names):
        raise ValueError(f"objectives {', '.join(names)}: each is allowed once")
    return tuple(objectives)


def objective_names(objectives: Sequence) -> list[str]:
    """Names of objectives, in the order of the reward vector."""
    return [objective.name if isinstance(objective, Objective) else objective for objective in objectives]
