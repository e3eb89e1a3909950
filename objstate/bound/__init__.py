"""The least error that anybody could make, from what a simulation knows: the Cramér-Rao bound."""

from objstate.bound.comparison import (
    BoundErrors,
    BoundEvaluation,
    compare_with_bounds,
    evaluate_bound,
)
from objstate.bound.drive import Bounds, bounds_of

__all__ = [
    "BoundErrors",
    "BoundEvaluation",
    "Bounds",
    "bounds_of",
    "compare_with_bounds",
    "evaluate_bound",
]
