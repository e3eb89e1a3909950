"""Open-RMF buildings as objstate's: walls, doors and lifts of each level.

Sizes that the file doesn't state are those of the world that rmf_building_map_tools makes of it.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from objstate.building.from_map import extrude
from objstate.building.model import Building, MovableObject
from objstate.building.sidecar import sidecar_of_drawing
from objstate.geometry import FloatArray
from objstate.interchange.imported import (
    Imported,
    Notes,
    file_name,
    several,
    tell_renamed,
    unused_name,
)
from objstate.interchange.rmf_doors import doors_of
from objstate.interchange.rmf_file import Level, RmfBuilding, read_rmf
from objstate.interchange.rmf_frames import Frame, frames
from objstate.interchange.rmf_lifts import lifts_of
from objstate.interchange.rmf_walls import WALL_THICKNESS

WALL_HEIGHT = 2.5  # m
OPAQUE = 1.0


def import_rmf(path: Path) -> Imported:
    """The levels of a ``building.yaml``. Raises BuildingError for a file that can't be used."""
    source = read_rmf(path)
    notes = Notes()
    places = frames(source, str(path), notes)
    title = path.name.removesuffix(path.suffix).removesuffix(".building")
    floors = {name: _floor(source, title, name, places, notes) for name in source.levels}
    _tell_levels(source, notes)
    sidecars = {name: sidecar_of_drawing(places[name].scale) for name in source.levels}
    return Imported(floors, notes, sidecars)


def _floor(
    source: RmfBuilding, title: str, name: str, places: dict[str, Frame], notes: Notes
) -> Building:
    level, frame = source.levels[name], places[name]
    cabins, lift_doors = lifts_of(source, name, places, notes)
    walls = extrude([*_wall_outlines(level, frame), *cabins], WALL_HEIGHT)
    objects: dict[str, MovableObject] = {}
    for item in [*doors_of(name, level, frame, notes), *lift_doors]:
        own = unused_name(item.name, objects)
        tell_renamed(notes, item.name, own)
        objects[own] = replace(item, name=own)
    _tell_walls(name, level, notes)
    called = title if len(source.levels) == 1 else file_name(f"{title}_{name}")
    return Building(called, walls, objects)


def _wall_outlines(level: Level, frame: Frame) -> list[FloatArray]:
    """Closed polygons (m, 2) about all walls, which are joined where they meet.

    A wall ends square half its thickness beyond its last vertex, except at a door.
    """
    from shapely import LineString, unary_union

    at_doors = {vertex for door in level.doors for vertex in (door.start, door.end)}
    shapes = []
    for edge in level.walls:
        ends = [frame.place(level.vertices[at]) for at in (edge.start, edge.end)]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        if length == 0:
            continue
        beyond = (ends[1] - ends[0]) * WALL_THICKNESS / 2 / length
        start = ends[0] - beyond * (edge.start not in at_doors)
        end = ends[1] + beyond * (edge.end not in at_doors)
        shapes.append(LineString([start, end]).buffer(WALL_THICKNESS / 2, cap_style="flat"))
    joined = unary_union(shapes)
    rings = [
        ring
        for part in getattr(joined, "geoms", [joined])
        if not part.is_empty
        for ring in (part.exterior, *part.interiors)
    ]
    return [np.asarray(ring.coords)[:-1] for ring in rings]


def _tell_walls(name: str, level: Level, notes: Notes) -> None:
    notes.taken.append(
        f"Level '{name}': {several(len(level.walls), 'wall')}, {WALL_THICKNESS:g} m thick and "
        f"{WALL_HEIGHT:g} m high."
    )
    clear = sum(edge.number("alpha", OPAQUE) < OPAQUE for edge in level.walls)
    if clear:
        notes.doubts.append(
            f"Level '{name}': {several(clear, 'wall')} can be seen through (alpha below 1); lasers "
            "may not see glass."
        )


def _tell_levels(source: RmfBuilding, notes: Notes) -> None:
    for name, level in source.levels.items():
        if level.models:
            kinds = Counter(model.model_name.rpartition("/")[2] for model in level.models)
            listed = ", ".join(f"{kind} ({count})" for kind, count in kinds.most_common())
            notes.left.append(f"Level '{name}': {several(len(level.models), 'model')}: {listed}.")
        for kind in ("lanes", "floors", "holes"):
            if items := getattr(level, kind):
                notes.left.append(f"Level '{name}': {several(len(items), kind[:-1])}.")
