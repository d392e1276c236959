"""NSGA-II (Deb et al. 2002, by pymoo) over plans (genes.py): crossover exchanges a stretch of years, mutation draws
genes anew."""

from collections.abc import Callable

from cleanrl_style.flags import require

require("pymoo", extra="planners")

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.mutation import Mutation
from pymoo.core.problem import Problem
from pymoo.core.repair import Repair
from pymoo.operators.crossover.pntx import TwoPointCrossover
from pymoo.optimize import minimize

from analysis.studies.genes import HALF, LEVELS, UNCHANGED, Budget, first_genes


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
        pairs[:, :, 1] = np.where(pairs[:, :, 0] == UNCHANGED, HALF, pairs[:, :, 1])
        return pairs.reshape(X.shape)
