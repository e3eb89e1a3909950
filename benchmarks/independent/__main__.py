"""``python -m benchmarks.independent``: simulate, estimate, and print a table per scenario."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.independent.results import from_json, to_json
from benchmarks.independent.runner import Task, measure_all
from benchmarks.independent.scenarios import SCENARIOS
from benchmarks.independent.table import comparison, table


def seeds_of(text: str) -> list[int]:
    """``1:9`` is 1 to 8, ``3`` is 3; several are parted by commas."""
    seeds: list[int] = []
    for part in text.split(","):
        begin, colon, end = part.partition(":")
        seeds += range(int(begin), int(end)) if colon else [int(begin)]
    return seeds


def scenarios_of(text: str) -> list[str]:
    """Names parted by commas."""
    names = text.split(",")
    for name in names:
        if name not in SCENARIOS:
            raise argparse.ArgumentTypeError(
                f"no scenario '{name}'; choose of {', '.join(SCENARIOS)}"
            )
    return names


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 1 if a drive failed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.independent",
        description="Accuracy on drives of an independent simulator.",
    )
    parser.add_argument(
        "--scenarios",
        type=scenarios_of,
        default=list(SCENARIOS),
        help=f"by commas; default: all of {', '.join(SCENARIOS)}",
    )
    parser.add_argument("--seeds", type=seeds_of, default=[1, 2, 3, 4], help="as in 1:9 or 3,5")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--settings", type=Path, help="YAML, as of `objstate estimate --config`")
    parser.add_argument("--cache", type=Path, default=Path("out/independent"), help="of drives")
    parser.add_argument("--keep", type=Path, help="a folder for the results of all drives")
    parser.add_argument("--json", type=Path, help="write what was measured")
    parser.add_argument("--against", type=Path, help="JSON of another run, paired by seed")
    given = parser.parse_args(arguments)

    tasks = [
        Task(scenario, seed, given.cache, given.settings, given.keep)
        for scenario in given.scenarios
        for seed in given.seeds
    ]
    drives, failures = measure_all(tasks, given.jobs)
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
