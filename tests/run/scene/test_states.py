"""What nobody has seen stands at the mode of its prior, and is said not to have been seen."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Building
from objstate.config import Settings, parse_strict
from objstate.estimator import Estimator
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.recording.candidates import Found
from objstate.recording.ros import ros2_types
from objstate.records import TrueState
from objstate.run.scene.ground import MOST_CELLS, map_message
from objstate.run.scene.messages import candidates_message, ghosts_message, joints_message
from objstate.run.scene.states import (
    STALE,
    STATES,
    STATES_DEFINITION,
    Truth,
    diagnostics_message,
    shown_state,
    states_message,
)
from tests.rooms import building, door, enclosure, sliding_door, table

ROOM = building(
    enclosure(8.0, 6.0),
    door("door", -0.4, 1.5),
    door("inward", 0.4, 1.5, limits=(-1.5, 0.0)),
    sliding_door("slide", 1.0, 2.0),
    table("desk", -1.0, -1.0, 0.5),
)
NOW = 7_000_000_000


def beliefs(place: Building = ROOM, settings: Settings | None = None) -> dict[str, ObjectBelief]:
    """What is believed before anything was seen."""
    return dict(Estimator(place, settings or Settings(), seed=0).objects)


def test_unseen_doors_are_shown_closed_where_every_angle_is_as_likely() -> None:
    known = beliefs()
    assert known["door"].mean[0] > 0.5  # half open, which no door is likely to be
    for name in ("door", "inward", "slide"):
        assert shown_state(known[name]) == pytest.approx([0.0])
    assert shown_state(known["desk"]) == pytest.approx(known["desk"].mean)
    joints = joints_message(NOW, known.values())
    assert joints.position == pytest.approx([0.0, 0.0, 0.0])


def test_the_mode_of_a_prior_that_says_more_counts() -> None:
    rule = {"match": "*", "prior": "gaussian", "prior_mean_deg": 40.0, "prior_std_deg": 10.0}
    settings = parse_strict(Settings, {"objects": [rule]}, "the test")
    place = building(enclosure(8.0, 6.0), door("door", -0.4, 1.5))
    assert np.degrees(shown_state(beliefs(place, settings)["door"])) == pytest.approx(
        [40.0], abs=0.3
    )


def test_it_is_said_in_numbers_in_words_and_beside_the_object() -> None:
    known, nothing = beliefs(), Truth()
    types = ros2_types(STATES, STATES_DEFINITION)
    message = types.deserialize_cdr(states_message(NOW, known, nothing), STATES)
    assert [(each.name, each.coordinate) for each in message.states] == [
        ("door", "angle"), ("inward", "angle"), ("slide", "offset"),
        ("desk", "x"), ("desk", "y"), ("desk", "yaw"),
    ]  # fmt: skip
    assert not any(each.seen for each in message.states)
    assert all(np.isnan([each.seconds_unseen, each.truth]).all() for each in message.states)
    for status in diagnostics_message(NOW, known, nothing).status:
        assert status.level == STALE
        assert "never seen" in status.message
    labels = ghosts_message(NOW, known.values()).markers
    assert [each.text for each in labels] == [f"{name}: not seen yet" for name in known]
    assert all(each.lifetime.sec > 0 for each in labels)  # they go when nobody renews them


def test_truth_holds_from_its_stamp_on() -> None:
    truth = Truth([TrueState(10, "door", "angle", 0.2), TrueState(20, "door", "angle", 0.7)])
    values = [truth.at(stamp, "door", "angle") for stamp in (9, 10, 19, 20, 99)]
    np.testing.assert_equal(values, [np.nan, 0.2, 0.2, 0.7, 0.7])
    assert np.isnan(truth.at(20, "desk", "x"))
    known: dict[str, FloatArray] = dict(truth.states(15, beliefs()))
    assert {name: state.tolist() for name, state in known.items()} == {"door": [0.2]}


def test_the_map_of_a_very_large_building_has_larger_cells() -> None:
    grid = map_message(NOW, building(enclosure(900.0, 700.0)), 0.3)
    assert grid.info.width * grid.info.height <= 1.1 * MOST_CELLS
    assert grid.info.resolution > 0.3
    assert (grid.data == 100).sum() > 2 * (900 + 700) / grid.info.resolution / 1.5


def test_a_building_without_walls_has_a_map_of_one_free_cell() -> None:
    grid = map_message(NOW, building(enclosure(8.0, 6.0)), 99.0)
    assert grid.data.tolist() == [0]


def test_candidates_are_drawn_from_the_floor_to_the_laser_and_earlier_ones_removed() -> None:
    outline = ((0.0, 0.0), (0.4, 0.0), (0.4, 0.6), (0.0, 0.6))
    crate = Found("unknown_3", 0.75, 4, 0.2, 0.3, 0.0, 0.6, 0.4, 0, NOW, outline)
    first, lines, label = candidates_message(NOW, [crate], 0.3).markers
    assert first.action == 3
    points = np.array([[point.x, point.y, point.z] for point in lines.points])
    assert len(points) == 2 * 3 * len(outline)
    assert {tuple(corner) for corner in points[:, :2].tolist()} == set(outline)
    assert set(points[:, 2].tolist()) == {0.0, 0.3}
    assert lines.color.a == pytest.approx(0.75)
    assert label.text == "unknown_3: 0.75"
    assert len(candidates_message(NOW, [], 0.3).markers) == 1
