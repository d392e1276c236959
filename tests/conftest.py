"""What all tests share: hypothesis without a clock and without a database, so that a run can be repeated; Ctrl-C."""

import signal

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True, database=None, max_examples=60)
settings.load_profile("repeatable")

# What a shell starts in the background ignores Ctrl-C, and so would the scripts that tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)
