"""The simulations of section 7 of Elfring et al. 2014: when to update which object."""

from objstate.experiments.elfring2014.alternatives import ALTERNATIVES
from objstate.experiments.elfring2014.claims import Claim, claims
from objstate.experiments.elfring2014.setup import Assumptions, Setup
from objstate.experiments.elfring2014.simulation import Course, simulate
from objstate.experiments.elfring2014.sweeps import Averages, Mean, Reproduction, reproduce

__all__ = [
    "ALTERNATIVES",
    "Assumptions",
    "Averages",
    "Claim",
    "Course",
    "Mean",
    "Reproduction",
    "Setup",
    "claims",
    "reproduce",
    "simulate",
]
