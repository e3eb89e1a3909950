"""Hours of robots in minutes: python benchmarks/service_soak.py [MINUTES] [ROBOTS] [SPEED]

Robots drive the sample log again and again, faster than real time, each drive with stamps of its own
clock, which begins anew. Prints the memory of the service and of what it started, as time goes by.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from service_setup import ROOT, Running, free_port, serving

from objstate.client import Client

LOG, BUILDING = ROOT / "logs/corridor.mcap", ROOT / "models/corridor/corridor.urdf"
EVERY_S = 30.0


def keep_driving(port: int, speed: float, ended: threading.Event) -> None:
    """Be a robot, one drive after the other."""
    while not ended.is_set():
        command = [sys.executable, "-m", "tests.service.replay", str(LOG), str(port), str(speed)]
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL)
        while process.poll() is None and not ended.wait(0.2):
            pass
        process.kill()


def family_mb(service: Running) -> tuple[float, float]:
    """Resident memory of the service, and of all that it started."""
    tasks = Path(f"/proc/{service.process.pid}/task").iterdir()
    children = [each for task in tasks for each in (task / "children").read_text().split()]
    return service.memory_mb, sum(map(_resident_mb, children))


def _resident_mb(process: str) -> float:
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    rows = (int(row.split()[1]) for row in status.splitlines() if row.startswith("VmRSS"))
    return next(rows, 0) / 1024


def main(minutes: float, robots: int, speed: float) -> None:
    """Drive, and print a line each half minute."""
    ports, ended = [free_port() for _ in range(robots)], threading.Event()
    threads = [
        threading.Thread(target=keep_driving, args=(port, speed, ended), daemon=True)
        for port in ports
    ]
    more = [f"--foxglove=r{k}=ws://127.0.0.1:{port}" for k, port in enumerate(ports)]
    with tempfile.TemporaryDirectory() as folder, serving(BUILDING, Path(folder), *more) as service:
        for thread in threads:
            thread.start()
        began = time.monotonic()
        with Client(service.url, service.token) as client:
            while time.monotonic() - began < 60.0 * minutes:
                time.sleep(EVERY_S)
                drives = client.drives()
                done = sum(each.state == "done" for each in drives)
                own, others = family_mb(service)
                print(
                    f"{time.monotonic() - began:.0f} s: service {own:.0f} MB, its processes "
                    f"{others:.0f} MB; {len(drives)} drives, {done} estimated",
                    flush=True,
                )
        ended.set()


if __name__ == "__main__":
    given = [float(each) for each in sys.argv[1:]] + [6.0, 4, 8.0][len(sys.argv) - 1 :]
    main(given[0], int(given[1]), given[2])
