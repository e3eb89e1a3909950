"""Worlds under real processes: a writer that is killed, and several at once, on both databases."""

import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

import pytest

from objstate.world.store import DriveEntry, open_store
from tests.world.examples import BUILDING, HOUR, SECOND, at_angle
from tests.world.writing import write

# A process of its own that has loaded everything, and is forked for each writer.
PROCESSES = get_context("forkserver")
PROCESSES.set_forkserver_preload([write.__module__])
LONGEST_S = 60.0  # that anything may take


@dataclass(frozen=True)
class Writer:
    """A process that adds a drive."""

    process: BaseProcess
    ours: Connection

    def word(self) -> str:
        """What it tells next."""
        assert self.ours.poll(LONGEST_S)
        return str(self.ours.recv())

    def killed(self) -> int | None:
        self.process.kill()
        self.process.join(LONGEST_S)
        return self.process.exitcode

    def may_go_on(self) -> None:
        self.ours.send("go on")

    def rest(self) -> list[str]:
        """What it still tells until its end."""
        words = []
        try:
            while True:
                words.append(self.word())
        except EOFError:
            self.process.join(LONGEST_S)
        assert self.process.exitcode == 0
        return words


Start = Callable[[str, int, int], Writer]


@pytest.fixture
def writer(place: str) -> Iterator[Start]:
    """Starts processes that add a drive; those that still run in the end are killed."""
    started: list[Writer] = []

    def start(digest: str, begin_ns: int, count: int) -> Writer:
        ours, theirs = PROCESSES.Pipe()
        arguments = (place, digest, begin_ns, count, theirs)
        process = PROCESSES.Process(target=write, args=arguments, daemon=True)
        process.start()
        theirs.close()
        started.append(Writer(process, ours))
        return started[-1]

    yield start
    for each in started:
        each.killed()
        each.ours.close()


def test_a_writer_killed_half_way_leaves_the_last_whole_world(place: str, writer: Start) -> None:
    store = open_store(place, BUILDING)
    first = DriveEntry("first", 0, 3 * SECOND)
    assert store.add(first, [at_angle(0.5, second * SECOND) for second in range(3)])
    second = writer("second", HOUR, 250)  # whose rows are in its transaction
    assert second.word() == "begun"
    assert second.word() == "half-way"
    assert second.killed() == -signal.SIGKILL
    assert [drive.digest for drive in store.drives()] == ["first"]
    assert store.load().latest_ns == 2 * SECOND
    third = writer("second", HOUR, 3)
    third.may_go_on()
    assert third.rest() == ["begun", "half-way", "added"]
    assert store.load().latest_ns == HOUR + 2 * SECOND


@pytest.mark.parametrize(("digests", "told"), [("ab", "added"), ("aa", "known")])
def test_two_writers_at_once_come_one_after_the_other(
    place: str, writer: Start, digests: str, told: str
) -> None:
    first = writer(digests[0], 0, 3)
    assert first.word() == "begun"
    assert first.word() == "half-way"
    second = writer(digests[1], HOUR, 1)
    second.may_go_on()
    assert second.word() == "begun"
    assert not second.ours.poll(0.3)  # s; it waits for the first
    first.may_go_on()
    assert first.rest() == ["added"]
    assert told in second.rest()
    store = open_store(place)
    assert len(store.drives()) == len(set(digests))
    assert len(store.load().history("door")) == 3 + (told == "added")


def test_many_may_make_one_world(place: str, writer: Start) -> None:
    writers = [writer(f"drive {k}", k * HOUR, 2) for k in range(3)]
    for each in writers:
        each.may_go_on()
    assert all("added" in each.rest() for each in writers)
    assert len(open_store(place).drives()) == 3
    assert len(open_store(place).load().history("door")) == 6
