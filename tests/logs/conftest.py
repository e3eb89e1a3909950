"""A small drive that tests put together message by message and write in any format."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROS2 = get_typestore(Stores.ROS2_HUMBLE)
ROS2.register(
    get_types_from_msg("geometry_msgs/Pose pose\nfloat64 weight", "nav2_msgs/msg/Particle")
    | get_types_from_msg(
        "std_msgs/Header header\nnav2_msgs/Particle[] particles", "nav2_msgs/msg/ParticleCloud"
    )
)
ROS1 = get_typestore(Stores.ROS1_NOETIC)
ROS1.register(
    get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
)
TYPES = ROS2.types

START_NS = 1_700_000_000_000_000_000


def stamp(t: float):
    ns = START_NS + round(t * 1e9)
    return TYPES["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)


def header(t: float | None, frame: str):
    time = TYPES["builtin_interfaces/msg/Time"](sec=0, nanosec=0) if t is None else stamp(t)
    return TYPES["std_msgs/msg/Header"](stamp=time, frame_id=frame)


def turned(yaw: float = 0.0, roll: float = 0.0):
    cy, sy, cr, sr = (f(a / 2) for a in (yaw, roll) for f in (math.cos, math.sin))
    return TYPES["geometry_msgs/msg/Quaternion"](x=cy * sr, y=sy * sr, z=sy * cr, w=cy * cr)


def pose(x: float, y: float, yaw: float):
    point = TYPES["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
    return TYPES["geometry_msgs/msg/Pose"](position=point, orientation=turned(yaw))


@dataclass
class Drive:
    """Messages in recorded order: topic, type, recording time (ns), object."""

    messages: list[tuple[str, str, int, object]] = field(default_factory=list)
    silent: list[tuple[str, str]] = field(default_factory=list)  # topics without any, and types

    def add(self, topic: str, kind: str, recorded: float, message: object) -> Drive:
        self.messages.append((topic, kind, START_NS + round(recorded * 1e9), message))
        return self

    def scan(self, t, ranges=(1.0, 2.0, 3.0), *, topic="/scan", frame="laser", recorded=None, **f):
        fields = {
            "angle_min": -math.pi / 2,
            "angle_max": math.pi / 2,
            "angle_increment": math.pi / max(len(ranges) - 1, 1),
            "time_increment": 0.0,
            "scan_time": 0.1,
            "range_min": 0.1,
            "range_max": 10.0,
            "ranges": np.array(ranges, np.float32),
            "intensities": np.zeros(0, np.float32),
        } | f
        kind = "sensor_msgs/msg/LaserScan"
        message = TYPES[kind](header=header(t, frame), **fields)
        return self.add(topic, kind, (t or 0.0) if recorded is None else recorded, message)

    def odometry(
        self,
        t,
        x=0.0,
        y=0.0,
        yaw=0.0,
        *,
        topic="/odom",
        child="base_link",
        recorded=None,
        speed=0.0,
    ):
        kind = "nav_msgs/msg/Odometry"
        ahead = TYPES["geometry_msgs/msg/Vector3"](x=speed, y=0.0, z=0.0)
        still = TYPES["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
        message = TYPES[kind](
            header=header(t, "odom"),
            child_frame_id=child,
            pose=TYPES["geometry_msgs/msg/PoseWithCovariance"](
                pose=pose(x, y, yaw), covariance=np.zeros(36)
            ),
            twist=TYPES["geometry_msgs/msg/TwistWithCovariance"](
                twist=TYPES["geometry_msgs/msg/Twist"](linear=ahead, angular=still),
                covariance=np.zeros(36),
            ),
        )
        return self.add(topic, kind, (t or 0.0) if recorded is None else recorded, message)

    def tf(self, t, parent, child, xyz=(0.0, 0.0, 0.0), yaw=0.0, roll=0.0, *, topic="/tf_static"):
        kind = "tf2_msgs/msg/TFMessage"
        x, y, z = xyz
        transform = TYPES["geometry_msgs/msg/Transform"](
            translation=TYPES["geometry_msgs/msg/Vector3"](x=x, y=y, z=z),
            rotation=turned(yaw, roll),
        )
        stamped = TYPES["geometry_msgs/msg/TransformStamped"](
            header=header(t, parent), child_frame_id=child, transform=transform
        )
        return self.add(topic, kind, t, TYPES[kind](transforms=[stamped]))

    def pose_with_covariance(
        self, t, x, y, yaw, *, topic, frame="map", recorded=None, variances=(0.25, 0.25, 0.07)
    ):
        kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
        covariance = np.zeros(36)
        covariance[[0, 7, 35]] = variances
        covariance[[1, 6]] = 0.2 * max(variances[0], 0.0)
        message = TYPES[kind](
            header=header(t, frame),
            pose=TYPES["geometry_msgs/msg/PoseWithCovariance"](
                pose=pose(x, y, yaw), covariance=covariance
            ),
        )
        return self.add(topic, kind, (t or 0.0) if recorded is None else recorded, message)

    def pose_array(self, t, poses, *, topic="/particlecloud", frame="map"):
        kind = "geometry_msgs/msg/PoseArray"
        message = TYPES[kind](header=header(t, frame), poses=[pose(*p) for p in poses])
        return self.add(topic, kind, t, message)

    def particle_cloud(self, t, poses, weights, *, topic="/particle_cloud"):
        kind = "nav2_msgs/msg/ParticleCloud"
        particles = [
            TYPES["nav2_msgs/msg/Particle"](pose=pose(*p), weight=w)
            for p, w in zip(poses, weights, strict=True)
        ]
        return self.add(topic, kind, t, TYPES[kind](header=header(t, "map"), particles=particles))

    def echoes(self, t, *, topic="/echoes", frame="laser"):
        kind = "sensor_msgs/msg/MultiEchoLaserScan"
        angles = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time")
        numbers = dict.fromkeys((*angles, "range_min", "range_max"), 0.0)
        message = TYPES[kind](header=header(t, frame), ranges=[], intensities=[], **numbers)
        return self.add(topic, kind, t, message)

    def grid(self, t, percent, *, topic="/map", resolution=0.05, origin=(0.0, 0.0, 0.0)):
        kind = "nav_msgs/msg/OccupancyGrid"
        info = TYPES["nav_msgs/msg/MapMetaData"](
            map_load_time=stamp(t),
            resolution=resolution,
            width=percent.shape[1],
            height=percent.shape[0],
            origin=pose(*origin),
        )
        message = TYPES[kind](header=header(t, "map"), info=info, data=percent.ravel())
        return self.add(topic, kind, t, message)

    def straight(self, seconds: float = 3.0) -> Drive:
        """The robot drives along x at 1 m/s: odometry at 20 Hz, scans at 5 Hz."""
        self.tf(0.0, "base_link", "laser", (0.2, 0.0, 0.3))
        for step in range(round(seconds * 20) + 1):
            t = step / 20
            self.odometry(t, x=t)
            if step % 4 == 0:
                self.scan(t)
        return self

    def cdr(self) -> list[tuple[str, str, int, bytes]]:
        return [
            (topic, kind, ns, bytes(ROS2.serialize_cdr(message, kind)))
            for topic, kind, ns, message in self.messages
        ]

    def ros1(self) -> list[tuple[str, str, int, bytes]]:
        return [
            (topic, kind, ns, bytes(ROS2.cdr_to_ros1(data, kind)))
            for topic, kind, ns, data in self.cdr()
        ]

    def mcap(
        self,
        path: Path,
        *,
        wire: str = "cdr",
        compression: CompressionType = CompressionType.NONE,
        chunk_size: int = 4096,
        extra_json: bool = False,
        **options: bool,
    ) -> Path:
        messages = self.cdr() if wire == "cdr" else self.ros1()
        with path.open("wb") as file:
            writer = McapWriter(file, chunk_size=chunk_size, compression=compression, **options)
            writer.start()
            channels = {}
            for topic, kind in self.silent:
                schema = writer.register_schema(*schema_of(kind, wire))
                writer.register_channel(topic, wire, schema)
            for topic, kind, ns, data in messages:
                if topic not in channels:
                    schema = writer.register_schema(*schema_of(kind, wire))
                    channels[topic] = writer.register_channel(topic, wire, schema)
                writer.add_message(channels[topic], ns, data, ns)
            if extra_json:
                schema = writer.register_schema("Note", "jsonschema", b"{}")
                channel = writer.register_channel("/note", "json", schema)
                writer.add_message(channel, START_NS, b"{}", START_NS)
            writer.finish()
        return path

    def bag1(self, path: Path, compression: str | None = None, chunk_size: int = 4096) -> Path:
        writer = Bag1Writer(path)
        writer.chunk_threshold = chunk_size
        if compression:
            writer.set_compression(Bag1Writer.CompressionFormat[compression.upper()])
        with writer:
            connections = {}
            for topic, kind in self.silent:
                text, md5 = ROS1.generate_msgdef(kind)
                writer.add_connection(topic, kind, msgdef=text, md5sum=md5)
            for topic, kind, ns, data in self.ros1():
                if topic not in connections:
                    text, md5 = ROS1.generate_msgdef(kind)
                    connections[topic] = writer.add_connection(topic, kind, msgdef=text, md5sum=md5)
                writer.write(connections[topic], ns, data)
        return path

    def bag2(self, path: Path, storage: str = "SQLITE3", compression: str | None = None) -> Path:
        writer = Bag2Writer(path, version=9, storage_plugin=StoragePlugin[storage])
        if compression:
            writer.set_compression(CompressionMode[compression], CompressionFormat.ZSTD)
        with writer:
            connections = {}
            for topic, kind in self.silent:
                writer.add_connection(topic, kind, typestore=ROS2)
            for topic, kind, ns, data in self.cdr():
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=ROS2)
                writer.write(connections[topic], ns, data)
        return path


def schema_of(kind: str, wire: str) -> tuple[str, str, bytes]:
    if wire == "cdr":
        return kind, "ros2msg", ROS2.generate_msgdef(kind, ros_version=2)[0].encode()
    return kind.replace("/msg/", "/"), "ros1msg", ROS1.generate_msgdef(kind)[0].encode()


@pytest.fixture
def drive() -> Drive:
    return Drive()


@pytest.fixture
def new_drive() -> type[Drive]:
    return Drive


@pytest.fixture
def start_ns() -> int:
    return START_NS


@pytest.fixture(scope="session")
def data() -> Path:
    folder = Path(__file__).parents[2].parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"the recorded data is not at {folder}")
    return folder
