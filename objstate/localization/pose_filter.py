"""An extended Kalman filter for a pose known to centimetres, with walls that are off the model.

Scans from one place repeat each other's errors, since a wall that is off its modelled place is so
for good. So the state holds the robot's pose, the mounting errors of each laser, and the offset of
each piece of wall in view along its normal. Maps are bent, too: all walls of a place share a shift.
The offset of a piece and the shift are Ornstein-Uhlenbeck processes over the distance driven, since
other parts of walls are met from elsewhere.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.config import BeamModelSettings, BuildingErrorSettings
from objstate.geometry import BoolArray, FloatArray, IntArray, wrapped
from objstate.lazy import Later
from objstate.localization.belief import PoseBelief
from objstate.localization.carried import POSE, Carried, Clones
from objstate.localization.motion import Variances
from objstate.records import Scan
from objstate.sensing.surfaces import Surfaces
from objstate.units import SECONDS_PER_HOUR

if TYPE_CHECKING:
    from objstate.localization import pose_update
    from objstate.sensing.sweeps import Scenery
else:
    pose_update = Later("objstate.localization.pose_update")

FRAME = slice(3, 5)  # local shift of the whole model: x, y
LASER = 6  # x, y, yaw; range bias, m; clock, s; duration of a sweep, s
BIAS, CLOCK = 3, 4  # indices among a laser's errors
LEAST_S = 0.005  # s; least duration of an odometry step that determines the velocity
SHIFTED = 0.5  # share of the walls' deviation that all walls of a place have in common
SIDEWAYS = 0.25  # variance of a step to the side, as a share of that of its length
LEVER = 1.0  # m; distance that decorrelates walls as a turn by a radian does
BEFORE_OBJECTS = 0.1  # m before a known object, up to which a beam counts for walls
EDGE = 0.25  # m between ranges of neighbouring beams that meet different walls
FEWEST = 3  # beams on a piece of wall from which it is followed
FOLLOWED = 40  # most pieces of wall; those out of reach are dropped first
NEAR = 0.02, math.radians(0.5)  # m and rad of deviation below which one linearization is enough
WIDE = 0.04, math.radians(1.5)  # above which a linearization about the mean isn't enough
SLIPPING = 0.3, 0.3, math.radians(20.0)  # m/s, m/s, rad/s: error of odometry while wheels slip
NEGLIGIBLE = 1e-3  # probability of slipping below which one linearization is enough
EVERY = 3  # of so many beams, one is used to detect slipping
SLIP_S = 0.5  # s, mean duration of a slip
# beams over which a laser's noise is averaged, as the map's error differs from place to place, and
# its correlations
LEARNT_BEAMS = np.array([2000.0, 4000.0])
FIRST_BEAMS = 200.0  # beams that the first guess of the noise counts for
# m, ranges of these beams; squared tangents of their incidence
FIRST_RANGES, FIRST_SLOPES = np.array((1.0, 5.0, 5.0)), np.array((0.0, 0.0, 1.0))
# m, least deviation of a range; largest growth of its variance with the range
LEAST_STD, MOST_GROWTH = 0.001, 0.05
NOISIEST = 2.0  # times the first guess of a range's deviation: the largest that is learnt
FIT = 10  # number of sums of the noise's fit, the last one of beams
UPPER = np.triu_indices(3)  # of a symmetric matrix of its three terms
COMMON = np.arange(POSE + 2)  # columns on which all beams depend: pose and shift
FIRST_TOGETHER = 0.5  # initial correlation of errors
MOST_TOGETHER = 0.8  # largest
FARTHEST = 3.0  # deviations beyond which a piece isn't a wall
FIRST_PIECES = 4.0  # pieces of wall that the first guess of their deviation counts for


NO_STATE: FloatArray = np.empty((POSE, 0))


class RangeNoise(NamedTuple):
    """The variance of a range r is variance + growth r^2 + slant r^2 tan^2 of the incidence.

    A beam widens with the range, and the surface that it meets at a slant is at different ranges
    over its width.
    """

    variance: float  # m^2
    growth: float
    slant: float


class Independence(NamedTuple):
    """Exponents on the likelihood of a beam, for errors that are correlated.

    Errors of a beam are correlated with those of the same beam in the previous scan and of its
    neighbours where walls are rough, or rougher than modelled. Of a Markov chain with correlation
    c, n errors carry as much information as n (1 - c) / (1 + c) independent ones.
    """

    beams: float  # for correlations between neighbours
    scans: float  # with the previous scan

    @property
    def both(self) -> float:
        """The number of independent errors for each beam."""
        return self.beams * self.scans


class Vantage(NamedTuple):
    """The origins and directions of a scan's beams, at the mean pose and mounting."""

    place: FloatArray  # (2,) m of the robot
    origins: FloatArray  # (n, 2) m
    directions: FloatArray  # (n, 2) unit vectors
    covariance: FloatArray  # (3, 3) of the pose that the beams leave from
    noise: RangeNoise
    independence: Independence = Independence(1.0, 1.0)
    bias: float = 0.0  # m by which ranges are too long
    jacobian: FloatArray = NO_STATE  # (3, m) of that pose by the state of the filter
    shared: FloatArray = NO_STATE.T  # (m, 3) covariance of the state with that pose

    @staticmethod
    def of(robot: PoseBelief, scan: Scan, noise: RangeNoise) -> Vantage:
        """The same for a belief about the pose alone, with lasers where they are modelled."""
        yaw = float(robot.mean[2])
        heading = np.array(((math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))))
        origins = scan.rays.origins[:, :2] @ heading + robot.mean[:2]
        directions = scan.rays.directions[:, :2] @ heading
        return Vantage(robot.mean[:2], origins, directions, robot.covariance, noise)


class WallErrors(NamedTuple):
    """How far walls at one height are off the model, and how surely that is known."""

    std: float  # m, deviation of pieces of wall from the model
    shift: FloatArray  # (2,) m, that of all walls about the robot
    of_shift: FloatArray  # (2, 2) m^2, its covariance
    offsets: FloatArray  # (k,) m of each piece along its normal
    of_offsets: FloatArray  # (k,) m^2, variances
    shared: FloatArray  # (k, 2) m^2, covariances with the shift

    @property
    def shift_std(self) -> float:
        """m by which all walls of a place are shifted, as far as no log tells."""
        return SHIFTED * self.std

    @staticmethod
    def unknown(pieces: int, wall_std: float) -> WallErrors:
        """Errors of some pieces of which only the deviation is known."""
        shift = np.zeros(2), (SHIFTED * wall_std) ** 2 * np.eye(2)
        offsets = np.zeros(pieces), np.full(pieces, wall_std**2)
        return WallErrors(wall_std, *shift, *offsets, np.zeros((pieces, 2)))

    def meet(
        self, surfaces: Surfaces, origins: FloatArray, directions: FloatArray, reach: float
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Ranges (n,) m of beams to walls, their variances (n,) m^2, and the pieces' numbers (n,).

        As ``Surfaces.meet``.
        """
        ranges, numbers = surfaces.meet(origins + self.shift, directions, reach)
        variances, meets = np.zeros(len(ranges)), numbers >= 0
        of = numbers[meets]
        by_offset = 1.0 / surfaces.cosines(of, directions[meets])
        by_shift = -surfaces.normals[of] * by_offset[:, None]
        of_shift = by_shift @ self.of_shift + 2.0 * by_offset[:, None] * self.shared[of]
        variances[meets] = by_offset**2 * self.of_offsets[of] + np.sum(of_shift * by_shift, axis=1)
        ranges[meets] += by_offset * self.offsets[of]
        return ranges, variances, numbers


class Learnt(NamedTuple):
    """What a filter has learnt of robot and building, which outlasts its pose."""

    lasers: dict[
        str, tuple[FloatArray, FloatArray]
    ]  # errors by laser: mean (6,), covariance (6, 6)
    noise: dict[
        str, FloatArray
    ]  # by laser: sums (9,) of the least squares fit of ``RangeNoise``, and
    # (4,) products and squares of residuals with those before and those of neighbours
    pieces: tuple[float, float]  # sums of squared offsets, m^2, and of pieces


NOTHING = Learnt({}, {}, (0.0, 0.0))


class PoseFilter:
    """Pose, errors of lasers and offsets of walls, for a pose known well enough to linearize."""

    def __init__(
        self,
        belief: PoseBelief,
        error: BuildingErrorSettings,
        beam_model: BeamModelSettings,
        slips_per_hour: float,
        learnt: Learnt = NOTHING,
    ) -> None:
        self._error = error
        self._beams = beam_model
        self._first_fit = FIRST_BEAMS * _first_sums(error.range_std_m**2)  # (9,)
        self._mean = belief.mean.copy()  # (m,) pose, shift, errors of lasers, offsets of walls
        self._covariance = belief.covariance.copy()
        self._slip_rate = slips_per_hour / SECONDS_PER_HOUR  # 1/s
        self._slips, self._since = 0.0, 0.0  # probability that wheels slip; s since the last scan
        self._velocity = np.zeros(POSE)  # m/s, m/s, rad/s in the robot's frame
        self._clones = Clones()
        self._clones.extend(POSE)
        self._lasers: dict[str, int] = {}  # the first column of each laser
        # the column of each piece, by height and number
        self._pieces: dict[tuple[float, int], int] = {}
        # by height: the column of each number, or -1, as of the number -1
        self._tables: dict[float, IntArray] = {}
        self._offsets = np.empty(0, dtype=np.int64)  # all columns of pieces
        self._known_wall_std: float | None = None  # cached for the present state
        self._learnt = learnt
        self._noise = dict(learnt.noise)
        # noise and independence that these sums give
        self._known_noise: dict[str, tuple[RangeNoise, Independence]] = {}
        self._residuals: dict[str, FloatArray] = {}  # (n,) of each laser's last scan
        self._append(np.zeros(2), (SHIFTED * self.wall_std) ** 2 * np.eye(2))

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
        """Standard deviation in m of pieces of wall from the model, by those seen so far."""
        if self._known_wall_std is None:
            (first, known), (squares, count) = self._first_walls, self._offs_of(self._offsets)
            self._known_wall_std = math.sqrt((first + squares) / (known + count))
        return self._known_wall_std

    @property
    def learnt(self) -> Learnt:
        """What outlasts the pose."""
        lasers = dict(self._learnt.lasers)
        for laser, first in self._lasers.items():
            own = slice(first, first + LASER)
            lasers[laser] = self._mean[own].copy(), self._covariance[own, own].copy()
        return Learnt(lasers, dict(self._noise), self._walls_with(self._offsets))

    def belief(self, draws: FloatArray) -> PoseBelief:
        """Samples of the pose at fixed ``draws`` (n, 3), see ``PoseBelief.whitened``."""
        return PoseBelief.whitened(self.mean, self.covariance.copy(), draws)

    def drive(self, step: FloatArray, variances: Variances, seconds: float) -> None:
        """Predict for a ``step`` (3,) of odometry in the robot's frame, with ``variances``."""
        if seconds >= LEAST_S:
            self._velocity = step / seconds
        self._since += seconds
        starts = -math.expm1(-self._slip_rate * seconds)
        self._slips = starts + (math.exp(-seconds / SLIP_S) - starts) * self._slips
        pose_update.drive(
            self._mean,
            self._covariance,
            self._clones.cross,
            step,
            *variances,
            SIDEWAYS,
            LEVER,
            self._error.wall_length_m,
            SHIFTED,
            self._offsets,
            *self._first_walls,
            FARTHEST,
        )
        self._known_wall_std = None

    def vantage(self, scan: Scan) -> Vantage:
        """The origins and directions of a scan's beams."""
        origins, directions, pose, laser, moving = self._beams_of(scan)
        first, (cos, sin) = self._laser(scan.laser), _heading(pose)
        x, y = laser - pose[:2]
        shift = self._mean[FRAME]
        jacobian = np.zeros((POSE, len(self._mean)))
        jacobian[:, :POSE] = np.eye(POSE)
        jacobian[:2, first : first + 2] = (cos, -sin), (sin, cos)
        jacobian[:, first + 2] = y, -x, 1.0
        jacobian[:, first + CLOCK] = moving
        shared = self._covariance @ jacobian.T
        return Vantage(
            pose[:2] - shift,
            origins - shift,
            directions,
            jacobian @ shared,
            *self._noises(scan.laser),
            float(self._mean[first + BIAS]),
            jacobian,
            shared,
        )

    def walls(self, height: float, pieces: int) -> WallErrors:
        """How far walls at a height m, which are that many ``pieces``, are off the model."""
        out = WallErrors.unknown(pieces, self.wall_std)._replace(
            shift=self._mean[FRAME], of_shift=self._covariance[FRAME, FRAME]
        )
        if height in self._tables:
            numbers = np.flatnonzero(self._tables[height] >= 0)
            columns = self._tables[height][numbers]
            out.offsets[numbers] = self._mean[columns]
            out.of_offsets[numbers] = self._covariance[columns, columns]
            out.shared[numbers] = self._covariance[columns, FRAME]
        return out

    def carried(self, name: str, vantage: Vantage) -> Carried:
        """How the error at the last observation of an object carries over; it is observed now."""
        return self._clones.renew(name, vantage.jacobian, vantage.shared, vantage.covariance)

    def range_noise(self, laser: str) -> RangeNoise:
        """The noise of a laser's ranges: weighted least squares of squared errors so far."""
        return self._noises(laser)[0]

    def independence(self, laser: str) -> Independence:
        """How independent the errors of a laser's beams are, by correlations so far."""
        return self._noises(laser)[1]

    def _noises(self, laser: str) -> tuple[RangeNoise, Independence]:
        if laser not in self._known_noise:
            sums = self._noise.get(laser, np.zeros(FIT + 4))
            self._known_noise[laser] = self._noise_of(sums[:FIT]), _independence(sums[FIT:])
        return self._known_noise[laser]

    def _noise_of(self, sums: FloatArray) -> RangeNoise:
        count, a, b, aa, ab, bb, own, of_a, of_b = (sums[:-1] + self._first_fit).tolist()
        first, most = self._error.range_std_m**2, MOST_GROWTH**2
        # the products of growth and slant, and of these with the squared errors, about their means
        aa, ab, bb = aa - a * a / count, ab - a * b / count, bb - b * b / count
        of_a, of_b = of_a - a * own / count, of_b - b * own / count
        determinant = aa * bb - ab * ab
        growth, slant = of_a * bb - of_b * ab, of_b * aa - of_a * ab
        if growth >= 0.0 <= slant:
            growth, slant = growth / determinant, slant / determinant
        elif growth < slant:
            growth, slant = 0.0, max(of_b / bb, 0.0)
        else:
            growth, slant = max(of_a / aa, 0.0), 0.0
        growth, slant = min(growth, most), min(slant, most)
        variance = (own - a * growth - b * slant) / count
        return RangeNoise(min(max(variance, LEAST_STD**2), NOISIEST**2 * first), growth, slant)

    @property
    def is_wide(self) -> bool:
        """Whether scans are not linear in the pose over the whole belief."""
        return self._is_wider(WIDE)

    def correct(
        self,
        scan: Scan,
        surfaces: Surfaces,
        most: FloatArray,
        entered: FloatArray,
        objects: Scenery,
        known: Scenery,
        about: PoseBelief | None = None,
    ) -> int:
        """Update by the beams that meet walls before ``most`` (n,) m; return their number.

        And before objects that are ``known`` to stand in one place. Beyond the ranges at which
        beams are ``entered`` (n,) m, other ``objects`` may stand.

        Ranges are linearized about the mean of the prior, or of a better belief ``about`` the pose;
        while the pose isn't known to centimetres, and as far as wheels have slipped, once more
        about the posterior mean.
        """
        off = np.zeros(POSE)
        if about is not None:
            off = about.mean - self._mean[:POSE]
            off[2] = wrapped(off[2])
            self._mean[:POSE] += off
        seen = self._meet(scan, surfaces, known)
        used = self._surely_met(scan, seen, most)
        if not used.any():
            self._mean[:POSE] -= off
            return 0
        self._follow(scan, surfaces, seen.numbers[used])
        shift = np.zeros(len(self._mean))
        shift[:POSE] = off
        mean, gripping = self._mean - shift, self._covariance
        is_near = not self._is_wider(NEAR)
        slipping = (np.array(SLIPPING) * min(self._since, 1.0)) ** 2
        may_meet = _MayMeet(used, entered, objects)
        beams = self._readings(scan, seen, may_meet, gripping)
        if about is None and self._slips > 0.0:
            self._slips = pose_update.slipped(
                np.ascontiguousarray(np.flatnonzero(used)[::EVERY]),
                beams,
                gripping,
                self._densities(scan),
                slipping,
                self._slips,
            )
        prior = gripping.copy()
        prior[range(POSE), range(POSE)] += self._slips * slipping
        gate = prior
        if about is not None:
            gate = prior.copy()
            gate[:POSE, :POSE] = about.covariance + np.diag([NEAR[0], NEAR[0], NEAR[1]]) ** 2
        taken = self._take(scan, beams, used, shift, prior, gate)
        if not is_near or self._slips > NEGLIGIBLE:
            self._mean, self._known_wall_std = mean + taken.shift, None
            seen = self._meet(scan, surfaces, known)
            used &= self._surely_met(scan, seen, most)
            gate = taken.reduced(prior)
            beams = self._readings(scan, seen, may_meet, gate)
            taken = self._take(scan, beams, used, taken.shift, prior, gate)
        covariance = taken.reduced(prior)
        self._covariance = 0.5 * (covariance + covariance.T)
        self._mean, self._known_wall_std = mean + taken.shift, None
        self._clones.cross = taken.reduced(self._clones.cross)
        self._since = 0.0
        self._learn_noise(scan.laser, taken)
        return int(np.count_nonzero(used))

    def _is_wider(self, limits: tuple[float, float]) -> bool:
        """Whether the pose has deviations, m and rad, above ``limits``."""
        p = self._covariance
        return bool(max(p[0, 0], p[1, 1]) > limits[0] ** 2 or p[2, 2] > limits[1] ** 2)

    def _surely_met(self, scan: Scan, seen: _Met, most: FloatArray) -> BoolArray:
        """The beams (n,) that meet walls at the mean, if nothing unexpected stops them."""
        used = scan.valid.copy()
        most = np.minimum(np.minimum(most, scan.range_max), seen.known - BEFORE_OBJECTS)
        pose_update.surely_met(used, scan.ranges, seen.ranges, seen.numbers, seen.row, most, EDGE)
        return used

    def _meet(self, scan: Scan, surfaces: Surfaces, known: Scenery) -> _Met:
        """The walls and known objects that a scan's beams meet at the mean."""
        leaving = self._beams_of(scan)
        origins, directions, pose, laser, moving = leaving
        ranges, numbers = surfaces.meet(origins, directions, scan.range_max)
        ranges += self._mean[self._laser(scan.laser) + BIAS]
        row = np.empty((len(scan), pose_update.COLUMNS))
        pose_update.rows(
            surfaces.normals,
            numbers,
            ranges,
            origins,
            directions,
            pose_update.evenly(len(scan)),
            pose,
            laser,
            moving,
            row,
        )
        before = np.empty(len(scan))
        pose_update.meet_objects(known, origins, directions, before)
        return _Met(ranges, numbers, row, leaving, before)

    def _take(
        self,
        scan: Scan,
        beams: pose_update.Readings,
        used: BoolArray,
        off: FloatArray,
        prior: FloatArray,
        gate: FloatArray,
    ) -> _Taken:
        """The posterior by the ``used`` beams (n,), linearized ``off`` (m,) from the prior's mean.

        The prior's covariance is (m, m). Beams count by the probability that they hit, for a state
        of covariance ``gate`` (m, m).
        """
        count = len(off)
        information, gradient = np.zeros((count, count)), np.zeros(count)
        sums, residuals = np.zeros(FIT), np.empty(len(scan))
        pose_update.gather(
            used,
            beams,
            off,
            gate,
            self._densities(scan),
            information,
            gradient,
            sums,
            residuals,
        )
        told = np.flatnonzero(information.diagonal())
        information, prior = information[told[:, None], told], prior[:, told]
        held = np.eye(len(told)) + information @ prior[told]
        gain = prior @ np.linalg.solve(held, information)
        taken = _Taken(told, gain, prior @ gradient[told], sums, residuals)
        return taken._replace(shift=taken.reduced(taken.shift))

    def _densities(self, scan: Scan) -> pose_update.Densities:
        """The beam model of a scan, as the loops take it."""
        return pose_update.Densities(
            *self._shares(scan.range_max),
            *self.range_noise(scan.laser),
            self.wall_std**2,
            self.independence(scan.laser).both,
        )

    # --- the state's parts ----------------------------------------------------------

    def _beams_of(self, scan: Scan) -> _Leaving:
        """The origins and directions of a scan's beams at the mean, with the local shift."""
        count, rays = len(scan), scan.rays
        out = _Leaving(
            np.empty((count, 2)), np.empty((count, 2)), np.empty(3), np.empty(2), np.empty(3)
        )
        first = self._laser(scan.laser)
        pose_update.leave(
            np.ascontiguousarray(rays.origins),
            np.ascontiguousarray(rays.directions),
            pose_update.evenly(count),
            self._mean,
            self._velocity,
            first,
            *out,
        )
        return out

    def _laser(self, laser: str) -> int:
        """The first column of a laser's errors, which are added on first use."""
        if laser not in self._lasers:
            e = self._error
            yaw_std = math.radians(e.laser_yaw_std_deg)
            place = e.laser_std_m, e.laser_std_m, yaw_std
            std = np.array((*place, e.range_bias_std_m, e.clock_std_s, e.sweep_std_s))
            mean, covariance = self._learnt.lasers.get(laser, (np.zeros(LASER), np.diag(std**2)))
            self._lasers[laser] = len(self._mean)
            self._append(mean, covariance)
        return self._lasers[laser]

    def _append(self, mean: FloatArray, covariance: FloatArray) -> None:
        before, count = len(self._mean), len(self._mean) + len(mean)
        both = np.zeros((count, count))
        both[:before, :before], both[before:, before:] = self._covariance, covariance
        self._mean, self._covariance = np.append(self._mean, mean), both
        self._clones.extend(len(mean))
        self._known_wall_std = None

    def _follow(self, scan: Scan, surfaces: Surfaces, numbers: IntArray) -> None:
        """Follow the offsets of pieces that enough beams (k,) meet; drop some of too many."""
        height = float(scan.rays.origins[0, 2])
        if height not in self._tables:
            self._tables[height] = np.full(len(surfaces.pieces) + 1, -1, dtype=np.int64)
        seen = np.flatnonzero(np.bincount(numbers) >= FEWEST)
        wanted = [(height, k) for k in seen.tolist()]
        fresh = [piece for piece in wanted if piece not in self._pieces]
        if len(self._pieces) + len(fresh) > FOLLOWED:
            self._leave([piece for piece in self._pieces if piece not in set(wanted)])
        if fresh:
            first = len(self._mean)
            self._append(np.zeros(len(fresh)), self.wall_std**2 * np.eye(len(fresh)))
            self._pieces |= {piece: first + k for k, piece in enumerate(fresh)}
            self._list_pieces()

    def _leave(self, pieces: list[tuple[float, int]]) -> None:
        """Stop following these pieces; their offsets still count for the learnt deviation."""
        columns = np.array([self._pieces[piece] for piece in pieces], dtype=np.int64)
        self._learnt = self._learnt._replace(pieces=self._walls_with(columns))
        gone = {self._pieces.pop(piece) for piece in pieces}
        kept = [column for column in range(len(self._mean)) if column not in gone]
        place = {column: k for k, column in enumerate(kept)}
        self._mean = self._mean[kept]
        self._covariance = np.ascontiguousarray(self._covariance[np.ix_(kept, kept)])
        self._clones.select(kept)
        self._pieces = {piece: place[column] for piece, column in self._pieces.items()}
        self._lasers = {laser: place[column] for laser, column in self._lasers.items()}
        self._known_wall_std = None
        self._list_pieces()

    def _list_pieces(self) -> None:
        """Make arrays hold the columns of the followed pieces."""
        self._offsets = np.array(list(self._pieces.values()), dtype=np.int64)
        for table in self._tables.values():
            table.fill(-1)
        for (height, number), column in self._pieces.items():
            self._tables[height][number] = column

    def _walls_with(self, columns: IntArray) -> tuple[float, float]:
        """Sums of squared offsets, m^2, and of pieces, weighted by information; all so far."""
        (left, known), (squares, count) = self._learnt.pieces, self._offs_of(columns)
        return left + squares, known + count

    def _offs_of(self, columns: IntArray) -> tuple[float, float]:
        """Such sums for the pieces in some columns (k,)."""
        first, known = self._first_walls
        sums: tuple[float, float] = pose_update.wall_sums(
            self._mean, self._covariance, columns, first / known, FARTHEST
        )
        return sums

    @property
    def _first_walls(self) -> tuple[float, float]:
        """Such sums for pieces that are no longer followed, and for the first guess."""
        squares, count = self._learnt.pieces
        return FIRST_PIECES * self._error.wall_std_m**2 + squares, FIRST_PIECES + count

    def _readings(
        self, scan: Scan, seen: _Met, may_meet: _MayMeet, covariance: FloatArray
    ) -> pose_update.Readings:
        """A scan's beams, which may meet objects, as the loops take them.

        For a state of some ``covariance`` (m, m).
        """
        columns = np.concatenate([COMMON, self._laser(scan.laser) + np.arange(LASER)])
        walls = self._tables[float(scan.rays.origins[0, 2])][seen.numbers]
        offsets = np.where(walls >= 0, self._mean[walls], 0.0)
        beams = pose_update.Readings(
            scan.ranges,
            seen.ranges,
            may_meet.entered,
            np.empty(len(scan)),
            seen.row,
            columns,
            walls,
            offsets,
        )
        origins, directions, pose, laser, moving = seen.leaving
        pose_update.expect_objects(
            may_meet.used,
            beams,
            may_meet.objects,
            origins,
            directions,
            pose_update.evenly(len(scan)),
            pose,
            laser,
            moving,
            float(self._mean[self._laser(scan.laser) + BIAS]),
            covariance,
            self._densities(scan),
        )
        return beams

    def _shares(self, range_max: float) -> tuple[float, float, float]:
        """Probability of a hit, and densities, 1/m, of random and of short readings."""
        s = self._beams
        total = s.z_hit + s.z_short + s.z_max + s.z_rand
        random = max(s.z_rand / total / range_max, 1e-9)
        return s.z_hit / total, random, s.z_short / total * s.lambda_short

    def _learn_noise(self, laser: str, taken: _Taken) -> None:
        """Update the statistics of errors and of their correlations, with fading memory."""
        found, residuals = np.concatenate([taken.sums, np.zeros(4)]), taken.residuals
        before = self._residuals.get(laser, np.empty(0))
        pose_update.agreement(residuals, before, found[FIT:])
        self._residuals[laser] = residuals
        total = self._noise.get(laser, np.zeros(FIT + 4)) + found
        self._known_noise.pop(laser, None)
        fitted, together = np.minimum(LEARNT_BEAMS / np.maximum(total[[FIT - 1, -1]], 1.0), 1.0)
        self._noise[laser] = np.concatenate([fitted * total[:FIT], together * total[FIT:]])


class _Leaving(NamedTuple):
    """The origins and directions of beams, with the model's local shift."""

    origins: FloatArray  # (n, 2) m
    directions: FloatArray  # (n, 2)
    pose: FloatArray  # (3,) of the robot
    laser: FloatArray  # (2,) m, its place
    moving: FloatArray  # (3,) m/s, m/s, rad/s of the robot in the building


class _Met(NamedTuple):
    """The walls that beams meet."""

    ranges: FloatArray  # (n,) m, expected
    numbers: IntArray  # (n,) of the pieces
    row: FloatArray  # (n, 12) derivatives with respect to the state's columns
    leaving: _Leaving
    known: FloatArray  # (n,) m to known objects


class _MayMeet(NamedTuple):
    """What beams may meet that is no wall."""

    used: BoolArray  # (n,) the beams that matter
    entered: FloatArray  # (n,) m from which on something may stand
    objects: Scenery  # in some of their states


class _Taken(NamedTuple):
    """The posterior of the state after a scan."""

    told: IntArray  # (t,) columns of the state on which readings depend
    gain: FloatArray  # (m, t) what is subtracted for each error in these
    shift: FloatArray  # (m,) of the mean
    sums: FloatArray  # (10,) of the fit of ``RangeNoise``
    residuals: FloatArray  # (n,) in standard deviations

    def reduced(self, errors: FloatArray) -> FloatArray:
        """What remains of errors (m, ...) of the prior: (1 + prior information)^-1 errors."""
        return np.asarray(errors - self.gain @ errors[self.told])


def _independence(sums: FloatArray) -> Independence:
    """By sums (4,) of products with the previous scan and with neighbours, and of squares."""
    products, squares = sums[::2], sums[1::2]
    together = (products + FIRST_TOGETHER * FIRST_BEAMS) / (squares + FIRST_BEAMS)
    together = together.clip(0.0, MOST_TOGETHER)
    scans, beams = ((1.0 - together) / (1.0 + together)).tolist()
    return Independence(beams, scans)


def _heading(pose: FloatArray) -> tuple[float, float]:
    yaw = float(pose[2])
    return math.cos(yaw), math.sin(yaw)


def _first_sums(variance: float) -> FloatArray:
    """(9,) sums of one beam of a ``variance`` in m^2, at the ``FIRST_RANGES`` and slopes."""
    terms = np.stack([np.ones(3), FIRST_RANGES**2, FIRST_RANGES**2 * FIRST_SLOPES])
    products = (terms @ terms.T / 3.0)[UPPER]
    return np.concatenate([products, variance * terms.mean(axis=1)]) / variance**2
