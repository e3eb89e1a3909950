"""What the commands of independent drives have in common."""

from __future__ import annotations

import argparse
from collections.abc import Collection
from functools import partial
from pathlib import Path

from benchmarks.independent.runner import Task


def seeds_of(text: str) -> list[int]:
    """``1:9`` is 1 to 8, ``3`` is 3; several are parted by commas."""
    seeds: list[int] = []
    for part in text.split(","):
        begin, colon, end = part.partition(":")
        seeds += range(int(begin), int(end)) if colon else [int(begin)]
    return seeds


def scenarios_of(known: Collection[str], text: str) -> list[str]:
    """Names parted by commas, of those that are known."""
    names = text.split(",")
    for name in names:
        if name not in known:
            raise argparse.ArgumentTypeError(f"no scenario '{name}'; choose of {', '.join(known)}")
    return names


def add_options(parser: argparse.ArgumentParser, scenarios: Collection[str]) -> None:
    """Add what tells which drives to estimate, and how."""
    parser.add_argument(
        "--scenarios",
        type=partial(scenarios_of, scenarios),
        default=list(scenarios),
        help=f"by commas; default: all of {', '.join(scenarios)}",
    )
    parser.add_argument("--seeds", type=seeds_of, default=[1, 2, 3, 4], help="as in 1:9 or 3,5")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--settings", type=Path, help="YAML, as of `objstate estimate --config`")
    parser.add_argument("--cache", type=Path, default=Path("out/independent"), help="of drives")
    parser.add_argument("--keep", type=Path, help="a folder for the results of all drives")
    parser.add_argument("--json", type=Path, help="write what was measured")


def tasks_of(given: argparse.Namespace) -> list[Task]:
    """The drives that these options name."""
    return [
        Task(scenario, seed, given.cache, given.settings, given.keep)
        for scenario in given.scenarios
        for seed in given.seeds
    ]
