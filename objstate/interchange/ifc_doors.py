"""Doors of an IFC file: how each of their panels moves, and where it is.

Source: ISO 16739-1, IfcDoor and IfcDoorTypeOperationEnum. A door lies in the plane of x and z of
its placement, from x = 0 to its overall width, and swings towards positive y. Left is the side of
x = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from objstate.building.door_table import Door
from objstate.building.leaves import hinged, sliding
from objstate.building.model import Mesh, MovableObject
from objstate.building.outline import outline
from objstate.building.shapes import Box
from objstate.geometry import FloatArray, transform

THICKNESS = 0.04  # m, of a panel without a known thickness
CUT = 0.3  # m above the threshold, where a panel's shape is cut
PARALLEL = 0.002  # m by which a face of a panel may leave the door's plane
LEAST = 0.6  # share of its nominal width that a panel has at least
SLIVER = 0.005  # m; linings no wider are none
WIDEST_SWING = np.pi / 2  # rad, as the format doesn't say how far a door opens
FORWARD, BACKWARD = 1, -1  # towards positive y, or negative


@dataclass(frozen=True)
class Panel:
    """How one panel moves, in the plan of its door."""

    side: Literal["left", "right"]  # where it hangs, or where it slides to
    swings: tuple[int, ...]  # the directions; none where it slides
    share: tuple[float, float]  # of the door's width, from where to where


def _single(side: Literal["left", "right"], *swings: int) -> tuple[Panel, ...]:
    return (Panel(side, swings, (0.0, 1.0)),)


def _double(left: tuple[int, ...], right: tuple[int, ...]) -> tuple[Panel, ...]:
    return Panel("left", left, (0.0, 0.5)), Panel("right", right, (0.5, 1.0))


_BOTH = (FORWARD, BACKWARD)
OPERATIONS = {
    "SINGLE_SWING_LEFT": _single("left", FORWARD),
    "SINGLE_SWING_RIGHT": _single("right", FORWARD),
    "DOUBLE_SWING_LEFT": _single("left", *_BOTH),
    "DOUBLE_SWING_RIGHT": _single("right", *_BOTH),
    "DOUBLE_DOOR_SINGLE_SWING": _double((FORWARD,), (FORWARD,)),
    "DOUBLE_DOOR_SINGLE_SWING_OPPOSITE_LEFT": _double((FORWARD,), (BACKWARD,)),
    "DOUBLE_DOOR_SINGLE_SWING_OPPOSITE_RIGHT": _double((BACKWARD,), (FORWARD,)),
    "DOUBLE_DOOR_DOUBLE_SWING": _double(_BOTH, _BOTH),
    "SLIDING_TO_LEFT": _single("left"),
    "SLIDING_TO_RIGHT": _single("right"),
    "DOUBLE_DOOR_SLIDING": _double((), ()),
}


@dataclass(frozen=True, eq=False)
class DoorShape:
    """One door as its file has it. Lengths in metres."""

    name: str
    width: float
    height: float
    place: FloatArray  # (4, 4) of its placement, on a floor at z = 0
    mesh: Mesh  # in its placement; may be empty
    left_share: float  # of the width, of the left panel of two


def panels_of(door: DoorShape, operation: str) -> tuple[list[MovableObject], Mesh]:
    """The panels of a door of an operation in ``OPERATIONS``, and what of its frame stands still."""
    panels = OPERATIONS[operation]
    if len(panels) == 2:
        panels = tuple(
            replace(p, share=(0.0, door.left_share) if p.side == "left" else (door.left_share, 1.0))
            for p in panels
        )
    cut = outline(door.mesh, CUT)
    spans = [_span(cut, panel, door.width) for panel in panels]
    leaves = [
        _leaf(door, panel, span, f"{door.name}_{panel.side}" if len(panels) > 1 else door.name)
        for panel, span in zip(panels, spans, strict=True)
    ]
    return leaves, _linings(door, spans, cut)


@dataclass(frozen=True)
class _Span:
    """Where a panel lies in the plan of its door, m."""

    start: float
    end: float
    middle: float  # y
    thickness: float


def _span(cut: FloatArray, panel: Panel, width: float) -> _Span:
    """A panel as its shape shows it: its faces along the door; nominal where it has none."""
    start, end = (share * width for share in panel.share)
    nominal = _Span(start, end, 0.0, THICKNESS)
    middle = (start + end) / 2
    low, high = cut[..., 0].min(axis=1), cut[..., 0].max(axis=1)
    is_face = (np.abs(cut[:, 0, 1] - cut[:, 1, 1]) < PARALLEL) & (low < middle) & (high > middle)
    if not is_face.any():
        return nominal
    ys = cut[is_face][..., 1]
    first, last = float(low[is_face].max()), float(high[is_face].min())  # a rebate may run on
    thickness = float(np.ptp(ys))
    if not LEAST * (end - start) <= last - first <= end - start + 2 * PARALLEL or thickness <= 0:
        return replace(nominal, middle=float(ys.mean()))
    return _Span(first, last, float(ys.mean()), thickness)


def _leaf(door: DoorShape, panel: Panel, span: _Span, name: str) -> MovableObject:
    """One panel, in the building."""
    ends = [(span.start, span.middle), (span.end, span.middle)]
    near, far = (_placed(door.place, end) for end in ends)
    if not panel.swings:
        start, end = (far, near) if panel.side == "left" else (near, far)
        return sliding(name, start, end, span.thickness, door.height)
    hinge, free = (near, far) if panel.side == "left" else (far, near)
    way = free - hinge
    # from the left hinge, the leaf lies along x: towards positive y is counter-clockwise
    sense = panel.swings[0] * (1 if panel.side == "left" else -1)
    bearing = float(np.arctan2(way[1], way[0]))
    row = Door(name, hinge, bearing, sense, float(np.hypot(*way)), WIDEST_SWING)
    leaf = hinged(row, span.thickness, door.height)
    return replace(leaf, lower=-WIDEST_SWING) if len(panel.swings) > 1 else leaf


def _placed(place: FloatArray, xy: tuple[float, float]) -> FloatArray:
    return np.asarray((place @ [*xy, 0.0, 1.0])[:2])


def _linings(door: DoorShape, spans: list[_Span], cut: FloatArray) -> Mesh:
    """Boxes between the panels and the ends of the door, as deep as its shape is there."""
    parts = []
    for start, end in (
        (0.0, min(s.start for s in spans)),
        (max(s.end for s in spans), door.width),
    ):
        points = cut.reshape(-1, 2)
        ys = points[(points[:, 0] >= start - SLIVER) & (points[:, 0] <= end + SLIVER), 1]
        if end - start <= SLIVER or len(ys) == 0 or np.ptp(ys) <= 0:
            continue
        middle = ((start + end) / 2, float(ys.min() + ys.max()) / 2, door.height / 2)
        box = Box((end - start, float(np.ptp(ys)), door.height)).mesh()
        parts.append(box.moved(door.place @ transform(np.eye(3), middle)))
    return Mesh.joined(parts)
