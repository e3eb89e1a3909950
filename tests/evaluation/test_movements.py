"""True movements beside those that a result tells."""

import numpy as np
import polars as pl
import pytest

from objstate.evaluation.movements import MovementErrors, movement_errors, together
from objstate.evaluation.states import TrueCourse
from objstate.evaluation.sums import Totals, packed, sums_of, unpacked
from objstate.recording.events import Event

SECOND = 1_000_000_000
SWING = [(20.0, 0.1), (20.5, 0.4), (21.0, 0.9)]  # s, rad


def course(*steps: tuple[float, float]) -> TrueCourse:
    stamps = np.array([int(t * SECOND) for t, _ in steps])
    return TrueCourse(stamps, np.array([value for _, value in steps]))


def told(begin: float, end: float, name: str = "door", coordinate: str = "angle") -> Event:
    stretch = int(begin * SECOND), int(end * SECOND)
    return Event(name, "moved", coordinate, *stretch, 0.0, 0.01, 0.9, 0.01, 0.99)


def observed(*seconds: float, name: str = "door") -> pl.DataFrame:
    stamps = [int(t * SECOND) for t in seconds]
    return pl.DataFrame({"object": name, "stamp": stamps, "observed": True})


def counted(*events: Event, steps: list[tuple[float, float]], at: tuple[float, ...]) -> list[int]:
    found = movement_errors(events, observed(*at), {("door", "angle"): course(*steps)})
    return [found[-1].count, found[-1].found, found[-1].false] if found else []


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        ([], [1, 0, 0]),
        ([told(20.2, 20.8)], [1, 1, 0]),  # the steps of a swing are one movement
        ([told(5, 25)], [1, 1, 0]),
        ([told(21.9, 22.5)], [1, 1, 0]),  # no later than the slack
        ([told(30, 31)], [1, 0, 1]),
        ([told(20, 21), told(22.5, 23), told(40, 41)], [1, 1, 2]),
    ],
)
def test_a_movement_is_found_by_what_is_told_in_its_time(
    events: list[Event], expected: list[int]
) -> None:
    assert counted(*events, steps=[(0.0, 0.0), *SWING], at=(1, 50)) == expected


def test_what_nobody_could_see_is_no_miss_and_finding_it_no_error() -> None:
    steps = [(0.0, 0.0), *SWING]
    assert counted(steps=steps, at=(1, 10)) == []
    assert counted(steps=steps, at=(30, 50)) == []
    assert counted(told(15, 40), steps=steps, at=(1, 10)) == []


def test_two_movements_between_two_looks_are_found_by_one_that_spans_both() -> None:
    steps = [(0.0, 0.0), (20.0, 0.9), (30.0, 0.2)]
    assert counted(told(1, 50), steps=steps, at=(1, 50)) == [2, 2, 0]
    assert counted(told(19, 22), steps=steps, at=(1, 25, 50)) == [2, 1, 0]


def test_a_recorded_truth_that_trembles_does_not_move() -> None:
    tremble = [(0.01 * k, 0.5 + 0.01 * np.sin(k)) for k in range(5000)]
    assert counted(steps=tremble, at=(0, 60)) == []
    turned = [(t, 3.14 if k % 2 else -3.14) for k, (t, _) in enumerate(tremble)]
    assert counted(steps=turned, at=(0, 60)) == []


def test_a_movement_before_the_truth_begins_is_not_compared() -> None:
    assert counted(told(2, 4), steps=[(10.0, 0.0)], at=(1, 50)) == []
    assert counted(told(2, 12), steps=[(10.0, 0.0)], at=(1, 50)) == [0, 0, 1]


def test_coordinates_of_a_piece_move_together() -> None:
    courses = {
        ("desk", "x"): course((0.0, 0.0), (20.0, 1.0)),
        ("desk", "yaw"): course((0.0, 0.0), (20.2, 0.4)),
    }
    events = [told(19, 23, "desk", part) for part in ("x", "y", "yaw")]
    found = movement_errors(events, observed(1, 50, name="desk"), courses)
    assert found == (MovementErrors("desk", 1, 1, 0), MovementErrors(None, 1, 1, 0))


def test_logs_add_up() -> None:
    totals, none = Totals(), pl.DataFrame()
    for number, movements in enumerate([MovementErrors(None, 3, 2, 1), None]):
        totals.add(f"log_{number}", unpacked(packed(sums_of({}, none, (), movements)), "a log"))
    assert totals.movements == MovementErrors(None, 3, 2, 1)
    both = together([MovementErrors("a", 3, 2, 1), MovementErrors("b", 1, 1, 0)])
    assert both == MovementErrors(None, 4, 3, 1)
