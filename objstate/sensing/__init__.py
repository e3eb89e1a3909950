"""Expected ranges of beams, and the likelihood of their readings."""

from objstate.sensing.beam_model import BeamModel
from objstate.sensing.expected import ExpectedRanges, cast_from
from objstate.sensing.level import UncertainObject
from objstate.sensing.sensing import Sensing
from objstate.sensing.view import Around, Comparison, ScanView

__all__ = [
    "Around",
    "BeamModel",
    "Comparison",
    "ExpectedRanges",
    "ScanView",
    "Sensing",
    "UncertainObject",
    "cast_from",
]
