"""A drive leaves the last belief of each look, some of a long one, and none made while lost."""

from itertools import pairwise

import pytest

from objstate.world.looks import LOOK_ENDS_NS, LOOK_LASTS_NS, Looks, ends_of_looks
from objstate.world.moving import sightings
from tests.world.examples import SECOND, at_angle, desk_at


def seen(looks: Looks, seconds: range | list[int], angle: float = 0.5) -> None:
    for second in seconds:
        looks.note([at_angle(angle, second * SECOND)])


def kept_at(looks: Looks) -> list[int]:
    return [(belief.stamp_ns or 0) // SECOND for belief in looks.beliefs]


def test_the_last_belief_of_each_look_is_kept() -> None:
    looks = Looks(0)
    seen(looks, [*range(4), *range(50, 53), 100])
    assert kept_at(looks) == [3, 52, 100]


def test_a_long_look_leaves_more() -> None:
    looks, lasts = Looks(0), LOOK_LASTS_NS // SECOND
    seen(looks, range(10 * lasts))
    stamps = kept_at(looks)
    assert len(stamps) == 10
    assert max(b - a for a, b in pairwise(stamps)) <= lasts
    assert stamps[-1] == 10 * lasts - 1


def test_objects_are_kept_apart() -> None:
    looks = Looks(0)
    looks.note([at_angle(0.5, 0), desk_at(3.0, 0)])
    looks.note([desk_at(3.1, LOOK_ENDS_NS + 1)])
    assert [b.item.name for b in looks.beliefs] == ["desk", "desk", "door"]


def test_what_was_learnt_while_lost_is_taken_back() -> None:
    looks = Looks(0)
    seen(looks, [*range(4), *range(50, 60)], angle=0.5)
    seen(looks, range(60, 200), angle=1.5)  # the robot is not where it thinks
    looks.take_back(60 * SECOND, [at_angle(0.5, 59 * SECOND)])
    assert kept_at(looks) == [3, 59]
    seen(looks, range(200, 203), angle=0.6)
    assert kept_at(looks) == [3, 59, 202]
    assert all(belief.mean[0] < 0.7 for belief in looks.beliefs)


def test_what_was_known_before_the_drive_is_not_the_drives() -> None:
    looks = Looks(100 * SECOND)
    seen(looks, [105])
    looks.take_back(104 * SECOND, [at_angle(0.5, 99 * SECOND)])
    assert looks.beliefs == []


def test_of_a_look_in_which_the_door_moves_both_sides_are_kept() -> None:
    looks = Looks(0)
    seen(looks, range(10), angle=0.2)
    seen(looks, range(10, 20), angle=1.2)
    assert kept_at(looks) == [9, 10, 19]
    assert [round(b.mean[0], 1) for b in looks.beliefs] == [0.2, 1.2, 1.2]


def test_while_it_is_moved_furniture_stands_nowhere() -> None:
    looks = Looks(0)
    for second in range(30):
        x = 3.0 + 0.2 * min(max(second - 10, 0), 5)  # it is pushed from 10 to 15 s
        looks.note([desk_at(x, second * SECOND, spread=0.01)])
    looks.note([desk_at(4.0, 60 * SECOND, spread=0.01)])
    assert len(looks.beliefs) > 4
    ends = ends_of_looks(looks.beliefs)
    assert [(belief.stamp_ns or 0) // SECOND for belief in ends] == [15, 29, 60]
    where = [seen.state[0] for seen in sightings(looks.beliefs) if seen.state is not None]
    assert where == pytest.approx([4.0, 4.0, 4.0], abs=0.01)
