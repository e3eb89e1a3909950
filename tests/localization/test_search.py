"""A search finds the place that explains the scans, and doesn't choose between places that do alike."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from objstate.building.model import Building, Mesh
from objstate.config import SearchSettings, Settings
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, compose, wrap
from objstate.localization import Hypotheses, Keyframe, LogLikelihood, Search, apart
from objstate.localization.places import CLEARANCE, TURNS, Places
from objstate.localization.search import Odds
from objstate.records import Rays, Scan
from objstate.sensing import Around, BeamModel, ExpectedRanges, Sensing
from tests.rooms import LASER_HEIGHT, block, building, fan, fence, observed, wall

RAYS = fan(181, 1.5 * np.pi)
TEMPERING = Settings().localization.tempering


def hall() -> Building:
    """Without symmetry, with a pillar and a bench."""
    sides = np.array([(0.0, -3.0), (8.0, -3.0), (8.0, 2.0), (5.0, 3.0), (0.0, 3.0)])
    return building(
        Mesh.joined([fence(sides), block(4.0, -1.5, 1.0, 2.0), block(1.5, 2.0, 0.6, 1.2)])
    )


def alike() -> Building:
    """Two rooms of the same shape side by side, of the same heading, with a wall between."""
    outside = fence(np.array([(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (0.0, 3.0)]))
    benches = [block(x, 2.0, 0.6, 1.0) for x in (1.0, 5.0)]
    return building(Mesh.joined([outside, wall((4.0, 0.0), (4.0, 3.0), 0.001), *benches]))


def searched(place: Building, pose: FloatArray, step: FloatArray, looks: int) -> Hypotheses:
    """What a search makes of scans taken while driving from a pose on by a step each."""
    rng, expected, sensing = np.random.default_rng(1), ExpectedRanges(place), Sensing(place, MODEL)
    search = Search(sensing, Settings())

    def explained(scan: Scan) -> LogLikelihood:
        view = sensing.view(scan)
        return lambda poses, blur: TEMPERING * view.nearby_log_likelihood(poses, blur, NONE)

    odometry = np.array([3.0, 1.0, -2.0])
    for _ in range(looks):
        assert search.note(Keyframe(observed(expected, {}, pose, RAYS, rng), odometry))
        pose, odometry = compose(pose, step), compose(odometry, step)
    return search.hypotheses(explained, rng)


MODEL = BeamModel(Settings().beam_model)
NONE = Around((), np.empty((0, 3)))


@pytest.mark.parametrize("x, y, yaw", [(1.0, -2.0, 0.4), (6.5, 1.0, 2.5), (3.0, 2.0, -1.6)])  # noqa: PT006
def test_the_place_is_found_from_one_look_all_over_a_hall(x: float, y: float, yaw: float) -> None:
    pose = np.array([x, y, yaw])
    found = searched(hall(), pose, np.zeros(3), 1)
    assert np.hypot(*(found.poses[0] - pose)[:2]) < 0.1
    assert abs(wrap(found.poses[0, 2] - yaw)) < np.radians(2.0)
    assert found.shares.sum() == pytest.approx(1.0)
    assert (np.diff(found.shares) <= 0.0).all()


def test_further_looks_while_driving_make_it_more_certain() -> None:
    pose, step = np.array([1.0, -2.0, 0.4]), np.array([0.45, 0.0, 0.1])
    once, often = (searched(hall(), pose, step, looks) for looks in (1, 4))
    assert often.shares[0] >= once.shares[0]
    assert often.shares[0] > 0.99
    end = pose
    for _ in range(3):
        end = compose(end, step)
    assert apart(often.poses[0], end) < 0.2


def test_between_rooms_that_look_alike_nothing_is_chosen() -> None:
    found = searched(alike(), np.array([2.4, 1.2, 0.3]), np.array([0.4, 0.0, 0.1]), 3)
    assert len(found.shares) >= 2
    np.testing.assert_allclose(found.shares[:2], 0.5, atol=0.3)
    shift = np.abs(found.poses[0] - found.poses[1])
    np.testing.assert_allclose(shift, [4.0, 0.0, 0.0], atol=0.1)


def test_hypotheses_lie_apart_and_drive_on_together() -> None:
    found = searched(alike(), np.array([2.4, 1.2, 0.3]), np.array([0.4, 0.0, 0.1]), 2)
    for k, pose in enumerate(found.poses):
        assert (apart(np.delete(found.poses, k, axis=0), pose) > 1.0).all()
    step = np.array([0.3, 0.0, -0.2])
    moved = found.moved(compose(found.odometry, step))
    np.testing.assert_allclose(moved, compose(found.poses, step), atol=1e-9)


def test_scans_from_one_place_are_remembered_once() -> None:
    place = hall()
    search = Search(Sensing(place, MODEL), Settings())
    scan = observed(ExpectedRanges(place), {}, np.array([1.0, -2.0, 0.4]), RAYS)
    assert search.note(Keyframe(scan, np.zeros(3)))
    assert not search.note(Keyframe(scan, np.array([0.05, 0.0, 0.0])))
    assert search.note(Keyframe(scan, np.array([1.0, 0.0, 0.0])))


def test_a_slow_robot_comes_to_new_places() -> None:
    """It drives 0.3 m between two scans, and waits longer than for a scan from the same place."""
    place = hall()
    search, step_ns = Search(Sensing(place, MODEL), Settings()), 2_000_000_000
    scan = observed(ExpectedRanges(place), {}, np.array([1.0, -2.0, 0.4]), RAYS)
    for k in range(9):
        scan_then = replace(scan, stamp_ns=k * step_ns)
        assert search.note(Keyframe(scan_then, np.array([0.3 * k, 0.0, 0.0])))
    places = [float(each.odometry[0]) for each in search.keyframes]
    assert places == pytest.approx([0.3, 0.9, 1.5, 2.1, 2.4])


def test_a_robot_that_stands_adds_no_evidence_for_another_place() -> None:
    """It is followed 1 m off the place that its scans show; that it slipped there is known."""
    place, rng = hall(), np.random.default_rng(2)
    sensing, pose = Sensing(place, MODEL), np.array([1.0, -2.0, 0.4])
    search, followed = Search(sensing, Settings()), pose + np.array([1.0, 0.5, 0.0])

    def explained(scan: Scan) -> LogLikelihood:
        view = sensing.view(scan)
        return lambda poses, blur: TEMPERING * view.nearby_log_likelihood(poses, blur, NONE)

    odds = []
    for k in range(6):
        scan = observed(ExpectedRanges(place), {}, pose, RAYS, rng)
        scan = replace(scan, stamp_ns=k * 2_000_000_000)
        slipped = Odds(slipped=1e-3) if k == 0 else Odds()
        assert search.note(Keyframe(scan, np.zeros(3), followed, Odds(slipped=1e-3), slipped))
        odds.append(float(search.hypotheses(explained, rng).log_odds.max()))
    assert max(odds) < min(odds) + 5.0


def test_places_are_free_inside_the_building_and_no_more_than_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walls, spacings = Sensing(hall(), MODEL).walls_at(LASER_HEIGHT), []
    for most in (SearchSettings.max_places, 150):
        monkeypatch.setattr(SearchSettings, "max_places", most)
        places = Places.of(walls, SearchSettings())
        assert 0 < len(places.points) <= most
        assert (places.nearest >= CLEARANCE).all()
        assert (places.nearest <= places.farthest).all()
        x, y = places.points.T
        assert ((x > 0.0) & (x < 8.0) & (y > -3.0) & (y < 3.0)).all()
        spacings.append(places.spacing)
    assert spacings[1] > spacings[0]


def test_places_know_what_rays_all_round_would_read() -> None:
    place = hall()
    places = Places.of(Sensing(place, MODEL).walls_at(LASER_HEIGHT), SearchSettings())
    poses = np.column_stack([places.points, np.zeros(len(places.points))])
    bearings = np.arange(TURNS) * (2.0 * np.pi / TURNS)
    level = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(TURNS)])
    rays = Rays(np.tile([0.0, 0.0, LASER_HEIGHT], (TURNS, 1)), level)
    ranges = ExpectedRanges(place).walls(poses, rays)
    about = np.stack([np.roll(ranges, turn, axis=1) for turn in (-1, 0, 1)])
    off = np.abs(
        np.stack([places.nearest - about.min(axis=0), places.farthest - about.max(axis=0)])
    )
    assert np.mean(off < 1e-4) > 0.999  # but for rays that just pass a corner


@pytest.mark.parametrize("walls", [Mesh.empty(), wall((0.0, 0.0), (6.0, 0.0))])
def test_where_walls_enclose_nothing_a_told_place_alone_is_held_against_scans(walls: Mesh) -> None:
    place, pose, rng = building(walls), np.array([1.0, 1.5, -1.2]), np.random.default_rng(0)
    expected = ExpectedRanges(place)
    sensing = Sensing(place, MODEL)
    search = Search(sensing, Settings())
    assert len(Places.of(sensing.walls_at(LASER_HEIGHT), SearchSettings()).points) == 0

    def explained(scan: Scan) -> LogLikelihood:
        view = sensing.view(scan)
        return lambda poses, blur: TEMPERING * view.nearby_log_likelihood(poses, blur, NONE)

    scan = observed(expected, {}, pose, RAYS, rng)
    assert search.note(Keyframe(scan, np.zeros(3)))
    with pytest.raises(BuildingError, match=r"enclose at the laser's height \(0\.3 m\)"):
        search.hypotheses(explained, rng)
    search.forget()
    assert search.note(Keyframe(scan, np.zeros(3), pose))
    found = search.hypotheses(explained, rng)
    assert len(found.poses) == 1
    assert apart(found.poses[0], pose) < 1.0


def test_nothing_keeps_places_once_they_are_done_with() -> None:
    place, settings, pose = hall(), Settings(), np.array([1.0, -2.0, 0.4])
    places = Places.of(Sensing(place, MODEL).walls_at(LASER_HEIGHT), settings.search)
    scan = observed(ExpectedRanges(place), {}, pose, RAYS)
    told = [
        places.log_likelihood(
            scan, settings.beam_model, 40, pose[None, :2], pose[None, 2:], np.zeros(3)
        )
        for _ in range(2)
    ]
    assert told[0] == told[1]
    kept = weakref.ref(places)
    del places
    gc.collect()
    assert kept() is None
