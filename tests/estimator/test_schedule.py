"""No reading serves both beliefs."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import ObjectUpdateSettings
from objstate.estimator.schedule import Schedule
from objstate.records import Scan
from objstate.sensing.circles import evenly_spread
from tests.rooms import fan, scan_of

SETTINGS = {
    "beams": ObjectUpdateSettings(schedule="beams"),
    "alternate": ObjectUpdateSettings(schedule="alternate"),
    "lasers": ObjectUpdateSettings(schedule=("front",)),
}


def scan_by(laser: str, count: int, seed: int) -> Scan:
    ranges = np.random.default_rng(seed).uniform(0.5, 9.0, count)
    ranges[::7] = np.nan
    return scan_of(ranges, fan(count), laser=laser)


@settings(max_examples=30)
@given(
    st.sampled_from(sorted(SETTINGS)),
    st.lists(st.sampled_from(["front", "rear"]), min_size=1, max_size=8),
    st.integers(1, 40),
)
def test_the_shares_are_disjoint_and_cover_the_valid_beams(
    schedule: str, lasers: list[str], count: int
) -> None:
    sharing = Schedule(SETTINGS[schedule])
    for k, laser in enumerate(lasers):
        scan = scan_by(laser, count, k)
        localizing, observing = sharing.share_out(scan)
        assert not (localizing & observing).any()
        np.testing.assert_array_equal(localizing | observing, scan.valid)


def test_alternating_scans_take_turns_for_each_laser() -> None:
    sharing = Schedule(SETTINGS["alternate"])
    turns = [
        sharing.share_out(scan_by(laser, 10, 0))[0].any() for laser in ("a", "b", "a", "b", "a")
    ]
    assert turns == [True, True, False, False, True]


def test_every_other_beam_serves_the_other_belief_in_the_next_scan() -> None:
    sharing, scan = Schedule(SETTINGS["beams"]), scan_by("front", 20, 0)
    (first, rest), (then, _) = sharing.share_out(scan), sharing.share_out(scan)
    np.testing.assert_array_equal(then, rest)
    assert abs(int(first.sum()) - int(rest.sum())) <= 1


def test_lasers_serve_one_belief_each() -> None:
    sharing = Schedule(SETTINGS["lasers"])
    front, rear = scan_by("front", 10, 0), scan_by("rear", 10, 1)
    np.testing.assert_array_equal(sharing.share_out(front)[0], front.valid)
    np.testing.assert_array_equal(sharing.share_out(rear)[1], rear.valid)


@given(st.lists(st.booleans(), max_size=200), st.integers(1, 60))
def test_evenly_spread_beams_are_some_of_the_chosen(chosen: list[bool], most: int) -> None:
    beams = np.array(chosen, dtype=bool)
    kept = evenly_spread(beams, most)
    assert not (kept & ~beams).any()
    assert kept.sum() == min(most, beams.sum())
    gaps = np.diff(np.searchsorted(np.flatnonzero(beams), np.flatnonzero(kept)))
    assert len(gaps) == 0 or gaps.max() - gaps.min() <= 1
