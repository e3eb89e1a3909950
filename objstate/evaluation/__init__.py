"""Errors against truth, and whether the intervals hold it."""
