"""Worlds under real processes: a writer that is killed, and several at once, on both databases."""

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from objstate.world.store import open_store
from tests.world.examples import BUILDING, HOUR, SECOND

ROOT = Path(__file__).parents[2]

# Adds a drive of many beliefs; tells when some are in the database, and goes on when told.
WRITER = """
import sys
from objstate.world.store import DriveEntry, open_store
from tests.world.examples import BUILDING, SECOND, at_angle

place, digest, begin, count = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])

def beliefs():
    for second in range(count):
        if second == count - 1:
            print("half-way", flush=True)
            sys.stdin.readline()
        yield at_angle(0.5, begin + second * SECOND)

entry = DriveEntry(digest, begin, begin + count * SECOND)
print("added" if open_store(place, BUILDING).add(entry, beliefs()) else "known", flush=True)
"""


Writer = Callable[[str, int, int], subprocess.Popen[str]]


@pytest.fixture
def writer(place: str) -> Iterator[Writer]:
    """Starts processes that add a drive; those that still run in the end are killed."""
    started: list[subprocess.Popen[str]] = []

    def start(digest: str, begin_ns: int, count: int) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, place, digest, str(begin_ns), str(count)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


def line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def told_to_go_on(process: subprocess.Popen[str]) -> list[str]:
    """What a writer still says when it may finish."""
    out, _ = process.communicate("\n", timeout=60)
    assert process.returncode == 0
    return out.split()


def test_a_writer_killed_half_way_leaves_the_last_whole_world(place: str, writer: Writer) -> None:
    store = open_store(place, BUILDING)
    first = writer("first", 0, 3)
    assert line(first) == "half-way"
    assert told_to_go_on(first) == ["added"]
    second = writer("second", HOUR, 250)  # two hundred rows are in its transaction
    assert line(second) == "half-way"
    second.send_signal(signal.SIGKILL)
    second.communicate(timeout=60)
    assert second.returncode == -signal.SIGKILL
    assert [drive.digest for drive in store.drives()] == ["first"]
    assert store.load().latest_ns == 2 * SECOND
    third = writer("second", HOUR, 250)
    assert line(third) == "half-way"
    assert told_to_go_on(third) == ["added"]
    assert store.load().latest_ns == HOUR + 249 * SECOND


@pytest.mark.parametrize(("digests", "told"), [("ab", "added"), ("aa", "known")])
def test_two_writers_at_once_come_one_after_the_other(
    place: str, writer: Writer, digests: str, told: str
) -> None:
    first = writer(digests[0], 0, 150)
    assert line(first) == "half-way"
    second = writer(digests[1], HOUR, 1)
    assert told_to_go_on(first) == ["added"]
    assert told in told_to_go_on(second)
    store = open_store(place)
    assert len(store.drives()) == len(set(digests))
    assert len(store.load().history("door")) == 150 + (told == "added")


def test_many_may_make_one_world(place: str, writer: Writer) -> None:
    writers = [writer(f"drive {k}", k * HOUR, 2) for k in range(3)]
    for process in writers:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    assert all("added" in told_to_go_on(process) for process in writers)
    assert len(open_store(place).drives()) == 3
    assert len(open_store(place).load().history("door")) == 6
