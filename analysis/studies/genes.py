"""Plans as NSGA-II searches them: a density change and a conifer mix for every block of years.

Two genes a block, each an index 0 to 4 on an ordered scale, and not the action's number, whose neighbours may be
opposite actions (4 cuts 100 stems, 5 cuts 50).
"""

from typing import NamedTuple

import numpy as np

LEVELS = 5
UNCHANGED = 2  # density index
HALF = 2  # mix index


class Budget(NamedTuple):
    """How long is searched, and on how many weathers."""

    population: int
    generations: int
    weathers: int  # the search plays each plan on
    report_weathers: int  # others, that the plans found are reported on


def plans(genes: np.ndarray, block_years: int, years: int) -> np.ndarray:
    """Actions (n, years) of genes (n, 2 x blocks): density index and mix index of each block in turn."""
    pairs = np.asarray(genes).reshape(len(genes), -1, 2)
    return np.repeat(LEVELS * pairs[:, :, 0] + pairs[:, :, 1], block_years, axis=1)[:, :years]


def constant_genes(blocks: int) -> np.ndarray:
    """The constant plans: no change, and every density change with every mix, (21, 2 x blocks)."""
    pairs = [(density, mix) for density in range(LEVELS) for mix in range(LEVELS) if density != UNCHANGED]
    return np.tile([(UNCHANGED, HALF), *pairs], blocks)


def first_genes(blocks: int, number: int, generator: np.random.Generator) -> np.ndarray:
    """Plans to start from, (number or more, 2 x blocks): constant ones, a forester's, the rest at random.

    A forester's: plant the whole first fifth or two and then let grow, at every mix; conifers first and deciduous
    trees later, and the reverse.
    """
    forester = []
    for share in (0.2, 0.4):
        planting = max(1, round(share * blocks))
        forester += [[(4, mix)] * planting + [(UNCHANGED, HALF)] * (blocks - planting) for mix in range(LEVELS)]
    half = blocks // 2
    forester += [[(4, a)] * half + [(4, b)] * (blocks - half) for a, b in ((4, 0), (0, 4))]
    genes = np.concatenate([constant_genes(blocks), np.reshape(forester, (len(forester), -1))])
    random = generator.integers(LEVELS, size=(max(number - len(genes), 0), 2 * blocks))
    return np.concatenate([genes, random])
