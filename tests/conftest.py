"""What all tests share: hypothesis without a clock and without a database, so that a run can be repeated."""

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True, database=None, max_examples=60)
settings.load_profile("repeatable")
