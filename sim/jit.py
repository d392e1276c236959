"""How the physics is compiled, and how the same source runs uncompiled.

Every process function carries `@compiled`. IEEE arithmetic is strict (no fastmath), so that one stand and
sixteen stands in lockstep give the same bits; `error_model="numpy"` drops the zero check of each division,
without which no loop over stands is vectorised.

numba keys its disk cache by the caller's own file and misses a change in a callee of another file. The cache
folder is therefore named by a hash of all of `sim/`.
"""
import functools
import hashlib
import os
import types
from pathlib import Path

import numba
from numba.core.dispatcher import Dispatcher

compiled = numba.njit(error_model="numpy", nogil=True, forceinline=True)
phase = numba.njit(error_model="numpy", nogil=True)


@functools.cache
def cache_folder() -> Path:
    """Folder of the compiled kernels: `$NUMBA_CACHE_DIR` or the user's cache, then a hash of the source."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    user_cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(user_cache) / "borearl")
    return base / digest.hexdigest()[:16]


def compiled_and_cached(function):
    """`@compiled` for the entry points of `sim`, kept on disk between runs."""
    previous, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(cache_folder())
    try:
        return numba.njit(error_model="numpy", nogil=True, cache=True)(function)
    finally:
        numba.config.CACHE_DIR = previous


def uncompiled(dispatcher: Dispatcher, _copies: dict | None = None):
    """The Python function behind a compiled one, calling the Python functions behind all that it calls.

    This is the `python` backend: the same source, executed by the interpreter.
    """
    copies = {} if _copies is None else _copies
    if dispatcher not in copies:
        source = dispatcher.py_func
        namespace = dict(source.__globals__)
        copies[dispatcher] = types.FunctionType(source.__code__, namespace, source.__name__, source.__defaults__)
        for name in source.__code__.co_names:
            if isinstance(namespace.get(name), Dispatcher):
                namespace[name] = uncompiled(namespace[name], copies)
    return copies[dispatcher]
