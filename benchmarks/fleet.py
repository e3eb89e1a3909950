"""What a start costs that finds everything done: ``python benchmarks/fleet.py RESULT LOG DIR COUNT``

RESULT is a log's result in a batch along the sample corridor, LOG the log that it was made of. DIR
gets ``drives``, COUNT names of the log, and ``batch``, as many names of its result. The index is
made of one of them, and tells the same of the others. Runs ``objstate batch`` twice and prints the
seconds and the largest memory of each.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

from objstate.batch.combine import combine
from objstate.recording.batches import BatchLog, result_of, write_logs
from objstate.recording.index import open_index
from objstate.recording.results import MARK
from objstate.report import REPORT

CORRIDOR = Path(__file__).parents[1] / "models" / "corridor" / "corridor.urdf"
MOST_LINKS = 50_000  # of one file, on the file systems that allow the fewest


def main(result: Path, log: Path, home: Path, count: int) -> None:
    """Make the fleet where there is none, and measure."""
    drives, batch = home / "drives", home / "batch"
    if not batch.exists():
        make(result, log, drives, batch, count)
    words = ["batch", str(drives), "--building", str(CORRIDOR), "--out", str(batch), "--quiet"]
    code = "import sys; from objstate.cli import main; sys.exit(main())"
    for start in ("first", "second"):
        began = time.monotonic()
        process = subprocess.Popen([sys.executable, "-c", code, *words], stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        print(
            f"{start} start: {time.monotonic() - began:.1f} s, {usage.ru_maxrss / 1024:.0f} MB, "
            f"exit {os.waitstatus_to_exitcode(status)}",
            flush=True,
        )


def make(result: Path, log: Path, drives: Path, batch: Path, count: int) -> None:
    """As many names as asked of one log and of its result."""
    drives.mkdir(parents=True)
    (batch / "logs").mkdir(parents=True)
    logs = []
    for number in range(count):
        if number % MOST_LINKS == 0:
            source = drives.parent / f"source-{number}"
            shutil.copytree(result, source / "result")
            shutil.copy(log, source / "log.mcap")
        name = f"drive_{number:06d}"
        os.link(source / "log.mcap", drives / f"{name}.mcap")
        own = result_of(batch, name)
        own.mkdir()
        for file in (source / "result").iterdir():
            os.link(file, own / file.name)
        logs.append(BatchLog(name, str(drives / f"{name}.mcap"), str(CORRIDOR)))
    write_logs(batch, logs[:1])
    combine(batch)
    with open_index(batch) as index:
        (entry,) = index.entries().values()
        assert entry.making is not None
        entries = {}
        for each in logs:
            made_ns = (result_of(batch, each.name) / MARK).stat().st_mtime_ns
            entries[each.name] = replace(
                entry,
                outcome=replace(entry.outcome, name=each.name),
                making=replace(entry.making, made_ns=made_ns),
            )
        index.describe(entries)
    write_logs(batch, logs)
    (batch / REPORT).touch()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]).absolute(), int(sys.argv[4]))
