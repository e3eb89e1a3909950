"""Scans are registered to the walls that all of them show, so that they agree about the rest.

The filter knows a pose to a centimetre or two, while what a look tells of a leaf is as sure as a
hundred readings of 2 cm noise. So lines and poses are adjusted in turns: lines to all readings
(``walls.fitted``), then each scan's pose to the lines by weighted least squares, point to line
(Chen and Medioni 1992), about the filter's pose.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.discovery.gathering import Beams
from objstate.discovery.walls import WallLine, fitted, on_lines
from objstate.geometry import FloatArray

ROUNDS = 3
PLACE_STD, TURN_STD = 0.02, np.radians(0.3)  # m, rad: of a scan's pose, as the filter has it
READING_STD = 0.02  # m, of a reading about its wall
OUTLIER = 0.04  # m, from a wall on at which a reading counts by half
TOLD = 100.0  # readings of a scan that tell something of their own


def registered(lines: list[WallLine], beams: Beams) -> tuple[list[WallLine], Beams]:
    """Lines and beams that agree."""
    lines = fitted(lines, beams)
    for _ in range(ROUNDS):
        beams = _to_lines(lines, beams)
        lines = fitted(lines, beams)
    return lines, beams


def _to_lines(lines: list[WallLine], beams: Beams) -> Beams:
    """The beams with each scan's pose fitted to the lines."""
    index, of, aside = on_lines(lines, beams, 3.0 * OUTLIER)
    normals = np.array([line.normal for line in lines])[of]
    scan = beams.scan[index]
    reach = beams.ranges[index, None] * beams.directions[index]
    slopes = np.column_stack([normals, normals[:, 1] * reach[:, 0] - normals[:, 0] * reach[:, 1]])
    weights = 1.0 / (1.0 + (aside / OUTLIER) ** 2) / READING_STD**2
    counts = np.bincount(scan, minlength=int(beams.scan.max()) + 1)
    weights *= np.minimum(TOLD / np.maximum(counts, 1), 1.0)[scan]
    information = np.zeros((len(counts), 3, 3)) + np.diag(
        1.0 / np.square([PLACE_STD, PLACE_STD, TURN_STD])
    )
    np.add.at(information, scan, weights[:, None, None] * slopes[:, :, None] * slopes[:, None, :])
    pull = np.zeros((len(counts), 3))
    np.add.at(pull, scan, (weights * aside)[:, None] * slopes)
    by = -np.linalg.solve(information, pull[..., None])[..., 0]
    return _moved(beams, np.asarray(by, dtype=float))


def _moved(beams: Beams, by: FloatArray) -> Beams:
    """The beams of scans that were moved (s, 3) in x and y, and turned about their lasers."""
    x, y, turn = by[beams.scan].T
    cos, sin = np.cos(turn), np.sin(turn)
    a, b = beams.directions.T
    directions = np.column_stack([cos * a - sin * b, sin * a + cos * b])
    return replace(beams, origins=beams.origins + np.column_stack([x, y]), directions=directions)
