"""What is wrong with a building that loads: each thing in a sentence, with its cure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from objstate.building.door_table import WIDEST_LEAF
from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.outline import outline
from objstate.errors import BuildingError
from objstate.geometry import WHOLE_TURN, FloatArray, cross_product, crosses

IN_METRES = 'give metres, and a <mesh> of millimetres scale="0.001 0.001 0.001"'
TALLEST = 100.0  # m: a storey or an object higher than this was drawn in millimetres
STOREY = 15.0  # m: more than a storey is high
UPRIGHT = 0.1  # of a unit normal's component, below which a face counts as parallel to that axis
TILT = np.radians(2.0)  # of a hinge that counts as vertical
AT_WALL = (
    0.12  # m from a hinge to the end of its wall: two cells of a map, and a hand that reads it
)
ASIDE = 2.0  # times nearer than that a hinge stands to the line of its wall, which is told better
AT_FRAME = (
    0.3  # m from the free edge to what the leaf closes against; maps miss slim frames and glass
)
JAMB = 0.1  # m about the hinge in which walls are the jamb
SLACK = 0.03  # m that a leaf may overlap the frame it closes against
INSIDE = 0.3  # m: a leaf with walls so near on both its sides stands inside them
STUB = 0.21  # m along a leaf; what ends before is its jamb: two cells of a coarse map
HALF = 0.02  # m, half the thickness of a leaf
TINY = 1e-9  # m
POINTS, MOST = 9, 0.5  # points of a leaf compared with the walls; largest share of them beside one
OVERLAP = 0.1  # share of a leaf; leaves that meet are drawn a few centimetres into each other
FARTHEST = 2.0  # times its width that a leaf slides
SHRUNK = 0.02  # m by which furniture may cut into a wall


def find_problems(building: Building, height: float) -> list[str]:
    """What is wrong with a building, for a level laser at ``height`` m above the floor."""
    faults = _wall_problems(building.walls, height)
    walls = outline(building.walls, height)
    closed = {
        item.name: outline(item.mesh, height, item.transforms(item.home[None])[0])
        for item in building.objects.values()
    }
    for item in building.objects.values():
        faults += _object_problems(item, Surroundings(item.name, walls, closed), height)
    doors = {
        name: shape
        for name, shape in closed.items()
        if building[name].kind is not Kind.PLANAR and len(shape)
    }
    return faults + _overlaps(doors)


def _overlaps(leaves: Mapping[str, FloatArray]) -> list[str]:
    """Of closed leaves, whose outlines (k, 2, 2) are given by name, those in the same place."""
    from shapely import MultiPoint, STRtree, area, intersection

    names = list(leaves)
    hulls = np.empty(len(names), dtype=object)
    hulls[:] = [MultiPoint(shape.reshape(-1, 2)).convex_hull for shape in leaves.values()]
    pairs = STRtree(hulls).query(hulls, predicate="intersects").T
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    shared = area(intersection(*hulls[pairs].T))
    smaller = area(hulls[pairs]).min(axis=1)
    return [
        f"'{names[a]}' and '{names[b]}' overlap when closed; remove one of them, or correct their "
        "places and widths."
        for a, b in pairs[shared > OVERLAP * smaller]
    ]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The surroundings of one object: walls (k, 2, 2), and the outlines of all objects by name."""

    name: str
    walls: FloatArray
    outlines: Mapping[str, FloatArray]

    @property
    def own(self) -> FloatArray:
        """The object's own outline (m, 2, 2), in its home."""
        return self.outlines[self.name]

    def distance(self, point: FloatArray) -> float:
        """From a point (2,) to the nearest wall or other object, m."""
        distance = float(_distances(point, self.walls).min())
        if distance <= AT_FRAME:
            return distance
        others = [shape for name, shape in self.outlines.items() if name != self.name]
        return min(distance, float(_distances(point, np.concatenate([self.walls, *others])).min()))


def _wall_problems(walls: Mesh, height: float) -> list[str]:
    if len(walls.faces) == 0:
        return ["The building has no walls; give the root link a <collision> with their shape."]
    if _in_millimetres(walls):
        return [_too_high(walls)]
    if _lies_on_its_side(walls):
        return [
            "The walls stand along y, as in a mesh drawn y-up; turn them with "
            '<origin rpy="1.5708 0 0"/> or export the mesh z-up.'
        ]
    if len(outline(walls, height)) == 0:
        low, high = walls.vertices[:, 2].min(), walls.vertices[:, 2].max()
        return [
            f"No wall is cut by a laser {height:g} m above the floor: the walls reach from "
            f"{low:.2f} to {high:.2f} m; move them, or give the laser's height."
        ]
    return []


def check_metres(building: Building) -> None:
    """Raise BuildingError for walls that are drawn in millimetres."""
    if _in_millimetres(building.walls):
        raise BuildingError(f"{building.name}: {_too_high(building.walls)}")


def _in_millimetres(mesh: Mesh) -> bool:
    return bool(len(mesh.vertices) and np.ptp(mesh.vertices[:, 2]) > TALLEST)


def _too_high(walls: Mesh) -> str:
    height = np.ptp(walls.vertices[:, 2])
    return f"The walls are {height:.0f} m high, which looks like millimetres; {IN_METRES}."


def _lies_on_its_side(walls: Mesh) -> bool:
    """Whether the floor plan lies in the plane of x and z, and the storey's height along y."""
    _, depth, height = np.ptp(walls.vertices, axis=0)
    if not (depth < STOREY and height > 2 * depth):
        return False
    a, b, c = (walls.vertices[walls.faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1)
    along = np.abs(normals) < UPRIGHT * area[:, None]  # faces that run along each axis
    return bool(area[along[:, 1]].sum() > area[along[:, 2]].sum())


def _object_problems(item: MovableObject, around: Surroundings, height: float) -> list[str]:
    home, walls = around.own, around.walls
    name = f"'{item.name}'"
    if len(item.mesh.faces) == 0:
        return [f"{name} has no shape; give its link a <collision>."]
    if _in_millimetres(item.mesh):
        return [
            f"{name} is {np.ptp(item.mesh.vertices[:, 2]):.0f} m high, which looks like "
            f"millimetres; {IN_METRES}."
        ]
    if len(home) == 0:
        return [
            f"{name} is not cut by a laser {height:g} m above the floor and stays unseen; "
            "check its height and which way up its mesh is."
        ]
    if item.kind is Kind.HINGED:
        return _hinge_problems(item, around)
    if item.kind is Kind.SLIDING:
        return _slide_problems(item)
    return _stand_problems(item, home, walls)


def _slide_problems(item: MovableObject) -> list[str]:
    width = float(np.ptp(item.mesh.vertices @ item.axis))
    travel = item.upper - item.lower
    if travel <= FARTHEST * width:
        return []
    return [
        f"'{item.name}' slides by {travel:.2f} m, but measures {width:.2f} m along its way; "
        "correct its limits, or its shape."
    ]


def _stand_problems(item: MovableObject, home: FloatArray, walls: FloatArray) -> list[str]:
    """Of furniture: whether it starts inside the walls, or on a floor that is not level."""
    faults = []
    if abs(item.direction[2]) < np.cos(TILT):
        faults.append(
            f"'{item.name}' moves in a plane that is not the floor, but x, y and yaw are taken "
            'on the floor; give <axis xyz="0 0 1"/>.'
        )
    if crosses(_shrink(home), walls):
        faults.append(f"'{item.name}' starts inside the walls; move its joint's <origin>.")
    return faults


def _hinge_problems(item: MovableObject, around: Surroundings) -> list[str]:
    faults = _limit_problems(item)
    axis = item.direction
    if abs(axis[2]) < np.cos(TILT):
        lean = np.degrees(np.arccos(abs(axis[2])))
        faults.append(
            f"The hinge of '{item.name}' leans by {lean:.0f} degrees; for a door that stands "
            'upright give <axis xyz="0 0 1"/>.'
        )
        return faults
    leaf = Leaf.of(item, around.own)
    if leaf.length > WIDEST_LEAF:
        faults.append(
            f"The leaf of '{item.name}' is {leaf.length:g} m long; if another unit is meant, give "
            "metres."
        )
    elif len(around.walls):
        fault = _doorway_problem(item.name, leaf, around)
        faults += [] if fault is None else [fault + _what_would_fit(leaf, around)]
    return faults


@dataclass(frozen=True, eq=False)
class Leaf:
    """A closed leaf as a line from its hinge to its free edge."""

    hinge: FloatArray  # (2,) m
    bearing: float  # rad
    length: float  # m

    @staticmethod
    def of(item: MovableObject, home: FloatArray) -> Leaf:
        """The line through the middle of a door's outline."""
        hinge = item.origin[:2, 3]
        lengths = np.linalg.norm(home[:, 1] - home[:, 0], axis=1)
        along = np.average(home.mean(axis=1), axis=0, weights=lengths) - hinge
        length = float(np.linalg.norm(home - hinge, axis=2).max())
        return Leaf(hinge, float(np.arctan2(along[1], along[0])), length)

    @property
    def along(self) -> FloatArray:
        """(2,) the unit vector from the hinge to the free edge."""
        return np.array([np.cos(self.bearing), np.sin(self.bearing)])


def _limit_problems(item: MovableObject) -> list[str]:
    if item.upper - item.lower <= 2 * np.pi + TILT:
        return []
    return [
        f"'{item.name}' opens from {item.lower:g} to {item.upper:g} rad, more than "
        "a whole turn; give the angles that its leaf can reach."
    ]


def _doorway_problem(name: str, leaf: Leaf, around: Surroundings) -> str | None:
    """Why a closed leaf doesn't fit a doorway: by its hinge, its length, or its free edge."""
    walls = around.walls
    along, middle = leaf.along, leaf.hinge + leaf.length / 2 * leaf.along
    aside = np.array([-along[1], along[0]])
    between = max(_range(middle, aside, walls), _range(middle, -aside, walls)) < INSIDE
    if between or _runs_along(leaf, walls):
        return f"'{name}' stands inside the walls when closed; cut its doorway out of them."
    if _off_wall(leaf, walls) > AT_WALL:
        distance = float(_distances(leaf.hinge, walls).min())
        return (
            f"The hinge of '{name}' is {distance:.2f} m away from any wall; "
            "correct its joint's <origin>."
        )
    gap = _free_length(leaf, walls)
    if gap < leaf.length - SLACK:
        return (
            f"The leaf of '{name}' is {leaf.length:.2f} m long, but a wall stands {gap:.2f} m from "
            "its hinge where it closes; shorten the leaf, or move or turn its joint's <origin>."
        )
    distance = around.distance(leaf.hinge + leaf.length * along)
    if distance > AT_FRAME:
        return (
            f"The free edge of '{name}' is {distance:.2f} m away from any wall or other leaf when "
            "closed; correct the leaf's length, or move or turn its joint's <origin>."
        )
    return None


def _off_wall(leaf: Leaf, walls: FloatArray) -> float:
    """Distance of a hinge from its wall, m; beside the leaf each metre counts ``ASIDE`` times."""
    aside = np.array([-leaf.along[1], leaf.along[0]])
    offset = walls - leaf.hinge
    drawn = np.stack([offset @ leaf.along, ASIDE * (offset @ aside)], axis=-1)
    return float(_distances(np.zeros(2), drawn).min())


def _free_length(leaf: Leaf, walls: FloatArray) -> float:
    """Distance from the hinge, beyond the jamb, of the first wall in a closed leaf's place."""
    offset, along = walls - leaf.hinge, leaf.along
    s, aside = offset @ along, offset @ np.array([-along[1], along[0]])  # (k, 2) of both ends
    step = aside[:, 1] - aside[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort((np.array([[-HALF], [HALF]]) - aside[:, 0]) / step, axis=0)  # (2, k)
    level = np.abs(step) < TINY
    within = np.abs(aside[:, 0]) <= HALF
    first = np.where(level, np.where(within, 0.0, 1.0), np.clip(ends[0], 0.0, 1.0))
    last = np.where(level, np.where(within, 1.0, 0.0), np.clip(ends[1], 0.0, 1.0))
    cut = np.stack([first, last], axis=1)
    places = s[:, :1] + cut * (s[:, 1:] - s[:, :1])
    met = (first < last) & (places.max(axis=1) > STUB)
    return float(np.min(np.maximum(places.min(axis=1)[met], JAMB), initial=np.inf))


def _runs_along(leaf: Leaf, walls: FloatArray) -> bool:
    """Whether walls lie beside a closed leaf for most of its length, however wavy."""
    places = np.linspace(JAMB, leaf.length - JAMB, POINTS)
    near = [float(_distances(leaf.hinge + s * leaf.along, walls).min()) < JAMB for s in places]
    return leaf.length > 4 * JAMB and float(np.mean(near)) > MOST


def _what_would_fit(leaf: Leaf, around: Surroundings) -> str:
    """Of slips of the pen the one, if any, without which the leaf would stand in a doorway."""
    degrees = math.degrees(leaf.bearing)
    slips = [(leaf.bearing + math.pi, "turned by 180 degrees it would: is its bearing reversed?")]
    if abs(degrees) <= WHOLE_TURN:  # the number that stands in a table of degrees
        told = f"with {degrees:.4g} rad instead of degrees it would: is its bearing in radians?"
        is_whole = math.isclose(degrees, round(degrees), abs_tol=1e-6)  # as few radians are
        slips.insert(len(slips) if is_whole else 0, (degrees, told))
    for bearing, told in slips:
        if _doorway_problem("", replace(leaf, bearing=bearing), around) is None:
            return f" It doesn't fit a doorway; {told}"
    return ""


def _range(origin: FloatArray, direction: FloatArray, walls: FloatArray) -> float:
    """Distance from a point (2,) in a direction (2,) to the nearest segment (k, 2, 2), or inf."""
    edge, gap = walls[:, 1] - walls[:, 0], walls[:, 0] - origin
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = cross_product(direction, edge)
        along, share = cross_product(gap, edge) / cross, cross_product(gap, direction) / cross
    hit = (along >= 0) & (share >= 0) & (share <= 1)
    return float(np.min(along[hit], initial=np.inf))


def _distances(point: FloatArray, walls: FloatArray) -> FloatArray:
    """(k,) distance from a point (2,) to each segment (k, 2, 2)."""
    edge, gap = walls[:, 1] - walls[:, 0], point - walls[:, 0]
    share = np.clip(np.sum(gap * edge, axis=1) / np.sum(edge * edge, axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(gap - share[:, None] * edge, axis=1))


def _shrink(segments: FloatArray) -> FloatArray:
    """An outline drawn in towards its middle by SHRUNK metres at its farthest point."""
    middle = (segments.min(axis=(0, 1)) + segments.max(axis=(0, 1))) / 2
    radius = float(np.linalg.norm(segments - middle, axis=2).max())
    return np.asarray(middle + (segments - middle) * max(0.0, 1.0 - SHRUNK / radius))
