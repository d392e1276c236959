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
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    core, *sys.argv = sys.argv[1:]
    sys.path[0] = str(Path(sys.argv[0]).resolve().parent)
    if core != "any":
        os.sched_setaffinity(0, {int(core)})
    threading.Thread(target=end_with_input, daemon=True).start()
    runpy.run_path(sys.argv[0], run_name="__main__")
