"""Section IV of Elfring et al. 2012: verification of a table, and the game of cups."""

from objstate.experiments.elfring2012.exploration import Exploration, explore
from objstate.experiments.elfring2012.falsifying import Case, Falsified, falsify
from objstate.experiments.elfring2012.games import METHODS, SPEEDS, Tally, shuffled, stages_at
from objstate.experiments.elfring2012.reproduction import Reproduction, reproduce
from objstate.experiments.elfring2012.shuffling import Hiding

__all__ = [
    "METHODS",
    "SPEEDS",
    "Case",
    "Exploration",
    "Falsified",
    "Hiding",
    "Reproduction",
    "Tally",
    "explore",
    "falsify",
    "reproduce",
    "shuffled",
    "stages_at",
]
