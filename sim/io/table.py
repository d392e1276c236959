"""The rows of a record, from a file or from memory, and how an error names one of them."""

import csv
import gzip
import os
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

GZIP = b"\x1f\x8b"  # first bytes of what it packs
NO_NUMBER = -9990.0  # -9999 and its likes stand for what is not there
CALENDARS = ("standard", "gregorian", "proleptic_gregorian")  # that pandas has
PLACE = {"latitude_deg": ("latitude", "lat"), "longitude_deg": ("longitude", "lon")}


@dataclass(frozen=True)
class Table:
    """A record as it is given: its columns, and how to read some of them."""

    name: str
    columns: list[str]
    read: Callable[[list[str]], pd.DataFrame]
    first_line: int | None = None
    """Line of the file that has the first row; None for a table in memory."""
    units: dict[str, str] = field(default_factory=dict)
    """Units of columns by the attribute `units` of a NetCDF file or a Dataset."""
    place: dict[str, float] = field(default_factory=dict)
    """Latitude and longitude, as it has them itself."""

    def where(self, row: int) -> str:
        """The row, as an error names it."""
        if self.first_line is None:
            return f"{self.name}, zero-based row {row}"
        return f"{self.name}, line {self.first_line + row}"

    def numbers(self, texts: pd.Series, name: str) -> np.ndarray:
        """A column as numbers, NaN where nothing was measured. Raises ValueError for a text or a truth value, naming
        its row."""
        values = pd.to_numeric(texts, errors="coerce").to_numpy(float)
        wrong = np.isnan(values) & texts.notna().to_numpy()
        if texts.dtype.kind in "bO":
            wrong |= np.array([isinstance(value, (bool, np.bool_)) for value in texts])
        if wrong.any():
            row = int(np.argmax(wrong))
            comma = " with a decimal point" if re.fullmatch(r"[+-]?\d+,\d+", str(texts.iloc[row])) else ""
            allowed = f"a number{comma} is allowed, and for a gap nothing, NA, NaN or -9999"
            raise ValueError(f"{self.where(row)}: {name} is {texts.iloc[row]!r}; {allowed}")
        return np.where(values <= NO_NUMBER, np.nan, values)


def open_table(source) -> Table:
    """A CSV file (also packed as .gz), a NetCDF file, a DataFrame, or an xarray Dataset of one place."""
    if isinstance(source, pd.DataFrame):
        return _in_memory(source, "the table")
    if hasattr(source, "data_vars"):
        return _of_one_place(source, "the dataset")
    if not isinstance(source, (str, Path)):
        raise ValueError(f"forcing: a file, a DataFrame or a Dataset is allowed, got {type(source).__name__}")
    path = Path(source)
    if not os.path.isfile(path):  # of a name too long for the file system, too
        raise ValueError(f"forcing: there is no file {path}")
    if path.suffix.lower() in (".nc", ".nc4", ".netcdf"):
        from sim.io.dataset import import_xarray

        xarray = import_xarray("a NetCDF file")
        try:
            opened = xarray.open_dataset(path, decode_cf=False)
        except (ValueError, OSError, RuntimeError) as error:
            raise ValueError(
                f"forcing: {path.name}: no NetCDF file, or netCDF4 or h5netcdf is not installed, which read it"
            ) from error
        try:
            with opened as dataset:
                _check_calendar(dataset, path.name)
                return _of_one_place(xarray.decode_cf(dataset), path.name)
        except ValueError as error:  # of xarray's own where a file is damaged
            if path.name in str(error):
                raise
            raise ValueError(f"forcing: {path.name}: {error}") from error
    if path.suffix.lower() in (".zip", ".xlsx", ".xls", ".grib"):
        raise ValueError(
            f"forcing: {path.name}: a CSV file (also .gz) or a NetCDF file is allowed; unpack or export it"
        )
    check_utf8(f"forcing: {path.name}", path)
    return _csv(path)


def is_packed(path: Path) -> bool:
    """Whether a file is packed by gzip, by its name or its first bytes."""
    with path.open("rb") as file:
        return path.suffix.lower() == ".gz" or file.read(2) == GZIP


def check_utf8(what: str, path: Path) -> None:
    """Refuse a text file that is not UTF-8, by its line, or that cannot be unpacked. what : how the error begins."""
    if is_packed(path):
        try:
            with gzip.open(path, "rb") as packed:
                while packed.read(2**20):
                    pass
        except (gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise ValueError(f"{what}: it cannot be unpacked ({error}); a whole gzip file is allowed") from error
    with gzip.open(path, "rb") if is_packed(path) else path.open("rb") as file:
        for number, line in enumerate(file, start=1):
            try:
                line.decode("utf-8")
            except UnicodeDecodeError as error:
                byte = f"byte 0x{line[error.start]:02x}"
                raise ValueError(f"{what}, line {number}: {byte} is not UTF-8; save the file as UTF-8") from None


def _csv(path: Path) -> Table:
    opened = gzip.open(path, "rt", encoding="utf-8-sig") if is_packed(path) else path.open(encoding="utf-8-sig")
    with opened as file:
        comments, header = 0, file.readline()
        while header.startswith("#"):  # as AmeriFlux begins
            comments, header = comments + 1, file.readline()
        below = 0
        if header.lstrip('"').startswith("TOA5"):  # of Campbell's loggers: station, names, units, kinds of mean
            comments, header, below = comments + 1, file.readline(), 2
    if not header.strip():
        raise ValueError(f"forcing: {path.name}, line {comments + 1}: a row of column names is needed, got nothing")
    separator = max(",;\t", key=header.count)
    columns = [name.strip() for name in next(csv.reader([header.rstrip("\r\n")], delimiter=separator))]
    at = f"forcing: {path.name}, line {comments + 1}"
    if all(re.fullmatch(r"[-+.\d][-+.:\d eTZ]*", name) for name in columns):
        raise ValueError(f"{at}: a row of column names is needed, got numbers, {', '.join(columns[:3])}")
    if len(columns) == 1 and len(columns[0].split()) > 1:
        raise ValueError(
            f"{at}: columns separated by comma, semicolon or tab are allowed, got {header.strip()!r}; lines above the "
            "names have to begin with #"
        )
    twice = [name for k, name in enumerate(columns) if name in columns[:k]]
    if twice:
        raise ValueError(f"{at}: column {twice[0] or '(without a name)'} is there twice")

    _check_fields(path, separator, len(columns), comments)

    def read(names: list[str]) -> pd.DataFrame:
        # times stay text; a row of nothing is a row, so that lines can be counted
        try:
            table = pd.read_csv(
                path,
                sep=separator,
                skiprows=comments + 1 + below,
                header=None,
                names=columns,
                usecols=names,
                index_col=False,
                skip_blank_lines=False,
                na_values=["NAN"],  # as Campbell's loggers write it
                dtype={name: str for name in names if _is_time(name)},
                low_memory=False,
                compression="gzip" if is_packed(path) else None,
                encoding="utf-8-sig",
            )
        except pd.errors.ParserError as error:
            fields = f"fields for the header's {len(columns)} names are needed in its rows"
            raise ValueError(f"forcing: {path.name}: {fields} ({' '.join(str(error).split())})") from error
        empty = table.isna().all(axis=1).to_numpy()
        return table.iloc[: len(table) - int(np.argmin(empty[::-1])) if len(table) and not empty.all() else 0]

    return Table(path.name, columns, read, first_line=comments + 2 + below)


def _check_fields(path: Path, separator: str, most: int, above: int) -> None:
    """Refuse a row of more fields than there are names, such as of decimal commas: it would be read shifted; and one
    of a stray quote, which would take up the rows below. above : lines above the names."""
    opens = re.compile(rf'(^|{separator})"')
    with gzip.open(path, "rt", encoding="utf-8") if is_packed(path) else path.open(encoding="utf-8") as file:
        for number, line in enumerate(file, start=1):
            fields = line.rstrip(f"{separator}\r\n").count(separator) + 1
            if number > above and fields > most and '"' not in line:
                raise ValueError(
                    f"forcing: {path.name}, line {number}: {fields} fields; the header has {most} names (lines above "
                    "the names have to be removed, or begin with #)"
                )
            if number > above and line.count('"') % 2 and opens.search(line):
                raise ValueError(f"forcing: {path.name}, line {number}: a quote is opened and not closed in its line")
            if not line.endswith(("\n", "\r")) and line.strip() and line.count(separator) + 1 < most:
                raise ValueError(f"forcing: {path.name}, line {number}: the file ends within a row; it was cut short")


def _is_time(name: str) -> bool:
    return "time" in name.lower() or "date" in name.lower()


def _in_memory(frame: pd.DataFrame, name: str) -> Table:
    if frame.index.name is not None or isinstance(frame.index, (pd.DatetimeIndex, pd.MultiIndex)):
        both = {*map(str, frame.columns)} & {str(level or "time") for level in frame.index.names}
        if both:
            raise ValueError(f"forcing: {name}: {min(both)} is there twice, as the index and as a column")
        frame = frame.reset_index(names="time" if frame.index.name is None and frame.index.nlevels == 1 else None)
    frame = frame.reset_index(drop=True)
    columns = [str(column) for column in frame.columns]
    twice = [name for k, name in enumerate(columns) if name in columns[:k]]
    if twice:
        raise ValueError(f"forcing: {name}: column {twice[0]} is there twice")
    return Table(name, columns, lambda names: frame.set_axis(columns, axis=1)[names])


def _of_one_place(dataset, name: str) -> Table:
    _check_calendar(dataset, name)
    wide = {dim: size for dim, size in dataset.sizes.items() if size > 1 and not _is_time(str(dim))}
    if wide:
        dim, size = next(iter(wide.items()))
        raise ValueError(f"forcing: {name} has {size} values of {dim}; choose one, such as by .sel or .isel")
    frame = dataset.squeeze([dim for dim in dataset.sizes if not _is_time(str(dim))], drop=True).to_dataframe()
    variables = {str(column): variable for column, variable in dataset.variables.items()}
    units = {column: str(variable.attrs.get("units", "")).strip() for column, variable in variables.items()}
    place = {
        quantity: float(variables[column].values.item())
        for quantity, columns in PLACE.items()
        for column in columns
        if column in variables and variables[column].size == 1 and variables[column].dtype.kind in "iuf"
    }
    return replace(_in_memory(frame, name), units={column: unit for column, unit in units.items() if unit}, place=place)


def _check_calendar(dataset, name: str) -> None:
    """Refuse times of a climate model's calendar, whether xarray has read them yet or not."""
    for column, variable in dataset.variables.items():
        calendar = variable.attrs.get("calendar")
        if variable.dtype.kind == "O" and variable.size:
            calendar = getattr(variable.values.flat[0], "calendar", calendar)
        if calendar is not None and str(calendar).lower() not in CALENDARS:
            allowed = ", ".join(CALENDARS)
            raise ValueError(f"forcing: {name}: {column} is of the calendar {calendar!r}; allowed are {allowed}")
