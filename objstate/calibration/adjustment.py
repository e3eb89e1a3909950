"""The joint adjustment of path, walls, errors of odometry and corrections of lasers.

Unknowns are the robot's pose at each scan (3 each), the odometry's systematic errors
(2), for each laser a correction of its mounting and clock (4 each: x, y, yaw in
``base_link``, seconds), and for each piece of wall how much farther back it stands
than the model says. Readings are the distances of returns from the walls, and the
odometry between scans. Gauss-Newton with a redescending loss.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from objstate.calibration.blocks import Blocks, NormalEquations
from objstate.calibration.gathering import Gathered
from objstate.calibration.motion import Links, links_between
from objstate.calibration.options import CalibrationOptions
from objstate.calibration.walls import WallReader, WallReadings
from objstate.geometry import FloatArray, IntArray, compose, wrap

TUKEY = 4.685  # deviations beyond which a reading has no weight (biweight of 95 % efficiency)
HUBER = 3.0  # deviations beyond which a link of odometry weighs less
MEDIAN = 1.4826  # deviations of a Gaussian for each median of its absolute values
NARROWEST = 0.005  # m, least deviation of readings from walls
STILLEST = 0.003  # m, least deviation of walls from the model
SLIGHT = np.array([1e-6, 1e-6, 1e-6])  # m, m, rad: steps of numeric derivatives
SLIGHT_ERROR = 1e-6  # the same of odometry's errors
SLIGHT_CLOCK = 1e-6  # s


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What is sought, but for the walls."""

    poses: FloatArray  # (n, 3) of the robot at each scan, in the building
    errors: FloatArray  # (2,) of odometry: share of ways, drift in rad/m
    lasers: FloatArray  # (l, 4) x m, y m, yaw rad about the laser; s its clock is ahead

    @property
    def others(self) -> FloatArray:
        """(2 + 4l,) all but the poses."""
        return np.concatenate([self.errors, self.lasers.ravel()])

    def moved(self, step: FloatArray) -> Unknowns:
        """After a step (3n + 2 + 4l,) of all of them."""
        count = self.poses.size
        poses = self.poses + step[:count].reshape(-1, 3)
        poses[:, 2] = wrap(poses[:, 2])
        errors = self.errors + step[count : count + 2]
        return Unknowns(poses, errors, self.lasers + step[count + 2 :].reshape(-1, 4))


@dataclass(frozen=True, eq=False)
class Walls:
    """How far behind the model the pieces of wall stand."""

    pieces: IntArray  # (w,) ascending labels
    offsets: FloatArray  # (w,) m
    spread: float  # m, deviation of the offsets

    def behind(self, pieces: IntArray) -> FloatArray:
        """Offsets (n,) of pieces (n,); zero for those that aren't known."""
        if not len(self.pieces):
            return np.zeros(len(pieces))
        place = np.searchsorted(self.pieces, pieces).clip(max=len(self.pieces) - 1)
        return np.where(self.pieces[place] == pieces, self.offsets[place], 0.0)


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The result of the adjustment."""

    frames: tuple[str, ...]  # (l,) of the lasers
    unknowns: Unknowns
    covariance: FloatArray  # (2 + 4l, 2 + 4l) of ``unknowns.others``
    spread: float  # m, deviation of readings from the walls
    wall_spread: float  # m, deviation of walls from the model
    used: float  # share of the readings that lie near walls


class Adjustment:
    """One drive's readings, ready to be adjusted."""

    def __init__(self, gathered: Gathered, reader: WallReader, options: CalibrationOptions) -> None:
        self._options, self._reader = options, reader
        self._scans, self._start = gathered.scans, gathered.poses
        self.frames = tuple(sorted({scan.laser for scan in self._scans}))
        self._laser = np.array([self.frames.index(scan.laser) for scan in self._scans])
        self._mounts = np.array([scan.rays.origins[0, :2] for scan in self._scans])
        stamps = np.array([scan.stamp_ns for scan in self._scans], dtype=np.int64)
        self._speeds = gathered.track.speeds(stamps)
        self._links = links_between(gathered.track.at(stamps), options)
        self._beams = gathered.beams

    def solve(self) -> Adjusted:
        """Linearize and step, round by round; the loss narrows to what readings spread by."""
        unknowns = Unknowns(self._start, np.zeros(2), np.zeros((len(self.frames), 4)))
        walls = Walls(np.zeros(0, dtype=np.int64), np.zeros(0), self._options.wall_spread)
        spread = self._options.spread / TUKEY
        for _ in range(self._options.rounds):
            unknowns, walls, covariance, off = self._round(unknowns, walls, spread)
            spread = spread_of(off, self._options.spread)
        return Adjusted(
            frames=self.frames,
            unknowns=unknowns,
            covariance=covariance,
            spread=spread,
            wall_spread=walls.spread,
            used=float((np.abs(off) < self._options.spread).mean()) if len(off) else 0.0,
        )

    def _round(
        self, unknowns: Unknowns, walls: Walls, spread: float
    ) -> tuple[Unknowns, Walls, FloatArray, FloatArray]:
        """Improved unknowns, the covariance of those but poses, and distances (n,) from walls."""
        from scipy.sparse import diags_array

        readings = self._read(unknowns)
        pieces = readings.pieces(self._options.place)
        off = readings.distances - walls.behind(pieces)
        known, piece = np.unique(pieces, return_inverse=True)
        weights = self._options.shared / spread**2 * biweight(off / (TUKEY * spread))
        blocks = (
            self._wall_blocks(unknowns, readings, piece.reshape(-1), weights),
            link_blocks(self._links, unknowns.poses, unknowns.errors),
        )
        poses, others = unknowns.poses.size, len(unknowns.others)
        equations = NormalEquations.of(
            blocks,
            precision=diags_array(
                np.concatenate(
                    [
                        np.zeros(poses),
                        prior_deviations(self._options, len(self.frames)) ** -2.0,
                        np.full(len(known), walls.spread**-2.0),
                    ]
                )
            ),
            values=np.concatenate([np.zeros(poses), unknowns.others, np.zeros(len(known))]),
        )
        step = equations.step()
        behind = step[poses + others :]
        covariance = equations.covariance(np.arange(poses, len(step)))
        variance = np.diag(covariance)[others:]
        wall_spread = walls.spread
        if len(known):
            wall_spread = max(float(np.sqrt(np.mean(behind**2 + variance))), STILLEST)
        return (
            unknowns.moved(step[: poses + others]),
            Walls(known, behind, wall_spread),
            covariance[:others, :others],
            off,
        )

    def _read(self, unknowns: Unknowns) -> WallReadings:
        """All scans' readings, one after the other."""
        poses = self._casting_poses(unknowns.poses, unknowns.lasers[self._laser])
        return WallReadings.joined(
            [
                self._reader.read(scan, beams, pose)
                for scan, beams, pose in zip(self._scans, self._beams, poses, strict=True)
            ]
        )

    def _casting_poses(self, poses: FloatArray, lasers: FloatArray) -> FloatArray:
        """Poses from which the recorded beams coincide with those of the corrected laser.

        ``poses`` (n, 3) of the robot at each scan's stamp, ``lasers`` (n, 4) each scan's; (n, 3).
        """
        then = compose(poses, -lasers[:, 3:] * self._speeds)  # the scan was taken a little earlier
        return compose(then, about_laser(self._mounts, lasers[:, :3]))

    def _wall_blocks(
        self, unknowns: Unknowns, readings: WallReadings, piece: IntArray, weights: FloatArray
    ) -> Blocks:
        """One block for each piece of wall in each scan."""
        lasers = unknowns.lasers[self._laser]

        def poses(off: FloatArray) -> FloatArray:
            return self._casting_poses(unknowns.poses + off[:3], lasers + off[3:])

        count, scans = unknowns.poses.size, np.arange(len(self._scans))
        of_laser = count + len(unknowns.errors) + 4 * self._laser[:, None] + np.arange(4)
        columns = np.hstack([3 * scans[:, None] + np.arange(3), of_laser])
        pairs, block = np.unique(
            np.column_stack([readings.scan, piece]), axis=0, return_inverse=True
        )
        over = np.column_stack([readings.gradients, np.full(len(piece), -1.0)])  # pose, and wall
        information = np.zeros((len(pairs), 4, 4))
        pull = np.zeros((len(pairs), 4))
        np.add.at(
            information,
            block.reshape(-1),
            weights[:, None, None] * over[:, :, None] * over[:, None, :],
        )
        np.add.at(pull, block.reshape(-1), (weights * readings.distances)[:, None] * over)
        slight = np.concatenate([SLIGHT, SLIGHT, [SLIGHT_CLOCK]])
        jacobian = np.zeros((len(pairs), 4, columns.shape[1] + 1))
        jacobian[:, :3, :-1] = derivative(poses, slight)[pairs[:, 0]]
        jacobian[:, 3, -1] = 1.0
        of_piece = count + len(unknowns.others) + pairs[:, 1:]
        return Blocks(np.hstack([columns[pairs[:, 0]], of_piece]), jacobian, information, pull)


def link_blocks(links: Links, poses: FloatArray, errors: FloatArray) -> Blocks:
    """One block for each link, over the ``poses`` (n, 3) in turn, and odometry's ``errors`` (2,)."""
    begin, end = poses[:-1], poses[1:]
    residuals = links.residuals(begin, end, errors)
    weights = HUBER / np.linalg.norm(residuals, axis=1).clip(min=HUBER)

    def whitened(off: FloatArray) -> FloatArray:
        return links.residuals(begin + off[:3], end + off[3:6], errors + off[6:])

    count = len(begin)
    others = np.broadcast_to(poses.size + np.arange(2), (count, 2))
    return Blocks(
        columns=np.hstack([3 * np.arange(count)[:, None] + np.arange(6), others]),
        jacobian=derivative(whitened, np.concatenate([SLIGHT, SLIGHT, np.full(2, SLIGHT_ERROR)])),
        information=weights[:, None, None] * np.eye(3),
        pull=weights[:, None] * residuals,
    )


def prior_deviations(options: CalibrationOptions, lasers: int) -> FloatArray:
    """(2 + 4l,) of odometry's errors and the lasers' corrections before any reading."""
    o = options
    laser = [o.prior_xy, o.prior_xy, o.prior_yaw, o.prior_clock]
    return np.array([o.prior_scale, o.prior_drift, *(lasers * laser)])


def about_laser(mounts: FloatArray, corrections: FloatArray) -> FloatArray:
    """Motions (n, 3) of ``base_link`` for corrections (n, 3) of lasers at ``mounts`` (n, 2)."""
    turned = compose(
        np.column_stack([np.zeros((len(mounts), 2)), corrections[:, 2]]),
        np.column_stack([mounts, np.zeros(len(mounts))]),
    )
    return np.column_stack([mounts + corrections[:, :2] - turned[:, :2], corrections[:, 2]])


def biweight(off: FloatArray) -> FloatArray:
    """Tukey's weights (n,): one at zero, none from one on."""
    return np.asarray((1.0 - off**2).clip(min=0.0) ** 2)


def spread_of(off: FloatArray, widest: float) -> float:
    """Deviation, m, of the readings that are of walls."""
    near = np.abs(off)[np.abs(off) < widest]
    return max(MEDIAN * float(np.median(near)), NARROWEST) if len(near) else widest


def derivative(function: Callable[[FloatArray], FloatArray], slight: FloatArray) -> FloatArray:
    """(n, 3, c) central differences of ``function`` (c,) -> (n, 3) at zero; yaws wrapped."""
    columns = []
    for k, step in enumerate(slight):
        off = np.zeros(len(slight))
        off[k] = step
        change = function(off) - function(-off)
        change[:, 2] = wrap(change[:, 2])
        columns.append(change / (2.0 * step))
    return np.stack(columns, axis=-1)
