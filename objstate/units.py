"""Factors between units."""

SECONDS_PER_HOUR = 3600.0
SECONDS_PER_DAY = 86_400.0
