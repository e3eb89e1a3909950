"""Factors between units."""

SECONDS_PER_HOUR = 3600.0
