"""Leaves of doors as movable objects: boxes on a hinge or a rail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.building.door_table import Door
from objstate.building.model import Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.geometry import FloatArray, transform, transform_from_pose

UP, FORWARD = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def leaf_of_door(door: Door, thickness: float, height: float) -> MovableObject:
    """The leaf of a door of a table, of ``thickness`` and ``height``, m, on z = 0."""
    if not door.slides:
        return hinged(door, thickness, height)
    along = np.array([np.cos(door.closed_bearing), np.sin(door.closed_bearing)])
    edge = door.hinge + door.width * along
    return replace(sliding(door.name, edge, door.hinge, thickness, height), upper=door.upper)


def hinged(door: Door, thickness: float, height: float) -> MovableObject:
    """A leaf of ``thickness`` and ``height``, m, that stands on z = 0 and turns about its hinge.

    The leaf lies along x of its link, which is that of the joint while the door is closed.
    """
    return MovableObject(
        name=door.name,
        kind=Kind.HINGED,
        origin=transform_from_pose(np.array([*door.hinge, door.closed_bearing])),
        axis=np.array([0.0, 0.0, door.sense]),
        lower=0.0,
        upper=door.upper,
        mesh=_leaf(door.width, thickness, height),
    )


def sliding(
    name: str, start: FloatArray, end: FloatArray, thickness: float, height: float
) -> MovableObject:
    """A leaf that is closed from ``start`` to ``end``, (2,) m, and slides beyond ``end``."""
    way = end - start
    width = float(np.hypot(*way))
    return MovableObject(
        name=name,
        kind=Kind.SLIDING,
        origin=transform_from_pose(np.array([*start, np.arctan2(way[1], way[0])])),
        axis=np.array(FORWARD),
        lower=0.0,
        upper=width,
        mesh=_leaf(width, thickness, height),
    )


def _leaf(width: float, thickness: float, height: float) -> Mesh:
    middle = transform(np.eye(3), (width / 2, 0.0, height / 2))
    return Box((width, thickness, height)).mesh().moved(middle)
