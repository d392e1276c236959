"""Stands of one kind on many sampled sites, held as they are while weather, water, heat and carbon fluxes run.

On every 1 January trees, dead wood, soil carbon and organic layer are put back to those of the first year, so that the
fluxes belong to the stand described and not to what it grows into. All kinds have the same sites, weather and dice.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

import sim
from boreal_env import NO_CHANGE
from sim.stands import HELD_COLUMNS
from sim.state import DAILY_NAMES, DAYS

UNDISTURBED = {"fire": False, "insects": False}
MONTH = pd.date_range("2001-01-01", periods=DAYS).month.to_numpy()  # of each day of a year without leap day

#: Kind -> first stocks. 1500 stems/ha of one age class are a closed stand. Biomass: interior Alaska, conifers 5.6 (mean
#: of black spruce 3.2 and white spruce 8.0), deciduous 6.5 kgC/m2 (targets of DVM-DOS-TEM, the latter of Murphy Dome);
#: young stems a quarter of it, the ratio of their relative carbon (`sim.demography.stem_weight`). Soil carbon, which is
#: not given, is drawn from the environment's 2-10 kgC/m2, the same for all kinds.
KINDS = {
    "mature conifer": {"conifer_mature_stems_ha": 1500.0, "biomass_kgc_m2": 5.6},
    "mature deciduous": {"deciduous_mature_stems_ha": 1500.0, "biomass_kgc_m2": 6.5},
    "mature mixed": {"conifer_mature_stems_ha": 750.0, "deciduous_mature_stems_ha": 750.0, "biomass_kgc_m2": 6.0},
    "young mixed": {"conifer_young_stems_ha": 750.0, "deciduous_young_stems_ha": 750.0, "biomass_kgc_m2": 1.6},
    "old mixed": {"conifer_old_stems_ha": 750.0, "deciduous_old_stems_ha": 750.0, "biomass_kgc_m2": 6.0},
    "open": {"conifer_mature_stems_ha": 0.0, "biomass_kgc_m2": 0.0},
}


@dataclass(frozen=True)
class Run:
    """What stands did: `annual` by record name (years, sites); `months` by daily column (years, sites, 12), the mean
    of the month's days; `daily` by daily column (years, sites, 365), or empty."""

    annual: dict[str, np.ndarray]
    months: dict[str, np.ndarray]
    daily: dict[str, np.ndarray]

    def sites(self, name: str) -> np.ndarray:
        """Mean of an annual quantity over the years, (sites,)."""
        return self.annual[name].mean(axis=0)

    def season(self, name: str, months: tuple[int, ...]) -> np.ndarray:
        """Mean of a daily quantity over months of all years, (sites,)."""
        return np.nanmean(self.months[name][:, :, [month - 1 for month in months]], axis=(0, 2))


def hold(
    kind: dict,
    sites: int,
    years: int,
    skipped: int = 0,
    mechanisms: dict | None = None,
    site_overrides: dict | None = None,
    keep_daily: tuple[str, ...] = (),
    **world,
) -> Run:
    """Run a kind of stand on sampled sites 0 to `sites` - 1 for `skipped` + `years` years, the last of which are kept.

    kind : first stocks, one of `KINDS` or like them; site_overrides : of `sim.sample_site`; keep_daily : daily columns
    to keep day by day; world : other arguments of `sim.Stands`, such as weather and boundary.
    """
    stands = sim.Stands(sites, mechanisms=mechanisms, **world)
    numbers = np.arange(sites)
    parameters = [sim.sample_site(k, site_overrides) for k in range(sites)]
    seeds = [sim.episode_seeds(k) for k in range(sites)]
    stands.start(numbers, parameters, seeds, initial=dict.fromkeys(range(sites), kind))
    first = stands.state[:, HELD_COLUMNS].copy()

    annual, months, daily = [], [], []
    actions = np.full(sites, NO_CHANGE)
    for year in range(skipped + years):
        record, days = stands.step(actions, daily=True)
        stands.state[:, HELD_COLUMNS] = first
        if year < skipped:
            continue
        annual.append(record.copy())
        months.append(np.stack([_mean(days[:, MONTH == month]) for month in range(1, 13)], axis=1))
        daily.append(days[:, :, [DAILY_NAMES.index(name) for name in keep_daily]].copy())
    annual, months, daily = (np.stack(values) for values in (annual, months, daily))
    return Run(
        annual={name: annual[..., i] for i, name in enumerate(sim.RECORD_NAMES)},
        months={name: months[..., i] for i, name in enumerate(DAILY_NAMES)},
        daily={name: daily[..., i] for i, name in enumerate(keep_daily)},
    )


def _mean(days: np.ndarray) -> np.ndarray:
    """Mean over days, (sites, days, columns) to (sites, columns); NaN (albedo without sun) does not count."""
    valid = np.isfinite(days)
    number = valid.sum(axis=1)
    return np.where(number > 0, np.where(valid, days, 0.0).sum(axis=1) / np.maximum(number, 1), np.nan)
