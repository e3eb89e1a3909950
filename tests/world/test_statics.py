"""What several drives tell of a door, put together."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Building
from objstate.config import BuildingErrorSettings, DoorErrorSettings, DoorSettings
from objstate.objects.doorframe import BearingReading
from objstate.objects.mixture import DoorMixture, Doorway, Statics
from objstate.objects.mixture_kernels import ZERO
from objstate.world.statics import BEARINGS, DoorEvidence, agreed, combined, contradicting, leaves
from tests.rooms import door as door_of
from tests.rooms import enclosure

ERROR = BuildingErrorSettings()


def evidence(
    x: float, y: float, std: float, bearing_deg: float | None = None, turn: float = 0.0
) -> DoorEvidence:
    """A drive whose leaf, turned so far, made a hinge seem to be there; perhaps it was closed."""
    cos, sin = np.cos(turn), np.sin(turn)
    seen = np.array([[1.0, 0.0, cos, -sin], [0.0, 1.0, sin, cos]])
    log = np.zeros(len(BEARINGS))
    if bearing_deg is not None:
        off = (BEARINGS - np.radians(bearing_deg)) / np.radians(0.1)
        log = np.logaddexp(np.log(0.15), np.log(30.0) - 0.5 * off**2)
        log -= log.max()
    return DoorEvidence(seen.T @ seen / std**2, seen.T @ np.array([x, y]) / std**2, log)


@settings(max_examples=20, deadline=None)
@given(st.permutations(range(4)), st.floats(-0.05, 0.05), st.floats(-3.0, 3.0))
def test_the_order_of_drives_changes_nothing(order: list[int], x: float, bearing: float) -> None:
    drives = [{"door": evidence(x + 0.001 * k, 0.0, 0.005, bearing)} for k in range(4)]
    (first,) = combined(drives, ERROR)
    (second,) = combined([drives[k] for k in order], ERROR)
    np.testing.assert_allclose(first.hinge, second.hinge, atol=1e-12)
    assert first.bearing == pytest.approx(second.bearing, abs=1e-12)


def test_more_drives_tell_more() -> None:
    drives = [{"door": evidence(0.02, -0.01, 0.01, 2.0, turn)} for turn in np.arange(5.0)]
    found = [combined(drives[:count], ERROR)[0] for count in range(1, 6)]
    stds = [each.hinge_std for each in found]
    assert stds == sorted(stds, reverse=True)
    assert found[-1].hinge == pytest.approx([0.02, -0.01], abs=0.003)
    assert np.degrees(found[-1].bearing) == pytest.approx(2.0, abs=0.1)
    assert found[-1].bearing_std < found[0].bearing_std


def test_one_drive_cant_tell_a_door_ajar_from_one_that_hangs_askew() -> None:
    (once,) = combined([{"door": evidence(0.0, 0.0, 0.01, 2.0)}], ERROR)
    assert 0.0 <= np.degrees(once.bearing) < 1.0


def test_a_door_that_was_never_closed_keeps_its_bearing() -> None:
    (door,) = combined([{"door": evidence(0.01, 0.0, 0.005)}] * 3, ERROR)
    assert door.bearing == pytest.approx(0.0, abs=1e-9)
    assert door.bearing_std > np.radians(0.05)


def test_the_walls_tell_the_bearing_of_a_door_that_was_never_closed() -> None:
    drives = [{name: evidence(0.01, 0.0, 0.005) for name in ("a", "b", "c")}] * 3
    reading = BearingReading(np.radians(2.0), np.radians(0.5) ** 2)
    found = combined(drives, ERROR, by_walls=dict.fromkeys("abc", reading))
    alone = combined([drives[0]], ERROR, by_walls=dict.fromkeys("abc", reading))
    for door, once in zip(found, alone, strict=True):
        assert np.degrees(door.bearing) == pytest.approx(1.8, abs=0.2)
        assert door.bearing == pytest.approx(once.bearing, abs=1e-9)  # told once, not by drives


def test_what_the_walls_tell_isnt_evidence_of_a_drive() -> None:
    reading = BearingReading(np.radians(2.0), np.radians(0.5) ** 2)
    leaf = door_of("door", 0.0, 0.0)
    way = Doorway(leaf, DoorSettings(), ERROR, reading)
    unseen = DoorMixture.unknown(way, Statics(0.03**2, np.radians(3.0) ** 2))
    told = DoorEvidence.of(unseen).bearing
    assert np.ptp(told) < 1e-6


def test_a_limit_that_is_known_less_surely_than_before_tells_no_bearing() -> None:
    """Limits get their Gaussians from cells, which may differ more than the walls let expect."""
    reading = BearingReading(0.0, np.radians(0.5) ** 2)
    way = Doorway(door_of("door", 0.0, 0.0), DoorSettings(), ERROR, reading)
    mixture = DoorMixture.unknown(way, Statics(0.03**2, np.radians(3.0) ** 2))
    mixture.means[way.cells, ZERO] = np.radians(0.5)
    mixture.covariances[way.cells, ZERO, ZERO] *= 1.2**2
    assert np.ptp(DoorEvidence.of(mixture).bearing) < 1e-6


def test_what_was_learnt_before_is_the_prior() -> None:
    known = DoorErrorSettings(hinge_std_m=0.001, bearing_std_deg=0.05)
    error = BuildingErrorSettings(doors={"door": known})
    (door,) = combined([{"door": evidence(0.05, 0.0, 0.01, 2.0)}], error)
    assert np.abs(door.hinge).max() < 0.001
    assert abs(np.degrees(door.bearing)) < 0.1


def test_a_drive_that_contradicts_all_others_is_named() -> None:
    names = [f"door_{k}" for k in range(6)]
    alike = [{name: evidence(0.01, 0.0, 0.005) for name in names} for _ in range(4)]
    assert contradicting(alike) is None
    elsewhere = {name: evidence(0.10, 0.05, 0.005) for name in names}
    assert contradicting([*alike[:2], elsewhere, *alike[2:]]) == 2
    assert contradicting([alike[0], elsewhere]) is None  # nobody knows which of two is wrong


def test_drives_that_differ_tell_less() -> None:
    names = [f"door_{k}" for k in range(5)]
    alike = [{name: evidence(0.01, 0.0, 0.003, 1.0) for name in names} for _ in range(4)]
    off = np.random.default_rng(0).standard_normal((4, 5, 3)) * (0.01, 0.01, 0.5)
    differing = [
        {
            name: evidence(0.01 + off[k, i, 0], off[k, i, 1], 0.003, 1.0 + off[k, i, 2])
            for i, name in enumerate(names)
        }
        for k in range(4)
    ]
    for sure, unsure in zip(combined(alike, ERROR), combined(differing, ERROR), strict=True):
        assert unsure.seen_std(np.zeros(1)) > 2.0 * sure.seen_std(np.zeros(1))
        assert unsure.bearing_std > 2.0 * sure.bearing_std
        assert abs(np.degrees(unsure.bearing - sure.bearing)) < 1.0


def test_a_box_that_one_drive_took_for_a_leaf_is_no_leaf() -> None:
    names = [f"door_{k}" for k in range(5)]
    alike = [{name: evidence(0.01, 0.0, 0.003, 1.0) for name in names} for _ in range(4)]
    wrong = alike[0] | {"door_2": evidence(0.09, -0.05, 0.003, -6.0)}
    kept, _ = agreed([*alike, wrong])
    assert [name for drive in kept for name in names if name not in drive] == ["door_2"]
    assert "door_2" not in kept[4]
    assert contradicting([*alike, wrong]) is None


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000))
def test_a_leaf_that_is_thicker_than_modelled_is_told_from_a_hinge_elsewhere(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hinge, leaf = rng.normal(0.0, 0.01, 2), rng.normal(0.0, 0.01, 2)
    drives = []
    for turn in (0.0, 0.4, 0.8, 1.6):
        cos, sin = np.cos(turn), np.sin(turn)
        x, y = hinge + np.array([[cos, -sin], [sin, cos]]) @ leaf
        drives.append({"door": evidence(x, y, 0.001, turn=turn)})
    (door,) = combined(drives, ERROR)
    off = np.append(door.hinge - hinge, door.leaf - leaf)
    assert np.abs(off).max() < 0.004
    assert off @ np.linalg.solve(door.covariance, off) < 13.3  # 99 % of chi squared, 4 degrees


def test_a_leaf_seen_at_one_angle_tells_little_of_its_hinge_at_others() -> None:
    same = [{"door": evidence(0.02, 0.0, 0.001)} for _ in range(5)]
    (door,) = combined(same, ERROR)
    assert door.seen_std(np.zeros(1)) < 0.003
    assert door.seen_std(np.array([np.pi / 2])) > 0.008
    turned = [{"door": evidence(0.02, 0.0, 0.001, turn=turn)} for turn in (0.0, 0.8, 1.6)]
    (known,) = combined(turned, ERROR)
    assert known.seen_std(np.array([np.pi / 2])) < 0.004


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000))
def test_a_hinge_is_as_uncertain_as_the_width_of_a_leaf_seen_at_one_angle(seed: int) -> None:
    """The free edge is where the hinge and the width have it: either may be off."""
    rng = np.random.default_rng(seed)
    off, turn = rng.normal(0.0, 0.05), 1.2
    known = {"door": DoorErrorSettings(hinge_std_m=0.03, bearing_std_deg=1.0, width_std_m=0.05)}
    error = ERROR.model_copy(update={"doors": known})
    walls = enclosure(4.0, 4.0)
    building = Building("room", walls, {"door": door_of("door", 0.0, 0.0)}, error=error)
    cos, sin = np.cos(turn), np.sin(turn)
    same = [{"door": evidence(off * cos, off * sin, 0.001, turn=turn)} for _ in range(5)]
    (door,) = combined(same, error, known_leaves=leaves(building))
    assert door.hinge @ np.linalg.solve(door.covariance[:2, :2], door.hinge) < 9.2  # 99 %
    assert np.array([cos, sin]) @ door.covariance[:2, :2] @ np.array([cos, sin]) > 0.02**2
    assert np.array([-sin, cos]) @ door.covariance[:2, :2] @ np.array([-sin, cos]) < 0.015**2


def test_evidence_of_earlier_versions_tells_of_the_hinge_alone() -> None:
    now = evidence(0.02, 0.01, 0.01)
    words = now.words()
    before = words | {"hinge": now.places[:2, :2].tolist(), "pull": now.pull[:2].tolist()}
    again = DoorEvidence.read(before)
    assert again.found is not None
    assert again.found[0] == pytest.approx([0.02, 0.01], abs=1e-4)


@settings(max_examples=20, deadline=None)
@given(st.floats(-0.05, 0.05), st.floats(0.002, 0.02), st.floats(-5.0, 5.0))
def test_evidence_is_written_and_read(x: float, std: float, bearing: float) -> None:
    once = evidence(x, -x, std, bearing)
    again = DoorEvidence.read(once.words())
    np.testing.assert_allclose(again.places, once.places, atol=1e-3)
    np.testing.assert_allclose(again.bearing, once.bearing, atol=1e-3)


def test_a_door_that_rests_ajar_twice_need_not_hang_askew() -> None:
    other = {f"door_{k}": evidence(0.0, 0.0, 0.01, 0.0) for k in range(6)}
    drives = [
        {**other, "door": evidence(0.0, 0.0, 0.01, at)} for at in (2.4, 2.4, None, None, None)
    ]
    doors = {each.name: each for each in combined(drives, ERROR)}
    askew = doors["door"]
    assert askew.bearing - 1.645 * askew.bearing_std < np.radians(0.3)
    assert doors["door_0"].bearing_std < np.radians(0.2)
    # closed it can't be ajar inward, so that there it hangs askew
    inward = combined(drives, ERROR, downward={"door"})
    assert {each.name: each for each in inward}["door"].bearing > askew.bearing
