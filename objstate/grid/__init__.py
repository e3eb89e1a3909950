"""An occupancy grid whose cells age: obstacles that are not in the building.

Source: the thesis on obstacle grid maps and active gaze control of the Darmstadt Dribblers (TU
Darmstadt), cited as "Darmstadt" with its equations and algorithms; ``docs/grid.md`` says where its
text and its printed formulas differ.
"""

from objstate.grid.candidates import Candidate, Candidates
from objstate.grid.cells import AverageCells, BayesCells, CellModel, CountCells, LogOddsCells
from objstate.grid.drawing import (
    Drawing,
    beam,
    circle,
    ellipse,
    expected_occupancy,
    gaussian,
    polygon,
    rectangle,
    spread_of,
    swept,
)
from objstate.grid.entropy import entropy
from objstate.grid.grid import Grid
from objstate.grid.layout import Layout
from objstate.grid.merging import (
    MERGES,
    Merge,
    add,
    bayes,
    either,
    maximum,
    merged,
    overwrite,
    resampled,
)
from objstate.grid.percepts import Camera, Percepts, laser_percepts

__all__ = [
    "MERGES",
    "AverageCells",
    "BayesCells",
    "Camera",
    "Candidate",
    "Candidates",
    "CellModel",
    "CountCells",
    "Drawing",
    "Grid",
    "Layout",
    "LogOddsCells",
    "Merge",
    "Percepts",
    "add",
    "bayes",
    "beam",
    "circle",
    "either",
    "ellipse",
    "entropy",
    "expected_occupancy",
    "gaussian",
    "laser_percepts",
    "maximum",
    "merged",
    "overwrite",
    "polygon",
    "rectangle",
    "resampled",
    "spread_of",
    "swept",
]
