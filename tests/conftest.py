"""What all tests share: hypothesis without a clock and without a database, so that a run can be repeated; Ctrl-C; and
that of two processes of tests that need a kernel one compiles it and the other waits."""

import fcntl
import signal

from hypothesis import settings

from sim import block
from sim.jit import cache_folder

# Files that train, run a study or a script's process, or need every kernel; `pytest -m quick` leaves them out.
SLOW = """agents archive backends benchmark claims cuda document_results eupg fronts heuristics hosts make_figures
make_tables measure_balance mechanisms new_method picture ppo_curriculum ppo_gated ppo_group protocol resume scaling
sensitivity signal_to_noise soil_column stand_development stress three_objectives training_gains validate variance
warming moea best_plans"""


def pytest_collection_modifyitems(items):
    """Marks what is quick."""
    slow = {f"test_{name}" for name in SLOW.split()}
    for item in items:
        if item.path.stem not in slow:
            item.add_marker("quick")


settings.register_profile("repeatable", deadline=None, derandomize=True, database=None, max_examples=60)
settings.load_profile("repeatable")

# What a shell starts in the background ignores Ctrl-C, and so would the scripts that tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)


def compiled_once(kernel):
    """The function of that name in `sim.block`, which only one process at a time compiles for a number of lanes."""

    def waiting(lanes):
        if block.is_compiled(lanes):
            return kernel(lanes)
        cache_folder().mkdir(parents=True, exist_ok=True)
        with (cache_folder() / f"{lanes}_lanes.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            return kernel(lanes)

    return waiting


block.kernel = compiled_once(block.kernel)
