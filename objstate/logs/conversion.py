"""From ROS messages to records, or to what becomes records once odometry is known."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from objstate.errors import LogError
from objstate.frame_names import frame_name
from objstate.geometry import FloatArray, compose, pose_from_transform
from objstate.logs.beliefs import (
    check_frame,
    gaussian_belief,
    initial_pose,
    particle_cloud_belief,
    plane_pose,
    pose_array_belief,
)
from objstate.logs.definitions import ODOMETRY
from objstate.logs.frames import BASE, FrameTree, Mountings, odometry_root
from objstate.logs.messages import Container, Message, header_ns
from objstate.logs.notices import Notices
from objstate.logs.odometry import Standing
from objstate.logs.ordering import UNSORTED, Arrival, Item, TopicByTopic
from objstate.logs.roles import Roles, check_left_out
from objstate.logs.scans import BeamGeometry, sweep_from
from objstate.logs.survey import Survey, read_tf_until, survey
from objstate.records import GaussianRobotBelief, InitialPose, Odometry, RobotBelief

# ns; header times that shift so far against the recording times are a clock set anew
CLOCK_JUMP_NS = 1_000_000_000

Belief = InitialPose | RobotBelief | GaussianRobotBelief
Handler = Callable[[Message, Any], Iterable[Item]]


class Converter:
    """Turns the messages of one log into items, in the order in which they were recorded.

    Raises LogError at once where a laser's mounting, or odometry in tf, is nowhere in the log. What
    can't be known ahead, in a drive that ``goes_on`` or where a topic's laser changes, is left out
    with a notice.
    """

    def __init__(
        self,
        messages: Container,
        roles: Roles,
        mounts: Mapping[str, FloatArray],
        clock_offsets: Mapping[str, float],
        notices: Notices,
        end: float | None = None,
        *,
        goes_on: bool = False,
    ) -> None:
        self.mountings: dict[str, FloatArray] = {}  # (4, 4) of the lasers read so far
        self._ahead_ns = {
            frame_name(frame): round(ahead * 1e9) for frame, ahead in clock_offsets.items()
        }
        self.messages = messages  # in recorded order, from when it is made on
        self._roles = roles
        self._notices = notices
        self._tree = FrameTree()
        self._mountings = Mountings(self._tree, mounts, notices)
        self._geometry = BeamGeometry()
        self._delays_ns: dict[str, int] = {}  # recording minus header time, the last, by topic
        self._odometry_from: str | None = None  # topic of the last odometry
        self._standing = Standing(roles.odometry or "", notices)
        # stamp of the last scan, by topic and laser
        self._scanned_ns: dict[tuple[str, str], int] = {}
        self._compared: set[str] = set()  # topics of lasers whose clock was compared
        self._sought: set[str] = set()  # lasers whose mounting tf was read ahead for
        self._goes_on = goes_on
        self._look_ahead(end)
        self._handlers = self._handlers_by_topic()

    def arrivals(self) -> Iterator[Arrival]:
        """All items of the log; messages that can't be decoded are dropped with a notice."""
        for message in self.messages.messages(self._handlers.keys()):
            try:
                decoded = self._roles.decoded(message)
            except LogError as error:
                self._notices.drop(f"Message on {message.topic}", str(error))
                continue
            for item in self._handlers[message.topic](message, decoded):
                yield Arrival(item, message.recorded_ns)

    def _look_ahead(self, end: float | None) -> None:
        with self._notices.muted():
            found = self._survey(end)
            if is_merged := not found.is_sorted:
                self.messages = TopicByTopic(self.messages, self._notices)
                found = self._survey(end)
            self._duplicates = {} if self._roles.are_chosen else found.duplicates()
            self._child = found.odometry_child
            self._surveyed_delay_ns = found.delay_ns or 0
            self._odometry_edge = self._find_odometry_in_tf(found.laser_frames.values())
            lasers = found.laser_frames | found.later_frames
            self._seek_mountings(
                [lasers[topic] for topic in lasers if topic not in self._duplicates]
            )
        if is_merged:
            self._notices.add(UNSORTED)
        for topic, used in self._duplicates.items():
            self._notices.add(
                f"{topic} comes from the same laser as {used} and is left out; "
                "--topics chooses otherwise"
            )

    def _survey(self, end: float | None) -> Survey:
        log = self.messages, self._roles, self._mountings
        return survey(*log, end, goes_on=self._goes_on)

    def _find_odometry_in_tf(self, lasers: Collection[str]) -> tuple[str, str] | None:
        """Odometry frame and robot frame in tf; None where there is an odometry topic."""
        if self._roles.odometry is not None:
            return None
        read_tf_until(
            lambda: odometry_root(self._tree, lasers) is not None,
            self.messages,
            self._roles,
            self._tree,
        )
        edge = odometry_root(self._tree, lasers)
        if edge is None:
            roles = self._roles
            check_left_out(roles.types, ODOMETRY, "odometry", are_chosen=roles.are_chosen)
            frames = ", ".join(self._tree.frames) or "none"
            raise LogError(
                "The log has no odometry: no nav_msgs/Odometry, and tf has no frame 'odom' above "
                f"'{BASE}' (its frames: {frames}). Record /odom or /tf."
            )
        self._child = edge[1]
        return edge

    @property
    def _base(self) -> str:
        return self._mountings.base(self._child or BASE)

    def _seek_mountings(self, lasers: Collection[str]) -> None:
        """Read tf ahead until it tells where the lasers are; one of them, in a drive that goes on.

        Raises LogError for a laser without a usable mounting.
        """
        if self._goes_on:
            read_tf_until(
                lambda: not lasers or bool(self._known(lasers)),
                self.messages,
                self._roles,
                self._tree,
            )
            lasers = self._known(lasers)
        for laser in lasers:
            self._seek_mounting(laser)
            self._mountings.mounting(laser, self._base)

    def _known(self, lasers: Collection[str]) -> list[str]:
        """Those whose mounting is known so far."""
        return [laser for laser in lasers if self._mountings.is_known(laser, self._base)]

    def _seek_mounting(self, laser: str) -> None:
        """Read tf ahead, once for each laser, until it tells where the laser is.

        A drive that goes on can't be read ahead for it.
        """
        is_known = self._mountings.is_known(laser, self._base)
        if is_known or self._goes_on or laser in self._sought:
            return
        self._sought.add(laser)
        with self._notices.muted():
            read_tf_until(
                lambda: self._mountings.is_known(laser, self._base),
                self.messages,
                self._roles,
                self._tree,
            )

    def _handlers_by_topic(self) -> dict[str, Handler]:
        roles = self._roles
        handlers: dict[str, Handler] = {}
        handlers |= dict.fromkeys(roles.lasers - self._duplicates.keys(), self._sweeps)
        handlers |= dict.fromkeys(roles.tf, self._transforms)
        if roles.odometry is not None:
            handlers[roles.odometry] = self._odometry
        for topics, convert in (
            (roles.initial_poses, initial_pose),
            (roles.gaussian_beliefs, gaussian_belief),
            (roles.pose_arrays, pose_array_belief),
            (roles.particle_clouds, particle_cloud_belief),
        ):
            handlers |= dict.fromkeys(topics, partial(self._beliefs, convert))
        return handlers

    def _sweeps(self, message: Message, scan: Any) -> Iterator[Item]:
        laser = self._mountings.laser(message.topic, scan)
        self._seek_mounting(laser)
        try:
            self.mountings[laser] = mounting = self._mountings.mounting(laser, self._base)
        except LogError as error:
            self._notices.drop("Scan", str(error).removesuffix("."))
            return
        stamp_ns = self._stamp_ns(message, scan) - self._ahead_ns.get(laser, 0)
        if self._scanned_ns.get((message.topic, laser)) == stamp_ns:
            self._notices.drop("Scan", "a second one of the same stamp")
            return
        self._scanned_ns[message.topic, laser] = stamp_ns
        self._compare_clocks(message.topic, laser)
        sweep = sweep_from(scan, stamp_ns, laser, mounting, self._geometry, self._notices)
        if sweep is not None:
            yield sweep

    def _odometry(self, message: Message, odometry: Any) -> Iterator[Item]:
        if self._child is None:
            self._child = frame_name(odometry.child_frame_id) or BASE
        try:
            pose = np.array(plane_pose(odometry.pose.pose))
            base = self._mountings.base_in(self._child)
        except ValueError as error:
            self._notices.drop("Odometry", str(error))
            return
        self._odometry_from = message.topic
        stamp_ns = self._stamp_ns(message, odometry)
        record = Odometry(stamp_ns, pose if base is None else compose(pose, base))
        velocity = odometry.twist.twist.linear
        self._standing.note(record, math.hypot(velocity.x, velocity.y))
        yield record

    def _transforms(self, message: Message, tf: Any) -> Iterator[Item]:
        for stamped in tf.transforms:
            child = self._tree.update(stamped)
            if self._moves_robot(child):
                yield from self._odometry_from_tf(message, stamped)

    def _moves_robot(self, child: str) -> bool:
        """Whether this frame's transform is the robot's odometry."""
        return (
            self._odometry_edge is not None
            and self._tree.parent(child) == self._odometry_edge[0]
            and child in self._tree.ancestors(self._base)
        )

    def _odometry_from_tf(self, message: Message, stamped: Any) -> Iterator[Item]:
        assert self._odometry_edge is not None
        try:
            in_odom = self._tree.pose_of(self._base, self._odometry_edge[0])
        except ValueError as error:
            self._notices.drop("Odometry", str(error))
            return
        self._odometry_from = message.topic
        stamp_ns = self._stamp_ns(message, stamped)
        yield Odometry(stamp_ns, pose_from_transform(in_odom))

    def _beliefs(
        self, convert: Callable[[Any, int], Belief], message: Message, decoded: Any
    ) -> Iterator[Item]:
        try:
            check_frame(decoded)
            belief = convert(decoded, self._stamp_ns(message, decoded))
        except ValueError as error:
            self._notices.drop(f"Belief on {message.topic}", str(error))
            return
        if not isinstance(belief, RobotBelief) and belief.covariance is None:
            self._notices.add(
                f"{message.topic} has a variance of 0: the error of its pose is taken as unknown"
            )
        yield belief

    def _stamp_ns(self, message: Message, stamped: Any) -> int:
        """The header's time; where it is zero, the recorder's, on the clock of the headers."""
        stamp_ns = header_ns(stamped)
        if stamp_ns == 0:
            self._notices.add(
                f"A message on {message.topic} has no header time: its recording time is used"
            )
            return message.recorded_ns - self._between_clocks_ns
        delay_ns = message.recorded_ns - stamp_ns
        if abs(delay_ns - self._delays_ns.get(message.topic, delay_ns)) > CLOCK_JUMP_NS:
            self._notices.add(
                f"Header times of {message.topic} jump by more than {CLOCK_JUMP_NS / 1e9:g} s "
                "against the recording times"
            )
        self._delays_ns[message.topic] = delay_ns
        return stamp_ns

    @property
    def _between_clocks_ns(self) -> int:
        """Recording minus header time, where they are by different clocks, as in simulations."""
        delay_ns = self._delays_ns.get(self._odometry_from or "", self._surveyed_delay_ns)
        return delay_ns if abs(delay_ns) > CLOCK_JUMP_NS else 0

    def _compare_clocks(self, topic: str, laser: str) -> None:
        """Note where a laser's stamps, as corrected, are of another clock than the odometry's."""
        delay_ns = self._delays_ns.get(topic)
        odometry_ns = self._delays_ns.get(self._odometry_from or "")
        if delay_ns is None or odometry_ns is None or topic in self._compared:
            return
        self._compared.add(topic)
        ahead_ns, given_ns = odometry_ns - delay_ns, self._ahead_ns.get(laser, 0)
        off_ns = ahead_ns - given_ns
        if abs(off_ns) > CLOCK_JUMP_NS:
            corrected = f", set back by {given_ns / 1e9:g} s," if given_ns else ""
            self._notices.add(
                f"By their recording times, header times of {topic}{corrected} are "
                f"{abs(off_ns) / 1e9:.1f} s {'ahead of' if off_ns > 0 else 'behind'} those of "
                f"{self._odometry_from}: its scans are placed in odometry of another time, and its "
                "estimates are wrong. Synchronize the clocks and record again, or give "
                f"--clock-offset {laser}={ahead_ns / 1e9:.2f}, which is right to tenths of a second"
            )
