"""The readings that localize the robot and those that update the objects.

Marginal inference keeps the two beliefs apart, so that no reading may serve both (section 2.2 of
the paper, which alternates between scans). Lasers, or every other beam, can be shared out as well.
"""

from __future__ import annotations

import numpy as np

from objstate.config import ObjectUpdateSettings
from objstate.geometry import BoolArray
from objstate.records import Scan


class Schedule:
    """Shares out a stream of scans between localization and objects."""

    def __init__(self, settings: ObjectUpdateSettings) -> None:
        self._settings = settings
        self._seen: dict[str, int] = {}  # number of scans of each laser so far: k of Table 1

    def share_out(self, scan: Scan) -> tuple[BoolArray, BoolArray]:
        """The beams (n,) that localize and those (n,) that update objects."""
        k = self._seen.get(scan.laser, 0)
        self._seen[scan.laser] = k + 1
        localizes = np.zeros(len(scan), dtype=bool)
        match self._settings.schedule:
            case "beams":
                localizes[k % 2 :: 2] = True
            case "alternate":
                localizes[:] = k % 2 == 0
            case lasers:
                localizes[:] = scan.laser in lasers
        return scan.valid & localizes, scan.valid & ~localizes
