"""Which scans of a drive tell of doors, and drives that are localized once more."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.floors import make_drives
from objstate.building.from_map import building_of_map
from objstate.building.model import Building
from objstate.building.occupancy import read_map
from objstate.discovery import learn_doors, learning
from objstate.discovery.gathering import Beams, Gathered, lost_or_unconfirmed
from objstate.errors import LogError
from objstate.records import NANOSECONDS
from objstate.run import RunOptions
from tests.discovery.test_finding import floor


def seconds(*ends: float) -> list[int]:
    return [round(each * NANOSECONDS) for each in ends]


@pytest.mark.parametrize(
    ("last", "stays"), [(60.0, False), (70.0, True), (52.0, False), (50.0, False)]
)
def test_scans_after_being_lost_count_where_the_log_goes_on(last: float, stays: bool) -> None:
    """Up to its end nobody found out that the robot was found in a wrong place."""
    first, second, (last_ns,) = seconds(3.0, 5.0), seconds(20.0, 50.0), seconds(last)
    found = lost_or_unconfirmed([(first[0], first[1]), (second[0], second[1])], last_ns)
    assert list(found[0]) == first
    assert list(found[1]) == [second[0], second[1] if stays else last_ns + 1]
    assert lost_or_unconfirmed([], last_ns) == []


def nothing() -> Beams:
    return Beams.of([])


class Places:
    """What is gathered of drives, by how often each was localized; and in which buildings."""

    def __init__(self, *found: Gathered) -> None:
        self.found = list(found)
        self.asked: list[tuple[str, list[str]]] = []

    def gather(self, log: Path, building: Building, *_: object) -> Gathered:
        self.asked.append((log.parent.name, sorted(building.objects)))
        return self.found[len(self.asked) - 1]


def test_a_drive_that_was_lost_is_localized_again_among_the_doors_that_were_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = make_drives(floor(), tmp_path / "floor", seed=5, count=2, moved=1.0)
    right = [learning.gather(log, walls(made.map), RunOptions()) for log in made.logs]
    assert not any(each.lost_share for each in right)
    places = Places(right[0], Gathered(nothing(), lost_share=1.0), right[1])
    monkeypatch.setattr(learning, "gather", places.gather)
    learnt = learn_doors(made.logs, made.map, tmp_path / "found", jobs=1)
    (_, none), (_, no_doors), (again, doors) = places.asked
    assert none == no_doors == []
    assert again == made.logs[1].parent.name
    assert len(doors) > 0
    assert learnt.warnings == ()
    monkeypatch.setattr(learning, "gather", Places(*right).gather)
    at_once = learn_doors(made.logs, made.map, tmp_path / "at_once", jobs=1)
    assert [each.probability for each in learnt.candidates] == pytest.approx(
        [each.probability for each in at_once.candidates]
    )


def test_a_drive_that_is_localized_nowhere_is_left_out_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = make_drives(floor(), tmp_path / "floor", seed=5, count=2, moved=1.0)
    right = learning.gather(made.logs[0], walls(made.map), RunOptions())
    lost = Gathered(nothing(), lost_share=1.0)
    monkeypatch.setattr(learning, "gather", Places(right, lost, lost).gather)
    (warning,) = learn_doors(made.logs, made.map, tmp_path / "found", jobs=1).warnings
    assert warning.startswith(f"{made.logs[1]}: The robot was localized nowhere")
    monkeypatch.setattr(learning, "gather", Places(lost, lost).gather)
    with pytest.raises(LogError, match=r"drive1.*drive2.*localized nowhere"):
        learn_doors(made.logs, made.map, tmp_path / "none", jobs=1)


def walls(map_yaml: Path) -> Building:
    return building_of_map(read_map(map_yaml))
