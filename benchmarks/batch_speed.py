"""How much faster two workers are than one: ``python benchmarks/batch_speed.py DRIVES [BLOCKS]``

DRIVES is what ``minute_logs.py`` made. The logs are taken in blocks, and each block is run by one
worker and by two, one right after the other, so that other load on the machine hits both. Prints
the seconds of each run, what of them the workers spent in logs, how their memory grew, and the
ratios.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import polars as pl

CORRIDOR = Path(__file__).parents[1] / "models" / "corridor" / "corridor.urdf"


def main(drives: Path, blocks: int) -> None:
    """Measure and print."""
    logs = sorted(drives.glob("drive_*/log.mcap"))
    size = len(logs) // blocks
    with tempfile.TemporaryDirectory() as folder:
        wall, used = {1: 0.0, 2: 0.0}, {1: 0.0, 2: 0.0}
        for block in range(blocks):
            chosen = logs[block * size : (block + 1) * size]
            for workers in (1, 2) if block % 2 else (2, 1):
                out = Path(folder) / f"{workers}-{block}"
                began = resource.getrusage(resource.RUSAGE_CHILDREN)
                seconds = timed(start(chosen, out, workers, drives))
                cpu = processor(resource.getrusage(resource.RUSAGE_CHILDREN)) - processor(began)
                wall[workers] += seconds
                used[workers] += cpu
                print(
                    f"block {block}, {workers} workers: {seconds:.1f} s, {cpu:.1f} s of processor, "
                    f"busy {100 * busy(out) / seconds / workers:.1f} %, {memory(out)}",
                    flush=True,
                )
        print(f"over {blocks * size} logs: {wall[1] / wall[2]:.2f} times as fast by the clock, ")
        print(f"with {used[2] / used[1]:.2f} times the processor time", flush=True)


def processor(usage: resource.struct_rusage) -> float:
    """Seconds of processor."""
    return usage.ru_utime + usage.ru_stime


def busy(out: Path) -> float:
    """Seconds that workers spent in logs."""
    return float(pl.read_parquet(out / "timings.parquet")["elapsed_seconds"].sum())


def start(
    logs: list[Path], out: Path, workers: int, truth: Path, *more: str
) -> subprocess.Popen[bytes]:
    """``objstate batch`` as a process of its own."""
    names = [str(log) for log in logs]
    command = ["batch", *names, "--building", str(CORRIDOR)]
    options = [
        "--out",
        str(out),
        "--workers",
        str(workers),
        "--truth",
        str(truth),
        "--quiet",
        *more,
    ]
    code = "import sys; from objstate.cli import main; sys.exit(main())"
    return subprocess.Popen(
        [sys.executable, "-c", code, *command, *options], stdout=subprocess.DEVNULL
    )


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


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
