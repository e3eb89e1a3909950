"""How fast a world answers planners: ``python benchmarks/planning.py``

A made-up office of 30 doors and 20 tables, seen once. Prints processor times: of
the fastest of some rounds, each the mean of many calls.
"""

from __future__ import annotations

import tempfile
import timeit
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path
from time import process_time

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.config import Settings
from objstate.geometry import transform
from objstate.objects import ObjectBelief, filter_for
from objstate.particles import Weights
from objstate.world import RouteEdge, Snapshot, World, door_modes, dynamic_edges
from objstate.world.store import DriveEntry, open_store

DOORS, TABLES = 30, 20
SECOND = 10**9
UP = np.array([0.0, 0.0, 1.0])
ROUNDS = 7


def office() -> Building:
    """Doors along one corridor, tables in a row behind them."""
    leaf = Box((0.9, 0.04, 2.0)).mesh().moved(transform(np.eye(3), [0.45, 0.0, 1.0]))
    top = Box((1.4, 0.7, 0.75)).mesh()
    doors = [
        MovableObject(f"door_{k:02d}", Kind.HINGED, at(3.0 * k, 0.0), UP, 0.0, np.pi / 2, leaf)
        for k in range(DOORS)
    ]
    tables = [
        MovableObject(f"table_{k:02d}", Kind.PLANAR, at(4.5 * k, 3.0), UP, 0.0, 0.0, top)
        for k in range(TABLES)
    ]
    return Building("office", Mesh.empty(), {item.name: item for item in (*doors, *tables)})


def at(x: float, y: float) -> np.ndarray:
    """A place on the floor, as a transform."""
    return transform(np.eye(3), [x, y, 0.0])


def seen_once(building: Building, stamp_ns: int) -> Iterator[ObjectBelief]:
    """Each object known to a degree or two, or to some centimetres."""
    rng = np.random.default_rng(0)
    for item in building.objects.values():
        prior = filter_for(item, Settings()).prior(rng)
        if item.kind is Kind.PLANAR:
            states = item.home + 0.03 * rng.standard_normal((250, 3))
            prior = prior.with_samples(states, Weights.uniform(250))
        else:
            off = (prior.states[:, 0] - rng.uniform(0.0, 1.5)) / 0.02
            prior = prior.with_weights(Weights.of(np.exp(-0.5 * off**2) + 1e-300))
        yield replace(prior, stamp_ns=stamp_ns, last_observed_ns=stamp_ns)


def microseconds(call: Callable[[], object], calls: int = 200) -> float:
    """Of one call, in the fastest of some rounds."""
    call()
    spent = timeit.repeat(call, number=calls, repeat=ROUNDS, timer=process_time)
    return min(spent) / calls * 1e6


def row(what: str, figure: float) -> None:
    """One row of the table."""
    shown = f"{figure / 1000:.1f} ms" if figure >= 1000 else f"{figure:.1f} us"
    print(f"| {what} | {shown} |", flush=True)


def queries(world: World) -> None:
    """What a planner asks in its loop."""
    held = world.at(60 * SECOND)
    row("a door at a moment that was asked for before", microseconds(lambda: passage(held)))
    for name, seconds in (("second", 1), ("minute", 60), ("hour", 3600), ("day", 86_400)):
        moments = count(seconds * SECOND)
        row(
            f"a door at a new moment, a {name} after it was seen",
            microseconds(lambda moments=moments: passage(world.at(next(moments)))),
        )
    row(
        "the same for a robot 0.9 m long",
        microseconds(lambda: held["door_03"].probability_clear(0.6, 0.9)),
    )
    path = [(9.5, -2.0), (9.5, 2.0), (20.0, 2.0)]
    row(
        "blocked: a path of two legs among 50 objects",
        microseconds(lambda: held.blocked(path, 0.3), 20),
    )
    edges = [RouteEdge(k, [(3.0 * k + 0.45, -1.0), (3.0 * k + 0.45, 1.0)]) for k in range(DOORS)]
    told = microseconds(lambda: dynamic_edges(held, edges, 0.3, detour_cost=20.0), 2)
    row("costs of 30 edges among 50 objects", told)
    row("modes of 30 doors", microseconds(lambda: door_modes(held, 0.7), 5))
    new = count(SECOND)
    row(
        "all 50 beliefs at a new moment",
        microseconds(lambda: world.at(next(new)).beliefs, 5),
    )


def passage(snapshot: Snapshot) -> float:
    """The query that a planner asks most."""
    return snapshot["door_03"].probability_clear(0.6)


def keeping(building: Building) -> None:
    """A world in a file."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "world.db"
        store = open_store(place, building)
        drives = count()

        def add() -> None:
            k = next(drives)
            entry = DriveEntry(str(k), k * SECOND, k * SECOND)
            store.add(entry, seen_once(building, k * SECOND))

        row("add a drive of 50 beliefs to a file", microseconds(add, 3))
        row("load the latest of a world", microseconds(lambda: store.load(since_ns=10**15), 3))
        kept = next(drives)
        size = place.stat().st_size / (50 * kept)
        print(f"{kept} drives of 50 beliefs: {size / 1000:.1f} kB a belief in the file")


if __name__ == "__main__":
    print("| what | time |\n| --- | --- |")
    building = office()
    queries(World.of(building.objects, beliefs=seen_once(building, 0)))
    keeping(building)
