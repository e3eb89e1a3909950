"""Of a damaged log everything readable is used, and the rest is named."""

import gzip
import os
import sqlite3
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType

from objstate.errors import LogError
from objstate.logs import open_log, open_messages

FEW = settings(
    max_examples=25,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
SHARES = st.floats(0.05, 0.95)

WRITERS = {
    "mcap": lambda drive, path: drive.mcap(path),
    "mcap-zstd": lambda drive, path: drive.mcap(path, compression=CompressionType.ZSTD),
    "mcap-lz4": lambda drive, path: drive.mcap(path, compression=CompressionType.LZ4),
    "bag1": lambda drive, path: drive.bag1(path),
    "bag1-bz2": lambda drive, path: drive.bag1(path, "bz2"),
    "bag1-lz4": lambda drive, path: drive.bag1(path, "lz4"),
}


@pytest.mark.parametrize("name", WRITERS)
@FEW
@given(share=SHARES)
def test_a_log_cut_anywhere_gives_its_beginning(name, share, new_drive, tmp_path) -> None:
    path = tmp_path / name
    if not path.exists():
        WRITERS[name](new_drive().straight(), path)
    expected = [(m.topic, m.recorded_ns, m.data) for m in open_messages(path)]
    cut = tmp_path / "cut"
    cut.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    messages = open_messages(cut)
    read = [(m.topic, m.recorded_ns, m.data) for m in messages]
    assert read == expected[: len(read)]
    if len(read) < len(expected):
        assert any("cut" in warning for warning in messages.warnings)


def test_a_bag_cut_in_its_index_has_all_its_topics(new_drive, tmp_path) -> None:
    path = new_drive().straight().bag1(tmp_path / "whole")
    whole, index = path.read_bytes(), path.read_bytes().rindex(b"/tf_static")
    for cut in range(index, len(whole), 100):
        (tmp_path / "cut").write_bytes(whole[:cut])
        assert open_messages(tmp_path / "cut").topics().keys() == {"/tf_static", "/odom", "/scan"}


@pytest.mark.parametrize("name", ["mcap", "bag1"])
def test_the_part_of_a_chunk_before_the_cut_is_used(name, new_drive, tmp_path) -> None:
    drive = new_drive().straight()
    path = tmp_path / "one-chunk"
    if name == "mcap":
        drive.mcap(path, chunk_size=2**20)
    else:
        drive.bag1(path, chunk_size=2**20)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert 10 < sum(1 for _ in open_messages(path)) < 78


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD])
@FEW
@given(share=st.floats(0.1, 0.8))
def test_flipped_bytes_cost_one_chunk(compression, share, new_drive, tmp_path) -> None:
    path = new_drive().straight().mcap(tmp_path / "a", compression=compression, chunk_size=1024)
    expected = [(m.topic, m.recorded_ns, m.data) for m in open_messages(path)]
    damaged = bytearray(path.read_bytes())
    # the middle of a chunk's data, not a record's length
    start = damaged.find(b"/odom", int(share * path.stat().st_size * 0.5))
    place = start if start > 0 else len(damaged) // 2
    damaged[place] ^= 0xFF
    path.write_bytes(damaged)
    messages = open_messages(path)
    read = [(m.topic, m.recorded_ns, m.data) for m in messages]
    assert set(read) <= set(expected)
    assert len(read) >= len(expected) - 20
    if len(read) < len(expected):
        assert messages.warnings


def test_a_bag_that_was_never_closed_is_read(drive, tmp_path) -> None:
    path = drive.straight().bag1(tmp_path / "a.bag")
    content = path.read_bytes()
    index_field = content.index(b"index_pos=") + len(b"index_pos=")
    index = int.from_bytes(content[index_field : index_field + 8], "little")
    path.write_bytes(content[:index_field] + bytes(8) + content[index_field + 8 : index])
    log = open_log(path)
    assert sum(1 for _ in log) == 77
    assert any("no index" in warning for warning in log.warnings)


def test_a_damaged_sqlite_page_is_stepped_over(drive, tmp_path) -> None:
    folder = drive.straight(30.0).bag2(tmp_path / "a")
    path = folder / "a.db3"
    page = sqlite3.connect(path).execute("PRAGMA page_size").fetchone()[0]
    content = bytearray(path.read_bytes())
    middle = len(content) // page // 2 * page
    content[middle : middle + page] = b"\xff" * page
    path.write_bytes(content)
    total = len(drive.messages)
    messages = open_messages(folder)
    read = list(messages)
    assert total * 0.8 < len(read) < total
    assert read[-1].recorded_ns == max(ns for _, _, ns, _ in drive.messages)
    assert any("damaged" in warning for warning in messages.warnings)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.777, 0.95])
def test_a_sqlite_file_cut_short_gives_its_beginning(share, drive, tmp_path) -> None:
    path = drive.straight(30.0).bag2(tmp_path / "a") / "a.db3"
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    messages = open_messages(path)
    read = [(m.topic, m.type, m.recorded_ns, m.cdr()) for m in messages]
    assert len(read) > 100
    # SQLite has no checksums and reads what is missing of the last page as zeros
    assert len(set(read) - set(drive.cdr())) <= 1
    assert read[:100] == drive.cdr()[:100]
    assert any("damaged" in warning for warning in messages.warnings)


def test_a_bag_folder_without_metadata_is_read(drive, tmp_path) -> None:
    folder = drive.straight().bag2(tmp_path / "a")
    (folder / "metadata.yaml").unlink()
    messages = open_messages(folder)
    assert len(list(messages)) == 78
    assert any("metadata.yaml" in warning for warning in messages.warnings)


@pytest.mark.parametrize(
    "content", [b"", b"[]", b": {", b"\xff\xfe", b"rosbag2_bagfile_information: 3"]
)
def test_unreadable_metadata_is_told_and_done_without(content, drive, tmp_path) -> None:
    folder = drive.straight().bag2(tmp_path / "a")
    (folder / "metadata.yaml").write_bytes(content)
    messages = open_messages(folder)
    assert len(list(messages)) == 78
    assert any("metadata.yaml" in warning for warning in messages.warnings)


def test_a_missing_part_is_named_and_the_others_are_used(drive, tmp_path) -> None:
    folder = drive.straight().bag2(tmp_path / "a")
    metadata = folder / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("- a.db3", "- a.db3\n  - a_1.db3"))
    messages = open_messages(folder)
    assert len(list(messages)) == 78
    assert any("a_1.db3" in warning for warning in messages.warnings)


def test_a_gzipped_carmen_log_cut_short_gives_its_beginning(tmp_path) -> None:
    lines = [f"FLASER 3 1 2 3 {i} 0 0 {i} 0 0 {i}.5 host {i}.6\n" for i in range(5000)]
    packed = gzip.compress("".join(lines).encode())
    path = tmp_path / "a.log.gz"
    path.write_bytes(packed[: len(packed) // 2])
    log = open_log(path)
    assert log.counts == {}
    assert sum(1 for _ in log) > 1000
    assert any("cut off" in warning for warning in log.warnings)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "empty"),
        (b"rubbish\n" * 100, "no log that objstate knows"),
        (bytes(range(256)) * 10, "no log that objstate knows"),
        (b"\x1f\x8b\x08\x00rubbish", "gunzip"),
        (b"BZh91AY&SY", "bunzip2"),
        (b"PK\x03\x04" + b"\x00" * 600, "unzip"),
        (b"bag/".ljust(257, b"\x00") + b"ustar\x0000", "tar xf"),
        (b"#ROSBAG V1.2\n", "rosbag fix"),
        (b"#ROSBAG V2.0\n", "holds no messages"),
        (b"\x89MCAP0\r\n", "cut off after 8 bytes"),
        (b"SQLite format 3\x00" + b"\xff" * 4096, "damaged"),
    ],
)
def test_what_is_no_log_is_refused_with_its_reason(content, said, tmp_path) -> None:
    path = tmp_path / "log"
    path.write_bytes(content)
    with pytest.raises(LogError, match=said):
        list(open_log(path))


def test_a_pipe_is_refused_without_waiting_for_what_comes(tmp_path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(LogError, match="is a pipe or a device"):
        open_log(tmp_path / "pipe")


def test_missing_paths_and_empty_folders_are_refused(tmp_path) -> None:
    with pytest.raises(LogError, match="no log at"):
        open_log(tmp_path / "none")
    with pytest.raises(LogError, match="holds no bag"):
        open_log(tmp_path)
    with pytest.raises(LogError, match="No log was named"):
        open_log([])


@FEW
@given(noise=st.binary(max_size=300), start=st.sampled_from([b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n"]))
def test_noise_after_a_magic_never_crashes(noise, start, tmp_path) -> None:
    path = tmp_path / "log"
    path.write_bytes(start + noise)
    list(open_messages(path))


@FEW
@given(data=st.data())
def test_noise_within_a_file_ends_in_warnings_or_a_log_error(data, new_drive, tmp_path) -> None:
    name = data.draw(st.sampled_from(["mcap", "mcap-lz4", "bag1", "bag1-bz2"]))
    path = tmp_path / name
    if not path.exists():
        WRITERS[name](new_drive().straight(), path)
    content = bytearray(path.read_bytes())
    place = data.draw(st.integers(20, len(content) - 20))
    content[place : place + 8] = data.draw(st.binary(min_size=8, max_size=8))
    damaged = tmp_path / "damaged"
    damaged.write_bytes(content)
    with suppress(LogError):  # any other error is a failure
        list(open_log(damaged))
