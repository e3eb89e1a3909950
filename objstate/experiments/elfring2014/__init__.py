"""Sections 7 and 8 of Elfring et al. 2014: when to update which object, with which sensor."""

from objstate.experiments.elfring2014.alternatives import ALTERNATIVES
from objstate.experiments.elfring2014.cat import CatSetup, follow
from objstate.experiments.elfring2014.claims import Claim, claims
from objstate.experiments.elfring2014.cleaning import Verification, verifications
from objstate.experiments.elfring2014.setup import Assumptions, Setup
from objstate.experiments.elfring2014.simulation import Course, simulate
from objstate.experiments.elfring2014.sweeps import (
    Averages,
    Difference,
    Mean,
    Reproduction,
    reproduce,
)

__all__ = [
    "ALTERNATIVES",
    "Assumptions",
    "Averages",
    "CatSetup",
    "Claim",
    "Course",
    "Difference",
    "Mean",
    "Reproduction",
    "Setup",
    "Verification",
    "claims",
    "follow",
    "reproduce",
    "simulate",
    "verifications",
]
