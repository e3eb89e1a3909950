"""A level scan compared with outlines, by compiled loops."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from objstate.geometry import BoolArray, FloatArray
from objstate.lazy import lazy
from objstate.records import Scan
from objstate.sensing import front_to_back, likelihood, projection, sweeps
from objstate.sensing.beam_model import BeamModel
from objstate.sensing.level import Sweep, UncertainObject
from objstate.sensing.outlines import SPREAD, LevelOutlines, ObjectOutline, Stand
from objstate.sensing.sweeps import Beams
from objstate.sensing.view import EXPLAINED_SIGMAS, Around, Comparison

ALL = np.empty((0, 3)), np.zeros((1, 2))  # circles and deviations: objects without a choice


class LevelView:
    """A level scan compared with outlines, by compiled loops."""

    def __init__(
        self,
        outlines: LevelOutlines,
        sweep: Sweep,
        among: Beams,
        chosen: BoolArray,
        beam_model: BeamModel,
        parameters: FloatArray,
    ) -> None:
        self._outlines = outlines
        self._sweep = sweep  # of all beams of the laser
        self._among = among
        self._chosen = chosen  # (n,) of those
        self._beam_model = beam_model
        self._parameters = parameters  # (9,) the beam model as the kernels take it
        self._range_max = float(parameters[sweeps.RANGE_MAX])

    @staticmethod
    def of(
        outlines: LevelOutlines, sweep: Sweep, scan: Scan, chosen: BoolArray, beam_model: BeamModel
    ) -> LevelView:
        """The view of some beams (n,) of a scan with this ``sweep``."""
        short = beam_model.short(scan.ranges)
        every = Beams(sweep.order, sweep.rows, sweep.index, scan.ranges, short)
        parameters = beam_model.parameters(scan.range_max)
        return LevelView(outlines, sweep, every, chosen, beam_model, parameters)

    def take(self, beams: BoolArray) -> LevelView:
        among = self._among if self._count == len(self._chosen) else self._beams
        model, parameters = self._beam_model, self._parameters
        return LevelView(self._outlines, self._sweep, among, beams, model, parameters)

    @lazy
    def _count(self) -> int:
        """The number of beams."""
        return int(np.count_nonzero(self._chosen))

    @lazy
    def _beams(self) -> Beams:
        """The beams of this view."""
        among, chosen = self._among, self._chosen
        order, rows, lookup = sweeps.take(chosen, among)
        return Beams(order, rows, lookup, among.measured[chosen], among.short[chosen])

    def walls(self, poses: FloatArray) -> FloatArray:
        def ranges(abreast: FloatArray) -> FloatArray:
            return np.asarray(self._walls(abreast[None])[0].T)

        return self._outlines.stand(poses).each(ranges)

    def _walls(self, poses: FloatArray, spread: float = math.sqrt(2.0) * SPREAD) -> FloatArray:
        """Ranges (h, m, p) m of walls from poses (h, p, 4), up to ``spread`` m apart in a group."""
        reach = self._range_max + self._sweep.around + spread
        walls = self._outlines.walls(self._sweep.height)
        near, beams = walls.near(poses[:, 0, :2], reach), (self._chosen, self._among)
        out = np.empty((len(poses), self._count, poses.shape[1]))
        front_to_back.wall_ranges(poses, walls.groups, near, *beams, self._sweep.centre, out)
        return out

    def _weigh(
        self,
        poses: FloatArray,
        walls: FloatArray,
        model: FloatArray,
        objects: Sequence[UncertainObject],
        among: tuple[FloatArray, FloatArray] = ALL,
    ) -> FloatArray:
        """Log p(o | l) (h, p) of poses (h, p, 4), with walls at ranges (h, m, p).

        Objects are chosen ``among`` those within circles (j, 3), with deviations (h, 2).
        """
        (circles, stds), out = among, np.empty(poses.shape[:2])
        likelihood.pose_log_likelihood(
            poses,
            stds,
            walls,
            self._outlines.scenery(tuple(objects), self._sweep.height),
            circles,
            self._chosen,
            self._among,
            self._sweep.centre,
            model,
            out,
        )
        return out

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        outline = self._outlines.of_object(name, self._sweep.height)
        placements = self._outlines.placements(name, states)
        return self._cast(outline, placements, self._outlines.stand(poses))

    def share_explained(
        self,
        name: str,
        states: FloatArray,
        pose: FloatArray,
        background: FloatArray,
        bears: BoolArray,
    ) -> float:
        share = sweeps.share_explained(
            bears,
            self._beams.order,
            self._beams.rows,
            self._sweep.centre,
            self._outlines.stand(pose[None]).poses[0],
            np.ascontiguousarray(background),
            self._outlines.placements(name, states),
            self._outlines.of_object(name, self._sweep.height).segments,
            self._range_max,
            EXPLAINED_SIGMAS * self._beam_model.sigma_hit,
        )
        return float(share)

    def stopped_short(self, pose: FloatArray, expected: FloatArray) -> FloatArray:
        margin = EXPLAINED_SIGMAS * self._beam_model.sigma_hit
        (stand,) = self._outlines.stand(pose[None]).poses
        beams, sweep = self._beams, self._sweep
        ends = sweeps.ends(beams.order, beams.rows, sweep.centre, sweep.height, stand)
        return np.asarray(ends[beams.measured < expected - margin])

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        beams, out = self._beams, np.empty(len(expected))
        likelihood.scan_log_likelihood(
            _abreast(expected), beams.measured, beams.short, self._lasting, self._parameters, out
        )
        return out

    def pose_log_likelihood(
        self,
        poses: FloatArray,
        blur: float,
        objects: Sequence[UncertainObject],
        walls: FloatArray | None = None,
    ) -> FloatArray:
        model = self._beam_model.blurred(blur).parameters(self._range_max)

        def log_likelihood(abreast: FloatArray, *known: FloatArray) -> FloatArray:
            expected = _abreast(known[0])[None] if known else self._walls(abreast[None])
            return np.asarray(self._weigh(abreast[None], expected, model, objects)[0])

        given = [] if walls is None else [walls]
        return self._outlines.stand(poses).each(log_likelihood, *given)

    def nearby_log_likelihood(self, poses: FloatArray, blur: float, around: Around) -> FloatArray:
        groups, size = poses.shape[:2]
        model = self._beam_model.blurred(blur).parameters(self._range_max)
        abreast, stds = np.empty((groups, size + (size > 1), 4)), np.empty((groups, 2))
        walls = self._walls(abreast, sweeps.stand_about(poses, abreast, stds))
        found = self._weigh(abreast, walls, model, around.objects, (around.circles, stds))
        return np.asarray(found[:, -size:])

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, comparison: Comparison
    ) -> tuple[FloatArray, BoolArray]:
        outline = self._outlines.of_object(name, self._sweep.height)
        normals = np.zeros((len(states), 2)) if comparison.normals is None else comparison.normals
        placements = self._outlines.placements(name, states)
        model = self._parameters
        if not comparison.in_runs:
            model = self._beam_model.beam_by_beam.parameters(self._range_max)
        out, bears = np.empty((len(poses), len(states))), np.zeros(len(self._beams.order), bool)
        likelihood.object_log_likelihood(
            self._outlines.stand(poses).poses,
            placements,
            normals,
            outline.segments,
            outline.rim,
            _abreast(comparison.background),
            self._beams.order,
            self._beams.rows,
            self._lasting,
            self._beams.lookup,
            self._sweep.centre,
            model,
            comparison.shift_std,
            comparison.tempering,
            out,
            bears,
        )
        return out, bears

    @lazy
    def _lasting(self) -> FloatArray:
        """(n,) densities of being stopped by what stopped the beam before."""
        return self._beam_model.lasting(self._beams.measured)

    def _cast(self, outline: ObjectOutline, placements: FloatArray, stand: Stand) -> FloatArray:
        """Ranges (p, s, n) m of an outline at placements (s, 4)."""
        if len(stand.poses) == 1:  # a loop that is compiled at once
            beams, found = self._beams, np.empty((len(placements), self._count))
            order, rows, centre = beams.order, beams.rows, self._sweep.centre
            sweeps.ranges_to(
                order, rows, centre, stand.poses[0], placements, outline.segments, found
            )
            return found[None]

        def ranges(abreast: FloatArray) -> FloatArray:
            found = np.empty((len(placements), self._count, len(abreast)))
            projection.cast(
                abreast,
                placements,
                outline.segments,
                outline.rim,
                self._chosen,
                self._among,
                self._sweep.centre,
                found,
            )
            return found.transpose(2, 0, 1)

        return stand.each(ranges)


def _abreast(ranges: FloatArray) -> FloatArray:
    """Ranges (p, n) as the kernels take them (n, p), contiguous over the poses."""
    return np.ascontiguousarray(ranges.T)
