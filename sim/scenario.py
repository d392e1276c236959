"""Climate change: what each year has on top of the site's own climate, and its carbon dioxide.

`scenarios.csv` has three paths of boreal land, against 1995-2014; `analysis/make_scenarios.py` writes it and has the
sources. A stand's first year is `FIRST_YEAR`; what comes before it, spin-up included, is without a path.
"""

import csv
from collections.abc import Mapping
from importlib.resources import files

import numpy as np

from sim.parameters import CONSTANTS, brief

FIRST_YEAR = 2025
TABLE = "scenarios.csv"
YEAR, LEAST_YEAR = "year", 1000
CO2 = "co2_ppm"

#: What the weather generator adds, as parameters, where no path says otherwise.
WITHOUT_SCENARIO = {"warming_k": 0.0, "warming_amplitude_k": 0.0, "precipitation_factor": 1.0}

#: What a path can have: column -> (lowest and highest value allowed, unit).
COLUMNS = {
    "warming_k": (-10.0, 15.0, "K"),
    "warming_amplitude_k": (-10.0, 10.0, "K"),
    "precipitation_factor": (0.3, 3.0, "(1: as without)"),
    CO2: (CONSTANTS[CO2].physical_low, CONSTANTS[CO2].physical_high, "ppm"),
}


def _read() -> dict[str, dict[str, list]]:
    lines = (files("sim") / TABLE).read_text(encoding="utf-8").splitlines()
    paths: dict[str, dict[str, list]] = {}
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        path = paths.setdefault(row["scenario"], {name: [] for name in ("year", *COLUMNS)})
        for name, values in path.items():
            values.append(int(row[name]) if name == "year" else float(row[name]))
    return paths


#: Name -> columns of `scenarios.csv`, `year` among them.
SCENARIOS = _read()


class Path:
    """A checked path: its `names`, and their `values` by year, shape (years, names); the first is a stand's first."""

    def __init__(self, columns: dict[str, np.ndarray], until: str):
        self.names = tuple(columns)
        self.values = np.column_stack(list(columns.values()))
        self.until = until

    def __len__(self) -> int:
        return len(self.values)

    def check_years(self, years: int) -> None:
        """Refuse to go on for more years than the path has."""
        if years > len(self):
            raise ValueError(f"years = {years}: the scenario {self.until}, so at most {len(self)} are allowed")


def check_scenario(scenario) -> Path | None:
    """A name of `SCENARIOS`, or a path of the user's, checked; None for none.

    A path is a dict or a DataFrame of one or more of `COLUMNS`. Its years are a column `year`, the index of a table (if
    it has a name, dates, texts, or numbers from `LEAST_YEAR` on), or the keys of a dict in place of a column; what is
    before `FIRST_YEAR` is left out. Without years the first value is that of `FIRST_YEAR`. Raises ValueError naming
    the value and what is allowed.
    """
    if scenario is None:
        return None
    if isinstance(scenario, str) and scenario in SCENARIOS:
        table = SCENARIOS[scenario]
        first = table["year"].index(FIRST_YEAR)
        columns = {name: np.array(table[name][first:]) for name in COLUMNS}
        return Path(columns, f"{scenario} is from {FIRST_YEAR} to {table['year'][-1]}")
    if not isinstance(scenario, Mapping) and not hasattr(scenario, "columns"):
        named = ", ".join(SCENARIOS)
        raise ValueError(
            f"scenario {brief(scenario)}: allowed are None, {named}, or a dict or DataFrame of a path by year"
        )
    columns = {}
    for name in scenario:
        if name not in COLUMNS and name != YEAR:
            raise ValueError(f"unknown column {name!r} of the scenario; allowed: {', '.join((YEAR, *COLUMNS))}")
        if name in COLUMNS:
            columns[name] = _check_column(name, scenario[name], scenario.get(YEAR))
    if not columns:
        raise ValueError(f"the scenario has no column; allowed: {', '.join(COLUMNS)}")
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"the scenario's columns are not equally long: {lengths}")
    return Path(columns, f"has {lengths.popitem()[1]} years")


def _check_column(name: str, values, years) -> np.ndarray:
    """Values of a column from `FIRST_YEAR` on. years : of the path's own column, or None."""
    beside = _years(values)
    if years is None:
        years = beside
    elif beside is not None and not np.array_equal(_plain(years), _plain(beside)):
        raise ValueError(f"scenario {name}: its own years are others than those of the column {YEAR}")
    if isinstance(values, Mapping):
        values = list(values.values())
    if np.ma.is_masked(values):
        raise ValueError(f"scenario {name}: a number for each year is allowed, got a masked one")
    try:
        numbers = np.asarray(values, dtype=float)
        if any(isinstance(value, (bool, np.bool_)) for value in np.ravel(np.asarray(values, dtype=object))):
            raise TypeError
    except (TypeError, ValueError):
        raise ValueError(f"scenario {name}: a number for each year is allowed, got {_no_number(values)!r}") from None
    if numbers.ndim != 1 or not len(numbers):
        raise ValueError(f"scenario {name}: a number for each year is allowed, got {brief(values)}")
    if years is None:
        years = FIRST_YEAR + np.arange(len(numbers))
    else:
        years = _check_years(name, years, len(numbers))
        numbers = numbers[years >= FIRST_YEAR]
        years = years[years >= FIRST_YEAR]
    low, high, unit = COLUMNS[name]
    wrong = ~((numbers >= low) & (numbers <= high))
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ValueError(f"scenario {name} = {numbers[k]:g} in {years[k]}: [{low:g}, {high:g}] {unit} is allowed")
    return numbers


def _no_number(values):
    """The first of values that is none, or all of them."""
    for value in np.ravel(np.asarray(values, dtype=object)):
        try:
            float(value)
        except (TypeError, ValueError):
            return value
        if isinstance(value, (bool, np.bool_)):
            return value
    return values


def _years(values):
    """Years that a column has beside its values, or None."""
    if isinstance(values, Mapping):
        return list(values)
    index = getattr(values, "index", None)
    if hasattr(values, "dims") and hasattr(values, "indexes"):  # of xarray
        index = values.indexes.get(values.dims[0]) if values.dims else None
    if index is None or callable(index):  # a list's index is a method
        return None
    dates = getattr(index, "year", None)
    if dates is not None:
        return dates
    rows = index.name in (None, *getattr(values, "dims", ())) and index.dtype.kind in "if"
    return None if rows and (not len(index) or index[0] < LEAST_YEAR) else list(index)


def _plain(years) -> np.ndarray:
    """Years, of dates too, as an array."""
    found = np.asarray(years)
    return found.astype("datetime64[Y]").astype(int) + 1970 if found.dtype.kind == "M" else found


def _check_years(name: str, given, number: int) -> np.ndarray:
    """The years of a column as integers, one by one, with `FIRST_YEAR` among them."""
    try:
        years = np.asarray(_plain(given), dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"scenario {name}: its years have to be integers, got {_no_number(given)!r}") from None
    if years.shape != (number,):
        raise ValueError(f"scenario {name}: {number} values of {years.size} years; a value each is allowed")
    apart = np.flatnonzero(np.diff(years) != 1.0)
    if (years % 1 != 0).any() or len(apart):
        which = f"{years[apart[0] + 1]:g} after {years[apart[0]]:g}" if len(apart) else f"{years[0]:g}"
        raise ValueError(f"scenario {name}: its years have to follow each other, got {which}")
    if not years[0] <= FIRST_YEAR <= years[-1]:
        raise ValueError(f"scenario {name}: its years are {years[0]:g} to {years[-1]:g}; {FIRST_YEAR} is needed, too")
    return years.astype(int)
