"""The table of section IV of Elfring et al. 2012: upright round things and boxes, by colour.

Frame: x to the right of the camera, y away from it, z up from the table's top. The camera stands
above the origin.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from objstate.geometry import FloatArray

TABLE, GREEN, RED, BLUE, OTHER = range(5)  # colours
CUP_RADIUS, CUP_HEIGHT = 0.04, 0.10  # m
HAND_RADIUS, HAND_HEIGHT = 0.045, 0.12  # m, of a hand seen as an upright cylinder
BOOK = (0.20, 0.15, 0.03)  # m


@dataclass(frozen=True, eq=False)
class Scene:
    """What stands on the table at one moment."""

    rounds: FloatArray = field(repr=False)  # (n, 5) x, y, radius, height, colour
    boxes: FloatArray = field(repr=False)  # (b, 7) least and largest x, y, z, then colour
