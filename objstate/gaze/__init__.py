"""Choosing views: what sensors see from a place, the expected gain, and the ways there."""

from objstate.gaze.entropy import belief_entropy, gaussian_entropy, histogram_entropy
from objstate.gaze.floor import Floor, FloorSettings, Ways
from objstate.gaze.laser import LaserLooks, LookSettings
from objstate.gaze.sensors import Sensor

__all__ = [
    "Floor",
    "FloorSettings",
    "LaserLooks",
    "LookSettings",
    "Sensor",
    "Ways",
    "belief_entropy",
    "gaussian_entropy",
    "histogram_entropy",
]
