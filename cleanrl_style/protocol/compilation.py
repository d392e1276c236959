"""The physics is compiled when a machine first needs it: what is needed now with a sign of life, the rest meanwhile."""

import contextlib
import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterable

from sim.block import compiling, is_compiled, kernel
from sim.draws import drawer

LOGGER = logging.getLogger("sim.block")  # it says in one line, on stderr, what is said here
INTERVAL = 5.0  # seconds between signs of life
_UNDER_WAY: dict[int, multiprocessing.Process] = {}  # by lanes, what is compiled in the background


def compile_physics(lanes: Iterable[int], later: Iterable[int] = ()) -> None:
    """Have kernels for so many lanes ready on disk, the first of them in this process, and what draws its numbers.

    later : of kernels that are needed later: compiled in the background once the first are there, so that the command
    goes on. Before worker processes are forked, all this saves each of them the loading. Says nothing where all are
    there.
    """
    first, *others = dict.fromkeys(lanes)
    complete = all(map(is_compiled, (first, *others)))
    for number in others:
        begin(number)
    with contextlib.nullcontext() if complete else alive(compiling(first)):
        finish(first)
        kernel(first)
        drawer("numba")
        for number in others:
            finish(number)
    for number in dict.fromkeys(later):
        begin(number)


def begin(lanes: int) -> None:
    """Compile in the background, if it is neither there nor under way."""
    if lanes not in _UNDER_WAY and not is_compiled(lanes):
        _UNDER_WAY[lanes] = multiprocessing.Process(target=compile_apart, args=(lanes,), daemon=True)
        _UNDER_WAY[lanes].start()


def finish(lanes: int) -> None:
    """Wait for what is compiled in the background."""
    if helper := _UNDER_WAY.pop(lanes, None):
        helper.join()


def compile_apart(lanes: int) -> None:
    """Compile in a process of its own, which leaves Ctrl-C to the main one, and the processor to who needs it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # not the training's way to stop
    LOGGER.disabled = True
    if hasattr(os, "nice"):  # not on Windows
        os.nice(5)
    kernel(lanes)


@contextlib.contextmanager
def alive(what: str):
    """Says what is being done, and every few seconds for how long."""
    print(what, flush=True)
    start, done = time.perf_counter(), threading.Event()

    def tell():
        while not done.wait(INTERVAL):
            print(f"  {time.perf_counter() - start:.0f} s", flush=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    LOGGER.disabled = True
    try:
        yield
    finally:
        LOGGER.disabled = False
        done.set()
        teller.join()
    print(f"  compiled in {time.perf_counter() - start:.0f} s", flush=True)
