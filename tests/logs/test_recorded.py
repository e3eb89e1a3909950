"""The recorded data: every log is read whole, with the figures known of it."""

from pathlib import Path

import numpy as np
import pytest

from objstate.logs import open_log
from objstate.records import Scan

LOGS = {
    "wean-hall/run1.mcap": (713, 180, [0.25, 0, 0.3], "laser"),
    "wean-hall/run2.mcap": (2251, 180, [0.25, 0, 0.3], "laser"),
    "birmingham-p3dx/trace0.bag": (958, 726, [0.135, 0, 0.202], "laser"),
    "olin-ac109-neato/ac109_1_demo.bag": (553, 361, [-0.1016, 0, 0.0889], "base_laser_link"),
    "olin-mac-tb4/macfirst_floor_take_2": (355, 720, [0.0039, 0, 0.1395], "rplidar_link"),
    "fr079/freiburg-079-corrected.log.gz": (4791, 360, [0, 0, 0.3], "front_laser"),
}


@pytest.mark.parametrize("name", LOGS)
def test_every_log_is_read_whole(name: str, data: Path) -> None:
    count, beams, origin, laser = LOGS[name]
    scans, last_ns = [], 0
    log = open_log(data / name)
    for record in log:
        assert record.stamp_ns >= last_ns
        last_ns = record.stamp_ns
        if isinstance(record, Scan):
            scans.append(record)
    assert len(scans) == count
    assert log.share == 1.0
    assert {(len(scan), scan.laser) for scan in scans} == {(beams, laser)}
    np.testing.assert_allclose(scans[0].rays.origins[0], origin, atol=1e-3)
    assert all(np.isfinite(scan.odometry).all() for scan in scans)


def test_the_turned_laser_of_the_turtlebot(data: Path) -> None:
    scan = next(
        r for r in open_log(data / "olin-mac-tb4/macfirst_floor_take_2") if isinstance(r, Scan)
    )
    # beam 0 at -179 degrees, in a frame turned by 90
    np.testing.assert_allclose(scan.rays.directions[0], [0.01745, -0.99985, 0], atol=1e-4)


def test_the_recorded_cloud_is_a_belief(data: Path) -> None:
    log = open_log(data / "olin-ac109-neato/ac109_1_demo.bag")
    beliefs = [record for record in log if type(record).__name__ == "RobotBelief"]
    assert len(beliefs) == 486
    assert {record.poses.shape for record in beliefs} == {(100, 3)}
    assert log.counts["InitialPose"] == 1


def test_neighbouring_scans_of_fr079_agree_in_their_corrected_poses(data: Path) -> None:
    """Endpoints of a scan lie on those of the next when the poses fit the readings."""
    from scipy.spatial import cKDTree

    log = open_log(data / "fr079/freiburg-079-corrected.log.gz", end=120.0)
    scans = [record for record in log if isinstance(record, Scan)]
    distances = []
    for a, b in zip(scans[100:400:10], scans[101:401:10], strict=True):
        distance, _ = cKDTree(endpoints(a)).query(endpoints(b))
        distances.append(np.median(distance))
    assert np.median(distances) < 0.05


def endpoints(scan: Scan) -> np.ndarray:
    hit = np.isfinite(scan.ranges)
    points = scan.rays.directions[hit, :2] * scan.ranges[hit, None] + scan.rays.origins[hit, :2]
    x, y, yaw = scan.odometry
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    return points @ turn.T + [x, y]
