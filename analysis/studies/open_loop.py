"""Episodes under plans that are fixed beforehand, many in lockstep, and the sites and weathers they are played on.

A site here is its 62 parameters and the stand that it starts with; a weather is the dice of fifty years, disturbances
included. Every weather can be played on every site and under every plan, so that differences are paired.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

import boreal_env
import sim
from sim.physical_constants import FREEZING_POINT_K

# Beyond what an environment draws (below 2^31), and not met in training, evaluation or the measured balance.
FIRST_SITE_SEED = 3_000_000_000
FIRST_WEATHER_SEED = 4_000_000_000
CANDIDATES = 400

OBJECTIVES = ("carbon", "thaw")
PAPERS_REWARD = boreal_env.Reward()
RETURNS, GAINS = ([f"{name}_{what}" for name in OBJECTIVES] for what in ("return", "gain"))
_COLUMN = {name: i for i, name in enumerate(sim.RECORD_NAMES)}
_HARVESTABLE = slice(sim.demography.AGE_CLASSES.index("young"), None)  # the environment's default


class Episodes(NamedTuple):
    """What n episodes gave."""

    rewards: np.ndarray  # [carbon, thaw] as the environment gives them, (n, years, 2)
    actions: np.ndarray  # carried out, (n, years)
    record: np.ndarray  # annual records, (n, years, columns of sim.RECORD_NAMES)
    start: dict[str, np.ndarray]  # stocks of the first day, see sim.Stands.stocks

    def returns(self) -> np.ndarray:
        """Undiscounted sums of both rewards, (n, 2)."""
        return self.rewards.sum(axis=1)

    def clipped_years(self) -> np.ndarray:
        """Years in which each reward is at -1 or 1, where the policy no longer moves it, (n, 2)."""
        return (np.abs(self.rewards) >= 1.0).sum(axis=1)

    def last(self, name: str) -> np.ndarray:
        """A column of the last year's record, (n,)."""
        return self.record[:, -1, _COLUMN[name]]

    def total(self, name: str) -> np.ndarray:
        """A column of the record summed over the years, (n,)."""
        return self.record[:, :, _COLUMN[name]].sum(axis=1)

    def planted_conifers(self) -> np.ndarray:
        """Conifers planted in all years [stems ha-1], (n,)."""
        _, mix = sim.management.decode(self.actions)
        return (self.record[:, :, _COLUMN["planted_stems_ha"]] * mix).sum(axis=1)


def play(sites, seeds, plans, *, initial=None, **arguments) -> Episodes:
    """Play plans: an action where it can be carried out in full, no change elsewhere, as a masked agent would.

    sites : for each episode its 62 parameters by name; seeds : for each its `sim.Seeds`; plans : actions, integers
    (n, years); initial : episode -> first stocks, see `sim.Stands.start`; arguments : of `sim.Stands`, such as
    constants, weather, boundary, threads. Rewards are the paper's.
    """
    plans = np.asarray(plans)
    everyone = np.arange(len(plans))
    stands = sim.Stands(len(plans), **arguments)
    stands.start(everyone, sites, seeds, initial)
    start = stands.stocks(everyone)
    rewards = np.empty((*plans.shape, 2))
    actions = np.empty(plans.shape, dtype=int)
    record = np.empty((*plans.shape, len(sim.RECORD_NAMES)))
    for year in range(plans.shape[1]):
        actions[:, year] = boreal_env.where_valid(plans[:, year], valid_actions(stands.stocks(everyone)))
        record[:, year] = stands.step(actions[:, year])
        rewards[:, year] = rewards_of_year(record[:, year], actions[:, year])
    return Episodes(rewards, actions, record, start)


def rewards_of_year(record, actions, reward=PAPERS_REWARD) -> np.ndarray:
    """[carbon, thaw] of a year, the paper's unless told, (n, 2); record (n, columns of sim.RECORD_NAMES), actions
    (n,)."""
    parts = boreal_env.rewards_of_year(record, actions, reward, "asymmetric")
    return np.column_stack([parts[f"{name}_reward"] for name in OBJECTIVES])


def valid_actions(stocks) -> np.ndarray:
    """Actions that stands with these stocks (`sim.Stands.stocks`) can carry out in full, bool (n, 25)."""
    density = stocks["density_stems_ha"]
    classes = stocks["age_classes"].reshape(len(density), 2, -1)
    return boreal_env.valid_actions(density, classes[:, :, _HARVESTABLE].sum(axis=(1, 2)))


def seeds(site_seed: int, weather: int) -> sim.Seeds:
    """Seeds of an episode: the site's own start, the dice of weather number `weather`."""
    dice = sim.episode_seeds(FIRST_WEATHER_SEED + weather)
    return dice._replace(start=sim.episode_seeds(site_seed).start)


def own_seeds(site_seed: int, weather: int, each: int) -> sim.Seeds:
    """Seeds of an episode under a weather that no other site has: number `weather` of the site's `each`.

    Sites that share weathers share their fires: a mean over them then varies by more than its sites tell.
    """
    return seeds(site_seed, (site_seed - FIRST_SITE_SEED) * each + weather)


def with_gains(plans: pd.DataFrame) -> pd.DataFrame:
    """A site's plans with GAINS: RETURNS less those of zero change on the same weather.

    plans : a row a plan and weather, with kind, actions (numbers, one a block of years) and weather.
    """
    unchanged = plans[[set(actions.split()) == {str(boreal_env.NO_CHANGE)} for actions in plans.actions]]
    reference = unchanged[unchanged.kind == "constant"].set_index("weather")[RETURNS]
    gains = plans[RETURNS].to_numpy() - reference.loc[plans.weather].to_numpy()
    return plans.assign(**dict(zip(GAINS, gains.T, strict=True)))


def site_features(site: dict[str, float]) -> dict[str, float]:
    """What a site's thaw is expected to hang on."""
    boundary = site["deep_boundary_temperature_k"] - FREEZING_POINT_K
    return {
        "boundary_above_air_k": boundary - site["mean_annual_temperature_c"],
        "snow_mm_day": site["winter_snow_prob"] * site["winter_snow_mm_day"],
        "latitude_deg": site["latitude_deg"],
    }


def spanning_sites(number: int) -> list[int]:
    """Seeds of sites that span what is sampled, the most central first.

    Of `CANDIDATES` sampled sites, the next is always the one farthest from those chosen (Kennard and Stone 1969), in
    ranks of the three features; so the first few span the ranges too.
    """
    if not 1 <= number <= CANDIDATES:
        raise ValueError(f"number of sites {number}: 1 to {CANDIDATES} are allowed")
    ranks = _feature_ranks()
    chosen = [int(((ranks - 0.5) ** 2).sum(axis=1).argmin())]
    while len(chosen) < number:
        gaps = ((ranks[:, None] - ranks[chosen]) ** 2).sum(axis=2).min(axis=1)
        chosen.append(int(gaps.argmax()))
    return [FIRST_SITE_SEED + k for k in chosen]


def quartile_sites() -> list[int]:
    """Seeds of three sites: the median, lower and upper quartile of boundary minus air temperature, else typical."""
    ranks = _feature_ranks()
    wanted = [(quantile, 0.5, 0.5) for quantile in (0.5, 0.25, 0.75)]
    return [FIRST_SITE_SEED + int(((ranks - point) ** 2).sum(axis=1).argmin()) for point in wanted]


def _feature_ranks() -> np.ndarray:
    """Ranks of the candidates' features, scaled to [0, 1], (CANDIDATES, 3)."""
    sites = [sim.sample_site(FIRST_SITE_SEED + k) for k in range(CANDIDATES)]
    features = np.array([list(site_features(site).values()) for site in sites])
    return features.argsort(axis=0).argsort(axis=0) / (CANDIDATES - 1)
