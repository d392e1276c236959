"""Heat conduction with phase change in any number of layers of mineral soil, driven by the organic layer above.

Freezing curve and mixing of conductivities are the simulator's (`sim.soil`), so that its two nodes and a column of
many thin layers differ in nothing but their layers.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sim import soil
from sim.jit import phase, uncompiled
from sim.parameters import CONSTANTS
from sim.physical_constants import (
    FREEZING_POINT_K,
    LATENT_HEAT_FUSION,
    SECONDS_PER_DAY,
    SECONDS_PER_HOUR,
    WATER_DENSITY,
)
from sim.soil import conductivity, frozen_share, temperature
from sim.state import DAYS

STABLE_SHARE = 0.8  # of the longest step of an explicit scheme
BALANCED_J_M2 = 2e4  # heat gained in a year of spin-up at which it ends
LONGEST_SPIN_UP_YEARS = 600


@dataclass(frozen=True)
class Grid:
    """Layers of mineral soil over a boundary of fixed temperature.

    edges : of the layers [m], from 0. nodes : depths at which the layers' temperatures stand [m]; None for their
    middles. boundary : its depth [m]. closures : whether soil above the first node conducts as the temperature above it
    has it, soil between last node and boundary as the mean of the two has it, and the last layer freezes no farther
    below its node than above it.
    """

    edges: tuple
    nodes: tuple | None = None
    boundary: float = CONSTANTS["boundary_depth_m"].low
    closures: bool = False

    @property
    def depths(self) -> np.ndarray:
        """Depths of the nodes [m], (layers,)."""
        return np.array(self.nodes) if self.nodes else 0.5 * (np.array(self.edges[1:]) + np.array(self.edges[:-1]))


class Ground(NamedTuple):
    """Conductivities [W m-1 K-1], heat capacities [J m-3 K-1], latent heat [J m-3], freezing range [K], boundary."""

    thawed_conductivity: float
    frozen_conductivity: float
    thawed_capacity: float
    frozen_capacity: float
    latent: float
    freezing_range: float
    boundary_c: float

    @classmethod
    def of(cls, parameters: dict) -> "Ground":
        """The ground of a site, from all its parameters by name."""
        thawed = parameters["soil_conductivity"]
        return cls(
            thawed,
            thawed * parameters["soil_frozen_conductivity_ratio"],
            parameters["soil_heat_capacity_thawed"],
            parameters["soil_heat_capacity_frozen"],
            LATENT_HEAT_FUSION * WATER_DENSITY * parameters["soil_freezing_water"],
            parameters["soil_freezing_range_k"],
            parameters["deep_boundary_temperature_k"] - FREEZING_POINT_K,
        )


class Above(NamedTuple):
    """What drives a column: temperature [degC] of what lies on the mineral soil, and the resistance from there to it
    [m2 K W-1], of each interval, the same number on every day."""

    temperature: np.ndarray
    resistance: np.ndarray


@phase
def conduct(driver, ground, closures, thickness, freezing, above, below, heat, daily, flux):
    """Conduct heat down a column, interval after interval, by explicit steps short enough to be stable.

    thickness, freezing : of each layer, and of its part that can freeze [m]; above, below : from its node to its upper
    edge, and to its lower edge or the boundary [m]; heat : its enthalpy [J m-2], advanced in place; (layers,) each.
    daily : temperatures at each day's end [degC], written, (days, layers); flux : heat into the soil, into the
    boundary and out of it [MJ m-2], added up, (3,).
    """
    layers = len(heat)
    thawed, frozen = ground.thawed_capacity * thickness, ground.frozen_capacity * thickness
    latent = ground.latent * freezing
    soft, hard = ground.thawed_conductivity, ground.frozen_conductivity
    node, upper, lower = np.empty(layers), np.empty(layers), np.empty(layers)
    down = np.empty(layers + 1)
    last = layers - 1
    per_day = len(driver.temperature) // len(daily)
    longest = SECONDS_PER_HOUR
    for i in range(layers):
        up = above[i] / hard + (below[i - 1] / hard if i > 0 else 0.0)
        under = below[i] / hard + (above[i + 1] / hard if i < last else 0.0)
        longest = min(longest, STABLE_SHARE * min(thawed[i], frozen[i]) / (1.0 / up + 1.0 / under))
    steps = int(np.ceil(SECONDS_PER_DAY / per_day / longest))
    seconds = SECONDS_PER_DAY / per_day / steps
    for day in range(len(daily)):
        for interval in range(day * per_day, (day + 1) * per_day):
            top, resistance = driver.temperature[interval], driver.resistance[interval]
            for _ in range(steps):
                for i in range(layers):
                    node[i] = temperature(heat[i], thawed[i], frozen[i], latent[i], ground.freezing_range)
                    k = conductivity(frozen_share(node[i], ground.freezing_range), soft, hard)
                    upper[i], lower[i] = above[i] / k, below[i] / k
                if closures:
                    share = frozen_share(top, ground.freezing_range)
                    upper[0] = above[0] / conductivity(share, soft, hard)
                    share = frozen_share(0.5 * (node[last] + ground.boundary_c), ground.freezing_range)
                    lower[last] = below[last] / conductivity(share, soft, hard)
                down[0] = (top - node[0]) / (resistance + upper[0])
                for i in range(1, layers):
                    down[i] = (node[i - 1] - node[i]) / (lower[i - 1] + upper[i])
                down[layers] = (node[last] - ground.boundary_c) / lower[last]
                for i in range(layers):
                    heat[i] += seconds * (down[i] - down[i + 1])
                flux[0] += 1e-6 * seconds * down[0]
                flux[1] += 1e-6 * seconds * max(down[layers], 0.0)
                flux[2] += 1e-6 * seconds * max(-down[layers], 0.0)
        for i in range(layers):
            daily[day, i] = node[i]


class Column:
    """A grid and its heat; at first on a straight line of temperature from `top` [degC] to the boundary."""

    def __init__(self, grid: Grid, ground: Ground, top: float):
        self.grid, self.ground = grid, ground
        self.thickness = np.diff(grid.edges)
        self.above = grid.depths - grid.edges[:-1]
        self.below = np.array([*grid.edges[1:-1], grid.boundary]) - grid.depths
        self.freezing = self.thickness.copy()
        if grid.closures:
            self.freezing[-1] = min(self.thickness[-1], 2.0 * self.above[-1])
        capacity = np.array(ground[2:5]) * np.stack([self.thickness, self.thickness, self.freezing], axis=1)
        line = np.interp(grid.depths, [0.0, grid.boundary], [top, ground.boundary_c])
        start = zip(line, capacity, strict=True)
        self.heat = np.array([uncompiled(soil.enthalpy)(t, *of, ground.freezing_range) for t, of in start])

    def run(self, driver: Above, days: int = DAYS) -> tuple[np.ndarray, np.ndarray]:
        """The layers' temperatures at the end of each day [degC], (days, layers), and the heat into the soil, into the
        boundary and out of it [MJ m-2], (3,)."""
        daily, flux = np.zeros((days, len(self.heat))), np.zeros(3)
        conduct(
            driver,
            self.ground,
            self.grid.closures,
            self.thickness,
            self.freezing,
            self.above,
            self.below,
            self.heat,
            daily,
            flux,
        )
        return daily, flux


def spun_up(grid: Grid, ground: Ground, year: Above) -> Column:
    """A column in balance with a year that repeats."""
    column = Column(grid, ground, year.temperature.mean() + 2.0)
    for _ in range(LONGEST_SPIN_UP_YEARS):
        before = column.heat.sum()
        column.run(year)
        if abs(column.heat.sum() - before) < BALANCED_J_M2:
            return column
    raise RuntimeError(f"no balance after {LONGEST_SPIN_UP_YEARS} years of spin-up: {grid}, {ground}")


def thawed_depth(daily: np.ndarray, depths: np.ndarray) -> np.ndarray:
    """Depth [m] of the uppermost 0 degC below the mineral surface, between nodes by a straight line, (days,).

    The deepest node's where none is frozen.
    """
    frozen = np.argmax(daily < 0.0, axis=1)
    days, above = np.arange(len(daily)), np.maximum(frozen - 1, 0)
    warm, cold = daily[days, above], daily[days, frozen]
    share = np.where(frozen > 0, warm / np.where(frozen > 0, warm - cold, 1.0), 0.0)
    front = np.where(frozen > 0, depths[above] + share * (depths[frozen] - depths[above]), 0.0)
    return np.where((daily < 0.0).any(axis=1), front, depths[-1])


def layer_mean(temperatures: np.ndarray, edges: tuple, depth: float) -> np.ndarray:
    """Mean [degC] from the mineral surface down to a depth, of temperatures (.., layers)."""
    upper, lower = np.array(edges[:-1]), np.minimum(edges[1:], depth)
    return temperatures @ np.maximum(lower - upper, 0.0) / depth
