"""The GPU's kernel: on numba's simulator and on a GPU it is the CPU's, to 1e-9; where NVIDIA's compiler is, it
compiles."""

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest

import sim
from sim import cuda, stands
from sim.state import DAYS, RECORD_NAMES

MINUTES = 720
stands.LONGEST_STEP_MINUTES = 1440  # in the process that simulates the GPU, too
#: stands (of which some are lanes of a second block), days, whether the weather is observed
CASES = {"three days of two blocks": (34, 3, False), "a year": (1, DAYS, False), "observed days": (2, 4, True)}
#: columns of the record in which a balance's error is
RESIDUALS = [k for k, name in enumerate(RECORD_NAMES) if "residual" in name]


def start(number):
    block = sim.Stands(number, time_step_minutes=MINUTES)
    fires = {"fire_base_probability": 0.05, "fire_drought_threshold": 0.0}
    sites = [sim.sample_site(k, fires) for k in range(number)]
    block.start(np.arange(number), sites, [sim.episode_seeds(k) for k in range(number)])
    return block


def compare(number, days, observed):
    """Step stands on the CPU and on the simulated GPU; print the largest difference, relative from 1e-6 on."""
    expected = start(number)
    got = sim.Stands(number, time_step_minutes=MINUTES, backend="cuda")
    got.set_state(expected.get_state())
    hours = np.arange(days * 1440 // MINUTES)
    weather = np.array(
        [hours % 7 - 3.0, 0.8 - 0.01 * hours, 0.0 * hours + 3.0, 90.0 * (hours % 2), 250.0 + hours, hours]
    )
    arguments = {"observed": weather.T if observed else None, "days": days, "daily": True}
    actions = np.arange(number) * 7 % 25
    results = [(*stands.step(actions, **arguments), stands.state) for stands in (expected, got)]
    for rows in results:
        rows[0][:, RESIDUALS] = 0.0  # nothing but rounding
    for ours, theirs in zip(*results, strict=True):
        assert np.array_equal(np.isnan(ours), np.isnan(theirs))
    print(max(np.nanmax(np.abs(b - a) / np.maximum(np.abs(a), 1e-6)) for a, b in zip(*results, strict=True)))


def difference(case, **variables):
    """What `compare` prints, in a process of its own: numba decides at its import whether to simulate a GPU."""
    root = Path(__file__).parents[1]
    path = os.pathsep.join([str(root), str(root / "tests"), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, **variables, "PYTHONPATH": path}
    code = f"import test_cuda; test_cuda.compare{CASES[case]}"
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, env=environment)
    assert run.returncode == 0, run.stderr
    return float(run.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_a_simulated_gpu_gives_what_the_cpu_gives(case):
    assert difference(case, NUMBA_ENABLE_CUDASIM="1") <= 1e-9


@pytest.mark.slow
@pytest.mark.skipif(not cuda.cuda.is_available(), reason="there is no GPU")
@pytest.mark.parametrize("case", CASES)
def test_a_gpu_gives_what_the_cpu_gives(case):
    assert difference(case) <= 1e-9


@pytest.mark.skipif(find_spec("numba_cuda") is None, reason='needs the extra "cuda", and NVIDIA\'s compiler')
def test_the_year_compiles_for_a_gpu(monkeypatch):
    """Without a GPU, to PTX for an H100; no product is joined with a sum."""
    monkeypatch.setattr("numba.cuda.dispatcher.get_current_device", lambda: SimpleNamespace(compute_capability=(9, 0)))
    numbers, rows, forcing = (numba.types.Array(numba.float64, n, "C") for n in (1, 2, 3))
    signature = numba.void(rows, rows, rows, rows, rows, numba.int64, forcing, rows, rows, rows)

    def joined(a):
        a[0] = a[0] * a[1] + a[2]

    with cuda.our_arithmetic():
        year = cuda.cuda.compile(
            cuda.year_of(*cuda.device_functions()), signature, device=False, abi="numba", cc=(9, 0)
        )[0]
        apart = cuda.cuda.compile(joined, numba.void(numbers), device=False, abi="numba", cc=(9, 0))[0]
    assert ".entry" in year and "div.rn.f64" in year
    assert "mul.rn.f64" in apart and "fma" not in apart


@pytest.mark.skipif(cuda.cuda.is_available(), reason="there is a GPU")
def test_without_a_gpu_one_line_says_so():
    with pytest.raises(ValueError, match=r"^backend 'cuda'.*$") as raised:
        sim.Stands(1, backend="cuda")
    assert "\n" not in str(raised.value)
