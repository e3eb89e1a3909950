"""What a log may cost is bounded by its size, whatever it says of itself."""

from __future__ import annotations

import bz2
import gzip
import resource
import sqlite3
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import lz4.frame
import pytest
import zstandard

from objstate.errors import LogError
from objstate.logs import decompression, inspect_log, open_log, open_messages
from objstate.logs.decompression import USUAL_CHUNK, decompress, most_unpacked
from objstate.logs.definitions import MessageType

METHODS: dict[str, Callable[[bytes], bytes]] = {
    "bz2": bz2.compress,
    "lz4": lz4.frame.compress,
    "zstd": zstandard.compress,
}
TABLES = (
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);"
    "INSERT INTO topics VALUES (1, '/scan', 'sensor_msgs/msg/LaserScan', 'cdr');"
)
MESSAGES = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data);"


@contextmanager
def within_bounds() -> Iterator[None]:
    """Ten seconds and 500 MB."""
    began, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    assert time.process_time() - began < 10
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000


@pytest.mark.parametrize("method", METHODS)
def test_no_more_is_unpacked_than_a_chunk_may_hold(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decompression, "MOST_UNPACKED", 2**23)
    plain, damage = decompress(method, METHODS[method](bytes(2**24)), 10**10)
    assert plain == bytes(2**23)
    assert "more than" in damage


@pytest.mark.parametrize("method", METHODS)
def test_a_header_that_announces_little_bounds_what_is_unpacked(method: str) -> None:
    packed = METHODS[method](bytes(4 * USUAL_CHUNK))
    assert len(decompress(method, packed, 100)[0]) == USUAL_CHUNK
    assert decompress(method, packed, 4 * USUAL_CHUNK) == (bytes(4 * USUAL_CHUNK), "")


def zeros(megabytes: int) -> bytes:
    """As zstd packs them, without having them all at once."""
    packer = zstandard.ZstdCompressor().compressobj()
    return b"".join([packer.compress(bytes(2**20)) for _ in range(megabytes)]) + packer.flush()


def mcap_bomb() -> bytes:
    packed = zeros(3000)
    chunk = struct.pack("<QQQI", 0, 0, 3000 * 2**20, 0) + struct.pack("<I", 4) + b"zstd"
    chunk += struct.pack("<Q", len(packed)) + packed
    return b"\x89MCAP0\r\n" + struct.pack("<BQ", 6, len(chunk)) + chunk


def bag_bomb() -> bytes:
    packed = bz2.compress(bytes(2 * USUAL_CHUNK))
    fields = (b"op=\x05", b"compression=bz2", b"size=" + struct.pack("<I", 100))
    header = b"".join(struct.pack("<I", len(field)) + field for field in fields)
    record = struct.pack("<I", len(header)) + header + struct.pack("<I", len(packed)) + packed
    return b"#ROSBAG V2.0\n" + record


@pytest.mark.parametrize("make", [mcap_bomb, bag_bomb])
def test_a_chunk_of_gigabytes_is_unpacked_to_its_bound(
    make: Callable[[], bytes], tmp_path: Path
) -> None:
    path = tmp_path / "bomb"
    path.write_bytes(make())
    messages = open_messages(path)
    with within_bounds():
        assert list(messages) == []
    assert any("more than" in warning for warning in messages.warnings)


def test_a_storage_file_that_unpacks_without_end_is_cut(tmp_path: Path) -> None:
    path = tmp_path / "a.db3.zstd"
    path.write_bytes(zeros(most_unpacked(0) // 2**20 + 16))
    with pytest.raises(LogError, match=r"a\.db3\.zstd") as caught:
        list(open_messages(path))
    assert "/tmp/objstate-" not in str(caught.value)


def test_a_gzipped_line_without_end_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.log.gz"
    line = b"FLASER 2 1 2 0 0 0 0 0 0 1.5 host 1.5\n"
    path.write_bytes(
        gzip.compress(line + bytes(100 * 2**20) + b"\n" + line.replace(b"1.5", b"2.5"))
    )
    messages = open_messages(path)
    with within_bounds():
        assert sum(message.topic == "/scan" for message in messages) == 2
    assert any("a line of more than" in warning for warning in messages.warnings)


ENDLESS = "WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) SELECT id"
VIEWS = {
    "rows without end": f"CREATE VIEW messages AS {ENDLESS}, 1 AS topic_id, 1 AS timestamp, "
    "x'00' AS data FROM n;",
    "no row, without end": f"CREATE VIEW messages AS {ENDLESS}, 1 AS topic_id, 1 AS timestamp, "
    "x'00' AS data FROM n WHERE id < 0;",
    "a row of a gigabyte": "CREATE VIEW messages AS SELECT 1 AS id, 1 AS topic_id, 1 AS timestamp, "
    "zeroblob(999999999) AS data;",
    "a column that is computed": "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, "
    "data AS (zeroblob(999999999)));",
    "a virtual table": "CREATE VIRTUAL TABLE messages USING fts5(id, topic_id, timestamp, data);",
}


@pytest.mark.parametrize("name", VIEWS)
def test_what_computes_its_rows_is_no_table_of_messages(name: str, tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as database:
        database.executescript(TABLES + VIEWS[name])
    with within_bounds(), pytest.raises(LogError, match=r"a\.db3: 'messages' is no plain"):
        list(open_messages(path))


def test_topics_that_are_bytes_or_nothing_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as database:
        database.executescript(TABLES + MESSAGES)
        for row in ((2, b"/bytes", "std_msgs/msg/Empty"), (3, None, None), (4, 5, 6.5)):
            database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr')", row)
        database.executemany("INSERT INTO messages VALUES (?, ?, 1, x'00')", [(1, 1), (2, 2)])
    database.close()
    messages = open_messages(path)
    assert [message.topic for message in messages] == ["/scan"]
    assert any("a damaged topic" in warning for warning in messages.warnings)


def test_a_row_whose_number_is_damaged_hides_none_after_it(drive, tmp_path: Path) -> None:
    path = drive.straight().bag2(tmp_path / "a") / "a.db3"
    whole = [(m.topic, m.recorded_ns, m.data) for m in open_messages(path)]
    with sqlite3.connect(path) as database:
        # the tree of rows stays as it is, so the number must be one that fits between others
        database.execute("UPDATE messages SET id = 10000 WHERE id = (SELECT max(id) FROM messages)")
    database.close()
    assert [(m.topic, m.recorded_ns, m.data) for m in open_messages(path)] == whole


LINE = "=" * 80


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a/X[] x\n", "holds itself"),
        (f"a/Y y\n{LINE}\nMSG: a/Y\na/X[] x\n", "holds itself"),
        ("string[300000] x\n", "fields"),
        (f"a/Y[] y\n{LINE}\nMSG: a/Y\n", "holds nothing"),
        ("".join(f"{LINE}\nMSG: a/T{i}\na/T{i + 1} x\na/T{i + 1} y\n" for i in range(40))
         .removeprefix(f"{LINE}\nMSG: a/T0\n") + f"{LINE}\nMSG: a/T40\nuint8 x\n", "fields"),
        ("x" * 300_000, "characters"),
        ("uint8 y\nuint8 y\n", "conflicting"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("wire", ["cdr", "ros1"])
def test_definitions_that_would_never_end_are_refused(text: str, said: str, wire: str) -> None:
    name = "a/msg/T0" if "T40" in text else "a/msg/X"
    message_type = MessageType(name, wire, text)
    data = b"\xff\xff\xff\x00" if wire == "ros1" else b"\x00\x01\x00\x00\xff\xff\xff\x00"
    for use in (lambda: message_type.decode(data), lambda: message_type.definition):
        with within_bounds(), pytest.raises(LogError, match=said):
            use()


def test_a_type_that_records_are_made_from_must_have_its_fields() -> None:
    with pytest.raises(LogError, match="lacks angle_increment, angle_max"):
        MessageType("sensor_msgs/msg/LaserScan", "cdr", "std_msgs/Header header\n").decode(b"")


def test_rates_are_told_where_there_are_any(new_drive, tmp_path: Path) -> None:
    drive = new_drive().straight(1.0)
    drive.messages.reverse()  # as recorded, the last comes first
    for _ in range(5):
        drive.odometry(0.0, topic="/latched")
    summary = inspect_log(drive.mcap(tmp_path / "a.mcap"))
    rates = {topic.name: topic.rate_hz for topic in summary.topics}
    assert rates["/odom"] == pytest.approx(20)
    assert rates["/latched"] is None
    assert rates["/tf_static"] is None


CARMEN_LINE = "FLASER 2 1.0 2.0 0 0 0 {x} 0 0 {ipc} host {logged}\n"


@pytest.mark.parametrize("time", ["4.29497e+09", "-0.445999", "1e400", "nan", "9" * 5000])
def test_carmen_lines_without_a_usable_time_are_left_out(time: str, tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    good = [CARMEN_LINE.format(x=0, ipc=t, logged=t) for t in ("1.0", "2.0")]
    odometry = f"ODOM 0 0 0 0 0 0 {time} host {time}\n"
    path.write_text(good[0] + odometry + CARMEN_LINE.format(x=0, ipc=time, logged=time) + good[1])
    log = open_log(path)
    assert sum(1 for _ in log) == 4
    assert any("FLASER line" in warning for warning in log.warnings)
    assert any("ODOM line" in warning for warning in log.warnings)


@pytest.mark.parametrize("number", ["1e300", "inf", "nan", "x"])
def test_carmen_places_and_parameters_that_are_none_are_left_out(
    number: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.log"
    parameters = [
        f"PARAM robot_frontlaser_offset {number}\n",
        f"PARAM robot_front_laser_max {number}\n",
    ]
    lines = [
        CARMEN_LINE.format(x=x, ipc=t, logged=t) for x, t in ((0, 1.5), (number, 2.5), (0, 3.5))
    ]
    path.write_text("".join(parameters + lines))
    log = open_log(path)
    assert log.counts == {}
    assert sum(1 for _ in log) == 4
    assert any("is no number" in warning for warning in log.warnings)
