"""The tree of tf frames, and the mountings of the lasers.

Frames follow REP-105. Records refer to ``base_link`` standing on the floor (z = 0). Where tf has
``base_footprint``, the floor is at its height, and lasers keep their true height above it;
otherwise ``base_link`` itself is taken to be on the floor. All of a robot's frames may have its
name in front, as in ``robot1/base_link``.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from objstate.errors import LogError
from objstate.frame_names import frame_name, laser_name
from objstate.geometry import (
    FloatArray,
    invert,
    is_rigid,
    pose_from_transform,
    rotation_from_quaternion,
    transform,
)
from objstate.logs.notices import Notices

BASE = "base_link"
FLOOR = "base_footprint"
ODOMETRY_FRAMES = ("odom", "odom_combined")

# m and sines of angles; a smaller change of a mounting is jitter of its publisher, and far
# below a laser's resolution
SAME_MOUNTING = 5e-3

SUPPLY = (
    "Supply it with --mount {}=x,y,z,roll,pitch,yaw (metres and radians), or leave this laser out "
    "with --topics."
)

Edge = tuple[str, tuple[float, ...]]  # parent, (x, y, z, qx, qy, qz, qw)
Path = tuple[tuple[Edge, ...], tuple[Edge, ...]]  # edges up from two frames to where they meet
Way = tuple[list[str], list[str]]  # the frames of such a path


def _beside(frame: str, name: str) -> str:
    """The frame of that name of the same robot: ``robot1/name`` beside ``robot1/frame``."""
    return "".join([*frame.rpartition("/")[:2], name])


class FrameTree:
    """The latest transform of every frame in its parent."""

    def __init__(self) -> None:
        self._edges: dict[str, Edge] = {}
        # as long as no parent changes: ancestors, and ways from frame to frame
        self._lines: dict[str, list[str]] = {}
        self._ways: dict[tuple[str, str], Way | None] = {}

    def update(self, stamped: Any) -> str:
        """Take a ``geometry_msgs/TransformStamped``; returns the child's name."""
        child = frame_name(stamped.child_frame_id)
        at, turn = stamped.transform.translation, stamped.transform.rotation
        numbers = (at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w)
        parent = frame_name(stamped.header.frame_id)
        if parent != self.parent(child):
            self._lines.clear()
            self._ways.clear()
        self._edges[child] = (parent, numbers)
        return child

    @property
    def frames(self) -> list[str]:
        """All frames, sorted."""
        return sorted(self._edges.keys() | {parent for parent, _ in self._edges.values()})

    def parent(self, frame: str) -> str | None:
        """The frame in which ``frame`` is given, if any."""
        edge = self._edges.get(frame)
        return edge[0] if edge else None

    def ancestors(self, frame: str) -> list[str]:
        """The frame itself, its parent, and so on to the root."""
        if frame not in self._lines:
            self._lines[frame] = line = [frame]
            while (parent := self.parent(line[-1])) is not None and parent not in line:
                line.append(parent)
        return self._lines[frame]

    def are_connected(self, a: str, b: str) -> bool:
        """Whether tf leads from one frame to the other."""
        return self._way(a, b) is not None

    def path(self, frame: str, reference: str) -> Path:
        """The edges up from two connected frames to their common ancestor."""
        way = self._way(frame, reference)
        assert way is not None
        up, up_reference = way
        edges = self._edges
        return tuple([edges[name] for name in up]), tuple([edges[name] for name in up_reference])

    def pose_of(self, frame: str, reference: str) -> FloatArray:
        """Transform (4, 4) of ``frame`` in ``reference``; they must be connected.

        Raises ValueError where a position or an orientation in between is none.
        """
        edges, reference_edges = self.path(frame, reference)
        return invert(_product(reference_edges)) @ _product(edges)

    def _way(self, frame: str, reference: str) -> Way | None:
        """The frames up from one, and up from another, below where they meet, if they do."""
        key = frame, reference
        if key not in self._ways:
            up, others = self.ancestors(frame), self.ancestors(reference)
            met = next((name for name in up if name in others), None)
            self._ways[key] = (
                None if met is None else (up[: up.index(met)], others[: others.index(met)])
            )
        return self._ways[key]


def _product(edges: tuple[Edge, ...]) -> FloatArray:
    """The first frame's transform (4, 4) in the last one's parent."""
    matrix = np.eye(4)
    for parent, (x, y, z, *turn) in edges:
        if not np.isfinite((x, y, z)).all():
            raise ValueError(f"a position in '{parent}' is not finite")
        matrix = transform(rotation_from_quaternion(*turn), (x, y, z)) @ matrix
    return matrix


class Mountings:
    """Where each laser is on the robot, and which frame the robot's pose is about."""

    def __init__(self, tree: FrameTree, mounts: Mapping[str, FloatArray], notices: Notices) -> None:
        self.tree = tree
        self._given = {frame_name(frame): _checked(frame, m) for frame, m in mounts.items()}
        self._notices = notices
        self._known: dict[str, tuple[Path, FloatArray]] = {}
        self._lifts: dict[str, FloatArray] = {}
        self._without_frame: dict[str, str] = {}  # topics of lasers whose scans have no frame

    def laser(self, topic: str, scan: Any) -> str:
        """The name by which a scan's laser is known, as ``laser_name`` has it."""
        laser = laser_name(topic, scan)
        if not frame_name(scan.header.frame_id):
            self._without_frame[laser] = topic
            self._notices.add(f"A scan on {topic} has no frame_id: its laser is called '{laser}'")
        return laser

    def base(self, odometry_child: str) -> str:
        """The frame that the records call ``base_link``: that one, where tf leads to it."""
        own = _beside(odometry_child, BASE)
        for base in (own, BASE):
            if self.tree.are_connected(odometry_child, base):
                return base
        if odometry_child == _beside(odometry_child, FLOOR) and own in self.tree.frames:
            self._notices.add(f"tf does not join {odometry_child} and {own}: they are taken as one")
            return own
        return odometry_child

    def base_in(self, odometry_child: str) -> FloatArray | None:
        """The base's plane pose (3,) in the odometry's child frame; None where they are one."""
        base = self.base(odometry_child)
        if base == odometry_child or not self.tree.are_connected(base, odometry_child):
            return None
        return pose_from_transform(self.tree.pose_of(base, odometry_child))

    def is_known(self, laser: str, base: str) -> bool:
        """Whether the laser's mounting is given, or can be had from tf."""
        return laser in self._given or self.tree.are_connected(laser, base)

    def mounting(self, laser: str, base: str) -> FloatArray:
        """Transform (4, 4) of the laser in the base on the floor.

        The same array is returned for as long as the mounting stays the same. Raises LogError where
        it is unknown, or the laser on another robot.
        """
        if laser in self._given:
            return self._given[laser]
        if not self.is_known(laser, base):
            raise LogError(self._unknown(laser, base))
        edges = self.tree.path(laser, base)
        if beyond := next((p for p, _ in edges[1] if _last_name(p) in ODOMETRY_FRAMES), None):
            raise LogError(
                f"The laser '{laser}' is not on the robot: tf leads from '{base}' to it only by way "
                f"of '{beyond}', as to another robot; choose the topics of one with --topics."
            )
        known = self._known.get(laser)
        if known is not None and known[0] == edges:
            return known[1]
        try:
            current = self.lift(base) @ self.tree.pose_of(laser, base)
        except ValueError as error:
            raise LogError(
                f"tf in the log gives no usable mounting for {laser}: {error}. "
                f"{SUPPLY.format(laser)}"
            ) from error
        if known is not None:
            if np.allclose(known[1], current, rtol=0, atol=SAME_MOUNTING):
                current = known[1]
            else:
                self._notices.add(f"The mounting of {laser} changes during the log; tf is followed")
        self._known[laser] = edges, current
        return current

    def lift(self, base: str) -> FloatArray:
        """Transform (4, 4) of the base in the frame below it on the floor: its height.

        Taken once: robots that publish how they tilt and bounce still drive on a level floor.
        """
        floor = _beside(base, FLOOR)
        if base not in self._lifts and self._are_in_line(base, floor):
            height = self.tree.pose_of(base, floor)[2, 3]
            self._lifts[base] = transform(np.eye(3), (0.0, 0.0, height))
        return self._lifts.get(base, np.eye(4))

    def _are_in_line(self, base: str, floor: str) -> bool:
        """Whether one is an ancestor of the other; below odometry, heights of two drift apart."""
        return floor in self.tree.ancestors(base) or base in self.tree.ancestors(floor)

    def _unknown(self, laser: str, base: str) -> str:
        known = ", ".join(self.tree.frames) or "none at all"
        name = f"'{laser}'"
        if topic := self._without_frame.get(laser):
            name += f", called by its topic {topic} because its scans have no frame_id,"
        return (
            f"The log has no mounting of the laser {name} on '{base}' (frames of tf: {known}). "
            f"{SUPPLY.format(laser)}"
        )


def odometry_root(tree: FrameTree, lasers: Collection[str]) -> tuple[str, str] | None:
    """The odometry frame in tf and the robot's frame below it, where there are such.

    Of several robots it is that of one of the ``lasers``, given by their frames.
    """
    found = [
        (frame, robot)
        for name in (BASE, FLOOR)
        for robot in sorted((f for f in tree.frames if _last_name(f) == name), key=len)
        for frame in tree.ancestors(robot)[1:]
        if _last_name(frame) in ODOMETRY_FRAMES
    ]
    own = {frame for laser in lasers for frame in tree.ancestors(laser)}
    return next((edge for edge in found if edge[0] in own), found[0] if found else None)


def _last_name(frame: str) -> str:
    """A frame's name without the robot's in front."""
    return frame.rpartition("/")[2]


def _checked(frame: str, matrix: FloatArray) -> FloatArray:
    array = np.asarray(matrix, dtype=float)
    if array.shape != (4, 4) or not is_rigid(array):
        raise LogError(f"The mounting given for '{frame}' is no rigid transform (4, 4).")
    return array
