"""A year of many stands on a GPU: the functions of `sim.year` compiled by numba for CUDA, one thread a stand.

A thread has its stand in memory of its own, as a block of one lane: the loops over lanes, which all process functions
have, run once. Arithmetic is as strict as on the CPU, but for NVIDIA's own sines, logarithms and powers: a year's state
differs by 1e-13. With NUMBA_ENABLE_CUDASIM=1 numba's simulator runs the same, interpreted, without a GPU.
"""

import contextlib
import functools
import math
from importlib.util import find_spec

import numba
import numpy as np
from numba import cuda

from sim.block import namespace
from sim.forcing import hour_angles
from sim.jit import translated, uncompiled
from sim.management import decode
from sim.state import DAILY, RECORD, STATE_SIZE, block_dtype, daily_dtype
from sim.year import advance

WARP = 32  # threads that a GPU runs in step
STANDS = 65_536  # in one launch: 1.4 GB of the GPU's memory, 6.6 with daily output, beside the threads' own
STAND, DAY = block_dtype(1), daily_dtype(1)
NUMBERS = STAND.itemsize // 8  # of a stand


def check_gpu() -> None:
    """Raise ValueError, in one line, where there is no GPU to compute on."""
    if simulated():
        return
    if find_spec("numba_cuda") is None:
        raise ValueError("backend 'cuda' needs numba-cuda: pip install -e \".[cuda]\"")
    if not cuda.is_available():
        why = " ".join(str(cuda.cuda_error() or "none found").split())
        raise ValueError(f"backend 'cuda': no NVIDIA GPU can be used here ({why}); allowed are numba, python")


def simulated() -> bool:
    """Whether numba's simulator stands for a GPU."""
    return bool(numba.config.ENABLE_CUDASIM)


def run_stands(
    parameters, state, draws, actions, observed, days, daily, *, steps_per_day, first_cut_age, products_decay
):
    """Run a year of at most `STANDS` stands; arguments and what it returns as of `sim.block.run_block`."""
    number = len(parameters)
    change, mix = decode(actions)
    fixed = np.full(number, first_cut_age, float), np.full(number, products_decay, float)
    forcing = np.zeros((0, 6, 1)) if observed is None else np.ascontiguousarray(observed)[:, :, None]
    results = [cuda.device_array((number, size)) for size in (STATE_SIZE, len(RECORD))]
    output = cuda.device_array((number, 0 if daily is None else days * len(DAILY)))
    given = [cuda.to_device(np.ascontiguousarray(rows)) for rows in (parameters, state, draws)]
    choices = cuda.to_device(np.column_stack([change, mix, *fixed]))
    with our_arithmetic():
        kernel()[math.ceil(number / WARP), WARP](
            *given,
            choices,
            cuda.to_device(uncompiled(hour_angles)(steps_per_day)),
            days,
            cuda.to_device(forcing),
            output,
            *results,
        )
    if daily is not None:
        daily[:] = output.copy_to_host().reshape(number, days, len(DAILY))
    return tuple(rows.copy_to_host() for rows in results)


@functools.cache
def kernel():
    """The kernel, compiled when it is first launched."""
    return cuda.jit(year_of(*device_functions()))


def device_functions():
    """The year and the two ways to look at memory: as a block of one lane, and as a stand's daily output."""
    if simulated():
        return (
            translated(advance, lambda function, original: function),
            lambda numbers: namespace(numbers.view(STAND)[0]),
            lambda numbers: [namespace(row) for row in numbers.view(DAY)],
        )
    return (
        translated(advance, for_gpu),
        cuda.jit(device=True, inline="always")(lambda numbers: numbers.view(STAND)[0]),
        cuda.jit(device=True, inline="always")(lambda numbers: numbers.view(DAY)),
    )


def for_gpu(function, original):
    """A process function for the GPU, inlined where it is on the CPU."""
    return cuda.jit(device=True, forceinline=bool(original.targetoptions.get("forceinline")))(function)


def year_of(advance, stand_of, days_of):
    """A thread's work: its stand into its memory, the year, the stand's state and record out."""

    def year(parameters, state, draws, choices, hours, days, observed, daily, new_state, record):
        k = cuda.grid(1)
        if k < len(parameters):
            numbers = cuda.local.array(NUMBERS, numba.float64)
            for n in range(NUMBERS):
                numbers[n] = 0.0
            first_of_state = parameters.shape[1]
            first_of_draws = first_of_state + state.shape[1]
            first_of_record = first_of_draws + draws.shape[1]
            for n in range(parameters.shape[1]):
                numbers[n] = parameters[k, n]
            for n in range(state.shape[1]):
                numbers[first_of_state + n] = state[k, n]
            for n in range(draws.shape[1]):
                numbers[first_of_draws + n] = draws[k, n]
            b = stand_of(numbers)
            b.w.density_change[0] = choices[k, 0]
            b.w.mix[0] = choices[k, 1]
            b.w.first_cut_age[0] = choices[k, 2]
            b.w.products_decay[0] = choices[k, 3]
            advance(b, hours, days, observed, days_of(daily[k]))
            for n in range(new_state.shape[1]):
                new_state[k, n] = numbers[first_of_state + n]
            for n in range(record.shape[1]):
                record[k, n] = numbers[first_of_record + n]

    return year


@contextlib.contextmanager
def our_arithmetic():
    """While it lasts, numba compiles for the GPU what it has no option for: NVIDIA's compiler joins no product and sum
    into one rounding, and `np.floor` is known."""
    if simulated():
        yield
        return
    from numba.cuda import ufuncs
    from numba.cuda.cudadrv import nvvm
    from numba.cuda.np import npyfuncs

    ufuncs.ufunc_db()[np.floor] = {"d->d": npyfuncs.np_real_floor_impl}
    compile_ir = nvvm.compile_ir
    nvvm.compile_ir = functools.partial(compile_ir, fma=False)
    try:
        yield
    finally:
        nvvm.compile_ir = compile_ir
