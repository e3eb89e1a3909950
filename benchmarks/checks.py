"""How long light checks take, beside a full scan's update: ``python benchmarks/checks.py``

Two rooms with a door between them and two desks; a laser of 720 beams over half a turn. Prints processor
times, of the fastest of some rounds, each the mean of many calls.
"""

from __future__ import annotations

import timeit
from collections.abc import Callable
from time import process_time

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.config import Settings
from objstate.estimator import Estimator
from objstate.gaze import Sensor
from objstate.geometry import FloatArray, rotation_from_rpy, transform
from objstate.maintenance import LightCheck
from objstate.objects import ObjectBelief, filter_for
from objstate.particles import Weights
from objstate.records import RobotBelief, Scan
from objstate.sensing import ExpectedRanges

ROUNDS, CALLS, SCANS = 7, 1000, 100
UP = np.array([0.0, 0.0, 1.0])
LASER = Sensor("laser", beams=720)


def main() -> None:
    """Measure and print."""
    building = rooms()
    beliefs = {name: known(item) for name, item in building.objects.items()}
    places = {"door": np.array([2.0, -0.3, np.pi]), "desk_1": np.array([1.0, 0.0, 0.5])}
    print("| what | door | desk |\n| --- | --- | --- |")
    row("a light check", [light(building, beliefs, name, at_) for name, at_ in places.items()])
    row("setting it up", [set_up(building, beliefs, name) for name in places])
    row(
        "a full scan's update", [full(building, beliefs, name, at_) for name, at_ in places.items()]
    )


def row(what: str, figures: list[float]) -> None:
    """One row of the table."""
    print(f"| {what} | {' | '.join(f'{figure:.0f} us' for figure in figures)} |", flush=True)


def light(
    building: Building, beliefs: dict[str, ObjectBelief], name: str, pose: FloatArray
) -> float:
    """Microseconds of a check."""
    check = LightCheck(building, LASER.rays(), LASER.range_max, beliefs[name], beliefs)
    ranges = scan(building, pose)
    return timed(lambda: check(ranges, pose), CALLS)


def set_up(building: Building, beliefs: dict[str, ObjectBelief], name: str) -> float:
    """Microseconds until an object can be checked."""
    rays, belief = LASER.rays(), beliefs[name]
    return timed(lambda: LightCheck(building, rays, LASER.range_max, belief, beliefs), 20)


def rooms() -> Building:
    """8 m by 4 m, halved by a wall with a door."""
    around = [(-4, -2, 4, -2), (4, -2, 4, 2), (4, 2, -4, 2), (-4, 2, -4, -2)]
    walls = [*around, (0, -2, 0, -0.47), (0, 0.47, 0, 2)]
    leaf = Box((0.9, 0.04, 2.0)).mesh().moved(transform(np.eye(3), [0.45, 0.0, 1.0]))
    top = Box((1.2, 0.6, 0.7)).mesh().moved(transform(np.eye(3), [0.0, 0.0, 0.35]))
    items = [
        MovableObject("door", Kind.HINGED, at(0.0, -0.45, np.pi / 2), UP, 0.0, np.pi / 2, leaf),
        MovableObject("desk_1", Kind.PLANAR, at(2.5, 1.2), UP, 0.0, 0.0, top),
        MovableObject("desk_2", Kind.PLANAR, at(-2.5, 1.2), UP, 0.0, 0.0, top),
    ]
    mesh = Mesh.joined([upright(*each) for each in walls])
    return Building("rooms", mesh, {item.name: item for item in items})


def at(x: float, y: float, yaw: float = 0.0) -> FloatArray:
    """A place on the floor, as a transform."""
    return transform(rotation_from_rpy(0.0, 0.0, yaw), np.array([x, y, 0.0]))


def upright(ax: float, ay: float, bx: float, by: float) -> Mesh:
    """A wall from one point to another."""
    length, yaw = float(np.hypot(bx - ax, by - ay)), float(np.arctan2(by - ay, bx - ax))
    lifted = at((ax + bx) / 2, (ay + by) / 2, yaw)
    lifted[2, 3] = 1.25
    return Box((length, 0.1, 2.5)).mesh().moved(lifted)


def known(item: MovableObject) -> ObjectBelief:
    """A belief that is sure to a degree or to two centimetres."""
    rng = np.random.default_rng(0)
    prior = filter_for(item, Settings()).prior(rng)
    if item.kind is Kind.PLANAR:
        states = item.home + 0.02 * rng.standard_normal((400, 3))
        return prior.with_samples(states, Weights.uniform(400))
    return prior.with_weights(
        Weights.of(np.exp(-0.5 * ((prior.states[:, 0] - 0.3) / 0.02) ** 2) + 1e-300)
    )


def scan(building: Building, pose: FloatArray) -> FloatArray:
    """What the laser reads with everything as believed."""
    states = {name: item.home for name, item in building.objects.items()}
    states["door"] = np.array([0.3])
    ranges = ExpectedRanges(building).scene(states, pose[None], LASER.rays())[0]
    return np.asarray(ranges + 0.01 * np.random.default_rng(1).standard_normal(len(ranges)))


def full(
    building: Building, beliefs: dict[str, ObjectBelief], name: str, pose: FloatArray
) -> float:
    """Microseconds that an estimator takes for a scan, of one object alone, its pose given."""
    rays, alone = LASER.rays(), Building("alone", building.walls, {name: building[name]})
    ranges, best = scan(building, pose), np.inf
    for _ in range(ROUNDS):
        own = {name: beliefs[name]}
        estimator = Estimator(alone, seed=0, belief="recorded", beliefs=own)
        estimator.feed(RobotBelief(0, pose[None], np.ones(1)))
        scans = [
            Scan(k * 10**8, LASER.name, ranges, rays, LASER.range_min, LASER.range_max)
            for k in range(1, SCANS + 1)
        ]
        estimator.feed(scans[0])
        start = process_time()
        for each in scans[1:]:
            estimator.feed(each)
        best = min(best, (process_time() - start) / (SCANS - 1) * 1e6)
    return best


def timed(call: Callable[[], object], calls: int) -> float:
    """Microseconds of one call, in the fastest of some rounds."""
    call()
    return min(timeit.repeat(call, number=calls, repeat=ROUNDS, timer=process_time)) / calls * 1e6


if __name__ == "__main__":
    main()
