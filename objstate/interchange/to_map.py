"""A building as a ROS occupancy map: what a level laser sees of it, in cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from objstate.building.model import Building
from objstate.building.outline import outline, wall_outline
from objstate.errors import BuildingError
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.interchange.imported import Notes, several
from objstate.recording.grids import write_map

MARGIN = 1.0  # m around the building
NARROW = 0.3  # m: an enclosed space that is nowhere wider is the inside of a wall; no robot fits in
MOST_CELLS = 100_000_000  # of a map that can be handled
FREE, UNKNOWN, OCCUPIED = 0.0, 0.5, 1.0


def write_occupancy(
    out: Path,
    building: Building,
    height: float,
    resolution: float,
    with_objects: bool,
    notes: Notes,
) -> None:
    """Write ``NAME.yaml`` and ``NAME.pgm`` to a folder: walls, and what is outside as unknown.

    The cells through which walls pass at ``height`` m are occupied, as a laser marks them.
    """
    walls = wall_outline(building.walls, height)
    objects = [
        outline(item.mesh, height, item.transforms(item.home[None])[0])
        for item in building.objects.values()
    ]
    everything = np.concatenate([walls, *objects])
    low = np.floor((everything.reshape(-1, 2).min(axis=0) - MARGIN) / resolution) * resolution
    size = np.ceil((everything.reshape(-1, 2).max(axis=0) + MARGIN - low) / resolution).astype(int)
    if size.prod() > MOST_CELLS:
        raise BuildingError(
            f"The map would have {size.prod():.3g} cells of {resolution:g} m; give a coarser resolution."
        )
    barrier = _passed(everything, low, resolution, size)
    occupied = _with_insides(_passed(walls, low, resolution, size), resolution)
    if with_objects:
        occupied |= barrier
    values = np.where(_reached_from_outside(barrier, resolution), UNKNOWN, FREE)
    values[occupied] = OCCUPIED
    write_map(out, values.astype(np.float32), resolution, np.array([*low, 0.0]), building.name)
    notes.taken.append(
        f"Walls at {height:g} m, in {size[0]} by {size[1]} cells of {resolution:g} m."
    )
    told = f"{several(len(objects), 'object')}, as they stand in the model"
    if objects:
        (notes.taken if with_objects else notes.left).append(f"{told}.")


def _passed(segments: FloatArray, low: FloatArray, resolution: float, size: IntArray) -> BoolArray:
    """(rows, columns) the cells through which segments (k, 2, 2) pass."""
    grid = np.zeros((size[1], size[0]), dtype=bool)
    ends = (segments - low) / resolution
    steps = np.ceil(4 * np.abs(ends[:, 1] - ends[:, 0]).max(axis=1)).astype(int) + 1
    which = np.repeat(np.arange(len(ends)), steps)
    place = np.arange(len(which)) - np.repeat(np.cumsum(steps) - steps, steps)
    share = place / np.maximum(steps - 1, 1)[which]
    points = ends[which, 0] + share[:, None] * (ends[which, 1] - ends[which, 0])
    columns, rows = np.floor(points).astype(int).T
    grid[rows, columns] = True
    return grid


def _with_insides(walls: BoolArray, resolution: float) -> BoolArray:
    """The walls, with what their faces enclose."""
    from scipy import ndimage

    spaces, count = ndimage.label(~walls)
    if count == 0:
        return walls
    clearance = ndimage.distance_transform_edt(~walls) * resolution
    widest = 2 * ndimage.maximum(clearance, spaces, np.arange(count + 1))
    return np.asarray(walls | (widest <= NARROW)[spaces] & (spaces > 0))


def _reached_from_outside(barrier: BoolArray, resolution: float) -> BoolArray:
    """The cells that are outside of all walls and closed doors; none if there is no inside."""
    from scipy import ndimage

    spaces, count = ndimage.label(~barrier)
    outside = spaces == spaces[0, 0]
    inside = ~outside & ~barrier
    clearance = ndimage.distance_transform_edt(inside) * resolution
    has_inside = count > 1 and 2 * clearance.max() > NARROW
    return np.asarray(outside if has_inside else np.zeros_like(outside))
