"""Doors that hang elsewhere than the model says, in whole drives with known truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from objstate.building.model import Building, Mesh, MovableObject
from objstate.config import Settings
from objstate.estimator import Estimator
from objstate.estimator.believed import Believed
from objstate.estimator.hinges import Hinges, _Glance, _Strangeness, _Watch
from objstate.estimator.sight import Sight
from objstate.estimator.surroundings import Surroundings
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief, filter_for
from objstate.objects.doors import LatticeFilter
from objstate.particles import Weights
from objstate.records import Rays, Scan
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.estimator.drives import START, corridor, drive, truth
from tests.rooms import block, building, door, fan, scan_of

OFFSETS = {"a": (0.0, 0.2), "b": (0.12, 0.0), "c": (-0.1, 0.1), "d": (0.05, -0.2)}


def hung_aside(model: Building, name: str, offset: FloatArray) -> Building:
    return model.with_object(model[name].hung_at(model[name].hinge + offset))


def real() -> Building:
    place = corridor()
    for name, offset in OFFSETS.items():
        place = hung_aside(place, name, np.array(offset))
    return place


def driven(place: Building, seed: int, settings: Settings | None = None) -> Estimator:
    estimator = Estimator(corridor(), settings, seed=seed, initial_pose=START)
    for record in drive(seed, seconds=11.0, place=place).records:
        estimator.feed(record)
    return estimator


def errors(estimator: Estimator) -> dict[str, float]:
    """deg"""
    return {
        name: float(np.degrees(abs(estimator.objects[name].mean[0] - state[0])))
        for name, state in truth().items()
    }


def test_doors_that_hang_elsewhere_are_found_and_their_angles_are_right() -> None:
    """The nearest always, and some of the others: the last is hardly passed, and looks are few."""
    seeds, in_place = (1, 2, 3, 4), Settings.model_validate({"hinges": {"in_place": 1.0}})
    learnt, rigid = (
        [driven(real(), seed, each) for seed in seeds] for each in (Settings(), in_place)
    )
    assert all(each.hung_elsewhere == {} for each in rigid)
    assert all("a" in each.hung_elsewhere for each in learnt)
    found = [(each, name) for each in learnt for name in each.hung_elsewhere]
    assert len(found) > len(seeds)
    for each, name in found:
        assert errors(each)[name] < 3.0
    middles = [np.median([list(errors(each).values()) for each in of]) for of in (learnt, rigid)]
    assert middles[0] < middles[1] / 1.5


def test_a_leaf_that_no_look_shows_whole_does_not_hang_decimetres_away() -> None:
    """What is shorter may be a box."""
    asked = Settings.model_validate({"hinges": {"least_shown": 1.0}})
    far = [
        [np.hypot(*offset) > 0.15 for offset in driven(real(), 1, each).hung_elsewhere.values()]
        for each in (Settings(), asked)
    ]
    assert any(far[0])
    assert not any(far[1])


@pytest.mark.parametrize("seed", [1, 2])
def test_intervals_hold_the_truth_whether_a_hinge_was_found_or_not(seed: int) -> None:
    objects = driven(real(), seed).objects
    inside = [
        bool(objects[name].interval(0.98)[0] <= state <= objects[name].interval(0.98)[1])
        for name, state in truth().items()
    ]
    assert sum(inside) >= len(inside) - 1


@pytest.mark.parametrize("seed", [1, 2])
def test_where_the_model_is_exact_all_doors_stay_in_place(seed: int) -> None:
    exact = driven(corridor(), seed)
    assert exact.hung_elsewhere == {}
    assert max(errors(exact).values()) < 3.0


@pytest.mark.parametrize("seed", [2, 3])
def test_a_box_beside_a_cupboard_is_not_its_door_hung_elsewhere(seed: int) -> None:
    """Open by 90 degrees and hung 10 cm aside, the closed door would lie on the box's side."""
    plain, closed = corridor(), np.array([0.0])
    cupboard = door("cupboard", 4.6, 0.9, np.pi, width=0.4)
    model = building(plain.walls, *plain.objects.values(), cupboard)
    walls = Mesh.joined([plain.walls, block(4.9, 0.7, 0.4, 0.4, 0.1)])
    place = building(walls, *model.objects.values())
    estimator, states = Estimator(model, seed=seed, initial_pose=START), truth()
    for record in drive(seed, 11.0, states=states | {"cupboard": closed}, place=place).records:
        estimator.feed(record)
    assert estimator.hung_elsewhere == {}
    assert np.degrees(estimator.objects["cupboard"].mean[0]) < 3.0


def test_the_same_records_find_the_same_hinges() -> None:
    first, second = (driven(real(), 3).hung_elsewhere for _ in range(2))
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_a_view_of_a_rehung_door_is_that_of_a_building_where_it_hangs_there() -> None:
    place, rays = corridor(), fan(181)
    aside = hung_aside(place, "b", np.array([0.1, -0.2]))
    poses, states = np.array([START, [4.0, 0.0, -1.2]]), np.array([[0.0], [0.7]])
    model = BeamModel(Settings().beam_model)
    scan = scan_of(np.full(len(rays), 2.0), rays)
    moved = Sensing(place, model).with_object(aside["b"]).view(scan)
    anew = Sensing(aside, model).view(scan)
    for name in place.objects:
        assert np.array_equal(moved.object(name, states, poses), anew.object(name, states, poses))
    assert np.array_equal(moved.walls(poses), anew.walls(poses))
    exact = ExpectedRanges(place).with_object(aside["b"])
    assert np.array_equal(
        exact.object("b", states, poses, rays),
        ExpectedRanges(aside).object("b", states, poses, rays),
    )


def test_what_was_learnt_of_a_hinge_by_a_lost_robot_is_taken_back() -> None:
    place = corridor()
    believed = Believed(place, Settings(), 0, {})
    aside = hung_aside(place, "a", np.array([0.2, 0.0]))["a"]
    rehung: ObjectBelief = replace(believed.marginals["a"], item=aside)
    believed.hang(rehung)
    assert believed.marginals["a"].item is aside
    assert believed.go_back() == [place["a"]]
    assert believed.marginals["a"].item is place["a"]
    assert believed.go_back() == []


def test_a_hinge_that_is_known_from_before_is_where_the_door_is_looked_for() -> None:
    place = real()
    priors = Estimator(corridor()).objects
    known = {name: replace(belief, item=place[name]) for name, belief in priors.items()}
    estimator = Estimator(corridor(), seed=1, initial_pose=START, beliefs=known)
    assert {
        name: tuple(offset.round(9)) for name, offset in estimator.hung_elsewhere.items()
    } == OFFSETS
    for record in drive(1, seconds=11.0, place=place).records:
        estimator.feed(record)
    assert estimator.hung_elsewhere.keys() == OFFSETS.keys()
    assert max(errors(estimator).values()) < 3.0


def test_the_last_look_at_a_door_is_always_remembered() -> None:
    """Of many looks every other one is forgotten; the last may have shown that the door was moved."""
    place, name = corridor(), "b"
    hinges, sensing = (
        Hinges(place, Settings()),
        Sensing(corridor(), BeamModel(Settings().beam_model)),
    )
    rng, rays = np.random.default_rng(0), fan(181)
    prior, seen = Estimator(place).objects[name], ExpectedRanges(place)
    belief = prior
    for k in range(15):
        angle = np.radians(50.0 if k < 12 else 20.0)
        states = truth() | {name: np.array([angle])}
        pose = np.array([3.2 + 0.12 * k, 0.2, -0.6])
        ranges = seen.scene(states, pose[None], rays)[0] + 0.02 * rng.standard_normal(181)
        robot = PoseBelief.gaussian(pose, np.diag([1e-4, 1e-4, 1e-5]), 150, rng)
        about = np.exp(-0.5 * ((prior.states[:, 0] - angle) / np.radians(0.5)) ** 2) + 1e-300
        stamp = (k + 1) * 10**9
        belief = replace(prior, weights=Weights.of(about), stamp_ns=stamp, last_observed_ns=stamp)
        scan = scan_of(ranges, rays, stamp)
        sight = Sight(scan, robot, sensing.view(scan), Surroundings(place))
        hinges.note(belief, sight, 0.35 * k, 0.005, {})
        assert hinges.seems_off(name) == (k == 14)  # a leaf that is seen is looked at for a while
    assert hinges.search(belief, sensing) is None


def door_about(place: Building, name: str, degrees: float, stamp_ns: int) -> ObjectBelief:
    prior = Estimator(place).objects[name]
    about = np.exp(-0.5 * ((prior.states[:, 0] - np.radians(degrees)) / 0.01) ** 2) + 1e-300
    return replace(prior, weights=Weights.of(about), stamp_ns=stamp_ns, last_observed_ns=stamp_ns)


def glance_at(stamp_ns: int) -> _Glance:
    scan = scan_of(np.full(5, 2.0), fan(5), stamp_ns)
    return _Glance(scan, np.zeros(3), np.full(5, 4.0), 0.01, 0.0, {})


def test_a_door_that_nobody_looked_at_for_long_is_another_only_once_scans_say_so() -> None:
    place, hour_ns = corridor(), 3600 * 10**9
    door = filter_for(place["b"], Settings())
    assert isinstance(door, LatticeFilter)
    watch, known = _Watch(door, Settings().hinges), door_about(place, "b", 50.0, 0)
    watch.add(glance_at(0), _Strangeness(20, 0), known, 0.0)
    later = replace(door.predict(known, 3600.0, np.random.default_rng(0)), stamp_ns=hour_ns)
    assert later.weights.values[np.abs(later.states[:, 0] - np.radians(50.0)) < 0.1].sum() < 0.3
    assert not watch.is_another(later)
    assert watch.is_another(door_about(place, "b", 20.0, hour_ns))


def test_glances_at_next_to_nothing_do_not_push_out_those_that_show_a_door() -> None:
    """However many there are while a door seems to be another: the last of them tells of it."""
    place, settings = corridor(), Settings().hinges
    door = filter_for(place["b"], Settings())
    assert isinstance(door, LatticeFilter)
    watch, belief = _Watch(door, settings), door_about(place, "b", 50.0, 0)
    for k in range(settings.looks):
        watch.add(glance_at(k), _Strangeness(20, 0), belief, 0.4 * k)
    unsure = replace(belief, weights=Weights.uniform(len(belief.states)))
    for k in range(settings.looks, 5 * settings.looks):
        watch.add(glance_at(k), _Strangeness(1, 0), unsure, 0.4 * k)
    stamps = [each.scan.stamp_ns for each in watch.glances]
    assert stamps == [*range(settings.looks), 5 * settings.looks - 1]


def test_a_door_that_suddenly_is_another_is_what_its_looks_surely_say() -> None:
    place, sensing = corridor(), Sensing(corridor(), BeamModel(Settings().beam_model))
    hinges, records = Hinges(place, Settings()), drive(1, seconds=11.0, place=place).records
    estimator, name = Estimator(place, seed=1, initial_pose=START), "b"
    driven_m = 0.0
    for record in records:
        estimator.feed(record)
        belief, robot = estimator.objects[name], estimator.robot
        if not isinstance(record, Scan) or robot is None or belief.last_observed_ns is None:
            continue
        driven_m = float(np.hypot(*(robot.mean - START)[:2]))
        if hinges.is_due(belief, driven_m):
            sight = Sight(record, robot, sensing.view(record), Surroundings(place))
            hinges.note(belief, sight, driven_m, estimator.map_error, {})
    right = estimator.objects[name]
    assert not hinges.seems_off(name)
    wrong = right.with_weights(Weights.of(np.exp(-20.0 * (right.states[:, 0] - 1.5) ** 2)))
    last = next(each for each in reversed(records) if isinstance(each, Scan))
    assert hinges.is_due(wrong, driven_m + 0.31)
    assert estimator.robot is not None
    sight = Sight(last, estimator.robot, sensing.view(last), Surroundings(place))
    hinges.note(wrong, sight, driven_m + 0.31, estimator.map_error, {})
    assert hinges.seems_off(name)
    told = hinges.search(wrong, sensing)
    assert told is not None
    assert told.item is place[name]
    assert abs(np.degrees(told.mean[0] - truth()[name][0])) < 3.0
    assert hinges.search(right, sensing) is None


def test_beams_that_go_through_a_leaf_speak_against_its_being_there() -> None:
    place, sensing = corridor(), Sensing(corridor(), BeamModel(Settings().beam_model))
    hinges, rays, name = Hinges(place, Settings()), fan(181), "b"
    rng, pose = np.random.default_rng(0), np.array([4.2, 0.2, -0.9])
    ranges = ExpectedRanges(place).scene(truth(), pose[None], rays)[0]
    robot = PoseBelief.gaussian(pose, np.diag([1e-5, 1e-5, 1e-6]), 150, rng)
    scan = scan_of(ranges, rays)
    sight = Sight(scan, robot, sensing.view(scan), Surroundings(place))
    prior = Estimator(place).objects[name]

    def passed(degrees: float, offset: tuple[float, float]) -> int:
        about = np.exp(-((prior.states[:, 0] - np.radians(degrees)) ** 2) / 1e-4) + 1e-300
        item = place[name].hung_at(place[name].hinge + offset)
        belief = replace(prior, item=item, weights=Weights.of(about))
        glance = _Glance(sight.scan, pose, sight.walls, 0.005, 0.0, {})
        return hinges._passed(belief, glance)

    assert passed(50.0, (0.0, 0.0)) == 0
    assert passed(20.0, (0.0, 0.0)) > 5
    assert passed(50.0, (0.0, 0.3)) > 5


def stopped_about(item: MovableObject, most: float, places: FloatArray) -> int:
    """How many of the readings at places (k, 2) m a door is asked about that may be so far from its swing."""
    settings = Settings.model_validate({"hinges": {"most_m": most}})
    hinges, ranges = Hinges(corridor(), settings), np.hypot(*places.T)
    directions = np.column_stack([places / ranges[:, None], np.zeros(len(places))])
    scan = Scan(0, "laser", ranges, Rays(np.zeros((len(places), 3)), directions), 0.0, 30.0)
    glance = _Glance(scan, np.zeros(3), ranges + 1.0, 0.0, 0.0, {})
    prior = filter_for(item, settings).prior(np.random.default_rng(0))
    return hinges._strangeness(prior, item, glance).stopped


def test_what_lies_about_a_swing_is_as_far_from_it_as_the_nearest_place_of_the_leaf() -> None:
    place, rng = corridor(), np.random.default_rng(0)
    for item in place.objects.values():
        leaf = item.mesh.vertices[:, :2]
        tip = leaf[np.argmax(np.hypot(*leaf.T))]
        states = np.linspace(item.lower, item.upper, 400)[:, None]
        turns, hinge = item.transforms(states)[:, :2, :2], item.origin[:2, 3]
        shares = np.linspace(0.0, 1.0, 200)
        swept = hinge + (shares[:, None, None] * (turns @ tip)).reshape(-1, 2)
        places = hinge + rng.uniform(-2.0, 2.0, (50, 2))
        nearest = np.hypot(*(places[:, None] - swept).T).min(axis=0)
        for most in (0.1, 0.3, 1.0):
            stopped = stopped_about(item, most, places)
            assert np.sum(nearest < most - 0.06) <= stopped <= np.sum(nearest < most + 0.06)
