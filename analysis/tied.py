"""Runs a script as `python` would, tied to the process that started this one: when that ends, the script ends.

    python -m analysis.tied CORE SCRIPT ARGUMENTS      CORE: number of the core to run on, or any

The parent holds the other end of the standard input, which closes however it ends. In a process group of its own.
"""

import os
import runpy
import signal
import sys
import threading
from pathlib import Path


def end_with_input() -> None:
    """End this process and those that it started when the standard input closes."""
    while os.read(0, 1024):
        pass
    if hasattr(os, "killpg"):
        os.killpg(0, signal.SIGKILL)
    os._exit(1)  # on Windows, where what this process started ends by its own closed pipe


if __name__ == "__main__":
    given = sys.argv[1:]
    if len(given) < 2 or not (given[0] == "any" or given[0].isdecimal()) or not Path(given[1]).is_file():
        got = " ".join(given) or "nothing"
        sys.exit(f"error: CORE SCRIPT ARGUMENTS are allowed, a core's number or any and a Python file, got {got}")
    core, *sys.argv = given
    sys.path[0] = str(Path(sys.argv[0]).resolve().parent)
    if core != "any":
        os.sched_setaffinity(0, {int(core)})
    threading.Thread(target=end_with_input, daemon=True).start()
    runpy.run_path(sys.argv[0], run_name="__main__")
