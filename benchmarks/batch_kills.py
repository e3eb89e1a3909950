"""Kills workers, and the batch itself, again and again: ``python benchmarks/batch_kills.py DRIVES OUT``

DRIVES is what ``minute_logs.py`` made, OUT a batch of just these logs that ran undisturbed. A
worker is killed every few seconds, and now and then the batch; it is started again until it is
done. Prints how much was killed and whether the combined tables are the same bytes as OUT's.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from pathlib import Path

import polars as pl
from batch_speed import start

PAUSE = 10.0  # s between two kills, in the mean
OF_BATCH = 0.2  # share of kills that hit the batch itself


def main(drives: Path, quiet: Path) -> None:
    """Run, kill, start again, compare."""
    names = set(pl.read_parquet(quiet / "summary.parquet")["log"])
    logs = [log for log in sorted(drives.glob("drive_*/log.mcap")) if log.parent.name in names]
    rng, kills, starts, lost = random.Random(0), 0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        out, finished = Path(folder) / "out", set()
        while True:
            batch = start(logs, out, 2, drives)
            starts += 1
            while batch.poll() is None:
                time.sleep(rng.expovariate(1 / PAUSE))
                lost += len(finished - results(out))
                finished = results(out)
                workers = children(batch.pid)
                if rng.random() < OF_BATCH:
                    batch.kill()
                elif workers:
                    os.kill(rng.choice(workers), signal.SIGKILL)
                    kills += 1
            if batch.returncode == 0:
                break
            if batch.returncode != -signal.SIGKILL:
                retry = start(logs, out, 2, drives, "--retry-failed")
                if retry.wait() == 0:
                    break
        same = tables(out) == tables(quiet)
    print(f"{len(logs)} logs, {starts} starts, {kills} workers killed, {lost} finished logs lost")
    print(f"the same bytes: {same}")


def results(out: Path) -> set[str]:
    """The logs whose results are there."""
    return {mark.parent.name for mark in out.glob("logs/[!.]*/.objstate")}


def tables(out: Path) -> dict[str, bytes]:
    """The combined tables."""
    files = [out / "summary.parquet", *sorted(out.glob("*.parquet/*"))]
    return {str(file.relative_to(out)): file.read_bytes() for file in files}


def children(parent: int) -> list[int]:
    """The worker processes of a batch."""
    listed = Path(f"/proc/{parent}/task").glob("*/children")
    return [int(pid) for file in listed for pid in file.read_text().split()]


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
