"""The command line: the only place that prints, parses arguments and sets exit codes."""

from objstate.cli.entry import main

__all__ = ["main"]
