"""What is unknown, as bits of the cells of a grid (Darmstadt, section 6.3.1)."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from objstate.errors import GridError
from objstate.geometry import FloatArray
from objstate.grid import Drawing, Layout, entropy, expected_occupancy, gaussian, swept
from objstate.grid.grid import OCCUPIED
from objstate.objects import ObjectBelief
from objstate.objects.covered import covered

Plane = NDArray[np.float32]  # (rows, columns)

WATCHED = 5.0  # what a cell on the way counts, bits: a collision costs more than an unknown corner
STATES = 40  # of an object that are drawn; probabilities are within 1/40
LANDMARK_STD = 0.1  # m, of the Gaussian that stands for a landmark


class EntropyMap:
    """Bits of each cell: of the grid, of what objects may cover, and of landmarks, which add up.

    Objects count by their beliefs: the entropy of a cell is that of the probability that the object
    covers it. What hasn't changed isn't drawn again. Priorities, from 0 to 1 and by patterns of
    names, may be changed at any time; the last that fits counts.

    Args:
        layout: of the grid.
        walls: segments (k, 4) m at the sensor's height, which hide what is behind, and are known.
        landmarks: places (n, 2) m that tell the robot where it is.
        priorities: by pattern; an object that fits none has the priority 1.
        objects: whether the cells that objects may cover have entropy; not with ``ObjectGains``.
    """

    def __init__(
        self,
        layout: Layout,
        walls: FloatArray,
        landmarks: FloatArray | None = None,
        priorities: Mapping[str, float] | None = None,
        *,
        objects: bool = True,
    ) -> None:
        self.layout, self._with_objects = layout, objects
        self.beliefs: Mapping[str, ObjectBelief] = {}  # as of the last update
        self.bits: Plane = np.ones(layout.shape, dtype=np.float32)
        self.opaque: Plane = np.zeros(layout.shape, dtype=np.float32)
        self.watched: Plane = np.zeros(layout.shape, dtype=np.float32)
        self.landmark_weight = 0.0
        self._walls = _drawn_walls(layout, walls)
        self._landmarks = _drawn_landmarks(
            layout, np.zeros((0, 2)) if landmarks is None else landmarks
        )
        self._drawn: dict[str, tuple[ObjectBelief, Drawing, Drawing]] = {}
        self.priorities: dict[str, float] = {}
        for pattern, priority in (priorities or {}).items():
            self.prioritize(pattern, priority)

    def prioritize(self, pattern: str, priority: float) -> None:
        """Let objects whose names fit a pattern count by a priority from now on.

        Raises GridError unless it is a share.
        """
        if not 0.0 <= priority <= 1.0:
            raise GridError(f"'{pattern}' can't have priority {priority:g}; give 0 to 1.")
        self.priorities.pop(pattern, None)  # so that the last that was said comes last
        self.priorities[pattern] = priority

    def update(
        self,
        values: Plane,
        beliefs: Mapping[str, ObjectBelief],
        unreliability: float = 0.0,
    ) -> None:
        """Take in the grid's values (rows, columns), all beliefs, and how lost the robot is, 0 to 1.

        Raises GridError for values that are none of this layout, or no probabilities.
        """
        _check(values, self.layout, unreliability)
        self.bits[:] = entropy(values)
        self.opaque[:] = np.where(values > OCCUPIED, values, np.float32(0.0))
        bits, opaque = self.bits.reshape(-1), self.opaque.reshape(-1)
        self.beliefs = dict(beliefs)
        self._draw(beliefs)
        for name, (_, covers, unsure) in self._drawn.items():
            if self._with_objects:
                bits[unsure.where] += np.float32(self.priority(name)) * unsure.values
            opaque[covers.where] = np.maximum(opaque[covers.where], covers.values)
        bits[self._walls.where] = 0.0
        opaque[self._walls.where] = 1.0
        self.landmark_weight = unreliability
        bits[self._landmarks.where] += np.float32(unreliability) * self._landmarks.values

    def watch(self, way: FloatArray, radius: float, bits: float = WATCHED) -> None:
        """Let cells within ``radius`` m of a way (n, 2) m, n > 1, count ``bits`` more while out of sight.

        Somebody may step in the robot's way, of which what was seen there says nothing. No points:
        none. Raises GridError for a way that is not finite.
        """
        if not np.isfinite(way).all() or not (np.isfinite(radius) and radius > 0.0):
            raise GridError("A way that is watched has to be finite, with a radius above 0 m.")
        self.watched[:] = 0.0
        if not len(way):
            return
        covered = swept(way, radius)
        drawn = expected_occupancy(self.layout, covered, np.ones(len(covered)))
        self.watched.reshape(-1)[drawn.where] = bits

    def priority(self, name: str) -> float:
        """By which an object counts."""
        fits = [each for pattern, each in self.priorities.items() if fnmatchcase(name, pattern)]
        return fits[-1] if fits else 1.0

    def parts(self) -> dict[str, Drawing]:
        """What each object adds to the bits of cells, and the landmarks."""
        parts = {
            name: Drawing(
                self.layout, unsure.where, np.float32(self.priority(name)) * unsure.values
            )
            for name, (_, _, unsure) in self._drawn.items()
        }
        marks = self._landmarks
        if self.landmark_weight > 0.0 and len(marks.where):
            weight = np.float32(self.landmark_weight)
            parts[LANDMARKS] = Drawing(self.layout, marks.where, weight * marks.values)
        return parts

    def _draw(self, beliefs: Mapping[str, ObjectBelief]) -> None:
        """What the objects cover, where beliefs have changed."""
        for name in [name for name in self._drawn if name not in beliefs]:
            del self._drawn[name]
        for name, belief in beliefs.items():
            if name in self._drawn and self._drawn[name][0] is belief:
                continue
            covers = covered(self.layout, belief, most=STATES)
            unsure = Drawing(self.layout, covers.where, entropy(covers.values))
            self._drawn[name] = belief, covers, unsure


LANDMARKS = "landmarks"  # their part's name


def corners(walls: FloatArray) -> FloatArray:
    """Where walls (k, 4) end or meet, (n, 2) m: what a laser can tell its place by."""
    ends = walls.reshape(-1, 2)
    return np.unique(np.round(ends, 3), axis=0)


def _drawn_walls(layout: Layout, walls: FloatArray) -> Drawing:
    segments = walls.reshape(-1, 2, 2)
    return expected_occupancy(layout, list(segments), np.ones(len(segments)))


def _drawn_landmarks(layout: Layout, places: FloatArray) -> Drawing:
    """The largest of the Gaussians about each place, which are 1 there."""
    spread = np.eye(2) * max(LANDMARK_STD, layout.resolution) ** 2
    drawn = [gaussian(layout, place, spread, 1.0, about=0.0) for place in places]
    if not drawn:
        return Drawing(layout, np.empty(0, np.int32), np.empty(0, np.float32))
    plane = np.zeros(layout.size, dtype=np.float32)
    for each in drawn:
        plane[each.where] = np.maximum(plane[each.where], each.values)
    where = np.flatnonzero(plane).astype(np.int32)
    return Drawing(layout, where, plane[where])


def _check(values: Plane, layout: Layout, unreliability: float) -> None:
    if values.shape != layout.shape:
        raise GridError(
            f"An entropy map of {layout.shape} cells can't be made of values of shape "
            f"{values.shape}; give those of the same layout."
        )
    if not (values.min() >= 0.0 and values.max() <= 1.0):  # nan, too
        raise GridError("Values of cells have to be probabilities from 0 to 1, none of them nan.")
    if not 0.0 <= unreliability <= 1.0:
        raise GridError(f"The robot can't be unreliable by {unreliability:g}; give 0 to 1.")
