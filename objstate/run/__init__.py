"""A whole run: recorded logs and a building in, a result folder out."""

from objstate.run.inputs import BuildingInput
from objstate.run.memory import WorldUse
from objstate.run.options import RunOptions
from objstate.run.run import FILES, RunResult, estimate_log

__all__ = ["FILES", "BuildingInput", "RunOptions", "RunResult", "WorldUse", "estimate_log"]
