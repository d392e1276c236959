"""Episodes side by side: what the environment of one stand and that of many in lockstep share."""

import inspect
from collections.abc import Iterator, Sequence
from dataclasses import asdict

import numpy as np
import pandas as pd
from gymnasium.spaces import Box

import sim
from sim.management import check_actions
from sim.parameters import check_name, check_noise, check_overrides, check_seed, is_integer
from sim.saved import check_array, check_keys, check_settings
from sim.spin_up import BOUNDARY, check_initial_ranges, middle_stocks
from sim.task.actions import MaskFunction, mask_function, unchanged
from sim.task.objectives import (
    HISTORY_NAMES,
    PAPER_OBJECTIVES,
    THAW_FORMULATIONS,
    TIMBER,
    Objective,
    Reward,
    check_objectives,
    objective_names,
    rewards_of_year,
)
from sim.task.observation import Moment, Table, observation_rows
from sim.task.preference import check_weights, draw_weights, shown
from sim.task.timber import TIMBER_COLUMNS, Timber, countries

#: A new site each episode, whose parameters are observed; or a fixed one.
MODES = ("generalist", "site-specific")

#: The world of `boreal-balanced-v0`, as arguments of an environment or of `sim.Stands`; its reward's scale is no part.
BALANCED_WORLD = {"boundary": "balanced", "soil_carbon": "balanced", "weather": "observed"}
#: Length of an episode.
DEFAULT_YEARS = 50
SAVED = ("weights", "site_seeds", "episode_seeds", "year", "running", "history", "observed")  # besides the stands'


class Episodes:
    """`number` episodes side by side, on `threads` threads. Other arguments are those of `BorealEnv`, checked here."""

    def __init__(
        self,
        number,
        *,
        threads=None,
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
        timber=None,
        discount_rate=None,
        mechanisms=None,
        constants=None,
        weather="paper",
        boundary="sampled",
        soil_carbon="drawn",
        scenario=None,
        observation_groups=None,
        record_years=False,
        record_steps=False,
    ):
        check_name("mode", mode, MODES)
        check_name("thaw_formulation", thaw_formulation, THAW_FORMULATIONS)
        if not is_integer(years) or not 1 <= years <= 1000:
            raise ValueError(f"years: an integer in [1, 1000] is allowed, got {years!r}")
        if site_seed is not None:
            check_seed("site_seed", site_seed)
        switches = {"balanced": balanced, "record_years": record_years, "record_steps": record_steps}
        for name, value in switches.items():
            if not isinstance(value, (bool, np.bool_)):
                raise ValueError(f"{name}: True or False is allowed, got {value!r}")
        self.number, self.mode, self.years = number, mode, int(years)
        self.record_years, self.record_steps = bool(record_years), bool(record_steps)
        self.thaw_formulation, self.harvest_min_class = thaw_formulation, harvest_min_class
        self.reward = Reward.of(reward, bool(balanced))

        sim.middle_site(parameter_overrides)
        self.site_seed, self.parameter_overrides = site_seed, dict(parameter_overrides or {})
        self.initial_ranges = check_initial_ranges(initial_ranges)
        for name, how, ours, given in (
            (BOUNDARY, "boundary", boundary, self.parameter_overrides),
            ("soil_kgc_m2", "soil_carbon", soil_carbon, self.initial_ranges),
        ):
            if ours == "balanced" and name in given:
                raise ValueError(f"{name}: {how}='balanced' finds it; a value of your own is not allowed")

        objectives = check_objectives(objectives)
        self.fixed_weights = None
        if fixed_preference is not None:
            self.fixed_weights = check_weights(fixed_preference, len(objectives), "fixed_preference")
        self._name_columns(objectives, timber, discount_rate)
        self.stands = sim.Stands(
            number,
            time_step_minutes=time_step_minutes,
            backend=backend,
            constants=constants,
            mechanisms=mechanisms,
            weather=weather,
            boundary=boundary,
            soil_carbon=soil_carbon,
            scenario=scenario,
            hwp_half_life_years=hwp_half_life_years,
            harvest_min_class=harvest_min_class,
            threads=threads,
        )
        if self.stands.scenario is not None:
            self.stands.scenario.check_years(self.years)
        noise = "daily_noise_std_c"
        if noise in self.parameter_overrides:
            most = {noise: check_overrides(self.parameter_overrides)[noise][1]}
            check_noise({**most, **self.stands.constants, **self.stands.weather})
        self._choose_observation(observation_groups)

        self.weights = np.zeros((number, len(objectives)))
        self.site_seeds = np.zeros(number, dtype=np.int64)
        self.episode_seeds = np.zeros(number, dtype=np.int64)
        self.year = np.zeros(number, dtype=int)
        self.running = np.zeros(number, dtype=bool)
        self.history = np.zeros((number, self.years, len(self.history_names)))
        self.observed = np.zeros((number, len(self.table.rows)))  # values of all rows, in their units
        self.last_year = np.zeros((number, len(self.history_names)))

    def _name_columns(self, objectives, timber, discount_rate) -> None:
        """Columns of a year's record, and which of them are the reward."""
        if timber is None and TIMBER in objectives:
            raise ValueError(f"objective 'timber' needs prices: timber=, such as {', '.join(countries())}")
        if timber is None and discount_rate is not None:
            raise ValueError(f"discount_rate = {discount_rate!r}: it needs prices, timber=, such as {countries()[0]}")
        self.timber = None if timber is None else Timber(timber, discount_rate)
        self.objective_names = tuple(objective_names(objectives))
        self.own_objectives = [objective for objective in objectives if isinstance(objective, Objective)]
        self.history_names = (
            *HISTORY_NAMES,
            *(TIMBER_COLUMNS if self.timber else ()),
            *(f"{objective.name}_{what}" for objective in self.own_objectives for what in ("clipped", "reward")),
        )
        self.reward_columns = [self.history_names.index(f"{name}_reward") for name in self.objective_names]
        limits = [(o.low, o.high) if isinstance(o, Objective) else (-1.0, 1.0) for o in objectives]
        self.reward_space = Box(*np.array(limits, dtype=np.float32).T, dtype=np.float32)

    def _choose_observation(self, observation_groups) -> None:
        """All that can be observed (masks need it), and the entries of it that are."""
        self.table = Table(observation_rows(self.objective_names))
        self.masks = MaskFunction(self.table.names, self.harvest_min_class)
        rows = self.table.rows
        groups = check_groups(observation_groups, [row.group for row in rows])
        if self.mode == "site-specific":
            groups = tuple(group for group in groups if group != "site")
        self.entries = [i for i, row in enumerate(rows) if row.group in groups]
        if not self.entries:
            left = f"nothing is left to observe in mode {self.mode}"
            raise ValueError(f"observation_groups = {observation_groups!r}: {left}")
        kept = Table([rows[i] for i in self.entries])
        self.observation_names = kept.names
        self.mask_function = mask_function(kept.names, self.harvest_min_class)
        most = {row.name: row.high for row in rows}
        self.observation_space = kept.space(self.reward.largest_penalties(most["biomass"], most["soil"]))

    def draw(self, generator: np.random.Generator) -> tuple[int, int, np.ndarray]:
        """Site seed, episode seed and preference of an episode: always as many draws."""
        site_seed, episode_seed = int(generator.integers(2**31)), int(generator.integers(2**62))
        return site_seed, episode_seed, draw_weights(generator, len(self.objective_names))

    def begin(self, indices, draws, preferences, sites, initial=None) -> None:
        """Start episodes. draws : for each, `draw`'s result; preferences (weights), sites : lists with an
        entry for each, which may be None; initial : as of `sim.Stands.start`."""
        for site in sites:
            # a whole site, as `sim.sample_site` gives one, has the sampled temperature beside its other parameters
            if self.stands.boundary == "balanced" and BOUNDARY in (site or ()) and len(site) < len(sim.SITE_PARAMETERS):
                raise ValueError(f"site: {BOUNDARY}: boundary='balanced' finds it; a value of your own is not allowed")
        chosen, seeds, given = [], [], dict(initial or {})
        site_seeds, episode_seeds, all_weights = [], [], []
        for k, (site_seed, episode_seed, weights) in enumerate(draws):
            overrides = {**self.parameter_overrides, **(sites[k] or {})}
            if self.mode == "site-specific":
                # A fixed world: one site, one start, one weather, one set of disturbance dice.
                overrides.setdefault("daily_noise_std_c", 0.0)
                episode_seed = 0 if self.site_seed is None else self.site_seed
                given[k] = middle_stocks({**sim.INITIAL_RANGES, **self.initial_ranges})
            if self.site_seed is not None:
                site_seed = self.site_seed
            fixed_middle = self.mode == "site-specific" and self.site_seed is None
            chosen.append(sim.middle_site(overrides) if fixed_middle else sim.sample_site(site_seed, overrides))
            seeds.append(sim.episode_seeds(episode_seed))
            site_seeds.append(-1 if fixed_middle else site_seed)
            episode_seeds.append(episode_seed)
            wanted = self.fixed_weights if preferences[k] is None else preferences[k]
            all_weights.append(weights if wanted is None else wanted)
        self.running[indices] = False  # till they have started: after an error, reset
        self.stands.start(indices, chosen, seeds, given, self.initial_ranges)
        self.site_seeds[indices], self.episode_seeds[indices] = site_seeds, episode_seeds
        self.weights[indices] = all_weights
        self.year[indices] = 0
        self.running[indices] = True
        self.history[indices] = 0.0
        self.observe_start(np.asarray(indices))

    def advance(self, actions) -> np.ndarray:
        """A year for all episodes; returns float32 rewards (number, objectives)."""
        if not self.running.all():
            stopped = int(np.argmin(self.running))
            raise RuntimeError(f"step of environment {stopped}, whose episode is over or not begun: call reset first")
        actions = check_actions(actions, self.number)
        record = self.stands.step(actions)
        self.running = np.zeros(self.number, bool)  # till the year is whole: after an objective's error, reset
        parts = rewards_of_year(record, actions, self.reward, self.thaw_formulation)
        by_name = dict(zip(sim.RECORD_NAMES, record.T, strict=True))
        if self.timber:
            parts |= self.timber.columns(by_name, self.year)
        for objective in self.own_objectives:
            parts |= objective.columns(by_name | parts)
        added = np.array([parts[name] for name in self.history_names[record.shape[1] :]])
        year = np.concatenate([record, added.T], axis=1)
        self.history[np.arange(self.number), self.year] = self.last_year = year
        self.year = self.year + 1
        self.running = self.year < self.years
        self.observed = self.values_of(np.arange(self.number), year, actions, self.observed)
        return year.take(self.reward_columns, axis=1).astype(np.float32)

    def observe_start(self, indices: np.ndarray) -> None:
        """Observe stands that have just been started, as after a year in which nothing happened."""
        nothing = np.zeros((len(indices), len(self.history_names)))
        actions = unchanged(self.stands.stocks(indices)["conifer_fraction"])
        before = np.zeros((len(indices), len(self.table.rows)))
        self.observed[indices] = self.values_of(indices, nothing, actions, before)

    def values_of(self, indices, record, actions, before) -> np.ndarray:
        """Values of all rows (n, rows) for stands after a year; before : those of a year ago."""
        now = Moment(
            weights=self.weights[indices],
            year=self.year[indices],
            stocks=self.stands.stocks(indices),
            record=record,
            actions=actions,
            parameters=self.stands.parameters[indices],
            before=lambda name: before[:, self.table.names.index(name)],
        )
        return self.table.values(now)

    def observations(self) -> np.ndarray:
        """Fresh float32 observations, shape (number, entries)."""
        return self.table.normalised(self.observed)[:, self.entries].astype(np.float32)

    def action_masks(self) -> np.ndarray:
        """Actions that can be carried out in full, bool, shape (number, 25)."""
        self.check_begun("action_masks")
        return self.masks(self.table.normalised(self.observed).astype(np.float32))

    def check_begun(self, what: str) -> None:
        """Refuse what needs a stand before the first reset."""
        fresh = ~self.running & (self.year == 0)
        if fresh.any():
            raise RuntimeError(f"{what} of episode {int(np.argmax(fresh))} that has not begun: call reset first")

    def year_record(self) -> dict[str, np.ndarray]:
        """The record of the year that was stepped last, each column (number,)."""
        return {name: column.copy() for name, column in zip(self.history_names, self.last_year.T, strict=True)}

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
            "preference": shown(self.weights[i]),
            "final_density": float(years["density_stems_ha"][-1]),
            "mean_density": mean("density_stems_ha"),
            "final_conifer_fraction": float(years["conifer_fraction"][-1]),
            "mean_conifer_fraction": mean("conifer_fraction"),
            **{name: mean(name) for name in ("growing_season_days", "latent_heat_mj_m2", "ground_shortwave_mj_m2")},
        }
        if self.timber:
            info["net_present_value_eur_ha"] = float(years["discounted_revenue_eur_ha"].sum())
        if self.record_years:
            record = {name: column.copy() for name, column in years.items()}
            info["years"] = {"year": np.arange(1, self.year[i] + 1), **record}
        return info

    def get_state(self) -> dict:
        """All that the future depends on."""
        arrays = {name: getattr(self, name).copy() for name in SAVED}
        return {"settings": self._settings(), "stands": self.stands.get_state(), **arrays}

    def set_state(self, state: dict) -> None:
        """Continue from a `get_state` of one with the same arguments; ValueError, and nothing done, for any other."""
        what = "state of episodes"
        check_keys(what, state, ("settings", "stands", *SAVED))
        check_settings(what, state["settings"], self._settings())
        limits = {"weights": (0.0, 1.0), "year": (0, self.years)}
        for name in SAVED:
            low, high = limits.get(name, (-np.inf, np.inf))
            check_array(f"{what}: {name}", state[name], getattr(self, name), low, high)
        running, stands = state["running"], state["stands"]
        if not np.array_equal(running, running & (state["year"] < self.years)):
            raise ValueError(f"{what}: an episode that runs is before year {self.years}, got {state['year'].tolist()}")
        weights = state["weights"][running]
        if not np.allclose(weights.sum(axis=1), 1.0):
            raise ValueError(f"{what}: weights whose sum is 1 are allowed, got {weights.tolist()}")
        self.stands.check_state(stands)
        for i in np.flatnonzero(running):
            if stands["seeds"][i] is None or stands["years"][i] != state["year"][i]:
                raise ValueError(f"{what}: episode {i} runs in year {state['year'][i]}, its stand does not")
        self.stands.set_state(stands)
        for name in SAVED:
            setattr(self, name, state[name].copy())

    def _settings(self) -> dict:
        """Arguments that a state belongs to, as plain values; functions by their names."""
        timber = self.timber and {"prices": self.timber.prices, "discount_rate": self.timber.discount_rate}
        return {
            **self.stands.settings(),
            "mode": self.mode,
            "years": self.years,
            "thaw_formulation": self.thaw_formulation,
            "fixed_preference": None if self.fixed_weights is None else np.asarray(self.fixed_weights).tolist(),
            "site_seed": self.site_seed,
            "parameter_overrides": check_overrides(self.parameter_overrides),
            "initial_ranges": self.initial_ranges,
            "reward": asdict(self.reward),
            "objectives": self.objective_names,
            "limits of objectives": [(o.name, o.low, o.high) for o in self.own_objectives],
            "timber": timber,
        }


def check_groups(wanted, groups: Sequence[str]) -> tuple[str, ...]:
    """Groups of the observation to keep: those wanted, or all for None; groups : of each row."""
    if wanted is None:
        return tuple(groups)
    if isinstance(wanted, str) or not np.iterable(wanted):
        raise ValueError(f"observation_groups: a sequence of names is allowed, got {wanted!r}")
    wanted = tuple(wanted)
    for group in wanted:
        check_name("observation group", group, tuple(dict.fromkeys(("preference", *groups))))
    if len(set(wanted)) < len(wanted):
        raise ValueError(f"observation_groups {', '.join(wanted)}: each is allowed once")
    return wanted


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
    keys = {"single": ("episodes", "generator"), "vector": ("episodes", "generators", "group_size")}
    for other in keys:
        if other != kind and isinstance(state, dict) and set(state) == set(keys[other]):
            raise ValueError(f"state of a {other} environment given to a {kind} one")
    check_keys("state", state, keys[kind])


ARGUMENTS = tuple(name for name in inspect.signature(Episodes).parameters if name not in ("number", "threads"))


def check_arguments(arguments: dict, own: tuple[str, ...] = ()) -> dict:
    """A copy of an environment's arguments, all of which it has; own : those that it has beside these."""
    for name, value in arguments.items():
        if name not in ARGUMENTS:
            raise ValueError(f"unknown argument {name!r}; allowed: {', '.join((*ARGUMENTS, *own))}")
        if isinstance(value, Iterator):
            raise ValueError(f"{name}: what can be read once, {value!r}, is not allowed; a list of it is")
    return copied(arguments)


def copied(value):
    """Plain containers and tables anew, so that whoever gave them may change them; a function, say, as it is."""
    if type(value) is dict:
        return {name: copied(one) for name, one in value.items()}
    if type(value) in (list, tuple):
        return type(value)(map(copied, value))
    return value.copy() if isinstance(value, (np.ndarray, pd.DataFrame, pd.Series)) else value
