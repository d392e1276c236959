"""An index of biodiversity in [0, 1], from what a stand has: the mean of four features, each from 0 to 1.

The features are of those that foresters' Index of Biodiversity Potential counts, all alike (Larrieu and Gonin 2008):
species and ages, old trees, dead wood, open ground.
"""

import numpy as np

from sim.demography import AGE_CLASSES
from sim.task.timber import SPECIES, VOLUME

CLASSES = tuple(f"{species}_{age}_stems_ha" for species in SPECIES for age in AGE_CLASSES)

#: Trees beyond 100 years [ha-1] that count in full: as many retention trees as FSC asks for in Sweden and Finland.
OLD_TREES = 10.0

#: Dead wood [m3 ha-1] that counts in full: upper end of the thresholds of most species of boreal conifer forests, 20-30
#: (Mueller and Buetler 2010).
DEADWOOD_M3 = 30.0

#: Open ground that counts in full, as boreal forests of 50 to 234 years have it in gaps (Kneeshaw and Bergeron 1998:
#: 7-40 %); where there is more than 0.9, the FAO's limit of forest, it counts nothing.
GAPS = (0.07, 0.40)
NO_FOREST = 0.9


def structure(year: dict[str, np.ndarray]) -> np.ndarray:
    """Shannon's index of the stems' species and age classes, over its largest value, that of ten equal classes."""
    stems = np.array([year[name] for name in CLASSES])
    whole = stems.sum(axis=0)
    shares = stems / np.where(whole > 0.0, whole, 1.0)
    return -(shares * np.log(np.where(shares > 0.0, shares, 1.0))).sum(axis=0) / np.log(len(CLASSES))


def old_trees(year: dict[str, np.ndarray]) -> np.ndarray:
    """Old trees, up to `OLD_TREES`."""
    old = year["conifer_old_stems_ha"] + year["deciduous_old_stems_ha"]
    return np.minimum(old / OLD_TREES, 1.0)


def deadwood(year: dict[str, np.ndarray]) -> np.ndarray:
    """Dead wood, at the density of fresh wood, up to `DEADWOOD_M3`."""
    conifer, deciduous = (VOLUME[species] * year[f"{species}_deadwood_kgc_m2"] for species in SPECIES)
    return np.minimum((conifer + deciduous) / DEADWOOD_M3, 1.0)


def open_ground(year: dict[str, np.ndarray]) -> np.ndarray:
    """Ground between crowns: in full within `GAPS`, less with less or more, nothing without gaps or without forest."""
    return np.interp(1.0 - year["crown_cover"], [0.0, *GAPS, NO_FOREST], [0.0, 1.0, 1.0, 0.0])


#: What "biodiversity" counts the index in: its return then varies between plans as those of carbon and thaw do, which
#: `analysis/studies/objective_scales.py` measures.
BIODIVERSITY_SCALE = 4.0


def biodiversity_reward(year: dict[str, np.ndarray]) -> np.ndarray:
    """The year's index over `BIODIVERSITY_SCALE`."""
    return biodiversity_index(year) / BIODIVERSITY_SCALE


def biodiversity_index(year: dict[str, np.ndarray]) -> np.ndarray:
    """Mean of the four features."""
    return np.clip(0.25 * (structure(year) + old_trees(year) + deadwood(year) + open_ground(year)), 0.0, 1.0)
