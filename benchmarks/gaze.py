"""Where a head should turn while the robot drives: ``python -m benchmarks.gaze [--seeds N] [--only NAME]``

A robot with a laser of 60 degrees on a pan axis drives through the corridor and the office, past boxes
that the building doesn't know and people who walk about. The estimator localizes it, and estimates doors
and furniture, from what the head happens to show. Heads turn straight ahead, in a sweep, by the gain of
objects (what ``objstate next`` weighs), or by the entropy of the field (``objstate next --head``). Means over
seeds with 95 % intervals, and paired differences from the default; processor times of one choice.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from time import process_time

import numpy as np
import shapely
from scipy.stats import t as student

from objstate import Estimator
from objstate.building import load_building, outline
from objstate.building.model import Building, Kind
from objstate.config import Settings
from objstate.gaze import LookSettings, Sensor, belief_entropy
from objstate.gaze.field import (
    EntropyMap,
    Gazer,
    GazeSettings,
    Head,
    ObjectGains,
    corners,
)
from objstate.gaze.field.entropy_map import WATCHED
from objstate.geometry import FloatArray, compose, wrap
from objstate.grid.grid import OCCUPIED
from objstate.objects import ObjectBelief
from objstate.recording.grids import Clutter
from objstate.records import NANOSECONDS, InitialPose, Odometry, Rays, Scan
from objstate.run.floor import Floor
from objstate.simulation.crowd import Crowd, Walker, boxes_mesh, walkers
from objstate.simulation.lasers import World, reading
from objstate.simulation.odometry import dead_reckoning
from objstate.simulation.route import Motion, drive
from objstate.simulation.scene import (
    Boxes,
    Laser,
    ObjectRule,
    OdometryNoise,
    People,
    PlanarState,
    Route,
    Waypoint,
)
from objstate.simulation.states import histories

ROOT = Path(__file__).parents[1]
SEEDS = 8
HZ = 5  # scans a second
LASER = Laser(beams=61, angle_min=-math.pi / 6, angle_max=math.pi / 6, false_share=0.02)
SENSOR = Sensor("head", field_of_view=math.pi / 3, beams=61, range_max=LASER.range_max)
TURN, SPEED = math.radians(120.0), math.radians(90.0)  # rad to either side, rad/s
HEAD = Head(SENSOR, TURN, SPEED)
LOOKS = LookSettings(scans=HZ * GazeSettings().dwell_s)
STEP = math.radians(1.0)  # rad, of the pan axis' encoder
START = np.array([0.05, 0.05, 0.02])  # m, m, rad: deviations of the initial pose
BOX, RADIUS = 0.4, 0.3  # m, side of a box; radius of the robot
NEAR, CELLS = 0.1, 4  # m about a box; cells of one that is found
BEAMS = 3  # that met what walks
TUBE = RADIUS + 0.3  # m to either side of the robot's way
SOON, LATE = 3.0, 1.5  # s ahead on the way, from and until when something has to be seen
AT_ONCE = 0.5  # s ahead; what comes nearer at once doesn't come from ahead
STEADY = 0.1  # bits/s; less isn't worth turning


@dataclass(frozen=True)
class Place:
    """Where the robot drives."""

    name: str
    building: Path
    waypoints: tuple[tuple[float, float], ...]
    boxes: int
    people: tuple[float, float, float, float]  # region


PLACES = (
    Place(
        "corridor",
        ROOT / "models/corridor/corridor.urdf",
        ((1.5, 0.0), (20.0, 0.0), (1.5, 0.0)),
        5,
        (3.0, -0.7, 19.0, 0.7),
    ),
    Place(
        "office",
        ROOT / "models/office/office.urdf",
        ((0.8, 0.1), (9.0, 0.2), (7.56, 0.2), (7.56, 3.2), (7.56, 0.2), (2.46, 0.2), (2.46, 3.2)),
        4,
        (1.0, 0.0, 9.0, 0.8),
    ),
)


# --- where the head turns ------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Known:
    """What a robot knows when it chooses."""

    time: float
    pose: FloatArray  # (3,)
    pan: float
    values: FloatArray  # (rows, columns) of the grid
    beliefs: dict[str, ObjectBelief]
    position_std: float
    way: FloatArray  # (n, 2) m, where it will drive in the next seconds


Choose = Callable[[Known], float]
Chooser = Callable[[Building, Floor], Choose]


def ahead(building: Building, floor: Floor) -> Choose:
    """Never turns."""
    return lambda _: 0.0


def sweep(building: Building, floor: Floor) -> Choose:
    """From one side to the other."""
    to = [TURN]

    def choose(known: Known) -> float:
        if abs(known.pan - to[0]) < STEP:
            to[0] = -to[0]
        return to[0]

    return choose


def by_objects(building: Building, floor: Floor) -> Choose:
    """The most bits a second of objects, as ``objstate next`` weighs looks; ahead where none gain."""
    gains, dwell = ObjectGains(building, HEAD, looks=LOOKS), GazeSettings().dwell_s

    def choose(known: Known) -> float:
        found = gains.bits(known.beliefs, known.pose)
        bits = sum(found.values(), np.zeros(len(gains.pans)))
        rates = bits / (np.abs(gains.pans - known.pan) / SPEED + dwell)
        return float(gains.pans[rates.argmax()]) if rates.max() > STEADY else 0.0

    return choose


def by_field(settings: GazeSettings, *, watching: float = 0.0, gaining: bool = False) -> Chooser:
    """The most bits a second of the field, with so many bits for cells on the way, and objects by their gain."""

    def made(building: Building, floor: Floor) -> Choose:
        gazers: list[Gazer] = []

        def choose(known: Known) -> float:
            if not gazers:
                walls = outline(building.walls, LASER.mount.z).reshape(-1, 4)
                assert floor.grid is not None
                layout, marks = floor.grid.layout, corners(walls)
                entropies = EntropyMap(layout, walls, marks, objects=not gaining)
                gains = ObjectGains(building, HEAD, looks=LOOKS) if gaining else None
                gazers.append(Gazer(entropies, HEAD, settings, gains))
            gazer = gazers[0]
            gazer.look(known.pose, known.pan, known.time)
            if watching:
                gazer.entropies.watch(known.way, RADIUS, watching)
            gazer.entropies.update(known.values, known.beliefs, min(1.0, known.position_std / 0.1))
            return gazer.rank(known.pose, known.pan, known.time, 1)[0].pan

        return choose

    return made


CHOOSERS: dict[str, Chooser] = {
    "both": by_field(GazeSettings(), gaining=True),
    "both, way": by_field(GazeSettings(), watching=30.0, gaining=True),
    "both, things of 0.4 m": by_field(GazeSettings(thing_m=0.4), gaining=True),
    "both, not on the way": by_field(GazeSettings(on_the_way=False), gaining=True),
    "objects": by_objects,
    "objects, some way": by_field(GazeSettings(thing_m=3.0), watching=27.0, gaining=True),
    "field": by_field(GazeSettings()),
    "field, way": by_field(GazeSettings(), watching=WATCHED),
    "field, no occlusion": by_field(GazeSettings(occlusion=False)),
    "field, not on the way": by_field(GazeSettings(on_the_way=False)),
    "field, no inhibition": by_field(GazeSettings(held_back=0.0)),
    "sweep": sweep,
    "ahead": ahead,
}


# --- one drive -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Drive:
    """A scene that is the same for all ways to turn the head."""

    building: Building
    motion: Motion
    world: World
    history: dict[str, object]
    boxes: list[shapely.Polygon]
    walkers: list[Walker]
    odometry: FloatArray  # (n, 3) at each scan


def drive_of(place: Place, seed: int) -> Drive:
    """Objects, boxes and people at random."""
    rng = np.random.default_rng([seed, len(place.name)])
    building = load_building(place.building)
    points = tuple(Waypoint(x=x, y=y, pause=0.5) for x, y in place.waypoints)
    motion = drive(Route(waypoints=points, speed=0.5))
    rules = (ObjectRule(name="*", initial="random", spread_xy=0.15, spread_yaw=0.3),)
    history = histories(building, rules, rng)
    way = shapely.LineString(place.waypoints)
    solid = [shapely.LineString(each) for each in outline(building.walls, LASER.mount.z)]
    solid += [shapely.Point(h.object.origin[:2, 3]).buffer(0.9) for h in history.values()]
    taken = shapely.union_all(solid)
    low, high = (
        np.array(place.waypoints).min(axis=0) - 1.2,
        np.array(place.waypoints).max(axis=0) + 1.2,
    )
    boxes: list[Boxes] = []
    shapes: list[shapely.Polygon] = []
    while len(boxes) < place.boxes:
        x, y = rng.uniform(low, high).tolist()
        yaw = float(rng.uniform(-np.pi, np.pi))
        corner = BOX / 2.0 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        shape = shapely.Polygon(corner @ turn.T + [x, y])
        if not RADIUS + 0.1 < shape.distance(way) < 1.0:
            continue
        if shape.distance(taken) < 0.1 or any(shape.distance(each) < 0.5 for each in shapes):
            continue
        boxes.append(Boxes(size=(BOX, BOX, 0.8), pose=PlanarState(x=x, y=y, yaw=yaw)))
        shapes.append(shape)
    people = (People(count=2, region=place.people, speed=0.9),)
    crowd = walkers(people, motion.duration, rng)
    world = World(building, history, Crowd(crowd, boxes_mesh(tuple(boxes), rng)))
    wheels = dead_reckoning(motion, OdometryNoise(rate=HZ), rng)
    return Drive(building, motion, world, history, shapes, crowd, wheels.poses)


@dataclass
class Score:
    """What came of one drive."""

    door_deg: float = math.nan  # mean error of doors, and of furniture, over the drive
    furniture_cm: float = math.nan
    entropy: float = 0.0  # nats, mean over objects and the drive
    boxes: float = 0.0  # share found, mean over the drive: the sooner, the more
    in_time: float = 0.0  # share of what would be hit that was seen in time
    travel: float = 0.0  # degrees a second
    robot_cm: float = 0.0  # mean error of the robot's position
    ms: float = 0.0  # processor time of a choice

    @property
    def row(self) -> list[float]:
        return list(vars(self).values())


HEADINGS = (
    "doors, deg",
    "furniture, cm",
    "entropy, nats",
    "boxes, %",
    "in time, %",
    "head, deg/s",
    "robot, cm",
    "choice, ms",
)
SCALES = (1.0, 1.0, 1.0, 100.0, 100.0, 1.0, 1.0, 1.0)


class _Nowhere:
    """Takes what a run would write."""

    def write(self, moments: Sequence[Clutter]) -> None:
        pass


@dataclass
class _Threats:
    """What stands or walks on the robot's way."""

    drive: Drive
    judged: dict[str, list[bool]] = field(default_factory=dict)
    _open: dict[str, bool] = field(default_factory=dict)  # whether this approach was judged
    _last: dict[str, float] = field(default_factory=dict)
    _ends: list[FloatArray] = field(default_factory=list)

    def note(self, time: float, occupied: FloatArray, ends: FloatArray) -> None:
        """Judge what comes too near; ``occupied`` (n, 2) m are the middles of occupied cells.

        ``ends`` (m, 2) are those of a scan's beams. What walks leaves no occupied cells, as no cell holds
        it for long; it counts as seen where beams of the last second met it.
        """
        self._ends.append(ends)
        met = np.concatenate(self._ends[-HZ:])
        ahead = np.arange(0.0, SOON, 0.1)
        way = self.drive.motion.at(time + ahead)[:, :2]
        robot = self.drive.motion.at(time)
        things: list[tuple[str, shapely.Geometry]] = [
            (f"box {k}", each) for k, each in enumerate(self.drive.boxes)
        ]
        for k, walker in enumerate(self.drive.walkers):
            place = walker.place(time, robot)
            things.append((f"person {k}", shapely.Point(place[:2]).buffer(0.25)))
        points = shapely.points(way)
        for name, shape in things:
            hit = np.flatnonzero(shapely.distance(shape, points) < TUBE)
            if not len(hit):
                if time - self._last.get(name, -np.inf) > SOON:
                    self._open.pop(name, None)
                continue
            self._last[name] = time
            if not AT_ONCE <= ahead[hit[0]] <= LATE or self._open.get(name, False):
                continue
            self._open[name] = True
            cells, beams = (
                int((shapely.distance(shape, shapely.points(each)) < NEAR).sum())
                for each in (occupied, met)
            )
            self.judged.setdefault(name, []).append(cells >= CELLS or beams >= BEAMS)

    @property
    def share(self) -> float:
        events = [each for one in self.judged.values() for each in one]
        return float(np.mean(events)) if events else math.nan


def _error(belief: ObjectBelief, state: FloatArray) -> float:
    """cm, or degrees of a door."""
    off = belief.mean - state
    if belief.item.kind is Kind.PLANAR:
        return 100.0 * float(np.hypot(*off[:2]))
    return math.degrees(abs(float(wrap(off[0]))))


def _found(boxes: Sequence[shapely.Polygon], occupied: FloatArray) -> float:
    """The share of boxes on which enough cells (n, 2) m are occupied."""
    places = shapely.points(occupied)
    return float(
        np.mean([(shapely.distance(each, places) < NEAR).sum() >= CELLS for each in boxes])
    )


@cache
def _rays(steps: int) -> Rays:
    """The laser's beams with so many steps of pan."""
    base, cos, sin = SENSOR.rays(), math.cos(steps * STEP), math.sin(steps * STEP)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return Rays(base.origins, base.directions @ turn.T)


def run(drive_: Drive, chooser: Chooser, seed: int) -> Score:
    """Drive once."""
    rng = np.random.default_rng([seed, 7])
    truth, d = drive_.motion, drive_
    estimator = Estimator(d.building, seed=seed)
    floor = Floor(d.building, Settings(), _Nowhere())
    choose, threats = chooser(d.building, floor), _Threats(d)
    start = truth.at(0.0) + START * rng.standard_normal(3)
    estimator.feed(InitialPose(0, start, np.diag(START**2)))
    pan = target = travel = since = spent = 0.0
    choices = 0
    errors: dict[Kind, list[float]] = {Kind.HINGED: [], Kind.PLANAR: []}
    entropies, robot_errors, found = [], [], []
    for k in range(int(truth.duration * HZ)):
        time, stamp = k / HZ, round(k / HZ * NANOSECONDS)
        turned = float(np.clip(target - pan, -SPEED / HZ, SPEED / HZ))
        pan, travel = pan + turned, travel + abs(turned)
        pose, rays = truth.at(time), _rays(round(pan / STEP))
        ranges = reading(d.world.distances(time, pose, rays, LASER.range_max + 0.1), LASER, rng)
        ranges[ranges == -np.inf] = np.nan
        scan = Scan(stamp, "head", ranges, rays, LASER.range_min, LASER.range_max, d.odometry[k])
        estimator.feed(Odometry(stamp, d.odometry[k]))
        estimates = estimator.feed(scan)
        floor.note(scan, estimator, estimates)
        robot, grid = estimator.robot, floor.grid
        assert robot is not None
        assert grid is not None
        values = grid.values(stamp)
        rows, columns = np.nonzero(values > OCCUPIED)
        occupied = grid.layout.to_frame(np.column_stack([columns, rows]) + 0.5)
        met = np.isfinite(ranges)
        local = rays.directions[met, :2] * ranges[met, None]
        ends = compose(robot.mean, np.column_stack([local, np.zeros(len(local))]))[:, :2]
        threats.note(time, occupied, ends)
        robot_errors.append(float(np.hypot(*(robot.mean - pose)[:2])))
        if k % HZ == 0:
            found.append(_found(d.boxes, occupied))
            for name, belief in estimator.objects.items():
                entropies.append(belief_entropy(belief))
                errors[belief.item.kind].append(_error(belief, d.history[name].at(time)))
        if abs(target - pan) >= STEP:
            since = time
        if time - since >= GazeSettings().dwell_s or chooser is sweep:
            began = process_time()
            target = choose(
                Known(
                    time,
                    robot.mean,
                    pan,
                    values,
                    estimator.objects,
                    robot.position_std,
                    truth.at(np.arange(time, time + SOON, 0.2))[:, :2],
                )
            )
            spent += process_time() - began
            choices, since = choices + 1, time
    means = [float(np.mean(each)) if each else math.nan for each in errors.values()]
    return Score(
        *means,
        float(np.mean(entropies)),
        float(np.mean(found)),
        threats.share,
        math.degrees(travel) / truth.duration,
        100.0 * float(np.mean(robot_errors)),
        1000.0 * spent / choices,
    )


# --- tables --------------------------------------------------------------------------------


def spread(values: FloatArray) -> str:
    """A mean with Student's interval."""
    kept = values[np.isfinite(values)]
    if not len(kept):
        return "-"
    if len(kept) == 1:
        return f"{kept[0]:.2f}"
    half = student.ppf(0.975, len(kept) - 1) * kept.std(ddof=1) / math.sqrt(len(kept))
    return f"{kept.mean():.2f} ± {half:.2f}"


def rows(place: Place, names: Sequence[str], seeds: int) -> Iterator[tuple[str, FloatArray]]:
    """Scores (seeds, k) of each way to turn the head."""
    for name in names:
        scores = [run(drive_of(place, seed), CHOOSERS[name], seed).row for seed in range(seeds)]
        yield name, np.array(scores) * SCALES


def main() -> None:
    """Print a table for each place."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--only", action="append", choices=CHOOSERS)
    parser.add_argument("--place", choices=[each.name for each in PLACES])
    given = parser.parse_args()
    names = given.only or list(CHOOSERS)
    for place in PLACES:
        if given.place not in {None, place.name}:
            continue
        found: dict[str, FloatArray] = {}
        print(f"\n{place.name}\n\n| head | {' | '.join(HEADINGS)} |")
        print("| --- " * (len(HEADINGS) + 1) + "|")
        for name, scores in rows(place, names, given.seeds):
            found[name] = scores
            print(f"| {name} | {' | '.join(map(spread, scores.T))} |", flush=True)
        print(f"\n| less {names[0]} | {' | '.join(HEADINGS[:-1])} |")
        print("| --- " * len(HEADINGS) + "|")
        for name in names[1:]:
            differences = (found[name] - found[names[0]]).T[:-1]
            print(f"| {name} | {' | '.join(map(spread, differences))} |")


if __name__ == "__main__":
    main()
