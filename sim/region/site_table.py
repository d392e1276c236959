"""The table of sites of a region: its columns, and what is refused in them."""

import difflib

import numpy as np
import pandas as pd

import sim
from sim.parameters import check_name, check_noise, check_seed
from sim.spin_up import INITIAL_LIMITS, check_initial, most_biomass

OTHERS = ("middle", "sampled")
LATITUDE, LONGITUDE, SEED = "latitude_deg", "longitude_deg", "seed"
BIOMASS = "biomass_kgc_m2"
UNITS = {"stems_ha": "stems ha-1", "kgc_m2": "kgC m-2", "layer_m": "m", "age_years": "yr", "fraction": "1"}


def unit_of(stock: str) -> str:
    """Unit of a first stock, by the end of its name."""
    return next(unit for end, unit in UNITS.items() if stock.endswith(end))


#: Columns that a table of sites may have: name -> (low, high, unit).
COLUMNS = {
    **{name: (p.physical_low, p.physical_high, p.unit) for name, p in sim.SITE_PARAMETERS.items()},
    **{name: (low, high, unit_of(name)) for name, (low, high) in INITIAL_LIMITS.items()},
    LONGITUDE: (-180.0, 360.0, "degE"),
    SEED: (0, 2**63 - 1, ""),
}


def check_sites(sites, others: str, seed: int) -> pd.DataFrame:
    """A table of sites with a column `seed`; ValueError names row, column, value and what is allowed."""
    check_name("others", others, OTHERS)
    if not isinstance(sites, pd.DataFrame):
        raise ValueError(
            f"sites: a DataFrame with a row a site is allowed, got {type(sites).__name__}; sim.sites_on_grid makes one"
        )
    if not len(sites):
        raise ValueError("sites: the table has no row; at least one site is needed")
    for name in sites.columns:
        if name not in COLUMNS:
            begun = [column for column in COLUMNS if column.startswith(str(name).lower())]
            near = begun[:3] or difflib.get_close_matches(str(name).lower(), COLUMNS, n=3)
            raise ValueError(
                f"sites: unknown column {name!r}; "
                + (f"did you mean {', '.join(near)}? " if near else "")
                + "allowed are names of sim/site_parameters.csv, first stocks (initial= of sim.simulate), "
                f"{LONGITUDE} and {SEED}"
            )
    if not sites.columns.is_unique:
        raise ValueError(f"sites: column {sites.columns[sites.columns.duplicated()][0]!r} is there twice")
    if LATITUDE not in sites:
        raise ValueError(f"sites: column {LATITUDE} is missing; every site needs its latitude")
    table = pd.DataFrame({name: check_column(sites[name], *COLUMNS[name]) for name in sites.columns})
    check_initial({name: table[name].iloc[0] for name in table if name in INITIAL_LIMITS and name != BIOMASS})
    check_biomass(table, sites.index)
    if SEED not in table:
        last = check_seed("seed", seed) + len(table) - 1
        if last >= 2**63:
            raise ValueError(f"seed = {seed}: row k gets seed + k, so at most 2^63 - {len(table)} is allowed")
        table[SEED] = np.arange(len(table)) + np.int64(seed)
    return table.reset_index(drop=True)


def row_of(index: pd.Index, k: int) -> str:
    """Row k, as an error names it."""
    return f"zero-based row {k}" if index.equals(pd.RangeIndex(len(index))) else f"row {index[k]}"


def check_biomass(table: pd.DataFrame, index: pd.Index) -> None:
    """Refuse first biomass of no stems, or of more than stems of their age hold."""
    if BIOMASS not in table or (held := most_biomass(table)) is None:
        return
    stems, most = held
    wrong = (table[BIOMASS] > most).to_numpy()
    if wrong.any():
        k = int(wrong.argmax())
        raise ValueError(
            f"sites: {row_of(index, k)}, column {BIOMASS} is {table[BIOMASS].iloc[k]:g}; of {stems.iloc[k]:g} stems/ha "
            f"at most {most.iloc[k]:.4g} kgC/m2 is allowed"
        )


def check_noise_of(table: pd.DataFrame, index: pd.Index, stands: sim.Stands) -> None:
    """Refuse a swing of temperature that is too much with the weather of these stands."""
    name = "daily_noise_std_c"
    if name not in table:
        return
    k = int(table[name].argmax())
    try:
        check_noise({name: float(table[name].iloc[k]), **stands.constants, **stands.weather})
    except ValueError as error:
        raise ValueError(f"sites: {row_of(index, k)}, column {error}") from None


def check_column(column: pd.Series, low: float, high: float, unit: str) -> np.ndarray:
    """The numbers of a column, all within its limits."""
    whole = column.name == SEED
    numbers = pd.to_numeric(column, errors="coerce")
    values = numbers.to_numpy(float, na_value=np.nan)
    wrong = ~((values >= low) & (values <= high))
    if whole:
        wrong |= values % 1 != 0
    if column.dtype.kind in "bc":  # truth values, complex numbers
        wrong[:] = True
    if wrong.any():
        k = int(wrong.argmax())
        value = "missing" if pd.isna(column.iloc[k]) else f"{column.iloc[k]}"
        kind = "an integer" if whole else "a number"
        raise ValueError(
            f"sites: {row_of(column.index, k)}, column {column.name} is {value}; "
            f"{kind} in [{low:g}, {high:g}]{f' {unit}' if unit not in ('', '1') else ''} is allowed"
        )
    return numbers.to_numpy(np.int64) if whole else values
