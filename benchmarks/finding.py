"""How well ``building learn --map`` finds doors: ``python -m benchmarks.finding --seeds 1:5``

Floors of ``benchmarks.floors``, a map of a drive on which doors stood in any state, and more drives:
three before each of which the same half of the doors was moved, or one on which nothing was. A door is found
if a candidate of probability above 0.5 has its middle within half its width of the closed leaf's,
and its hinge at the same end. Shelves in gaps, niches and openings without a leaf are no doors.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.floors import (
    Floor,
    entered,
    furnished,
    make_drives,
    make_floor,
    with_sliding,
    with_windows,
)
from benchmarks.independent.options import seeds_of
from objstate.building.door_table import Door
from objstate.discovery import learn_doors
from objstate.discovery.candidates import Candidate

NORMAL_90 = 1.645


@dataclass
class Tally:
    """What was found on some floors."""

    doors: int = 0
    found: int = 0  # with the hinge at the right end
    swapped: int = 0  # with the hinge at the other end
    false: int = 0
    hinge_m: list[float] = field(default_factory=list)
    width_m: list[float] = field(default_factory=list)
    bearing_deg: list[float] = field(default_factory=list)
    held: list[tuple[bool, bool, bool]] = field(default_factory=list)  # hinge, bearing, width
    # of the end with the hinge and the way to open: the stated probability, and whether it is right
    sides: list[tuple[float, bool]] = field(default_factory=list)
    sliding: int = 0  # of the doors
    # of those found that slide, and of those that are said to: whether the other holds as well
    slides: list[bool] = field(default_factory=list)
    said: list[bool] = field(default_factory=list)


def closed(door: Door) -> tuple[np.ndarray, np.ndarray]:
    """(2,) direction of a closed leaf and its middle."""
    along = np.array([np.cos(door.closed_bearing), np.sin(door.closed_bearing)])
    return along, door.hinge + door.width / 2.0 * along


def compare(floor: Floor, found: Sequence[Candidate], tally: Tally) -> None:
    """Add a floor to a tally."""
    left = [each for each in found if each.probability > 0.5]
    tally.doors += len(floor.doors)
    tally.sliding += sum(door.slides for door in floor.doors)
    for door in floor.doors_in_map:
        along, middle = closed(door)
        near = sorted(left, key=lambda each: float(np.hypot(*(closed(each.door)[1] - middle))))
        if not near or np.hypot(*(closed(near[0].door)[1] - middle)) > door.width / 2.0:
            continue
        best = near[0]
        left.remove(best)
        if door.slides:
            tally.slides.append(best.door.slides)
        if best.door.slides:
            tally.said.append(door.slides)
        is_swapped = bool(np.hypot(*(best.door.hinge - door.hinge)) > door.width / 2.0)
        is_right = not is_swapped and best.door.sense == door.sense
        tally.sides.append((best.side_probability, is_right))
        if is_swapped:
            tally.swapped += 1
            continue
        tally.found += 1
        off = best.door.hinge - door.hinge
        across = np.array([-along[1], along[0]])
        parts = np.abs([off @ along, off @ across])
        turn = best.door.closed_bearing - door.closed_bearing
        bearing = abs((turn + np.pi) % (2.0 * np.pi) - np.pi)
        width = abs(best.door.width - door.width)
        tally.hinge_m.append(float(np.hypot(*off)))
        tally.width_m.append(float(width))
        tally.bearing_deg.append(float(np.degrees(bearing)))
        tally.held.append(
            (
                bool((parts <= NORMAL_90 * np.asarray(best.hinge_std)).all()),
                bool(bearing <= NORMAL_90 * best.bearing_std),
                bool(width <= NORMAL_90 * best.width_std),
            )
        )
    tally.false += len(left)


def row(name: str, tally: Tally, seconds: float) -> str:
    """A row of the table."""
    hinge, width = 100.0 * np.array(tally.hinge_m), 100.0 * np.array(tally.width_m)
    held = 100.0 * np.mean(tally.held, axis=0) if tally.held else np.zeros(3)
    stated, right = np.mean(tally.sides, axis=0) if tally.sides else np.zeros(2)
    claimed = max(tally.found + tally.swapped + tally.false, 1)
    return (
        f"| {name} | {tally.doors} | {tally.found / tally.doors:.0%} "
        f"| {tally.swapped / tally.doors:.0%} | {tally.false / claimed:.0%} "
        f"| {np.median(hinge):.1f}, {np.quantile(hinge, 0.95):.1f} "
        f"| {np.median(width):.1f}, {np.quantile(width, 0.95):.1f} "
        f"| {np.median(tally.bearing_deg):.1f} | {stated:.0%}, {right:.0%} | {held[0]:.0f}, {held[1]:.0f}, {held[2]:.0f} % "
        f"| {seconds:.0f} |"
    )


def add_kinds(parser: argparse.ArgumentParser) -> None:
    """Add the options of what kind floors are."""
    parser.add_argument("--furnished", action="store_true", help="rooms full of furniture, entered")
    parser.add_argument("--entered", action="store_true", help="rooms entered, a turned map")
    parser.add_argument("--sliding", action="store_true", help="half of the doors slide")
    parser.add_argument("--recessed", action="store_true", help="half of the doors in alcoves")
    parser.add_argument("--windows", action="store_true", help="windows in the outer walls")


def floor_of(seed: int, given: argparse.Namespace) -> Floor:
    """A floor of the kind that these options ask for."""
    floor = make_floor(seed, recessed=given.recessed)
    if given.sliding:
        with_sliding(floor, seed)
    if given.windows:
        with_windows(floor, seed)
    if given.furnished:
        furnished(floor, seed)
    if given.entered:
        entered(floor, seed)
    return floor


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=seeds_of, default=seeds_of("1:5"))
    parser.add_argument("--keep", type=Path, help="a folder for drives, taken from there again")
    add_kinds(parser)
    given = parser.parse_args()
    cases = {"three drives, half of the doors moved": (3, 0.5), "one drive, none moved": (1, 0.0)}
    print(
        "| drives | doors | found | hinge at the other end | false | hinge: median, 95 % (cm) "
        "| width: median, 95 % (cm) | bearing: median (deg) | end and way: stated, right | in 90 %: hinge, bearing, width "
        "| s a floor |\n|" + " --- |" * 11
    )
    for name, (count, moved) in cases.items():
        tally, seconds = Tally(), 0.0
        for seed in given.seeds:
            floor = floor_of(seed, given)
            with tempfile.TemporaryDirectory() as scratch:
                folder = (given.keep or Path(scratch)) / f"{seed}_{count}"
                folder.mkdir(parents=True, exist_ok=True)
                drives = make_drives(floor, folder, seed, count, moved)
                began = time.perf_counter()
                found = learn_doors(
                    drives.logs, drives.map, Path(scratch) / "learnt", jobs=1
                ).candidates
                seconds += time.perf_counter() - began
            before = tally.found, tally.swapped, tally.false
            compare(floor, found, tally)
            print(
                f"<!-- seed {seed}: {len(floor.doors)} doors, found "
                f"{tally.found - before[0]}, swapped {tally.swapped - before[1]}, "
                f"false {tally.false - before[2]} -->",
                flush=True,
            )
        print(row(name, tally, seconds / len(given.seeds)), flush=True)
        if given.sliding:
            print(
                f"<!-- {tally.sliding} doors slide: {len(tally.slides)} are found, of {sum(tally.slides)} "
                f"that is said; it is said of {len(tally.said)} that are found, and right of "
                f"{sum(tally.said)} -->",
                flush=True,
            )


if __name__ == "__main__":
    main()
