"""Logs with known truth, from a building and a scene."""
