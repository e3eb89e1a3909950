"""A whole run: recorded logs and a building in, a result folder out."""

from objstate.run.options import RunOptions
from objstate.run.run import FILES, RunResult, estimate_log, open_run

__all__ = ["FILES", "RunOptions", "RunResult", "estimate_log", "open_run"]
