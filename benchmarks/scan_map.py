"""A map made of a log's own scans, by counting where beams end and where they pass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from objstate.geometry import FloatArray, transform_from_pose
from objstate.records import Scan
from objstate.sensing import cast_from

CELL = 0.05  # m
MARGIN = 12.0  # m about the robot's way that the map covers
REACH = 12.0  # m up to which beams count
HITS, SHARE = 3, 0.15  # beams that end in a wall, and their share of those that come by


def write_map(scans: list[Scan], folder: Path, hits_of_a_wall: int = HITS) -> Path:
    """An occupancy grid by counting where beams end and where they pass; the path of its YAML.

    A wall is where at least ``hits_of_a_wall`` beams end. The scans' odometry is where they were taken from.
    """
    poses = np.array([scan.odometry for scan in scans])
    corner = poses[:, :2].min(axis=0) - MARGIN
    shape = np.ceil((poses[:, :2].max(axis=0) + MARGIN - corner) / CELL).astype(int)
    hits, passed = np.zeros(shape), np.zeros(shape)
    for scan in scans:
        returned = np.isfinite(scan.ranges) & (scan.ranges < REACH)
        origins, directions = cast_from(
            transform_from_pose(scan.odometry), scan.rays.take(returned)
        )
        ranges = scan.ranges[returned]
        count(hits, origins[:, :2] + directions[:, :2] * ranges[:, None], corner)
        for step in np.arange(CELL, REACH, CELL):
            beams = step < ranges - 2.0 * CELL
            count(passed, origins[beams, :2] + directions[beams, :2] * step, corner)
    image = np.full(shape, 205, dtype=np.uint8)
    image[passed > 2] = 254
    image[(hits >= hits_of_a_wall) & (hits > SHARE * (hits + passed / 2.0))] = 0
    rows = np.ascontiguousarray(image.T[::-1])
    (folder / "map.pgm").write_bytes(f"P5 {shape[0]} {shape[1]} 255\n".encode() + rows.tobytes())
    about = {
        "image": "map.pgm",
        "resolution": CELL,
        "origin": [*corner.tolist(), 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    (folder / "map.yaml").write_text(yaml.safe_dump(about))
    return folder / "map.yaml"


def count(grid: FloatArray, points: FloatArray, corner: FloatArray) -> None:
    """Add one to the cells of a grid (w, h) in which points (n, 2) lie."""
    cells = np.floor((points - corner) / CELL).astype(int)
    inside = ((cells >= 0) & (cells < grid.shape)).all(axis=1)
    np.add.at(grid, tuple(cells[inside].T), 1.0)


def ends_of(scan: Scan) -> FloatArray:
    """Where the beams of a scan end (n, 2), as its corrected pose has it."""
    origins, directions = cast_from(
        transform_from_pose(scan.odometry), scan.rays.take(np.isfinite(scan.ranges))
    )
    returned = scan.ranges[np.isfinite(scan.ranges), None]
    return origins[:, :2] + returned * directions[:, :2]
