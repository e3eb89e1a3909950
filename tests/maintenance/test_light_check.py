"""Light checks of a door and a chest, with simulated scans."""

from dataclasses import replace

import numpy as np
import pytest

from objstate.errors import QueryError, SettingsError
from objstate.gaze import Sensor
from objstate.geometry import FloatArray
from objstate.maintenance import LightCheck, Outcome, Verdict, falsified
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from objstate.sensing import ExpectedRanges
from tests.gaze.places import chest, priors, surely, two_rooms
from tests.rooms import fan, placed

ROOMS = two_rooms(chest("chest", 2.5, 1.2), chest("screen", 1.6, 0.5, 0.9))
LASER = Sensor("laser", beams=361)
AT_DOOR, AT_CHEST = np.array([2.0, -0.3, np.pi]), np.array([1.0, 0.0, 0.5])
HOME = np.array([2.5, 1.2, 0.0])
AWAY = np.array([50.0, 0.0, 0.0])
MOVED = 0.2


def known(item_belief: ObjectBelief, state: FloatArray, std: float = 0.02) -> ObjectBelief:
    off = std * np.random.default_rng(0).standard_normal((300, 3))
    return item_belief.with_samples(state + off, Weights.uniform(300))


def beliefs(screen: FloatArray = AWAY) -> dict[str, ObjectBelief]:
    all_ = priors(ROOMS)
    return {
        "door": surely(all_["door"], 0.3),
        "chest": known(all_["chest"], HOME),
        "screen": known(all_["screen"], screen),
    }


def scan(pose: FloatArray, seed: int = 0, **states: FloatArray) -> FloatArray:
    true = {"door": np.array([0.3]), "chest": HOME, "screen": AWAY} | states
    ranges = ExpectedRanges(ROOMS).scene(true, pose[None], LASER.rays())[0]
    return np.asarray(ranges + 0.02 * np.random.default_rng(seed).standard_normal(len(ranges)))


def check_of(name: str, screen: FloatArray = AWAY) -> LightCheck:
    believed = beliefs(screen)
    return LightCheck(ROOMS, LASER.rays(), LASER.range_max, believed[name], believed)


def verdict(name: str, pose: FloatArray, **states: FloatArray) -> Verdict:
    check = check_of(name)
    return check.verdict(check(scan(pose, **states), pose), MOVED)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_as_believed_is_confirmed(seed: int) -> None:
    for name, pose in (("door", AT_DOOR), ("chest", AT_CHEST)):
        check = check_of(name)
        found = check.verdict(check(scan(pose, seed), pose), MOVED)
        assert found.outcome is Outcome.CONFIRMED
        assert found.probability > 0.95


@pytest.mark.parametrize("angle", [0.0, 0.7, 1.1])
def test_a_door_that_was_moved_is_elsewhere(angle: float) -> None:
    assert verdict("door", AT_DOOR, door=np.array([angle])).outcome is Outcome.MOVED


@pytest.mark.parametrize("off", [(0.2, 0.0, 0.2), (-0.2, -0.1, 0.0), (0.0, 0.15, -0.3)])
def test_a_chest_that_was_pushed_is_elsewhere(off: tuple[float, ...]) -> None:
    assert verdict("chest", AT_CHEST, chest=HOME + np.array(off)).outcome is Outcome.MOVED


def test_a_chest_that_is_gone_is_absent_and_falsified() -> None:
    check = check_of("chest")
    checked = check(scan(AT_CHEST, chest=AWAY), AT_CHEST)
    assert check.verdict(checked, MOVED).outcome is Outcome.ABSENT
    assert falsified(check.belief, check.falsification(checked, MOVED)).presence < 0.01
    assert check.updated(checked, MOVED).presence < 0.01


def test_a_chest_behind_something_known_is_hidden_by_it_and_not_falsified() -> None:
    screen = np.array([1.6, 0.5, 0.9])
    for true_chest in (HOME, AWAY):
        check = check_of("chest", screen)
        checked = check(scan(AT_CHEST, screen=screen, chest=true_chest), AT_CHEST)
        found = check.verdict(checked, MOVED)
        assert (found.outcome, found.hidden_by) == (Outcome.HIDDEN, "screen")
        assert check.updated(checked, MOVED).presence == pytest.approx(0.95, abs=0.03)


def test_a_chest_behind_something_unexpected_is_hidden_by_something_unknown() -> None:
    screen = np.array([1.6, 0.5, 0.9])
    found = verdict("chest", AT_CHEST, screen=screen, chest=AWAY)
    assert (found.outcome, found.hidden_by) == (Outcome.HIDDEN, "")


def test_how_probably_something_is_hidden_follows_from_what_is_believed_of_others() -> None:
    check, screen = check_of("chest"), np.array([1.6, 0.5, 0.9])
    clear, covered = (check.probability_hidden(AT_CHEST, beliefs(at)) for at in (AWAY, screen))
    assert clear == 0.0
    maybe = beliefs(screen)
    maybe["screen"] = replace(maybe["screen"], presence=0.5)
    assert check.probability_hidden(AT_CHEST, maybe) == pytest.approx(covered * 0.5 / 0.95)
    assert covered > 0.8
    assert check.probability_hidden(np.array([-3.0, -1.5, 0.0]), beliefs()) > 0.9  # walls


def test_what_is_no_scan_or_no_pose_is_refused() -> None:
    check, ranges = check_of("door"), scan(AT_DOOR)
    for other in (ranges[:5], np.append(ranges, 1.0), ranges[None]):
        with pytest.raises(QueryError, match="one for each of the rays"):
            check(other, AT_DOOR)
    for ask in (lambda pose: check(ranges, pose), check.region):
        with pytest.raises(QueryError, match="must be finite"):
            ask(np.array([np.nan, 0.0, 0.0]))


def test_the_region_holds_what_bears_on_the_object_and_little_else() -> None:
    check, exact = check_of("chest"), ExpectedRanges(ROOMS)
    here, gone = (
        exact.scene({"door": np.array([0.3]), "chest": at, "screen": AWAY}, AT_CHEST[None],
                    LASER.rays())[0]
        for at in (HOME, AWAY)
    )  # fmt: skip
    bears, region = np.flatnonzero(here < gone - 1e-6), check.region(AT_CHEST)
    assert set(bears) <= set(region.beams.tolist())
    assert len(region.beams) < 1.6 * len(bears)
    assert region.near <= here[bears].min() <= here[bears].max() <= region.far


def test_readings_outside_the_region_change_nothing() -> None:
    check = check_of("door")
    ranges, outside = scan(AT_DOOR), np.ones(LASER.beams, dtype=bool)
    outside[check.region(AT_DOOR).beams] = False
    before = check(ranges, AT_DOOR)
    ranges[outside] = 0.5
    assert check(ranges, AT_DOOR) == before


def test_what_no_beam_reaches_is_hidden() -> None:
    check = check_of("chest")
    behind = np.array([1.0, 0.0, -2.6])
    checked = check(np.full(LASER.beams, np.nan), behind)
    assert (checked.beams, checked.hidden) == (0, 1.0)
    assert check.verdict(checked, MOVED).outcome is Outcome.HIDDEN
    assert check.verdict(checked, MOVED).hidden_by is None


def test_a_moved_door_is_believed_to_be_anywhere_but_where_it_was() -> None:
    check = check_of("door")
    after = check.updated(check(scan(AT_DOOR, door=np.array([1.1])), AT_DOOR), MOVED)
    assert after.weights.values.sum() == pytest.approx(1.0)
    near = np.abs(after.states[:, 0] - 0.3) < 0.05
    assert after.weights.values[near].sum() < 0.05
    assert after.std[0] > 0.3


def test_a_laser_that_is_not_level_is_refused() -> None:
    tilted = fan(50, mount=placed(0.0, 0.0, 0.3, (0.0, 0.2, 0.0)))
    believed = beliefs()
    with pytest.raises(SettingsError, match="level plane"):
        LightCheck(ROOMS, tilted, 8.0, believed["door"], believed)
