"""Tables on disk that know what made them, so that a study that was stopped goes on where it stopped."""

import json
import sys
from functools import cache
from pathlib import Path

import pandas as pd

from cleanrl_style.protocol import FLOAT_FORMAT, provenance, replacing


def write(path: Path, table: pd.DataFrame, settings: dict) -> None:
    """Write a table as CSV, whole or not at all; its first line is a comment with what made it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as file:
        file.write(f"# {json.dumps(with_physics(settings))}\n".encode())
        table.to_csv(file, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")


def with_physics(settings: dict) -> dict:
    """Settings, and by which source of the simulator a table is made."""
    return settings | {"physics": provenance.physics_name()}


def read(path: Path, text: tuple[str, ...] = ()) -> pd.DataFrame:
    """A table that `write` wrote; text : columns that stay text though they look like numbers, empty cells included.

    One that was made with another source of the simulator is said to be.
    """
    say_if_of_another_physics(path)
    table = pd.read_csv(path, skiprows=1, dtype=dict.fromkeys(text, str))
    table[list(text)] = table[list(text)].fillna("")
    return table


def settings(path: Path) -> dict:
    """What made a table."""
    with path.open(encoding="utf-8") as file:
        return json.loads(file.readline().removeprefix("#"))


@cache
def say_if_of_another_physics(path: Path) -> None:
    """One line on standard error, once, about a table that was made with another source of the simulator."""
    if settings(path).get("physics", provenance.physics_name()) != provenance.physics_name():
        print(f"{path}: made with another source of the simulator; its command makes it anew", file=sys.stderr)


def is_finished(path: Path, made_by: dict) -> bool:
    """Whether the table is there and was made with these settings in this physics."""
    return path.exists() and settings(path) == json.loads(json.dumps(with_physics(made_by)))
