"""What each topic of a log is good for, found by message type."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from objstate.errors import LogError
from objstate.logs.definitions import (
    LASER_SCAN,
    ODOMETRY,
    PARTICLE_CLOUD,
    POSE_ARRAY,
    POSE_WITH_COVARIANCE,
    TF,
    USED_TYPES,
)
from objstate.logs.messages import Message
from objstate.logs.notices import Notices

# what makes scans of other sensor data, in ROS, by its type
MAKERS_OF_SCANS = {
    "sensor_msgs/msg/PointCloud2": "pointcloud_to_laserscan",
    "sensor_msgs/msg/MultiEchoLaserScan": "laser_proc",
}

# how localization packages call the topic of their samples
CLOUD_NAMES = ("particlecloud", "particle_cloud", "particles")


@dataclass(frozen=True)
class Roles:
    """The topics that records are made from."""

    lasers: frozenset[str]
    odometry: str | None  # None: odometry comes from tf
    tf: frozenset[str]
    initial_poses: frozenset[str]
    gaussian_beliefs: frozenset[str]
    pose_arrays: frozenset[str]
    particle_clouds: frozenset[str]
    are_chosen: bool  # by the user, not found by type
    types: Mapping[str, str]  # of the topics, by name

    def decoded(self, message: Message) -> Any:
        """A message's content. Raises LogError for damage, or another type than its topic's."""
        expected = self.types[message.topic]
        if message.type != expected:
            raise LogError(f"it is of type {message.type}, and others there are of {expected}")
        return message.decode()

    @property
    def telling(self) -> frozenset[str]:
        """The topics with information about frames."""
        odometry = {self.odometry} if self.odometry else set()
        return self.lasers | self.tf | odometry


def check_left_out(types: Mapping[str, str], kind: str, what: str, *, are_chosen: bool) -> None:
    """Raise LogError where the log has messages of a type that no chosen topic has."""
    left_out = _of_type(types, kind)
    if are_chosen and left_out:
        raise LogError(
            f"The topics that --topics chooses hold no {what}; add {' or '.join(sorted(left_out))}."
        )


def find_roles(types: Mapping[str, str], chosen: Collection[str] | None, notices: Notices) -> Roles:
    """Roles by the topics' types, among the ``chosen`` ones if any; the lasers' tf is always read.

    Raises LogError where the log is empty, a chosen topic is not in it or of no use, where no
    topic holds scans or those of several robots do, and where neither odometry nor tf is there.
    """
    if not types:
        raise LogError(f"The log holds no messages; record it again.{notices.sentences()}")
    if chosen is not None:
        _check_chosen(chosen, types)
    usable = {t: name for t, name in types.items() if chosen is None or t in chosen}
    lasers = _of_type(usable, LASER_SCAN)
    if not lasers:
        check_left_out(types, LASER_SCAN, "laser scans", are_chosen=chosen is not None)
        raise LogError(
            f"No topic holds laser scans ({LASER_SCAN}). {_made_of_others(types)}{_listed(types)}"
        )
    tf = _tf_of(lasers, types)
    odometry = odometry_topic(_of_type(usable, ODOMETRY), notices)
    if odometry is None and not tf:
        check_left_out(types, ODOMETRY, "odometry", are_chosen=chosen is not None)
        raise LogError(
            f"No topic holds odometry ({ODOMETRY}, or {TF[0]} with the frame 'odom'). "
            f"{_listed(types)}"
        )
    with_covariance = _of_type(usable, POSE_WITH_COVARIANCE)
    initial = frozenset(topic for topic in with_covariance if _last_name(topic) == "initialpose")
    return Roles(
        lasers=lasers,
        odometry=odometry,
        tf=tf,
        initial_poses=initial,
        gaussian_beliefs=with_covariance - initial,
        pose_arrays=_belief_arrays(_of_type(usable, POSE_ARRAY), chosen),
        particle_clouds=_of_type(usable, PARTICLE_CLOUD),
        are_chosen=chosen is not None,
        types=types,
    )


def _tf_of(lasers: frozenset[str], types: Mapping[str, str]) -> frozenset[str]:
    """The tf topics in whose namespaces the lasers are; all, where there are none such.

    Raises LogError where the lasers are in the namespaces of several robots, each with its tf.
    """
    tf = sorted((topic for topic, name in types.items() if name in TF), key=len)
    around = [[t for t in tf if laser.lstrip("/").startswith(_namespace(t))] for laser in lasers]
    robots = {next(filter(None, map(_namespace, topics)), "") for topics in around} - {""}
    if len(robots) > 1:
        raise LogError(
            f"The log has scans and tf of several robots ({', '.join(sorted(robots))}); choose the "
            "topics of one with --topics."
        )
    return frozenset(topic for topics in around for topic in topics) or frozenset(tf)


def _namespace(topic: str) -> str:
    """What stands before a topic's last name: ``robot1/`` of ``/robot1/tf``."""
    return "".join(topic.lstrip("/").rpartition("/")[:2])


def odometry_topic(topics: Collection[str], notices: Notices) -> str | None:
    """Of several odometry topics the one called ``odom``, else the rawest, with a notice."""
    if len(topics) <= 1:
        return next(iter(topics), None)
    named = [topic for topic in topics if _last_name(topic) == "odom"]
    best = preferred(named or topics)
    if len(named) != 1:
        others = ", ".join(sorted(set(topics) - {best}))
        notices.add(f"Odometry is taken from {best}, not from {others}; --topics chooses otherwise")
    return best


def preferred(topics: Collection[str]) -> str:
    """Of topics that hold the same data, the rawest: processing lengthens names."""
    return min(topics, key=lambda topic: (len(topic), topic))


def _check_chosen(chosen: Collection[str], types: Mapping[str, str]) -> None:
    if isinstance(chosen, str):
        raise LogError(f"Topics are given as the text '{chosen}'; give a list, as ['{chosen}'].")
    for topic in chosen:
        if topic not in types:
            raise LogError(f"The log has no topic '{topic}'. {_listed(types)}")
        if types[topic] not in USED_TYPES:
            raise LogError(
                f"The topic '{topic}' is of type {types[topic]}, which is not used. "
                f"{_listed(types)}"
            )


def _made_of_others(types: Mapping[str, str]) -> str:
    """Sentences that say how scans are made of what other topics hold."""
    return "".join(
        f"Play {topic} ({name}) into the ROS package {MAKERS_OF_SCANS[name]}, and record the scans "
        "that it makes. "
        for topic, name in sorted(types.items())
        if name in MAKERS_OF_SCANS
    )


def _listed(types: Mapping[str, str]) -> str:
    usable = sorted(f"{topic} ({name})" for topic, name in types.items() if name in USED_TYPES)
    return f"Usable topics in the log: {', '.join(usable) or 'none'}."


def _of_type(types: Mapping[str, str], wanted: str) -> frozenset[str]:
    return frozenset(topic for topic, name in types.items() if name == wanted)


def _belief_arrays(topics: frozenset[str], chosen: Collection[str] | None) -> frozenset[str]:
    if chosen is not None or len(topics) == 1:
        return topics
    return frozenset(topic for topic in topics if _last_name(topic) in CLOUD_NAMES)


def _last_name(topic: str) -> str:
    return topic.rpartition("/")[2]
