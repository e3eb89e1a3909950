"""Writes the example buildings: corridor, office and hotel, each as NAME/NAME.urdf.

It also writes those of the paper's experiments, to objstate/experiments/schulz2001/.

Run `python models/make.py` after changing a measure. Metres, radians, z up; the
frame's x axis runs along the corridor, its origin lies in the middle of the west end.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as Xml

HERE = Path(__file__).parent
SCHULZ_2001 = HERE.parent / "objstate" / "experiments" / "schulz2001"

WALL_HEIGHT = 2.5
WALL = 0.12  # thickness
LEAF_WIDTH, LEAF_THICKNESS, LEAF_HEIGHT = 0.9, 0.04, 2.0
SLIT = 0.01  # between leaf and frame, on both sides
NORTH, SOUTH = 1, -1
INTO_ROOM, INTO_CORRIDOR = 1, -1


@dataclass(frozen=True)
class Door:
    """A doorway in a wall along x, and the leaf in it."""

    name: str
    x: float  # west side of the doorway
    side: int  # of the corridor, NORTH or SOUTH
    opens: int  # INTO_ROOM or INTO_CORRIDOR
    hinge_west: bool
    limit: float = 1.92

    @property
    def gap(self) -> tuple[float, float]:
        return self.x, self.x + LEAF_WIDTH + 2 * SLIT


class Urdf:
    """A building under construction."""

    def __init__(self, name: str) -> None:
        self.robot = Xml.Element("robot", name=name)
        self.walls = Xml.SubElement(self.robot, "link", name="building")

    def block(self, x: tuple[float, float], y: tuple[float, float], top: float = WALL_HEIGHT,
              bottom: float = 0.0) -> None:  # fmt: skip
        """A fixed box from x[0] to x[1], y[0] to y[1]."""
        size = (x[1] - x[0], y[1] - y[0], top - bottom)
        box(self.walls, size, ((x[0] + x[1]) / 2, (y[0] + y[1]) / 2, (bottom + top) / 2))

    def wall_along_x(self, x: tuple[float, float], y: tuple[float, float],
                     gaps: Iterable[tuple[float, float]]) -> None:  # fmt: skip
        """A wall with doorways; above them it goes on."""
        start = x[0]
        for gap in sorted(gaps):
            self.block((start, gap[0]), y)
            self.block(gap, y, bottom=LEAF_HEIGHT + SLIT)
            start = gap[1]
        self.block((start, x[1]), y)

    def door(self, door: Door, corridor_half: float) -> None:
        """A leaf that turns about the face of its wall, on the side to which it opens."""
        face = corridor_half + (WALL if door.opens == INTO_ROOM else 0.0)
        hinge = door.gap[0] + SLIT if door.hinge_west else door.gap[1] - SLIT
        closed = 0.0 if door.hinge_west else math.pi
        turn = door.side * door.opens * (1 if door.hinge_west else -1)  # seen from above
        link = self.moving("revolute", door.name, (hinge, door.side * face, 0.0), closed)
        joint = self.robot[-1]
        Xml.SubElement(joint, "axis", xyz=f"0 0 {turn}")
        Xml.SubElement(joint, "limit", lower="0", upper=f"{door.limit}", effort="0", velocity="0")
        middle = (LEAF_WIDTH / 2, -turn * LEAF_THICKNESS / 2, LEAF_HEIGHT / 2 + SLIT)
        box(link, (LEAF_WIDTH, LEAF_THICKNESS, LEAF_HEIGHT), middle)

    def furniture(self, name: str, x: float, y: float, yaw: float,
                  boxes: Iterable[tuple[tuple[float, ...], tuple[float, ...]]]) -> None:  # fmt: skip
        """Something that can be pushed about on the floor, of boxes (size, middle)."""
        link = self.moving("planar", name, (x, y, 0.0), yaw)
        Xml.SubElement(self.robot[-1], "axis", xyz="0 0 1")
        for size, middle in boxes:
            box(link, size, middle)

    def moving(self, kind: str, name: str, place: tuple[float, ...], yaw: float) -> Xml.Element:
        """A link on a joint of the building; the joint is the last element."""
        link = Xml.SubElement(self.robot, "link", name=f"{name}_body")
        joint = Xml.SubElement(self.robot, "joint", name=name, type=kind)
        Xml.SubElement(joint, "parent", link="building")
        Xml.SubElement(joint, "child", link=link.get("name", ""))
        Xml.SubElement(joint, "origin", xyz=numbers(place), rpy=numbers((0.0, 0.0, yaw)))
        return link

    def write(self, path: Path) -> None:
        Xml.indent(self.robot)
        path.write_bytes(Xml.tostring(self.robot, encoding="utf-8", xml_declaration=True) + b"\n")


def box(link: Xml.Element, size: tuple[float, ...], middle: tuple[float, ...]) -> None:
    visual = Xml.SubElement(link, "visual")
    Xml.SubElement(visual, "origin", xyz=numbers(middle))
    Xml.SubElement(Xml.SubElement(visual, "geometry"), "box", size=numbers(size))


def numbers(values: Iterable[float]) -> str:
    return " ".join(f"{round(value, 6) + 0.0:g}" for value in values)


def corridor() -> Urdf:
    """A corridor 40 m long with seven rooms on each side, a door to each."""
    length, half, depth = 40.0, 1.2, 4.2  # inside, from the corridor's middle, of the rooms
    west = {"hinge_west": True}
    east = {"hinge_west": False}
    doors = [
        Door("door_01", 1.2, NORTH, INTO_ROOM, **west),
        Door("door_02", 7.9, NORTH, INTO_ROOM, **east),
        Door("door_03", 12.3, NORTH, INTO_CORRIDOR, **west, limit=1.57),
        Door("door_04", 18.6, NORTH, INTO_ROOM, **west),
        Door("door_05", 23.1, NORTH, INTO_ROOM, **east, limit=1.75),
        Door("door_06", 30.4, NORTH, INTO_ROOM, **west),
        Door("door_07", 37.2, NORTH, INTO_CORRIDOR, **east, limit=1.57),
        Door("door_08", 3.4, SOUTH, INTO_ROOM, **east),
        Door("door_09", 9.6, SOUTH, INTO_CORRIDOR, **east, limit=1.57),
        Door("door_10", 15.2, SOUTH, INTO_ROOM, **west),
        Door("door_11", 20.8, SOUTH, INTO_ROOM, **east, limit=1.75),
        Door("door_12", 26.7, SOUTH, INTO_ROOM, **west),
        Door("door_13", 32.0, SOUTH, INTO_CORRIDOR, **west, limit=1.57),
        Door("door_14", 35.1, SOUTH, INTO_ROOM, **east),
    ]
    partitions = {
        NORTH: (5.6, 10.9, 16.4, 21.8, 27.9, 34.3),
        SOUTH: (6.7, 13.1, 18.2, 24.5, 29.6, 34.0),
    }
    niches = {NORTH: ((14.6, 15.5),), SOUTH: ((22.6, 23.8),)}  # in the corridor's walls
    niche_depth = 0.45
    urdf = Urdf("corridor")
    for side in (NORTH, SOUTH):
        gaps = [door.gap for door in doors if door.side == side]
        wall, back = across(side, half, half + WALL), half + WALL + depth
        urdf.wall_along_x((-WALL, length + WALL), wall, [*gaps, *niches[side]])
        urdf.block((-WALL, length + WALL), across(side, back, back + WALL))
        for x in partitions[side]:
            urdf.block((x, x + WALL), across(side, half + WALL, back))
        for x0, x1 in niches[side]:
            end = half + niche_depth
            urdf.block((x0, x1), across(side, end, end + WALL))
            urdf.block((x0 - WALL, x0), across(side, half + WALL, end + WALL))
            urdf.block((x1, x1 + WALL), across(side, half + WALL, end + WALL))
    outside = half + 2 * WALL + depth
    urdf.block((-WALL, 0.0), (-outside, outside))
    urdf.block((length, length + WALL), (-outside, outside))
    for x, side in ((5.0, NORTH), (6.1, SOUTH), (17.0, NORTH), (24.9, SOUTH), (28.6, NORTH),
                    (34.4, SOUTH)):  # fmt: skip
        urdf.block((x, x + 0.3), across(side, half - 0.22, half))  # pillars
    for x, width, side, from_wall, thick in (
        (3.2, 1.6, NORTH, 3.5, 0.6), (6.0, 0.8, NORTH, 2.0, 0.5), (13.4, 1.2, NORTH, 3.2, 0.8),
        (20.2, 0.9, NORTH, 1.0, 0.45), (25.4, 1.8, NORTH, 3.0, 0.8), (32.6, 1.0, NORTH, 2.2, 0.6),
        (35.2, 1.4, NORTH, 3.6, 0.5), (1.0, 1.6, SOUTH, 3.0, 0.8), (7.4, 1.2, SOUTH, 2.4, 0.6),
        (16.4, 1.4, SOUTH, 3.4, 0.7), (19.0, 0.8, SOUTH, 2.1, 0.5), (28.2, 1.2, SOUTH, 1.4, 0.6),
        (31.0, 1.6, SOUTH, 3.2, 0.8), (37.3, 1.5, SOUTH, 2.6, 0.8),
    ):  # fmt: skip
        near = half + WALL + from_wall  # cupboards and benches that never move
        urdf.block((x, x + width), across(side, near, near + thick), top=0.9)
    for door in doors:
        urdf.door(door, half)
    return urdf


def department() -> Urdf:
    """Section 4.1 of Schulz and Burgard 2001: a corridor with doors that open by up to 90 degrees."""
    length, half, depth = 26.0, 1.2, 4.0
    right_angle = round(math.pi / 2, 6)
    places = [
        ("door_01", 1.5, NORTH, True), ("door_02", 2.9, SOUTH, False),
        ("door_03", 6.2, NORTH, False), ("door_04", 8.0, SOUTH, True),
        ("door_05", 11.1, NORTH, True), ("door_06", 13.4, SOUTH, True),
        ("door_07", 16.3, NORTH, False), ("door_08", 18.2, SOUTH, False),
        ("door_09", 21.4, NORTH, True), ("door_10", 23.0, SOUTH, True),
    ]  # fmt: skip
    doors = [Door(name, x, side, INTO_ROOM, west, right_angle) for name, x, side, west in places]
    urdf = Urdf("department")
    back = half + WALL + depth
    for side in (NORTH, SOUTH):
        gaps = [door.gap for door in doors if door.side == side]
        urdf.wall_along_x((-WALL, length + WALL), across(side, half, half + WALL), gaps)
        urdf.block((-WALL, length + WALL), across(side, back, back + WALL))
    for x, side in ((4.6, NORTH), (9.3, NORTH), (14.2, NORTH), (19.5, NORTH),
                    (5.9, SOUTH), (11.2, SOUTH), (16.5, SOUTH), (21.3, SOUTH)):  # fmt: skip
        urdf.block((x, x + WALL), across(side, half + WALL, back))
    for x in (-WALL, length):
        urdf.block((x, x + WALL), (-back - WALL, back + WALL))
    for x, side in ((4.0, SOUTH), (9.6, NORTH), (15.4, NORTH), (20.3, SOUTH)):
        urdf.block((x, x + 0.3), across(side, half - 0.2, half))  # pillars
    for door in doors:
        urdf.door(door, half)
    return urdf


def passage() -> Urdf:
    """Section 4.2: a piece of corridor in which a U-shaped object stands."""
    length, half = 10.0, 1.2
    urdf = Urdf("passage")
    for side in (NORTH, SOUTH):
        urdf.block((-WALL, length + WALL), across(side, half, half + WALL))
    for x in (-WALL, length):
        urdf.block((x, x + WALL), (-half, half))
    for x, side in ((2.2, NORTH), (3.7, SOUTH), (7.4, NORTH)):
        urdf.block((x, x + 0.3), across(side, half - 0.2, half))  # pillars
    urdf.furniture("u_shape", 5.0, -0.55, math.pi / 2, u_shape())
    return urdf


DESKS = {  # where they stand
    "desk_1": (1.6, 4.6, 0.0),
    "desk_2": (4.2, 3.6, math.pi / 2),
    "desk_3": (6.2, 4.6, 0.0),
    "desk_4": (9.2, 2.8, math.pi / 2),
}


def office() -> Urdf:
    """Two offices with two desks each, on a corridor in which a U-shaped object stands."""
    urdf = two_offices("office")
    for name, (x, y, yaw) in DESKS.items():
        urdf.furniture(name, x, y, yaw, desk())
    urdf.furniture("u_shape", 5.0, -0.45, math.pi, u_shape())
    return urdf


def offices() -> Urdf:
    """Section 4.3: the model has the desks 20 cm too near to the middle of the rooms."""
    urdf = two_offices("offices")
    for name, (x, y, yaw) in DESKS.items():
        middle = (2.5, 3.3) if x < 5.0 else (7.5, 3.3)
        share = 0.2 / math.dist((x, y), middle)
        there = [a + share * (b - a) for a, b in zip((x, y), middle, strict=True)]
        urdf.furniture(name, *there, yaw, desk())
    urdf.furniture("table", 6.82, 3.68, 0.0, small_table())
    return urdf


def two_offices(name: str) -> Urdf:
    """Two offices with open doors to a corridor, without furniture that moves."""
    length, half, depth, middle = 10.0, 1.2, 4.0, 5.0
    doors = [
        Door("door_west", 2.0, NORTH, INTO_ROOM, hinge_west=True),
        Door("door_east", 7.1, NORTH, INTO_ROOM, hinge_west=False),
    ]
    back = half + WALL + depth
    urdf = Urdf(name)
    urdf.wall_along_x((-WALL, length + WALL), (half, half + WALL), [door.gap for door in doors])
    urdf.block((-WALL, length + WALL), (back, back + WALL))
    urdf.block((-WALL, length + WALL), (-half - WALL, -half))
    urdf.block((-WALL, 0.0), (-half, back))
    urdf.block((length, length + WALL), (-half, back))
    urdf.block((middle - WALL / 2, middle + WALL / 2), (half + WALL, back))
    urdf.block((0.0, 0.4), (3.0, 4.2), top=1.8)  # cupboards
    urdf.block((9.0, 9.9), (back - 0.4, back), top=1.8)
    for door in doors:
        urdf.door(door, half)
    return urdf


def hotel() -> Urdf:
    """Eight rooms exactly alike, four on each side of a corridor of 26 m that ends in two ways."""
    length, half, depth, pitch = 26.0, 1.0, 4.0, 6.0
    doors = [
        Door(f"room_{side_name}_{k + 1}", 2.5 + pitch * k, side, INTO_ROOM, hinge_west=True)
        for side, side_name in ((NORTH, "north"), (SOUTH, "south"))
        for k in range(4)
    ]
    urdf = Urdf("hotel")
    back = half + WALL + depth
    for side in (NORTH, SOUTH):
        gaps = [door.gap for door in doors if door.side == side]
        urdf.wall_along_x((-WALL, length + WALL), across(side, half, half + WALL), gaps)
        urdf.block((-WALL, length + WALL), across(side, back, back + WALL))
        for k in range(4):
            west = 1.0 + pitch * k
            for x in (west - WALL, west + pitch - 2 * WALL):
                urdf.block((x, x + WALL), across(side, half + WALL, back))
            urdf.block((west + 3.6, west + 5.6), across(side, back - 1.6, back))  # bed
            urdf.block((west, west + 0.6), across(side, half + WALL + 2.0, half + WALL + 3.2))
    urdf.block((-WALL, 0.0), (-back, back))
    urdf.block((length, length + WALL), (-back, back))
    urdf.block((24.6, 25.4), (0.4, half))  # a counter at the east end
    for door in doors:
        urdf.door(door, half)
    return urdf


def small_table() -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """A square top of 60 cm on legs of 2 cm, of which a laser sees next to nothing."""
    height, thick, leg, out = 0.7, 0.02, 0.02, 0.27
    below = height - thick
    legs = [((leg, leg, below), (i * out, j * out, below / 2)) for i in (-1, 1) for j in (-1, 1)]
    return [((0.6, 0.6, thick), (0.0, 0.0, height - thick / 2)), *legs]


def desk() -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """A top of 1.6 m by 0.8 m on four legs; a low laser sees the legs alone."""
    height, thick, leg, inset = 0.72, 0.03, 0.06, 0.05
    x, y = 0.8 - inset - leg / 2, 0.4 - inset - leg / 2
    below = height - thick
    legs = [((leg, leg, below), (i * x, j * y, below / 2)) for i in (-1, 1) for j in (-1, 1)]
    return [((1.6, 0.8, thick), (0.0, 0.0, height - thick / 2)), *legs]


def u_shape() -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """37 cm by 37 cm, walls 1 cm thick, open towards its x axis."""
    side, thick, height = 0.37, 0.01, 0.6
    edge = (side - thick) / 2
    return [
        ((thick, side, height), (-edge, 0.0, height / 2)),
        ((side - thick, thick, height), (thick / 2, edge, height / 2)),
        ((side - thick, thick, height), (thick / 2, -edge, height / 2)),
    ]


def across(side: int, near: float, far: float) -> tuple[float, float]:
    """From ``near`` to ``far`` of the corridor's middle, on one side, in rising order."""
    return (near, far) if side == NORTH else (-far, -near)


if __name__ == "__main__":
    corridor().write(HERE / "corridor" / "corridor.urdf")
    office().write(HERE / "office" / "office.urdf")
    hotel().write(HERE / "hotel" / "hotel.urdf")
    department().write(SCHULZ_2001 / "department.urdf")
    passage().write(SCHULZ_2001 / "passage.urdf")
    offices().write(SCHULZ_2001 / "offices.urdf")
