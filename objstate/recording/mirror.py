"""A batch whose folder lies at a URL: a small copy of it here, which is sent there now and then.

Results never pass through here: workers write them to the store, file by file, the mark last, and
then a word that they did. What is mirrored are the index, the list of logs, the tables over all
logs and the report. A result counts from its word on; the words are dropped once the index there
knows of them, so that a kill at any moment loses no finished log.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from objstate.errors import ResultError
from objstate.outputs import as_url, is_url
from objstate.packing import unpack
from objstate.recording.batches import BATCH, LOGS, REPORT, SUMMARY_TABLE, TIMINGS_TABLE, result_of
from objstate.recording.index import INDEX, REMOTE, open_index
from objstate.recording.parts import BESIDE
from objstate.recording.results import MARK
from objstate.recording.summary import SUMMARY
from objstate.storage import exists, get, listed, put, remove

WORDS = "finished"  # a folder there: a file for each result that the index may not know of yet
MIRRORED = (INDEX, BATCH, SUMMARY_TABLE, TIMINGS_TABLE, REPORT)
SMALL = (SUMMARY, BESIDE, MARK)  # of a result: what the index is made of
EVERY_S = 60.0  # between two times that what changed is sent
MOST_EXPECTED = 500  # results that are taken in together
FETCHES = 32  # files that are fetched at a time
SHARE = 20  # times as long as sending takes, at least, until it is sent again


@contextmanager
def mirrored(folder: str | Path, *, only: Collection[str] = ()) -> Iterator[Path]:
    """A batch's folder, or a copy of what is small of one at a URL, sent back in the end.

    Of what is ``only`` looked at, such as by a report, no more than these files are sent, as a
    batch may be at work there. Raises OutageError where the store is out of reach.
    """
    if not is_url(folder):
        yield Path(folder)
        return
    with tempfile.TemporaryDirectory(prefix="objstate-mirror-") as name:
        mirror = Mirror(
            as_url(folder), Path(name) / (as_url(folder).rstrip("/").rpartition("/")[2])
        )
        mirror.fetch()
        try:
            yield mirror.folder
        finally:
            mirror.send(only)


class Mirror:
    """A small copy of a batch at a URL."""

    def __init__(self, address: str, folder: Path) -> None:
        self.address = address.rstrip("/")
        self.folder = folder
        self._sent: dict[str, tuple[int, int]] = {}  # what was sent: sizes and times
        self._due = time.monotonic() + EVERY_S
        self._expected: list[str] = []  # results that are there, and not taken in yet

    @staticmethod
    def of(folder: Path) -> Mirror | None:
        """That of a folder which is a copy; None of any other."""
        try:
            address = (folder / REMOTE).read_text(encoding="utf-8")
        except OSError:
            return None
        return Mirror(address, folder)

    def address_of(self, name: str) -> str:
        """Where the result of a log lies."""
        return f"{self.address}/{LOGS}/{name}"

    def fetch(self) -> None:
        """Fill the copy, and take in the results that the index doesn't know of yet."""
        (self.folder / LOGS).mkdir(parents=True)
        (self.folder / REMOTE).write_text(self.address, encoding="utf-8")
        there = set(listed(self.address))
        if BATCH not in there and not there <= {LOGS, WORDS, INDEX, ""}:
            raise ResultError(
                f"{self.address} is no batch of objstate; choose another name for it."
            )
        for name in MIRRORED:
            if name in there:
                get(f"{self.address}/{name}", self.folder / name)
                self._note(name)
        self.take_in(listed(f"{self.address}/{WORDS}") if WORDS in there else [])

    def take_in(self, names: Iterable[str]) -> None:
        """Bring what is small of new results, and keep their parts in the index."""
        with ThreadPoolExecutor(FETCHES) as pool:
            found = list(pool.map(self._fetched, names))
        kept: dict[str, list[tuple[str, str, bytes]]] = {}
        for name, content in found:
            stamps, arrays = unpack(content, BESIDE)
            for kind, stamp in stamps.items():
                kept.setdefault(kind, []).append((name, stamp, arrays[kind].tobytes()))
        with open_index(self.folder) as index:
            for kind, parts in kept.items():
                index.keep(kind, parts)

    def _fetched(self, name: str) -> tuple[str, bytes]:
        """A result's name, and what its worker left beside it."""
        own = result_of(self.folder, name)
        own.mkdir(parents=True, exist_ok=True)
        for file in SMALL:
            get(f"{self.address_of(name)}/{file}", own / file)
        return name, (own / BESIDE).read_bytes()

    def expect(self, name: str) -> None:
        """A worker has written a result; it is taken in with others, soon."""
        self._expected.append(name)
        if len(self._expected) >= MOST_EXPECTED:
            self.take_in_expected()

    def take_in_expected(self) -> None:
        """Take in all results that are there."""
        names, self._expected = self._expected, []
        self.take_in(names)

    def send_if_due(self, settle: Callable[[], object]) -> None:
        """Send what changed, where it is time; ``settle`` brings the index up to date before."""
        if time.monotonic() >= self._due:
            self.take_in_expected()
            settle()
            self.send()

    def send(self, only: Collection[str] = ()) -> None:
        """Send what changed, the index last, and then drop the words of results that it knows of."""
        began = time.monotonic()
        with open_index(self.folder) as index:
            known = {n for n, e in index.entries().items() if e.making is not None}
        for name in only or reversed(MIRRORED):
            path = self.folder / name
            if path.is_file() and self._sent.get(name) != _state(path):
                put(path, f"{self.address}/{name}")
                self._note(name)
        if only:
            return
        for name in known & set(listed(f"{self.address}/{WORDS}")):
            remove(f"{self.address}/{WORDS}/{name}")
        took = time.monotonic() - began
        self._due = time.monotonic() + max(EVERY_S, SHARE * took)

    def _note(self, name: str) -> None:
        self._sent[name] = _state(self.folder / name)


def send_result(made: Path, address: str) -> None:
    """Write a result folder to ``.../logs/NAME``; it counts once all of it is there.

    Raises OutageError.
    """
    mark = f"{address}/{MARK}"
    if exists(mark):
        remove(mark)
    files = [path for path in sorted(made.rglob("*")) if path.is_file() and path.name != MARK]
    for path in (*files, made / MARK):
        put(path, f"{address}/{path.relative_to(made).as_posix()}")
    home, _, name = address.rpartition("/")
    put(made / MARK, f"{home.rpartition('/')[0]}/{WORDS}/{name}")


def _state(path: Path) -> tuple[int, int]:
    state = os.stat(path)
    return state.st_size, state.st_mtime_ns
