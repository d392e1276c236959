"""How the physics is compiled, and how the same source runs uncompiled.

Process functions carry `@compiled`; functions that loop over the lanes of a block carry `@phase`, but for those of a
step, which are `@compiled` into one: what a phase hands to the next then stays in registers. IEEE arithmetic is
strict (no fastmath), so that one stand and sixteen stands in lockstep give the same bits; `error_model="numpy"` drops
the zero check of each division, and `forceinline` the calls, without which no loop over lanes is vectorised.

Two faults of numba's disk cache are worked around here. It keys by the caller's own file and misses a change in a
callee of another file: the cache folder is named by a hash of `sim/*.py`, where all kernels are (values of tables are
passed in). And it names compiled code by counters
of the compiling process, so that kernels for one and for sixteen lanes, compiled by two processes, are taken for each
other in a third: each number of lanes gets functions with names of their own.
"""

import contextlib
import functools
import hashlib
import os
import pickle
import sys
import tempfile
import threading
import types
import warnings
from pathlib import Path

import llvmlite.binding as llvm
import numba
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher

try:
    import fcntl
except ImportError:  # Windows, where two processes compile the same
    fcntl = None  # type: ignore[assignment]

OPTIONS = {"error_model": "numpy", "nogil": True}

# LLVM halves AVX-512's vectors on processors of Intel. Whole, sixteen lanes take a fifth less time, with the same bits
# (docs/performance.md). The oldest slow their clock for it and keep LLVM's choice; so do the user's own settings. It is
# numba's setting for the process, read at its first compilation.
SLOWED = ("skylake-avx512", "cascadelake", "cooperlake")
FEATURES = numba.config.CPU_FEATURES or llvm.get_host_cpu_features().flatten()
if (
    (numba.config.CPU_NAME, numba.config.CPU_FEATURES) == (None, None)
    and numba.config.ENABLE_AVX
    and llvm.get_host_cpu_features().get("avx512f")
    and llvm.get_host_cpu_name() not in SLOWED
):
    FEATURES = numba.config.CPU_FEATURES = f"{FEATURES},-prefer-256-bit"

MAKING = threading.Lock()  # threads may come together, and numba's cache folder is one setting for all of them

compiled = numba.njit(**OPTIONS, forceinline=True)
phase = numba.njit(**OPTIONS)


@functools.cache
def cache_folder() -> Path:
    """Folder of the compiled kernels: `$NUMBA_CACHE_DIR` or the user's cache, then a hash of all they depend on."""
    cpu = (llvm.get_host_cpu_name(), FEATURES)
    here = Path(__file__).parent  # numba keeps the kernels of each checkout apart
    digest = hashlib.sha256(repr((numba.__version__, sys.version, cpu, here)).encode())
    for path in sorted(here.glob("*.py")):
        digest.update(path.read_bytes())
    try:
        user_cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError:  # a user without a home
        user_cache = os.devnull
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(user_cache) / "borearl")
    return base / digest.hexdigest()[:16]


@functools.cache
def is_cacheable() -> bool:
    """Whether the cache folder takes compiled kernels; warns if not."""
    try:
        cache_folder().mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=cache_folder()).close()
    except OSError as error:
        warn_uncached(error)
        return False
    return True


def warn_uncached(error: OSError) -> None:
    """Say that the next process compiles again."""
    warnings.warn(
        f"{cache_folder()} cannot be written ({error.strerror}): every process compiles the physics anew, for half a "
        "minute. NUMBA_CACHE_DIR names another folder.",
        RuntimeWarning,
        stacklevel=2,
    )


@contextlib.contextmanager
def alone(name: str):
    """While it lasts, other processes that come here under the same name wait."""
    if fcntl is None or not is_cacheable():
        yield
        return
    with (cache_folder() / f"{name}.lock").open("w") as lock:
        with contextlib.suppress(OSError):  # a file system without locks: two processes compile the same
            fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                fcntl.flock(lock, fcntl.LOCK_UN)  # closing would not do where a child was forked meanwhile


def specialised(dispatcher: Dispatcher, name: str):
    """A copy of a compiled function and of all that it calls, under names that end in `name`, cached if possible."""
    previous, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(cache_folder())
    try:
        copy = _copy(dispatcher, {}, lambda function, original: _recompiled(function, original, name))
        return numba.njit(**OPTIONS, cache=is_cacheable())(copy.py_func)
    finally:
        numba.config.CACHE_DIR = previous


def made_ready(made, *nothing):
    """A function of `specialised`, compiled or loaded for arguments like these."""
    try:
        made(*nothing)
    except OSError as error:  # a full disk: it is compiled, but not kept
        warn_uncached(error)
        made(*nothing)
    except (EOFError, pickle.UnpicklingError) as error:  # numba does not flush what it writes: a machine may die first
        warnings.warn(
            f"a file in {cache_folder()} is damaged ({error!r}): every process compiles the physics anew, for half a "
            "minute, until that folder is deleted.",
            RuntimeWarning,
            stacklevel=2,
        )
        made = numba.njit(**OPTIONS)(made.py_func)
        made(*nothing)
    return made


@contextlib.contextmanager
def loops_kept():
    """While it lasts, loops over lanes are not unrolled: LLVM would do so with those of four and of eight before it
    comes to vectorising them. A setting of all that is compiled in the process, so nothing else is meanwhile."""
    with global_compiler_lock:
        llvm.set_option("", "-unroll-full-max-count=3")
        try:
            yield
        finally:
            llvm.set_option("", f"-unroll-full-max-count={2**32 - 1}")  # its default: no limit


def uncompiled(dispatcher: Dispatcher):
    """The Python function behind a compiled one, calling the Python functions behind all that it calls.

    This is the `python` backend: the same source, executed by the interpreter.
    """
    return _copy(dispatcher, {}, lambda function, original: function)


def translated(dispatcher: Dispatcher, translate):
    """A copy of a compiled function and of all that it calls, each made by `translate` of a Python function and of the
    compiled one that it comes from."""
    return _copy(dispatcher, {}, translate)


def _recompiled(function, original, name):
    function.__qualname__ = f"{function.__qualname__}_{name}"
    inline = bool(original.targetoptions.get("forceinline"))
    return numba.njit(**OPTIONS, forceinline=inline, no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)


def _copy(dispatcher, copies, wrap):
    """A function with globals of its own, in which every compiled function is a copy too."""
    if dispatcher not in copies:
        source = dispatcher.py_func
        namespace = dict(source.__globals__)
        function = types.FunctionType(source.__code__, namespace, source.__name__, source.__defaults__)
        function.__qualname__, function.__module__ = source.__qualname__, source.__module__
        copies[dispatcher] = wrap(function, dispatcher)
        for name in source.__code__.co_names:
            if isinstance(namespace.get(name), Dispatcher):
                namespace[name] = _copy(namespace[name], copies, wrap)
    return copies[dispatcher]
