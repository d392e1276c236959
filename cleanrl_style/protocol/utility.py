"""What returns are worth at a preference: the utility that a training maximises and its evaluation reports."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cleanrl_style.protocol.fronts import scalarize


class Utility(ABC):
    """The utility of an episode's return; another one is a class with its own `__call__` in `SCALARIZATIONS`.

    What is not linear is the utility of each episode's own return (expected scalarised return, ESR), and means are over
    those.
    """

    title: ClassVar[str] = "utility"  # as a run prints it

    @abstractmethod
    def __call__(self, returns: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Utility (...) of returns (..., m) at weights (..., m)."""

    def gain(self, before: np.ndarray, added: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """What `added` (..., m) is worth to who has `before` (..., m).

        Year by year of an episode these sum to the utility of its return less that of none, so that they can be
        rewards.
        """
        return self(before + added, weights) - self(before, weights)


@dataclass(frozen=True)
class Linear(Utility):
    """The weighted sum of returns."""

    title: ClassVar[str] = "weighted return"

    def __call__(self, returns: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Utility (...) of returns (..., m) at weights (..., m)."""
        return scalarize(returns, weights)

    def gain(self, before: np.ndarray, added: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """The same, whatever there was before, without the rounding of a difference."""
        return scalarize(added, weights)


@dataclass(frozen=True)
class Chebyshev(Utility):
    """Minus the largest weighted shortfall from an ideal point.

    ideal : a return for each objective, fixed by the task. An objective of weight 0 does not count.
    """

    ideal: tuple[float, ...]
    title: ClassVar[str] = "Chebyshev's utility"

    def __call__(self, returns: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Utility (...) of returns (..., m) at weights (..., m)."""
        return -np.where(weights > 0, weights * (np.array(self.ideal) - returns), -np.inf).max(-1)


#: What --scalarization names; one of your own is made without arguments.
SCALARIZATIONS = {"linear": Linear, "chebyshev": Chebyshev}
LINEAR = Linear()
