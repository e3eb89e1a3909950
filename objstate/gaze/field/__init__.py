"""Where to turn a head: entropy of the field (Darmstadt, section 6.3; ``docs/gaze.md``)."""

from objstate.gaze.field.entropy_map import EntropyMap, corners
from objstate.gaze.field.focus import Focus, FocusGazer
from objstate.gaze.field.head import Head
from objstate.gaze.field.looking import Gaze, Gazer, GazeSettings
from objstate.gaze.field.objects import ObjectGains
from objstate.gaze.field.pan_tilt import PanTilt

__all__ = [
    "EntropyMap",
    "Focus",
    "FocusGazer",
    "Gaze",
    "GazeSettings",
    "Gazer",
    "Head",
    "ObjectGains",
    "PanTilt",
    "corners",
]
