"""What holds for all tests."""

from hypothesis import settings

# The first example of a law may wait for loops to be compiled.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")
