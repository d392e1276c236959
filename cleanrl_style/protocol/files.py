"""Files that nobody ever sees half of, and the sign that a table has been cut short since."""

import contextlib
import os
from pathlib import Path


@contextlib.contextmanager
def replacing(path: Path):
    """A binary file that takes the place of `path` when the block ends; if it fails, the old file stays."""
    temporary = path.with_name(path.name + ".tmp")
    try:
        with open(temporary, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def is_cut(table: Path) -> bool:
    """Whether the last line of a table has no end, which ours all have."""
    return not table.read_bytes().endswith(b"\n")
