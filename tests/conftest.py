"""What all tests share: hypothesis without a clock and without a database, so that a run can be repeated; Ctrl-C."""

import os
import signal

from hypothesis import settings

from sim import stands

# Files that train, run a study or a script's process, or need every kernel; `pytest -m quick` leaves them out. Single
# tests that take long for what they add have `@pytest.mark.slow`; `pytest` leaves them out, `pytest -m ""` does not.
SLOW = """agents archive arithmetic backends benchmark best_plans boreal_map claims command_line commands course cuda
decade_plans docs document_results ensembles eupg executor explore field_experiments flags fronts heuristics imports
make_figures make_tables measure_balance mechanisms moea new_method objective_scales outside picture plan_regression
ppo_curriculum ppo_gated ppo_group protocol region_killed replanning resume scaling sensitivity signal_to_noise
simulator_page site_choice soil_column stand_development stress sweep task three_objectives utility validate variance
warming workers"""


def pytest_collection_modifyitems(items):
    """Marks what is quick."""
    slow = {f"test_{name}" for name in SLOW.split()}
    for item in items:
        if item.path.stem not in slow:
            item.add_marker("quick")


# They kill processes as one can on Linux and macOS alone.
collect_ignore = ["test_region_killed.py", "test_resume.py"] if os.name == "nt" else []

# Bookkeeping is tested in steps of hours, for speed; that users may not is in test_simulate.py.
stands.LONGEST_STEP_MINUTES = 1440

settings.register_profile("repeatable", deadline=None, derandomize=True, database=None, max_examples=60)
settings.load_profile("repeatable")

# What a shell starts in the background ignores Ctrl-C, and so would the scripts that tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)
