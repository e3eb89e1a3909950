"""What one scan can tell: functions of robot poses and object states, conditioned on its readings."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol
from weakref import WeakKeyDictionary

import numpy as np

from objstate.building.model import Building, MovableObject
from objstate.errors import PlatformError
from objstate.geometry import BoolArray, FloatArray, IntArray, transform_from_pose
from objstate.records import Rays, Scan
from objstate.sensing.beam_model import BeamModel
from objstate.sensing.embree import needs_embree, why_no_embree
from objstate.sensing.expected import ExpectedRanges, cast_from
from objstate.sensing.level import (
    LevelOutlines,
    ObjectOutline,
    Sweep,
    UncertainObject,
)

FIXED = np.array([[0.0, 0.0, 1.0, 0.0]])  # the placement of what doesn't move
EXPLAINED_SIGMAS = 3.0  # of sigma_hit, within which a range reads what was expected


@dataclass(frozen=True, eq=False)
class Comparison:
    """How the states of an object are compared: against what, from where, and how much it counts."""

    background: FloatArray  # (p, n) m, expected ranges of everything else
    tempering: float = 1.0  # exponent on the likelihood
    shift_std: float = 0.0  # m by which the whole object may stand off its place
    normals: FloatArray | None = None  # (s, 2) along which; unit vectors in the building
    whole: BoolArray | None = None  # (s,) states cast from every pose
    few: IntArray | None = None  # the poses from which all others are cast, and averaged


class ScanView(Protocol):
    """One scan's beams, against any robot poses (p, 3) and object states (s, d)."""

    def take(self, beams: BoolArray) -> ScanView:
        """The view of some of its beams (n,)."""

    def walls(self, poses: FloatArray) -> FloatArray:
        """Expected ranges (p, n) m of the fixed walls."""

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        """Expected ranges (p, s, n) m of one object alone."""

    def explained(self, expected: FloatArray) -> BoolArray:
        """Which beams (n,) read what is expected (n,) of them, within ``EXPLAINED_SIGMAS``."""

    def stopped_short(self, pose: FloatArray, expected: FloatArray) -> FloatArray:
        """Where beams end (k, 3) m that read less than expected (n,), from a robot pose (3,)."""

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        """log p(o | d-hat) (p,) of all beams together, for expected ranges (p, n)."""

    def pose_log_likelihood(
        self,
        poses: FloatArray,
        blur: float,
        objects: Sequence[UncertainObject],
        walls: FloatArray | None = None,
    ) -> FloatArray:
        """log p(o | l) (p,), each beam averaged over where the objects may be.

        ``blur`` m is added to the beam model's ``sigma_hit``, as variances add. ``walls`` (p, n) m
        saves casting them, where they are known.
        """

    def fit(self, log_likelihood: float, blur: float) -> float:
        """How well a scan with that log p(o | l) is explained: 0 as by chance, 1 as it should be."""

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, comparison: Comparison
    ) -> tuple[FloatArray, BoolArray]:
        """log p(o | s, l) - log p(o | object absent, l) (p, s), and which beams (n,) bear on it."""


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
        if sweep is None and len(scan) and why_no_embree() is not None:
            raise self._needs_embree(scan)
        if sweep is None or not len(measured):
            rays = scan.rays.take(chosen)
            return MeshView(self._expected, rays, measured, self._beam_model, scan.range_max)
        sweep, short = sweep.take(chosen), self._beam_model.short(measured)
        return LevelView(self._outlines, sweep, measured, short, self._beam_model, scan.range_max)

    def with_object(self, item: MovableObject) -> Sensing:
        """The same building but for one object of a name it has, which now stands elsewhere."""
        other = copy(self)
        other._outlines = self._outlines.with_object(item)
        other._expected = self._expected.with_object(item)
        return other

    def _needs_embree(self, scan: Scan) -> PlatformError:
        """The error for a scan that outlines don't hold for."""
        if self._outlines.hold:
            return needs_embree(f"The beams of laser '{scan.laser}' aren't level")
        return needs_embree(f"Some object of '{self._expected.building.name}' moves up or down")

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
        self._along = beam_model.along(measured, range_max)
        self._range_max = range_max
        self._near = 4.0 * beam_model.settings.sigma_hit

    def take(self, beams: BoolArray) -> MeshView:
        rays, measured = self._rays.take(beams), self._measured[beams]
        return MeshView(self._expected, rays, measured, self._beam_model, self._range_max)

    def walls(self, poses: FloatArray) -> FloatArray:
        return self._expected.walls(poses, self._rays)

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        return self._expected.object(name, states, poses, self._rays)

    def explained(self, expected: FloatArray) -> BoolArray:
        margin = EXPLAINED_SIGMAS * self._beam_model.sigma_hit
        return _agree(self._measured, expected, self._range_max, margin)

    def stopped_short(self, pose: FloatArray, expected: FloatArray) -> FloatArray:
        short = self._measured < expected - EXPLAINED_SIGMAS * self._beam_model.sigma_hit
        origins, directions = cast_from(transform_from_pose(pose), self._rays.take(short))
        return np.asarray(origins + self._measured[short, None] * directions)

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        return self._along(expected)[0]

    def pose_log_likelihood(
        self,
        poses: FloatArray,
        blur: float,
        objects: Sequence[UncertainObject],
        walls: FloatArray | None = None,
    ) -> FloatArray:
        log_likelihood = self._beam_model.blurred(blur)(self._measured, self._range_max)
        background = self.walls(poses) if walls is None else walls
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

    def fit(self, log_likelihood: float, blur: float) -> float:
        return self._beam_model.blurred(blur).fit(log_likelihood, self._measured, self._range_max)

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, comparison: Comparison
    ) -> tuple[FloatArray, BoolArray]:
        whole = np.ones(len(states), dtype=bool) if comparison.whole is None else comparison.whole
        few = np.arange(len(poses)) if comparison.few is None else comparison.few
        out = np.empty((len(poses), len(states)))
        out[:, whole], bears = self._change(name, states, poses, comparison, whole)
        if not whole.all():
            rest, also = self._change(name, states, poses, comparison, ~whole, few)
            out[:, ~whole] = np.logaddexp.reduce(rest, axis=0) - np.log(len(few))
            bears |= also
        return out, bears

    def _change(
        self,
        name: str,
        states: FloatArray,
        poses: FloatArray,
        comparison: Comparison,
        chosen: BoolArray,
        few: IntArray | None = None,
    ) -> tuple[FloatArray, BoolArray]:
        """The change of log-likelihood for chosen states (s,), from all poses or a few (p,)."""
        from objstate.sensing import kernels

        background = comparison.background
        if few is not None:
            poses, background = poses[few], background[few]
        alone = self.object(name, states[chosen], poses)
        touched = alone < background[:, None]
        log_likelihood, share = self._along(np.where(touched, alone, background[:, None]))
        change = log_likelihood - self._along(background)[0][:, None]
        bears = touched & (self._measured > alone - self._near) & (alone < self._range_max)
        variance = comparison.shift_std**2
        if comparison.normals is not None and variance > 0.0:
            off = np.zeros(alone.shape)
            told = touched & np.isfinite(self._measured)
            np.subtract(self._measured, alone, out=off, where=told)
            cosine = self._cosines(poses, comparison.normals[chosen])
            told &= np.abs(cosine) > kernels.GRAZING
            per_shift = np.divide(1.0, cosine, out=np.zeros_like(cosine), where=told)
            pull = (share * per_shift * off).sum(axis=2)
            hold = (share * per_shift**2).sum(axis=2)
            precision = comparison.tempering / self._beam_model.sigma_hit**2
            pull, hold = precision * pull, precision * hold
            surely = 1.0 + hold * variance
            averaged = 0.5 * (pull**2 * variance / surely - np.log(surely))
            return comparison.tempering * change + averaged, np.asarray(bears.any(axis=(0, 1)))
        return comparison.tempering * change, np.asarray(bears.any(axis=(0, 1)))

    def _cosines(self, poses: FloatArray, normals: FloatArray) -> FloatArray:
        """(p, s, n) between the beams and the normals (s, 2) of surfaces, seen from above."""
        turns = np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
        x, y = self._rays.directions[:, 0], self._rays.directions[:, 1]
        east = turns[:, :1] * x - turns[:, 1:] * y
        north = turns[:, 1:] * x + turns[:, :1] * y
        return np.asarray(east[:, None] * normals[:, :1] + north[:, None] * normals[:, 1:])


class LevelView:
    """A level sweep against outlines, by compiled loops."""

    def __init__(
        self,
        outlines: LevelOutlines,
        sweep: Sweep,
        measured: FloatArray,
        short: FloatArray,
        beam_model: BeamModel,
        range_max: float,
    ) -> None:
        self._outlines = outlines
        self._sweep = sweep
        self._measured = measured
        self._short = short  # (n,) densities if stopped before the target
        self._beam_model = beam_model
        self._range_max = range_max

    def take(self, beams: BoolArray) -> LevelView:
        return LevelView(
            self._outlines,
            self._sweep.take(beams),
            self._measured[beams],
            self._short[beams],
            self._beam_model,
            self._range_max,
        )

    @cached_property
    def _beams(self) -> FloatArray:
        """(7, n) the sorted beams as the kernels take them."""
        return self._sweep.beams(self._measured, self._short)

    def walls(self, poses: FloatArray) -> FloatArray:
        walls = self._outlines.walls_in_sight(self._sweep, poses, self._range_max)
        return self._cast(ObjectOutline(walls), FIXED, poses)[:, 0]

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        outline = self._outlines.of_object(name, self._sweep.height)
        return self._cast(outline, self._outlines.placements(name, states), poses)

    def explained(self, expected: FloatArray) -> BoolArray:
        margin = EXPLAINED_SIGMAS * self._beam_model.sigma_hit
        return _agree(self._measured, expected, self._range_max, margin)

    def stopped_short(self, pose: FloatArray, expected: FloatArray) -> FloatArray:
        short = self._measured < expected - EXPLAINED_SIGMAS * self._beam_model.sigma_hit
        directions, offsets = self._sweep.unsorted(self._sweep.rows[1:]).reshape(2, 2, -1)
        reached = self._measured[short] * directions[:, short]
        ends = reached + offsets[:, short] + self._sweep.centre[:2, None]
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        x, y = np.array([[cos, -sin], [sin, cos]]) @ ends + pose[:2, None]
        return np.column_stack([x, y, np.full(len(x), self._sweep.height)])

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        from objstate.sensing import likelihood

        out, model = np.empty(len(expected)), self._parameters
        likelihood.scan_log_likelihood(
            expected, self._measured, self._short, self._lasting, model, out
        )
        return out

    def pose_log_likelihood(
        self,
        poses: FloatArray,
        blur: float,
        objects: Sequence[UncertainObject],
        walls: FloatArray | None = None,
    ) -> FloatArray:
        from objstate.sensing import likelihood

        stand, known = self._outlines.stand(poses), self.walls(poses) if walls is None else walls
        scenery = self._outlines.scenery(tuple(objects), self._sweep.height)
        model = self._beam_model.blurred(blur).parameters(self._range_max)

        def log_likelihood(abreast: FloatArray, expected: FloatArray) -> FloatArray:
            found = np.empty(len(abreast))
            likelihood.pose_log_likelihood(
                abreast,
                expected,
                *scenery,
                self._sweep.order,
                self._beams,
                self._sweep.index,
                self._sweep.centre,
                model,
                found,
            )
            return found

        return stand.each(log_likelihood, known)

    def fit(self, log_likelihood: float, blur: float) -> float:
        return self._beam_model.blurred(blur).fit(log_likelihood, self._measured, self._range_max)

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, comparison: Comparison
    ) -> tuple[FloatArray, BoolArray]:
        from objstate.sensing import likelihood

        outline = self._outlines.of_object(name, self._sweep.height)
        normals = np.zeros((len(states), 2)) if comparison.normals is None else comparison.normals
        placements = self._outlines.placements(name, states)
        stand, bears = self._outlines.stand(poses).poses, np.zeros(self._beams.shape[1], dtype=bool)

        def compare(some: IntArray, stand: FloatArray, background: FloatArray) -> FloatArray:
            out = np.empty((len(stand), len(states)))
            likelihood.object_log_likelihood(
                some,
                stand,
                placements,
                normals,
                outline.segments,
                outline.rim,
                background,
                self._sweep.order,
                self._beams,
                self._lasting,
                self._sweep.index,
                self._sweep.centre,
                self._parameters,
                comparison.shift_std,
                comparison.tempering,
                out,
                bears,
            )
            return out

        if comparison.whole is None:
            out = compare(np.arange(len(states)), stand, comparison.background)
            return out, self._sweep.unsorted(bears)
        out = compare(np.flatnonzero(comparison.whole), stand, comparison.background)
        rest, few = np.flatnonzero(~comparison.whole), comparison.few
        if len(rest):
            out[:, rest] = _log_mean(compare(rest, stand[few], comparison.background[few])[:, rest])
        return out, self._sweep.unsorted(bears)

    @cached_property
    def _lasting(self) -> FloatArray:
        """(n,) densities if stopped by what stopped the beam before."""
        return self._beam_model.lasting(self._measured)

    @cached_property
    def _parameters(self) -> FloatArray:
        """(9,) the beam model as the kernels take it."""
        return self._beam_model.parameters(self._range_max)

    def _cast(
        self, outline: ObjectOutline, placements: FloatArray, poses: FloatArray
    ) -> FloatArray:
        from objstate.sensing import projection

        stand, count = self._outlines.stand(poses), self._beams.shape[1]

        def ranges(abreast: FloatArray) -> FloatArray:
            found = np.empty((len(abreast), len(placements), count))
            projection.cast(
                abreast,
                placements,
                outline.segments,
                outline.rim,
                self._sweep.order,
                self._beams,
                self._sweep.index,
                self._sweep.centre,
                found,
            )
            return found

        return stand.each(ranges)


def _log_mean(logs: FloatArray) -> FloatArray:
    """Logarithms (s,) of the means of columns (p, s) of which the logarithms are given."""
    top = logs.max(axis=0)
    return np.asarray(top + np.log(np.exp(logs - top).mean(axis=0)))


def _agree(
    measured: FloatArray, expected: FloatArray, range_max: float, margin: float
) -> BoolArray:
    """Which ranges (n,) agree within ``margin`` m; all beyond ``range_max`` are one."""
    off = np.minimum(measured, range_max) - np.minimum(expected, range_max)
    return np.asarray(np.abs(off) <= margin)
