"""What a planner pays for a world of many beliefs: ``python benchmarks/worlds.py DIR COUNT [OBJECTS]``

Makes a world of COUNT beliefs of OBJECTS doors (100), one each ten minutes in turns, and loads it in
processes of its own, as a planner does and whole. Prints the milliseconds and how much the memory
grew, and what thinning leaves.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

from sqlalchemy import insert

from objstate.building.model import Building
from objstate.objects import ObjectBelief
from objstate.world import World
from objstate.world.codec import pack_belief
from objstate.world.forgetting import Thinning
from objstate.world.schema import BELIEFS
from objstate.world.store import DriveEntry, open_store
from tests.rooms import building, door, enclosure

STEP_NS = 600 * 10**9
AT_ONCE = 10_000
WHOLE = 50_000  # beliefs, above which a world isn't loaded whole


def main(home: Path, count: int, doors: int) -> None:
    """Make the world where there is none, and measure."""
    place = home / f"world-{count}-{doors}.db"
    if not place.exists():
        make(place, count, doors)
    print(f"{count} beliefs of {doors} doors, {place.stat().st_size / 1e6:.0f} MB of database")
    for how in ("newest", *(["whole"] if count <= WHOLE else [])):
        subprocess.run([sys.executable, __file__, "load", str(place), how], check=True)
    began = time.monotonic()
    gone = open_store(place).thin(Thinning())
    print(f"thinned in {time.monotonic() - began:.1f} s: {gone} beliefs went")


def make(place: Path, count: int, doors: int) -> None:
    """A world with the same belief of each door again and again."""
    items = [door(f"door_{n:04d}", float(n), 0.0) for n in range(doors)]
    rooms: Building = building(enclosure(doors + 4.0, 6.0), *items)
    store = open_store(place, rooms)
    start = World.of(rooms.objects)
    first: list[ObjectBelief] = [replace(start.at(0)[name]) for name in rooms.objects]
    store.add(DriveEntry("year", 0, count * STEP_NS), first)
    packed = {belief.item.name: pack_belief(belief) for belief in first}
    names = list(packed)
    with store._database.writing() as connection:
        for begin in range(1, count // doors, AT_ONCE // doors):
            rows = [
                {"object": name, "stamp_ns": n * STEP_NS, "drive": 1, "last_observed_ns": None,
                 "belief": packed[name]}
                for n in range(begin, min(begin + AT_ONCE // doors, count // doors))
                for name in names
            ]  # fmt: skip
            connection.execute(insert(BELIEFS), rows)


def load(place: str, how: str) -> None:
    """Load a world, and print what it took beyond the program itself."""
    store = open_store(place)
    store.latest_ns()
    before, began = peak(), time.monotonic()
    world = store.load(newest=how == "newest")
    took = time.monotonic() - began
    print(f"{how}: {1000 * took:.0f} ms, {peak() - before:.0f} MB more, at {world.latest_ns} ns")


def peak() -> float:
    """The largest memory so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    if sys.argv[1] == "load":
        load(*sys.argv[2:])
    else:
        main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 100)
