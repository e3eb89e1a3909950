"""What is wrong with a building that loads: each thing in a sentence, with its cure."""

from __future__ import annotations

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.outline import outline
from objstate.geometry import BoolArray, FloatArray

TALLEST = 100.0  # m: a storey or an object higher than this was drawn in millimetres
STOREY = 15.0  # m: more than a storey is high
UPRIGHT = 0.1  # of a unit normal's component, below which a face counts as parallel to that axis
TILT = np.radians(2.0)  # of a hinge that counts as vertical
FAR = 0.5  # m from a hinge to the nearest wall
JAMB = 0.1  # m about the hinge in which walls are the jamb
SLACK = 0.03  # m that a leaf may overlap the frame it closes against
INSIDE = 0.3  # m: a leaf with walls so near on both its sides stands inside them
SHRUNK = 0.02  # m by which furniture may cut into a wall


def find_problems(building: Building, height: float) -> list[str]:
    """What is wrong with a building, for a level laser at ``height`` m above the floor."""
    faults = _wall_problems(building.walls, height)
    walls = outline(building.walls, height)
    for item in building.objects.values():
        faults += _object_problems(item, walls, height)
    return faults


def _wall_problems(walls: Mesh, height: float) -> list[str]:
    if len(walls.faces) == 0:
        return ["The building has no walls; give the root link a <collision> with their shape."]
    if _in_millimetres(walls):
        return [
            f"The walls are {np.ptp(walls.vertices[:, 2]):.0f} m high, which looks like "
            'millimetres; add scale="0.001 0.001 0.001" to their <mesh>.'
        ]
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


def _in_millimetres(mesh: Mesh) -> bool:
    return bool(np.ptp(mesh.vertices[:, 2]) > TALLEST)


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


def _object_problems(item: MovableObject, walls: FloatArray, height: float) -> list[str]:
    name = f"'{item.name}'"
    if len(item.mesh.faces) == 0:
        return [f"{name} has no shape; give its link a <collision>."]
    if _in_millimetres(item.mesh):
        return [
            f"{name} is {np.ptp(item.mesh.vertices[:, 2]):.0f} m high, which looks like "
            'millimetres; add scale="0.001 0.001 0.001" to its <mesh>.'
        ]
    home = outline(item.mesh, height, item.transforms(item.home[None])[0])
    if len(home) == 0:
        return [
            f"{name} is not cut by a laser {height:g} m above the floor and stays unseen; "
            "check its height and which way up its mesh is."
        ]
    if item.kind is Kind.HINGED:
        return _hinge_problems(item, home, walls)
    return _stand_problems(item, home, walls) if item.kind is Kind.PLANAR else []


def _stand_problems(item: MovableObject, home: FloatArray, walls: FloatArray) -> list[str]:
    """Of furniture: whether it starts inside the walls, or on a floor that is not level."""
    faults = []
    if abs(item.direction[2]) < np.cos(TILT):
        faults.append(
            f"'{item.name}' moves in a plane that is not the floor, but x, y and yaw are taken "
            'on the floor; give <axis xyz="0 0 1"/>.'
        )
    if _crosses(_shrink(home), walls):
        faults.append(f"'{item.name}' starts inside the walls; move its joint's <origin>.")
    return faults


def _hinge_problems(item: MovableObject, home: FloatArray, walls: FloatArray) -> list[str]:
    faults = _limit_problems(item)
    axis = item.direction
    if abs(axis[2]) < np.cos(TILT):
        lean = np.degrees(np.arccos(abs(axis[2])))
        faults.append(
            f"The hinge of '{item.name}' leans by {lean:.0f} degrees; for a door that stands "
            'upright give <axis xyz="0 0 1"/>.'
        )
        return faults
    hinge = item.origin[:2, 3]
    if len(walls) == 0:
        return faults
    distance = float(_distances(hinge, walls).min())
    if distance > FAR:
        faults.append(
            f"The hinge of '{item.name}' is {distance:.2f} m away from any wall; "
            "correct its joint's <origin>."
        )
        return faults
    return faults + _doorway_problems(item.name, hinge, home, walls)


def _limit_problems(item: MovableObject) -> list[str]:
    if item.upper - item.lower <= 2 * np.pi + TILT:
        return []
    return [
        f"'{item.name}' opens from {item.lower:g} to {item.upper:g} rad, more than "
        "a whole turn; give the angles that its leaf can reach."
    ]


def _doorway_problems(
    name: str, hinge: FloatArray, leaf: FloatArray, walls: FloatArray
) -> list[str]:
    """Whether the closed leaf fits between the walls."""
    lengths = np.linalg.norm(leaf[:, 1] - leaf[:, 0], axis=1)
    middle = np.average(leaf.mean(axis=1), axis=0, weights=lengths)
    length = float(np.linalg.norm(leaf - hinge, axis=2).max())
    along = (middle - hinge) / max(np.linalg.norm(middle - hinge), np.finfo(float).tiny)
    aside = np.array([-along[1], along[0]])
    if max(_range(middle, aside, walls), _range(middle, -aside, walls)) < INSIDE:
        return [f"'{name}' stands inside the walls when closed; cut its doorway out of them."]
    gap = JAMB + _range(hinge + JAMB * along, along, walls)
    if gap < length - SLACK:
        return [
            f"The leaf of '{name}' is {length:.2f} m long, but a wall stands {gap:.2f} m from its "
            "hinge where it closes; shorten the leaf, or move or turn its joint's <origin>."
        ]
    return []


def _range(origin: FloatArray, direction: FloatArray, walls: FloatArray) -> float:
    """How far it is from a point (2,) in a direction (2,) to the nearest segment (k, 2, 2), or inf."""
    edge, gap = walls[:, 1] - walls[:, 0], walls[:, 0] - origin
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = _cross(direction, edge)
        along, share = _cross(gap, edge) / cross, _cross(gap, direction) / cross
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


def _crosses(a: FloatArray, b: FloatArray) -> bool:
    """Whether any segment of a (m, 2, 2) crosses any of b (k, 2, 2)."""

    def parted(segments: FloatArray, by: FloatArray) -> BoolArray:
        """(m, k) whether the ends of each segment lie on both sides of each line."""
        start = by[None, :, 0]
        edge = by[None, :, 1] - start
        sides = [_cross(edge, segments[:, None, end] - start) for end in (0, 1)]
        return np.asarray(sides[0] * sides[1] < 0)

    return bool(np.any(parted(a, b) & parted(b, a).T))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """The z component of the cross product of plane vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
