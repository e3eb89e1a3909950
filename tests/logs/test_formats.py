"""Whatever the format, the same drive gives the same messages and records."""

import math
import re
import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType

from objstate.conversion import convert
from objstate.errors import LogError
from objstate.logs import Message, inspect_log, open_log, open_messages
from objstate.logs.notices import Notices
from objstate.logs.ordering import UNSORTED, Beginnings, in_recorded_order
from objstate.records import Scan

WRITERS = {
    "mcap": lambda drive, path: drive.mcap(path / "a.mcap"),
    "mcap-zstd": lambda drive, path: drive.mcap(path / "a", compression=CompressionType.ZSTD),
    "mcap-lz4": lambda drive, path: drive.mcap(path / "a", compression=CompressionType.LZ4),
    "mcap-unchunked": lambda drive, path: drive.mcap(path / "a", use_chunking=False),
    "mcap-without-summary": lambda drive, path: drive.mcap(
        path / "a", use_summary_offsets=False, use_statistics=False, repeat_channels=False
    ),
    "mcap-ros1": lambda drive, path: drive.mcap(path / "a.mcap", wire="ros1"),
    "mcap-with-json": lambda drive, path: drive.mcap(path / "a.mcap", extra_json=True),
    "bag1": lambda drive, path: drive.bag1(path / "a.bag"),
    "bag1-bz2": lambda drive, path: drive.bag1(path / "a.bag", "bz2"),
    "bag1-lz4": lambda drive, path: drive.bag1(path / "a.bag", "lz4"),
    "sqlite3": lambda drive, path: drive.bag2(path / "a"),
    "sqlite3-bare": lambda drive, path: drive.bag2(path / "a") / "a.db3",
    "sqlite3-zstd-file": lambda drive, path: drive.bag2(path / "a", compression="FILE"),
    "sqlite3-zstd-message": lambda drive, path: drive.bag2(path / "a", compression="MESSAGE"),
    "rosbag2-mcap-zstd-message": lambda drive, path: drive.bag2(path / "a", "MCAP", "MESSAGE"),
    "rosbag2-mcap-zstd-file": lambda drive, path: drive.bag2(path / "a", "MCAP", "FILE"),
    "rosbag2-mcap": lambda drive, path: drive.bag2(path / "a", "MCAP"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_the_same_messages(name: str, drive, tmp_path: Path) -> None:
    path = WRITERS[name](drive.straight(), tmp_path)
    messages = open_messages(path)
    read = [(m.topic, m.type, m.recorded_ns, m.cdr()) for m in messages]
    assert read == drive.cdr()
    assert messages.warnings == []
    assert messages.share == 1.0


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_tells_its_topics_and_types(name: str, drive, tmp_path: Path) -> None:
    topics = open_messages(WRITERS[name](drive.straight(), tmp_path)).topics()
    assert {topic: kind.name for topic, kind in topics.items()} == {
        topic: kind for topic, kind, _, _ in drive.messages
    }
    assert "float32 range_max" in topics["/scan"].definition
    assert "uint32 seq" not in topics["/scan"].definition


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_the_same_records(name: str, drive, tmp_path: Path) -> None:
    log = open_log(WRITERS[name](drive.straight(), tmp_path))
    records = list(log)
    stamps = [record.stamp_ns for record in records]
    assert stamps == sorted(stamps)
    assert log.counts == {"Odometry": 61, "Scan": 16}
    assert log.warnings == []
    scan = next(record for record in reversed(records) if isinstance(record, Scan))
    np.testing.assert_allclose(scan.odometry, [3.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(scan.rays.origins, np.tile([0.2, 0.0, 0.3], (3, 1)), atol=1e-12)


def test_parts_of_a_drive_are_read_as_one(new_drive, tmp_path: Path) -> None:
    whole = new_drive().straight().messages
    parts = [new_drive(whole[:40]), new_drive(whole[40:])]
    paths = [part.bag1(tmp_path / f"{i}.bag") for i, part in enumerate(parts)]
    for order in (paths, paths[::-1]):
        log = open_log(order)
        assert sum(1 for _ in log) == 77
        assert log.warnings == []


@pytest.mark.parametrize("read", [open_log, inspect_log])
def test_a_folder_of_several_recordings_is_no_log(read, new_drive, tmp_path: Path) -> None:
    folder = tmp_path / "monday"
    folder.mkdir()
    names = ["monday_0.mcap", "monday_1.mcap", "again.mcap"]
    for name in names[:2]:
        new_drive().straight().mcap(folder / name)
    read(folder)
    new_drive().straight().mcap(folder / names[2])
    with pytest.raises(LogError, match=r"a folder of 3 logs \(again.mcap, .*objstate batch"):
        read(folder)


def test_the_share_read_grows_within_a_chunk(drive, tmp_path: Path) -> None:
    messages = open_messages(drive.straight().mcap(tmp_path / "a.mcap"))  # a single chunk
    for _ in range(2):
        shares = [messages.share for _ in messages]
        assert shares == sorted(shares)
        assert len(set(shares)) > len(shares) / 2


def test_a_part_that_is_named_twice_is_refused(drive, tmp_path: Path) -> None:
    bag = drive.straight().bag2(tmp_path / "a")
    with pytest.raises(LogError, match="named twice"):
        open_log([bag, bag / "a.db3"])


def test_topics_recorded_apart_are_merged(new_drive, tmp_path: Path) -> None:
    whole = new_drive().straight().messages
    lasers = new_drive([m for m in whole if m[0] == "/scan"]).mcap(tmp_path / "lasers.mcap")
    others = new_drive([m for m in whole if m[0] != "/scan"]).bag1(tmp_path / "others.bag")
    log = open_log([lasers, others])
    assert sum(isinstance(record, Scan) for record in log) == 16


@pytest.mark.parametrize("kind", ["mcap", "bag1", "bag2"])
@pytest.mark.parametrize("first", ["/odom", "/scan"])
def test_topics_written_one_after_the_other_are_merged(
    kind: str, first: str, new_drive, tmp_path: Path
) -> None:
    whole = new_drive().straight(10.0)
    apart = new_drive(sorted(whole.messages, key=lambda each: (each[0] != first, each[0])))
    log = open_log(getattr(apart, kind)(tmp_path / "apart"))
    shares, stamps = [], []
    for record in log:
        shares.append(log.share)
        stamps.append((type(record), record.stamp_ns))
    sorted_log = open_log(whole.mcap(tmp_path / "sorted.mcap"))
    assert stamps == [(type(record), record.stamp_ns) for record in sorted_log]
    assert shares == sorted(shares)
    assert log.warnings == ["The log is not sorted by time: it is read topic by topic, and slower"]
    assert sorted_log.warnings == []


def damaged(kind: str, path: Path) -> Path:
    """The path of a log with its end cut off, or a topic and some messages damaged."""
    if kind != "bag2":
        path.write_bytes(path.read_bytes()[: path.stat().st_size * 6 // 10])
        return path
    with closing(sqlite3.connect(path / f"{path.name}.db3")) as database, database:
        columns = "type, serialization_format, offered_qos_profiles, type_description_hash"
        database.execute(f"INSERT INTO topics SELECT 9, x'00', {columns} FROM topics LIMIT 1")
        database.execute("UPDATE messages SET timestamp = x'00' WHERE rowid % 50 = 3")
    return path


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("mcap", ["cut off after"]),
        ("bag1", [r"is cut off \(read up to byte \d+ of \d+\):"]),
        ("bag2", ["a damaged topic was left out", r"a damaged message was left out \(6 times\)"]),
    ],
)
def test_damage_of_a_log_written_topic_by_topic_is_counted_once(
    kind: str, told: list[str], new_drive, tmp_path: Path
) -> None:
    order = ["/tf_static", "/scan", "/odom"]
    whole = new_drive().straight(10.0).messages
    apart = new_drive(sorted(whole, key=lambda message: order.index(message[0])))
    path = damaged(kind, getattr(apart, kind)(tmp_path / "a"))
    log = open_log(path)
    assert len(list(log)) > 100
    for warnings in (log.warnings, convert(path, tmp_path / "converted.mcap").warnings):
        assert UNSORTED in warnings
        for each in told:
            assert (
                sum(re.search(f"{each}[^()]*$", warning) is not None for warning in warnings) == 1
            )


@pytest.fixture
def looked_at(monkeypatch: pytest.MonkeyPatch) -> list[Message]:
    """The messages that were read ahead."""
    seen: list[Message] = []
    note = Beginnings.note

    def noted(self: Beginnings, message: Message) -> bool:
        seen.append(message)
        return note(self, message)

    monkeypatch.setattr(Beginnings, "note", noted)
    return seen


@pytest.mark.parametrize("kind", ["mcap", "bag1", "bag2"])
def test_a_topic_without_messages_is_not_waited_for(
    kind: str, new_drive, looked_at: list[Message], tmp_path: Path
) -> None:
    drive = new_drive(silent=[("/rear", "sensor_msgs/msg/LaserScan")]).straight(60.0)
    path = getattr(drive, kind)(tmp_path / "a")
    assert "/rear" in open_messages(path).topics()
    next(iter(open_log(path)))
    assert 100 < len(looked_at) < 150  # 5 s of them
    looked_at.clear()
    in_recorded_order(open_messages(path), Notices())
    assert len(looked_at) < 5


def test_a_carmen_log_is_not_read_through_for_its_rear_laser(
    looked_at: list[Message], tmp_path: Path
) -> None:
    path = tmp_path / "a.log"
    line = "FLASER 3 1.0 1.0 1.0 0.0 0.0 0.0 0.0 0.0 0.0 {0} robot {0}\n"
    path.write_text("".join(line.format(10.0 + k) for k in range(60)))
    next(iter(open_log(path)))
    assert 10 < len(looked_at) < 20  # 5 s of them, and the first one after


def test_a_topic_whose_messages_the_summary_lacks_is_read(drive, tmp_path: Path) -> None:
    drive.straight(7.0)
    drive.tf(0.0, "base_link", "rear_laser", (-0.2, 0.0, 0.3), math.pi)
    drive.scan(6.0, topic="/rear", frame="rear_laser")
    drive.messages.sort(key=lambda message: message[2])
    path = drive.mcap(tmp_path / "a.mcap")
    whole = path.read_bytes()
    topics = list(dict.fromkeys(topic for topic, *_ in drive.messages))
    rear = 1 + topics.index("/rear")  # the number of its channel
    said = whole.rindex(struct.pack("<HQ", rear, 1))
    path.write_bytes(whole[:said] + struct.pack("<HQ", rear, 0) + whole[said + 10 :])
    assert "/rear" not in open_messages(path).awaited(["/rear", "/scan"])
    assert {r.laser for r in open_log(path) if isinstance(r, Scan)} == {"laser", "rear_laser"}


def test_iterating_again_reads_again(drive, tmp_path: Path) -> None:
    messages = open_messages(drive.straight().mcap(tmp_path / "a.mcap"))
    assert list(messages) == list(messages) != []


def test_only_the_asked_topics_are_read(drive, tmp_path: Path) -> None:
    path = drive.straight().bag1(tmp_path / "a.bag")
    assert {m.topic for m in open_messages(path, ["/scan"])} == {"/scan"}
