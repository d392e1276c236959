"""A year of many stands on a GPU: the functions of `sim.year` compiled by numba for CUDA, one thread a stand.

Stands lie as on the CPU, in blocks of `block_dtype(WARP)`, so that neighbouring threads read neighbouring numbers. A
thread sees its lane as a record whose arrays are one lane long: the loops over lanes, which all process functions
have, run once. Arithmetic is as strict as on the CPU. With NUMBA_ENABLE_CUDASIM=1 numba's simulator runs the same,
interpreted, without a GPU.
"""

import contextlib
import functools
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

WARP = 32  # threads that a GPU runs in step: the lanes of a block
STANDS = 65_536  # in one launch: 3 GB of the GPU's memory


def lane_dtype(dtype: np.dtype) -> np.dtype:
    """One lane of a block's dtype as seen from the lane's first number: everything in its place, one lane long."""
    names = dtype.names or ()
    fields = [dtype.fields[name] for name in names]  # type: ignore[index]  # None has no names
    return np.dtype(  # type: ignore[call-overload]  # offsets are left out of numpy's types
        {
            "names": names,
            "formats": [one_lane(field) for field, _ in fields],  # type: ignore[misc]  # no field has a title
            "offsets": [offset for _, offset in fields],  # type: ignore[misc]
            "itemsize": dtype.itemsize,
        }
    )


def one_lane(field: np.dtype) -> np.dtype:
    """The same of a field. (ages, lanes) stays, for from an age to the next it is as far as before."""
    if field.names:
        return lane_dtype(field)
    return np.dtype(("f8", (1,))) if len(field.shape) == 1 else field


LANE, DAY = lane_dtype(block_dtype(WARP)), daily_dtype(1)
BLOCK = LANE.itemsize // 8  # numbers of a block


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
    blocks = -(-number // WARP)
    results = [cuda.device_array((number, size)) for size in (STATE_SIZE, len(RECORD))]
    output = cuda.device_array((number, 0 if daily is None else days * len(DAILY)))
    given = [cuda.to_device(np.ascontiguousarray(rows)) for rows in (parameters, state, draws)]
    choices = cuda.to_device(np.column_stack([change, mix, *fixed]))
    with our_arithmetic():
        kernel()[blocks, WARP](
            workspace(blocks),
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


_MEMORY: dict = {}  # of the GPU, kept from year to year


def workspace(blocks: int):
    """Memory for so many blocks, and for the last lane's record to end in."""
    size = blocks * BLOCK + WARP
    if "blocks" not in _MEMORY or len(_MEMORY["blocks"]) < size:
        _MEMORY.pop("blocks", None)
        _MEMORY["blocks"] = cuda.device_array(size)
    return _MEMORY["blocks"]


@functools.cache
def kernel():
    """The kernel, compiled when it is first launched."""
    return cuda.jit(year_of(*device_functions()))


def device_functions():
    """The year and the two ways to look at memory: as a lane of a block, and as a stand's daily output."""
    if simulated():
        return (
            translated(advance, lambda function, original: function),
            lambda numbers: namespace(numbers.view(LANE)[0]),
            lambda numbers: [namespace(row) for row in numbers.view(DAY)],
        )
    return (
        translated(advance, for_gpu),
        cuda.jit(device=True, inline="always")(lambda numbers: numbers.view(LANE)[0]),
        cuda.jit(device=True, inline="always")(lambda numbers: numbers.view(DAY)),
    )


def for_gpu(function, original):
    """A process function for the GPU, inlined where it is on the CPU."""
    return cuda.jit(device=True, forceinline=bool(original.targetoptions.get("forceinline")))(function)


def year_of(advance, lane_of, days_of):
    """A thread's work: its stand into a lane, the year, the lane's state and record out."""

    def year(memory, parameters, state, draws, choices, hours, days, observed, daily, new_state, record):
        k = cuda.grid(1)
        if k < len(parameters):
            first = k // WARP * BLOCK + k % WARP
            for place in range(first, first + BLOCK, WARP):
                memory[place] = 0.0
            place = first
            for n in range(parameters.shape[1]):
                memory[place] = parameters[k, n]
                place += WARP
            state_place = place
            for n in range(state.shape[1]):
                memory[place] = state[k, n]
                place += WARP
            for n in range(draws.shape[1]):
                memory[place] = draws[k, n]
                place += WARP
            record_place = place
            b = lane_of(memory[first : first + BLOCK])
            b.w.density_change[0] = choices[k, 0]
            b.w.mix[0] = choices[k, 1]
            b.w.first_cut_age[0] = choices[k, 2]
            b.w.products_decay[0] = choices[k, 3]
            advance(b, hours, days, observed, days_of(daily[k]))
            for n in range(new_state.shape[1]):
                new_state[k, n] = memory[state_place + n * WARP]
            for n in range(record.shape[1]):
                record[k, n] = memory[record_place + n * WARP]

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
