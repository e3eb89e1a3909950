"""A scan compared with triangles, for any mounting and any geometry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import BoolArray, FloatArray, transform_from_pose
from objstate.lazy import Later
from objstate.records import Rays
from objstate.sensing.beam_model import BeamModel
from objstate.sensing.expected import ExpectedRanges, cast_from
from objstate.sensing.level import UncertainObject
from objstate.sensing.view import EXPLAINED_SIGMAS, Around, Comparison, agree

if TYPE_CHECKING:
    from objstate.sensing import circles, sweeps
else:
    circles, sweeps = Later("objstate.sensing.circles"), Later("objstate.sensing.sweeps")


class MeshView:
    """Any mounting, any geometry: every beam is cast at the triangles."""

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

    def share_explained(
        self,
        name: str,
        states: FloatArray,
        pose: FloatArray,
        background: FloatArray,
        bears: BoolArray,
    ) -> float:
        alone = self.object(name, states, pose[None])[0].min(axis=0, initial=np.inf)
        expected = np.minimum(alone, background)
        margin = EXPLAINED_SIGMAS * self._beam_model.sigma_hit
        explained = agree(self._measured, expected, self._range_max, margin)
        return float(np.mean(explained[bears]))

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

    def nearby_log_likelihood(self, poses: FloatArray, blur: float, around: Around) -> FloatArray:
        groups, size = poses.shape[:2]
        abreast, stds = np.empty((groups, size + (size > 1), 4)), np.empty((groups, 2))
        sweeps.stand_about(poses, abreast, stds)
        every, out = np.ones(len(self._measured), dtype=bool), np.empty((groups, size))
        (directions, level), origins = self._rays.courses, self._rays.origins
        for h, (x, y, cos, sin) in enumerate(abreast[:, 0].tolist()):
            mean = np.array([[x, y, math.atan2(sin, cos)]])
            seen = circles.seen(
                around.circles,
                mean[0],
                stds[h, 0],
                stds[h, 1],
                self._range_max,
                origins,
                directions,
                level,
                every,
                self.walls(mean)[0],
            )
            objects = [around.objects[k] for k in seen.tolist()]
            out[h] = self.pose_log_likelihood(poses[h], blur, objects)
        return out

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, comparison: Comparison
    ) -> tuple[FloatArray, BoolArray]:
        background = comparison.background
        alone = self.object(name, states, poses)
        touched = alone < background[:, None]
        along = self._along
        if not comparison.in_runs:
            along = self._beam_model.beam_by_beam.along(self._measured, self._range_max)
        log_likelihood, share = along(np.where(touched, alone, background[:, None]))
        change = log_likelihood - along(background)[0][:, None]
        bears = touched & (self._measured > alone - self._near) & (alone < self._range_max)
        variance = comparison.shift_std**2
        if comparison.normals is not None and variance > 0.0:
            off = np.zeros(alone.shape)
            informative = touched & np.isfinite(self._measured)
            np.subtract(self._measured, alone, out=off, where=informative)
            cosine = self._cosines(poses, comparison.normals)
            informative &= np.abs(cosine) > sweeps.GRAZING
            per_shift = np.divide(1.0, cosine, out=np.zeros_like(cosine), where=informative)
            pull = (share * per_shift * off).sum(axis=2)
            hold = (share * per_shift**2).sum(axis=2)
            precision = comparison.tempering / self._beam_model.sigma_hit**2
            pull, hold = precision * pull, precision * hold
            surely = 1.0 + hold * variance
            averaged = 0.5 * (pull**2 * variance / surely - np.log(surely))
            return comparison.tempering * change + averaged, np.asarray(bears.any(axis=(0, 1)))
        return comparison.tempering * change, np.asarray(bears.any(axis=(0, 1)))

    def _cosines(self, poses: FloatArray, normals: FloatArray) -> FloatArray:
        """(p, s, n) cosines of beams with the normals (s, 2) of surfaces, seen from above."""
        turns = np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
        x, y = self._rays.directions[:, 0], self._rays.directions[:, 1]
        east = turns[:, :1] * x - turns[:, 1:] * y
        north = turns[:, 1:] * x + turns[:, :1] * y
        return np.asarray(east[:, None] * normals[:, :1] + north[:, None] * normals[:, 1:])
