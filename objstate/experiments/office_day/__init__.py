"""A working day in a simulated office: what a coordinator saves against simpler strategies."""

from objstate.experiments.office_day.comparison import KNOBS, Trial, Worth, compare, saving, try_day

__all__ = ["KNOBS", "Trial", "Worth", "compare", "saving", "try_day"]
