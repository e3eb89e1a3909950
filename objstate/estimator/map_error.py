"""How far off the building is, as the log itself tells.

Where a wall stands aside of its place in the model, its beams read long, or short,
each time it is seen. Noise and the robot's own errors are others the next second.
So the product of what one place reads off now and what it read off before is, on
average, the variance of the error that stays.
"""

from __future__ import annotations

import numpy as np

from objstate.config import MapErrorSettings
from objstate.geometry import FloatArray
from objstate.records import NANOSECONDS


class MapError:
    """A running estimate of the standard deviation, m, by which places are off the model."""

    def __init__(self, settings: MapErrorSettings) -> None:
        self._settings = settings
        self._sum = settings.weight * settings.std_m**2
        self._count = settings.weight
        self._squares = settings.weight * settings.std_m**4
        self._noted_ns: int | None = None
        self._before: dict[tuple[int, int], tuple[float, int]] = {}  # sum and number, by cell

    @property
    def std(self) -> float:
        """m, by what the looks agree on: their mean less half its standard error."""
        mean = self._sum / self._count
        error = np.sqrt(max(self._squares / self._count - mean**2, 0.0) / self._count)
        return max(float(np.sqrt(max(mean - error / 2.0, 0.0))), self._settings.least_m)

    def is_due(self, stamp_ns: int) -> bool:
        """Whether enough time has gone by since the last note that its errors are forgotten."""
        wait = self._settings.every_s * NANOSECONDS
        return self._noted_ns is None or stamp_ns - self._noted_ns >= wait

    def note(self, stamp_ns: int, places: FloatArray, off: FloatArray) -> None:
        """Take in that beams which should end at places (n, 2) read longer by ``off`` (n,) m."""
        s, self._noted_ns = self._settings, stamp_ns
        believable = np.abs(off) < s.most_m  # not stopped by something, nor through a gap
        if not believable.any():
            return
        cells = np.floor(places[believable] / s.cell_m).astype(np.int64)
        order = np.lexsort(cells.T)
        cells, off = cells[order], off[believable][order]
        starts = np.flatnonzero(np.append(True, (np.diff(cells, axis=0) != 0).any(axis=1)))
        for part, (x, y) in zip(np.split(off, starts[1:]), cells[starts], strict=True):
            if len(part) < s.beams:
                continue
            middle = float(np.median(part))  # beside a corner, some beams read another wall
            total, visits = self._before.get((x, y), (0.0, 0))
            if visits:
                product = middle * total / visits
                self._sum += product
                self._squares += product**2
                self._count += 1
            self._before[x, y] = (total + middle, visits + 1)
