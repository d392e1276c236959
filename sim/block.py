"""A year of up to sixteen stands in one call of the kernel.

Stands are rows of arrays, (stands, fields); a block has them as lanes of `sim.state.block_dtype`.
"""

import contextlib
import functools
import logging
import math
from types import SimpleNamespace

import numpy as np

from sim.jit import MAKING, alone, cache_folder, is_cacheable, loops_kept, made_ready, specialised, uncompiled
from sim.management import decode
from sim.state import DAILY, DRAWS_SIZE, RECORD, STATE_SIZE, block_dtype, daily_dtype
from sim.year import simulate_year

KERNELS = (1, 4, 8, 16)  # lanes that there is a kernel for
LANES = KERNELS[-1]
FEW = 8  # fewer stands than these go one by one, where each has a thread
CACHE_LINE = 64  # bytes
BACKENDS = ("numba", "python", "cuda")


def lanes_for(number: int, threads: int) -> int:
    """Lanes of the blocks that so many stands are stepped in, such that every thread has its share of them."""
    if number < FEW and number <= threads:
        return 1
    share = math.ceil(number / threads)
    return min((lanes for lanes in KERNELS[1:] if lanes >= share), default=LANES)


def blocks(number: int, lanes: int) -> list[slice]:
    """Split stands into calls of the kernel."""
    return [slice(k, min(k + lanes, number)) for k in range(0, number, lanes)]


def run_block(
    lanes,
    parameters,
    state,
    draws,
    actions,
    observed,
    days,
    daily,
    *,
    steps_per_day,
    backend,
    first_cut_age,
    products_decay,
):
    """Run a year of up to `lanes` stands; lanes that are left over repeat the last one.

    parameters, state, draws : (stands, fields); actions : (stands,); observed : forcing (days x steps a day, 6) for all
    stands, or None; daily : filled with the daily output (stands, days, columns), or None. Returns the new state and
    the annual record, (stands, fields) each, and touches nothing else.
    """
    number = len(parameters)
    if backend == "python":
        lanes = number  # interpreted, an idle lane takes as long as another
    block, rows = filled_block(
        lanes, parameters, state, draws, actions, first_cut_age=first_cut_age, products_decay=products_decay
    )
    forcing = np.zeros((0, 6, lanes)) if observed is None else np.repeat(observed[:, :, None], lanes, axis=2)
    output = np.zeros(0 if daily is None else days, daily_dtype(lanes))
    if backend == "numba":
        kernel(lanes)(block, steps_per_day, days, forcing, output)
    else:
        with np.errstate(all="ignore"):
            interpreted()([namespace(block[0])], steps_per_day, days, forcing, [namespace(row) for row in output])
    if daily is not None:
        daily[:] = output.view(float).reshape(days, len(DAILY), lanes)[:, :, :number].transpose(2, 0, 1)
    first = parameters.shape[1]
    new_state = rows[first : first + STATE_SIZE, :number].T
    record = rows[first + STATE_SIZE + DRAWS_SIZE :][: len(RECORD), :number].T
    return new_state, record


def filled_block(lanes, parameters, state, draws, actions, *, first_cut_age, products_decay):
    """A block at the start of a year, its lanes filled as `run_block` says; returns it as an array of one record of
    `block_dtype(lanes)`, and the same memory as rows, (fields, lanes)."""
    rows = aligned_zeros((block_dtype(lanes).itemsize // (8 * lanes), lanes))
    block = np.ndarray(1, block_dtype(lanes), buffer=rows)
    fill = np.minimum(np.arange(lanes), len(parameters) - 1)
    first = 0
    for values in (parameters, state, draws):
        rows[first : first + values.shape[1]] = values[fill].T
        first += values.shape[1]
    work = block[0]["w"]
    work["density_change"], work["mix"] = (values[fill] for values in decode(actions))
    work["first_cut_age"] = first_cut_age
    work["products_decay"] = products_decay
    return block, rows


def aligned_zeros(shape) -> np.ndarray:
    """Zeros from a cache line's beginning on: vectors that lie across two lines make lockstep a tenth slower."""
    size = 8 * math.prod(shape)
    memory = np.zeros(size + CACHE_LINE, dtype=np.uint8)
    first = -memory.__array_interface__["data"][0] % CACHE_LINE
    return memory[first : first + size].view(float).reshape(shape)


def namespace(record):
    """A numpy record, and the records in it, as plain attributes for the interpreter."""
    fields = ((name, record[name]) for name in record.dtype.names)
    return SimpleNamespace(**{name: namespace(value) if value.dtype.names else value for name, value in fields})


def compiling(lanes: int) -> str:
    """What is said while a kernel is compiled; there is one for each number of lanes."""
    return (
        f"compiling the physics for {lanes} stand{'s'[: lanes > 1]} at a time, once for this processor: half a minute"
    )


def kernel(lanes: int):
    """The year kernel for blocks of this many lanes, compiled or loaded from the disk cache when it is first wanted.

    Of several processes that want it one compiles it, and says so through the logger `sim.block`; the others wait.
    """
    with MAKING:
        if lanes not in _MADE:
            # what is on disk is loaded side by side: of a thousand jobs each would wait for all before it
            with contextlib.nullcontext() if is_compiled(lanes) else alone(f"{lanes}_lanes"):
                if not is_compiled(lanes):
                    _LOGGER.warning(compiling(lanes))
                _MADE[lanes] = _made(lanes)
        return _MADE[lanes]


def _made(lanes: int):
    """Compiled or loaded."""
    made = specialised(simulate_year, f"{lanes}_lanes")
    nothing = np.zeros(1, block_dtype(lanes)), 1, 0, np.zeros((0, 6, lanes)), np.zeros(0, daily_dtype(lanes))
    with loops_kept():
        return made_ready(made, *nothing)


def is_compiled(lanes: int) -> bool:
    """Whether a kernel is ready in this process or on disk."""
    on_disk = cache_folder().rglob(f"*.simulate_year_{lanes}_lanes-*.nbi")
    return lanes in _MADE or (any(on_disk) and is_cacheable())


_LOGGER = logging.getLogger("sim.block")
_MADE: dict = {}  # kernels by lanes


@functools.cache
def interpreted():
    """The same year as plain Python: the `python` backend."""
    return uncompiled(simulate_year)
