"""Which scans a run keeps for pictures, and how much of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.geometry import FloatArray
from objstate.recording.scans import ScanWriter, read_scans
from objstate.records import Odometry, Rays, Scan
from objstate.run.scans import MOST_ENDS, SPACING, ScanRecorder, ends_of, thinned

SECOND = 10**9


def scan(seconds: float, laser: str = "laser", ranges: FloatArray | None = None) -> Scan:
    measured = np.full(360, 2.0) if ranges is None else ranges
    bearings = np.linspace(-np.pi, np.pi, len(measured))
    directions = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(measured))])
    origins = np.tile([0.3, 0.0, 0.4], (len(measured), 1))
    return Scan(int(seconds * SECOND), laser, measured, Rays(origins, directions), 0.1, 8.0)


def test_ends_lie_in_the_frame_of_the_robot() -> None:
    assert ends_of(scan(0.0)) - [0.3, 0.0] == pytest.approx(2.0 * scan(0.0).rays.directions[:, :2])


def test_beams_that_returned_nothing_have_no_end() -> None:
    ranges = np.array([1.0, np.inf, np.nan, 2.0, np.inf])
    assert len(ends_of(scan(0.0, ranges=ranges))) == 2


def test_a_scan_a_second_of_each_laser_is_kept(tmp_path: Path) -> None:
    with ScanWriter(tmp_path) as writer:
        recorder = ScanRecorder(writer)
        for k in range(40):
            for laser in ("front", "rear"):
                recorder.note(scan(k / 10, laser), None, [])  # type: ignore[arg-type]
            recorder.note(Odometry(k, np.zeros(3)), None, [])  # type: ignore[arg-type]
    kept = read_scans(tmp_path)
    assert kept.group_by("laser").len()["len"].to_list() == [4, 4]
    assert (np.diff(kept["stamp"].unique().sort()) >= SECOND).all()


@pytest.mark.parametrize("count", [0, 1, 5, 1000])
@pytest.mark.parametrize("radius", [0.3, 3.0, 100.0])
def test_what_is_kept_is_small_and_spread_over_all(count: int, radius: float) -> None:
    bearings = np.linspace(0.0, 6.0, count)
    ends = radius * np.column_stack([np.cos(bearings), np.sin(bearings)])
    kept = thinned(ends)
    assert len(kept) <= MOST_ENDS
    assert (np.diff(kept) > 0).all()
    if count:
        farthest = np.linalg.norm(ends[:, None] - ends[kept], axis=2).min(axis=1).max()
        assert farthest <= max(1.5 * SPACING, 6.0 * radius / MOST_ENDS)
