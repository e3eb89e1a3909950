"""How good estimates are in a building that was learnt from a map: ``python -m benchmarks.from_map``

What the README's three commands come to, where nobody edits anything. Doors of a floor of
``benchmarks.floors`` are found in its map and three drives (``building learn --map``), the building
is adjusted to these drives and some more (``building learn --building``), and other drives are
estimated with the building as it was found, as it was adjusted, and as it was built.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import polars as pl

from benchmarks.finding import NORMAL_90, add_kinds, closed, floor_of
from benchmarks.floors import Floor, make_drives
from benchmarks.independent.metrics import SECOND, SURE, WRONG
from benchmarks.independent.options import seeds_of
from objstate import RunOptions, estimate_log, load_building
from objstate.building.door_table import Door
from objstate.building.model import Building, Kind
from objstate.discovery import learn_doors, refine_building
from objstate.geometry import wrap

FOUND_BY = 3  # drives


@dataclass
class Tally:
    """What was measured of one kind of building."""

    hinges_m: list[float] = field(default_factory=list)
    held: list[bool] = field(default_factory=list)  # hinges, in both coordinates
    bearings_deg: list[float] = field(default_factory=list)
    bearings_held: list[bool] = field(default_factory=list)
    angles_deg: list[float] = field(default_factory=list)  # of leaves at the end of a drive
    angles_held: list[bool] = field(default_factory=list)
    wrong_s: float = 0.0  # confidently wrong
    all_s: float = 0.0


def placed(building: Building) -> dict[str, Door]:
    """The doors that turn of a building, as tables have them."""
    out = {}
    for name, item in building.objects.items():
        if item.kind is Kind.HINGED:
            bearing = float(np.arctan2(item.origin[1, 0], item.origin[0, 0]))
            width = float(item.mesh.vertices[:, 0].max())
            sense = int(np.sign(item.direction[2]))
            out[name] = Door(name, item.hinge, bearing, sense, width, item.upper)
    return out


def matches(floor: Floor, doors: Mapping[str, Door]) -> dict[str, Door]:
    """The true door that each of a building's doors is, where it has the right hinge and side."""
    out = {}
    for true in floor.doors_in_map if doors else ():
        middle = closed(true)[1]
        name = min(doors, key=lambda each: float(np.hypot(*(closed(doors[each])[1] - middle))))
        is_at_hinge = np.hypot(*(doors[name].hinge - true.hinge)) < true.width / 2.0
        if is_at_hinge and doors[name].sense == true.sense:
            out[name] = true
    return out


def hang(
    tally: Tally, building: Building, doors: Mapping[str, Door], true: Mapping[str, Door]
) -> None:
    """Add how far hinges and bearings are off."""
    errors = building.error.doors if building.error else {}
    for name, door in true.items():
        off = doors[name].hinge - door.hinge
        turn = abs(float(np.degrees(wrap(doors[name].closed_bearing - door.closed_bearing))))
        tally.hinges_m.append(float(np.hypot(*off)))
        tally.bearings_deg.append(turn)
        if name in errors:
            tally.held.append(bool((np.abs(off) <= NORMAL_90 * errors[name].hinge_std_m).all()))
            tally.bearings_held.append(turn <= NORMAL_90 * errors[name].bearing_std_deg)


def estimated(
    tally: Tally,
    log: Path,
    urdf: Path,
    true: Mapping[str, Door],
    states: Mapping[str, float],
    run: RunOptions,
) -> None:
    """Add how far leaves are off in a drive during which none is moved."""
    with tempfile.TemporaryDirectory() as scratch:
        estimate_log([log], urdf, Path(scratch) / "out", run)
        table = pl.read_parquet(Path(scratch) / "out" / "smoothed.parquet")
    for name, door in sorted(true.items()):
        rows = table.filter(pl.col("object") == name).sort("stamp")
        if not len(rows):
            continue
        truth = float(np.degrees(states[door.name]))
        middle, low, high = (
            np.degrees(rows[each].to_numpy()) for each in ("median", "lower", "upper")
        )
        off = np.abs(middle - truth)
        is_wrong = (off > WRONG) & (high - low < SURE) & ((truth < low) | (truth > high))
        step = np.append(np.diff(rows["stamp"].to_numpy()), 0) / SECOND
        tally.wrong_s += float(step[is_wrong].sum())
        tally.all_s += float(step.sum())
        tally.angles_deg.append(float(off[-1]))
        tally.angles_held.append(bool(low[-1] - 0.01 <= truth <= high[-1] + 0.01))


def row(name: str, tally: Tally) -> str:
    """A row of the table."""
    hinge, angle = 100.0 * np.array(tally.hinges_m), np.array(tally.angles_deg)
    held = [f"{np.mean(each):.0%}" if each else "-" for each in (tally.held, tally.bearings_held)]
    return (
        f"| {name} | {len(hinge)} | {np.median(hinge):.1f}, {np.quantile(hinge, 0.95):.1f}, {held[0]} "
        f"| {np.median(tally.bearings_deg):.2f}, {np.quantile(tally.bearings_deg, 0.95):.2f}, {held[1]} "
        f"| {len(angle)} | {angle.mean():.2f}, {np.median(angle):.2f} | {np.mean(tally.angles_held):.0%} "
        f"| {tally.wrong_s / max(tally.all_s, 1e-9):.2%} |"
    )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=seeds_of, default=seeds_of("1:5"))
    parser.add_argument("--more", type=int, default=0, help="drives that only adjust the building")
    parser.add_argument("--held-out", type=int, default=1, help="drives that are estimated")
    parser.add_argument("--keep", type=Path, help="a folder for drives, taken from there again")
    add_kinds(parser)
    given = parser.parse_args()
    tallies = {name: Tally() for name in ("found", "adjusted", "exact")}
    for seed in given.seeds:
        with tempfile.TemporaryDirectory() as scratch:
            _of_seed(seed, given, Path(scratch), tallies)
    print(
        "| building | doors | hinge: median, 95 % (cm), held | bearing: median, 95 % (deg), held "
        "| leaves | off at the end: mean, median (deg) | in 90 % | confidently wrong |\n|"
        + " --- |"
        * 8
    )
    for name, tally in tallies.items():
        print(row(name, tally))


def _of_seed(
    seed: int, given: argparse.Namespace, scratch: Path, tallies: Mapping[str, Tally]
) -> None:
    """Add a floor."""
    floor, count = floor_of(seed, given), FOUND_BY + given.more + given.held_out
    floor.turn = 0.0  # so that the building as it was built has the map's frame
    folder = (given.keep or scratch) / f"{seed}_{count}"
    folder.mkdir(parents=True, exist_ok=True)
    drives = make_drives(floor, folder, seed, count, 0.5)
    learnt, began = drives.logs[: count - given.held_out], time.perf_counter()
    found = learn_doors(learnt[:FOUND_BY], drives.map, scratch / "found", jobs=1)
    between = time.perf_counter()
    better = refine_building(learnt, found.urdf, scratch / "adjusted", jobs=1)
    ended = time.perf_counter()
    true = matches(floor, placed(load_building(found.urdf)))
    same = {door.name: door for door in true.values()}
    mounts = {each.frame: each.corrected_mount for each in better.lasers}
    for name, urdf, doors, run in (
        ("found", found.urdf, true, RunOptions()),
        ("adjusted", better.urdf, true, RunOptions(mounts=mounts)),
        ("exact", folder / "building" / "floor.urdf", same, RunOptions()),
    ):
        model = load_building(urdf)
        hang(tallies[name], model, placed(model), doors)
        for number in range(count - given.held_out, count):
            state = drives.states[number + 1]
            estimated(tallies[name], drives.logs[number], urdf, doors, state, run)
    print(
        f"<!-- seed {seed}: {len(floor.doors)} doors, {len(found.candidates)} candidates, {len(true)} right; "
        f"found in {between - began:.0f} s, adjusted in {ended - between:.0f} s -->",
        flush=True,
    )


if __name__ == "__main__":
    main()
