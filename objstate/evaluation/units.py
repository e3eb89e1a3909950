"""The units in which people read states."""

from __future__ import annotations

import math
from typing import NamedTuple


class Reading(NamedTuple):
    """How a number in SI units is shown."""

    unit: str
    factor: float  # from SI
    decimals: int


UNITS = {
    "angle": Reading("deg", 180 / math.pi, 1),
    "yaw": Reading("deg", 180 / math.pi, 1),
    "offset": Reading("m", 1.0, 3),
    "x": Reading("m", 1.0, 3),
    "y": Reading("m", 1.0, 3),
}
