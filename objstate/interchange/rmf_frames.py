"""Where the drawings of an Open-RMF building lie: metres, y to the left of x, levels one above another.

As rmf_building_map_tools has it, so that the result lies where its Gazebo world lies.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from objstate.errors import BuildingError
from objstate.geometry import FloatArray
from objstate.interchange.imported import Notes, several
from objstate.interchange.rmf_file import Level, RmfBuilding

SPREAD = 0.02  # difference of the scales of measurements from which on it is reported
ASTRAY = 0.1  # m by which the levels' common points may miss each other before it is said
REDRAW = "Draw a measurement there in traffic-editor, and give its length"


@dataclass(frozen=True)
class Frame:
    """A level's drawing in the building: turned, scaled and shifted, in complex numbers."""

    turn: complex  # rotation times scale, m per unit of the drawing
    shift: complex  # m
    flip: int  # -1 where y counts downwards, as in an image

    @property
    def scale(self) -> float:
        """Metres per unit of the drawing."""
        return abs(self.turn)

    def place(self, xy: tuple[float, float]) -> FloatArray:
        """A point of the drawing, (2,) m in the building."""
        there = self.turn * self.number(xy) + self.shift
        return np.array([there.real, there.imag])

    def number(self, xy: tuple[float, float]) -> complex:
        """A point of the drawing with y upwards."""
        return complex(xy[0], self.flip * xy[1])


def frames(building: RmfBuilding, source: str, notes: Notes) -> dict[str, Frame]:
    """The frame of each level. Raises BuildingError where the unit is unknown."""
    if building.coordinate_system == "cartesian_meters":
        notes.taken.append("Unit and axes: metres, y upwards, as the file says.")
        shift = -complex(*(_parameter(building, name) for name in ("offset_x", "offset_y")))
        return dict.fromkeys(building.levels, Frame(1.0, shift, 1))
    if building.coordinate_system != "reference_image":
        raise BuildingError(
            f"{source} has the coordinate system '{building.coordinate_system}', places on the "
            "globe; save it with cartesian_meters."
        )
    reference = building.reference_level_name or next(iter(building.levels))
    scale = _measured_scale(reference, building.levels[reference], notes)
    if scale is None:
        raise BuildingError(
            f"Level '{reference}' of {source} has no measurement, so the size of its pixels is "
            f"unknown. {REDRAW}."
        )
    known = {reference: Frame(scale, 0j, -1)}
    for name in building.levels:
        if name != reference:
            known[name] = _beside(building, name, reference, known[reference], notes, source)
    return known


def _parameter(building: RmfBuilding, name: str) -> float:
    value = building.parameters.get(name, 0.0)
    value = value[1] if isinstance(value, list) and len(value) == 2 else value
    return float(value) if isinstance(value, int | float) else 0.0


def _measured_scale(name: str, level: Level, notes: Notes) -> float | None:
    """Metres per pixel by a level's measurements, if it has any."""
    scales = []
    for edge in level.measurements:
        start, end = (complex(*level.vertices[at]) for at in (edge.start, edge.end))
        distance = edge.number("distance", 0.0)
        if distance <= 0 or start == end:
            notes.left.append(f"Level '{name}': a measurement without a length.")
            continue
        scales.append(distance / abs(end - start))
    if not scales:
        return None
    scale = float(np.mean(scales))
    notes.taken.append(
        f"Level '{name}': a pixel is {1000 * scale:.2f} mm, by "
        f"{several(len(scales), 'measurement')}; y of the drawing counts downwards."
    )
    if np.ptp(scales) > SPREAD * scale:
        notes.doubts.append(
            f"Level '{name}': by its measurements a pixel is {1000 * min(scales):.2f} to "
            f"{1000 * max(scales):.2f} mm; check which is wrong."
        )
    return scale


def _beside(
    building: RmfBuilding, name: str, reference: str, frame: Frame, notes: Notes, source: str
) -> Frame:
    """The frame of another level than the reference, by the points that both drawings show."""
    level = building.levels[name]
    there = {point.name: point for point in building.levels[reference].fiducials if point.name}
    pairs = [
        (frame.number((there[p.name].x, there[p.name].y)), frame.number((p.x, p.y)))
        for p in level.fiducials
        if p.name in there
    ]
    if len({a for a, _ in pairs}) < 2 or len({b for _, b in pairs}) < 2:
        scale = _measured_scale(name, level, notes)
        if scale is None:
            raise BuildingError(
                f"Level '{name}' of {source} has neither two fiducials in common with level "
                f"'{reference}' nor a measurement, so its place and size are unknown. {REDRAW}."
            )
        notes.doubts.append(
            f"Level '{name}' has no two fiducials in common with level '{reference}'; it may lie "
            "aside of it."
        )
        return Frame(scale, 0j, -1)
    found = _aligned(pairs, frame.scale)
    misses = [abs(found.turn * b + found.shift - frame.turn * a) for a, b in pairs]
    notes.taken.append(
        f"Level '{name}': laid over level '{reference}' by {len(pairs)} fiducials, which miss each "
        f"other by {100 * max(misses):.0f} cm at most; a pixel is {1000 * found.scale:.2f} mm."
    )
    if max(misses) > ASTRAY:
        notes.doubts.append(f"Level '{name}': its fiducials don't fit; check where they are.")
    return found


def _aligned(pairs: list[tuple[complex, complex]], scale: float) -> Frame:
    """The frame that lays the second points over the first, in whose drawing a unit is ``scale`` m."""
    sides = [
        (a1 - a0, b1 - b0) for (a0, b0), (a1, b1) in combinations(pairs, 2) if a0 != a1 and b0 != b1
    ]
    angle = np.angle(np.sum([a / b / abs(a / b) for a, b in sides]))
    larger = float(np.mean([abs(b) / abs(a) for a, b in sides]))
    turn = complex(np.exp(1j * angle)) * scale / larger
    shift = complex(np.mean([scale * a - turn * b for a, b in pairs]))
    return Frame(turn, shift, -1)
