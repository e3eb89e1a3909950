"""A whole run: recorded logs and a building in, a result folder out."""

from objstate.run.inputs import BuildingInput
from objstate.run.observer import Observer
from objstate.run.options import RunOptions
from objstate.run.run import FILES, GRID_FILES, RunResult, estimate_log, open_run, unknown_start
from objstate.run.scene import LAYOUT, SCENE

__all__ = [
    "FILES",
    "GRID_FILES",
    "LAYOUT",
    "SCENE",
    "BuildingInput",
    "Observer",
    "RunOptions",
    "RunResult",
    "estimate_log",
    "open_run",
    "unknown_start",
]
