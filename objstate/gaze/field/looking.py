"""Where to turn a sensor: the heading that shows most of what is unknown for the time it takes.

Unlike the thesis, which ranks a few particles by the mean entropy of an ellipse, all headings are
compared: sums over what rays pass give each in one subtraction, what is hidden doesn't count, and
what is seen while the head turns does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from objstate.config import NonNegative, Positive, Share, Strict
from objstate.gaze.field.entropy_map import EntropyMap, Plane
from objstate.gaze.field.head import Head
from objstate.gaze.field.objects import ObjectGains
from objstate.geometry import FloatArray, wrap
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.gaze.field import kernels
else:
    kernels = Later("objstate.gaze.field.kernels")

RAYS = 720  # of a whole turn
NEVER = -1e9  # s, when a cell was last looked at that never was
FLOOR, WAY = "floor", "way"  # what the grid doesn't know, and where somebody may step
TOLD = 0.01  # share of a view's bits from which an object is named


class GazeSettings(Strict):
    """What makes a heading worth turning to."""

    dwell_s: Positive = 0.5  # s that a look takes once the head has turned
    fade_s: Positive = 10.0  # s until it no longer matters that one has looked there
    watch_s: Positive = 2.0  # s after a look, until somebody may have stepped in the way unseen
    held_back: Share = 0.5  # share of the entropy that doesn't count where one has just looked
    thing_m: Positive = 1.0  # side of a piece of floor whose cells are known or unknown together
    occlusion: bool = True  # what walls and known things hide doesn't count
    on_the_way: bool = False  # what is seen while the head turns does
    apart_deg: NonNegative = 20.0  # between the headings that are listed


@dataclass(frozen=True)
class Gaze:
    """A heading, and what it is worth."""

    heading: float  # rad in the building
    pan: float  # rad from the robot's heading
    bits: float  # to be seen there, and on the way where that counts
    seconds: float  # to turn and look
    parts: dict[str, float] = field(default_factory=dict)  # bits by object, landmarks and floor

    @property
    def rate(self) -> float:
        """Bits per second, by which headings are ranked."""
        return self.bits / self.seconds


class Gazer:
    """Chooses headings, one after another, and remembers where it has looked.

    With ``gains`` objects count by what looks are expected to tell of them, rather than by the
    entropy of the cells that they may cover, and the floor by what may stand on it.
    """

    def __init__(
        self,
        entropies: EntropyMap,
        head: Head,
        settings: GazeSettings | None = None,
        gains: ObjectGains | None = None,
    ) -> None:
        self.entropies, self.head, self.gains = entropies, head, gains
        self.settings = settings or GazeSettings()
        layout = entropies.layout
        self._looked = np.full(layout.size, NEVER, dtype=np.float32)
        self._reach = max(1, math.ceil(head.sensor.range_max / layout.resolution))
        self._least = math.floor(head.sensor.range_min / layout.resolution)
        bearings = 2.0 * np.pi * np.arange(RAYS) / RAYS
        self._bearings: FloatArray = bearings  # rad in the building
        turned = bearings - layout.origin[2]
        self._directions = np.column_stack([np.cos(turned), np.sin(turned)])
        self._sight = np.zeros((RAYS, self._reach), dtype=np.float32)
        self._seen = np.zeros((RAYS, self._reach), dtype=np.float32)

    def look(self, robot: FloatArray, pan: float, at: float) -> None:
        """Note that a look was taken from a pose (3,) with a pan, rad, at a time, s."""
        pose = self._pose(robot, pan)
        near = np.abs(wrap(self._bearings - pose[2])) <= self.head.sensor.field_of_view / 2.0
        cell = self.entropies.layout.to_cells(pose[:2])
        shape = self.entropies.layout.shape
        kernels.mark_looked(
            shape[1],
            shape[0],
            float(cell[0]),
            float(cell[1]),
            np.ascontiguousarray(self._directions[near]),
            self._least,
            self._reach,
            at,
            self._looked,
        )

    def rank(self, robot: FloatArray, pan: float, at: float, count: int = 10) -> list[Gaze]:
        """The best headings from a robot's pose (3,), for a head that has a pan, rad, now.

        The first is the best. Each other lies ``apart_deg`` from all before it. ``at`` is a time in
        seconds, by which the memory of looks fades.
        """
        profile = self._profile(robot, pan, at, self.entropies.bits)
        pans, bits, seconds = self._candidates(robot, pan, profile)
        objects, cells = self._of_objects(robot, pan, pans), 1.0
        if self.gains is not None:
            cells = max(1.0, (self.settings.thing_m / self.entropies.layout.resolution) ** 2)
            bits = bits / cells + sum(objects.values(), np.zeros(len(pans)))
        if self.entropies.watched.any():
            nothing = np.zeros_like(self.entropies.bits)
            watched = self._candidates(robot, pan, self._profile(robot, pan, at, nothing))[1]
            objects[WAY] = watched / cells
        chosen: list[int] = []
        apart = math.radians(self.settings.apart_deg)
        for k in np.argsort(-bits / seconds, kind="stable").tolist():
            if all(abs(float(wrap(pans[k] - pans[other]))) >= apart for other in chosen):
                chosen.append(k)
            if len(chosen) == count:
                break
        return [
            Gaze(
                float(wrap(robot[2] + pans[k])),
                float(pans[k]),
                float(bits[k]),
                float(seconds[k]),
                self._parts(
                    robot,
                    pan,
                    float(pans[k]),
                    float(bits[k]),
                    {name: float(own[k]) for name, own in objects.items()},
                ),
            )
            for k in chosen
        ]

    def _profile(self, robot: FloatArray, pan: float, at: float, bits: Plane) -> FloatArray:
        """(rays,) what is to be seen along each of bits (rows, columns), and of the way."""
        pose, layout, s = self._pose(robot, pan), self.entropies.layout, self.settings
        cell = layout.to_cells(pose[:2])
        kernels.along_rays(
            layout.columns,
            layout.rows,
            float(cell[0]),
            float(cell[1]),
            self._directions,
            2.0 * np.pi / RAYS,
            bits.reshape(-1),
            self.entropies.opaque.reshape(-1),
            self.entropies.watched.reshape(-1),
            self._looked,
            at,
            s.fade_s,
            s.watch_s,
            s.held_back,
            self._least,
            s.occlusion,
            self._sight,
            self._seen,
        )
        return np.asarray(self._seen.sum(axis=1, dtype=np.float64))

    def _candidates(
        self, robot: FloatArray, pan: float, profile: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Pans (c,) rad, the bits (c,) that turning there shows, and the seconds (c,) it takes."""
        head = self.head
        pans = wrap(self._bearings - robot[2])
        pans = np.sort(pans[np.abs(pans) <= head.turn])
        if not len(pans):
            pans = np.array([pan])
        turns = pans - pan
        if head.turns_round:
            turns = wrap(turns)
        half = head.sensor.field_of_view / 2.0
        starts, ends = turns - half, turns + half
        if self.settings.on_the_way:
            starts, ends = np.minimum(starts, -half), np.maximum(ends, half)
        now = robot[2] + pan
        sums = _between(profile, now + starts, now + ends)
        return pans, sums, np.abs(turns) / head.speed + self.settings.dwell_s

    def _of_objects(self, robot: FloatArray, pan: float, pans: FloatArray) -> dict[str, FloatArray]:
        """Bits (c,) by object that turning to pans (c,) is expected to tell; none without gains."""
        if self.gains is None:
            return {}
        steps, found = self.gains.pans, {}
        for name, own in self.gains.bits(self.entropies.beliefs, robot).items():
            # of several looks at the same on the way, the best counts
            then = np.interp(pans, steps, own)
            if self.settings.on_the_way:
                for step, bits in zip(steps, own, strict=True):
                    passed = (step - pan) * (step - pans) <= 0.0
                    then = np.maximum(then, np.where(passed, bits, 0.0))
            found[name] = self.entropies.priority(name) * then
        return found

    def _parts(
        self, robot: FloatArray, pan: float, to: float, bits: float, parts: dict[str, float]
    ) -> dict[str, float]:
        """Bits of a view by what they are of, the most first, with the parts that are known."""
        if self.gains is not None:
            return _sorted(parts, bits)
        return _sorted(parts | self._drawn(robot, pan, to), bits)

    def _drawn(self, robot: FloatArray, pan: float, to: float) -> dict[str, float]:
        """Bits of what is drawn into the entropy map; inhibition left out."""
        pose, layout = self._pose(robot, pan), self.entropies.layout
        turn = to - pan
        if self.head.turns_round:
            turn = float(wrap(turn))
        half, now = self.head.sensor.field_of_view / 2.0, robot[2] + pan
        start, end = turn - half, turn + half
        if self.settings.on_the_way:
            start, end = min(start, -half), max(end, half)
        middle, width = now + (start + end) / 2.0, (end - start) / 2.0
        parts: dict[str, float] = {}
        for name, drawn in self.entropies.parts().items():
            rows, columns = np.divmod(drawn.where, layout.columns)
            away = np.column_stack([columns, rows]) + 0.5 - layout.to_cells(pose[:2])
            distance = np.hypot(away[:, 0], away[:, 1])
            bearing = np.arctan2(away[:, 1], away[:, 0]) + layout.origin[2]
            near = (distance < self._reach) & (np.abs(wrap(bearing - middle)) <= width)
            if near.any():
                k = np.rint(bearing[near] / (2.0 * np.pi) * RAYS).astype(np.int64) % RAYS
                sight = self._sight[k, distance[near].astype(np.int64)]
                parts[name] = float(sight @ drawn.values[near])
        return parts

    def _pose(self, robot: FloatArray, pan: float) -> FloatArray:
        """(3,) of the sensor in the building."""
        pose = self.head.sensor.poses(np.asarray(robot, dtype=float))
        return np.array([pose[0], pose[1], robot[2] + pan])


def _sorted(parts: dict[str, float], bits: float) -> dict[str, float]:
    """Parts of a view, the largest first, and what remains as the floor's."""
    told = {name: each for name, each in parts.items() if each >= TOLD * max(bits, 1e-9)}
    told[FLOOR] = max(0.0, float(bits) - sum(parts.values()))
    return dict(sorted(told.items(), key=lambda each: -each[1]))


def _between(profile: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Sums (c,) of a function of the bearing (k,) from bearings (c,) to others, up to a whole turn."""
    rays = len(profile)
    summed = np.append(0.0, np.cumsum(np.tile(profile, 3)))
    scale = rays / (2.0 * np.pi)
    low = np.mod(starts, 2.0 * np.pi) * scale
    high = low + np.minimum((ends - starts) * scale, float(rays))
    at = np.arange(len(summed), dtype=float)
    shift = 0.5  # a ray stands for the bearings half way to its neighbours
    return np.asarray(np.interp(high + shift, at, summed) - np.interp(low + shift, at, summed))
