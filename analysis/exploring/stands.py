"""A stand that is played year by year, each of which can be looked at again, and the sites that it may stand on."""

from dataclasses import dataclass
from importlib.resources import files

import gymnasium as gym
import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis.validation.tower_stands import SE_SVB, US_PRR
from cleanrl_style.protocol.sites import TABLE
from sim.spin_up import BOUNDARY
from sim.state import DAILY_NAMES
from sim.task.picture import View, view_of

YEARS = boreal_env.DEFAULT_YEARS

#: What the page calls a world -> its environment. In the paper's alone the ground far below is chosen with the site.
PAPER = "boreal-generalist-v0"
WORLDS = {
    "Ground in balance with climate": "boreal-balanced-v0",
    "The same, then warming (SSP2-4.5)": "boreal-warming-v0",
    "The paper's, ground chosen apart": PAPER,
}

#: What a place has of its own; all else is from the middle of the ranges that sites are sampled from.
CLIMATE = ("latitude_deg", "mean_annual_temperature_c", "seasonal_amplitude_c", BOUNDARY)
PLACES = {
    "Middle of all ranges": {},
    "Svartberget, Sweden (64.3 °N)": {name: SE_SVB.site[name] for name in CLIMATE},
    "Poker Flat, Alaska (65.1 °N)": {name: US_PRR.site[name] for name in CLIMATE},
}
PLACE_SEED = 1


@dataclass(frozen=True)
class Setting:
    """What all stands have in common: environment, all site parameters, and seed of first stand, weather and dice."""

    env_id: str
    site: dict[str, float]
    seed: int


def evaluation_sites() -> pd.DataFrame:
    """Sites that methods are evaluated on, numbered from 1: columns `site_seed`, and `seed` of the episode."""
    table = pd.read_csv(files("cleanrl_style.protocol") / TABLE)
    test = table[table.split == "test"]
    return test.set_index(np.arange(1, len(test) + 1))


def evaluation_site(number: int) -> tuple[dict[str, float], int]:
    """Parameters and seed of an evaluation site. Raises ValueError for a number that there is not."""
    table = evaluation_sites()
    if number not in table.index:
        raise ValueError(f"evaluation site {number}: 1 to {len(table)} are allowed")
    return sim.sample_site(int(table.site_seed[number])), int(table.seed[number])


def place(name: str) -> tuple[dict[str, float], int]:
    """Parameters and seed of one of `PLACES`."""
    return sim.middle_site(PLACES[name]), PLACE_SEED


def moved(site: dict[str, float], name: str, value: float) -> dict[str, float]:
    """The site with another value; to another latitude, the mean temperature of its latitude comes along.

    Raises ValueError for a value outside physical limits.
    """
    temperature = "mean_annual_temperature_c"
    at_latitude = sim.middle_site({name: value})
    along = {temperature: at_latitude[temperature]} if name == "latitude_deg" else {}
    return {**site, name: at_latitude[name], **along}


class Stand:
    """A stand from before its first year on. `look` goes back to a year; a step from there forgets what came after."""

    def __init__(self, setting: Setting, preference: float = 0.5):
        self.setting = setting
        self.weights = np.array([preference, 1.0 - preference])
        self.env = gym.make(setting.env_id).unwrapped
        options = {"preference": preference, "site": setting.site}
        self.observation, _ = self.env.reset(seed=setting.seed, options=options)
        self.year = 0  # that is looked at
        self.actions: list[int] = []  # of all years played, and so are rewards, carbon and thaw
        self.rewards = np.zeros((0, 2))
        self._ends = [(self.env.get_state(), self.observation)]  # of the years, the first before any

    @property
    def played(self) -> int:
        """Years played."""
        return len(self.actions)

    @property
    def masks(self) -> np.ndarray:
        """Actions that can be carried out in full, bool, shape (25,)."""
        return self.env.action_masks()

    @property
    def returns(self) -> np.ndarray:
        """Sums of the rewards up to the year looked at, shape (2,)."""
        return self.rewards[: self.year].sum(axis=0)

    def step(self, action: int) -> None:
        """A year on from the one looked at."""
        now = self.year
        self.observation, reward, *_ = self.env.step(action)
        self.actions = [*self.actions[:now], int(action)]
        self.rewards = np.vstack([self.rewards[:now], reward])
        self._ends = [*self._ends[: now + 1], (self.env.get_state(), self.observation)]
        self.year = now + 1

    def look(self, year: int) -> None:
        """Go to the end of a year that was played; 0 is before the first."""
        state, self.observation = self._ends[year]
        self.env.set_state(state)
        self.year = year

    def view(self) -> View:
        """What there is to draw of the year looked at, with the records of all years up to it."""
        return view_of(self.env._episodes, 0)

    def whole_view(self) -> View:
        """The same of the last year played."""
        now = self.year
        self.look(self.played)
        view = self.view()
        self.look(now)
        return view

    def days(self) -> pd.DataFrame:
        """Daily output of the year looked at, which is simulated once more for it; no rows before the first."""
        if self.year == 0:
            return pd.DataFrame(columns=DAILY_NAMES, dtype=float)
        now = self.year
        self.look(now - 1)
        _, daily = self.env._episodes.stands.step(np.array([self.actions[now - 1]]), daily=True)
        self.look(now)
        return pd.DataFrame(daily[0], columns=DAILY_NAMES)
