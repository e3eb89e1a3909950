"""The walls as an occupancy grid, as maps of ROS are."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.building.model import Building
from objstate.building.outline import outline
from objstate.geometry import FloatArray
from objstate.recording.messages import MAP, header, make, plane_pose

GRID = "nav_msgs/msg/OccupancyGrid"
RESOLUTION = 0.05  # m, sides of a cell
MOST_CELLS = 4_000_000  # of larger buildings, cells are larger, lest the message fill the memory
MARGIN = 1  # cells around the outermost walls
FREE, OCCUPIED = 0, 100


def map_message(stamp_ns: int, building: Building, height: float) -> Any:
    """Which cells walls pass in the plane of a laser, at a height, m. Doors and furniture aren't in it."""
    segments = outline(building.walls, height)
    corner, cells, resolution = _grid(segments)
    rows, columns = cells.shape
    origin = plane_pose(np.array([*corner, 0.0]))
    load_time = make("builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    info = make(
        "nav_msgs/msg/MapMetaData",
        map_load_time=load_time,
        resolution=resolution,
        width=columns,
        height=rows,
        origin=origin,
    )
    return make(GRID, header=header(stamp_ns, MAP), info=info, data=cells.reshape(-1))


def _grid(segments: FloatArray) -> tuple[FloatArray, Any, float]:
    """Its lower left corner (2,) m, its cells (rows, columns), and their size, m."""
    if len(segments) == 0:
        return np.zeros(2), np.full((1, 1), FREE, dtype=np.int8), RESOLUTION
    lower, upper = segments.min(axis=(0, 1)), segments.max(axis=(0, 1))
    area = float(np.prod(upper - lower + 2 * RESOLUTION))
    resolution = max(RESOLUTION, float(np.sqrt(area / MOST_CELLS)))
    corner = (np.floor(lower / resolution) - MARGIN) * resolution
    width, height = np.ceil((upper - corner) / resolution).astype(int) + MARGIN
    cells = np.full((height, width), FREE, dtype=np.int8)
    along = segments[:, 1] - segments[:, 0]
    counts = np.ceil(2.0 * np.linalg.norm(along, axis=1) / resolution).astype(int) + 1
    of = np.repeat(np.arange(len(segments)), counts)
    number = np.arange(len(of)) - np.searchsorted(of, of)
    share = number / np.maximum(counts[of] - 1, 1)
    column, row = np.floor((segments[of, 0] + share[:, None] * along[of] - corner) / resolution).T
    cells[row.astype(int), column.astype(int)] = OCCUPIED
    return corner, cells, resolution
