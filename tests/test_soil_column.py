"""The column that the simulator's soil is compared with: closure, analytical solutions, its two-node form."""

import math

import numpy as np
import pytest
from pytest import approx
from scripts import run_script

import sim
from analysis.validation import soil_column
from analysis.validation.conduction import Above, Column, Grid, Ground, layer_mean, spun_up, thawed_depth
from analysis.validation.soil_column import LAYER_EDGES_M, SCHEMES, layers_to
from analysis.validation.surface import record_year
from sim.block import namespace
from sim.ground_heat import ground_conductances, ground_temperatures
from sim.jit import uncompiled
from sim.organic import organic_capacities
from sim.parameters import check_constants, check_mechanisms, check_weather
from sim.scenario import WITHOUT_SCENARIO
from sim.soil import enthalpy
from sim.spin_up import INITIAL_RANGES, first_state
from sim.state import DAYS, PARAMETER_NAMES, block_dtype, daily_dtype
from sim.year import simulate_year

PARAMETERS = {
    **sim.middle_site(),
    **check_constants(None),
    **check_mechanisms(None),
    **check_weather("paper"),
    **WITHOUT_SCENARIO,
}
GROUND = Ground.of(PARAMETERS)
YEAR = 2.0 * np.pi * np.arange(DAYS) / DAYS


def driven_by(temperature, resistance=0.0) -> Above:
    """What lies above, of so many days, with the same resistance throughout."""
    return Above(np.asarray(temperature, float), np.full(len(temperature), resistance))


def block():
    """The middle site's stand at its start, as the interpreter takes it, with its record (parameters, state, ..)."""
    record = np.zeros(1, block_dtype(1))
    state = first_state(PARAMETERS, np.random.default_rng(0), None, INITIAL_RANGES)
    given = np.concatenate([[PARAMETERS[name] for name in PARAMETER_NAMES], state])
    record.view("f8")[: len(given)] = given
    record[0]["d"]["wet_amount"] = 0.2  # a little rain or snow every day
    return namespace(record[0])


@pytest.mark.parametrize("grid", SCHEMES.values(), ids=SCHEMES)
def test_heat_gained_is_the_heat_that_came_in(grid):
    column = Column(grid, GROUND, -2.0)
    year = driven_by(-4.0 - 15.0 * np.cos(YEAR), resistance=1.0)
    before = column.heat.sum()
    _, (surface, warming, cooling) = column.run(year)
    assert abs(surface) > 5.0 and warming + cooling > 0.5
    assert column.heat.sum() - before == approx(1e6 * (surface - warming + cooling), rel=1e-9)


def test_the_thawing_front_of_neumann():
    """Frozen ground under a surface that is suddenly warm (Carslaw and Jaeger 1959, 11.2)."""
    ground = GROUND._replace(freezing_range=0.02, boundary_c=-3.0)
    warm, days = 8.0, 100
    column = Column(Grid(LAYER_EDGES_M), ground, -3.0)
    daily, _ = column.run(driven_by(np.full(days, warm)), days)

    thawed = ground.thawed_conductivity / ground.thawed_capacity
    frozen = ground.frozen_conductivity / ground.frozen_capacity

    def imbalance(x):
        y = x * math.sqrt(thawed / frozen)
        from_above = ground.thawed_conductivity * warm * math.exp(-x * x) / (math.erf(x) * math.sqrt(thawed))
        below = ground.frozen_conductivity * 3.0 * math.exp(-y * y) / (math.erfc(y) * math.sqrt(frozen))
        return from_above - below - ground.latent * x * math.sqrt(math.pi * thawed)

    low, high = 1e-3, 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if imbalance(middle) > 0.0 else (low, middle)
    front = 2.0 * low * np.sqrt(thawed * 86400.0 * np.array([25, 50, 100]))
    molten = 1.0 - np.clip(-daily / ground.freezing_range, 0.0, 1.0)
    assert (molten @ np.diff(LAYER_EDGES_M))[[24, 49, 99]] == approx(front, rel=0.03)
    # Between nodes the front moves by leaps: 0 degC waits at a layer until all of it has thawed.
    assert thawed_depth(daily, column.grid.depths)[[24, 49, 99]] == approx(front, abs=0.06)


def test_the_annual_wave_decays_with_depth():
    """In thawed ground, by 1/e in the damping depth, and later by a radian."""
    ground = GROUND._replace(boundary_c=20.0)
    grid = Grid(LAYER_EDGES_M)
    column = Column(grid, ground, 20.0)
    for _ in range(3):
        daily, _ = column.run(driven_by(20.0 + 10.0 * np.sin(YEAR)))
    damping = math.sqrt(2.0 * ground.thawed_conductivity / (ground.thawed_capacity * 2.0 * math.pi / (365 * 86400.0)))
    for k in (8, 18, 21):  # nodes at 0.45, 2.25 and 3.75 m
        wave = 2.0 * np.mean((daily[:, k] - 20.0) * np.exp(-1j * YEAR))
        assert abs(wave) == approx(10.0 * math.exp(-grid.depths[k] / damping), rel=0.03)
        lag = -np.angle(wave * 1j) % (2.0 * math.pi)
        assert lag == approx(grid.depths[k] / damping, abs=0.04)


@pytest.mark.parametrize("celsius", [8.0, -20.0, -0.8])
def test_two_nodes_have_the_simulators_conductances(celsius):
    b = block()
    uncompiled(simulate_year)([b], 1, 1, np.zeros((0, 6, 1)), [])
    b.s.organic_heat[0] = uncompiled(enthalpy)(celsius, *uncompiled(organic_capacities)(b, 0), GROUND.freezing_range)
    uncompiled(ground_temperatures)(b, 0)
    assert b.w.organic[0] == approx(celsius)
    uncompiled(ground_conductances)(b, 0)
    steady = driven_by(np.full(DAYS, celsius), 1.0 / b.w.surface_conductance[0] - b.w.upper_soil[0])
    column = spun_up(SCHEMES["two nodes: the simulator's"], GROUND, steady)
    for _ in range(100):
        daily, (entering, warming, cooling) = column.run(steady)
    b.s.surface_heat[0], b.s.deep_heat[0] = column.heat
    uncompiled(ground_temperatures)(b, 0)
    uncompiled(ground_conductances)(b, 0)
    upper, lower = daily[-1]
    assert (b.w.surface[0], b.w.deep[0]) == approx((upper, lower), abs=1e-4)
    assert entering == approx(warming - cooling, rel=1e-4)
    per_year = 86400.0 * DAYS * 1e-6
    assert b.w.surface_conductance[0] * (celsius - upper) * per_year == approx(entering, rel=1e-3)
    assert b.w.deep_conductance[0] * (upper - lower) * per_year == approx(entering, rel=1e-3)
    assert b.w.boundary_conductance[0] * (lower - GROUND.boundary_c) * per_year == approx(entering, rel=1e-3)


def test_the_recorded_surface_is_the_simulators():
    no_weather, surface = np.zeros((0, 6, 1)), np.zeros((2, DAYS, 1))
    daily = np.zeros(DAYS, daily_dtype(1))
    b = block()
    uncompiled(record_year)(b, 1, no_weather, [], surface)
    other = block()
    uncompiled(simulate_year)([other], 1, DAYS, no_weather, [namespace(row) for row in daily])
    assert surface[0, :, 0] == approx(daily["organic_temperature_c"][:, 0], abs=1e-12)
    frozen = surface[0, :, 0] < -1.0
    assert 100 < frozen.sum() < 300 and surface[1, frozen, 0].max() < surface[1, ~frozen, 0].max()
    assert surface[1].min() > 0.0


def test_depth_of_the_uppermost_zero():
    depths = np.array([0.1, 0.3, 1.0])
    daily = np.array([[-1.0, -2.0, -3.0], [2.0, -2.0, 1.0], [3.0, 1.0, -1.0], [3.0, 1.0, 0.5]])
    assert thawed_depth(daily, depths) == approx([0.0, 0.2, 0.65, 1.0])


def test_mean_of_the_layers_above_a_depth():
    assert layer_mean(np.array([[1.0, 4.0, 9.0]]), (0.0, 0.2, 0.3, 1.0), 0.3) == approx([2.0])
    assert layer_mean(np.array([[1.0, 4.0, 9.0]]), (0.0, 0.2, 0.3, 1.0), 0.4) == approx([3.75])


def test_grids_reach_the_boundary():
    assert layers_to(12.0) == SCHEMES["15 layers"]
    for boundary in soil_column.BOUNDARY_DEPTHS_M:
        grid = layers_to(boundary)
        assert grid.edges[-1] == grid.boundary == boundary and (np.diff(grid.edges) > 0.0).all()


@pytest.mark.parametrize("flag", [("--sites", 0), ("--years", 0), ("--first-site", -1)])
def test_bad_arguments_are_named(flag):
    with pytest.raises(SystemExit, match="must lie in"):
        run_script("analysis/validation/soil_column.py", *flag)
