"""What a fleet costs, without driving it: ``python benchmarks/fleet.py RESULT LOG DIR COUNT``

RESULT is a log's result in a batch along the sample corridor, LOG the log that it was made of, with
its truth beside it. DIR gets ``drives``, COUNT names of the log, and ``batch``, as many names of its
result. The index is made of one of them, and tells the same of the others, each an hour after
the one before. Prints the seconds, those of processor, and the largest memory of ``batch`` with nothing to do, ``evaluate``,
``statistics`` and ``report``, and the size of the page.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

from objstate.batch.combine import combine
from objstate.batch.compacting import pieces
from objstate.evaluation import batch as evaluation
from objstate.evaluation.batch import evaluate_batch
from objstate.packing import pack, unpack
from objstate.recording.batches import SUMMARY_TABLE, BatchLog, result_of, write_logs
from objstate.recording.index import Entry, open_index
from objstate.recording.parts import truth_state
from objstate.recording.results import MARK
from objstate.report import REPORT, batch_part, write_batch_report
from objstate.statistics import OpenAbove, door_statistics, looks

CORRIDOR = Path(__file__).parents[1] / "models" / "corridor" / "corridor.urdf"
MOST_LINKS = 50_000  # of one file, on the file systems that allow the fewest


def main(result: Path, log: Path, home: Path, count: int) -> None:
    """Make the fleet where there is none, and measure."""
    drives, batch = home / "drives", home / "batch"
    if not batch.exists():
        make(result, log, drives, batch, count)
    given = ("--building", str(CORRIDOR), "--truth", str(drives))
    (batch / SUMMARY_TABLE).unlink(
        missing_ok=True
    )  # as after a change: it is written, and the report
    measure("batch", str(drives), *given, "--out", str(batch), "--quiet")
    measure("batch", str(drives), *given, "--out", str(batch), "--quiet")
    measure("evaluate", str(batch), "--quiet")
    measure("statistics", str(batch))
    measure("report", str(batch))
    print(f"{(batch / REPORT).stat().st_size / 1e6:.1f} MB of page")


def measure(*words: str) -> None:
    """Run a command, and print what it cost."""
    code = "import sys; from objstate.cli import main; sys.exit(main())"
    began = time.monotonic()
    process = subprocess.Popen([sys.executable, "-c", code, *words], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    print(
        f"{words[0]}: {time.monotonic() - began:.1f} s, "
        f"{usage.ru_utime + usage.ru_stime:.1f} s of processor, {usage.ru_maxrss / 1024:.0f} MB, "
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
            for file in (log, log.with_name("truth.csv"), log.with_name("path.tum")):
                shutil.copy(file, source / file.name)
        name = f"drive_{number:06d}"
        address, truth, path = (drives / f"{name}{end}" for end in (".mcap", ".csv", ".path.tum"))
        for file, link in (("log.mcap", address), ("truth.csv", truth), ("path.tum", path)):
            os.link(source / file, link)
        own = result_of(batch, name)
        own.mkdir()
        for file in (source / "result").iterdir():
            os.link(file, own / file.name)
        logs.append(BatchLog(name, *map(str, (address, CORRIDOR, truth, path))))
    write_logs(batch, logs[:1])
    combine(batch)
    evaluate_batch(batch)
    door_statistics(batch)
    write_batch_report(batch)
    write_logs(batch, logs)
    with open_index(batch) as index:
        (entry,) = index.entries().values()
        entries = {each.name: as_if(entry, batch, each) for each in logs}
        index.describe(entries)
        for piece in pieces(entries):  # as if the tables over all logs were there
            index.note_piece(piece.file, piece.stamp)
        for kind, stamped in KINDS.items():
            ((_, _, content),) = index.parts(kind)
            index.keep(
                kind,
                (
                    (
                        each.name,
                        stamped(result_of(batch, each.name), each),
                        shifted(kind, content, n),
                    )
                    for n, each in enumerate(logs)
                ),
            )


def as_if(entry: Entry, batch: Path, log: BatchLog) -> Entry:
    """The entry of one log as if it were that of another."""
    assert entry.making is not None
    made_ns = (result_of(batch, log.name) / MARK).stat().st_mtime_ns
    outcome = replace(entry.outcome, name=log.name)
    return replace(
        entry,
        outcome=outcome,
        making=replace(entry.making, made_ns=made_ns),
        truth=json.dumps(truth_state(log)),
    )


def shifted(kind: str, content: bytes, hours: int) -> bytes:
    """What was kept of a log, as if it had been driven so many hours later."""
    words, arrays = unpack(content, kind)
    later_ns = hours * 3600 * 10**9
    if kind == REPORT_PART:
        latest = [[row[0] + later_ns, *row[1:]] for row in words["latest"]]
        words |= {"begin_ns": words["begin_ns"] + later_ns, "latest": latest}
        return pack(words, arrays | {"stamps": arrays["stamps"] + later_ns})
    if kind != LOOKS:
        return content
    later = {name: arrays[name] + later_ns for name in ("first_ns", "last_ns")}
    return pack(words, arrays | later | {"minutes": arrays["minutes"] + 60 * hours})


LOOKS = looks.kind_of(OpenAbove(), filtered=False)
REPORT_PART = batch_part.kind_of(filtered=False)
KINDS = {
    evaluation.kind_of(filtered=False): lambda result, log: evaluation.stamp_of(result, log, False),
    LOOKS: lambda result, log: looks.stamp_of(result, False),
    REPORT_PART: lambda result, log: batch_part.part_of(result, log, False).stamp,
}


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]).absolute(), int(sys.argv[4]))
