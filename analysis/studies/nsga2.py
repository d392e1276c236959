"""NSGA-II (Deb et al. 2002, by pymoo) over plans: a density change and a conifer mix for every block of years.

Two genes a block, each an index 0 to 4 on an ordered scale, and not the action's number, whose neighbours may be
opposite actions (4 cuts 100 stems, 5 cuts 50). Crossover exchanges a stretch of years; mutation draws genes anew.
"""

from collections.abc import Callable
from typing import NamedTuple

from cleanrl_style.flags import require

require("pymoo", extra="analysis")

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.mutation import Mutation
from pymoo.core.problem import Problem
from pymoo.core.repair import Repair
from pymoo.operators.crossover.pntx import TwoPointCrossover
from pymoo.optimize import minimize

LEVELS = 5
NO_CHANGE = 2  # density index
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
    pairs = [(density, mix) for density in range(LEVELS) for mix in range(LEVELS) if density != NO_CHANGE]
    return np.tile([(NO_CHANGE, HALF), *pairs], blocks)


def first_genes(blocks: int, number: int, generator: np.random.Generator) -> np.ndarray:
    """Plans to start from, (number or more, 2 x blocks): constant ones, a forester's, the rest at random.

    A forester's: plant the whole first fifth or two and then let grow, at every mix; conifers first and deciduous
    trees later, and the reverse.
    """
    forester = []
    for share in (0.2, 0.4):
        planting = max(1, round(share * blocks))
        forester += [[(4, mix)] * planting + [(NO_CHANGE, HALF)] * (blocks - planting) for mix in range(LEVELS)]
    half = blocks // 2
    forester += [[(4, a)] * half + [(4, b)] * (blocks - half) for a, b in ((4, 0), (0, 4))]
    genes = np.concatenate([constant_genes(blocks), np.reshape(forester, (len(forester), -1))])
    random = generator.integers(LEVELS, size=(max(number - len(genes), 0), 2 * blocks))
    return np.concatenate([genes, random])


def search(objectives: Callable, blocks: int, budget: Budget, seed: int) -> np.ndarray:
    """Genes of the non-dominated plans of the last generation, (k, 2 x blocks).

    objectives : function of genes (n, 2 x blocks) that gives what is to be maximised, (n, 2).
    """
    first = first_genes(blocks, budget.population, np.random.default_rng(seed))
    algorithm = NSGA2(
        pop_size=budget.population,
        sampling=first,
        crossover=TwoPointCrossover(),
        mutation=_DrawAnew(),
        repair=_OneGeneForNoChange(),
    )
    result = minimize(_Plans(objectives, 2 * blocks), algorithm, ("n_gen", budget.generations), seed=seed)
    return np.atleast_2d(result.X)


class _Plans(Problem):
    def __init__(self, objectives, genes):
        super().__init__(n_var=genes, n_obj=2, xl=0, xu=LEVELS - 1, vtype=int)
        self.objectives = objectives

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = -self.objectives(x)


class _DrawAnew(Mutation):
    """Each gene is drawn anew with probability one over their number."""

    def _do(self, problem, X, random_state=None, **kwargs):
        drawn = random_state.integers(LEVELS, size=X.shape)
        return np.where(random_state.random(X.shape) < 1.0 / X.shape[1], drawn, X)


class _OneGeneForNoChange(Repair):
    """A block without density change has no mix: one gene for it, so that equal plans are found out as duplicates."""

    def _do(self, problem, X, **kwargs):
        pairs = X.reshape(len(X), -1, 2).copy()
        pairs[:, :, 1] = np.where(pairs[:, :, 0] == NO_CHANGE, HALF, pairs[:, :, 1])
        return pairs.reshape(X.shape)
