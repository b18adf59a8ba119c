"""Settings for the whole suite."""

import os

from hypothesis import settings

# No deadline: the first example may compile a kernel, and shared machines stall.
settings.register_profile("default", deadline=None, max_examples=60)
settings.register_profile("ci", deadline=None, max_examples=60, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "default")
