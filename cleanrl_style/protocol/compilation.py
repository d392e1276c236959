"""The physics is compiled when a machine first needs it: for all that a command needs at once, with a sign of life."""

import contextlib
import multiprocessing
import signal
import threading
import time
from collections.abc import Iterable

from sim.block import is_compiled, kernel

INTERVAL = 5.0  # seconds between signs of life


def compile_physics(lanes: Iterable[int]) -> None:
    """Have kernels for so many lanes ready on disk, compiled at the same time, and the first of them in this process.

    Before worker processes are forked, this saves each of them the loading. Says nothing where all are there.
    """
    first, *others = dict.fromkeys(lanes)
    missing = [number for number in others if not is_compiled(number)]
    if is_compiled(first) and not missing:
        kernel(first)
        return
    helpers = [multiprocessing.Process(target=compile_apart, args=(number,), daemon=True) for number in missing]
    try:
        for helper in helpers:
            helper.start()
        with alive("compiling the physics, once for this processor: half a minute or more"):
            kernel(first)
            for helper in helpers:
                helper.join()
    finally:
        for helper in helpers:
            helper.kill()


def compile_apart(lanes: int) -> None:
    """Compile in a process of its own, which leaves Ctrl-C to the main one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
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
    try:
        yield
    finally:
        done.set()
        teller.join()
    print(f"  compiled in {time.perf_counter() - start:.0f} s", flush=True)
