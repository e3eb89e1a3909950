"""Small valid files of every kind that objstate reads, to be mutated."""

from __future__ import annotations

import bz2
import gzip
import sqlite3
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import lz4.frame
import zstandard
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from tests.logs.conftest import Drive

MAP_YAML = """image: map.pgm
resolution: 0.05
origin: [-1.0, -2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
mode: trinary
"""
DOORS = """door,hinge_x,hinge_y,closed_bearing_deg,opens,width_m,upper_limit_deg
door_1,-0.8,-1.8,0,ccw,0.3,90
door_2,-0.2,-1.8,180,cw,0.3,120
"""
URDF = """<?xml version="1.0"?>
<robot name="room">
  <link name="walls">
    <collision><origin xyz="2 0 1.25"/><geometry><box size="0.1 4 2.5"/></geometry></collision>
    <collision><origin xyz="-2 0 1.25" rpy="0 0 0.1"/><geometry><box size="0.1 4 2.5"/></geometry></collision>
    <visual><geometry><cylinder radius="0.2" length="2.5"/></geometry></visual>
  </link>
  <link name="leaf">
    <collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></collision>
  </link>
  <joint name="door_1" type="revolute">
    <parent link="walls"/><child link="leaf"/><origin xyz="1.95 0.5 0" rpy="0 0 1.57"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1.57" effort="1" velocity="1"/>
  </joint>
  <link name="rail"><collision><geometry><box size="0.9 0.04 2"/></geometry></collision></link>
  <joint name="slide" type="prismatic">
    <parent link="walls"/><child link="rail"/><origin xyz="-1 -1 1"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="0.9"/>
  </joint>
  <link name="ball"><collision><geometry><sphere radius="0.3"/></geometry></collision></link>
  <joint name="chair" type="planar"><parent link="walls"/><child link="ball"/><origin xyz="0 1 0.3"/></joint>
</robot>
"""
SETTINGS = """beam_model: {model: mixture, z_hit: 0.8, sigma_hit: 0.05}
localization:
  min_particles: 100
  max_particles: 2000
  alpha1: 0.02
object_updates: {schedule: [front, rear]}
objects:
  - {match: "door_*", dynamics: {moves_per_hour: 4.0}, rest: {closed: 0.5}}
  - match: "chair*"
    prior: gaussian
    prior_std_m: 0.3
    presence: 0.9
"""
SCENE = """building: room.urdf
seed: 1
route:
  speed: 0.7 # m/s
  waypoints:
    - {x: 0.5, y: 0.0, pause: 1.0}
    - {x: 1.0, y: 0.0, kidnapped_to: {x: 0.0, y: 0.0, yaw: 1.0}}
    - {x: 0.5, y: 0.5}
odometry: {rate: 15.0, drift: 0.002, publish_tf: true}
lasers:
  - {frame: front, mount: {x: 0.22, z: 0.3}, beams: 18, range_max: 8.0, rate: 5.0}
objects:
  - {name: "door_*", initial: 0.5, changes: [{at: 2.0, to: 1.0, duration: 1.0}]}
  - {name: chair, initial: {x: 0.1, y: 0.2}}
people:
  - {route: [[0, 0], [1, 1]], speed: 1.0}
  - {count: 2, region: [0, 0, 1, 1]}
boxes:
  - {size: [0.3, 0.3, 0.5], pose: {x: 1, y: 1}}
belief: {rate: 2.0, count: 10}
start_time: 1600000000
"""
TRUTH = """stamp,object,coordinate,value
1600000000000000000,door_1,angle,0.5
1600000001000000000,door_1,angle,1.0
1600000000000000000,chair,x,0.1
1600000000000000000,chair,yaw,-0.3
"""
PATH = """# stamp tx ty tz qx qy qz qw
1600000000.000000000 0.0 0.0 0 0 0 0.0 1.0
1600000000.100000000 0.1 0.0 0 0 0 0.049979 0.998750
1600000000.200000000 0.2 -1e-3 0 0 0 0.1 0.99
"""
MANIFEST = """log,name,building,truth,path,settings,initial_pose,global,seed
a.mcap,mon,room.urdf,truth.csv,path.tum,settings.yaml,"1,2,90deg",,3
b.bag,tue,room.urdf,,,,,yes,
s3://bucket/c.mcap,,room.urdf,,,,"0,0,0",no,7
"""
CALIBRATION = """lasers:
  front:
    mount: {x: 0.2, y: 0.0, z: 0.3, roll_deg: 0.0, pitch_deg: 0.0, yaw_deg: 1.5}
    clock_offset: 0.01
    correction: {x: 0.01, y: 0.0, yaw_deg: 0.1, clock: 0.01}
    std: {x: 0.01, y: 0.01, yaw_deg: 0.1, clock: 0.01}
    not_told: [x]
"""
STL = """solid leaf
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0.5
endloop
endfacet
endsolid leaf
"""
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0.5\nvn 0 0 1\nf 1 2 3\nf 1//1 2//1 3//1\n"
CARMEN = """# a log
PARAM robot_frontlaser_offset 0.1 1600000000.0 host 0
PARAM robot_front_laser_max 50.0
ODOM 0.0 0.0 0.0 0.5 0.0 0.0 1600000000.000000 host 0.0
FLASER 3 1.0 2.0 3.0 0.1 0.0 0.0 0.0 0.0 0.0 1600000000.100000 host 0.1
ODOM 0.1 0.0 0.0 0.5 0.0 0.0 1600000000.200000 host 0.2
RLASER 3 1.0 2.0 81.91 -0.1 0.0 3.14 0.1 0.0 0.0 1600000000.300000 host 0.3
ROBOTLASER1 0 -1.57 3.14 1.57 80.0 0.01 0 3 1.0 2.0 3.0 0 0.3 0 0 0.2 0 0 0 0 0 0 0 1600000000.4 host 0.4
ODOM 0.3 0.0 0.1 0.5 0.0 0.0 1600000000.500000 host 0.5
FLASER 3 1.5 2.5 3.5 0.4 0.0 0.1 0.3 0.0 0.1 1600000000.600000 host 0.6
"""


def drive() -> Drive:
    """Every type of message that is used, once or a few times."""
    made = Drive().tf(0.0, "base_link", "laser", (0.2, 0.0, 0.3))
    made.pose_with_covariance(0.0, 0.1, 0.2, 0.3, topic="/initialpose")
    for step in range(5):
        made.odometry(0.1 * step, x=0.1 * step)
        made.tf(0.1 * step, "odom", "base_link", (0.1 * step, 0.0, 0.0), topic="/tf")
        if step % 2 == 0:
            made.scan(0.1 * step)
    made.pose_array(0.3, [(0.0, 0.0, 0.0), (0.1, 0.0, 0.1)])
    return made.particle_cloud(0.4, [(0.0, 0.0, 0.0), (0.1, 0.0, 0.1)], [0.5, 0.5])


def _mcap(wire: str = "cdr", *, with_definitions: bool = False, **options: object) -> bytes:
    """Without definitions the file is short, and most mutations meet something else."""
    made = drive()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        if with_definitions:
            compression = options.get("compression", CompressionType.NONE)
            made.mcap(path, wire=wire, compression=compression, chunk_size=1024, enable_crcs=False)
            return path.read_bytes()
        with path.open("wb") as file:
            writer = McapWriter(file, chunk_size=1024, enable_crcs=False, **options)
            writer.start()
            channels: dict[str, int] = {}
            for topic, kind, ns, data in made.cdr() if wire == "cdr" else made.ros1():
                if topic not in channels:
                    schema = writer.register_schema(kind, "ros2msg" if wire == "cdr" else "", b"")
                    channels[topic] = writer.register_channel(topic, wire, schema)
                writer.add_message(channels[topic], ns, data, ns)
            writer.finish()
        return path.read_bytes()


def mcap() -> list[bytes]:
    none, zstd, lz4 = CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4
    return [
        *[_mcap(compression=none)] * 3,
        _mcap(compression=zstd),
        _mcap(compression=lz4),
        _mcap(use_chunking=False),
        _mcap("ros1", compression=none),
        _mcap(with_definitions=True),
    ]


def _bag1(method: str = "none", compress: Callable[[bytes], bytes] = bytes) -> bytes:
    """Chunks of a few messages, and no index."""
    made = drive()
    numbers: dict[str, int] = {}
    chunks, chunk = b"", b""
    for topic, kind, ns, data in made.ros1():
        if topic not in numbers:
            numbers[topic] = len(numbers)
            described = {"topic": topic, "type": kind.replace("/msg/", "/"), "md5sum": "*"}
            fields = {key: value.encode() for key, value in described.items()}
            fields["message_definition"] = b""
            header = {"op": b"\7", "conn": _uint32(numbers[topic]), "topic": topic.encode()}
            chunk += _record(header, _header(fields))
        time = _uint32(ns // 10**9) + _uint32(ns % 10**9)
        chunk += _record({"op": b"\2", "conn": _uint32(numbers[topic]), "time": time}, data)
        if len(chunk) > 1024:
            chunks += _chunk(method, chunk, compress)
            chunk = b""
    return b"#ROSBAG V2.0\n" + chunks + _chunk(method, chunk, compress)


def _chunk(method: str, plain: bytes, compress: Callable[[bytes], bytes]) -> bytes:
    header = {"op": b"\5", "compression": method.encode(), "size": _uint32(len(plain))}
    return _record(header, compress(plain))


def _record(header: dict[str, bytes], data: bytes) -> bytes:
    fields = _header(header)
    return _uint32(len(fields)) + fields + _uint32(len(data)) + data


def _header(fields: dict[str, bytes]) -> bytes:
    named = (key.encode() + b"=" + value for key, value in fields.items())
    return b"".join(_uint32(len(field)) + field for field in named)


def _uint32(number: int) -> bytes:
    return number.to_bytes(4, "little")


def _indexed_bag1() -> bytes:
    """With definitions and an index, as recorders write it."""
    with TemporaryDirectory() as folder:
        return Drive().straight(0.4).bag1(Path(folder) / "a.bag", chunk_size=1024).read_bytes()


def bag1() -> list[bytes]:
    plain = _bag1()
    return [
        *[plain] * 3, _bag1("bz2", bz2.compress), _bag1("lz4", lz4.frame.compress), _indexed_bag1()
    ]  # fmt: skip


def _bag2(compress: Callable[[bytes], bytes] = bytes, *, with_definitions: bool = False) -> bytes:
    """In pages as small as they can be."""
    made = drive()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.db3"
        database = sqlite3.connect(path)
        database.executescript(
            "PRAGMA page_size = 512; CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT "
            "NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles "
            "TEXT NOT NULL); CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT "
            "NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL); CREATE INDEX timestamp_idx ON "
            "messages (timestamp ASC);"
        )
        numbers: dict[str, int] = {}
        for topic, kind, ns, data in made.cdr():
            if topic not in numbers:
                numbers[topic] = len(numbers) + 1
                row = numbers[topic], topic, kind, "cdr", ""
                database.execute("INSERT INTO topics VALUES (?, ?, ?, ?, ?)", row)
            database.execute(
                "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
                (numbers[topic], ns, compress(data)),
            )
        if with_definitions:
            database.execute(
                "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding "
                "TEXT, encoded_message_definition TEXT, type_description_hash TEXT)"
            )
            text = "geometry_msgs/TransformStamped[] transforms\n"
            row = "tf2_msgs/msg/TFMessage", "ros2msg", text, ""
            database.execute("INSERT INTO message_definitions VALUES (1, ?, ?, ?, ?)", row)
        database.commit()
        database.close()
        return path.read_bytes()


def bag2() -> list[bytes]:
    return [
        *[_bag2()] * 3,
        _bag2(with_definitions=True),
        _bag2(zstandard.compress),
        zstandard.compress(_bag2()),
    ]


def metadata() -> list[bytes]:
    with TemporaryDirectory() as folder:
        return [(drive().bag2(Path(folder) / "a") / "metadata.yaml").read_bytes()]


def carmen() -> list[bytes]:
    plain = CARMEN.encode()
    return [plain, plain, plain, gzip.compress(plain, mtime=0)]


def picture() -> bytes:
    """A room of 40 by 40 cells, as PGM."""
    rows = [bytes(40)] + [bytes(1) + b"\xfe" * 38 + bytes(1)] * 38 + [bytes(40)]
    return b"P5\n# a map\n40 40\n255\n" + b"".join(rows)


def pictures() -> list[bytes]:
    from io import BytesIO

    from PIL import Image

    file = BytesIO()
    with Image.open(BytesIO(picture())) as image:
        image.save(file, "PNG")
    return [picture(), file.getvalue()]


def parquet_manifest() -> bytes:
    from io import BytesIO

    import polars as pl

    file = BytesIO()
    pl.read_csv(MANIFEST.encode(), infer_schema=False).write_parquet(file)
    return file.getvalue()
