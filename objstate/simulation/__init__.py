"""Logs with known truth, from a building and a scene."""

from objstate.simulation.drive import SimulationResult, simulate

__all__ = ["SimulationResult", "simulate"]
