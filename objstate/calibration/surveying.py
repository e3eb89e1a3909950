"""What one drive tells of walls and lasers: an adjustment of its path, without any prior of these.

The readings are those of ``PoseFilter``, all at once: the distance of a return from its wall, given
the robot's pose, the laser's mounting, bias, clock and sweep, and the displacements of the columns
between which the wall stands. Poses, the clocks and sweeps, and the errors of odometry are the
drive's own, and are integrated out (Schur complement) where they are most probable. What remains is
a Gaussian likelihood of what all drives share.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.building.warping import Columns
from objstate.calibration.adjustment import TUKEY, biweight, link_blocks, spread_of
from objstate.calibration.blocks import NormalEquations, of_forms
from objstate.calibration.gathering import Gathered
from objstate.calibration.motion import links_between
from objstate.calibration.options import CalibrationOptions
from objstate.calibration.walls import WallReader
from objstate.config import BuildingErrorSettings
from objstate.errors import LogError
from objstate.estimator import Estimator
from objstate.geometry import BoolArray, FloatArray, IntArray, wrap
from objstate.lazy import Later
from objstate.localization.pose_filter import EDGE
from objstate.records import Scan
from objstate.sensing.surfaces import Surfaces

if TYPE_CHECKING:
    from scipy.sparse import csc_array

    from objstate.calibration import survey_kernels
    from objstate.localization import pose_update
else:
    survey_kernels = Later("objstate.calibration.survey_kernels")
    pose_update = Later("objstate.localization.pose_update")

POSE, MOUNTING = 3, 4  # x, y, yaw; and those of a laser with the bias of its ranges
CLOCKS = 2  # of a laser: offset of its clock, duration of a sweep
BIAS = 3  # index of the bias
ERRORS = 2  # systematic ones of odometry


@dataclass(frozen=True, eq=False)
class Survey:
    """The likelihood of what drives share, by one drive: a Gaussian without a prior.

    The unknowns are the mountings of ``lasers`` (x and y in m, yaw in rad, bias of ranges in m), and
    the displacements (x and y in m) of ``columns`` of the walls.
    """

    lasers: tuple[str, ...]  # (l,)
    columns: IntArray  # (c,)
    information: FloatArray  # (4l + 2c, 4l + 2c)
    pull: FloatArray  # (4l + 2c,) information times the unknowns
    spread: float  # m, deviation of readings from walls
    height: float  # m, of its first laser

    def placed(self, lasers: Sequence[str]) -> IntArray:
        """Where its unknowns are among those of all ``lasers``, and of all columns after these."""
        first = [4 * lasers.index(laser) for laser in self.lasers]
        mountings = [place + k for place in first for k in range(MOUNTING)]
        walls = 4 * len(lasers) + 2 * self.columns[:, None] + np.arange(2)
        return np.concatenate([np.array(mountings, dtype=np.int64), walls.ravel()])

    def without(self, columns: IntArray) -> Survey:
        """The same, where nothing is told of some ``columns`` (h,)."""
        hidden = np.isin(self.columns, columns)
        if not hidden.any():
            return self
        gone = np.concatenate([np.zeros(MOUNTING * len(self.lasers)), np.repeat(hidden, 2)])
        kept, gone = np.flatnonzero(gone == 0.0), np.flatnonzero(gone)
        own = self.information[np.ix_(gone, gone)] + np.eye(len(gone))  # 1/m^2, next to nothing
        across = np.linalg.solve(own, self.information[np.ix_(gone, kept)]).T
        information = self.information[np.ix_(kept, kept)]
        information = information - across @ self.information[np.ix_(gone, kept)]
        return Survey(
            self.lasers,
            self.columns[~hidden],
            0.5 * (information + information.T),
            self.pull[kept] - across @ self.pull[gone],
            self.spread,
            self.height,
        )

    def beside(self, mountings: Mapping[str, FloatArray], walls: FloatArray) -> Survey:
        """The same about a model, where this is about one that is off it by so much.

        That is by corrections (4,) of mountings by laser, and displacements (c, 2) m of columns.
        """
        lasers = [mountings.get(laser, np.zeros(MOUNTING)) for laser in self.lasers]
        off = np.concatenate([*lasers, walls[self.columns].ravel()])
        return replace(self, pull=self.pull + self.information @ off)

    def words(self) -> dict[str, Any]:
        """As JSON has it: arrays in single precision, by base64."""
        upper = self.information[np.triu_indices(len(self.pull))]
        return {
            "lasers": list(self.lasers),
            "columns": self.columns.tolist(),
            "information": _encoded(upper),
            "pull": _encoded(self.pull),
            "spread_m": round(self.spread, 5),
            "height_m": round(self.height, 3),
        }

    @staticmethod
    def read(words: Mapping[str, Any]) -> Survey:
        """Raises KeyError, TypeError or ValueError for what isn't such words."""
        lasers, columns = tuple(words["lasers"]), np.array(words["columns"], dtype=np.int64)
        pull, upper = _decoded(words["pull"]), _decoded(words["information"])
        count = MOUNTING * len(lasers) + 2 * len(columns)
        if len(pull) != count or len(upper) != count * (count + 1) // 2:
            raise ValueError("the survey has another form")
        spread, height = float(words["spread_m"]), float(words["height_m"])
        return Survey.of_upper(lasers, columns, upper, pull, spread, height)

    @staticmethod
    def of_upper(
        lasers: tuple[str, ...],
        columns: IntArray,
        upper: FloatArray,
        pull: FloatArray,
        spread: float,
        height: float,
    ) -> Survey:
        """With the upper triangle of the information, row by row."""
        information = np.zeros((len(pull), len(pull)))
        information[np.triu_indices(len(pull))] = upper
        information += np.triu(information, 1).T
        return Survey(lasers, columns, information, pull, spread, height)


def _encoded(values: FloatArray) -> str:
    return b64encode(np.asarray(values, dtype="<f4").tobytes()).decode()


def _decoded(text: str) -> FloatArray:
    return np.frombuffer(b64decode(text, validate=True), dtype="<f4").astype(float)


def deviations(error: BuildingErrorSettings) -> FloatArray:
    """(4,) of a laser's mounting and the bias of its ranges, before any reading."""
    yaw = np.radians(error.laser_yaw_std_deg)
    return np.array([error.laser_std_m, error.laser_std_m, yaw, error.range_bias_std_m])


@dataclass(frozen=True, eq=False)
class _State:
    """All unknowns."""

    poses: FloatArray  # (n, 3)
    errors: FloatArray  # (2,) of odometry
    clocks: FloatArray  # (l, 2) s, offsets and durations of sweeps
    lasers: FloatArray  # (l, 4)
    walls: FloatArray  # (c, 2) m

    @property
    def values(self) -> FloatArray:
        """All in one, those of the drive first."""
        parts = (self.poses, self.errors, self.clocks, self.lasers, self.walls)
        return np.concatenate([part.ravel() for part in parts])

    def moved(self, step: FloatArray) -> _State:
        ends = np.cumsum([self.poses.size, ERRORS, self.clocks.size, self.lasers.size])
        poses, errors, clocks, lasers, walls = np.split(step, ends)
        turned = self.poses + poses.reshape(-1, POSE)
        turned[:, 2] = wrap(turned[:, 2])
        return _State(
            turned,
            self.errors + errors,
            self.clocks + clocks.reshape(-1, CLOCKS),
            self.lasers + lasers.reshape(-1, MOUNTING),
            self.walls + walls.reshape(-1, 2),
        )


@dataclass(frozen=True, eq=False)
class _Beams:
    """Of a scan, the beams that are used and, for edges between them, those next to these."""

    used: BoolArray  # (n,)
    ranges: FloatArray  # (n,) m
    origins: FloatArray  # (n, 3)
    directions: FloatArray  # (n, 3)
    times: FloatArray  # (n,) in durations of the sweep from its middle
    range_max: float  # m

    @staticmethod
    def of(scan: Scan, used: BoolArray) -> _Beams:
        kept = used.copy()
        kept[1:] |= used[:-1]
        kept[:-1] |= used[1:]
        rays = scan.rays.take(kept)
        origins, directions = (
            np.ascontiguousarray(each) for each in (rays.origins, rays.directions)
        )
        times = pose_update.evenly(len(scan))[kept]
        return _Beams(used[kept], scan.ranges[kept], origins, directions, times, scan.range_max)


@dataclass(frozen=True, eq=False)
class _Readings:
    """Returns from walls, linear about a state."""

    off: FloatArray  # (m,) m behind the wall, along its normal
    # (m, 11) gradients over pose, mounting, clock, sweep, and both ends of the face
    over: FloatArray
    face: IntArray  # (m,)
    ends: FloatArray  # (m, 2, 2, 3) of both columns of both ends: number, derivatives by x and y


class Surveyor:
    """Reads scans against the columns of a building's walls."""

    def __init__(
        self,
        columns: Columns,
        reader: WallReader,
        error: BuildingErrorSettings,
        options: CalibrationOptions,
    ) -> None:
        self.columns, self.reader, self.error, self.options = columns, reader, error, options
        self.faces = cache(columns.faces)
        self.surfaces = cache(lambda height: Surfaces(self.faces(height).segments))

    @staticmethod
    def of(estimator: Estimator, columns: Columns) -> Surveyor:
        """With an estimator's building, whose walls have these columns."""
        options, error = CalibrationOptions(), estimator.settings.building_error
        return Surveyor(columns, WallReader.of(estimator, options), error, options)

    def survey(self, gathered: Gathered) -> Survey:
        """What a drive tells, by its level lasers. Raises LogError where none is level."""
        return _Drive(self, gathered).survey()


class _Drive:
    """One drive's level scans, ready to be adjusted."""

    def __init__(self, by: Surveyor, gathered: Gathered) -> None:
        self._by = by
        level = np.array([by.reader.is_level(scan) for scan in gathered.scans], dtype=bool)
        self._scans = [gathered.scans[k] for k in np.flatnonzero(level)]
        self._beams = [
            _Beams.of(gathered.scans[k], gathered.beams[k]) for k in np.flatnonzero(level)
        ]
        self._start = gathered.poses[level]
        self._lasers = tuple(sorted({scan.laser for scan in self._scans}))
        self._laser = np.array([self._lasers.index(scan.laser) for scan in self._scans], dtype=int)
        stamps = np.array([scan.stamp_ns for scan in self._scans], dtype=np.int64)
        self._speeds = gathered.track.speeds(stamps)
        self._links = links_between(gathered.track.at(stamps), by.options)

    def survey(self) -> Survey:
        """Linearize and step, round by round; the loss narrows to what readings spread by.

        Raises LogError where no laser is level.
        """
        if not self._scans:
            raise LogError("No laser of the log is level, so walls can't be learnt from it.")
        lasers, count = len(self._lasers), len(self._by.columns.places)
        state = _State(
            self._start,
            np.zeros(ERRORS),
            np.zeros((lasers, CLOCKS)),
            np.zeros((lasers, MOUNTING)),
            np.zeros((count, 2)),
        )
        options, precision = self._by.options, self._precision(len(self._start), lasers)
        own = len(self._start) * POSE + ERRORS + CLOCKS * lasers
        spread = options.spread / TUKEY
        for _ in range(options.rounds):
            equations, off = self._equations(state, spread, precision)
            state = state.moved(equations.step())
            spread = spread_of(off, options.spread)
        from scipy.sparse import diags_array

        of_drive = diags_array(np.where(np.arange(len(state.values)) < own, 1.0, 0.0)) @ precision
        equations, _ = self._equations(state, spread, of_drive.tocsc())
        walls = own + MOUNTING * lasers
        unread = np.zeros(2 * count, dtype=bool)
        unread[equations.unread - walls] = True
        unseen = np.logical_and(unread[0::2], unread[1::2])
        held = walls + np.flatnonzero(np.repeat(unseen, 2))
        information, gradient = equations.holding(held).marginal(len(self._start) * POSE, own)
        pull = information @ np.delete(state.values, held)[own:] - gradient
        return Survey(
            self._lasers,
            np.flatnonzero(~unseen),
            information,
            pull,
            spread,
            float(self._scans[0].rays.origins[0, 2]),
        )

    def _precision(self, scans: int, lasers: int) -> csc_array:
        """(u, u) of all unknowns but poses before any reading."""
        from scipy.sparse import block_diag, diags_array, eye_array, kron

        error, options = self._by.error, self._by.options
        first = np.concatenate(
            [
                np.zeros(POSE * scans),
                np.array([options.prior_scale, options.prior_drift]) ** -2.0,
                np.tile(np.array([error.clock_std_s, error.sweep_std_s]) ** -2.0, lasers),
                np.tile(deviations(error) ** -2.0, lasers),
            ]
        )
        walls = self._by.columns.precision(error.wall_length_m) / options.wall_spread**2
        return block_diag([diags_array(first), kron(walls, eye_array(2))]).tocsc()

    def _equations(
        self, state: _State, spread: float, precision: csc_array
    ) -> tuple[NormalEquations, FloatArray]:
        """All readings about a state, and their distances (m,) from walls.

        ``precision`` (u, u) is that of the prior, which has all unknowns but poses zero.
        """
        parts = [self._read(number, state) for number in range(len(self._scans))]
        off = np.concatenate([part.off for part in parts])
        weights = self._by.options.shared / spread**2 * biweight(off / (TUKEY * spread))
        links = link_blocks(self._links, state.poses, state.errors)
        values = state.values
        of_walls, walls_slope = self._of_walls(state, parts, weights)
        of_links, links_slope = of_forms(links.columns, links.slopes, links.curvatures, len(values))
        hessian = (precision + of_links + of_walls).tocsc()
        return NormalEquations(hessian, precision @ values + links_slope + walls_slope), off

    def _of_walls(
        self, state: _State, parts: Sequence[_Readings], weights: FloatArray
    ) -> tuple[csc_array, FloatArray]:
        """Hessian (u, u) and gradient (u,) of readings with ``weights`` (m,)."""
        from scipy.sparse import coo_array

        off, over, face, ends = (
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("off", "over", "face", "ends")
        )
        scan = np.repeat(np.arange(len(parts)), [len(part.off) for part in parts])
        own = POSE + MOUNTING + CLOCKS
        by_ends = over[:, own:, None, None] * ends[..., 1:]  # (m, 2, 2, 2) of ends, columns, axes
        over = np.hstack([over[:, :own], by_ends.reshape(-1, 8)])
        of_laser = self._laser[scan] * (int(face.max(initial=0)) + 1) + face
        _, first, form = np.unique(of_laser, return_index=True, return_inverse=True)
        poses, count = state.poses.size, len(state.values)
        others = self._others(state, self._laser[scan], ends[..., 0].astype(np.int64))
        of_scans, scan_slopes = np.zeros((len(parts), POSE, POSE)), np.zeros((len(parts), POSE))
        size = others.shape[1]
        of_faces, face_slopes = np.zeros((len(first), size, size)), np.zeros((len(first), size))
        scans, unknowns, entries = survey_kernels.sums(
            over,
            off,
            weights,
            scan,
            others,
            form.reshape(-1),
            count - poses,
            of_scans,
            scan_slopes,
            of_faces,
            face_slopes,
        )
        rows = POSE * np.arange(len(parts))[:, None] + np.arange(POSE)
        hessian, gradient = of_forms(rows, scan_slopes, of_scans, count)
        fixed, slope = of_forms(poses + others[first], face_slopes, of_faces, count)
        columns = np.repeat(poses + unknowns, POSE)
        across = coo_array((entries.ravel(), (rows[scans].ravel(), columns)), shape=(count, count))
        return hessian + fixed + across + across.T, gradient + slope

    def _others(self, state: _State, laser: IntArray, ends: IntArray) -> IntArray:
        """(m, 14) unknowns beside poses: of lasers (m,), and of the columns ``ends`` (m, 2, 2).

        They are counted from the first that is no pose.
        """
        mountings = ERRORS + CLOCKS * len(self._lasers)
        walls = mountings + state.lasers.size + 2 * ends[..., None] + np.arange(2)
        return np.hstack(
            [
                mountings + MOUNTING * laser[:, None] + np.arange(MOUNTING),
                ERRORS + CLOCKS * laser[:, None] + np.arange(CLOCKS),
                walls.reshape(len(laser), 8),
            ]
        )

    def _read(self, number: int, state: _State) -> _Readings:
        """The chosen returns of a scan."""
        beams, laser = self._beams[number], self._laser[number]
        height = float(beams.origins[0, 2])
        surfaces, faces = self._by.surfaces(height), self._by.faces(height)
        mounting = state.lasers[laser]
        mean = np.concatenate([state.poses[number], np.zeros(2), mounting, state.clocks[laser]])
        count = len(beams.ranges)
        origins, directions = np.empty((count, 2)), np.empty((count, 2))
        pose, place, moving = np.empty(3), np.empty(2), np.empty(3)
        pose_update.leave(
            beams.origins,
            beams.directions,
            beams.times,
            mean,
            self._speeds[number],
            POSE + 2,
            origins,
            directions,
            pose,
            place,
            moving,
        )
        expected, met = surfaces.meet(origins, directions, beams.range_max)
        row, used = np.empty((count, pose_update.COLUMNS)), beams.used.copy()
        pose_update.rows(
            surfaces.normals,
            met,
            expected,
            origins,
            directions,
            beams.times,
            pose,
            place,
            moving,
            row,
        )
        reached = np.full(count, beams.range_max)
        pose_update.surely_met(used, beams.ranges, expected, met, row, reached, EDGE)
        met = met[used]
        cosine = 1.0 / row[used, pose_update.OFFSET]
        segments, normals = faces.segments[met], surfaces.normals[met]
        points = origins[used] + expected[used, None] * directions[used]
        along = segments[:, 2:] - segments[:, :2]
        share = np.sum((points - segments[:, :2]) * along, axis=1) / np.sum(along**2, axis=1)
        shares = np.column_stack([1.0 - share, share])  # (m, 2) of both ends' offsets
        columns = faces.columns[met]  # (m, 2, 2)
        by = faces.shares[met][..., None] * normals[:, None, None, :]  # (m, 2, 2, 2)
        offsets = np.sum(by * state.walls[columns], axis=(2, 3))  # (m, 2) of both ends
        off = cosine * (beams.ranges[used] - expected[used] - mounting[MOUNTING - 1])
        own = row[used][:, [0, 1, 2, 5, 6, 7, 8, 9, 10]]
        return _Readings(
            off - np.sum(shares * offsets, axis=1),
            -np.column_stack([cosine[:, None] * own, shares]),
            met,
            np.concatenate([columns[..., None], by], axis=-1),
        )
