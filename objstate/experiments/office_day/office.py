"""An office of thirty doors and twenty pieces of furniture, and a working day in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.config import Dynamics, ObjectRule, Rest, Settings
from objstate.geometry import FloatArray, rotation_about, transform, wrap
from objstate.simulation.states import StateHistory, Swing

WALL, WALL_HEIGHT = 0.12, 2.5  # m
LENGTH = 45.0  # m, of both corridors, which a hall between them joins
CORRIDOR, HALL, ROOM = 2.0, 8.0, 3.5  # m, depths from south to north: room, corridor, hall, ...
DOORS_A_SIDE = 15
LEAF = np.array([0.9, 0.04, 2.0])  # m
LIMIT = 1.75  # rad
UP = np.array([0.0, 0.0, 1.0])

# Moves in an hour: a third of the doors are busy, a third are ordinary, a third hardly ever move.
DOOR_RATES = (3.0, 0.5, 0.05)
FURNITURE_RATES = (1.0, 0.1)
REST = Rest()  # where doors come to rest, as the estimator's settings have it
FROM_STOP_DEG = 5.0  # standard deviation of a door that is left closed, or wide open
SPREAD_M, SPREAD_RAD = 0.2, np.radians(15.0)  # of where somebody leaves furniture
SWING = 2.0  # s in which somebody moves an object


@dataclass(frozen=True, eq=False)
class Office:
    """A building, and what an estimator may know of how its objects move."""

    building: Building
    rates: dict[str, float]  # moves in an hour, by object

    @property
    def settings(self) -> Settings:
        return Settings(
            objects=tuple(
                ObjectRule(
                    match=name,
                    dynamics=Dynamics(moves_per_hour=rate, drift_deg=0.0, drift_m=0.0),
                )
                for name, rate in self.rates.items()
            )
        )

    @property
    def shut(self) -> Building:
        """The building with its doors walled up: where a robot can drive that enters no room."""
        doors = [each for each in self.building.objects.values() if each.kind is not Kind.PLANAR]
        leaves = [each.mesh.moved(each.transforms(each.home[None])[0]) for each in doors]
        return Building(
            "office", Mesh.joined([self.building.walls, *leaves]), self.building.objects
        )


def office(rng: np.random.Generator) -> Office:
    """Two corridors with rooms on their outer sides, and a hall with furniture between them."""
    walls: list[Mesh] = []
    objects: list[MovableObject] = []
    rates: dict[str, float] = {}
    inner = HALL / 2 + CORRIDOR  # m from the middle to the corridors' outer walls
    for side in (1.0, -1.0):
        hinges = _hinges(rng)
        walls += _front(side * inner, hinges)
        back = inner + WALL + ROOM
        walls.append(_block((0.0, LENGTH), (side * back, side * (back + WALL))))
        walls += _partitions(side * (inner + WALL), side * back)
        for k, hinge in enumerate(hinges):
            name = f"door_{len(rates) + 1:02d}"
            objects.append(_door(name, hinge, side, inner, k % 2 == 0))
            rates[name] = DOOR_RATES[int(rng.integers(len(DOOR_RATES)))]
    edge = inner + WALL + ROOM + WALL
    walls += [_block((-WALL, 0.0), (-edge, edge)), _block((LENGTH, LENGTH + WALL), (-edge, edge))]
    walls += _screens()
    for k, (x, y) in enumerate(_stands(rng)):
        name = f"chest_{k + 1:02d}"
        objects.append(_chest(name, x, y, float(rng.uniform(-np.pi, np.pi))))
        rates[name] = FURNITURE_RATES[int(rng.integers(len(FURNITURE_RATES)))]
    return Office(
        Building("office", Mesh.joined(walls), {each.name: each for each in objects}), rates
    )


def working_day(place: Office, hours: float, rng: np.random.Generator) -> dict[str, StateHistory]:
    """The true states of a day: everything is moved now and then, to where priors say."""
    return {
        name: _history(item, place.rates[name], hours, rng)
        for name, item in place.building.objects.items()
    }


def _history(
    item: MovableObject, rate: float, hours: float, rng: np.random.Generator
) -> StateHistory:
    moments = np.sort(rng.uniform(0.0, hours * 3600.0, rng.poisson(rate * hours)))
    apart = moments[np.diff(moments, prepend=-np.inf) > SWING]
    swings = tuple(Swing(float(start), SWING, _left_at(item, rng)) for start in apart)
    return StateHistory(item, _left_at(item, rng), swings)


def _left_at(item: MovableObject, rng: np.random.Generator) -> FloatArray:
    """(d,) where somebody leaves an object: a door closed, wide open or between, as it rests."""
    if item.kind is not Kind.PLANAR:
        between = float(rng.uniform(item.lower, item.upper))
        from_stop = abs(float(np.radians(FROM_STOP_DEG) * rng.standard_normal()))
        rests = (item.lower + from_stop, item.upper - from_stop, between)
        shares = np.array([REST.closed, REST.open, REST.anywhere])
        return np.array([rests[int(rng.choice(3, p=shares))]])
    width = np.array([SPREAD_M, SPREAD_M, SPREAD_RAD])
    state = item.home + width * rng.standard_normal(3)
    state[2] = wrap(state[2])
    return np.asarray(state)


def _block(x: tuple[float, float], y: tuple[float, float]) -> Mesh:
    """A wall from floor to ceiling."""
    (x0, x1), (y0, y1) = sorted(x), sorted(y)
    middle = transform(np.eye(3), [(x0 + x1) / 2, (y0 + y1) / 2, WALL_HEIGHT / 2])
    return Box((x1 - x0, y1 - y0, WALL_HEIGHT)).mesh().moved(middle)


def _hinges(rng: np.random.Generator) -> FloatArray:
    """(n,) m along the corridor, one for each room, somewhere along its front."""
    width = LENGTH / DOORS_A_SIDE
    return width * np.arange(DOORS_A_SIDE) + rng.uniform(0.3, width - LEAF[0] - 0.3, DOORS_A_SIDE)


def _front(y: float, hinges: FloatArray) -> list[Mesh]:
    """The wall between a corridor and its rooms, with doorways."""
    thick = (y, y + np.sign(y) * WALL)
    starts = np.append(0.0, hinges + LEAF[0] + 0.02)
    ends = np.append(hinges, LENGTH)
    return [_block((a, b), thick) for a, b in zip(starts, ends, strict=True)]


def _partitions(near: float, far: float) -> list[Mesh]:
    """Walls between rooms."""
    width = LENGTH / DOORS_A_SIDE
    places = width * np.arange(1, DOORS_A_SIDE)
    return [_block((x - WALL / 2, x + WALL / 2), (near, far)) for x in places]


def _screens() -> list[Mesh]:
    """Walls between the hall and the corridors, with wide openings, and pillars in the hall."""
    stretches = ((3.0, 9.0), (12.0, 14.5), (17.0, 25.0), (28.5, 33.0), (36.0, 42.5))
    screens = [
        _block(stretch, (side * HALL / 2, side * (HALL / 2 - WALL)))
        for side in (1.0, -1.0)
        for stretch in stretches
    ]
    pillars = [
        _block((x, x + 0.4), (y, y + 0.4)) for x, y in ((10.2, 0.8), (22.0, -1.2), (31.0, 0.3))
    ]
    return screens + pillars


def _door(name: str, hinge: float, side: float, inner: float, hinge_west: bool) -> MovableObject:
    """A leaf on the corridor's wall that opens into its room."""
    x = hinge + 0.01 if hinge_west else hinge + LEAF[0] + 0.01
    turn = side if hinge_west else -side  # seen from above
    leaf = (
        Box(tuple(LEAF)).mesh().moved(transform(np.eye(3), [LEAF[0] / 2, -turn * LEAF[1] / 2, 1.0]))
    )
    facing = rotation_about(UP, 0.0 if hinge_west else np.pi)
    origin = transform(facing, [x, side * (inner + WALL), 0.0])
    return MovableObject(name, Kind.HINGED, origin, turn * UP, 0.0, LIMIT, leaf)


def _stands(rng: np.random.Generator) -> FloatArray:
    """(20, 2) m where furniture should stand in the hall."""
    x = 2.2 + 4.5 * np.arange(10)
    rows = [np.column_stack([x, np.full(10, y)]) for y in (1.9, -1.9)]
    return np.concatenate(rows) + rng.uniform(-0.4, 0.4, (20, 2))


def _chest(name: str, x: float, y: float, yaw: float) -> MovableObject:
    """A chest of 1.0 m by 0.5 m."""
    chest = Box((1.0, 0.5, 0.7)).mesh().moved(transform(np.eye(3), [0.0, 0.0, 0.35]))
    origin = transform(rotation_about(UP, yaw), [x, y, 0.0])
    return MovableObject(name, Kind.PLANAR, origin, UP, 0.0, 0.0, chest)
