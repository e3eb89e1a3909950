"""Where a head turns: to what is unknown, not hidden, and not just looked at."""

from __future__ import annotations

import math

import numpy as np
import pytest

from objstate.config import Settings
from objstate.errors import GridError, SettingsError
from objstate.gaze import Sensor
from objstate.gaze.field import (
    EntropyMap,
    Gazer,
    GazeSettings,
    Head,
    ObjectGains,
    corners,
)
from objstate.grid import Layout
from objstate.objects import filter_for
from tests import rooms

LAYOUT = Layout(0.05, 160, 160, np.array([-4.0, -4.0, 0.0]))
NO_WALLS = np.zeros((0, 4))
ROBOT = np.array([0.0, 0.0, 0.5])
PLAIN = GazeSettings(on_the_way=False)


def head(view: float = 60.0, turn: float = 180.0, yaw: float = 0.0) -> Head:
    sensor = Sensor("head", range_max=3.0, field_of_view=math.radians(view), yaw=yaw)
    return Head(sensor, math.radians(turn))


def unknown_at(bearing: float, width: float = 0.4) -> np.ndarray:
    """Values of a grid that knows all but what lies about a bearing."""
    off = LAYOUT.centres()
    turn = (np.arctan2(off[..., 1], off[..., 0]) - bearing + np.pi) % (2 * np.pi) - np.pi
    return np.where(np.abs(turn) < width, 0.5, 0.0).astype(np.float32)


def entropies(values: np.ndarray, walls: np.ndarray = NO_WALLS) -> EntropyMap:
    made = EntropyMap(LAYOUT, walls)
    made.update(values, {})
    return made


@pytest.mark.parametrize("bearing", [-3.0, -1.2, 0.0, 2.1])
def test_it_turns_to_what_is_unknown(bearing: float) -> None:
    best = Gazer(entropies(unknown_at(bearing)), head(), PLAIN).rank(ROBOT, 0.0, 0.0, 1)[0]
    off = abs((best.heading - bearing + np.pi) % (2 * np.pi) - np.pi)
    assert off < 0.2
    assert best.pan == pytest.approx((best.heading - 0.5 + np.pi) % (2 * np.pi) - np.pi)


def test_a_view_has_the_bits_of_the_cells_in_it() -> None:
    chosen = Gazer(entropies(np.full(LAYOUT.shape, 0.5, np.float32)), head(), PLAIN).rank(
        ROBOT, 0.3, 0.0
    )
    off = LAYOUT.centres()
    distance = np.hypot(off[..., 0], off[..., 1])
    reliable = np.clip(1.0 - distance / 3.0, 0.0, None)
    bearing = np.arctan2(off[..., 1], off[..., 0])
    for each in chosen:
        turn = (bearing - each.heading + np.pi) % (2 * np.pi) - np.pi
        inside = (np.abs(turn) <= math.radians(30.0)) & (distance > 0.05)
        assert each.bits == pytest.approx(reliable[inside].sum(), rel=0.03)
    assert chosen[0].pan == pytest.approx(0.3, abs=0.01)  # all are alike, and staying is free


def test_what_a_wall_hides_does_not_count() -> None:
    wall = np.array([[1.0, -2.0, 1.0, 2.0]])
    values = unknown_at(0.0)
    shown = {}
    for occlusion in (True, False):
        settings = GazeSettings(on_the_way=False, occlusion=occlusion)
        best = Gazer(entropies(values, wall), head(), settings).rank(ROBOT, -0.5, 0.0, 1)[0]
        shown[occlusion] = best.bits
    seen = entropies(values, wall).bits[:, : LAYOUT.columns // 2 + 20]
    assert 0.0 < shown[True] < seen.sum()
    assert shown[False] > 3.0 * shown[True]


def test_what_is_seen_on_the_way_counts() -> None:
    made = entropies(np.full(LAYOUT.shape, 0.5, np.float32))
    plain = Gazer(made, head(), PLAIN).rank(ROBOT, 0.0, 0.0)
    swept = Gazer(made, head(), GazeSettings(on_the_way=True)).rank(ROBOT, 0.0, 0.0)
    per_view = plain[0].bits
    for each in swept:
        width = (abs(each.pan) + math.radians(60.0)) / math.radians(60.0)
        assert each.bits == pytest.approx(width * per_view, rel=0.03)


def test_it_does_not_stare() -> None:
    values = unknown_at(0.0)
    values[unknown_at(2.0) == 0.5] = 0.45
    gazer = Gazer(entropies(values), head(), GazeSettings(on_the_way=False, held_back=1.0))
    robot = np.zeros(3)
    first = gazer.rank(robot, 1.0, 0.0, 1)[0]
    gazer.look(robot, first.pan, 0.0)
    second = gazer.rank(robot, 1.0, 0.5, 1)[0]
    assert min(abs(first.heading), abs(first.heading - 2.0)) < 0.2
    assert abs(first.heading - second.heading) > 1.5
    much_later = gazer.rank(robot, 1.0, 100.0, 1)[0]
    assert much_later.heading == pytest.approx(first.heading)


def test_a_head_stays_within_its_limits() -> None:
    made = entropies(unknown_at(math.pi))
    for each in Gazer(made, head(turn=50.0), PLAIN).rank(np.zeros(3), 0.0, 0.0):
        assert abs(each.pan) <= math.radians(50.0) + 1e-9
    with pytest.raises(SettingsError, match="can't turn 200"):
        head(turn=200.0)
    with pytest.raises(SettingsError, match="aside"):
        head(turn=30.0, yaw=1.0)


def test_objects_count_by_their_beliefs_and_priorities() -> None:
    door = rooms.door("door_1", 1.5, 0.0)
    prior = filter_for(door, Settings()).prior(np.random.default_rng(0))
    made = EntropyMap(LAYOUT, NO_WALLS)
    known = np.zeros(LAYOUT.shape, np.float32)
    made.update(known, {"door_1": prior})
    unsure = made.bits.sum()
    best = Gazer(made, head(), PLAIN).rank(np.zeros(3), 2.0, 0.0, 1)[0]
    assert best.parts["door_1"] == pytest.approx(best.bits, rel=0.05)
    made.prioritize("door_*", 0.25)
    made.update(known, {"door_1": prior})
    assert made.bits.sum() == pytest.approx(0.25 * unsure)
    sure = prior.with_weights(prior.weights.of(np.eye(len(prior.states))[40] + 1e-30))
    made.update(known, {"door_1": sure})
    assert made.bits.sum() < 0.01 * unsure
    made.update(known, {})
    assert made.bits.sum() == 0.0
    with pytest.raises(GridError, match="priority 2"):
        made.prioritize("door_*", 2.0)


def test_landmarks_count_as_the_robot_gets_lost() -> None:
    walls = np.array([[1.0, 1.0, 2.0, 1.0], [2.0, 1.0, 2.0, 2.0]])
    made = EntropyMap(LAYOUT, walls, corners(walls))
    known = np.zeros(LAYOUT.shape, np.float32)
    sums = []
    for unreliability in (0.0, 0.5, 1.0):
        made.update(known, {}, unreliability)
        sums.append(made.bits.sum())
    assert sums[0] == 0.0
    assert sums[2] == pytest.approx(2.0 * sums[1])
    assert len(corners(walls)) == 3


@pytest.mark.parametrize(
    ("values", "unreliability", "told"),
    [
        (np.zeros((3, 3), np.float32), 0.0, "shape"),
        (np.full(LAYOUT.shape, np.nan, np.float32), 0.0, "nan"),
        (np.zeros(LAYOUT.shape, np.float32), 2.0, "unreliable by 2"),
    ],
)
def test_maps_that_cannot_be_are_refused(
    values: np.ndarray, unreliability: float, told: str
) -> None:
    with pytest.raises(GridError, match=told):
        EntropyMap(LAYOUT, NO_WALLS).update(values, {}, unreliability)


def test_the_way_ahead_is_looked_at_again_and_again() -> None:
    """All is known; only whether somebody has stepped in the way isn't."""
    made = entropies(np.zeros(LAYOUT.shape, np.float32))
    made.watch(np.array([[0.7, 0.0], [1.5, 0.0]]), 0.2)
    made.update(np.zeros(LAYOUT.shape, np.float32), {})
    gazer = Gazer(made, head(), GazeSettings(on_the_way=False, watch_s=2.0))
    robot = np.zeros(3)
    first = gazer.rank(robot, 1.5, 0.0, 1)[0]
    assert abs(first.heading) < 0.4
    assert first.parts["way"] == pytest.approx(first.bits)
    gazer.look(robot, 0.0, 0.0)
    shown = [gazer.rank(robot, 0.0, at, 1)[0].bits for at in (0.0, 1.0, 2.0, 9.0)]
    assert shown == pytest.approx([0.0, shown[2] / 2.0, shown[2], shown[2]], abs=1e-6)
    made.watch(np.zeros((0, 2)), 0.3)
    assert gazer.rank(robot, 0.0, 9.0, 1)[0].bits == 0.0
    with pytest.raises(GridError, match="way"):
        made.watch(np.array([[0.0, np.nan]]), 0.3)


def test_what_the_way_leads_around_is_not_watched() -> None:
    made = entropies(np.zeros(LAYOUT.shape, np.float32))
    loop = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    made.watch(loop, 0.2)
    column, row = np.floor(LAYOUT.to_cells(np.array([[0.0, 0.0], [1.0, 0.0]]))).astype(int).T
    inside, on_it = made.watched[row, column]
    assert inside == 0.0 < on_it


def test_with_gains_objects_count_by_what_looks_tell_of_them() -> None:
    door, walls = rooms.door("door_1", 1.5, 0.0), rooms.enclosure(6.0, 5.0)
    building = rooms.building(walls, door)
    prior = filter_for(door, Settings()).prior(np.random.default_rng(0))
    made = EntropyMap(LAYOUT, NO_WALLS, objects=False)
    gains = ObjectGains(building, head())
    known = np.zeros(LAYOUT.shape, np.float32)
    made.update(known, {"door_1": prior})
    assert made.bits.sum() == 0.0
    best = Gazer(made, head(), PLAIN, gains).rank(np.zeros(3), 2.0, 0.0, 1)[0]
    assert best.parts["door_1"] == pytest.approx(best.bits)
    off = np.arctan2(*(np.array([1.5, 0.0]) + 0.45 * np.array([1.0, 1.0]))[::-1]) - best.pan
    assert abs(off) < math.radians(40.0)
    bits = gains.bits({"door_1": prior}, np.zeros(3))["door_1"]
    assert best.bits == pytest.approx(np.interp(best.pan, gains.pans, bits))
    assert bits[np.abs(gains.pans) > math.radians(100.0)] == pytest.approx(0.0)
    assert 1.0 < bits.max() < 10.0
    sure = prior.with_weights(prior.weights.of(np.eye(len(prior.states))[40] + 1e-30))
    made.update(known, {"door_1": sure})
    assert Gazer(made, head(), PLAIN, gains).rank(np.zeros(3), 0.0, 0.0, 1)[0].bits < 0.1


def test_the_best_look_on_the_way_counts() -> None:
    door = rooms.door("door_1", 1.5, 0.0)
    building = rooms.building(rooms.enclosure(6.0, 5.0), door)
    prior = filter_for(door, Settings()).prior(np.random.default_rng(0))
    made = EntropyMap(LAYOUT, NO_WALLS, objects=False)
    made.update(np.zeros(LAYOUT.shape, np.float32), {"door_1": prior})
    gains = ObjectGains(building, head(turn=120.0))
    gazer = Gazer(made, head(turn=120.0), GazeSettings(apart_deg=60.0, on_the_way=True), gains)
    passing = [each for each in gazer.rank(np.zeros(3), -2.0, 0.0) if each.pan > 1.5]
    most = gains.bits({"door_1": prior}, np.zeros(3))["door_1"].max()
    assert [each.bits for each in passing] == pytest.approx([most] * len(passing))
    assert passing
