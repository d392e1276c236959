"""Where runs and results lie: below the folder in which a command is started."""

import errno
import os
from pathlib import Path

from cleanrl_style.flags import fail

QUICK = "quick"  # folder of what `reproduce.py --quick` makes, which are no results
REPOSITORY = Path(__file__).parents[1]


def runs(quick: bool = False) -> Path:
    """Folder that holds the runs."""
    return Path("runs", QUICK) if quick else Path("runs")


def results(quick: bool = False) -> Path:
    """Folder of all that is made of them."""
    return Path("results", QUICK) if quick else Path("results")


def archive(quick: bool = False) -> Path:
    """Folder of the archived runs."""
    return results(quick) / "runs"


def studies(quick: bool = False) -> Path:
    """Folder of the studies' tables."""
    return results(quick) / "studies"


def there(folder: Path) -> Path:
    """Where a folder of results is read from: the repository's, if there is none where the command is started."""
    return folder if os.path.isdir(folder) or QUICK in folder.parts else REPOSITORY / folder


def make_file_writable(flag: str, path: Path) -> None:
    """Make a file's folder before anything is computed; a flag that names a folder, or one that cannot be written to,
    ends the script with one line.
    """
    if os.path.isdir(path):
        fail(f"{flag} {path}: the name of a file is allowed")
    make_writable(flag, path.parent)


def make_writable(flag: str, folder: Path) -> None:
    """Make a folder before anything is computed; a flag's that cannot be written to ends the script with one line."""
    file = next((path for path in (folder, *folder.parents) if path.is_file()), None)
    if file is not None:
        fail(f"{flag} {folder}: cannot write there ({file} is a file)")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    except OSError as error:
        fail(f"{flag} {folder}: cannot write there ({error.strerror})")
