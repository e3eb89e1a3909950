"""The papers' experiments as commands, on simulated drives, beside the papers' figures."""

from objstate.experiments.reproduction import Experiment, Reproduction, reproduce
from objstate.experiments.tables import Table

__all__ = ["Experiment", "Reproduction", "Table", "reproduce"]
