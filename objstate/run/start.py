"""Checks of the robot's start against the building."""

from __future__ import annotations

import numpy as np

from objstate.building.model import Building
from objstate.errors import BuildingError, SettingsError
from objstate.estimator.start import checked_pose
from objstate.geometry import FloatArray
from objstate.run.options import RunOptions

# m from the walls; beyond any laser's range, so that a start there is a mistake
FARTHEST_START = 1000.0


def check_start(options: RunOptions, building: Building) -> None:
    """Refuse a start from which nothing can be localized.

    Raises SettingsError for a pose that is none or far from the building, BuildingError where
    there is no building to search.
    """
    if options.global_start and not len(building.walls.vertices):
        raise BuildingError(
            "--global needs walls to search between, and the building has none; give "
            "--initial-pose X,Y,YAW, or the root link some walls."
        )
    if options.initial_pose is None:
        return
    pose = checked_pose(options.initial_pose)
    if _distance(pose, building) > FARTHEST_START:
        raise SettingsError(
            f"The start {_place(pose)} is more than {FARTHEST_START:g} m away from the building, "
            f"{_span(building)}; give --initial-pose in metres, in the building's frame."
        )


def start_outside(pose: FloatArray, building: Building) -> str | None:
    """A warning where a pose (3,) lies outside of the building's walls."""
    if _distance(pose, building) == 0.0:
        return None
    return (
        f"The robot starts at {_place(pose)}, outside the building, {_span(building)}. Is the "
        "start given in the building's frame?"
    )


def _distance(pose: FloatArray, building: Building) -> float:
    """Distance, m, along x or y of a pose from the walls' bounding box.

    0 inside, or without walls.
    """
    if not len(building.walls.vertices):
        return 0.0
    low, high = _corners(building)
    return float(np.max(np.maximum(low - pose[:2], pose[:2] - high).clip(min=0.0)))


def _corners(building: Building) -> tuple[FloatArray, FloatArray]:
    corners = building.walls.vertices[:, :2]
    return corners.min(axis=0), corners.max(axis=0)


def _span(building: Building) -> str:
    low, high = _corners(building)
    return f"whose walls reach from {_place(low)} to {_place(high)}"


def _place(point: FloatArray) -> str:
    x, y = (round(float(value), 2) for value in point[:2])  # centimetres
    return f"({x:.8g}, {y:.8g}) m"
