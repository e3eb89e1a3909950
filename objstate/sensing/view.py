"""What one scan can tell: functions of robot poses and object states, conditioned on its readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol
from weakref import WeakKeyDictionary

import numpy as np

from objstate.building.model import Building
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.records import Rays, Scan
from objstate.sensing.beam_model import BeamModel
from objstate.sensing.expected import ExpectedRanges
from objstate.sensing.level import LevelOutlines, ObjectOutline, Sweep, with_trigonometry


@dataclass(frozen=True, eq=False)
class UncertainObject:
    """Where an object may be, as far as a scan's other readers need to know."""

    name: str
    states: FloatArray  # (k, d)
    shares: FloatArray  # (k,) sum to one


class ScanView(Protocol):
    """One scan's beams, against any robot poses (p, 3) and object states (s, d)."""

    def take(self, beams: BoolArray) -> ScanView:
        """The view of some of its beams (n,)."""

    def walls(self, poses: FloatArray) -> FloatArray:
        """Expected ranges (p, n) m of the fixed walls."""

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        """Expected ranges (p, s, n) m of one object alone."""

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        """log p(o | d-hat) (p,) of all beams together, for expected ranges (p, n)."""

    def pose_log_likelihood(
        self, poses: FloatArray, blur: float, objects: Sequence[UncertainObject]
    ) -> FloatArray:
        """log p(o | l) (p,), each beam averaged over where the objects may be.

        ``blur`` m is added to the beam model's ``sigma_hit``, as variances add.
        """

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, background: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        """log p(o | s, l) - log p(o | object absent, l) (p, s), and which beams (n,) bear on it.

        ``background`` (p, n) are the expected ranges of everything else.
        """

    def shifted_log_likelihood(
        self,
        name: str,
        states: FloatArray,
        normals: FloatArray,
        shift_std: float,
        poses: FloatArray,
        background: FloatArray,
        whole: BoolArray,
        few: IntArray,
        tempering: float,
    ) -> tuple[FloatArray, BoolArray]:
        """The same with an exponent, averaged over a shift of the object along ``normals`` (s, 2).

        The shift is unknown, with a standard deviation of ``shift_std`` m. States that
        aren't ``whole`` (s,) are cast from the poses ``few`` alone and averaged.
        """


class Sensing:
    """Turns scans into views: outlines for level lasers, Embree for all others."""

    def __init__(self, building: Building, beam_model: BeamModel) -> None:
        self._outlines = LevelOutlines(building)
        self._expected = ExpectedRanges(building)
        self._beam_model = beam_model
        self._sweeps: WeakKeyDictionary[Rays, Sweep | None] = WeakKeyDictionary()

    def view(self, scan: Scan, beams: BoolArray | None = None) -> ScanView:
        """The view of a scan's valid beams, or of those that ``beams`` (n,) selects."""
        chosen = scan.valid if beams is None else scan.valid & beams
        measured, sweep = scan.ranges[chosen], self._sweep(scan.rays)
        if sweep is None or not len(measured):
            rays = scan.rays.take(chosen)
            return MeshView(self._expected, rays, measured, self._beam_model, scan.range_max)
        return LevelView(
            self._outlines, sweep.take(chosen), measured, self._beam_model, scan.range_max
        )

    def _sweep(self, rays: Rays) -> Sweep | None:
        """The level sweep of some rays, or None; the scans of a laser often share their rays."""
        if rays not in self._sweeps:
            self._sweeps[rays] = Sweep.of(rays) if self._outlines.hold else None
        return self._sweeps[rays]


class MeshView:
    """Any mounting, any geometry: every beam is cast against the triangles."""

    def __init__(
        self,
        expected: ExpectedRanges,
        rays: Rays,
        measured: FloatArray,
        beam_model: BeamModel,
        range_max: float,
    ) -> None:
        self._expected = expected
        self._rays = rays
        self._measured = measured
        self._beam_model = beam_model
        self._log_likelihood = beam_model(measured, range_max)
        self._range_max = range_max
        self._near = 4.0 * beam_model.settings.sigma_hit

    def take(self, beams: BoolArray) -> MeshView:
        rays, measured = self._rays.take(beams), self._measured[beams]
        return MeshView(self._expected, rays, measured, self._beam_model, self._range_max)

    def walls(self, poses: FloatArray) -> FloatArray:
        return self._expected.walls(poses, self._rays)

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        return self._expected.object(name, states, poses, self._rays)

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        return np.asarray(self._log_likelihood(expected).sum(axis=-1))

    def pose_log_likelihood(
        self, poses: FloatArray, blur: float, objects: Sequence[UncertainObject]
    ) -> FloatArray:
        log_likelihood = self._beam_model.blurred(blur)(self._measured, self._range_max)
        background = self.walls(poses)
        likelihood = np.exp(log_likelihood(background))
        for item in objects:
            alone = self.object(item.name, item.states, poses)
            kept = np.where(
                alone < background[:, None],
                np.exp(log_likelihood(alone)),
                likelihood[:, None],
            )
            likelihood = np.einsum("s,psn->pn", item.shares, kept)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(likelihood).sum(axis=1))

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, background: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        alone = self.object(name, states, poses)
        touched = (alone < background[:, None]) & (alone < self._range_max)
        without = self._log_likelihood(background)[:, None]
        change = np.where(touched, self._log_likelihood(alone) - without, 0.0)
        bears = (touched & (self._measured > alone - self._near)).any(axis=(0, 1))
        return change.sum(axis=2), np.asarray(bears)

    def shifted_log_likelihood(
        self,
        name: str,
        states: FloatArray,
        normals: FloatArray,
        shift_std: float,
        poses: FloatArray,
        background: FloatArray,
        whole: BoolArray,
        few: IntArray,
        tempering: float,
    ) -> tuple[FloatArray, BoolArray]:
        change, bears = self.object_log_likelihood(name, states, poses, background)
        return tempering * change, bears


class LevelView:
    """A level sweep against outlines, by compiled loops."""

    def __init__(
        self,
        outlines: LevelOutlines,
        sweep: Sweep,
        measured: FloatArray,
        beam_model: BeamModel,
        range_max: float,
    ) -> None:
        self._outlines = outlines
        self._sweep = sweep
        self._measured = measured
        self._beams = sweep.beams(measured, beam_model.short(measured))
        self._beam_model = beam_model
        self._range_max = range_max

    def take(self, beams: BoolArray) -> LevelView:
        sweep, measured = self._sweep.take(beams), self._measured[beams]
        return LevelView(self._outlines, sweep, measured, self._beam_model, self._range_max)

    def walls(self, poses: FloatArray) -> FloatArray:
        walls = ObjectOutline(self._walls(poses), convex=False)
        return self._cast(walls, np.zeros((1, 3)), poses)[:, 0]

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        outline = self._outlines.of_object(name, self._sweep.height)
        return self._cast(outline, self._outlines.placements(name, states), poses)

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        each = self._beam_model(self._measured, self._range_max)(expected)
        return np.asarray(each.sum(axis=-1))

    def pose_log_likelihood(
        self, poses: FloatArray, blur: float, objects: Sequence[UncertainObject]
    ) -> FloatArray:
        from objstate.sensing import kernels

        outlines = [self._outlines.of_object(each.name, self._sweep.height) for each in objects]
        places = [self._outlines.placements(each.name, each.states) for each in objects]
        out = np.empty(len(poses))
        kernels.pose_log_likelihood(
            with_trigonometry(poses),
            self._walls(poses),
            np.concatenate([np.empty((0, 4)), *(each.segments for each in outlines)]),
            np.cumsum([len(each.segments) for each in outlines], dtype=np.int64),
            np.array([each.convex for each in outlines], dtype=bool),
            with_trigonometry(np.concatenate([np.empty((0, 3)), *places])),
            np.cumsum([len(each) for each in places], dtype=np.int64),
            np.concatenate([np.empty(0), *(each.shares for each in objects)]),
            self._beams,
            self._sweep.index,
            self._sweep.centre,
            self._beam_model.blurred(blur).parameters(self._range_max),
            out,
        )
        return out

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, background: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        from objstate.sensing import kernels

        outline = self._outlines.of_object(name, self._sweep.height)
        change = np.empty((len(poses), len(states)))
        bears = np.zeros(self._beams.shape[1], dtype=bool)
        kernels.object_log_likelihood(
            with_trigonometry(poses),
            with_trigonometry(self._outlines.placements(name, states)),
            outline.segments,
            outline.convex,
            np.ascontiguousarray(background[:, self._sweep.order]),
            self._beams,
            self._sweep.index,
            self._sweep.centre,
            self._beam_model.parameters(self._range_max),
            change,
            bears,
        )
        return change, self._sweep.unsorted(bears)

    def shifted_log_likelihood(
        self,
        name: str,
        states: FloatArray,
        normals: FloatArray,
        shift_std: float,
        poses: FloatArray,
        background: FloatArray,
        whole: BoolArray,
        few: IntArray,
        tempering: float,
    ) -> tuple[FloatArray, BoolArray]:
        from objstate.sensing import kernels

        outline = self._outlines.of_object(name, self._sweep.height)
        placements = with_trigonometry(self._outlines.placements(name, states))
        out = np.empty((len(poses), len(states)))
        bears = np.zeros(self._beams.shape[1], dtype=bool)
        kernels.shifted_log_likelihood(
            with_trigonometry(poses),
            placements,
            normals,
            whole,
            few,
            outline.segments,
            outline.convex,
            np.ascontiguousarray(background[:, self._sweep.order]),
            self._beams,
            self._sweep.index,
            self._sweep.centre,
            self._beam_model.parameters(self._range_max),
            shift_std,
            tempering,
            out,
            bears,
        )
        return out, self._sweep.unsorted(bears)

    def _walls(self, poses: FloatArray) -> FloatArray:
        return self._outlines.walls_in_sight(self._sweep, poses, self._range_max)

    def _cast(
        self, outline: ObjectOutline, placements: FloatArray, poses: FloatArray
    ) -> FloatArray:
        from objstate.sensing import kernels

        out = np.full((len(poses), len(placements), self._beams.shape[1]), np.inf)
        kernels.cast(
            with_trigonometry(poses),
            with_trigonometry(placements),
            outline.segments,
            outline.convex,
            self._beams,
            self._sweep.index,
            self._sweep.centre,
            out,
        )
        return self._sweep.unsorted(out)
