"""Errors against truth, and whether the intervals hold it."""

from objstate.evaluation.breakdown import Group
from objstate.evaluation.calibration import Calibration
from objstate.evaluation.evaluation import CoordinateErrors, Evaluation, evaluate, evaluate_states
from objstate.evaluation.latest import LatestState, latest_states
from objstate.evaluation.lost import read_lost, within
from objstate.evaluation.movements import MovementErrors
from objstate.evaluation.paired import Difference
from objstate.evaluation.robot import RobotErrors, compare_paths
from objstate.evaluation.summary import Distances, StateErrors

__all__ = [
    "Calibration",
    "CoordinateErrors",
    "Difference",
    "Distances",
    "Evaluation",
    "Group",
    "LatestState",
    "MovementErrors",
    "RobotErrors",
    "StateErrors",
    "compare_paths",
    "evaluate",
    "evaluate_states",
    "latest_states",
    "read_lost",
    "within",
]
