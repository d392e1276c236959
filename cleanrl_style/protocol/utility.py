"""What returns are worth at a preference: the utility that a training maximises and its evaluation reports."""

from dataclasses import dataclass

import numpy as np

from cleanrl_style.protocol.fronts import scalarize

SCALARIZATIONS = ("linear", "chebyshev")


@dataclass(frozen=True)
class Utility:
    """The weighted sum of returns or, with an ideal point, Chebyshev's: minus the largest weighted shortfall from it.

    ideal : a return for each objective, fixed by the task. An objective of weight 0 does not count. Chebyshev's is not
    linear: it is the utility of each episode's own return (expected scalarised return, ESR), and means are over those.
    """

    ideal: tuple[float, ...] | None = None

    @property
    def scalarization(self) -> str:
        """Its name among `SCALARIZATIONS`."""
        return SCALARIZATIONS[self.ideal is not None]

    def __call__(self, returns: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Utility (...) of returns (..., m) at weights (..., m)."""
        if self.ideal is None:
            return scalarize(returns, weights)
        return -np.where(weights > 0, weights * (np.array(self.ideal) - returns), -np.inf).max(-1)

    def gain(self, before: np.ndarray, added: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """What `added` (..., m) is worth to who has `before` (..., m).

        Year by year of an episode these sum to the utility of its return less that of none, so that they can be
        rewards.
        """
        if self.ideal is None:
            return scalarize(added, weights)
        return self(before + added, weights) - self(before, weights)


LINEAR = Utility()
