"""How many results a second a batch takes in from a store: ``python benchmarks/store_limit.py RESULT [DELAY] [COUNT]``

RESULT is a log's result in a batch. A store with a file system's files stands in for one elsewhere: each
request to it waits DELAY seconds (0.02). Prints the results a second that the command takes in
while workers write them, and that it brings for the tables over all logs.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

import fsspec
from fsspec.implementations.local import LocalFileSystem

from objstate.batch.compacting import compact
from objstate.recording.batches import LOGS, BatchLog
from objstate.recording.index import open_index, settled
from objstate.recording.mirror import Mirror


class Far(LocalFileSystem):
    """Files of this machine, each request to which takes a while."""

    protocol = "far"
    delay = 0.02  # s

    def __init__(self, **options: object) -> None:
        super().__init__(**options | {"auto_mkdir": True})

    def get_file(self, *given: object, **options: object) -> object:
        """Read one."""
        time.sleep(self.delay)
        return super().get_file(*given, **options)

    def ls(self, *given: object, **options: object) -> object:
        """List a folder."""
        time.sleep(self.delay)
        return super().ls(*given, **options)


def main(result: Path, delay: float, count: int) -> None:
    """Measure and print."""
    Far.delay = delay
    fsspec.register_implementation("far", Far)
    names = [f"drive_{number:05d}" for number in range(count)]
    with tempfile.TemporaryDirectory() as home:
        store, here = Path(home) / "store", Path(home) / "here"
        (store / LOGS).mkdir(parents=True)
        here.mkdir()
        for name in names:
            shutil.copytree(result, store / LOGS / name)
        mirror = Mirror(f"far://{store}", here / "batch")
        mirror.fetch()
        began = time.monotonic()
        for name in names:
            mirror.expect(name)
        mirror.take_in_expected()
        print(f"{count / (time.monotonic() - began):.0f} results a second taken in")
        with open_index(mirror.folder) as index:
            entries = settled(index, mirror.folder, [BatchLog(name, "", "") for name in names])
            began = time.monotonic()
            compact(index, mirror.folder, entries)
        print(f"{count / (time.monotonic() - began):.0f} a second for the tables over all logs")


if __name__ == "__main__":
    main(
        Path(sys.argv[1]),
        float(sys.argv[2]) if len(sys.argv) > 2 else 0.02,
        int(sys.argv[3]) if len(sys.argv) > 3 else 1000,
    )
