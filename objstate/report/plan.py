"""The building from above: walls at laser height, and each object's shape and way of moving."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.outline import outline
from objstate.geometry import FloatArray
from objstate.records import Path as RobotPath
from objstate.report.course import Course
from objstate.report.markup import element, polyline, segments, text
from objstate.report.solids import solid_areas

if TYPE_CHECKING:
    from shapely import Geometry

MARGIN = 0.6  # m around everything
LABEL_OFF = 0.3  # m from the middle of a closed leaf, on the side to which it doesn't open
INTRICATE = 2000  # triangles, above which an object is drawn by its convex outline
GRID = 1e-4  # m: corners so near to each other are one
MOST_TRUE_POSES = 3_000  # of a true path
NOWHERE = np.zeros((0, 2))
CORNERS = np.array([[-1.0, -1.0], [1.0, 1.0]])
LEVEL = 1e-6  # an axis is upright, or level, when no further from it than this


@dataclass(frozen=True, eq=False)
class Shape:
    """An object as the plan draws it, in its state zero, in the building's frame."""

    name: str
    motion: dict[str, Any]  # how a state moves it, in words that the page's script knows
    hull: list[FloatArray]  # rings (k, 2) m, seen from above
    cut: FloatArray  # (s, 2, 2) m, at laser height
    label: tuple[float, float]  # m


def shape_of(item: MovableObject, height: float) -> Shape:
    """What of an object the plan needs; objects that leave the plane keep their home state."""
    motion = _motion(item)
    zero = item.home[None] if motion["kind"] == "still" else np.zeros((1, len(item.coordinates)))
    placed = item.transforms(zero)[0]
    moved = item.mesh.moved(placed)
    return Shape(
        name=item.name,
        motion=motion,
        hull=_silhouette(moved),
        cut=outline(item.mesh, height, placed),
        label=_label(item, motion, moved.vertices[:, :2]),
    )


def draw_plan(
    building: Building,
    shapes: list[Shape],
    course: Course,
    height: float,
    true_path: RobotPath | None = None,
    robot_radius: float | None = None,
    reached: FloatArray = NOWHERE,
    outlines: Sequence[str] = (),
) -> str:
    """The plan as SVG, y up, one unit a metre; the page's script moves objects.

    Furniture gets to the places (n, 2) ``reached``, so that they are included in the view.
    ``outlines`` are markup of obstacles.
    """
    drawn = [
        *path_markup(course),
        "" if true_path is None else _true_path(true_path),
        *(object_markup(shape, index) for index, shape in enumerate(shapes)),
        *outlines,
        element("path", d="", class_="driven", id="driven"),
        element("path", d="", class_="driven lost", id="driven-lost"),
        element("path", d="", class_="clutter", id="clutter"),
        element("path", d="", class_="scan", id="scan"),
        _robot("true-robot", robot_radius) if true_path is not None else "",
        _robot("robot", robot_radius),
    ]
    shown = [course.drawn, reached]
    if true_path is not None:
        shown.append(true_path.poses[:, :2])
    return framed(building, shapes, np.concatenate(shown), height, drawn, "plan")


def path_markup(course: Course) -> list[str]:
    """The robot's way: a line where it is known, dashed where the robot was lost."""
    kinds = (("way", course.known), ("way lost", course.doubtful))
    return [
        element("path", d="".join(map(polyline, pieces)), class_=kind)
        for kind, pieces in kinds
        if pieces
    ]


def framed(
    building: Building,
    shapes: list[Shape],
    points: FloatArray,
    height: float,
    drawn: list[str],
    name: str | None = None,
) -> str:
    """Walls, ``drawn`` markup over them and objects' names, with points (n, 2) in view."""
    walls = outline(building.walls, height)
    solid = solid_areas(building.walls, height)
    low, high = _bounds(walls, points, shapes)
    x, y, width, depth = low[0], -high[1], high[0] - low[0], high[1] - low[1]
    upright = element(
        "g",
        element("path", d="".join(polyline(ring, closed=True) for ring in solid), class_="solid"),
        element("path", d=segments(walls), class_="wall"),
        *drawn,
        transform="scale(1 -1)",
    )
    names = [
        element(
            "text",
            text(shape.name),
            x=f"{shape.label[0]:.2f}",
            y=f"{-shape.label[1]:.2f}",
            class_="name",
            data_object=index,
        )
        for index, shape in enumerate(shapes)
    ]
    return element(
        "svg",
        upright,
        element("g", *names, class_="names"),
        viewBox=f"{x:.2f} {y:.2f} {width:.2f} {depth:.2f}",
        id=name,
        class_="plan",
        role="img",
        aria_label="Plan of the building with the robot's path and every object's state",
        style=f"--aspect:{width / depth:.3f}",
    )


def plan_buttons() -> str:
    """How to look closer."""
    buttons = (("−", "smaller", "zoom out"), ("+", "larger", "zoom in"), ("fit", "fit", "show all"))
    return "".join(
        element("button", label, class_=name, type="button", title=told, aria_label=told)
        for label, name, told in buttons
    )


def covered(item: MovableObject, state: FloatArray) -> FloatArray:
    """(n, 2) m of the floor, corners of what an object covers in a state (d,)."""
    return np.asarray(item.mesh.moved(item.transforms(state[None])[0]).vertices[:, :2])


def placement(motion: Mapping[str, Any], state: FloatArray) -> str:
    """The SVG transform that moves a shape into a state (d,), m and rad."""
    if motion["kind"] == "turn":
        x, y = motion["pivot"]
        return f"rotate({motion['sense'] * np.degrees(state[0]):.2f} {x} {y})"
    if motion["kind"] == "slide":
        x, y = state[0] * np.array(motion["along"])
        return f"translate({x:.3f} {y:.3f})"
    if motion["kind"] == "free":
        x, y, yaw = state
        return f"translate({x:.3f} {y:.3f}) rotate({np.degrees(yaw):.2f})"
    return ""


def object_markup(shape: Shape, index: int) -> str:
    """An object's parts: interval, truth, estimate; furniture's interval is a few ghosts."""
    hull = "".join(polyline(ring, closed=True) for ring in shape.hull)
    cut = segments(shape.cut)
    ghosts = {"turn": 0, "slide": 2, "free": 4, "still": 0}[shape.motion["kind"]]
    pivot = shape.motion.get("pivot")
    return element(
        "g",
        element("path", d="", class_="sector") if pivot else "",
        *(element("path", d=hull, class_="ghost") for _ in range(ghosts)),
        element("path", d=hull, class_="true"),
        element("g", element("path", d=hull, class_="leaf"), element("path", d=cut, class_="cut"),
                element("path", d=hull, class_="hit"),
                class_="estimate"),
        element("path", d=f"M{pivot[0]},{pivot[1]}h0", class_="hinge") if pivot else "",
        class_="object",
        data_object=index,
    )  # fmt: skip


def _true_path(path: RobotPath) -> str:
    stride = -(-len(path.stamps_ns) // MOST_TRUE_POSES)
    return element("path", d=polyline(path.poses[::stride, :2]), class_="true-way")


def _robot(name: str, radius: float | None) -> str:
    """The robot as a mark of one size on the screen, and at its own size, where that is known."""
    body = "" if radius is None else element("circle", r=f"{radius:.3f}", class_="body")
    mark = element("path", d="M9,0L-6,6L-3,0L-6,-6Z", class_="mark")
    return element("g", body, mark, class_="robot", id=name, style="display:none")


def _motion(item: MovableObject) -> dict[str, Any]:
    if item.kind is Kind.PLANAR:
        return {"kind": "free"}
    axis, place = item.direction, item.origin[:2, 3].round(4).tolist()
    if item.kind is Kind.SLIDING:
        return {"kind": "slide", "along": axis[:2].round(4).tolist()}
    if float(np.hypot(axis[0], axis[1])) > LEVEL:
        return {"kind": "still"}
    closed = item.mesh.moved(item.transforms(np.zeros((1, 1)))[0]).vertices[:, :2]
    off = closed - item.origin[:2, 3]
    farthest = off[np.argmax(np.hypot(*off.T))] if len(off) else np.zeros(2)
    middle = off.mean(axis=0) if len(off) else np.zeros(2)
    return {
        "kind": "turn",
        "pivot": place,
        "sense": 1 if axis[2] > 0 else -1,
        "reach": round(float(np.hypot(*farthest)), 3),
        "bearing": round(float(np.degrees(np.arctan2(middle[1], middle[0]))), 2),
    }


def _silhouette(mesh: Mesh) -> list[FloatArray]:
    """Rings (k, 2) around a mesh seen from above; of a complex one its convex outline."""
    import shapely

    corners = mesh.vertices[:, :2]
    if len(mesh.faces) > INTRICATE:
        covered = shapely.convex_hull(shapely.multipoints(corners))
    else:
        faces = shapely.polygons(corners[mesh.faces])
        covered = shapely.union_all(faces[shapely.area(faces) > 0.0], grid_size=GRID)
    return [shapely.get_coordinates(ring) for ring in _rings(covered)]


def _rings(covered: Geometry) -> list[Geometry]:
    import shapely

    polygons = [each for each in shapely.get_parts([covered]) if each.geom_type == "Polygon"]
    return [ring for each in polygons for ring in shapely.get_rings([each])]


def _label(
    item: MovableObject, motion: dict[str, Any], vertices: FloatArray
) -> tuple[float, float]:
    """Where an object's name stands, m."""
    if not len(vertices):
        return float(item.origin[0, 3]), float(item.origin[1, 3])
    middle = vertices.mean(axis=0)
    if motion["kind"] == "free":
        return float(item.home[0]), float(item.home[1])
    if motion["kind"] == "turn":
        bearing = np.radians(motion["bearing"])
        aside = motion["sense"] * np.array([np.sin(bearing), -np.cos(bearing)])
        middle = middle + LABEL_OFF * aside
    return float(middle[0]), float(middle[1])


def _bounds(
    walls: FloatArray, others: FloatArray, shapes: Sequence[Shape]
) -> tuple[FloatArray, FloatArray]:
    """The corners of the plan, m: of walls, of other points (n, 2), and of all that doors sweep."""
    points = np.concatenate([walls.reshape(-1, 2), others, *map(_reached, shapes)])
    if not len(points):
        points = np.zeros((1, 2))
    return points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN


def _reached(shape: Shape) -> FloatArray:
    """(n, 2) m of the floor that an object reaches without being carried away."""
    if shape.motion["kind"] == "turn":
        return np.asarray(shape.motion["pivot"]) + float(shape.motion["reach"]) * CORNERS
    if shape.motion["kind"] == "free":
        return np.array([shape.label])
    return np.concatenate([np.array([shape.label]), *shape.hull])
