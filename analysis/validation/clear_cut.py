"""A clear-cut and the forest beside it, followed for some summers: what the cut does to the ground's heat and thaw.

Forest and cutover have the same sites, weather and dice, and the same forest before the cut. The organic layer stays.
"""

from dataclasses import dataclass

import numpy as np

import sim
from analysis.validation.held_stands import UNDISTURBED
from boreal_env import NO_CHANGE
from sim.stands import HELD_COLUMNS
from sim.state import DAILY_NAMES, STATE, STATE_NAMES

YEARS_BEFORE, YEARS_AFTER = 3, 3
MAY_TO_AUGUST = slice(120, 243)  # of the days of a year

#: Central Yakutia: the mean annual temperature is that of SRDB's Yakutsk stands; half-range and permafrost, from the
#: climate normals and boreholes, are from memory. Leaf area about 2.5 at the cover of 1500 stems; biomass of the larch
#: stand at Neleger, 170 years old (SRDB 2437).
YAKUTSK = {
    "latitude_deg": 62.3,
    "mean_annual_temperature_c": -10.0,
    "seasonal_amplitude_c": 29.0,
    "deep_boundary_temperature_k": 270.15,
    "max_lai_deciduous": 2.8,
}
LARCH = {"deciduous_mature_stems_ha": 1500.0, "biomass_kgc_m2": 5.3}


@dataclass(frozen=True)
class Cut:
    """Cutover less forest in each year after the cut, (years, sites): heat into the ground from May to August
    [MJ m-2], depth of thaw [m], annual mean at the top of the mineral soil [K]; and the forest's own thaw [m]."""

    heat: np.ndarray
    thaw: np.ndarray
    warming: np.ndarray
    forest_thaw: np.ndarray


def cut(site_overrides: dict, stand: dict, sites: int) -> Cut:
    """Fell a held stand on sampled sites 0 to `sites` - 1 after YEARS_BEFORE years."""
    numbers = [*range(sites), *range(sites)]  # forest, cutover
    stands = sim.Stands(len(numbers), mechanisms=UNDISTURBED)
    parameters = [sim.sample_site(k, site_overrides) for k in numbers]
    seeds = [sim.episode_seeds(k) for k in numbers]
    stands.start(np.arange(len(numbers)), parameters, seeds, initial=dict.fromkeys(range(len(numbers)), stand))
    trees = [STATE_NAMES.index(f"{species}_biomass") for species in ("conifer", "deciduous")]
    first = stands.state.copy()

    actions = np.full(len(numbers), NO_CHANGE)
    for _ in range(YEARS_BEFORE):
        stands.step(actions)
        stands.state[:, HELD_COLUMNS] = first[:, HELD_COLUMNS]
    first[sites:, trees + list(range(len(STATE), first.shape[1]))] = 0.0
    heat, thaw, top = [], [], []
    for _ in range(YEARS_AFTER):
        stands.state[:, HELD_COLUMNS] = first[:, HELD_COLUMNS]
        record, days = stands.step(actions, daily=True)
        heat.append(days[:, MAY_TO_AUGUST, DAILY_NAMES.index("ground_heat_mj_m2")].sum(axis=1))
        thaw.append(record[:, sim.RECORD_NAMES.index("active_layer_depth_m")].copy())
        top.append(record[:, sim.RECORD_NAMES.index("soil_top_temperature_c")].copy())
    heat, thaw, top = (np.stack(values).reshape(YEARS_AFTER, 2, sites) for values in (heat, thaw, top))
    difference = [values[:, 1] - values[:, 0] for values in (heat, thaw, top)]
    return Cut(*difference, forest_thaw=thaw[:, 0])
