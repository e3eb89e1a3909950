"""Memory and speed over an hour of driving: ``python -m benchmarks.speed --hour``"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks.speed.table import Table, number
from objstate.run import RunOptions, estimate_log
from objstate.simulation import simulate

CORRIDOR = Path(__file__).parents[2] / "models" / "corridor" / "corridor.urdf"
ENDS = (1.5, 38.5)  # m along the corridor, between which the robot goes to and fro
SPEED = 0.7  # m/s
COMPILED = 30.0  # s of log after which all loops have been compiled
EVERY = 600.0  # s of log between looks at the memory
MEGABYTE = 1024.0  # kB

SCENE = """
building: {building}
route:
  speed: {speed}
  waypoints: [{waypoints}]
lasers:
  - {{mount: {{x: 0.22, z: 0.3}}, beams: 180, range_max: 8.0, rate: 10.0, false_share: 0.02}}
objects:
  - {{name: "door_*", initial: spread}}
"""


def hour(minutes: float) -> list[Table]:
    """Simulate a log of so many minutes at 10 scans a second, estimate it, watch the memory."""
    with tempfile.TemporaryDirectory() as folder:
        log = simulate(_scene(Path(folder), 60.0 * minutes), Path(folder) / "drive").log
        return [memory_over(log)]


def memory_over(log: Path) -> Table:
    """What a process takes that estimates a log, as time goes by; all loops were compiled before."""
    _watched(log, end=COMPILED)
    looks = _watched(log)
    rows = [
        (
            f"{look['log_s'] / 60.0:.0f}",
            number(look["resident_mb"]),
            number(look["peak_mb"]),
            number(look["processor_s"]),
        )
        for look in looks
    ]
    last = looks[-1]
    return Table(
        f"{last['log_s'] / 60.0:.0f} minutes of log at 10 scans a second",
        ("minutes of log", "MB in memory", "MB at most so far", "s of processor time"),
        rows,
        (
            f"Up and down the corridor with fourteen doors, 180 beams, default settings: "
            f"{number(last['log_s'] / last['processor_s'])} times real time, start-up, reading and "
            "writing included. The first row was taken before the first scan.",
        ),
    )


def _watched(log: Path, end: float | None = None) -> list[dict[str, float]]:
    """What ``watched`` tells in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        part = [] if end is None else [str(end)]
        command = [sys.executable, "-m", __name__, str(log), str(Path(folder) / "result"), *part]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def _scene(folder: Path, seconds: float) -> Path:
    """A scene that lasts about so long."""
    ways = max(round(seconds * SPEED / (ENDS[1] - ENDS[0])), 1)
    points = [f"{{x: {ENDS[k % 2]}, y: 0.0}}" for k in range(ways + 1)]
    scene = folder / "hour.scene.yaml"
    text = SCENE.format(building=CORRIDOR, speed=SPEED, waypoints=", ".join(points))
    scene.write_text(text, encoding="utf-8")
    return scene


def watched(log: Path, out: Path, end: float | None = None) -> None:
    """Estimate a log; print what the process takes, as JSON, each time that ``EVERY`` s have gone by."""
    due = 0.0

    def look(log_s: float) -> None:
        used = {key: value / MEGABYTE for key, value in _memory()}
        told = {"log_s": log_s, "processor_s": time.process_time()} | used
        print(json.dumps(told), flush=True)

    def on_progress(_: float, log_s: float) -> None:
        nonlocal due
        if log_s >= due:
            look(log_s)
            due += EVERY

    result = estimate_log([log], CORRIDOR, out, RunOptions(end=end), on_progress=on_progress)
    look(result.log_seconds)


def _memory() -> Iterator[tuple[str, int]]:
    """What Linux says that this process takes, kB."""
    names = {"VmRSS:": "resident_mb", "VmHWM:": "peak_mb"}
    for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
        fields = line.split()
        if fields[0] in names:
            yield names[fields[0]], int(fields[1])


if __name__ == "__main__":
    watched(Path(sys.argv[1]), Path(sys.argv[2]), *map(float, sys.argv[3:]))
