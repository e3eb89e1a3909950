"""Chapter 7 of the thesis on obstacle grid maps and active gaze control of the Darmstadt Dribblers."""

from objstate.experiments.darmstadt.reproduction import EXPERIMENTS, Reproduction, reproduce

__all__ = ["EXPERIMENTS", "Reproduction", "reproduce"]
