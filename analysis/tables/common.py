"""What all tables share: statistics over training seeds, cells with intervals, three formats."""

from pathlib import Path

import numpy as np
import pandas as pd

from analysis import experiments, methods, metrics
from cleanrl_style import protocol
from cleanrl_style.protocol import FLOAT_FORMAT

PAPER_TABLES = Path(__file__).parents[1] / "paper_tables"
#: The first columns of a table with a row for each method.
ROW_COLUMNS = {"method": "method", "environment": "environment", "setting": "setting", "seeds": "seeds"}


#: Columns with numbers that are there without a run.
NAMES = (*ROW_COLUMNS, "weight", "sites", "site_seed")
FORMATS = (".csv", ".md", ".tex")


def paper(name: str, **arguments) -> pd.DataFrame:
    """A table of the paper."""
    return pd.read_csv(PAPER_TABLES / f"{name}.csv", **arguments)


def row_of(key: tuple, number: int) -> dict:
    """The columns that name a row, with the number of its training seeds."""
    return dict(zip(("method", "environment", "setting"), key, strict=True)) | {"seeds": number}


def over_seeds(values: pd.DataFrame) -> dict:
    """Interquartile mean of each column over training seeds (rows), with its 95 % bootstrap interval."""
    row = {}
    for name in values:
        known = values[name].dropna().to_numpy(dtype=float)
        row[name] = metrics.iqm(known) if len(known) else np.nan
        row[f"{name}_low"], row[f"{name}_high"] = metrics.bootstrap_interval(known)
    return row


def cell(row: pd.Series, name: str) -> str:
    """A value as text; a number with its 95 % interval, if there is one."""
    value, low, high = (row.get(key, np.nan) for key in (name, f"{name}_low", f"{name}_high"))
    if isinstance(value, str):
        return value
    if pd.isna(value):
        return ""
    return f"{value:.4g}" if pd.isna(low) else f"{value:.4g} [{low:.4g}, {high:.4g}]"


def score_text(value: float, low: float = np.nan, high: float = np.nan) -> str:
    """A score with its interval; near 100, which much is compared with, of one decimal."""
    digits = 1 if any(95.0 <= one <= 105.0 for one in (value, low, high)) else 0
    if np.isnan(value):
        return ""
    one = np.isnan(low) or low == high
    return f"{value:z.{digits}f}" + ("" if one else f" [{low:z.{digits}f}, {high:z.{digits}f}]")  # z: no -0


def readable(table: pd.DataFrame, columns: dict[str, str]) -> pd.DataFrame:
    """The table's chosen columns as text: name -> heading. A row without runs says so in the cell after `seeds`.

    (Not in a table by weights, where the paper's weights are rows too.)
    """
    cells = [[cell(row, name) for name in columns] for _, row in table.iterrows()]
    text = pd.DataFrame(cells, columns=list(columns.values()))
    if "seeds" in table and "weight" not in table:
        text.iloc[(table.seeds == 0).to_numpy().nonzero()[0], list(columns).index("seeds") + 1] = "not run yet"
    return text


def has_numbers(table: pd.DataFrame, columns) -> bool:
    """Whether any of the shown columns has a number of ours: not the paper's, nor one that only names a row."""
    ours = [name for name in columns if name in table and name not in NAMES and not name.startswith("paper")]
    return any(pd.to_numeric(table[name], errors="coerce").notna().any() for name in ours)


def remove_table(stem: Path) -> None:
    """Remove what an earlier `write_table` left."""
    for suffix in FORMATS:
        stem.with_suffix(suffix).unlink(missing_ok=True)


def markdown(header, rows) -> str:
    """A Markdown table, a line each."""
    return "".join(f"| {' | '.join(line)} |\n" for line in (header, ["---"] * len(header), *rows))


def write_table(stem: Path, table: pd.DataFrame, text: pd.DataFrame) -> None:
    """stem.csv with all numbers; stem.md and stem.tex (booktabs) with the readable columns."""
    with protocol.replacing(stem.with_suffix(".csv")) as file:
        table.to_csv(file, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
    with protocol.replacing(stem.with_suffix(".md")) as file:
        file.write(markdown(text.columns, text.to_numpy()).encode())
    with protocol.replacing(stem.with_suffix(".tex")) as file:
        file.write(text.to_latex(index=False, escape=True, column_format="l" * text.shape[1]).encode())


def paper_name(script: str, env_id: str, setting: str) -> str | None:
    """What the paper's tables call a row's method; None if they do not have it.

    They have methods in the paper's environment, as they are by default. That its PPOs choose among valid actions alone
    the paper says, of other methods it does not: a number of theirs stands beside both readings.
    """
    its = env_id == experiments.GENERALIST and methods.flags(setting) in ("", "--no-masks")
    return methods.paper_name(script) if its else None
