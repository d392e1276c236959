"""Files that nobody ever sees half of, and the sign that a table has been cut short since."""

import contextlib
import os
import zipfile
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


def load_whole(path: Path, weights_only: bool):
    """What torch has saved in a file. zipfile.BadZipFile for one that is not as it was written; what torch raises."""
    import torch  # only here: the heuristics do without

    with zipfile.ZipFile(path) as archive:
        damaged = archive.testzip()  # torch does not look at the checksums that it wrote
    if damaged:
        raise zipfile.BadZipFile(f"damaged: {damaged}")
    return torch.load(path, weights_only=weights_only)


def is_cut(table: Path) -> bool:
    """Whether the last line of a table has no end, which ours all have."""
    return not table.read_bytes().endswith(b"\n")
