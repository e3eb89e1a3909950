"""Doors of an Open-RMF level: an edge from v1 to v2 with a type.

A hinged door hangs at v1, and opens clockwise seen from above where its direction is 1. The second
leaf of a double door hangs at v2 and opens the other way. Sliding leaves move towards v1, the
second one towards v2. Sources: rmf_building_map_msgs/Door, and rmf_building_map_tools
(SwingDoor, DoubleSwingDoor, SlidingDoor, DoubleSlidingDoor).
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from objstate.building.door_table import WIDEST_LEAF, Door
from objstate.building.leaves import hinged, sliding
from objstate.building.model import Kind, MovableObject
from objstate.geometry import FloatArray
from objstate.interchange.imported import Notes, several
from objstate.interchange.rmf_file import Edge, Level
from objstate.interchange.rmf_frames import Frame

THICKNESS, HEIGHT = 0.03, 2.2  # m, of a leaf
NARROWEST = 0.3  # m, of a leaf that a scale can be right for
TYPES = ("hinged", "double_hinged", "sliding", "double_sliding")
DEFAULT_DEGREES = 90.0
FULL_TURN = 360.0  # degrees


def doors_of(name: str, level: Level, frame: Frame, notes: Notes) -> list[MovableObject]:
    """The leaves of a level's doors; each door that has none is named in the notes."""
    leaves: list[MovableObject] = []
    counts: Counter[str] = Counter()
    for number, edge in enumerate(level.doors):
        door = edge.text("name", "") or f"door_{number + 1}"
        kind = edge.text("type", "")
        ends = [frame.place(level.vertices[at]) for at in (edge.start, edge.end)]
        if fault := _fault(edge, kind, ends):
            notes.left.append(f"Level '{name}': door '{door}', as {fault}.")
            continue
        if edge.text("motion_axis", "start") == "end" and kind == "hinged":
            notes.doubts.append(
                f"Level '{name}': door '{door}' hangs at its end in traffic-editor's drawing, which is "
                "taken, but at its start in the Gazebo world made of it."
            )
        made = _leaves(door, kind, edge, ends)
        counts[kind] += 1
        leaves += made
        notes.doubts.extend(f"Level '{name}': {it}" for leaf in made for it in _doubts(leaf))
    if counts:
        listed = ", ".join(f"{count} {kind.replace('_', ' ')}" for kind, count in counts.items())
        notes.taken.append(f"Level '{name}': {several(sum(counts.values()), 'door')}: {listed}.")
    return leaves


def _fault(edge: Edge, kind: str, ends: list[FloatArray]) -> str | None:
    if kind not in TYPES:
        return f"its type '{kind}' is none of {', '.join(TYPES)}"
    if np.allclose(ends[0], ends[1], rtol=0, atol=1e-6):
        return "it has no width"
    degrees = abs(edge.number("motion_degrees", DEFAULT_DEGREES))
    if "hinged" in kind and not 0 < degrees < FULL_TURN:
        return f"it opens by {degrees:g} degrees"
    if edge.number("right_left_ratio", 1.0) <= 0:
        return f"the ratio of its leaves is {edge.number('right_left_ratio', 1.0):g}"
    return None


def _leaves(name: str, kind: str, edge: Edge, ends: list[FloatArray]) -> list[MovableObject]:
    v1, v2 = ends
    ratio = edge.number("right_left_ratio", 1.0)
    meet = v1 + (v2 - v1) * ratio / (1 + ratio)
    sense = -1 if edge.number("motion_direction", 1) > 0 else 1
    if kind == "hinged":
        hung, free = (v2, v1) if edge.text("motion_axis", "start") == "end" else (v1, v2)
        return [_hung(name, hung, free, sense, edge)]
    if kind == "double_hinged":
        return [
            _hung(f"{name}_right", v1, meet, sense, edge),
            _hung(f"{name}_left", v2, meet, -sense, edge),
        ]
    if kind == "sliding":
        return [sliding(name, v2, v1, THICKNESS, HEIGHT)]
    return [
        sliding(f"{name}_right", meet, v1, THICKNESS, HEIGHT),
        sliding(f"{name}_left", meet, v2, THICKNESS, HEIGHT),
    ]


def _hung(name: str, hinge: FloatArray, free: FloatArray, sense: int, edge: Edge) -> MovableObject:
    way = free - hinge
    door = Door(
        name=name,
        hinge=hinge,
        closed_bearing=float(np.arctan2(way[1], way[0])),
        sense=sense,
        width=float(np.hypot(*way)),
        upper=math.radians(abs(edge.number("motion_degrees", DEFAULT_DEGREES))),
    )
    return hinged(door, THICKNESS, HEIGHT)


def _doubts(leaf: MovableObject) -> list[str]:
    width = float(np.ptp(leaf.mesh.vertices[:, 0]))
    widest = WIDEST_LEAF if leaf.kind is Kind.HINGED else 2 * WIDEST_LEAF
    if NARROWEST <= width <= widest:
        return []
    return [f"door '{leaf.name}' is {width:.2f} m wide; check the level's measurements."]
