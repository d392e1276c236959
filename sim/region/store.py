"""The zarr store of a region: written chunk by chunk, gone on with where it was killed."""

import contextlib
import dataclasses
import functools
import hashlib
import json
import os
import re
import shutil
import warnings
from collections.abc import Mapping
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

import sim
from sim.io.dataset import UDUNITS
from sim.region.plan import Plan
from sim.region.site_table import COLUMNS
from sim.scenario import FIRST_YEAR
from sim.spin_up import INITIAL_LIMITS
from sim.state import RECORD
from sim.task.timber import TIMBER_COLUMNS

try:
    import fcntl
except ImportError:  # Windows, where a store is not locked
    fcntl = None  # type: ignore[assignment]

LONGEST_WORDS = 200  # letters of an argument in the store's settings; of more a hash


class Store:
    """A zarr store that is written chunk by chunk, and is there under its name when all are.

    Meanwhile `<path>.partial` has it, and a file for each chunk that is written. A context: it holds a lock meanwhile.
    """

    def __init__(self, path, plan: Plan, label: str, overwrite: bool):
        if path is not None and not (isinstance(path, (str, os.PathLike)) and Path(path).name):
            raise ValueError(f"path {path!r}: the name of a folder is allowed")
        if path is not None and Path(path).suffix in (".nc", ".csv"):
            raise ValueError(
                f"path {path}: a zarr store is written, such as region.zarr; `.to_netcdf` makes NetCDF of it"
            )
        self.plan = plan
        self.settings = {
            "simulator": simulator(),
            "sites": digest(*(plan.table[name].to_numpy() for name in plan.table)) + f", {len(plan.table)}",
            "columns": list(plan.table),
            "actions": label,
            "years": plan.years,
            "others": plan.others,
            "preference": plan.weights.tolist(),
            "variables": list(plan.variables),
            "arguments": {name: in_words(value) for name, value in sorted(plan.arguments.items())},
        }
        self.path: Any = None if path is None else Path(path)
        self.partial: Any = None if path is None else Path(path).with_name(Path(path).name + ".partial")
        self.overwrite = overwrite
        self.group: Any = None
        self.lock: Any = None
        self.waiting = list(range(plan.chunks))

    def __enter__(self) -> "Store":
        import zarr

        if self.path is None:
            self.group = self._create(zarr.storage.MemoryStore())
            return self
        data, written = self.partial / "data.zarr", self.partial / "written"
        if self.path.exists():
            there = settings_of(self.path)
            if not self.overwrite:
                self._compare(there)
                check_whole(self.path)
                self.waiting = []
                if not data.exists():  # killed after its last act but one
                    shutil.rmtree(self.partial, ignore_errors=True)
                return self
        try:
            self.partial.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ValueError(f"path {self.path}: cannot write there ({error.strerror})") from error
        self.lock = locked(self.partial / "lock", self.path)
        try:
            if self.overwrite:
                for old in (written, self.path):
                    shutil.rmtree(old, ignore_errors=True)
            if written.exists():
                self._compare(settings_of(data))
                self.waiting = [k for k in self.waiting if not (written / str(k)).exists()]
                self.group = zarr.open_group(data, mode="r+")
            else:  # killed before it was whole, or new
                shutil.rmtree(data, ignore_errors=True)
                self.group = self._create(data)
                written.mkdir()
        except BaseException:
            self.lock.close()
            raise
        return self

    def __exit__(self, kind, error, trace) -> None:
        if self.lock is None:
            return
        whole = self.path.exists()
        if whole:
            shutil.rmtree(self.partial / "written", ignore_errors=True)
        self.lock.close()  # NFS and Windows delete no open file
        if whole:
            with contextlib.suppress(OSError):  # another process has begun there meanwhile
                (self.partial / "lock").unlink()
                self.partial.rmdir()

    def _compare(self, there: dict) -> None:
        """Refuse to go on with another simulation."""
        for name, value in json.loads(json.dumps(self.settings)).items():
            if there.get(name) != value:
                raise ValueError(
                    f"{self.path} holds another simulation: {name} {there.get(name)} there, {value} now "
                    "(overwrite=True starts over)"
                )

    def _create(self, store):
        """An empty store with its coordinates."""
        import zarr

        plan, number = self.plan, len(self.plan.table)
        attributes = {
            "title": "Stands of the BoreaRL simulator, one a site",
            "settings": json.dumps(self.settings),
            "coordinates": " ".join(map(coordinate, plan.table)),
        }
        group = zarr.create_group(store, zarr_format=3, attributes=attributes)
        for name in plan.table:
            values = plan.table[name].to_numpy()
            unit = COLUMNS[name][2]
            units = {"units": UDUNITS.get(unit, unit)} if unit else {}
            group.create_array(
                coordinate(name), data=values, chunks=(number,), dimension_names=("stand",), attributes=units
            )
        group.create_array(
            "year",
            data=FIRST_YEAR + np.arange(plan.years),
            chunks=(plan.years,),
            dimension_names=("year",),
            attributes={"long_name": "year of the weather"},
        )
        for name in (*plan.variables, "action"):
            unit, meaning = {**RECORD, **TIMBER_COLUMNS}.get(name, ("1", name.replace("_", " ")))
            group.create_array(
                name,
                shape=(number, plan.years),
                chunks=(plan.size, plan.years),
                dtype="int8" if name == "action" else "float32",
                dimension_names=("stand", "year"),
                attributes={"units": UDUNITS.get(unit, unit), "long_name": meaning},
            )
        return group

    def write(self, k: int, played: dict[str, np.ndarray]) -> None:
        """Write chunk k, and then that it is written."""
        for name, values in played.items():
            self.group[name][self.plan.rows(k)] = values
        if self.path is not None:
            (self.partial / "written" / str(k)).touch()

    def dataset(self):
        """The finished store."""
        import xarray

        if self.path is not None and not self.path.exists():
            os.replace(self.partial / "data.zarr", self.path)
        store = self.group.store if self.path is None else self.path
        return xarray.open_zarr(store, consolidated=False, chunks=None, decode_timedelta=False)


def settings_of(folder: Path) -> dict:
    """What a store was made by; ValueError if it is none of ours."""
    import zarr

    try:
        return json.loads(zarr.open_group(folder, mode="r").attrs["settings"])
    except (OSError, KeyError, ValueError) as error:
        raise ValueError(f"{folder}: no store of simulate_many; name another path") from error


def check_whole(folder: Path) -> None:
    """ValueError if a part of a store cannot be read: whoever reads it later would not be told of which."""
    import zarr

    try:
        for _, array in zarr.open_group(folder, mode="r").arrays():
            for first in range(0, array.shape[0], array.chunks[0]):
                array[first : first + array.chunks[0]]
    except (OSError, RuntimeError, ValueError) as error:
        raise ValueError(f"{folder} is damaged ({error}); overwrite=True starts over") from error


def locked(path: Path, store: Path):
    """A file that no other process holds; ValueError if one does."""
    file = open(path, "w")
    if fcntl is not None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            raise ValueError(f"{store}: another process is at work on it") from None
        except OSError as error:
            warnings.warn(
                f"{store}: its file system has no locks ({error.strerror}); see that no other process works on it",
                RuntimeWarning,
                stacklevel=2,
            )
    return file


def coordinate(column: str) -> str:
    """What the store calls a column of the table: first stocks are not taken for those of the years."""
    return f"initial_{column}" if column in INITIAL_LIMITS else column


def digest(*arrays: np.ndarray) -> str:
    """Hash of arrays."""
    found = hashlib.sha256()
    for values in arrays:
        found.update(repr(values.shape).encode() + np.ascontiguousarray(values).tobytes())
    return found.hexdigest()[:16]


def in_words(value) -> str:
    """What an argument is, in words that are the same in every process and others for another value: of a table all of
    its numbers, of a file its content, of a function its code.
    """
    words = _in_words(value)
    return words if len(words) <= LONGEST_WORDS else f"{words[:LONGEST_WORDS]}.. {digest(np.array(words))}"


def _in_words(value) -> str:
    if isinstance(value, (str, Path)) and os.path.isfile(value):  # False, too, of text longer than names may be
        return f"{value} {hashlib.sha256(Path(value).read_bytes()).hexdigest()[:16]}"
    if isinstance(value, np.ndarray):
        value = value.tolist()
    elif hasattr(value, "to_dict"):  # of pandas and xarray, whose repr leaves most out
        value = value.to_dict()
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {_in_words(one)}" for key, one in value.items()) + "}"
    if isinstance(value, (set, frozenset)):  # whose order differs from process to process
        value = sorted(value, key=repr)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_in_words, value)) + "]"
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return type(value).__name__ + _in_words({f.name: getattr(value, f.name) for f in dataclasses.fields(value)})
    if callable(value):
        return f"{name_of(value)} {code_of(value)}"
    return re.sub(r" at 0x[0-9a-f]+", "", repr(value))


def name_of(function) -> str:
    """A function's name, or that of a callable's class."""
    return f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', type(function).__qualname__)}"


def code_of(function) -> str:
    """Hash of what a function does: its code, defaults, and what it has from around it; of a partial function of both
    parts.
    """
    if isinstance(function, functools.partial):
        return code_of(function.func) + in_words([function.args, function.keywords])
    code = getattr(function, "__code__", None) or getattr(type(function).__call__, "__code__", None)
    around = [cell.cell_contents for cell in getattr(function, "__closure__", None) or ()]
    around = [one for one in around if one is not function]  # which calls itself
    of_it = [_code(code), in_words(getattr(function, "__defaults__", None)), *map(in_words, around)]
    return hashlib.sha256(repr(of_it).encode()).hexdigest()[:16]


def _code(code) -> list:
    """Instructions and constants of a code object and of those in it."""
    if code is None:  # compiled
        return []
    constants = [_code(one) if isinstance(one, CodeType) else _in_words(one) for one in code.co_consts]
    return [code.co_code, code.co_names, constants]


def simulator() -> str:
    """Hash of the simulator's source and tables."""
    found, folder = hashlib.sha256(), Path(sim.__file__).parent
    for path in sorted([*folder.rglob("*.py"), *folder.rglob("*.csv")]):
        found.update(path.read_bytes())
    return found.hexdigest()[:16]
