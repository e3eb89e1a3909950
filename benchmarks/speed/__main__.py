"""Measures how fast objstate is, and writes it down: ``make bench``, ``make bench-hour``

Prints every table as soon as it is measured, and puts all of them into docs/performance.md,
where they replace those of before. ``--quick`` measures less and writes nothing.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from benchmarks.speed.growth import growth
from benchmarks.speed.hour import hour
from benchmarks.speed.localization import updates
from benchmarks.speed.machine import circumstances
from benchmarks.speed.objects import estimates
from benchmarks.speed.page import write
from benchmarks.speed.rays import rays_per_second, whole_scans
from benchmarks.speed.runs import sample_log, start_up, two_cores
from benchmarks.speed.table import Table, wrapped
from benchmarks.speed.timing import FULL, QUICK, Effort

PAGE = Path(__file__).parents[2] / "docs" / "performance.md"
MEASURES = (
    sample_log,
    two_cores,
    start_up,
    growth,
    updates,
    estimates,
    rays_per_second,
    whole_scans,
)


def tables(effort: Effort) -> Iterator[Table]:
    """All but the hour's."""
    for measure in MEASURES:
        yield from measure(effort)


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description="How fast is objstate?")
    parser.add_argument("--quick", action="store_true", help="measure less, write nothing")
    parser.add_argument("--hour", action="store_true", help="only memory over an hour of log")
    parser.add_argument("--minutes", type=float, default=60.0, help="of log, instead of an hour")
    given = parser.parse_args()
    measured = hour(given.minutes) if given.hour else tables(QUICK if given.quick else FULL)
    parts = [wrapped(circumstances())]
    print(parts[0] + "\n", flush=True)
    for table in measured:
        parts.append(table.markdown())
        print(parts[-1] + "\n", flush=True)
    if not given.quick and given.minutes == parser.get_default("minutes"):
        write(PAGE, "bench-hour" if given.hour else "bench", "\n\n".join(parts))


if __name__ == "__main__":
    main()
