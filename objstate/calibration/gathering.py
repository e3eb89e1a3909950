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
from objstate.geometry import FloatArray, between
from objstate.records import Odometry, Record, Scan


@dataclass(frozen=True, eq=False)
class Gathered:
    """One drive, as far as a calibration needs it."""

    track: OdometryTrack
    scans: tuple[Scan, ...]
    poses: FloatArray  # (k, 3) about where the robot was at each scan, in the building

    def parts(self, count: int) -> list[Gathered]:
        """The drive in consecutive parts with equal numbers of scans."""
        bounds = np.linspace(0, len(self.scans), count + 1).round().astype(int).tolist()
        return [
            Gathered(self.track, self.scans[begin:end], self.poses[begin:end])
            for begin, end in pairwise(bounds)
            if end > begin
        ]


def gather(
    records: Iterable[Record],
    estimator: Estimator,
    options: CalibrationOptions,
    on_scan: Callable[[Scan], None] | None = None,
) -> Gathered:
    """Localize along the records, and keep scans from places that differ, where they fit the walls.

    Whether a scan fits is judged here, and not by the estimator's lost stretches: with a laser
    that is askew, and a late clock in a turn, a robot may look lost that isn't.

    Raises LogError where the robot was localized nowhere.
    """
    odometry: dict[int, FloatArray] = {}
    kept: list[tuple[Scan, FloatArray]] = []
    latest: dict[str, FloatArray] = {}
    limit = estimator.settings.object_updates.max_position_std
    for record in records:
        estimator.feed(record)
        if isinstance(record, Odometry):
            odometry[record.stamp_ns] = record.pose
        if not isinstance(record, Scan):
            continue
        if on_scan is not None:
            on_scan(record)
        robot = estimator.robot
        if robot is None or record.odometry is None or robot.position_std > limit:
            continue
        if _is_elsewhere(latest.get(record.laser), record.odometry, options):
            latest[record.laser] = record.odometry
            kept.append((record, robot.mean))
    reader = WallReader(estimator.building, estimator.settings, options)
    kept = [(scan, pose) for scan, pose in kept if reader.fits(scan, pose)]
    if len(odometry) < 2 or not kept:
        raise LogError(
            "The robot was localized nowhere in the log, so its lasers can't be calibrated; see "
            "with `objstate estimate` what is wrong."
        )
    return _gathered(odometry, kept, options.most_scans)


def _gathered(
    odometry: dict[int, FloatArray], kept: list[tuple[Scan, FloatArray]], most: int
) -> Gathered:
    chosen = np.unique(np.linspace(0, len(kept) - 1, min(most, len(kept))).round().astype(int))
    stamps = np.array(sorted(odometry), dtype=np.int64)
    return Gathered(
        track=OdometryTrack(stamps, np.array([odometry[stamp] for stamp in stamps.tolist()])),
        scans=tuple(kept[k][0] for k in chosen),
        poses=np.array([kept[k][1] for k in chosen]),
    )


def _is_elsewhere(
    before: FloatArray | None, odometry: FloatArray, options: CalibrationOptions
) -> bool:
    if before is None:
        return True
    x, y, turn = between(before, odometry)
    return bool(np.hypot(x, y) >= options.spacing or abs(turn) >= options.spacing_yaw)
