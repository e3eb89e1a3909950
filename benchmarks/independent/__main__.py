"""``python -m benchmarks.independent``: simulate, estimate, and print a table per scenario."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.independent.options import add_options, tasks_of
from benchmarks.independent.results import from_json, to_json
from benchmarks.independent.runner import measure_all, run
from benchmarks.independent.scenarios import SCENARIOS
from benchmarks.independent.table import comparison, table


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 1 if a drive failed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.independent",
        description="Accuracy on drives of an independent simulator.",
    )
    add_options(parser, SCENARIOS)
    parser.add_argument("--against", type=Path, help="JSON of another run, paired by seed")
    given = parser.parse_args(arguments)

    drives, failures = measure_all(run, tasks_of(given), given.jobs)
    if given.json:
        given.json.parent.mkdir(parents=True, exist_ok=True)
        given.json.write_text(to_json(drives), encoding="utf-8")
    print(table(drives))
    if given.against:
        print("\n" + comparison(drives, from_json(given.against.read_text(encoding="utf-8"))))
    for failure in failures:
        print(f"failed: {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
