"""Where the cells of a grid lie in the building."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from objstate.errors import GridError
from objstate.geometry import BoolArray, FloatArray, between, compose

MOST_CELLS = 100_000_000  # 1.6 GB of count cells; 500 m by 500 m at 5 cm


@dataclass(frozen=True, eq=False)
class Layout:
    """Rows and columns of square cells. Cell [row, column] counts from the lower left corner.

    ``origin`` is the pose of that corner in ``frame``, as in ``nav_msgs/OccupancyGrid``. A point in
    cells is ``(column, row)``, and cell [r, c] covers columns c to c + 1 and rows r to r + 1.
    Raises GridError for sizes, poses or numbers of cells that can't be used.
    """

    resolution: float  # m, side of a cell
    rows: int
    columns: int
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))  # (3,) x m, y m, yaw rad
    frame: str = "map"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise GridError(
                f"A grid can't have cells of {self.resolution:g} m; give a resolution above 0 m."
            )
        origin = np.asarray(self.origin, dtype=float)
        if origin.shape != (3,) or not np.isfinite(origin).all():
            raise GridError(
                f"The origin of a grid is {origin.tolist()}; give three finite numbers: x m, y m, "
                "yaw rad."
            )
        if self.rows < 1 or self.columns < 1:
            raise GridError(
                f"A grid can't have {self.rows} rows and {self.columns} columns; give at least one "
                "of either."
            )
        if self.rows * self.columns > MOST_CELLS:
            width, height = self.columns * self.resolution, self.rows * self.resolution
            raise GridError(
                f"A grid of {width:.4g} m by {height:.4g} m in cells of {self.resolution:g} m has "
                f"{self.rows * self.columns:.3g} cells, more than {MOST_CELLS:.0e}; give a smaller "
                "extent or a coarser resolution."
            )
        object.__setattr__(self, "origin", origin)

    @classmethod
    def around(cls, points: FloatArray, resolution: float, margin: float = 0.0) -> Layout:
        """The smallest layout that covers points (n, 2) m and a margin, m, about them."""
        if not len(points) or not np.isfinite(points).all():
            raise GridError("A grid can't be laid around no points, or ones that are not finite.")
        if not (math.isfinite(resolution) and resolution > 0.0):
            raise GridError(
                f"A grid can't have cells of {resolution:g} m; give a resolution above 0 m."
            )
        low = np.floor((points.min(axis=0) - margin) / resolution)
        columns, rows = np.maximum(np.ceil((points.max(axis=0) + margin) / resolution) - low, 1.0)
        origin = np.append(low * resolution, 0.0)
        return cls(resolution, int(rows), int(columns), origin)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows, self.columns

    @property
    def size(self) -> int:
        """The number of cells."""
        return self.rows * self.columns

    def to_cells(self, points: FloatArray) -> FloatArray:
        """Points (..., 2) in cells (column, row) from points (..., 2) m in the frame."""
        cos, sin = math.cos(self.origin[2]), math.sin(self.origin[2])
        x, y = points[..., 0] - self.origin[0], points[..., 1] - self.origin[1]
        return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1) / self.resolution

    def to_frame(self, cells: FloatArray) -> FloatArray:
        """Points (..., 2) m in the frame from points (..., 2) in cells (column, row)."""
        cos, sin = math.cos(self.origin[2]), math.sin(self.origin[2])
        column, row = cells[..., 0] * self.resolution, cells[..., 1] * self.resolution
        x, y = cos * column - sin * row, sin * column + cos * row
        return np.stack([x + self.origin[0], y + self.origin[1]], axis=-1)

    def centres(self) -> FloatArray:
        """(rows, columns, 2) m the middle of each cell in the frame."""
        column, row = np.meshgrid(np.arange(self.columns) + 0.5, np.arange(self.rows) + 0.5)
        return self.to_frame(np.stack([column, row], axis=-1))

    def within(self, cells: FloatArray) -> BoolArray:
        """(...) which points (..., 2) in cells (column, row) lie on the grid."""
        column, row = cells[..., 0], cells[..., 1]
        return np.asarray((column >= 0) & (column < self.columns) & (row >= 0) & (row < self.rows))

    def same_cells(self, other: Layout) -> bool:
        """Whether both have the same cells at the same places."""
        turn = between(self.origin, other.origin)
        return (
            self.shape == other.shape
            and math.isclose(self.resolution, other.resolution)
            and bool(np.abs(turn[:2]).max() < 1e-6 * self.resolution)
            and abs(turn[2]) * max(self.shape) < 1e-6
        )

    def seen_from(self, pose: FloatArray, frame: str) -> Layout:
        """The same cells in another frame, in which this one's lies at a pose (3,)."""
        return Layout(self.resolution, self.rows, self.columns, compose(pose, self.origin), frame)

    def require_frame(self, frame: str) -> None:
        """Raises GridError if something is given in another frame than that of the grid."""
        if frame != self.frame:
            raise GridError(
                f"The grid lies in frame '{self.frame}', what is put into it in '{frame}'; "
                "transform it first."
            )
