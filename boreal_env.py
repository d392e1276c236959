"""BoreaRL: managing a boreal stand for carbon and for permafrost, as a mo-gymnasium environment.

`import boreal_env` registers the ids of `REGISTERED`, at the end. Here are the environment of one stand, with its
manual, and that of many in lockstep. What they are made of is in `sim/task/`: what is observed, which actions are
valid, what is rewarded, the preference, and the episodes that both share. `python -m boreal_env` says what there is.
"""

import importlib.util
import runpy
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Discrete
from gymnasium.utils import EzPickle
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

import sim

if not Path(__file__).with_name("sim").samefile(_found := getattr(sim, "__path__", [sim.__file__])[0]):
    raise ImportError(f"boreal_env needs the package `sim` beside it, but Python found {_found} first: rename that")

from sim.block import kernel, lanes_for
from sim.management import NUM_ACTIONS, as_array
from sim.parameters import brief, check_name, check_overrides, check_seed, is_integer
from sim.saved import restored_generator
from sim.stands import check_threads, positive_integer
from sim.task.actions import NO_CHANGE, MaskFunction, action_masks, valid_actions, where_valid
from sim.task.episodes import (
    BALANCED_WORLD,
    DEFAULT_YEARS,
    MODES,
    Episodes,
    check_arguments,
    check_reset_options,
    check_saved,
)
from sim.task.fronts import discounts, plans_of, play_plans, undominated
from sim.task.objectives import (
    BALANCED_CARBON_SCALE,
    FIELD_OBJECTIVES,
    HISTORY_NAMES,
    PAPER_OBJECTIVES,
    READY_OBJECTIVES,
    REWARD_COLUMNS,
    THAW_FORMULATIONS,
    Objective,
    Reward,
    carbon_reward,
    objective_names,
    reward_components,
    rewards_of_year,
    thaw_reward,
)
from sim.task.observation import (
    OBSERVATION,
    OBSERVATION_GROUPS,
    OBSERVATION_NAMES,
    Observed,
    in_unit,
    sample_site_observations,
)
from sim.task.preference import check_weights, draw_weights, observed_weights, spread_weights
from sim.task.timber import TIMBER_COLUMNS

__all__ = [
    "BALANCED_CARBON_SCALE",
    "BALANCED_WORLD",
    "BorealEnv",
    "BorealVectorEnv",
    "DEFAULT_YEARS",
    "FIELD_OBJECTIVES",
    "HISTORY_NAMES",
    "MODES",
    "MaskFunction",
    "NO_CHANGE",
    "OBSERVATION",
    "OBSERVATION_GROUPS",
    "OBSERVATION_NAMES",
    "Objective",
    "Observed",
    "PAPER_OBJECTIVES",
    "READY_OBJECTIVES",
    "REWARD_COLUMNS",
    "Reward",
    "THAW_FORMULATIONS",
    "TIMBER_COLUMNS",
    "action_masks",
    "carbon_reward",
    "check_weights",
    "draw_weights",
    "in_unit",
    "objective_names",
    "observed_weights",
    "reward_components",
    "rewards_of_year",
    "sample_site_observations",
    "thaw_reward",
    "valid_actions",
    "where_valid",
    "warm_up",
]


MOST_ENVS = 1_000_000  # in lockstep: their episodes' records alone are 50 GB


def warm_up(num_envs: int = 1, threads: int | None = None) -> None:
    """Compile the physics for `num_envs` stands in lockstep on so many threads, or load it from the disk cache.

    Called before worker processes are forked (with 1: each has one stand), it saves each of them the compilation.
    """
    kernel(lanes_for(positive_integer("num_envs", num_envs), check_threads(threads)))


class Described:
    """What both environments say of themselves."""

    _spec: EnvSpec | None = None
    _lockstep: dict = {}  # of a vector environment: how it is stepped

    def _describe(self, number: int, arguments: dict, own: tuple[str, ...], threads: int | None = None) -> None:
        """Check the arguments, make the episodes with their stands, and copy what they say of themselves."""
        self._arguments = check_arguments(arguments, own)
        self._episodes = Episodes(number, threads=threads, **self._arguments)
        self.mode: str = self._episodes.mode
        self.years: int = self._episodes.years
        self.site_seed: int | None = self._episodes.site_seed
        self.thaw_formulation: str = self._episodes.thaw_formulation
        self.observation_names: tuple[str, ...] = self._episodes.observation_names
        self.objective_names: tuple[str, ...] = self._episodes.objective_names
        self.reward_space: Box = self._episodes.reward_space
        self.reward_dim = len(self.objective_names)

    @property
    def spec(self) -> EnvSpec | None:
        """What gymnasium.make made it of; max_episode_steps is its years, with no TimeLimit: an episode ends itself."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec
        if spec is not None:
            spec.max_episode_steps = self.years

    def mask_function(self) -> MaskFunction | None:
        """Observations (n, entries) -> valid actions, bool (n, 25); None where they lack the density or the ages."""
        return self._episodes.mask_function

    def lockstep(self, num_envs: int, **changes) -> "BorealVectorEnv":
        """So many of these environments in lockstep: the same arguments (and groups and threads), but for `changes`.

        TypeError for a subclass of BorealEnv, whose own methods would be lost.
        """
        if isinstance(self, BorealEnv) and type(self) is not BorealEnv:
            raise TypeError(f"{type(self).__name__}: lockstep is of BorealEnv itself, whose subclass it would ignore")
        return BorealVectorEnv(num_envs, **{**self._arguments, **self._lockstep, **changes})


# ---------------------------------------------------------------------------------------------------------------
# The environment
# ---------------------------------------------------------------------------------------------------------------


class BorealEnv(Described, gym.Env, EzPickle):
    """
    ## Description
    A boreal stand on permafrost is managed for 50 years: each year a forester plants or thins, then the stand's
    energy, water and carbon are simulated at a half-hourly step. Two objectives: store carbon, and keep heat out of
    the permafrost.

    ## Observation Space
    `Box` of 105 values, or 43 in site-specific mode, without the 62 site parameters, float32;
    `boreal_env.OBSERVATION` has the name, unit, normalisation and limits of each, `observation_names` the names of
    those that this environment gives. The first is the preference for carbon (of m objectives the weights of the first
    m - 1, `preference_<objective>`; a single objective has none). Where two years are given, the most recent is
    first. Age fractions are of all stems: seedlings of 0-5 years, saplings 6-20, young 21-40, mature 41-100, old from
    101.

    ## Action Space
    `Discrete(25)`: action = 5 x density index + mix index; density changes (-100, -50, 0, 50, 100) stems/ha, conifer
    mixes (0, 0.25, 0.5, 0.75, 1). Planting adds seedlings of that mix; thinning cuts the oldest class first, so that
    the remaining stand nears the mix. Without a change of density the mix has nothing to act on: 10 to 14 are alike,
    and 12 stands for doing nothing. `action_masks()` says which actions can be carried out in full; the others are
    legal, do what can be done, and cost a penalty. Planting ends at 2000 stems/ha, thinning at 150, and it cuts only
    trees of `harvest_min_class` and older. What would end at 2000 exactly is masked, against rounding, though it is
    done in full. The density penalty is another: a stand at or above `density_limit` (2000) after the action costs it,
    whatever the action, valid or not.

    ## Reward Space
    `Box(-1, 1, (2,))`: [carbon, thaw]. Carbon: net change of biomass, dead wood, soil and products over `carbon_scale`,
    less penalties. Thaw: a year's heat up through a boundary of fixed temperature, 12 m deep, less 2.5 times the heat
    down through it, over 40 MJ/m2. Also available: thaw as the field measures it, "active_layer", 1 - thaw depth /
    1 m, and "permafrost_heat", -1 - heat of the upper 3 m / 135 MJ/m2 (1 is frozen at -2 degC, -1 thawed at 0 degC);
    "timber", the year's net revenue at the prices of `timber`, discounted, over 3000 EUR/ha, so that the return is the
    net present value over that; and "biodiversity", a quarter of an index in [0, 1] of species and ages, old trees,
    dead wood and open ground. Any other objective is a function of the year's record: `objectives=("carbon", "thaw",
    Objective("harvest", value, 0, 1))`.
    The preference has a weight for each, none negative, 1 in sum; of two it is given as one number, the first's.

    ## Starting State
    Site, first stocks and ages, weather and preference are drawn anew in generalist mode, and are fixed in
    site-specific mode (but the preference). Soil, snow and water are spun up, run for years before the first; dead
    wood is what deaths keep up.

    ## Which Id
    `boreal-balanced-v0` is the task to study policies with: the ground below is in balance with the climate and the
    first stand above it, the soil's carbon with its litter, weather varies from day to day as on record, and both
    returns vary equally between a site's non-dominated policies. `boreal-generalist-v0` and
    `boreal-site-specific-v0` are the paper's: use them to compare with it. There the boundary's temperature is drawn
    without regard to the climate, and so which site was drawn decides nearly all of the thaw return (in the balanced
    task, most of it). `boreal-timber-v0` is the balanced task with a third objective, timber at Finnish prices,
    `boreal-four-v0` with biodiversity as a fourth.
    `boreal-warming-v0` is the balanced task from 2025 on under the scenario SSP2-4.5: the ground starts in balance with
    the climate of 1995-2014, and warms.

    ## Episode Termination
    After 50 years the episode is terminated: nothing is worth anything beyond.

    ## Arguments
    Where values are named, the first is the default.
    - `mode`: "generalist" or "site-specific" (one site: that of `site_seed`, else the middle of all ranges)
    - `years`: length of an episode (50)
    - `time_step_minutes`: a divisor of 1440, at most 120 (30)
    - `backend`: "numba", "python" (the same source, interpreted) or "cuda" (a GPU, for thousands)
    - `thaw_formulation`: "asymmetric" (heat up less 2.5 times heat down, over 40 MJ/m2), "contrast" ((up - down) /
      (up + down)) or "raw_degree_days" ((up - down) over 40 MJ/m2; the name is the paper's)
    - `fixed_preference`: weight of carbon in [0, 1] instead of a drawn one, or the weights of all objectives
    - `site_seed`: one site (`sim.sample_site(site_seed)`) instead of a new one each episode
    - `parameter_overrides`: site parameter -> value or (low, high), see `sim/site_parameters.csv`; nothing else of the
      site changes, but with `latitude_deg` the mean annual temperature, which is drawn around its latitude's
    - `initial_ranges`: first stock -> (low, high), see `sim.INITIAL_RANGES`; biomass is at most 120 kgC a stem,
      and the stems' age follows from it unless `oldest_age_years` has a range
    - `hwp_half_life_years`: half-life of wood products (None: for ever)
    - `harvest_min_class`: youngest class that may be cut: "young" (from 21 years on), "mature" or "old"
    - `reward`: a `Reward`, or a dict of the constants to change
    - `balanced`: of the reward alone: whether `carbon_scale`, unless `reward` gives it, is 1.8 (`boreal-balanced-v0`)
      instead of 2; the ground's balance is `boundary`, `soil_carbon` and `weather`
    - `boundary`: "sampled" with the site, or "balanced" (`boreal-balanced-v0`): the temperature far below is the one
      at which no heat flows there under the site's own first stand, found by the spin-up, whatever the site's own.
      The observation shows it, and it may leave the sampled range of 268-272 K
    - `soil_carbon`: first soil carbon "drawn", or "balanced" (`boreal-balanced-v0`): what the first stand's litter
      keeps up, at least 2 kgC/m2; as drawn without trees
    - `weather`: "paper", or "observed" (`boreal-balanced-v0`): temperature, wet days and wind vary from day to day as
      on record, and means stay
    - `scenario`: None, or climate change from the first year, 2025, on: "ssp126", "ssp245" (`boreal-warming-v0`) or
      "ssp585", to 2100, or a dict or DataFrame with a value a year of any of `warming_k`, `warming_amplitude_k` (on the
      warmest day; below 0, winters warm more), `precipitation_factor` and `co2_ppm`, from 2025 on or beside its years
      (a column `year`, the index, or the keys of a dict in a column's place). It is not observed, but the year is,
      and the path is the same in every episode; the climate that is observed stays the site's own
    - `objectives`: of the reward vector, "carbon", "thaw" (these two), "active_layer", "permafrost_heat", "timber",
      "biodiversity" and any `Objective` of your own
    - `timber`: None, or prices and costs, which "timber" needs: "finland", "sweden" or "canada" of
      `sim/timber_prices.csv`, a .csv of one country with the same columns, or a dict of all its items in EUR; the
      record then has the revenue, the last step's info the net present value
    - `discount_rate`: of that, a year's (0.03); without `timber` none is allowed
    - `mechanisms`: switches of the physics, see `sim.MECHANISMS`
    - `constants`: literature constants to override, see `sim/constants.csv`
    - `observation_groups`: groups of the observation to keep, of `boreal_env.OBSERVATION_GROUPS`, whose order they keep
    - `record_years`: put the annual record into the last step's info, as `info["years"]`
    - `record_steps`: put the year's record into every step's info, as `info["record"]`, a number a column
    - `render_mode`: None or "rgb_array"

    ## Reset and Step
    `reset(seed=, options={"preference": w, "site": {name: value}})`; what the site does not name is drawn, and
    `sim.middle_site` names all. The option "preference" goes before `fixed_preference`. Seeds are at most 2^63 - 1.
    `info` is empty but for the last step, where it has the episode's totals (and for `record_steps`). Bad values raise
    ValueError, a step before reset or after the end RuntimeError (of `gym.make`, before reset, ResetNeeded).

    ## Attributes and Methods
    `objective_names`, `reward_dim`, `mode`, `years`, `thaw_formulation`, `site_seed` and `observation_names` are
    attributes. `lockstep(num_envs, **changes)` gives a `BorealVectorEnv` with the same arguments but for the changes,
    `mask_function()` a function of observations (n, entries) to valid actions, bool (n, 25), which can be pickled; it
    is None where `observation_groups` leave out "state" or "age". A wrapped environment is asked as `env.unwrapped`.

    ## Saving
    `get_state()` has everything that the future depends on, the running episode and the generators; `set_state` gives
    it to another environment with the same arguments. One of `gym.make` is asked as `env.unwrapped`, and counts as
    begun only after a `reset`. `pickle` and `copy.deepcopy` keep the arguments alone: their copy has to be reset, or
    given the state.

    ## Credits
    After BoreaRL (Dsouza et al. 2025, arXiv 2509.19846).
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 5}

    def __init__(self, *, render_mode: str | None = None, **kwargs):
        EzPickle.__init__(self, render_mode=render_mode, **kwargs)
        if render_mode is not None:
            if render_mode not in self.metadata["render_modes"]:
                raise ValueError(f"render_mode {brief(render_mode)}: allowed are rgb_array, None")
            if importlib.util.find_spec("matplotlib") is None:
                raise gym.error.DependencyNotInstalled('render_mode "rgb_array": pip install matplotlib')
        self.render_mode = render_mode
        self._describe(1, kwargs, ("render_mode",))
        self.observation_space = self._episodes.observation_space
        self.action_space = Discrete(NUM_ACTIONS)
        self._begun_with: int | None = None  # seed of the last reset, if all of the episode follows from it

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Start an episode. options: "preference" (see `fixed_preference`) and "site" (parameter -> value)."""
        options = check_reset_options(options)
        preference, site = options.get("preference"), options.get("site")
        weights = None if preference is None else check_weights(preference, self.reward_dim)
        sim.middle_site(site)
        super().reset(seed=None if seed is None else check_seed("seed", seed))
        self._begun_with = None if site else seed
        self._episodes.begin([0], [self._episodes.draw(self.np_random)], [weights], [site])
        return self._episodes.observations()[0], {}

    def step(self, action):
        """One year under `action`, an integer in [0, 25)."""
        values = as_array(action)
        if values.size != 1:
            raise ValueError(f"action {action!r}: one integer in [0, {NUM_ACTIONS}) is allowed")
        reward = self._episodes.advance(values.reshape(1))[0]
        terminated = not bool(self._episodes.running[0])
        info = self._episodes.final_info(0) if terminated else {}
        if self._episodes.record_steps:
            info["record"] = {name: float(column[0]) for name, column in self._episodes.year_record().items()}
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

    def pareto_front(self, gamma: float) -> list[np.ndarray]:
        """The best known front of the episode, discounted returns (m,) each, as mo-gymnasium's environments have it.

        Known for the first 50 test sites alone, after `reset(seed=)` of theirs: returns of the plans that
        `analysis/best_plans.py` found for this very weather and these dice, which are played anew (seconds). A plan
        that is worth most at another `gamma` than 1 may be missing.
        """
        factors = discounts(gamma, self.years)
        plans = plans_of(self._arguments, self._begun_with, REGISTERED)
        rewards = play_plans(self.lockstep(len(plans)), self._begun_with, plans, self.years)
        return list(undominated(np.einsum("pym,y->pm", rewards, factors)))

    def get_state(self) -> dict:
        """Everything the future depends on, generators included; picklable."""
        return {"episodes": self._episodes.get_state(), "generator": self.np_random.bit_generator.state}

    def set_state(self, state: dict) -> None:
        """Continue from `get_state`."""
        check_saved(state, "single")
        generator = restored_generator(state["generator"])
        if generator is None:
            raise ValueError("state: a generator's state is allowed, got None")
        self._episodes.set_state(state["episodes"])
        self.np_random, self._begun_with = generator, None


# ---------------------------------------------------------------------------------------------------------------
# The vector environment: all stands in lockstep, one compiled call, all cores
# ---------------------------------------------------------------------------------------------------------------


class BorealVectorEnv(Described, VectorEnv, EzPickle):
    """`num_envs` environments in lockstep, without worker processes; arguments as for `BorealEnv`.

    With the same seeds and actions it gives the trajectories of `num_envs` single environments. Episodes that end
    start anew within the step (`AutoresetMode.SAME_STEP`); infos then have `final_obs` and `final_info`.
    `reset(seed=s, options={"preference": for all or a sequence, "site": one dict or a sequence, "reset_mask": bool
    array})`, where stand i has the seed s + i, or one of a sequence, and only stands of the mask start anew.
    `action_masks()`, bool (num_envs, 25), is `call("action_masks")`, too; `weights()` are the preferences,
    `stable_baselines3()` makes a VecEnv ([clients](clients.md)).

    `group_size` neighbours share site, start, weather and dice (draws of fire, insects and deaths) in every episode,
    not the preference: all but that are drawn from the seed of a group's first stand. The options "site" and
    "reset_mask" have to be the same within a group. `threads`, one a core by default, share the stands.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        *,
        group_size: int = 1,
        threads: int | None = None,
        render_mode: str | None = None,
        **kwargs,
    ):
        EzPickle.__init__(self, num_envs, group_size=group_size, threads=threads, render_mode=render_mode, **kwargs)
        if render_mode is not None:
            raise ValueError(f"render_mode {render_mode!r}: the vector environment draws nothing; None is allowed")
        for name, value in (("num_envs", num_envs), ("group_size", group_size)):
            if not is_integer(value) or not 1 <= value <= MOST_ENVS:
                raise ValueError(f"{name}: an integer in [1, {MOST_ENVS}] is allowed, got {value!r}")
        if num_envs % group_size:
            raise ValueError(f"group_size = {group_size}: a divisor of num_envs = {num_envs} is allowed")
        self.num_envs, self.group_size = int(num_envs), int(group_size)
        self._lockstep = {"group_size": self.group_size, "threads": threads}
        try:
            self._describe(self.num_envs, kwargs, ("num_envs", "group_size", "threads"), threads)
        except MemoryError as error:
            raise ValueError(f"num_envs = {num_envs}: fewer are allowed here. {error}") from None
        self.single_observation_space = self._episodes.observation_space
        self.single_action_space = Discrete(NUM_ACTIONS)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._generators: list[np.random.Generator] | None = None

    def reset(self, *, seed=None, options: dict | None = None):
        """Start episodes. seed : an integer (environment i gets seed + i), or one integer or None for each."""
        self._check_open()
        options = check_reset_options(options, ("reset_mask",))
        mask = np.ones(self.num_envs, bool) if options.get("reset_mask") is None else options["reset_mask"]
        mask = np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ValueError(f"reset_mask: {self.num_envs} booleans, at least one True, are allowed, got {mask!r}")
        left = ~(mask | self._episodes.running)
        if left.any():
            raise ValueError(f"reset_mask: environment {left.argmax()} has not begun, and has to be among the first")
        weights = spread_weights(options.get("preference"), self.num_envs, self.reward_dim)
        sites = _spread("site", options.get("site"), self.num_envs)
        self._check_groups("site", [check_overrides(site) for site in sites])
        self._check_groups("reset_mask", mask.tolist())
        if isinstance(seed, (int, np.integer)) and not isinstance(seed, bool):
            if check_seed("seed", seed) > 2**63 - self.num_envs:
                raise ValueError(f"seed = {seed}: stand i gets seed + i, so at most 2^63 - {self.num_envs} is allowed")
            seed = [int(seed) + i for i in range(self.num_envs)]
        seeds = [seed if seed is None else check_seed("seed", seed) for seed in _spread("seed", seed, self.num_envs)]
        if self._generators is None:
            self._generators = [np.random.default_rng() for _ in range(self.num_envs)]
        for i, value in enumerate(seeds):
            if value is not None and mask[i]:
                self._generators[i] = gym.utils.seeding.np_random(value)[0]
        self._begin(np.flatnonzero(mask), weights, sites)
        return self._episodes.observations(), {}

    def step(self, actions):
        """A year of every stand under `actions`, integers (num_envs,)."""
        self._check_open()
        rewards = self._episodes.advance(actions)
        ended = ~self._episodes.running
        infos: dict = {}
        if self._episodes.record_steps:
            all_of_them = np.ones(self.num_envs, bool)
            record = self._episodes.year_record()
            infos = {"record": {**record, **{f"_{name}": all_of_them for name in record}}, "_record": all_of_them}
        observations = self._episodes.observations()
        if ended.any():
            indices = np.flatnonzero(ended)
            for i in map(int, indices):
                final = {"final_info": self._episodes.final_info(i), "final_obs": observations[i].copy()}
                if self._episodes.record_steps:
                    final["final_info"]["record"] = {name: float(column[i]) for name, column in record.items()}
                infos = self._add_info(infos, final, i)
            nothing = [None] * self.num_envs
            self._begin(indices, nothing, nothing)
            observations = self._episodes.observations()
        return observations, rewards, ended, np.zeros(self.num_envs, bool), infos

    def close_extras(self, **kwargs) -> None:
        """End the threads."""
        self._episodes.stands.close()

    def action_masks(self) -> np.ndarray:
        """Actions that can be carried out in full, bool, shape (num_envs, 25)."""
        return self._episodes.action_masks()

    def weights(self) -> np.ndarray:
        """The preference of every episode that is under way, as weights (num_envs, m)."""
        self._episodes.check_begun("weights")
        return self._episodes.weights.copy()

    def stable_baselines3(self):
        """These stands as a VecEnv of Stable-Baselines3, with masks for sb3-contrib: `pip install -e ".[sb3]"`.

        Each stand's reward is scalarised by its own preference, which it observes.
        """
        if importlib.util.find_spec("stable_baselines3") is None:
            raise gym.error.DependencyNotInstalled('stable_baselines3(): pip install -e ".[sb3]"')
        from sim.task.stable_baselines import LockstepVecEnv

        return LockstepVecEnv(self)

    def call(self, name: str, *args, **kwargs) -> tuple:
        """A method of every environment, as with gymnasium's AsyncVectorEnv: here `action_masks` only."""
        check_name("method", name, ("action_masks",))
        if args or kwargs:
            raise ValueError(f"call: action_masks takes no arguments, got {[*args, *kwargs.items()]}")
        return tuple(self.action_masks())

    def get_state(self) -> dict:
        """Everything the future depends on, generators included; picklable."""
        generators = [generator.bit_generator.state for generator in self._generators or []]
        return {
            "episodes": self._episodes.get_state(),
            "generators": generators or None,
            "group_size": self.group_size,
        }

    def set_state(self, state: dict) -> None:
        """Continue from `get_state`."""
        check_saved(state, "vector")
        if state["group_size"] != self.group_size:
            groups = f"groups of {brief(state['group_size'])}, these are of {self.group_size}"
            raise ValueError(f"state of {groups}: make both with the same group_size")
        generators = state["generators"]  # None before the first reset
        if generators is None and isinstance(state["episodes"], dict) and np.any(state["episodes"].get("running")):
            raise ValueError("state: generators of episodes that run are allowed, got None")
        if generators is not None:
            known = [restored_generator(saved) for saved in generators if saved] if isinstance(generators, list) else []
            if len(known) != self.num_envs:
                raise ValueError(f"state: generators of {self.num_envs} stands are allowed, got {len(known)}")
            generators = known
        self._episodes.set_state(state["episodes"])
        self._generators = generators

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

    def _begin(self, indices, weights, sites) -> None:
        generators = self._generators or []
        draws = [self._episodes.draw(generators[i]) for i in indices]
        if self.group_size > 1:
            leaders: dict[int, tuple] = {}
            for k, i in enumerate(indices):
                site_seed, episode_seed, _ = leaders.setdefault(i // self.group_size, draws[k])
                draws[k] = (site_seed, episode_seed, draws[k][2])
        self._episodes.begin(indices, draws, [weights[i] for i in indices], [sites[i] for i in indices])


def _spread(name, value, number) -> list:
    """One value for each environment, from one for all or a sequence."""
    if value is None or isinstance(value, dict) or np.ndim(value) == 0:
        return [value] * number
    if len(value) != number:
        raise ValueError(f"{name}: one value or {number} are allowed, got {len(value)}")
    return list(value)


# ---------------------------------------------------------------------------------------------------------------
# Registration
# ---------------------------------------------------------------------------------------------------------------
REGISTERED: dict[str, dict] = {
    "boreal-generalist-v0": {"mode": "generalist"},
    "boreal-site-specific-v0": {"mode": "site-specific"},
    "boreal-balanced-v0": {"mode": "generalist", "balanced": True, **BALANCED_WORLD},
    "boreal-timber-v0": {
        "mode": "generalist",
        "balanced": True,
        **BALANCED_WORLD,
        "objectives": ("carbon", "thaw", "timber"),
        "timber": "finland",
    },
    "boreal-four-v0": {
        "mode": "generalist",
        "balanced": True,
        **BALANCED_WORLD,
        "objectives": ("carbon", "thaw", "timber", "biodiversity"),
        "timber": "finland",
    },
    "boreal-warming-v0": {"mode": "generalist", "balanced": True, **BALANCED_WORLD, "scenario": "ssp245"},
}
if __name__ == "__main__":  # python -m boreal_env
    runpy.run_module("cleanrl_style.protocol.command_line", run_name="__main__")
else:
    for _name, _kwargs in REGISTERED.items():
        gym.register(
            id=_name,
            entry_point="boreal_env:BorealEnv",
            vector_entry_point="boreal_env:BorealVectorEnv",
            disable_env_checker=True,  # it warns at every vector reward
            kwargs=_kwargs,
        )
