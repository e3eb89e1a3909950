"""A door's posterior as a Gaussian mixture: laws, and doors that are found by exact ranges."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Mesh, MovableObject
from objstate.building.outline import outline
from objstate.config import BuildingErrorSettings, DoorSettings, Rest
from objstate.geometry import FloatArray, transform_from_pose
from objstate.lazy import altered
from objstate.objects import mixture as mixtures
from objstate.objects.doors import LatticeFilter
from objstate.objects.mixture import PACES, DoorMixture, Doorway, Statics, static_precisions
from objstate.objects.mixture_kernels import (
    ERRORS,
    FLAT,
    GLASS,
    HANDLE,
    OBSERVED,
    STATE,
    THICKNESS,
    Beams,
    Noise,
    Shape,
    condition,
)
from objstate.objects.shape import shape_of
from objstate.sensing import ExpectedRanges, cast_from
from objstate.sensing.surfaces import Surfaces
from tests.rooms import building, door, fan, sliding_door, wall

LASER = "laser"
RANGE_MAX = 8.0
SIGMA = 0.02
ERROR = BuildingErrorSettings(bearing_std_deg=0.1)
KNOWN = np.diag([1e-6, 1e-6, 1e-8])  # covariance of a robot that knows where it is
POSE = np.array([0.2, -1.5, 1.2])
STATICS = Statics(0.01**2, math.radians(0.1) ** 2)

WIDE_STATICS = Statics(0.03**2, math.radians(3.0) ** 2)

ANEW = np.zeros((3, 3)), KNOWN  # another error of the robot


def leaf() -> MovableObject:
    return door("door", 0.0, 0.0)


@cache
def doorway() -> Doorway:
    return Doorway(leaf(), DoorSettings(), ERROR)


def noise(independence: float = 1.0, in_scan: float | None = None) -> Noise:
    return Noise(
        0.8,
        0.15 / RANGE_MAX,
        0.05,
        SIGMA**2,
        0.0,
        0.0,
        RANGE_MAX,
        0.05,
        0.9,
        0.5,
        0.1,
        independence,
        independence if in_scan is None else in_scan,
        0.1,
    )


def shape(item: MovableObject, *, may_have_handle: bool = False) -> Shape:
    home = item.transforms(item.home[None])[0]
    segments = outline(item.mesh.moved(home), 0.3).reshape(-1, 4) - np.tile(item.hinge, 2)
    way = doorway()
    return shape_of(segments, way.turn, way.slide, is_leaf=may_have_handle)


def read(
    angle: float,
    hinge: FloatArray | None = None,
    rng: np.random.Generator | None = None,
    pose: FloatArray = POSE,
    thickness: float = 0.04,
) -> Beams:
    """What a laser reads of a door that stands alone, at an angle, perhaps hung elsewhere."""
    true, rays = door("door", 0.0, 0.0, thickness=thickness), fan(121)
    if hinge is not None:
        true = true.hung_at(true.hinge + hinge)
    place = building(Mesh.empty(), true)
    ranges = ExpectedRanges(place).scene({"door": np.array([angle])}, pose[None], rays)[0]
    if rng is not None:
        ranges = ranges + SIGMA * rng.standard_normal(len(ranges))
    origins, directions = cast_from(transform_from_pose(pose), rays)
    nothing = np.full(len(rays), np.inf)
    return Beams(
        pose[:2].copy(),
        np.ascontiguousarray(origins[:, :2]),
        np.ascontiguousarray(directions[:, :2]),
        np.where(ranges > RANGE_MAX, np.inf, ranges),
        nothing,
        np.zeros(len(rays)),
        np.zeros((len(rays), 2)),
        np.zeros(len(rays)),
    )


def after(beams: list[Beams], mixture: DoorMixture | None = None) -> DoorMixture:
    mixture = mixture or DoorMixture.unknown(doorway(), STATICS)
    for each in beams:
        mixture, _ = mixture.later(0.1, *ANEW).given(LASER, each, noise(), shape(leaf()))
    return mixture


def belief(mixture: DoorMixture) -> tuple[float, float]:
    """Mean and standard deviation of the angle, deg."""
    lattice = LatticeFilter(leaf(), DoorSettings(resolution_deg=0.05)).prior(
        np.random.default_rng()
    )
    found = mixture.on_lattice(lattice)
    return math.degrees(found.mean[0]), math.degrees(found.std[0])


def probability(mixture: DoorMixture, kind: int) -> float:
    """Of a handle or of glass."""
    return float(mixture.weights @ mixture.kinds[: len(mixture.weights), kind])


@pytest.mark.parametrize("angle", [5.0, 20.0, 41.3, 66.6, 80.0])
def test_exact_ranges_find_a_door(angle: float) -> None:
    mean, std = belief(after([read(math.radians(angle))] * 3))
    assert mean == pytest.approx(angle, abs=0.25)
    assert std < 1.0


def test_a_door_that_is_closed_is_told_from_one_that_is_ajar() -> None:
    closed, ajar = after([read(0.0)] * 5), after([read(math.radians(3.0))] * 5)
    first = doorway().cells
    assert closed.weights[first] > 0.9
    assert ajar.weights[first] < 0.05


@pytest.mark.parametrize("pose", [(-1.5, -0.3, 0.15), (3.0, -0.4, 3.0)], ids=["hinge", "edge"])
@pytest.mark.parametrize("seed", range(2))
def test_a_robot_that_drives_away_goes_on_believing_that_a_door_is_ajar(
    pose: tuple[float, float, float], seed: int
) -> None:
    """Few beams meet the leaf from afar, and what they meet hasn't changed."""
    rng, mixture, latched = np.random.default_rng(seed), None, 0.0
    angle = math.radians(2.5)
    for _ in range(20):
        mixture = after([read(angle, rng=rng)], mixture)
    for _ in range(40):
        mixture = after([read(angle, rng=rng, pose=np.array(pose))], mixture)
        latched = max(latched, float(mixture.weights[doorway().cells]))
    assert latched < 0.01


@pytest.mark.parametrize(
    ("pose", "angle"), [((0.2, -1.5, 1.2), 0.0), ((0.2, -2.0, 1.3), 0.0), ((1.0, -1.2, 1.8), 60.0)]
)
def test_the_beams_beside_an_edge_tell_once_where_it_is(
    pose: tuple[float, float, float], angle: float
) -> None:
    """A robot that stands sees the edge between the same two beams in each scan."""
    mixture = DoorMixture.unknown(doorway(), Statics(0.03**2, STATICS.bearing))
    rng, still = np.random.default_rng(0), (np.eye(3), np.zeros((3, 3)))
    for _ in range(60):
        beams = read(math.radians(angle), rng=rng, pose=np.array(pose))
        mixture, _ = mixture.later(0.1, *still).given(LASER, beams, noise(), shape(leaf()))
    offset, covariance = mixture.hinge
    assert offset @ np.linalg.solve(covariance, offset) < 9.2  # 99 % of chi squared, 2 degrees


def test_a_leaf_that_hangs_elsewhere_is_found_at_its_angle_and_its_hinge() -> None:
    angle, off, rng = math.radians(35.0), np.array([0.02, -0.03]), np.random.default_rng(0)
    mixture = DoorMixture.unknown(doorway(), Statics(0.03**2, math.radians(0.1) ** 2))
    mixture = after([read(angle, off, rng) for _ in range(20)], mixture)
    mean, _ = belief(mixture)
    assert mean == pytest.approx(35.0, abs=0.7)
    across = np.array([-math.sin(angle), math.cos(angle)])
    hinge, covariance = mixture.hinge
    std = math.sqrt(across @ covariance @ across)
    assert across @ hinge == pytest.approx(across @ off, abs=3.0 * std + 0.003)
    assert std < 0.01


@pytest.mark.parametrize("thickness", [0.02, 0.04, 0.07])
def test_a_leaf_seen_from_both_sides_tells_its_thickness(thickness: float) -> None:
    angle, behind, rng = math.radians(40.0), np.array([0.2, 1.6, -1.3]), np.random.default_rng(1)
    mixture = DoorMixture.unknown(doorway(), STATICS)
    for pose in (POSE, behind, POSE, behind):
        for _ in range(8):
            beams = read(angle, rng=rng, pose=pose, thickness=thickness)
            own = shape(leaf(), may_have_handle=True)
            mixture, _ = mixture.later(0.1, *ANEW).given(LASER, beams, noise(), own)
    best = int(np.argmax(mixture.weights))
    std = math.sqrt(mixture.covariances[best, THICKNESS, THICKNESS])
    assert std < 0.004
    assert mixture.means[best, THICKNESS] == pytest.approx(thickness - 0.04, abs=3.0 * std + 0.002)
    assert np.hypot(*mixture.hinge[0]) < 0.01
    assert belief(mixture)[0] == pytest.approx(40.0, abs=0.5)


@settings(max_examples=25, deadline=None)
@given(
    angle=st.floats(0.0, 1.5),
    seconds=st.floats(0.0, 1e5),
    kept=st.floats(0.0, 1.0),
    seed=st.integers(0, 10),
)
def test_a_mixture_stays_one(angle: float, seconds: float, kept: float, seed: int) -> None:
    mixture = after([read(angle, rng=np.random.default_rng(seed))])
    later = mixture.later(seconds, kept * np.eye(3), (1.0 - kept**2) * KNOWN)
    for each in (mixture, later):
        assert each.weights.sum() == pytest.approx(1.0)
        assert (each.resting >= 0.0).all()
        assert (each.moving >= 0.0).all()
        assert np.isfinite(each.means).all()
        assert (np.linalg.eigvalsh(each.covariances) > -1e-12).all()


def test_a_door_that_nobody_looks_at_for_long_may_be_where_doors_rest() -> None:
    mixture = after([read(math.radians(35.0))] * 3).later(1e7, *ANEW)
    np.testing.assert_allclose(mixture.weights, doorway().rest, atol=0.02)


def closed_between_walls(
    begins: float, ends: float, *, pose: FloatArray = POSE, face: float = -0.05
) -> Beams:
    """A closed leaf behind the faces of walls on both sides, of which the model has the opening.

    It is modelled from 0 to 0.9 m along the walls, and is truly where it ``begins`` and ``ends``.
    """
    alone = read(0.0, pose=pose)
    facing, slope = alone.directions[:, 1] > 0.0, alone.directions[:, 1]
    walls, leaves = (
        np.where(facing, (y - alone.origins[:, 1]) / slope, np.inf) for y in (face, -0.02)
    )
    along = alone.origins[:, 0] + np.where(facing, walls, 0.0) * alone.directions[:, 0]
    opening = (along > 0.0) & (along < 0.9)
    truly_opening = (along > begins) & (along < ends)
    read_there = np.where(truly_opening, leaves, walls)
    return alone._replace(
        measured=np.where(read_there > RANGE_MAX, np.inf, read_there),
        background=np.where(opening | (walls > RANGE_MAX), np.inf, walls),
        blur=np.full(len(walls), 0.01**2),
    )


@pytest.mark.parametrize("aside", [-0.02, 0.0, 0.02])
def test_where_an_opening_ends_tells_nothing_of_the_closed_leaf_behind(aside: float) -> None:
    beams, std = closed_between_walls(aside, 0.9 + aside), 0.03
    mixture = DoorMixture.unknown(doorway(), Statics(std**2, math.radians(0.1) ** 2))
    mixture = after([beams] * 30, mixture)
    assert mixture.weights[doorway().cells] > 0.8
    offset, covariance = mixture.hinge
    assert math.sqrt(covariance[0, 0]) > 0.9 * std
    assert abs(offset[0]) < 0.5 * std
    assert math.sqrt(covariance[1, 1]) < 0.1 * std


@pytest.mark.parametrize("slides", [False, True])
def test_the_other_leaf_of_a_closed_double_door_is_no_part_of_a_leaf(slides: bool) -> None:
    """All that is known of the other one is that every other such leaf is closed."""
    if slides:
        mine, other = sliding_door("door", 0.9, 0.0, math.pi), sliding_door("other", 0.91, 0.0)
    else:
        mine, other = door("door", 0.0, 0.0), door("other", 1.81, 0.0, math.pi)
    way, rng = Doorway(mine, DoorSettings(), ERROR), np.random.default_rng(0)
    walls = Mesh.joined([wall((-2.0, 0.0), (-0.01, 0.0)), wall((1.82, 0.0), (4.0, 0.0))])
    scene, bare = ExpectedRanges(building(walls, mine, other)), ExpectedRanges(building(walls))
    beside = ExpectedRanges(building(walls, other))
    seen = shape_of(
        (outline(mine.mesh.moved(mine.transforms(mine.home[None])[0]), 0.3) - mine.hinge).reshape(
            -1, 4
        ),
        way.turn,
        way.slide,
    )
    mixture = DoorMixture.unknown(way, Statics(0.05**2, STATICS.bearing))
    closed, precise = {"door": np.zeros(1), "other": np.zeros(1)}, noise()._replace(variance=1e-4)
    for x in np.arange(-1.5, 3.0, 0.15):
        pose, rays = np.array([[x, -1.0, 1.57]]), fan(361)
        ranges, background = scene.scene(closed, pose, rays)[0], bare.walls(pose, rays)[0]
        to_other = beside.scene({"other": np.zeros(1)}, pose, rays)[0]
        measured = ranges + 0.01 * rng.standard_normal(len(ranges))
        behind = np.minimum(to_other, RANGE_MAX)
        off = np.where(to_other < background, measured - behind, np.inf)
        origins, directions = cast_from(transform_from_pose(pose[0]), rays)
        beams = Beams(
            pose[0, :2].copy(),
            np.ascontiguousarray(origins[:, :2]),
            np.ascontiguousarray(directions[:, :2]),
            measured,
            background,
            np.full(len(ranges), 1e-4),
            np.zeros((len(ranges), 2)),
            0.5 * np.exp(-0.5 * (off / 0.01) ** 2) / (0.01 * math.sqrt(2.0 * math.pi)),
        )
        mixture, _ = mixture.later(0.1, *ANEW).given(LASER, beams, precise, seen)
    # one that slides may be open by some millimetres, as its rail is known to 5 cm
    assert mixture.weights[way.cells] > (0.85 if slides else 0.9)
    assert abs(mixture.hinge[0][0]) < 0.01


@pytest.mark.parametrize(("pose", "lip"), [((-2.4, -0.85, 0.3), 0.1), ((-2.0, -0.6, 0.3), 0.05)])
def test_a_frame_before_a_closed_leaf_tells_nothing_of_the_leaf(
    pose: tuple[float, float, float], lip: float
) -> None:
    """One beam, which grazes the wall, meets a frame that the model lacks."""
    beams = closed_between_walls(lip, 0.9, pose=np.array(pose), face=-0.09)
    mixture = DoorMixture.unknown(doorway(), Statics(0.03**2, math.radians(0.1) ** 2))
    precise = noise()._replace(variance=0.01**2)
    for _ in range(10):
        mixture, _ = mixture.later(0.1, *ANEW).given(LASER, beams, precise, shape(leaf()))
    assert mixture.resting[doorway().cells] > 0.9


def test_no_door_latches_where_nothing_stops_it() -> None:
    """The door swings for a second somewhere near its upper limit."""
    latched = []
    for rest in (Rest(), Rest(open=0.0)):
        way = Doorway(leaf(), DoorSettings(rest=rest), ERROR)
        mixture = DoorMixture.unknown(way, STATICS)
        moving = np.full(len(way.states), 1e-9)
        moving[way.cells - 1] = 1.0
        mixture = mixture.weighed(np.full(len(way.states), 1e-9), moving)
        latched.append(mixture.later(1.0, *ANEW).resting[way.cells :])
    (at_zero, at_stop), (still_at_zero, nowhere) = latched
    assert at_stop > 0.01
    assert nowhere < 1e-8
    assert math.isclose(at_zero, still_at_zero, rel_tol=1e-6)


@pytest.mark.parametrize("pose", [(-2.4, -0.85, 0.3), (-1.2, -0.4, 0.3)])
def test_beams_that_meet_wall_and_leaf_at_once_tilt_no_closed_leaf(
    pose: tuple[float, float, float],
) -> None:
    """Half of the beams at the edge read something between both; the robot drives past."""
    std, closed = 0.01, []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        mixture = DoorMixture.unknown(doorway(), Statics(0.03**2, math.radians(0.1) ** 2))
        for k in range(25):
            at = np.add(pose, (0.02 * k, 0.0, 0.0))
            beams, wall = (
                closed_between_walls(begins, 0.9, pose=at, face=-0.09) for begins in (0.0, 0.4)
            )
            of_leaf = np.isinf(beams.background) & np.isfinite(beams.measured)
            edge = np.argmin(np.where(of_leaf, beams.measured, np.inf))
            measured = beams.measured + std * rng.standard_normal(len(beams.measured))
            share = rng.random()
            if rng.random() < 0.5:
                measured[edge] = share * beams.measured[edge] + (1.0 - share) * wall.measured[edge]
            mixture, _ = mixture.later(0.1, *ANEW).given(
                LASER,
                beams._replace(measured=measured),
                noise()._replace(variance=std**2),
                shape(leaf()),
            )
        closed.append(mixture.resting[doorway().cells])
    assert np.mean(closed) > 0.9


def log_evidence_of_closed(beams: Beams) -> float:
    """Log p(scan) of a closed leaf that is exactly where the model has it."""
    log, closed = np.zeros(1), doorway().placements[doorway().cells][None]
    condition(
        beams,
        shape(leaf()),
        noise(),
        np.ones(len(beams.measured)),
        np.ones(len(beams.measured)),
        np.zeros(1, dtype=bool),
        closed,
        np.ones(1),
        FLAT,
        np.zeros((1, ERRORS)),
        1e-10 * np.eye(ERRORS)[None],
        np.full((1, 2), 1e-3),
        log,
    )
    return float(log[0])


def conditioned(
    beams: Beams, component: int, mean: FloatArray, covariance: FloatArray, times: float = 1.0
) -> tuple[FloatArray, FloatArray, float]:
    """Mean, covariance and log evidence of a component of a scan that was met so many times."""
    count, way = len(beams.measured), doorway()
    means, covariances, log = mean[None].copy(), covariance[None].copy(), np.zeros(1)
    condition(
        beams,
        shape(leaf()),
        noise(),
        np.ones(count),
        np.full(count, times),
        np.zeros(1, dtype=bool),
        way.placements[component][None],
        np.ones(1),
        static_precisions(way, WIDE_STATICS),
        means,
        covariances,
        np.full((1, 2), 1e-3),
        log,
    )
    return means[0], covariances[0], float(log[0])


@given(
    st.integers(0, 10**6), st.floats(0.05, 0.25), st.integers(1, 40), st.sampled_from([1.0, 10.0])
)
@settings(max_examples=60, deadline=None)
def test_no_step_makes_the_errors_less_probable(
    seed: int, before: float, many: int, times: float
) -> None:
    """Something that the model lacks stands before the leaf, in some beams of the scan."""
    rng = np.random.default_rng(seed)
    beams, way = read(rng.uniform(0.0, 1.5), rng=rng), doorway()
    first = int(rng.integers(len(beams.measured) - many))
    measured = beams.measured.copy()
    measured[first : first + many] -= before
    beams = beams._replace(measured=measured)
    prior = DoorMixture.unknown(way, WIDE_STATICS)
    component = int(rng.integers(way.cells))
    mean, covariance = prior.means[component], prior.covariances[component]
    mode = conditioned(beams, component, mean, covariance, times)[0]
    at_mean = conditioned(beams, component, mean, 1e-12 * np.eye(ERRORS), times)[2]
    at_mode = conditioned(beams, component, mode, 1e-12 * np.eye(ERRORS), times)[2]
    off, known = (mode - mean)[STATE:OBSERVED], covariance[STATE:OBSERVED, STATE:OBSERVED]
    paid = 0.5 * float(off @ np.linalg.solve(known, off))
    # the last step and edges aren't checked: some beams that just pass an edge cost 5 each
    assert at_mode - paid / times > at_mean - 15.0


def test_a_beam_past_a_jamb_may_meet_a_casing_in_line_with_it() -> None:
    """The first beam passes a doorway's jamb, the second meets it, the third the wall beside it."""
    alone, ends = read(0.0), np.array([[0.95, 0.03], [0.95, -0.05], [1.1, -0.1]])
    gone = ends - POSE[:2]
    ranges = np.hypot(*gone.T)
    evidence = []
    for before in (0.0, 0.3):
        beams = Beams(
            alone.place,
            np.tile(POSE[:2], (3, 1)),
            gone / ranges[:, None],
            ranges - np.array([before, 0.0, 0.0]),
            np.array([4.0, *ranges[1:]]),
            np.zeros(3),
            np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 1.0]]),
            np.zeros(3),
        )
        evidence.append(log_evidence_of_closed(beams))
    assert evidence[0] > evidence[1] + 1.0


def towards(begin: FloatArray, points: FloatArray, measured: FloatArray, far: FloatArray) -> Beams:
    """Beams from a place to points, of some measured and expected ranges."""
    gone, count = points - begin, len(points)
    return Beams(
        begin,
        np.tile(begin, (count, 1)),
        gone / np.hypot(*gone.T)[:, None],
        measured,
        far,
        np.zeros(count),
        np.zeros((count, 2)),
        np.zeros(count),
    )


def log_evidence(beams: Beams, times: FloatArray, state: float | None) -> float:
    """Log p(scan | state) of readings that were met so many times; None: there is no leaf."""
    turn = np.full((1, 3), np.nan) if state is None else np.array([[0.0, 0.0, state]])
    log = np.zeros(1)
    condition(
        beams,
        shape(leaf()),
        noise(),
        np.ones(len(times)),
        times,
        np.zeros(1, dtype=bool),
        turn,
        np.ones(1),
        FLAT,
        np.zeros((1, ERRORS)),
        1e-10 * np.eye(ERRORS)[None],
        np.full((1, 2), 1e-3),
        log,
    )
    return float(log[0])


def test_a_beam_that_passes_a_jamb_and_the_leaf_behind_it_shows_that_there_is_none() -> None:
    """The wall beside the opening begins 3 cm farther on than modelled."""
    begin, jamb = np.array([-2.0, -0.7]), np.array([[-0.015, -0.1], [0.03, -0.1]])
    at_leaf = np.hypot(*(jamb - begin).T) * 0.68 / 0.6
    background = np.array([np.hypot(*(jamb[0] - begin)), 5.0])
    past, stopped = (
        towards(begin, jamb, np.array([first, at_leaf[1]]), background)
        for first in (5.0, at_leaf[0])
    )
    anew = np.ones(2)
    assert log_evidence(stopped, anew, 0.0) > log_evidence(past, anew, 0.0) + 1.0
    assert log_evidence(past, anew, None) > log_evidence(stopped, anew, None) + 1.0


@pytest.mark.parametrize("measured", [2.5, 4.0])
def test_a_thing_may_stand_behind_a_jamb(measured: float) -> None:
    """Two beams end on it: one passes a wall that is shorter than modelled, one the opening."""
    begin, jamb = np.array([-2.0, -0.7]), np.array([[-0.015, -0.1], [0.03, -0.1]])
    background = np.array([np.hypot(*(jamb[0] - begin)), 5.0])
    both = towards(begin, jamb, np.full(2, measured), background)
    one = towards(begin, jamb[1:], np.full(1, measured), background[1:])
    by_chance = math.log(noise().random) + log_evidence(one, np.ones(1), None)
    # at most 2.6 where nothing can stand behind a wall
    assert log_evidence(both, np.ones(2), None) > by_chance + 2.7


def box_before_an_open_door(steps: FloatArray) -> Beams:
    """Beams on a box, of which the first ends where a closed leaf would stop it by chance."""
    begin = np.array([-2.0, -0.7])
    points = np.column_stack([np.linspace(0.2, 0.6, len(steps)), np.full(len(steps), -0.02)])
    ranges = np.hypot(*(points - begin).T)
    return towards(begin, points, ranges[0] - steps, np.full(len(steps), 5.0))


def test_a_thing_that_was_met_before_does_not_begin_again() -> None:
    """Another piece of a box comes into view, in the plane of the closed leaf."""
    beams = box_before_an_open_door(np.array([0.0, 0.04, 0.08, 0.12, 0.16]))
    known = np.array([1.0, 20.0, 20.0, 20.0, 20.0])
    assert log_evidence(beams, known, 0.0) - log_evidence(beams, known, None) < 2.0


def test_a_thing_that_was_met_before_ends_where_it_did() -> None:
    begin = np.array([-2.0, -0.7])
    points = np.column_stack([np.linspace(0.2, 0.7, 6), np.zeros(6)])
    thing, known = np.array([1.5] * 5 + [5.0]), np.array([20.0] * 5 + [1.0])
    wall_behind = log_evidence(towards(begin, points, thing, np.full(6, 5.0)), known, None)
    nothing = log_evidence(
        towards(begin, points[-1:], thing[-1:], np.full(1, 5.0)), known[-1:], None
    )
    assert wall_behind == pytest.approx(nothing, abs=0.5)


def test_an_oblique_wall_behind_a_leaf_is_not_before_it() -> None:
    """One beam beside the wall before a closed leaf passes to the wall behind it."""
    alone, x = read(0.0), np.array([0.4, 0.42, 0.44, 0.46])
    gone = np.column_stack([x, np.zeros(4)]) - POSE[:2]
    leaf_range = np.hypot(*gone.T)
    directions = gone / leaf_range[:, None]
    evidence = []
    for steps in (0.0, 0.2):
        behind = 1.0 / (1.0 / 3.0 - np.arange(-1, 3) * (1.0 / 3.0 - 1.0 / (3.0 + steps)))
        background = np.where(np.arange(4) == 0, 1.0, behind)
        measured = np.array([1.0, 3.0, leaf_range[2], leaf_range[3]])
        along = background[2] * directions[2] - background[1] * directions[1]
        normals = np.tile(np.array([-along[1], along[0]]) / np.hypot(*along), (4, 1))
        beams = Beams(
            alone.place,
            np.tile(POSE[:2], (4, 1)),
            directions,
            measured,
            background,
            np.zeros(4),
            normals * (np.arange(4) > 0)[:, None],
            np.zeros(4),
        )
        evidence.append(log_evidence_of_closed(beams))
    assert evidence[1] == pytest.approx(evidence[0], abs=0.1)


def test_ends_of_a_leaf_that_stands_free_tell_where_it_hangs_along_it() -> None:
    angle, std = math.radians(35.0), 0.03
    mixture = DoorMixture.unknown(doorway(), Statics(std**2, math.radians(0.1) ** 2))
    mixture = after([read(angle)] * 10, mixture)
    along = np.array([math.cos(angle), math.sin(angle)])
    offset, covariance = mixture.hinge
    assert math.sqrt(along @ covariance @ along) < 0.2 * std
    assert abs(along @ offset) < 0.01


@pytest.mark.parametrize("mixed", [2.1, 2.2])
def test_a_beam_that_meets_a_person_and_the_wall_behind_tells_little_of_a_leaf(
    mixed: float,
) -> None:
    """A person stands before a doorway; one beam beside him reads something between."""
    nothing = read(0.0)
    along = np.where(nothing.directions[:, 1] > 0.2, nothing.directions[:, 1], np.nan)
    wall = np.nan_to_num((1.2 - nothing.origins[:, 1]) / along, nan=np.inf)
    wall[wall > RANGE_MAX] = np.inf
    readings = wall.copy()
    readings[72:97] = 0.6
    blended = readings.copy()
    blended[71] = mixed
    without, told = (
        np.log(after([nothing._replace(measured=each, background=wall)]).weights)
        for each in (readings, blended)
    )
    out_of_view = len(told) - 1
    gained = told - told[out_of_view] - (without - without[out_of_view])
    assert gained.max() < 7.5


def test_a_beam_that_may_have_met_another_door_tells_little_of_this_one() -> None:
    """One beam reads the closed leaf, or that of another door whose state isn't known."""
    closed = read(0.0)
    one = np.flatnonzero(np.isfinite(closed.measured))[10:11]
    alone = Beams(closed.place, *(each[one] for each in closed[1:]))
    alone = alone._replace(background=np.full(1, 3.0))
    told = []
    for density in (0.0, 10.0):
        mixture = after([alone._replace(others=np.full(1, density))])
        gained = np.log(mixture.weights) - np.log(doorway().prior)
        told.append(gained.max() - gained.min())
    assert told[0] > 5.0
    assert told[1] < 1.5


def test_what_is_known_of_a_hinge_outlasts_a_move() -> None:
    off, rng = np.array([0.0, -0.03]), np.random.default_rng(1)
    mixture = DoorMixture.unknown(doorway(), Statics(0.03**2, math.radians(0.1) ** 2))
    mixture = after([read(math.radians(35.0), off, rng) for _ in range(20)], mixture)
    before = mixture.hinge[1]
    moved = after(
        [read(math.radians(80.0), off, rng) for _ in range(10)], mixture.later(600.0, *ANEW)
    )
    assert belief(moved)[0] == pytest.approx(80.0, abs=0.7)
    assert np.trace(moved.hinge[1]) < 1.5 * np.trace(before)


def test_a_handle_pulls_the_angle_less_where_a_leaf_may_have_one() -> None:
    """Some beams end 5 cm before the leaf, near its free edge."""
    angle = math.radians(20.0)
    plain, rng = read(angle), np.random.default_rng(3)
    ends = plain.origins + plain.measured[:, None] * plain.directions - leaf().hinge
    away = np.hypot(ends[:, 0], ends[:, 1])
    width = away[np.isfinite(away)].max()
    on_it = np.isfinite(plain.measured) & (away > width - 0.18) & (away < width - 0.04)
    assert on_it.sum() >= 2
    measured = np.where(on_it, plain.measured - 0.05, plain.measured)
    off = []
    for form in (shape(leaf()), shape(leaf(), may_have_handle=True)):
        mixture = DoorMixture.unknown(doorway(), STATICS)
        for _ in range(20):
            noisy = measured + SIGMA * rng.standard_normal(len(measured))
            mixture, _ = mixture.later(0.1, *ANEW).given(
                LASER, plain._replace(measured=noisy), noise(), form
            )
        off.append(abs(belief(mixture)[0] - 20.0))
    assert off[1] < 0.8 * off[0]
    assert probability(mixture, HANDLE) > 0.9


def test_a_leaf_that_never_stops_beams_early_has_no_handle() -> None:
    beams, rng = read(math.radians(20.0)), np.random.default_rng(4)
    mixture, outline = DoorMixture.unknown(doorway(), STATICS), shape(leaf(), may_have_handle=True)
    for _ in range(20):
        noisy = beams.measured + SIGMA * rng.standard_normal(len(beams.measured))
        mixture, _ = mixture.later(0.1, *ANEW).given(
            LASER, beams._replace(measured=noisy), noise(), outline
        )
    assert probability(mixture, HANDLE) < 0.1


@pytest.mark.parametrize("angle", [0.0, 25.0, 60.0])
@pytest.mark.parametrize(("passing", "is_glass"), [(0.33, True), (0.0, False)])
def test_a_leaf_of_glass_is_told_from_an_open_door(
    angle: float, passing: float, is_glass: bool
) -> None:
    """A third of the beams that would end on the leaf end on a wall behind."""
    solid, rng = read(math.radians(angle)), np.random.default_rng(5)
    mixture = DoorMixture.unknown(doorway(), STATICS)
    behind = np.full(len(solid.measured), 5.0)
    for _ in range(20):
        passed = rng.random(len(behind)) < passing
        noisy = np.where(passed, behind, np.minimum(solid.measured, behind))
        noisy = noisy + SIGMA * rng.standard_normal(len(behind))
        beams = solid._replace(measured=noisy, background=behind, blur=np.full(len(behind), 1e-4))
        mixture, _ = mixture.later(0.1, *ANEW).given(LASER, beams, noise(), shape(leaf()))
    assert belief(mixture)[0] == pytest.approx(angle, abs=0.3)
    assert (probability(mixture, GLASS) > 0.9) == is_glass
    assert (probability(mixture, GLASS) < 0.01) != is_glass
    if angle == 0.0:
        assert mixture.weights[doorway().zero] > 0.9


def test_a_leaf_nowhere_explains_beams_as_one_that_is_far_away_does() -> None:
    beams, out = read(math.radians(40.0)), list[float]()
    for place in ([np.nan] * 3, [0.0, 50.0, 0.0]):
        placements = np.array([doorway().placements[3], place])
        means, covariances = np.zeros((2, ERRORS)), np.tile(1e-6 * np.eye(ERRORS), (2, 1, 1))
        ones, log = np.ones(len(beams.measured)), np.full(2, -np.inf)
        kinds, arrived = np.full((2, 2), 0.1), np.zeros(2, dtype=bool)
        condition(
            beams,
            shape(leaf()),
            noise(),
            ones,
            ones,
            arrived,
            placements,
            np.array([0.5, 0.5]),
            FLAT,
            means,
            covariances,
            kinds,
            log,
        )
        out.append(float(log[1]))
    assert np.isfinite(out[0])
    assert out[0] == pytest.approx(out[1], abs=1e-9)


@pytest.mark.parametrize("angle", [None, 0.0, 40.0, 80.0])
def test_a_leaf_that_beams_meet_is_told_from_none(angle: float | None) -> None:
    nothing = read(0.0)._replace(measured=np.full(121, np.inf))
    beams = nothing if angle is None else read(math.radians(angle))
    unmet = after([beams] * 10).unmet
    assert unmet > 0.99 if angle is None else unmet < 1e-6


def test_errors_that_go_together_tell_less() -> None:
    beams = read(math.radians(35.0))
    start = DoorMixture.unknown(doorway(), STATICS)
    free, _ = start.given(LASER, beams, noise(), shape(leaf()))
    bound, _ = start.given(LASER, beams, noise(0.1), shape(leaf()))
    assert belief(bound)[1] > belief(free)[1]


def test_errors_that_repeat_from_scan_to_scan_count_once_in_the_evidence() -> None:
    """How often a surface was met is in the evidence already."""
    closed = []
    for each in (noise(), noise(0.05, 1.0), noise(0.05)):
        mixture = DoorMixture.unknown(doorway(), STATICS).later(0.1, *ANEW)
        closed.append(mixture.given(LASER, read(0.0), each, shape(leaf()))[0])
    independent, repeating, dependent = (float(each.weights[doorway().cells]) for each in closed)
    assert repeating == pytest.approx(independent, abs=0.05)
    assert dependent < independent - 0.1


def test_no_beam_reaches_a_door_behind_something() -> None:
    beams = read(math.radians(35.0))
    hidden = beams._replace(measured=np.full_like(beams.measured, 0.5))
    start = DoorMixture.unknown(doorway(), STATICS)
    assert start.given(LASER, beams, noise(), shape(leaf()))[1] > 10
    assert start.given(LASER, hidden, noise(), shape(leaf()))[1] == 0


def test_a_belief_on_a_lattice_makes_a_mixture_and_comes_back() -> None:
    lattice = LatticeFilter(leaf(), DoorSettings()).prior(np.random.default_rng())
    found = altered(after([read(math.radians(35.0))] * 3), stamp_ns=0).on_lattice(lattice)
    again = DoorMixture.of(doorway(), found, STATICS)
    assert math.degrees(again.on_lattice(lattice).mean[0]) == pytest.approx(35.0, abs=1.5)


def test_a_door_that_is_next_to_surely_at_a_limit_has_a_belief() -> None:
    lattice = LatticeFilter(leaf(), DoorSettings()).prior(np.random.default_rng())
    mixture = DoorMixture.unknown(doorway(), STATICS)
    resting = np.full(len(mixture.resting), 1e-14)
    resting[-1] = 1.0 - resting[:-1].sum()
    found = altered(mixture, resting=resting, stamp_ns=0).on_lattice(lattice)
    assert found.weights.values[-1] == pytest.approx(1.0)
    assert np.isfinite(found.p_moving).all()


def test_pieces_of_wall_are_short_and_together_the_wall() -> None:
    walls = np.array([[0.0, 0.0, 7.0, 0.0], [7.0, 0.0, 7.0, 1.0]])
    pieces = Surfaces(walls).pieces
    lengths = np.hypot(*(pieces[:, 2:] - pieces[:, :2]).T)
    assert lengths.max() <= 2.0
    assert lengths.sum() == pytest.approx(8.0)


def test_a_moved_door_forgets_a_hinge_that_no_longer_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a box beside it, say, had made of its hinge."""
    rng, errors = np.random.default_rng(8), {}
    for forgets in (1e-9, mixtures.FORGETS):
        monkeypatch.setattr(mixtures, "FORGETS", forgets)
        misled = after([read(math.radians(20.0), np.array([0.06, 0.05]), rng) for _ in range(8)])
        moved = misled.later(600.0, *ANEW)
        assert moved.arrived.any()
        moved, _ = moved.given(LASER, read(math.radians(60.0)), noise(), shape(leaf()))
        errors[forgets] = abs(belief(moved)[0] - 60.0)
    assert errors[mixtures.FORGETS] < 0.5
    assert errors[1e-9] > 2.0 * errors[mixtures.FORGETS]


def seen_each_minute(angles: list[float]) -> DoorMixture:
    """A door after scans a minute apart, in which it stands at angles in degrees."""
    mixture = DoorMixture.unknown(doorway(), STATICS).among(np.full(len(PACES), 1 / len(PACES)))
    for angle in angles:
        beams = read(math.radians(angle))
        mixture, _ = mixture.later(60.0, *ANEW).given(LASER, beams, noise(), shape(leaf()))
    return mixture


def test_a_door_that_stands_still_is_moved_seldom() -> None:
    log = seen_each_minute([35.0] * 20).log_paces
    assert (np.diff(log[2:]) < -1.0).all()  # from 8 an hour on; 20 minutes don't tell fewer apart


def test_a_door_that_is_found_elsewhere_each_time_is_moved_often() -> None:
    mixture = seen_each_minute([35.0, 70.0] * 5)
    assert (np.diff(mixture.log_paces[:4]) > 1.0).all()
    assert mixture.posterior_paces @ PACES * DoorSettings().dynamics.moves_per_hour > 20.0


def test_weights_are_those_of_all_paces_by_their_probabilities() -> None:
    mixture = seen_each_minute([35.0, 70.0])
    each = [mixture.among(alone) for alone in np.eye(len(PACES))]
    shares = mixture.posterior_paces
    resting = sum(share * other.resting for share, other in zip(shares, each, strict=True))
    assert resting == pytest.approx(mixture.resting, abs=1e-12)
    assert mixture.weights.sum() == pytest.approx(1.0)


def test_a_handle_of_another_depth_is_one_from_the_side_too() -> None:
    """2 instead of 5.5 cm deep: seen along the leaf, its ranges are 9 cm off."""
    plain, rng = read(0.0, pose=np.array([-0.4, -0.5, 0.4])), np.random.default_rng(5)
    ends = plain.origins + plain.measured[:, None] * plain.directions - leaf().hinge
    on_it = np.isfinite(plain.measured) & (ends[:, 0] > 0.72) & (ends[:, 0] < 0.86)
    slant = np.abs(plain.directions[:, 1])  # of a leaf that is closed along x
    assert on_it.sum() == 2
    measured = np.where(on_it, plain.measured - 0.02 / slant, plain.measured)
    measured += 0.01 * rng.standard_normal(len(measured))
    precise, outline = noise()._replace(variance=0.01**2), shape(leaf(), may_have_handle=True)
    mixture, _ = (
        DoorMixture.unknown(doorway(), STATICS)
        .later(0.1, *ANEW)
        .given(LASER, plain._replace(measured=measured), precise, outline)
    )
    assert probability(mixture, HANDLE) > 0.85
