"""What a calibration needs of a log: odometry, some scans, and about where the robot was."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from objstate.calibration.motion import OdometryTrack
from objstate.calibration.options import CalibrationOptions
from objstate.calibration.walls import WallReader
from objstate.errors import LogError
from objstate.estimator import Estimator
from objstate.geometry import BoolArray, FloatArray, between
from objstate.records import Odometry, Record, Scan


@dataclass(frozen=True, eq=False)
class Gathered:
    """One drive, as far as a calibration needs it."""

    track: OdometryTrack
    scans: tuple[Scan, ...]
    poses: FloatArray  # (k, 3) about where the robot was at each scan, in the building
    beams: tuple[BoolArray, ...]  # (n,) of each scan, that meet walls from there

    def parts(self, count: int) -> list[Gathered]:
        """The drive in consecutive parts with equal numbers of scans."""
        bounds = np.linspace(0, len(self.scans), count + 1).round().astype(int).tolist()
        return [
            Gathered(
                self.track, self.scans[begin:end], self.poses[begin:end], self.beams[begin:end]
            )
            for begin, end in pairwise(bounds)
            if end > begin
        ]


class Gathering:
    """Follows an estimator, and keeps scans from places that differ.

    Where they are twice as many as are used, every other one is left out, and places have to differ
    twice as much from then on.
    """

    def __init__(self, options: CalibrationOptions) -> None:
        self._options, self._apart = options, 1.0
        self._odometry: dict[int, FloatArray] = {}
        self._kept: list[tuple[Scan, FloatArray]] = []
        self._latest: dict[str, FloatArray] = {}

    def note(self, record: Record, estimator: Estimator) -> None:
        """A record that the estimator was fed with."""
        if isinstance(record, Odometry):
            self._odometry[record.stamp_ns] = record.pose
        if not isinstance(record, Scan):
            return
        robot, limit = estimator.robot, estimator.settings.object_updates.max_position_std
        if robot is None or record.odometry is None or robot.position_std > limit:
            return
        if self._is_elsewhere(self._latest.get(record.laser), record.odometry):
            self._latest[record.laser] = record.odometry
            self._kept.append((record, robot.mean))
        if len(self._kept) > 2 * self._options.most_scans:
            self._kept, self._apart = self._kept[::2], 2.0 * self._apart

    def gathered(self, reader: WallReader) -> Gathered:
        """The drive so far, by those scans that fit the walls.

        Whether a scan fits is judged here, and not by the estimator's lost stretches: with a laser
        that is askew, and a late clock in a turn, a robot may look lost that isn't. Raises LogError
        where the robot was localized nowhere.
        """
        most = self._options.most_scans
        on_walls = [reader.beams_on_walls(scan, pose) for scan, pose in self._kept]
        kept = [
            (scan, pose, beams)
            for (scan, pose), beams in zip(self._kept, on_walls, strict=True)
            if reader.fits(scan, pose, beams)
        ]
        if len(self._odometry) < 2 or not kept:
            raise LogError(
                "The robot was localized nowhere in the log, so its lasers can't be calibrated; see "
                "with `objstate estimate` what is wrong."
            )
        chosen = np.unique(np.linspace(0, len(kept) - 1, min(most, len(kept))).round().astype(int))
        stamps = np.array(sorted(self._odometry), dtype=np.int64)
        poses = np.array([self._odometry[stamp] for stamp in stamps.tolist()])
        return Gathered(
            track=OdometryTrack(stamps, poses),
            scans=tuple(kept[k][0] for k in chosen),
            poses=np.array([kept[k][1] for k in chosen]),
            beams=tuple(kept[k][2] for k in chosen),
        )

    def _is_elsewhere(self, before: FloatArray | None, odometry: FloatArray) -> bool:
        if before is None:
            return True
        x, y, turn = between(before, odometry)
        options, apart = self._options, self._apart
        is_far = np.hypot(x, y) >= apart * options.spacing
        return bool(is_far or abs(turn) >= apart * options.spacing_yaw)


def gather(
    records: Iterable[Record],
    estimator: Estimator,
    options: CalibrationOptions,
    on_scan: Callable[[Scan], None] | None = None,
) -> Gathered:
    """Localize along the records, and keep scans from places that differ, where they fit the walls.

    Raises LogError where the robot was localized nowhere.
    """
    gathering = Gathering(options)
    for record in records:
        estimator.feed(record)
        if on_scan is not None and isinstance(record, Scan):
            on_scan(record)
        gathering.note(record, estimator)
    return gathering.gathered(WallReader.of(estimator, options))
