"""Laws of the filters: priors, predictions, and updates by real scans of small rooms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Building, Mesh, MovableObject
from objstate.config import (
    BeamModelSettings,
    DoorSettings,
    Dynamics,
    FurnitureSettings,
    Rest,
    Settings,
)
from objstate.geometry import FloatArray, wrap
from objstate.objects import ObjectBelief, ObjectFilter, ScanEvidence, filter_for
from objstate.objects.doors import LatticeFilter
from objstate.objects.furniture import SampleFilter
from objstate.particles import Weights
from objstate.records import Scan
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.objects.views import evidence_by, gaussian_about, updated
from tests.rooms import (
    building,
    door,
    enclosure,
    fan,
    observed,
    scan_of,
    sliding_door,
    table,
    wall,
)

TEMPERING = 0.3
HINGED, SLIDING, TABLE = door("door", 0.0, 1.0), sliding_door("slide", 0, 1), table("table", 1, 0.5)
TURNSTILE = door("turnstile", 0.0, 1.0, limits=(-np.pi, np.pi), wraps=True)
STILL = Dynamics(moves_per_hour=0.0, drift_deg=0.0, drift_m=0.0)


def rng_of(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def doorway(item: MovableObject = HINGED) -> Building:
    """A wall at y = 1 with a doorway from x = 0 to 0.9, and a room behind."""
    walls = [wall((-4, 1), (0, 1)), wall((0.9, 1), (4, 1)), wall((-4, 4), (4, 4))]
    return building(Mesh.joined([*walls, wall((-4, -2), (4, -2))]), item)


def evidence_of(place: Building, name: str, scan: Scan, poses: FloatArray) -> ScanEvidence:
    view = Sensing(place, BeamModel(BeamModelSettings())).view(scan)
    weights = Weights.uniform(len(poses))
    walls = view.walls(poses)
    absent = view.log_likelihood(walls)
    return ScanEvidence(name, view, poses, weights, walls, absent, TEMPERING)


def read(
    place: Building,
    name: str,
    state: FloatArray,
    pose: FloatArray,
    rng: np.random.Generator | None = None,
) -> Scan:
    return observed(ExpectedRanges(place), {name: state}, pose, fan(361, 2 * np.pi), rng)


# --- priors -------------------------------------------------------------------------


@pytest.mark.parametrize("item", [HINGED, SLIDING, TURNSTILE])
def test_before_any_scan_doors_stand_as_they_come_to_rest(item: MovableObject) -> None:
    prior = filter_for(item, Settings()).prior(rng_of())
    states, weights = prior.states[:, 0], prior.weights.values
    shares = (0.0, 0.0) if item.wraps else (Rest().closed, Rest().open)
    between = (1.0 - sum(shares)) / len(states)
    ajar = Rest().closed / 6.0 if item is HINGED else 0.0
    near = np.flatnonzero(states < np.radians(6.3)) if item is HINGED else np.array([0])
    np.testing.assert_allclose(weights[near[-1] + 1 : -1], between)
    assert weights[near[1:]].sum() == pytest.approx(ajar + between * (len(near) - 1))
    assert weights[[0, -1]] - between == pytest.approx((shares[0] - ajar, shares[1]))
    assert (np.diff(states) > 0).all()
    assert states[0] == item.lower
    assert states[-1] == pytest.approx(item.upper - (prior.cell[0] if item.wraps else 0.0))
    resolution = np.radians(0.5) if item is not SLIDING else 0.005
    assert prior.cell[0] <= resolution + 1e-12


def test_a_gaussian_prior_is_about_its_mean_or_the_way_the_model_shows_it() -> None:
    told = DoorSettings(prior="gaussian", prior_mean_deg=60.0, prior_std_deg=5.0)
    belief = LatticeFilter(HINGED, told).prior(rng_of())
    assert np.degrees(belief.mean[0]) == pytest.approx(60.0, abs=0.1)
    assert np.degrees(belief.std[0]) == pytest.approx(5.0, abs=0.1)
    shown = LatticeFilter(SLIDING, DoorSettings(prior="gaussian", prior_std_m=0.1))
    assert shown.prior(rng_of()).mean[0] == pytest.approx(0.1 * np.sqrt(2 / np.pi), abs=0.003)


@pytest.mark.parametrize(("kind", "ratio"), [("gaussian", 1.0), ("uniform", 1 / np.sqrt(3))])
def test_furniture_is_expected_where_it_should_stand(kind: str, ratio: float) -> None:
    chosen = FurnitureSettings(prior=kind, prior_std_m=0.3, prior_std_deg=10.0)
    belief = SampleFilter(TABLE, chosen).prior(rng_of())
    np.testing.assert_allclose(belief.mean, TABLE.home, atol=0.05)
    expected = ratio * np.array([0.3, 0.3, np.radians(10.0)])
    np.testing.assert_allclose(belief.std, expected, rtol=0.12)


def test_the_joint_chooses_the_filter() -> None:
    kinds = [type(filter_for(item, Settings())) for item in (HINGED, SLIDING, TABLE)]
    assert kinds == [LatticeFilter, LatticeFilter, SampleFilter]


# --- predictions --------------------------------------------------------------------


def knows(filter_: ObjectFilter, state: FloatArray) -> ObjectBelief:
    """The filter's belief after it was told the state."""
    belief, told = (
        filter_.prior(rng_of()),
        evidence_by(gaussian_about(state, np.full(len(state), 0.02))),
    )
    for _ in range(4):  # the first leaves only the right states to be cast finely
        belief = updated(filter_, belief, told, rng_of())
    return belief


def moving(drift_deg: float, drift_m: float, moves: float) -> Dynamics:
    return Dynamics(moves_per_hour=moves, drift_deg=drift_deg, drift_m=drift_m)


@pytest.mark.parametrize("item", [HINGED, SLIDING, TURNSTILE])
@pytest.mark.parametrize(("moves", "atol"), [(0.0, 2e-4), (20.0, 2.5e-3)])
def test_two_predictions_of_half_a_minute_are_one_of_a_minute(
    item: MovableObject, moves: float, atol: float
) -> None:
    """What is being moved drifts only once it rests, by the next prediction."""
    anywhere = Rest(closed=0.0, open=0.0)
    filter_ = LatticeFilter(item, DoorSettings(dynamics=moving(0.5, 0.005, moves), rest=anywhere))
    belief = knows(filter_, np.array([0.5]))
    half = filter_.predict(belief, 30.0, rng_of())
    twice, once = filter_.predict(half, 30.0, rng_of()), filter_.predict(belief, 60.0, rng_of())
    np.testing.assert_allclose(twice.weights.values, once.weights.values, atol=atol)
    assert twice.std[0] == pytest.approx(once.std[0], rel=0.01)


@settings(max_examples=30)
@given(st.floats(0.001, 20_000.0), st.floats(0.0, 1.57), st.floats(0.0, 5.0), st.floats(0.0, 60.0))
def test_a_predicted_door_stays_between_its_limits_and_sums_to_one(
    seconds: float, angle: float, drift: float, moves: float
) -> None:
    filter_ = LatticeFilter(HINGED, DoorSettings(dynamics=moving(drift, 0.0, moves)))
    belief = knows(filter_, np.array([angle]))
    later = filter_.predict(belief, seconds, rng_of())
    assert later.states is belief.states
    assert later.weights.values.sum() == pytest.approx(1.0)
    assert HINGED.lower <= later.mean[0] <= HINGED.upper
    assert later.std[0] >= belief.std[0] - 1e-6


@pytest.mark.parametrize("seconds", [0.05, 1.0, 30.0])
def test_drift_adds_its_variance_however_short_the_time(seconds: float) -> None:
    filter_ = LatticeFilter(HINGED, DoorSettings(dynamics=moving(0.6, 0.0, 0.0)))
    belief = knows(filter_, np.array([0.8]))
    later = filter_.predict(belief, seconds, rng_of())
    added = later.std[0] ** 2 - belief.std[0] ** 2
    assert added == pytest.approx(np.radians(0.6) ** 2 * seconds, rel=0.02)
    assert later.mean[0] == pytest.approx(belief.mean[0], abs=1e-4)


def test_many_small_predictions_spread_as_one_long() -> None:
    filter_ = LatticeFilter(HINGED, DoorSettings(dynamics=moving(0.3, 0.0, 0.0)))
    belief = stepped = knows(filter_, np.array([0.8]))
    for _ in range(200):
        stepped = filter_.predict(stepped, 0.1, rng_of())
    once = filter_.predict(belief, 20.0, rng_of())
    assert stepped.std[0] == pytest.approx(once.std[0], rel=0.01)


@pytest.mark.parametrize("seconds", [0.5, 2.0, 20.0])
def test_moves_in_small_steps_go_as_far_as_in_one_long(seconds: float) -> None:
    filter_ = LatticeFilter(HINGED, DoorSettings(dynamics=moving(0.0, 0.0, 2.0)))
    belief = stepped = knows(filter_, np.array([0.8]))
    for _ in range(round(10 * seconds)):
        stepped = filter_.predict(stepped, 0.1, rng_of())
    once = filter_.predict(belief, seconds, rng_of())
    far = np.abs(belief.states[:, 0] - 0.8) > 0.3
    share = stepped.weights.values[far].sum() / once.weights.values[far].sum()
    going = (stepped.weights.values @ stepped.p_moving) / (once.weights.values @ once.p_moving)
    assert share == pytest.approx(1.0, rel=0.05)
    assert going == pytest.approx(1.0, rel=0.01)


def test_a_door_last_seen_an_hour_ago_is_uncertain_again() -> None:
    filter_ = filter_for(HINGED, Settings())
    belief = knows(filter_, np.array([0.4]))
    assert belief.is_certain
    later = filter_.predict(belief, 3600.0, rng_of())
    assert not later.is_certain
    long_after = filter_.predict(belief, 100 * 3600.0, rng_of())
    rest, degrees = Rest(), np.degrees(long_after.states[:, 0])
    weights = long_after.weights.values
    assert weights[degrees < 15.0].sum() > rest.closed
    assert weights[degrees > degrees.max() - 15.0].sum() > rest.open
    assert weights.min() > 0.5 * rest.anywhere / len(weights)


def test_furniture_last_seen_long_ago_may_be_anywhere_in_its_prior_again() -> None:
    filter_ = SampleFilter(TABLE, FurnitureSettings(dynamics=Dynamics(moves_per_hour=1.0)))
    belief = knows(filter_, TABLE.home + 0.1)
    later = filter_.predict(belief, 20 * 3600.0, rng_of(1))
    np.testing.assert_allclose(later.mean, TABLE.home, atol=0.15)
    assert (later.std > 5.0 * belief.std).all()
    np.testing.assert_allclose(later.std, filter_.prior(rng_of(2)).std, rtol=0.35)


def test_furniture_drifts_with_the_root_of_time() -> None:
    chosen = FurnitureSettings(samples=4000, dynamics=moving(0.5, 0.01, 0.0))
    filter_ = SampleFilter(TABLE, chosen)
    belief = filter_.prior(rng_of()).with_samples(
        np.tile(TABLE.home, (4000, 1)), Weights.uniform(4000)
    )
    for seconds in (1.0, 25.0):
        later = filter_.predict(belief, seconds, rng_of())
        expected = np.array([0.01, 0.01, np.radians(0.5)]) * np.sqrt(seconds)
        np.testing.assert_allclose(later.std, expected, rtol=0.05)


@pytest.mark.parametrize("item", [HINGED, SLIDING, TABLE])
def test_what_never_moves_does_not_change(item: MovableObject) -> None:
    rules = ({"match": "*", "dynamics": STILL},)
    filter_ = filter_for(item, Settings.model_validate({"objects": rules}))
    belief = filter_.prior(rng_of())
    later = filter_.predict(belief, 5000.0, rng_of())
    np.testing.assert_allclose(later.mean, belief.mean, atol=2e-3)
    np.testing.assert_allclose(later.std, belief.std, atol=2e-3)


# --- updates ------------------------------------------------------------------------


@pytest.mark.parametrize("item", [HINGED, SLIDING, TABLE])
def test_where_nothing_bears_on_the_object_the_belief_stays_itself(item: MovableObject) -> None:
    filter_ = filter_for(item, Settings())
    belief = filter_.prior(rng_of())
    nothing = evidence_by(gaussian_about(item.home, np.full(len(item.home), 0.01)), bears=False)
    assert updated(filter_, belief, nothing, rng_of()) is belief


@pytest.mark.parametrize("degrees", [0.0, 3.0, 27.3, 45.0, 61.9, 90.0])
@pytest.mark.parametrize("x", [0.3, 0.8, 1.8])
def test_more_evidence_never_moves_a_noiseless_door_away_from_its_true_angle(
    degrees: float, x: float
) -> None:
    place, pose = doorway(), np.array([x, -0.6, 0.3])
    filter_, rng = filter_for(HINGED, Settings()), rng_of()
    belief, true = filter_.prior(rng), np.radians(degrees)
    evidence = evidence_of(place, "door", read(place, "door", np.array([true]), pose), pose[None])
    errors = []
    for _ in range(8):
        belief = updated(filter_, belief, evidence, rng)
        errors.append(abs(belief.mean[0] - true))
    # half of the resolution; the first scan finds a wide belief and is cast coarsely
    assert np.degrees(np.diff(errors[1:]).max()) < 0.125
    assert np.degrees(errors[0]) < 5.0  # what it shows may stand before a leaf farther open
    assert np.degrees(errors[-1]) < 0.6  # of a closed door, all of the belief is on one side


def test_a_door_hidden_behind_its_jamb_is_known_only_not_to_be_where_it_would_be_seen() -> None:
    place, pose = doorway(), np.array([-1.0, -0.6, 0.3])
    filter_, rng = filter_for(HINGED, Settings()), rng_of()
    belief, true = filter_.prior(rng), np.array([np.pi / 2])
    for _ in range(8):
        scan = read(place, "door", true, pose, rng)
        belief = updated(filter_, belief, evidence_of(place, "door", scan, pose[None]), rng)
    (lower,), (upper,) = belief.interval()
    sight = np.arctan2(1.0 + 0.6, 1.0)  # past the hinge, from where the robot stands
    assert lower > sight - np.radians(5.0)
    assert upper > np.radians(85.0)
    assert not belief.is_certain


@pytest.mark.parametrize("stop", [HINGED.lower, HINGED.upper])
def test_a_door_at_its_stop_is_found_there_within_its_limits(stop: float) -> None:
    place, pose, rng = doorway(), np.array([0.3, -0.5, 0.0]), rng_of(1)
    filter_ = filter_for(HINGED, Settings())
    belief = filter_.prior(rng)
    for _ in range(6):
        scan = read(place, "door", np.array([stop]), pose, rng)
        belief = updated(filter_, belief, evidence_of(place, "door", scan, pose[None]), rng)
    assert np.degrees(abs(belief.mean[0] - stop)) < 1.0
    (lower,), (upper,) = belief.interval()
    half = belief.cell[0] / 2
    assert HINGED.lower - half <= lower <= upper <= HINGED.upper + half


def swinging(speed: float, *, until: float) -> tuple[ObjectFilter, ObjectBelief]:
    """What is believed of a door that was watched at 10 Hz while it opened, from 0.3 rad on, with a speed in rad/s."""
    filter_ = filter_for(HINGED, Settings())
    belief = knows(filter_, np.array([0.3]))
    for k in range(1, round(10 * until) + 1):
        belief = filter_.predict(belief, 0.1, rng_of())
        state = np.array([0.3 + 0.1 * k * speed])
        belief = updated(
            filter_, belief, evidence_by(gaussian_about(state, np.full(1, 0.02))), rng_of()
        )
    return filter_, belief


@pytest.mark.parametrize("speed", [0.3, 0.7])
def test_a_door_that_goes_out_of_sight_while_it_swings_may_swing_on(speed: float) -> None:
    filter_, belief = swinging(speed, until=1.2)
    seen = 0.3 + 1.2 * speed
    (lower,), (upper,) = belief.interval()
    assert lower < seen < upper
    assert upper - lower < 0.3
    for _ in range(30):
        belief = filter_.predict(belief, 0.1, rng_of())
    (lower,), (upper,) = belief.interval()
    assert lower < seen < min(seen + 2.0 * speed, 1.3) < upper


def test_a_door_that_swings_is_known_to_and_one_that_rests_is_not() -> None:
    filter_, belief = swinging(0.7, until=1.0)
    resting = filter_.predict(knows(filter_, np.array([0.3])), 0.1, rng_of())
    for each, least, most in ((belief, 0.5, 1.0), (resting, 0.0, 1e-4)):
        assert ((each.p_moving >= 0.0) & (each.p_moving <= 1.0)).all()
        assert least < each.weights.values @ each.p_moving < most


def test_a_door_that_came_to_rest_in_sight_is_known_out_of_sight() -> None:
    filter_, belief = swinging(0.7, until=1.0)
    for _ in range(30):
        belief = filter_.predict(belief, 0.1, rng_of())
        belief = updated(
            filter_, belief, evidence_by(gaussian_about(np.ones(1), np.full(1, 0.02))), rng_of()
        )
    belief = filter_.predict(belief, 10.0, rng_of())
    (lower,), (upper,) = belief.interval()
    assert upper - lower < np.radians(3.0)


@pytest.mark.parametrize("degrees", [20.0, 47.3, 85.0])
def test_a_door_that_was_moved_while_nobody_looked_is_found_again(degrees: float) -> None:
    place, pose, rng = doorway(), np.array([0.3, -0.6, 0.0]), rng_of(2)
    filter_ = filter_for(HINGED, Settings())
    belief, true = knows(filter_, np.array([0.0])), np.radians(degrees)
    belief = filter_.predict(belief, 60.0, rng)
    for _ in range(6):
        scan = read(place, "door", np.array([true]), pose, rng)
        belief = updated(filter_, belief, evidence_of(place, "door", scan, pose[None]), rng)
        belief = filter_.predict(belief, 0.2, rng)
    assert np.degrees(abs(belief.mean[0] - true)) < 1.0


@pytest.mark.parametrize("offset", [0.0, 0.37, 0.9])
def test_a_sliding_door_is_found(offset: float) -> None:
    place, pose, rng = doorway(SLIDING), np.array([0.3, -0.5, 0.0]), rng_of(1)
    filter_ = filter_for(SLIDING, Settings())
    belief = filter_.prior(rng)
    for _ in range(6):
        scan = read(place, "slide", np.array([offset]), pose, rng)
        belief = updated(filter_, belief, evidence_of(place, "slide", scan, pose[None]), rng)
    assert belief.mean[0] == pytest.approx(offset, abs=0.03)


@pytest.mark.parametrize("angle", [-3.1, 0.0, 2.0, 3.1])
def test_a_leaf_that_turns_all_the_way_round_is_found(angle: float) -> None:
    place, pose, rng = (
        building(enclosure(6.0, 6.0), TURNSTILE),
        np.array([-1.0, -1.0, 0.0]),
        rng_of(),
    )
    filter_ = filter_for(TURNSTILE, Settings())
    belief = filter_.prior(rng)
    for _ in range(8):
        scan = read(place, "turnstile", np.array([angle]), pose, rng)
        belief = updated(filter_, belief, evidence_of(place, "turnstile", scan, pose[None]), rng)
    assert np.degrees(abs(wrap(belief.mean[0] - angle))) < 1.5
    assert np.degrees(belief.std[0]) < 3.0


def test_an_uncertain_robot_leaves_a_door_more_uncertain() -> None:
    place, pose = doorway(), np.array([0.3, -0.5, 0.0])
    filter_ = filter_for(HINGED, Settings())
    prior, scan = filter_.prior(rng_of()), read(place, "door", np.array([0.9]), pose)
    robots = pose + rng_of().normal(0.0, [0.1, 0.1, 0.06], (60, 3))
    sure = updated(filter_, prior, evidence_of(place, "door", scan, pose[None]), rng_of())
    unsure = updated(filter_, prior, evidence_of(place, "door", scan, robots), rng_of())
    assert unsure.std[0] > 1.5 * sure.std[0]
    (lower,), (upper,) = unsure.interval()
    assert lower < 0.9 < upper


def hidden(scan: Scan, share: float) -> Scan:
    """Somebody stands half a metre before the laser, in a share of the beams to the doorway."""
    towards = np.arctan2(scan.rays.directions[:, 1], scan.rays.directions[:, 0])
    left, right = np.radians(110.0), np.radians(40.0)
    person = (towards > right) & (towards < right + share * (left - right))
    return scan_of(np.where(person, np.minimum(scan.ranges, 0.5), scan.ranges), scan.rays)


@pytest.mark.parametrize("degrees", [5.0, 40.0, 75.0])
@pytest.mark.parametrize("share", [0.2, 0.4, 0.6])
def test_a_person_before_a_door_does_not_drag_its_angle(degrees: float, share: float) -> None:
    place, pose, rng = doorway(), np.array([0.3, -0.6, 0.0]), rng_of(3)
    filter_ = filter_for(HINGED, Settings())
    belief, true = filter_.prior(rng), np.radians(degrees)
    for _ in range(8):
        scan = hidden(read(place, "door", np.array([true]), pose, rng), share)
        belief = updated(filter_, belief, evidence_of(place, "door", scan, pose[None]), rng)
    assert np.degrees(abs(belief.mean[0] - true)) < 2.0


def test_a_door_wholly_hidden_by_a_person_is_not_observed() -> None:
    place, pose, rng = doorway(), np.array([0.3, -0.6, 0.0]), rng_of(3)
    filter_ = filter_for(HINGED, Settings())
    belief = filter_.prior(rng)
    scan = read(place, "door", np.array([0.6]), pose)
    hidden_all = scan_of(np.minimum(scan.ranges, 0.3), scan.rays)
    evidence = evidence_of(place, "door", hidden_all, pose[None])
    assert updated(filter_, belief, evidence, rng) is belief


@pytest.mark.parametrize("seed", range(3))
def test_a_table_off_its_place_is_found_within_a_few_scans(seed: int) -> None:
    place, rng = building(enclosure(6.0, 5.0), TABLE), rng_of(seed)
    true = TABLE.home + np.array([0.12, -0.09, np.radians(10.0)])  # 15 cm and 10 degrees off
    filter_ = filter_for(TABLE, Settings())
    belief = filter_.prior(rng)
    for pose in ([-1.0, -0.5, 0.0], [-0.5, -1.0, 0.0], [0.5, -1.2, 0.0], [1.5, -1.2, 0.0]) * 2:
        scan = read(place, "table", true, np.array(pose), rng)
        evidence = evidence_of(place, "table", scan, np.array([pose]))
        belief = updated(filter_, belief, evidence, rng)
    assert np.hypot(*(belief.mean - true)[:2]) < 0.03
    assert np.degrees(abs(wrap(belief.mean[2] - true[2]))) < 2.5


def test_steps_take_in_all_of_a_samples_evidence() -> None:
    """Overwhelming evidence by steps ends where Bayes' rule does at once."""
    filter_ = SampleFilter(TABLE, FurnitureSettings(samples=3000))
    mean, std = TABLE.home + np.array([0.1, -0.1, 0.1]), np.full(3, 0.05)
    told = evidence_by(gaussian_about(mean, std))
    after = updated(filter_, filter_.prior(rng_of()), told, rng_of(1))
    prior_std = np.array([0.2, 0.2, np.radians(15.0)])
    variance = 1.0 / (1.0 / prior_std**2 + 1.0 / std**2)
    expected = variance * (TABLE.home / prior_std**2 + mean / std**2)
    np.testing.assert_allclose(after.mean, expected, atol=0.012)
    np.testing.assert_allclose(after.std, np.sqrt(variance), rtol=0.25)


def test_the_same_generator_gives_the_same_belief() -> None:
    told = evidence_by(gaussian_about(TABLE.home, np.full(3, 0.02)))
    filter_ = filter_for(TABLE, Settings())
    one, two = (updated(filter_, filter_.prior(rng_of(4)), told, rng_of(5)) for _ in range(2))
    np.testing.assert_array_equal(one.states, two.states)
