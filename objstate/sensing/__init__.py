"""What each beam should read, and how likely it is to read what it read."""

from objstate.sensing.beam_model import BeamModel
from objstate.sensing.expected import ExpectedRanges, cast_from
from objstate.sensing.level import UncertainObject
from objstate.sensing.sensing import Sensing
from objstate.sensing.view import Comparison, ScanView

__all__ = [
    "BeamModel",
    "Comparison",
    "ExpectedRanges",
    "ScanView",
    "Sensing",
    "UncertainObject",
    "cast_from",
]
