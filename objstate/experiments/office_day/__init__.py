"""A working day in a simulated office: what a coordinator saves against simpler strategies."""

from objstate.experiments.office_day.comparison import (
    KNOBS,
    Saving,
    Trial,
    Worth,
    compare,
    savings,
    try_day,
)
from objstate.experiments.office_day.writing import write

__all__ = ["KNOBS", "Saving", "Trial", "Worth", "compare", "savings", "try_day", "write"]
