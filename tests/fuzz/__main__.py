"""``make fuzz``: mutants of every kind of file, for as long as asked, by processes of their own."""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.fuzz.targets import LOGS, TARGETS
from tests.fuzz.worker import mutants

SLICE = 1000  # mutants of one process
LOG_SLICES = 3  # of every log format, for one of every other file


def main() -> int:
    """Returns 1 if anything was found."""
    asked = _arguments()
    names = asked.targets or list(TARGETS)
    end = time.monotonic() + 60 * asked.minutes
    run: Counter[str] = Counter()
    found: dict[str, list[str]] = {}
    asked.out.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(asked.jobs) as pool:
        slices = _slices(names, asked.count, end)
        for name, number, faults in pool.map(lambda each: _run(*each, asked.seed), slices):
            run[name] += number
            for index, fault in faults:
                kind = f"{name}: {re.sub(r'[0-9]+', '0', fault)[-200:]}"
                if kind not in found:
                    print(f"{name} {asked.seed} {index}: {fault}", flush=True)
                    _keep(name, asked.seed, index, asked.out)
                found.setdefault(kind, []).append(f"{index}")
    for name in names:
        print(f"{run[name]:8d} mutants of {name}")
    print(f"{sum(map(len, found.values()))} faults of {len(found)} kinds; files in {asked.out}")
    return 1 if found else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", help=f"of {', '.join(TARGETS)}; default: all")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--count", type=int, default=10**9, help="of mutants of each at most")
    parser.add_argument(
        "--seed", type=int, default=int(time.time()), help="default: another each time"
    )
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--out", type=Path, default=Path("out/fuzz"), help="where what fails is put"
    )
    return parser.parse_args()


def _slices(names: list[str], most: int, end: float) -> Iterator[tuple[str, int, int, float]]:
    """Name, first and last mutant of each process, in turn, and when all has to end."""
    begun: Counter[str] = Counter()
    for _ in count():
        waiting = [name for name in names if begun[name] < most]
        if not waiting or time.monotonic() > end:
            return
        for name in waiting:
            for _each in range(LOG_SLICES if name in LOGS else 1):
                start = begun[name]
                begun[name] = stop = min(start + SLICE, most)
                if start < stop:
                    yield name, start, stop, end


def _run(
    name: str, start: int, stop: int, end: float, seed: int
) -> tuple[str, int, list[tuple[int, str]]]:
    """Faults of a slice, by mutant. A process that hangs or dies is followed by another."""
    faults: list[tuple[int, str]] = []
    begin = start
    with TemporaryDirectory() as folder:
        note = Path(folder) / "note"
        while start < stop and time.monotonic() < end:
            command = [sys.executable, "-m", "tests.fuzz.worker", name, str(seed)]
            command += [str(start), str(stop), str(note)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            for line in done.stdout.splitlines():
                told = json.loads(line)
                faults.append((told["index"], told["fault"]))
            last = int(note.read_text()) if note.exists() else start
            if done.returncode:
                faults.append((last, f"died ({done.returncode}): {done.stderr[-600:]}"))
            start = last + 1
    return name, start - begin, faults


def _keep(name: str, seed: int, index: int, out: Path) -> None:
    ((_, content),) = mutants(name, seed, index, index + 1)
    (out / f"{name}-{seed}-{index}").write_bytes(content)


if __name__ == "__main__":
    sys.exit(main())
