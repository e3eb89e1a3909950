"""The messages of a scene: coloured beams, ghosts of intervals, joint states."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.recording.candidates import Found
from objstate.recording.messages import (
    BASE,
    MAP,
    POINT,
    VECTOR,
    header,
    make,
    placed,
    plane_pose,
    triple,
)
from objstate.records import Path as RobotPath
from objstate.records import Scan
from objstate.run.scene.hits import Hit
from objstate.run.scene.states import shown_state

CLOUD = "sensor_msgs/msg/PointCloud2"
MARKERS = "visualization_msgs/msg/MarkerArray"
JOINTS = "sensor_msgs/msg/JointState"
COLOURS = {  # of beams, as 0xRRGGBB
    Hit.WALL: 0x8FA0AD,
    Hit.OBJECT: 0xF08A3C,
    Hit.UNEXPECTED: 0xD14FD1,
    Hit.BEYOND: 0xE02020,
}
POINT_TYPE = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4"), ("hit", "<u4")])
FIELDS = {"x": 7, "y": 7, "z": 7, "rgb": 7, "hit": 6}  # PointField: 7 FLOAT32, 6 UINT32
PATH = "nav_msgs/msg/Path"
LINE_LIST, TEXT, TRIANGLE_LIST = 5, 9, 11  # types of visualization_msgs/Marker
LINE_WIDTH = 0.015  # m
LABEL_HEIGHT = 0.2  # m of its letters, and above the object
SCALES = {
    LINE_LIST: (LINE_WIDTH, 0.0, 0.0),
    TEXT: (0.0, 0.0, LABEL_HEIGHT),
    TRIANGLE_LIST: (1.0, 1.0, 1.0),
}
GHOST = (0.95, 0.73, 0.31)  # red, green, blue
TRUE = (0.04, 0.48, 0.46)
UNKNOWN = (0.82, 0.31, 0.82)
DELETE_ALL = 3  # an action of visualization_msgs/Marker
SECTOR_STEP = np.radians(4.0)  # of the fan that fills an interval
SECTOR_HEIGHT = 0.02  # m above the lowest point of the leaf, so that no floor hides it
EDGES = np.array(  # of a box, as pairs of corners numbered by their bits
    [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]
)


def beams_message(scan: Scan, hits: np.ndarray) -> Any:
    """The ends (n,) of returning beams in ``base_link``, coloured by what they hit."""
    returned = np.isfinite(scan.ranges)
    rays = scan.rays.take(returned)
    ends = rays.origins + scan.ranges[returned, None] * rays.directions
    points = np.zeros(len(ends), POINT_TYPE)
    for name, column in zip("xyz", ends.T, strict=True):
        points[name] = column
    points["hit"] = hits[returned]
    points["rgb"] = np.array([COLOURS[hit] for hit in Hit], dtype=np.uint32)[points["hit"]]
    return make(
        CLOUD,
        header=header(scan.stamp_ns, BASE),
        height=1,
        width=len(points),
        fields=[
            make("sensor_msgs/msg/PointField", name=name, offset=4 * k, datatype=kind, count=1)
            for k, (name, kind) in enumerate(FIELDS.items())
        ],
        is_bigendian=False,
        point_step=POINT_TYPE.itemsize,
        row_step=POINT_TYPE.itemsize * len(points),
        data=np.frombuffer(points.tobytes(), np.uint8),
        is_dense=True,
    )


def joints_message(stamp_ns: int, beliefs: Iterable[ObjectBelief]) -> Any:
    """The state in which every door is shown."""
    doors = [belief for belief in beliefs if belief.item.kind is not Kind.PLANAR]
    nothing = np.zeros(0)
    return make(
        JOINTS,
        header=header(stamp_ns, MAP),
        name=[door.item.name for door in doors],
        position=np.array([float(shown_state(door)[0]) for door in doors]),
        velocity=nothing,
        effort=nothing,
    )


def ghosts_message(stamp_ns: int, beliefs: Iterable[ObjectBelief]) -> Any:
    """The 90 % interval of each object: ghosts at its bounds, a door's swing filled.

    What was never seen has a label instead, which goes when it is seen.
    """
    markers = []
    for number, belief in enumerate(beliefs):
        if len(belief.item.mesh.vertices) == 0:
            continue
        if belief.last_observed_ns is None:
            markers.append(_label(stamp_ns, number, belief))
        else:
            markers += _ghosts(stamp_ns, number, belief)
    return make(MARKERS, markers=markers)


def truth_message(stamp_ns: int, states: Iterable[tuple[MovableObject, FloatArray]]) -> Any:
    """Objects in their true states (d,), by their edges."""
    markers = [
        _marker(stamp_ns, "truth", number, LINE_LIST, _edges(item, state), 0.9, TRUE)
        for number, (item, state) in enumerate(states)
    ]
    return make(MARKERS, markers=markers)


def candidates_message(stamp_ns: int, found: Iterable[Found], height: float) -> Any:
    """Outlines of candidates for objects, from the floor to a laser's ``height`` m, and labels."""
    markers = [_marker(stamp_ns, "candidate", 0, LINE_LIST, np.empty((0, 3)), 0.0)]
    markers[0].action = DELETE_ALL
    for number, each in enumerate(found):
        corners = np.array(each.outline)
        rims = [np.column_stack([corners, np.full(len(corners), z)]) for z in (0.0, height)]
        low, high = rims
        sides = [(rim, np.roll(rim, -1, axis=0)) for rim in rims] + [(low, high)]
        lines = np.concatenate([np.stack(side, axis=1).reshape(-1, 3) for side in sides])
        above = np.array([[each.x, each.y, height + LABEL_HEIGHT]])
        text = f"{each.name}: {each.probability:.2f}"
        markers += [
            _marker(stamp_ns, "candidate", number, LINE_LIST, lines, each.probability, UNKNOWN),
            _marker(stamp_ns, "candidate_name", number, TEXT, above, 0.9, UNKNOWN, text),
        ]
    return make(MARKERS, markers=markers)


def path_message(stamp_ns: int, path: RobotPath) -> Any:
    """A robot's path."""
    poses = [
        make(
            "geometry_msgs/msg/PoseStamped",
            header=header(int(stamp), MAP),
            pose=plane_pose(pose),
        )
        for stamp, pose in zip(path.stamps_ns, path.poses, strict=True)
    ]
    return make(PATH, header=header(stamp_ns, MAP), poses=poses)


def _label(stamp_ns: int, number: int, belief: ObjectBelief) -> Any:
    item = belief.item
    matrix = item.transforms(shown_state(belief)[None])[0]
    vertices = item.mesh.moved(matrix).vertices
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    above = np.array([[middle[0], middle[1], vertices[:, 2].max() + LABEL_HEIGHT]])
    return _marker(stamp_ns, "unseen", number, TEXT, above, 0.9, text=f"{item.name}: not seen yet")


def _ghosts(stamp_ns: int, number: int, belief: ObjectBelief) -> list[Any]:
    item, (lower, upper) = belief.item, belief.interval()
    states = _bounding_states(belief.mean, lower, upper)
    lines = np.concatenate([_edges(item, state) for state in states])
    found = [_marker(stamp_ns, "ghost", number, LINE_LIST, lines, 0.9)]
    if item.kind is Kind.HINGED:
        fan = _swing(item, float(lower[0]), float(upper[0]))
        found.append(_marker(stamp_ns, "swing", number, TRIANGLE_LIST, fan, 0.45))
    return found


def _bounding_states(mean: FloatArray, lower: FloatArray, upper: FloatArray) -> list[FloatArray]:
    """The states at which an interval's ghosts stand."""
    if len(mean) == 1:
        return [lower, upper]
    x, y, _ = mean
    return [
        np.array([lower[0], y, lower[2]]),
        np.array([upper[0], y, upper[2]]),
        np.array([x, lower[1], upper[2]]),
        np.array([x, upper[1], lower[2]]),
    ]


def _edges(item: MovableObject, state: FloatArray) -> FloatArray:
    """Both ends of the twelve edges (24, 3) of the box around an object in a state."""
    corners = np.array([item.mesh.vertices.min(axis=0), item.mesh.vertices.max(axis=0)])
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    box = np.take_along_axis(corners, bits, axis=0)
    matrix = item.transforms(state[None])[0]
    return np.asarray((box @ matrix[:3, :3].T + matrix[:3, 3])[EDGES.reshape(-1)])


def _swing(item: MovableObject, lower: float, upper: float) -> FloatArray:
    """Triangles (3 k, 3) between the hinge and where the leaf's far edge may be."""
    vertices = item.mesh.vertices
    hinge = np.array([0.0, 0.0, vertices[:, 2].min() + SECTOR_HEIGHT])
    tip = vertices[np.argmax(np.hypot(*vertices[:, :2].T))] * (1.0, 1.0, 0.0) + hinge
    count = max(2, int(np.ceil((upper - lower) / SECTOR_STEP)) + 1)
    matrices = item.transforms(np.linspace(lower, upper, count)[:, None])
    middle = (matrices @ np.append(hinge, 1.0))[:, :3]
    rim = (matrices @ np.append(tip, 1.0))[:, :3]
    return np.stack([middle[:-1], rim[:-1], rim[1:]], axis=1).reshape(-1, 3)


def _marker(
    stamp_ns: int,
    space: str,
    number: int,
    kind: int,
    points: FloatArray,
    opacity: float,
    colour: tuple[float, float, float] = GHOST,
    text: str = "",
) -> Any:
    """One marker in ``map`` that stays until the next of its number."""
    duration = make("builtin_interfaces/msg/Duration", sec=1 if kind == TEXT else 0, nanosec=0)
    scale, place = SCALES[kind], np.eye(4)
    if kind == TEXT:
        place[:3, 3], points = points[0], points[:0]
    red, green, blue = colour
    return make(
        "visualization_msgs/msg/Marker",
        header=header(stamp_ns, MAP),
        ns=space,
        id=number,
        type=kind,
        action=0,
        pose=placed(place),
        scale=triple(VECTOR, scale),
        color=make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=opacity),
        lifetime=duration,
        frame_locked=False,
        points=[triple(POINT, point) for point in points.tolist()],
        colors=[],
        texture_resource="",
        texture=make(
            "sensor_msgs/msg/CompressedImage",
            header=header(0, ""),
            format="",
            data=np.zeros(0, np.uint8),
        ),
        uv_coordinates=[],
        text=text,
        mesh_resource="",
        mesh_file=make("visualization_msgs/msg/MeshFile", filename="", data=np.zeros(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )
