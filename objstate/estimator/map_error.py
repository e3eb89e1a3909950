"""How far off the building is, as the log itself tells.

Where a wall stands aside of its place in the model, its beams read long, or short,
each time it is seen. Noise and the robot's own errors are others the next second.
So the product of what one place lies off now and what it lay off before is, on
average, the variance of the error that stays.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from objstate.config import MapErrorSettings
from objstate.geometry import BoolArray, FloatArray
from objstate.records import NANOSECONDS

BENT = 0.02  # rad, by which three places in a row on a flat wall may seem to bend
ASIDE = 0.27  # of a cell, by which the grid of places is shifted: walls stand at round numbers
SIDES = 8  # directions that the walls of one place are told apart by

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
        self._precision = settings.weight / settings.std_m**4
        self._sum = self._precision * settings.std_m**2
        self._noted_ns: int | None = None
        self._before: dict[_Place, _Mean] = {}

    @property
    def std(self) -> float:
        """m, along the walls' normals, by what looks at a place agree on: less half its standard error."""
        mean, error = self._sum / self._precision, self._precision**-0.5
        return math.sqrt(max(mean - error / 2.0, self._settings.least_m**2))

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
        for place, off, noise in _looks(s, places, directions, longer):
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


def _looks(
    settings: MapErrorSettings, places: FloatArray, directions: FloatArray, longer: FloatArray
) -> Iterator[tuple[_Place, float, float]]:
    """By how many m each place seems to lie off along its wall's normal, and the variance of that by noise.

    Only beams between two neighbours on the same flat wall tell, and only of places that nothing hides in part.
    """
    if len(places) < 3:
        return
    along, is_flat = _walls(places)
    places, directions, longer = places[1:-1], directions[1:-1], longer[1:-1]
    normals = np.column_stack([-along[:, 1], along[:, 0]])
    cosines = (directions * normals).sum(axis=1)
    normals *= np.sign(cosines)[:, None]
    off = longer * np.abs(cosines)
    facing = np.round(np.arctan2(normals[:, 1], normals[:, 0]) * SIDES / (2.0 * np.pi)) % SIDES
    cells = np.column_stack([np.floor(places / settings.cell_m + ASIDE), facing])
    there: dict[_Place, list[tuple[float, float]]] = {}
    told = zip(off[is_flat].tolist(), (cosines[is_flat] ** 2).tolist(), strict=True)
    for (column, row, side), each in zip(cells[is_flat].tolist(), told, strict=True):
        there.setdefault((column, row, side), []).append(each)
    for place, beams in sorted(there.items()):
        # not stopped by something, nor through a gap
        believable = sorted(each for each in beams if abs(each[0]) < settings.most_m)
        count = len(believable)
        if count >= max(settings.beams, settings.in_full * len(beams)):
            median = (believable[(count - 1) // 2][0] + believable[count // 2][0]) / 2.0
            yield place, median, settings.noise_m**2 * sum(s for _, s in believable) / count**2


def _walls(places: FloatArray) -> tuple[FloatArray, BoolArray]:
    """The direction (n - 2, 2) of the wall at each place but the first and the last, and whether it's flat there.

    A wall is flat where a place and its neighbours lie in one line.
    """
    steps = np.diff(places, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    steps = steps / np.maximum(lengths, np.finfo(float).tiny)[:, None]
    before, after = steps[:-1], steps[1:]
    bend = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    ahead = (before * after).sum(axis=1) > 0.0
    return after, (np.abs(bend) < BENT) & ahead
