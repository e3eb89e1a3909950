"""What the drives saw: the beams of scans from places that differ, placed in the map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from objstate.building.model import Building
from objstate.discovery.nearby import Nearby
from objstate.errors import LogError
from objstate.geometry import FloatArray, IntArray, between, transform_from_pose
from objstate.records import NANOSECONDS, Scan
from objstate.run import RunOptions, open_run, unknown_start
from objstate.sensing import cast_from

SPACING, SPACING_YAW = 0.15, 0.2  # m, rad between scans that are kept: nearer ones tell the same
WELL_KNOWN = 0.15  # m: a pose less sure than this places no beams
LOCALIZED = 0.9  # probability of being where it seems, below which nothing is kept
CONFIRMED_S = 15.0  # s within which a robot that was found in a wrong place is found out to be lost

Progress = Callable[[float, float], None]  # share of all logs done, seconds of them done


@dataclass(frozen=True, eq=False)
class Beams:
    """Beams in the map's frame, scan after scan, in the order of each scan."""

    origins: FloatArray  # (n, 2) m
    directions: FloatArray  # (n, 2) unit vectors
    ranges: FloatArray  # (n,) m; inf: nothing up to the laser's reach
    reach: FloatArray  # (n,) m, of the laser
    scan: IntArray  # (n,) number of the scan, counted over all drives
    drive: IntArray  # (n,) number of the drive
    seconds: FloatArray  # (n,) s, when, in the clock of its drive

    def __len__(self) -> int:
        return len(self.ranges)

    def ends(self, index: IntArray) -> FloatArray:
        """(k, 2) m, where beams end that returned."""
        return np.asarray(self.origins[index] + self.ranges[index, None] * self.directions[index])

    @cached_property
    def readings(self) -> Readings:
        """Those that returned."""
        numbers = np.flatnonzero(np.isfinite(self.ranges))
        ends = self.ends(numbers)
        return Readings(numbers, ends, self.directions[numbers], Nearby.of(ends))

    @cached_property
    def scans(self) -> IntArray:
        """(scans + 1,) where each scan begins, and the number of beams."""
        return np.append(np.flatnonzero(np.diff(self.scan, prepend=-1)), len(self))

    @staticmethod
    def of(parts: Sequence[Beams]) -> Beams:
        """Those of parts as they are numbered; none of no part."""
        flat, numbers = np.empty((0, 2)), np.empty(0, dtype=np.int64)
        none = Beams(flat, flat, flat[:, 0], flat[:, 0], numbers, numbers, flat[:, 0])
        return Beams(
            *(np.concatenate([getattr(p, name) for p in (none, *parts)]) for name in NAMES)
        )

    @staticmethod
    def joined(parts: Sequence[Beams]) -> Beams:
        """Beams of several drives; their scans and drives are numbered on."""
        scans = drives = 0
        numbered = []
        for part in parts:
            numbered.append(replace(part, scan=part.scan + scans, drive=part.drive + drives))
            scans += int(part.scan.max(initial=-1)) + 1
            drives += int(part.drive.max(initial=-1)) + 1
        return Beams.of(numbered)


@dataclass(frozen=True, eq=False)
class Readings:
    """Where beams ended that returned."""

    numbers: IntArray  # (k,) of the beams
    ends: FloatArray  # (k, 2) m
    directions: FloatArray  # (k, 2) unit vectors
    nearby: Nearby  # of the ends


NAMES = tuple(Beams.__dataclass_fields__)


@dataclass(frozen=True, eq=False)
class Gathered:
    """What one drive saw."""

    beams: Beams  # none, where the robot was localized nowhere
    lost_share: float  # of the time in which there was a pose


def gather(
    log: Path, building: Building, run: RunOptions, on_progress: Progress | None = None
) -> Gathered:
    """The beams of one drive, localized in a building.

    Raises LogError where the robot's start is unknown.
    """
    records, estimator = open_run([log], building, run)
    kept: list[tuple[int, Beams]] = []
    last: dict[str, FloatArray] = {}
    began_ns: int | None = None
    seconds = 0.0
    for record in records:
        estimator.feed(record)
        robot = estimator.robot
        if not isinstance(record, Scan) or robot is None:
            continue
        began_ns = record.stamp_ns if began_ns is None else began_ns
        seconds = (record.stamp_ns - began_ns) / NANOSECONDS
        if on_progress is not None:
            on_progress(records.share, seconds)
        is_known = robot.position_std < WELL_KNOWN and estimator.p_localized > LOCALIZED
        if not is_known or not _is_elsewhere(last.get(record.laser), robot.mean):
            continue
        last[record.laser] = robot.mean
        kept.append((record.stamp_ns, _placed(record, robot.mean, seconds)))
    if estimator.robot is None:
        raise LogError(f"{log}: {unknown_start(records, run)}")
    lost = lost_or_unconfirmed(estimator.lost, kept[-1][0] if kept else 0)
    right = [part for ns, part in kept if not any(begin <= ns < end for begin, end in lost)]
    scans = [replace(part, scan=part.scan + number) for number, part in enumerate(right)]
    lost_ns = sum(end - begin for begin, end in lost)
    return Gathered(Beams.of(scans), lost_ns / NANOSECONDS / max(seconds, 1.0))


def lost_or_unconfirmed(lost: Sequence[tuple[int, int]], last_ns: int) -> Sequence[tuple[int, int]]:
    """Intervals ns in which the robot was lost, or may have been found in a wrong place.

    That it is elsewhere is found out later: not where the ``last_ns`` scan is near the end of these.
    """
    if lost and last_ns - lost[-1][1] < CONFIRMED_S * NANOSECONDS:
        return [*lost[:-1], (lost[-1][0], last_ns + 1)]
    return lost


def _is_elsewhere(before: FloatArray | None, pose: FloatArray) -> bool:
    if before is None:
        return True
    x, y, turn = between(before, pose)
    return bool(np.hypot(x, y) >= SPACING or abs(turn) >= SPACING_YAW)


def _placed(scan: Scan, pose: FloatArray, seconds: float) -> Beams:
    index = np.flatnonzero(scan.valid)
    origins, directions = cast_from(transform_from_pose(pose), scan.rays.take(index))
    level = np.hypot(directions[:, 0], directions[:, 1]).clip(min=1e-9)
    count = len(index)
    return Beams(
        origins=origins[:, :2],
        directions=directions[:, :2] / level[:, None],
        ranges=scan.ranges[index] * level,
        reach=np.full(count, scan.range_max) * level,
        scan=np.zeros(count, dtype=np.int64),
        drive=np.zeros(count, dtype=np.int64),
        seconds=np.full(count, seconds),
    )
