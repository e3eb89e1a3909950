"""The walls, and what a run mapped, as occupancy grids, as maps of ROS are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from objstate.building.model import Building
from objstate.building.outline import outline
from objstate.geometry import FloatArray
from objstate.grid import Layout
from objstate.recording.messages import MAP, header, make, plane_pose

GRID = "nav_msgs/msg/OccupancyGrid"
RESOLUTION = 0.05  # m, sides of a cell
MOST_CELLS = 4_000_000  # of larger buildings, cells are larger, lest the message fill the memory
MARGIN = 1  # cells around the outermost walls
FREE, OCCUPIED, UNKNOWN = 0, 100, -1
NOTHING = 0.5  # the probability where nothing is known


def map_message(stamp_ns: int, building: Building, height: float) -> Any:
    """The cells that walls pass in a laser's plane at a height, m, without movable objects."""
    segments = outline(building.walls, height)
    corner, cells, resolution = _grid(segments)
    return _message(stamp_ns, cells, resolution, np.array([*corner, 0.0]))


def grid_message(stamp_ns: int, values: NDArray[np.float32], layout: Layout) -> Any:
    """Probabilities (rows, columns) of being occupied, in percent; -1 where nothing is known."""
    percent = np.rint(OCCUPIED * values).astype(np.int8)
    percent[values == np.float32(NOTHING)] = UNKNOWN
    return _message(stamp_ns, percent, layout.resolution, layout.origin)


def _message(stamp_ns: int, cells: NDArray[np.int8], resolution: float, origin: FloatArray) -> Any:
    """Cells (rows, columns) whose lower left corner lies at ``origin`` (3,)."""
    load_time = make("builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    info = make(
        "nav_msgs/msg/MapMetaData",
        map_load_time=load_time,
        resolution=resolution,
        width=cells.shape[1],
        height=cells.shape[0],
        origin=plane_pose(origin),
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
