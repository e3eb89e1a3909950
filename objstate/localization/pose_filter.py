"""Where a robot is that is known to centimetres: an extended Kalman filter over walls that are off.

Scans of one place repeat each other's errors, since a wall that stands aside of its place does so
for good. So the filter's state is the robot's pose, how each laser is really mounted, and how far
each piece of wall in view stands off along its normal. What a piece is off counts as another one
after some way (an Ornstein-Uhlenbeck process): other parts of it are met from there.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.config import BeamModelSettings, BuildingErrorSettings
from objstate.geometry import FloatArray, IntArray, wrapped
from objstate.lazy import Later
from objstate.localization.belief import PoseBelief
from objstate.localization.motion import Variances
from objstate.particles import Weights
from objstate.records import Scan
from objstate.sensing.surfaces import Surfaces

if TYPE_CHECKING:
    from objstate.localization import pose_kernels as kernels
else:
    kernels = Later("objstate.localization.pose_kernels")

POSE = 3
MOUNTING = 3  # x, y, yaw
SIDEWAYS = 0.25  # of the variance of a step's length, that a step has aside of it
LEVER = 1.0  # m; a turn by a radian shows other parts of walls as a way of so many metres does
STANDING = 0.5  # 1/m, density with which an object that may stand somewhere stops a beam
EDGE = 0.25  # m between ranges of neighbouring beams that meet different walls
GRAZING = 0.12  # cosine of incidence below which a range tells next to nothing of a wall's offset
FEWEST = 3  # beams by which a piece of wall is followed
FOLLOWED = 40  # pieces of wall at most; those out of reach are left first
NEAR = 0.02, math.radians(0.5)  # m and rad of deviation, from which one linearization is enough
LEARNT_BEAMS = 4000.0  # beams over which a laser's noise is averaged
FIRST_BEAMS = 200.0  # beams that the first guess of it counts for
NOISIEST = 2.0  # times the first guess of a range's deviation; beyond, walls are elsewhere
FIRST_TOGETHER = 0.5  # correlation of errors that is reckoned with at first
MOST_TOGETHER = 0.8  # and at most
FARTHEST = 3.0  # deviations by which a piece counts as off at most: others are no walls
FIRST_PIECES = 4.0  # pieces of wall that the first guess of their deviation counts for


class Vantage(NamedTuple):
    """From where a scan's beams leave, by a robot's mean pose and a laser's mean mounting."""

    place: FloatArray  # (2,) m of the robot
    origins: FloatArray  # (n, 2) m
    directions: FloatArray  # (n, 2) unit vectors
    covariance: FloatArray  # (3, 3) of the pose that the beams leave from
    variance: float  # m^2 of a range
    independence: float = 1.0  # exponent on the likelihood of a beam, as errors go together

    @staticmethod
    def of(robot: PoseBelief, scan: Scan, variance: float) -> Vantage:
        """By a belief of the pose alone, with lasers where they are said to be."""
        yaw = float(robot.mean[2])
        heading = np.array(((math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))))
        origins = scan.rays.origins[:, :2] @ heading + robot.mean[:2]
        directions = scan.rays.directions[:, :2] @ heading
        return Vantage(robot.mean[:2], origins, directions, robot.covariance, variance)


class Learnt(NamedTuple):
    """What a filter knows of robot and building that outlasts its pose."""

    mountings: dict[str, tuple[FloatArray, FloatArray]]  # by laser: mean (3,), covariance (3, 3)
    noise: dict[str, FloatArray]  # by laser: sums of squared residuals, m^2, of beams, and of
    # products and squares of residuals with those before, and with their neighbours'
    pieces: tuple[float, float]  # sums of squared offsets, m^2, and of pieces


NOTHING = Learnt({}, {}, (0.0, 0.0))


class PoseFilter:
    """Pose, mountings and walls' offsets of a robot whose pose is known well enough to linearize."""

    def __init__(
        self,
        belief: PoseBelief,
        error: BuildingErrorSettings,
        beam_model: BeamModelSettings,
        learnt: Learnt = NOTHING,
    ) -> None:
        self._error = error
        self._beams = beam_model
        self._mean = belief.mean.copy()  # (m,) pose, mountings, offsets of walls
        self._covariance = belief.covariance.copy()
        self._mountings: dict[str, int] = {}  # by laser, the first of its columns
        self._pieces: dict[tuple[float, int], int] = {}  # by height and number, its column
        self._learnt = learnt
        self._noise = dict(learnt.noise)
        self._residuals: dict[str, FloatArray] = {}  # (n,) of each laser's last scan

    @property
    def mean(self) -> FloatArray:
        """(3,) x m, y m, yaw rad."""
        pose = self._mean[:POSE].copy()
        pose[2] = wrapped(pose[2])
        return pose

    @property
    def covariance(self) -> FloatArray:
        """(3, 3)"""
        return self._covariance[:POSE, :POSE]

    @property
    def wall_std(self) -> float:
        """m by which pieces of wall stand off the model, by those seen so far."""
        first, (squares, count) = self._error.wall_std_m, self._walls
        return math.sqrt((FIRST_PIECES * first**2 + squares) / (FIRST_PIECES + count))

    @property
    def learnt(self) -> Learnt:
        """What outlasts the pose."""
        mountings = dict(self._learnt.mountings)
        for laser, first in self._mountings.items():
            own = slice(first, first + MOUNTING)
            mountings[laser] = self._mean[own].copy(), self._covariance[own, own].copy()
        return Learnt(mountings, dict(self._noise), self._walls)

    def belief(self, draws: FloatArray) -> PoseBelief:
        """The pose by samples that stand at fixed ``draws`` (n, 3) of a standard normal distribution."""
        root = np.linalg.cholesky(self.covariance + 1e-18 * np.eye(POSE))
        poses = self._mean[:POSE] + draws @ root.T
        poses[:, 2] = (poses[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        return PoseBelief(poses, Weights.uniform(len(poses)))

    def drive(self, step: FloatArray, variances: Variances) -> None:
        """The odometry moved by ``step`` (3,) in the robot's frame, with ``variances``."""
        ahead, left, turn = step.tolist()
        way, heading = math.hypot(ahead, left), float(self._mean[2]) + turn / 2.0
        cos, sin = math.cos(heading), math.sin(heading)
        dx, dy = cos * ahead - sin * left, sin * ahead + cos * left
        self._mean[:POSE] += dx, dy, turn
        p = self._covariance
        p[:2] += np.outer((-dy, dx), p[2])
        p[:, :2] += np.outer(p[:, 2], (-dy, dx))
        along = np.array((dx, dy)) / max(way, 1e-12)
        aside = np.array((-along[1], along[0]))
        p[:2, :2] += variances.length * (np.outer(along, along) + SIDEWAYS * np.outer(aside, aside))
        if way == 0.0:
            p[:2, :2] += variances.length * np.eye(2)
        p[2, 2] += variances.turn
        self._let_walls_be_others(math.exp(-(way + LEVER * abs(turn)) / self._error.wall_length_m))

    def vantage(self, scan: Scan) -> Vantage:
        """From where a scan's beams leave."""
        origins, directions, laser = self._beams_of(scan)
        first, cos, sin = self._mounting(scan.laser), *self._heading
        x, y = laser - self._mean[:2]
        moved = np.zeros((POSE, len(self._mean)))
        moved[:, :POSE] = np.eye(POSE)
        moved[:2, first : first + 2] = (cos, -sin), (sin, cos)
        moved[:, first + 2] = y, -x, 1.0
        covariance = moved @ self._covariance @ moved.T
        place = self._mean[:2].copy()
        noise = self.noise_variance(scan.laser), self.independence(scan.laser)
        return Vantage(place, origins, directions, covariance, *noise)

    def noise_variance(self, laser: str) -> float:
        """m^2 of a laser's ranges, by those seen so far."""
        squares, count = self._sums(laser)[:2].tolist()
        first = self._error.range_std_m**2
        variance = (FIRST_BEAMS * first + squares) / (FIRST_BEAMS + count)
        return float(min(variance, NOISIEST**2 * first))

    def independence(self, laser: str) -> float:
        """How many independent errors there are for each beam of a laser, as far as can be told.

        Errors of a beam and of the same beam of the scan before, or of its neighbour, go together
        where walls are rough, or the model has them smoother than they are. If they are chains with
        correlations c, n of them tell as much as n (1 - c) / (1 + c) that are independent.
        """
        products, squares = self._sums(laser)[2::2], self._sums(laser)[3::2]
        together = (products + FIRST_TOGETHER * FIRST_BEAMS) / (squares + FIRST_BEAMS)
        together = np.clip(together, 0.0, MOST_TOGETHER)
        return float(np.prod((1.0 - together) / (1.0 + together)))

    def _sums(self, laser: str) -> FloatArray:
        return self._noise.get(laser, np.zeros(6))

    def correct(self, scan: Scan, surfaces: Surfaces, most: FloatArray, entered: FloatArray) -> int:
        """Take in how far a scan's beams, that meet walls before ``most`` (n,) m, reach; how many did.

        Beyond the ranges at which beams are ``entered`` (n,) m, objects may stand.

        Linearized about the mean, and once more about the next one while the pose is wide.
        """
        prior_mean, prior = self._mean, self._covariance
        before = math.sqrt(max(prior[0, 0], prior[1, 1])), math.sqrt(prior[2, 2])
        looks = 1 if before[0] <= NEAR[0] and before[1] <= NEAR[1] else 2
        used, sums, residuals = scan.valid.copy(), np.zeros(2), np.empty(len(scan))
        for look in range(looks):
            origins, directions, laser = self._beams_of(scan)
            ranges, numbers = surfaces.meet(origins, directions, scan.range_max)
            row = np.empty((len(scan), kernels.COLUMNS))
            kernels.rows(
                surfaces.normals,
                numbers,
                ranges,
                origins,
                directions,
                self._mean[:POSE],
                laser,
                row,
            )
            if look == 0:
                within = np.minimum(most, scan.range_max)
                kernels.surely_met(used, scan.ranges, ranges, numbers, row, within, EDGE, GRAZING)
                if not used.any():
                    return 0
                self._follow(scan, numbers[used])
                prior_mean, prior = self._mean, self._covariance
            else:
                used &= numbers >= 0
            columns, offsets = self._columns(scan, numbers)
            off, count = self._mean - prior_mean, len(prior_mean)
            information, gradient = np.zeros((count, count)), np.zeros(count)
            sums[:] = 0.0
            kernels.gather(
                used,
                scan.ranges,
                ranges,
                entered,
                row,
                columns,
                off,
                offsets,
                self._covariance,
                *self._shares(scan.range_max),
                STANDING,
                self.noise_variance(scan.laser),
                self.wall_std**2,
                self.independence(scan.laser),
                information,
                gradient,
                sums,
                residuals,
            )
            surely = np.eye(count) + information @ prior
            found = np.linalg.solve(surely, np.column_stack([gradient, information @ prior]))
            mean, covariance = prior_mean + prior @ found[:, 0], prior - prior @ found[:, 1:]
            self._mean, self._covariance = mean, 0.5 * (covariance + covariance.T)
        self._learn_noise(scan.laser, sums, residuals)
        return int(np.count_nonzero(used))

    # --- the state's parts ----------------------------------------------------------

    @property
    def _heading(self) -> tuple[float, float]:
        yaw = float(self._mean[2])
        return math.cos(yaw), math.sin(yaw)

    def _beams_of(self, scan: Scan) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Origins and directions (n, 2) of a scan's beams, and the laser's place (2,), by the mean."""
        first, (cos, sin) = self._mounting(scan.laser), self._heading
        x, y, yaw = self._mean[first : first + MOUNTING].tolist()
        own, middle = scan.rays.origins[:, :2], scan.rays.origins[:, :2].mean(axis=0)
        turned = np.array(((math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))))
        heading = np.array(((cos, sin), (-sin, cos)))
        place = middle + np.array((x, y))
        origins = ((own - middle) @ turned + place) @ heading + self._mean[:2]
        directions = scan.rays.directions[:, :2] @ (turned @ heading)
        return origins, directions, place @ heading + self._mean[:2]

    def _mounting(self, laser: str) -> int:
        """The first column of a laser's mounting, which is added when it is first asked for."""
        if laser not in self._mountings:
            e = self._error
            std = np.array((e.laser_std_m, e.laser_std_m, math.radians(e.laser_yaw_std_deg)))
            mean, covariance = self._learnt.mountings.get(laser, (np.zeros(3), np.diag(std**2)))
            self._mountings[laser] = len(self._mean)
            self._append(mean, covariance)
        return self._mountings[laser]

    def _append(self, mean: FloatArray, covariance: FloatArray) -> None:
        before, count = len(self._mean), len(self._mean) + len(mean)
        both = np.zeros((count, count))
        both[:before, :before], both[before:, before:] = self._covariance, covariance
        self._mean, self._covariance = np.append(self._mean, mean), both

    def _follow(self, scan: Scan, numbers: IntArray) -> None:
        """Follow the offsets of pieces that enough beams (k,) meet; leave some where they are too many."""
        height = float(scan.rays.origins[0, 2])
        seen, counts = np.unique(numbers, return_counts=True)
        wanted = [(height, int(k)) for k in seen[counts >= FEWEST]]
        fresh = [piece for piece in wanted if piece not in self._pieces]
        if len(self._pieces) + len(fresh) > FOLLOWED:
            self._leave([piece for piece in self._pieces if piece not in set(wanted)])
        if fresh:
            first = len(self._mean)
            self._append(np.zeros(len(fresh)), self.wall_std**2 * np.eye(len(fresh)))
            self._pieces |= {piece: first + k for k, piece in enumerate(fresh)}

    def _leave(self, pieces: list[tuple[float, int]]) -> None:
        """Follow these pieces no longer; how far they were off stays in mind."""
        self._learnt = self._learnt._replace(pieces=self._walls_with(pieces))
        gone = {self._pieces.pop(piece) for piece in pieces}
        kept = [column for column in range(len(self._mean)) if column not in gone]
        place = {column: k for k, column in enumerate(kept)}
        self._mean = self._mean[kept]
        self._covariance = np.ascontiguousarray(self._covariance[np.ix_(kept, kept)])
        self._pieces = {piece: place[column] for piece, column in self._pieces.items()}
        self._mountings = {laser: place[column] for laser, column in self._mountings.items()}

    @property
    def _walls(self) -> tuple[float, float]:
        """Sums of squared offsets, m^2, and of pieces, each by how much is known of it."""
        return self._walls_with(list(self._pieces))

    def _walls_with(self, pieces: list[tuple[float, int]]) -> tuple[float, float]:
        squares, count = self._learnt.pieces
        columns = [self._pieces[piece] for piece in pieces]
        variances, prior = self._covariance[columns, columns], self._prior_wall_variance
        known = np.maximum(1.0 - variances / prior, 0.0)
        offs = np.minimum(self._mean[columns] ** 2, FARTHEST**2 * prior)
        squares += float(known @ (offs + variances))
        return squares, count + float(known.sum())

    @property
    def _prior_wall_variance(self) -> float:
        first, (squares, count) = self._error.wall_std_m, self._learnt.pieces
        return (FIRST_PIECES * first**2 + squares) / (FIRST_PIECES + count)

    def _columns(self, scan: Scan, numbers: IntArray) -> tuple[IntArray, FloatArray]:
        """Which of the state's columns (n, 7) tell of each beam, and the offset (n,) of the wall that it meets."""
        height, first = float(scan.rays.origins[0, 2]), self._mounting(scan.laser)
        columns = np.empty((len(numbers), kernels.COLUMNS), dtype=np.int64)
        columns[:, :POSE], columns[:, POSE:6] = range(POSE), range(first, first + MOUNTING)
        columns[:, 6] = [self._pieces.get((height, k), -1) for k in numbers.tolist()]
        return columns, np.where(columns[:, 6] >= 0, self._mean[columns[:, 6]], 0.0)

    def _let_walls_be_others(self, kept: float) -> None:
        columns = list(self._pieces.values())
        if kept == 1.0 or not columns:
            return
        self._mean[columns] *= kept
        self._covariance[columns] *= kept
        self._covariance[:, columns] *= kept
        self._covariance[columns, columns] += (1.0 - kept**2) * self.wall_std**2

    def _shares(self, range_max: float) -> tuple[float, float, float]:
        """Probability of a hit, and densities, 1/m, of random and of short readings."""
        s = self._beams
        total = s.z_hit + s.z_short + s.z_max + s.z_rand
        random = max(s.z_rand / total / range_max, 1e-9)
        return s.z_hit / total, random, s.z_short / total * s.lambda_short

    def _learn_noise(self, laser: str, sums: FloatArray, residuals: FloatArray) -> None:
        """Take in how far ranges were off, and how much that goes together; what is old fades."""
        found = np.concatenate([sums, np.zeros(4)])
        before = self._residuals.get(laser)
        if before is not None and len(before) == len(residuals):
            kernels.agreement(residuals, before, found[2:])
        self._residuals[laser] = residuals
        total = self._sums(laser) + found
        self._noise[laser] = min(LEARNT_BEAMS / max(float(total[1]), 1.0), 1.0) * total
