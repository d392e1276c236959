"""What is to be simulated on the sites of a region, whole or a chunk of it."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Plan:
    """A checked simulation, or a chunk of one."""

    table: pd.DataFrame
    actions: Any  # a policy, or integers (sites, years)
    years: int
    weights: np.ndarray
    others: str
    variables: tuple[str, ...]
    arguments: dict
    size: int  # sites of a chunk
    threads: int

    @property
    def chunks(self) -> int:
        """How many there are."""
        return math.ceil(len(self.table) / self.size)

    def rows(self, k: int) -> slice:
        """Sites of chunk k."""
        return slice(k * self.size, min((k + 1) * self.size, len(self.table)))

    def part(self, k: int) -> "Plan":
        """Chunk k alone."""
        actions = self.actions if callable(self.actions) else self.actions[self.rows(k)]
        return Plan(**{**vars(self), "table": self.table.iloc[self.rows(k)], "actions": actions})
