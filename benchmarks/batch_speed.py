"""How much faster two workers are than one: ``python benchmarks/batch_speed.py DRIVES [BLOCKS]``

DRIVES is what ``minute_logs.py`` made. The logs are taken in blocks, and each block is run by one
worker and by two, one right after the other, so that other load on the machine hits both. Prints
the seconds of each run, their ratio, and how the memory of the workers grew. Then all logs are
run once more by two workers while one of them is killed every few seconds, and the combined
tables are compared with those of the quiet runs.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import polars as pl

CORRIDOR = Path(__file__).parents[1] / "models" / "corridor" / "corridor.urdf"
KILL_EVERY = 7.0  # s


def main(drives: Path, blocks: int) -> None:
    """Measure and print."""
    logs = sorted(drives.glob("drive_*/log.mcap"))
    size = len(logs) // blocks
    with tempfile.TemporaryDirectory() as folder:
        totals = {1: 0.0, 2: 0.0}
        for block in range(blocks):
            chosen = logs[block * size : (block + 1) * size]
            for workers in (1, 2) if block % 2 else (2, 1):
                out = Path(folder) / f"{workers}-{block}"
                seconds = timed(start(chosen, out, workers, drives))
                totals[workers] += seconds
                print(
                    f"block {block}, {workers} workers: {seconds:.1f} s, {memory(out)}", flush=True
                )
        print(f"ratio over {blocks * size} logs: {totals[1] / totals[2]:.2f}", flush=True)
        if blocks == 1:
            killed(logs, Path(folder) / "2-0", Path(folder) / "killed", drives)


def start(logs: list[Path], out: Path, workers: int, truth: Path) -> subprocess.Popen[bytes]:
    """``objstate batch`` as a process of its own."""
    names = [str(log) for log in logs]
    command = ["batch", *names, "--building", str(CORRIDOR)]
    options = ["--out", str(out), "--workers", str(workers), "--truth", str(truth), "--quiet"]
    code = "import sys; from objstate.cli import main; sys.exit(main())"
    return subprocess.Popen([sys.executable, "-c", code, *command, *options])


def timed(process: subprocess.Popen[bytes]) -> float:
    """Seconds until a batch ended well."""
    began = time.monotonic()
    if process.wait():
        raise SystemExit("a batch failed")
    return time.monotonic() - began


def memory(out: Path) -> str:
    """How the workers' largest memory grew from their first logs to their last."""
    peaks = pl.read_parquet(out / "timings.parquet")["peak_memory_mb"].sort()
    return (
        f"peak memory {peaks.min():.0f} MB after the first log, {peaks.max():.0f} MB after the last"
    )


def killed(logs: list[Path], quiet: Path, out: Path, truth: Path) -> None:
    """Run all logs while workers are killed at random; compare the tables."""
    rng, kills = random.Random(0), 0
    batch = start(logs, out, 2, truth)
    while batch.poll() is None:
        time.sleep(rng.uniform(0.5, 2 * KILL_EVERY))
        workers = children(batch.pid)
        if workers:
            os.kill(rng.choice(workers), signal.SIGKILL)
            kills += 1
    same = all(
        (quiet / part).read_bytes() == (out / part).read_bytes()
        for part in (
            "summary.parquet",
            *(str(p.relative_to(quiet)) for p in quiet.glob("estimates.parquet/*/*")),
        )
    )
    print(f"{kills} workers killed, exit code {batch.returncode}, the same bytes: {same}")
    print(
        f"attempts: {pl.read_parquet(out / 'timings.parquet')['attempts'].value_counts(sort=True).rows()}"
    )


def children(parent: int) -> list[int]:
    """The worker processes of a batch."""
    listed = Path(f"/proc/{parent}/task").glob("*/children")
    return [int(pid) for file in listed for pid in file.read_text().split()]


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
