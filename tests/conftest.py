"""What holds for all tests."""

import os

from hypothesis import settings

# The first example of a law may wait for loops to be compiled.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

# Many tests start processes, which are not all to compile the package's modules anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
