"""How far off the building is, as the log itself tells.

Where a wall stands aside of its place in the model, its beams read long, or short,
each time it is seen. Noise and the robot's own errors are others the next second.
So the product of what one place lies off now and what it lay off before is, on
average, the variance of the error that stays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from objstate.config import MapErrorSettings
from objstate.estimator.kernels import wall_looks
from objstate.geometry import FloatArray
from objstate.records import NANOSECONDS

_Place = tuple[float, float, float]  # column and row of its cell, and which way its wall faces


@dataclass(frozen=True)
class _Mean:
    """What one place lay off so far, m, and its precision, 1/m^2."""

    off: float
    precision: float


class MapError:
    """A running estimate of the standard deviation, m, by which places are off the model."""

    def __init__(self, settings: MapErrorSettings) -> None:
        self._settings = settings
        self._guessed = settings.weight / settings.std_m**4  # precision of the first guess, 1/m^4
        self._precision = self._guessed
        self._sum = self._precision * settings.std_m**2
        self._noted_ns: int | None = None
        self._before: dict[_Place, _Mean] = {}

    @property
    def std(self) -> float:
        """m, along the walls' normals, by what looks at a place agree on: as far as learnt, less its standard error."""
        mean, error = self._sum / self._precision, self._precision**-0.5
        learnt = 1.0 - self._guessed / self._precision
        return math.sqrt(max(mean - learnt * error, self._settings.least_m**2))

    def is_due(self, stamp_ns: int) -> bool:
        """Whether enough time has gone by since the last note that its errors are forgotten."""
        wait = self._settings.every_s * NANOSECONDS
        return self._noted_ns is None or stamp_ns - self._noted_ns >= wait

    def note(
        self, stamp_ns: int, places: FloatArray, directions: FloatArray, longer: FloatArray
    ) -> None:
        """Take in a scan's beams in their order.

        They should end at places (n, 2), go in ``directions`` (n, 2), unit vectors seen from
        above, and read ``longer`` (n,) m than they should. Pairs of looks weigh by how well they
        tell a variance; a place that lies off by more than ``clip`` deviations counts as if by so many.
        """
        s, self._noted_ns, guess = self._settings, stamp_ns, self._settings.std_m**2
        looks = wall_looks(
            places, directions, longer, s.cell_m, s.most_m, s.beams, s.in_full, s.noise_m**2
        )
        for column, row, side, off, noise in looks.tolist():
            place = (column, row, side)
            clip = s.clip * math.sqrt(self.std**2 + noise)
            now = min(max(off, -clip), clip)
            before = self._before.get(place, _Mean(0.0, 0.0))
            if before.precision > 0.0:
                weight = 1.0 / ((guess + noise) * (guess + 1.0 / before.precision))
                self._sum += weight * now * before.off
                self._precision += weight
            precision = before.precision + 1.0 / noise
            mean = before.off + (now - before.off) / (noise * precision)
            self._before[place] = _Mean(mean, precision)
