"""The sites of a region: a table for `sim.simulate_many` from latitudes and longitudes, and from gridded climate."""

from pathlib import Path

import numpy as np
import pandas as pd

from sim.io.dataset import import_xarray
from sim.region.site_table import COLUMNS, LATITUDE, LONGITUDE, SEED

AXES = {LATITUDE: (LATITUDE, "latitude", "lat"), LONGITUDE: (LONGITUDE, "longitude", "lon")}  # names that files use
MONTHLY = "air_temperature_c"  # of twelve months, from which mean and seasonal amplitude of a site follow
CLIMATE = ("mean_annual_temperature_c", "seasonal_amplitude_c")
WARMEST_MONTH_C = 60.0  # beyond it, a temperature is in kelvin
#: A month's mean of an annual cosine is so much less than the cosine.
IN_A_MONTH = np.sin(np.pi / 12) / (np.pi / 12)


def sites_on_grid(latitudes, longitudes, climate=None) -> pd.DataFrame:
    """A table of sites, a row a point of the grid, from the north-west on.

    latitudes, longitudes : [degN, degE]. climate : None leaves the climate to the latitude, as for sampled sites; or an
    xarray.Dataset, or the path of a NetCDF file or zarr store, with coordinates `latitude` and `longitude` (or lat and
    lon) and with variables that are named as columns of a table of sites, or with `air_temperature_c` of twelve months,
    from which mean annual temperature and seasonal amplitude are made. Each point takes the file's nearest; one where
    all of it is missing, as over sea, is left out.

    Raises ValueError naming what is wrong and what is allowed.
    """
    points = [check_axis(name, values) for name, values in ((LATITUDE, latitudes), (LONGITUDE, longitudes))]
    latitude, longitude = (values.ravel() for values in np.meshgrid(points[0][::-1], points[1], indexing="ij"))
    table = pd.DataFrame({LATITUDE: latitude, LONGITUDE: longitude})
    if climate is None:
        return table
    values = climate_at(climate, latitude, longitude)
    known = values.notna().any(axis=1)
    if not known.any():
        raise ValueError("climate: every point of the grid is missing in the file; is it another region's?")
    return pd.concat([table, values], axis=1)[known].reset_index(drop=True)


def check_axis(name: str, values) -> np.ndarray:
    """Latitudes or longitudes in increasing order, each once."""
    low, high, unit = COLUMNS[name]
    try:
        numbers = np.unique(np.asarray(values, dtype=float))
        allowed = (
            not np.ma.is_masked(values)
            and np.ndim(values) == 1
            and len(numbers)
            and ((numbers >= low) & (numbers <= high)).all()
        )
    except (TypeError, ValueError):  # text, or rows of several lengths
        allowed = False
    if allowed and len(numbers) < len(values):
        raise ValueError(f"{name}: each number once is allowed, got {values!r}")
    if not allowed:
        raise ValueError(f"{name}: a sequence of numbers in [{low:g}, {high:g}] {unit} is allowed, got {values!r}")
    if name == LONGITUDE and len(np.unique(numbers % 360.0)) < len(numbers):
        raise ValueError(f"{name}: each meridian once is allowed, and -180 is 180; got {values!r}")
    return numbers


def climate_at(climate, latitude: np.ndarray, longitude: np.ndarray) -> pd.DataFrame:
    """Columns of a table of sites at these points, of a gridded climate."""
    xarray = import_xarray("climate=")

    if isinstance(climate, (str, Path)):
        if not Path(climate).exists():
            raise ValueError(f"climate: there is no file {climate}")
        try:
            file = (xarray.open_zarr if Path(climate).is_dir() else xarray.open_dataset)(climate)
        except (OSError, ValueError) as error:
            raise ValueError(
                f"climate: {climate} cannot be read as a zarr store or a NetCDF file, or netCDF4 or h5netcdf is not "
                "installed, which read it"
            ) from error
        with file:
            return climate_at(file, latitude, longitude)
    if not isinstance(climate, xarray.Dataset):
        raise ValueError(f"climate: a path or an xarray.Dataset is allowed, got {type(climate).__name__}")
    axes: dict[str, str] = {}
    for name, names in AXES.items():
        found = [one for one in names if one in climate.coords and climate[one].ndim == 1]
        if not found:
            raise ValueError(f"climate: it has no coordinate {' or '.join(names[1:])} of one dimension")
        axes[found[0]] = name
        check_coordinate(found[0], climate[found[0]].to_numpy())
    grid = climate.rename(axes)
    grid = grid.assign_coords({LONGITUDE: wrapped(grid[LONGITUDE])}).sortby([LATITUDE, LONGITUDE])
    points = {LATITUDE: ("point", latitude), LONGITUDE: ("point", wrapped(longitude))}
    columns: dict[str, np.ndarray] = {}
    for name in grid.data_vars:
        if name not in COLUMNS and name != MONTHLY or name in (SEED, LATITUDE, LONGITUDE):
            allowed = ", ".join(column for column in COLUMNS if column not in (SEED, LATITUDE, LONGITUDE))
            raise ValueError(f"climate: unknown variable {name!r}; allowed: {MONTHLY} of twelve months, {allowed}")
        others = [size for size in grid[name].dims if size not in (LATITUDE, LONGITUDE)]
        shape = [grid.sizes[size] for size in others]
        if shape != ([12] if name == MONTHLY else []):
            months = "twelve months, " if name == MONTHLY else ""
            raise ValueError(
                f"climate: {name} has dimensions {grid[name].dims}; {months}latitude, longitude are allowed"
            )
        if grid[name].dtype.kind not in "iuf":
            raise ValueError(f"climate: {name} has type {grid[name].dtype}; numbers are allowed")
        values = nearest(grid[name], points).transpose("point", ...).to_numpy().astype(float)
        if name == MONTHLY:
            check_months(values, latitude, longitude)
        columns |= dict(zip(CLIMATE, mean_and_amplitude(values), strict=True)) if name == MONTHLY else {name: values}
    if not columns:
        raise ValueError("climate: it has no variable")
    return pd.DataFrame(columns)


def check_coordinate(name: str, values: np.ndarray) -> None:
    """Refuse a coordinate of a file that is no number somewhere, or twice the same."""
    if values.dtype.kind not in "iuf" or not np.isfinite(values).all():
        raise ValueError(f"climate: coordinate {name} has a value that is missing or no number")
    found, counts = np.unique(values, return_counts=True)
    if (counts > 1).any():
        raise ValueError(f"climate: coordinate {name} has {found[counts > 1][0]:g} twice; each once is allowed")


def wrapped(longitude):
    """Longitudes in [-180, 180)."""
    return (longitude + 180.0) % 360.0 - 180.0


def nearest(values, points: dict):
    """Values at the nearest points of the grid; ValueError for a point farther from it than the grid is wide."""
    for name, (_, wanted) in points.items():
        there = values[name].to_numpy()
        gaps = np.abs(there[:, None] - wanted).min(axis=0)
        if name == LONGITUDE:
            gaps = np.minimum(gaps, np.abs(there[[0, -1], None] + [[360.0], [-360.0]] - wanted).min(axis=0))
        far = gaps > (np.diff(there).max() if len(there) > 1 else 1.0)
        if far.any():
            raise ValueError(
                f"climate: {name} = {wanted[far][0]:g} lies outside the file's [{there[0]:g}, {there[-1]:g}]"
            )
    xarray = import_xarray("climate=")
    if LONGITUDE in points:  # from 179 E it is nearer to 180 W than to 177 E
        last, first = (
            values.isel({LONGITUDE: [k]}).assign_coords({LONGITUDE: values[LONGITUDE][[k]] + turn})
            for k, turn in ((-1, -360.0), (0, 360.0))
        )
        values = xarray.concat([last, values, first], LONGITUDE)
    return values.sel(
        {name: xarray.DataArray(wanted, dims=dim) for name, (dim, wanted) in points.items()}, method="nearest"
    )


def check_months(months: np.ndarray, latitude: np.ndarray, longitude: np.ndarray) -> None:
    """Refuse a point that has some of the twelve months (points, 12) and not all."""
    missing = np.isnan(months)
    some = missing.any(axis=1) & ~missing.all(axis=1)
    if some.any():
        k = int(np.argmax(some))
        raise ValueError(
            f"climate: {MONTHLY} of latitude {latitude[k]:g}, longitude {longitude[k]:g} lacks month "
            f"{int(np.argmax(missing[k])) + 1}; all twelve, or none, are allowed"
        )


def mean_and_amplitude(months: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and half-range of the cosine of a year [degC], of monthly means (points, 12)."""
    if np.nanmax(months, initial=-np.inf) > WARMEST_MONTH_C:
        raise ValueError(f"climate: {MONTHLY} is {np.nanmax(months):g}; is it in kelvin? degC is allowed")
    wave = np.exp(-2j * np.pi * np.arange(12) / 12)
    return months.mean(axis=1), 2.0 * np.abs(months @ wave) / 12 / IN_A_MONTH
