"""Where to turn a head: entropy of the field (Darmstadt, section 6.3; ``docs/gaze.md``)."""

from objstate.gaze.field.entropy_map import EntropyMap, corners
from objstate.gaze.field.head import Head
from objstate.gaze.field.looking import Gaze, Gazer, GazeSettings

__all__ = ["EntropyMap", "Gaze", "GazeSettings", "Gazer", "Head", "corners"]
