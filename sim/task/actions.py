"""Which actions can be carried out in full: masks, from the stand or from what is observed of it.

An action is 5 x density index + mix index; `sim.management` decodes it and has the rule of what can be done.
"""

from collections.abc import Sequence

import numpy as np

from sim.demography import AGE_CLASSES
from sim.jit import uncompiled
from sim.management import (
    CONIFER_MIXES,
    DENSITY_CHANGES,
    NEGLIGIBLE_STEMS,
    NO_CHANGE,
    NUM_ACTIONS,
    check_actions,
    feasible_change,
)
from sim.parameters import check_name
from sim.task.observation import AGE_ENTRIES, SPECIES_AND_AGES, Reader, observation_rows

MAY_BE_CUT = AGE_CLASSES[AGE_CLASSES.index("young") :]
FIRST_UNCHANGED = DENSITY_CHANGES.index(0.0) * len(CONIFER_MIXES)

#: Entries of the observation that a mask is made of.
NEEDED = ("density", *AGE_ENTRIES)

CHANGES = np.array(DENSITY_CHANGES)
_feasible_change = uncompiled(feasible_change)


def unchanged(conifer_fraction: np.ndarray) -> np.ndarray:
    """Actions that neither plant nor thin, of the mix nearest to the stands', shape (n,)."""
    return FIRST_UNCHANGED + np.abs(conifer_fraction[:, None] - np.array(CONIFER_MIXES)).argmin(axis=1)


def valid_actions(density: np.ndarray, harvestable: np.ndarray) -> np.ndarray:
    """Actions whose whole density change can be made, bool, shape (n, 25).

    density, harvestable : stems, and those of an age that may be cut [stems ha-1], shape (n,). Both are taken for a
    little more, against the rounding of float32 observations: half of what the penalty forgives when thinning, and
    that far below the largest density when planting.
    """
    little = 0.5 * NEGLIGIBLE_STEMS
    valid = _feasible_change(CHANGES, density[:, None] + little, harvestable[:, None] + little) == CHANGES
    return np.repeat(valid, len(CONIFER_MIXES), axis=1)


def where_valid(actions: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Actions (n,) where masks (n, 25) bool allow them, `NO_CHANGE` where they do not."""
    masks = np.asarray(masks)
    if masks.ndim != 2 or masks.shape[1] != NUM_ACTIONS or masks.dtype != bool:
        raise ValueError(f"masks of shape {masks.shape}, {masks.dtype}: bool of shape (n, {NUM_ACTIONS}) is allowed")
    actions = check_actions(actions, len(masks), of="masks")
    return np.where(masks[np.arange(len(actions)), actions], actions, NO_CHANGE)


class MaskFunction:
    """Valid actions of observations with these entries, (n, names) -> bool (n, 25); picklable.

    youngest : the youngest age class that may be cut.
    """

    def __init__(self, names: Sequence[str], youngest: str):
        check_name("harvest_min_class", youngest, MAY_BE_CUT)
        self.width = len(names)
        self.read = Reader(NEEDED, names)
        old_enough = AGE_CLASSES[AGE_CLASSES.index(youngest) :]
        self.may_be_cut = [age_class in old_enough for _, age_class in SPECIES_AND_AGES]

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        observations = np.atleast_2d(np.asarray(observations))
        if observations.ndim != 2 or observations.shape[1] != self.width:
            raise ValueError(f"observations of shape {observations.shape}: (n, {self.width}) is allowed")
        needed = self.read(observations)
        if not np.isfinite(needed).all():
            raise ValueError("observations: finite densities and age fractions are allowed, got NaN or infinity")
        density, shares = needed[:, 0], needed[:, 1:]
        return valid_actions(density, density * shares[:, self.may_be_cut].sum(axis=1))


def mask_function(names: Sequence[str], youngest: str) -> MaskFunction | None:
    """The masks of observations with these entries; None where they lack the density or the ages."""
    return MaskFunction(names, youngest) if set(NEEDED) <= set(names) else None


def action_masks(observations: np.ndarray, harvest_min_class: str = "young", objectives: int = 2) -> np.ndarray:
    """Valid actions of observations: those whose whole density change can be made, and so cost no penalty.

    observations : (n, 43) or (n, 105) for two objectives, all groups of a mode; a reduced observation does not say
    which columns it has, but `env.unwrapped.action_masks()` and `env.unwrapped.mask_function()` know.
    harvest_min_class : "young", "mature" or "old". objectives : how many the environment has. Returns bool, shape
    (n, 25).
    """
    if isinstance(objectives, bool) or not isinstance(objectives, (int, np.integer)) or objectives < 1:
        raise ValueError(f"objectives: a positive integer is allowed, got {objectives!r}")
    whole = observation_rows([f"objective_{k + 1}" for k in range(objectives)])
    names = [row.name for row in whole]
    without_site = [row.name for row in whole if row.group != "site"]
    observations = np.atleast_2d(np.asarray(observations))
    for known in (without_site, names):
        if observations.ndim == 2 and observations.shape[1] == len(known):
            return MaskFunction(known, harvest_min_class)(observations)
    raise ValueError(
        f"observations of shape {observations.shape}: (n, {len(without_site)}) or (n, {len(names)}), all groups of a "
        "mode, are allowed; env.unwrapped.action_masks() works with any observation_groups"
    )
