"""What a scan tells, by outlines and by triangles: the same likelihoods."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Mesh
from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray
from objstate.records import Scan
from objstate.sensing import (
    Around,
    BeamModel,
    Comparison,
    ExpectedRanges,
    ScanView,
    Sensing,
    UncertainObject,
)
from objstate.sensing.level_view import LevelView
from objstate.sensing.mesh_view import MeshView
from tests.rooms import (
    block,
    building,
    door,
    enclosure,
    fan,
    observed,
    placed,
    scan_of,
    sliding_door,
    table,
)

ROOM = building(
    Mesh.joined([enclosure(9.0, 7.0), block(2.0, 1.5, 0.5, 0.5, 0.4)]),
    door("door", -1.0, 2.0, 0.3),
    sliding_door("slide", 0.5, -2.0, 0.2),
    table("table", -2.0, 0.5, 0.4),
)
EXPECTED = ExpectedRanges(ROOM)
TRUE_STATES = {
    "door": np.array([0.6]),
    "slide": np.array([0.3]),
    "table": np.array([-2.0, 0.4, 0.5]),
}
ROBOT = np.array([0.5, 0.1, 0.3])
BEAM_MODEL = BeamModel(BeamModelSettings())
RANGE_MAX = 6.0  # m
BEAMS = 361
RAYS = fan(BEAMS, 2 * np.pi)


def noisy_scan(seed: int) -> Scan:
    """Readings with noise, some short, some missing, some discarded."""
    rng = np.random.default_rng(seed)
    scan = observed(EXPECTED, TRUE_STATES, ROBOT, RAYS, rng, 0.03, RANGE_MAX)
    ranges = scan.ranges.copy()
    ranges[rng.integers(0, BEAMS, 20)] *= rng.uniform(0.1, 1.0, 20)
    ranges[rng.integers(0, BEAMS, 10)] = np.inf
    ranges[rng.integers(0, BEAMS, 10)] = np.nan
    return scan_of(ranges, RAYS, range_max=RANGE_MAX)


def both_views(scan: Scan, model: BeamModel = BEAM_MODEL) -> tuple[LevelView, MeshView]:
    level = Sensing(ROOM, model).view(scan)
    assert isinstance(level, LevelView)
    chosen = scan.rays.take(scan.valid)
    return level, MeshView(EXPECTED, chosen, scan.ranges[scan.valid], model, scan.range_max)


def near_robots(seed: int, count: int = 6) -> FloatArray:
    return ROBOT + np.random.default_rng(seed).normal(0.0, [0.1, 0.1, 0.05], (count, 3))


def states_of(name: str, rng: np.random.Generator) -> FloatArray:
    if name == "table":
        return TRUE_STATES[name] + rng.normal(0.0, 0.2, (5, 3))
    return rng.uniform(0.0, ROOM[name].upper, (5, 1))


MODELS = [
    BEAM_MODEL,
    BeamModel(BeamModelSettings(model="gaussian", sigma_hit=0.4)),
    BeamModel(BeamModelSettings(sigma_hit=0.1, lambda_short=0.1, z_max=0.2)),
    BeamModel(BeamModelSettings(), run=1.0),
]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("model", MODELS)
def test_both_views_tell_the_same_of_an_object(seed: int, model: BeamModel) -> None:
    level, mesh = both_views(noisy_scan(seed), model)
    robots, rng = near_robots(seed), np.random.default_rng(seed)
    for name in ROOM.objects:
        states = states_of(name, rng)
        told = Comparison(mesh.walls(robots), in_runs=seed % 2 == 0)
        found, bears = level.object_log_likelihood(name, states, robots, told)
        exact, bears_exactly = mesh.object_log_likelihood(name, states, robots, told)
        np.testing.assert_allclose(found, exact, atol=0.02, rtol=1e-3)
        np.testing.assert_array_equal(bears, bears_exactly)


@pytest.mark.parametrize("view", range(2))
def test_groups_of_poses_are_weighed_as_each_alone_with_what_their_beams_may_reach(
    view: int,
) -> None:
    seen = both_views(noisy_scan(view))[view]
    rng, groups = np.random.default_rng(view), [near_robots(k) for k in range(3)]
    groups[2] = groups[2] + np.array([-2.0, 1.0, 2.0])
    objects = tuple(
        UncertainObject(name, states_of(name, rng), np.full(5, 0.2)) for name in ROOM.objects
    )
    anywhere = np.tile([0.0, 0.0, 20.0], (len(objects), 1))
    nowhere = np.tile([100.0, 0.0, 1.0], (len(objects), 1))
    for circles, met in ((anywhere, objects), (nowhere, ())):
        found = seen.nearby_log_likelihood(np.array(groups), 0.02, Around(objects, circles))
        alone = [seen.pose_log_likelihood(group, 0.02, met) for group in groups]
        np.testing.assert_allclose(found, alone, atol=1e-9)
        single = seen.nearby_log_likelihood(groups[0][:, None], 0.02, Around(objects, circles))
        np.testing.assert_allclose(single[:, 0], alone[0], atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("model", MODELS)
def test_both_views_find_as_many_beams_explained(seed: int, model: BeamModel) -> None:
    level, mesh = both_views(noisy_scan(seed), model)
    pose, rng = near_robots(seed, 1)[0], np.random.default_rng(seed)
    background = mesh.walls(pose[None])[0]
    for name, true in TRUE_STATES.items():
        states, some = states_of(name, rng), rng.random(len(background)) < 0.7
        for each in (states[:0], states, true[None]):
            told = name, each, pose, background, some
            assert level.share_explained(*told) == pytest.approx(mesh.share_explained(*told))


def test_where_an_object_stands_its_beams_are_explained_and_where_not_they_are_not() -> None:
    level, mesh = both_views(noisy_scan(0))
    background = mesh.walls(ROBOT[None])[0]
    for name, true in TRUE_STATES.items():
        bears = mesh.object(name, true[None], ROBOT[None])[0, 0] < background
        told = ROBOT, background, bears
        assert level.share_explained(name, true[None], *told) > 0.7
        assert level.share_explained(name, true[None][:0], *told) < 0.3


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("blur", [0.0, 0.1])
def test_both_views_tell_the_same_of_the_robot(seed: int, model: BeamModel, blur: float) -> None:
    level, mesh = both_views(noisy_scan(seed), model)
    rng = np.random.default_rng(seed)
    uncertain = [
        UncertainObject(name, states_of(name, rng), rng.dirichlet(np.ones(5)))
        for name in ROOM.objects
    ]
    robots = near_robots(seed)
    for objects in ([], uncertain[:1], uncertain):
        found = level.pose_log_likelihood(robots, blur, objects)
        exact = mesh.pose_log_likelihood(robots, blur, objects)
        np.testing.assert_allclose(found, exact, atol=0.05, rtol=1e-3)


@pytest.mark.parametrize("blur", [0.0, 0.1])
def test_both_views_tell_the_same_where_many_readings_are_at_the_gaussians_floor(
    blur: float,
) -> None:
    """Products of densities stay floats even there."""
    level, mesh = both_views(
        noisy_scan(0), BeamModel(BeamModelSettings(model="gaussian", sigma_hit=0.01))
    )
    robots = near_robots(0)
    known = [UncertainObject(k, v[None], np.ones(1)) for k, v in TRUE_STATES.items()]
    for objects in ([], known):
        found = level.pose_log_likelihood(robots, blur, objects)
        exact = mesh.pose_log_likelihood(robots, blur, objects)
        assert (found < -1000.0).all()
        np.testing.assert_allclose(found, exact, rtol=1e-4)
    background, states = mesh.walls(robots), np.linspace(0.0, 1.5, 30)[:, None]
    found, _ = level.object_log_likelihood("door", states, robots, Comparison(background))
    exact, _ = mesh.object_log_likelihood("door", states, robots, Comparison(background))
    np.testing.assert_allclose(found, exact, rtol=1e-3, atol=2.0)


def views() -> list[ScanView]:
    return list(both_views(noisy_scan(0)))


@pytest.mark.parametrize("view", views(), ids=["level", "mesh"])
def test_beams_that_do_not_touch_an_object_tell_nothing_of_it(view: ScanView) -> None:
    behind = np.array([[40.0, 0.0, 0.0]])  # outside, behind the wall
    robots = near_robots(0)
    change, bears = view.object_log_likelihood(
        "table", behind, robots, Comparison(view.walls(robots))
    )
    assert not change.any()
    assert not bears.any()


@pytest.mark.parametrize("kind", [0, 1], ids=["level", "mesh"])
def test_beams_beside_an_object_change_nothing_where_each_is_stopped_by_itself(kind: int) -> None:
    """The beams that bear on the object tell all that the whole scan tells."""
    view = both_views(noisy_scan(0), BeamModel(BeamModelSettings(), run=1.0))[kind]
    robots, states = near_robots(0), np.array([TRUE_STATES["table"], [-2.1, 0.3, 0.4]])
    background = view.walls(robots)
    whole, bears = view.object_log_likelihood("table", states, robots, Comparison(background))
    touching = np.isfinite(view.object("table", states, robots)).any(axis=(0, 1))
    part, _ = view.take(touching).object_log_likelihood(
        "table", states, robots, Comparison(background[:, touching])
    )
    assert 0 < touching.sum() < len(touching) / 2
    assert not bears[~touching].any()
    np.testing.assert_allclose(part, whole, atol=1e-9)


@pytest.mark.parametrize("view", views(), ids=["level", "mesh"])
def test_an_object_hidden_by_its_background_tells_nothing(view: ScanView) -> None:
    robots = near_robots(0)
    close = np.full_like(view.walls(robots), 0.2)
    change, bears = view.object_log_likelihood(
        "table", TRUE_STATES["table"][None], robots, Comparison(close)
    )
    assert not change.any()
    assert not bears.any()


def test_a_robot_elsewhere_explains_a_scan_worse_than_the_true_one() -> None:
    scan = observed(EXPECTED, TRUE_STATES, ROBOT, RAYS, range_max=RANGE_MAX)
    known = [UncertainObject(k, v[None], np.ones(1)) for k, v in TRUE_STATES.items()]
    robots = ROBOT + np.array(
        [[0, 0, 0], [0.1, 0, 0], [-0.1, 0, 0], [0, 0.1, 0], [0, -0.1, 0], [0, 0, 0.05]]
    )
    for view in both_views(scan):
        log_likelihood = view.pose_log_likelihood(robots, 0.0, known)
        assert (log_likelihood[1:] < log_likelihood[0] - 5.0).all()


def test_the_true_state_explains_a_scan_best() -> None:
    scan = observed(EXPECTED, TRUE_STATES, ROBOT, RAYS, range_max=RANGE_MAX)
    angles = np.linspace(0.0, 1.5, 61)[:, None]
    for view in both_views(scan):
        change, _ = view.object_log_likelihood(
            "door", angles, ROBOT[None], Comparison(view.walls(ROBOT[None]))
        )
        assert angles[change[0].argmax(), 0] == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize("view", views(), ids=["level", "mesh"])
def test_uncertain_objects_are_averaged_over(view: ScanView) -> None:
    """Two states in equal shares tell as much of one beam as the mean of their likelihoods."""
    robots = near_robots(1, 3)
    angles, none = np.array([[0.2], [1.2]]), np.zeros((2, 3))
    count = view.walls(robots).shape[1]
    for beam in range(0, count, 7):
        one = view.take(np.arange(count) == beam)
        each = [
            one.pose_log_likelihood(robots, 0.0, [UncertainObject("door", a[None], np.ones(1))])
            for a in angles
        ]
        both = one.pose_log_likelihood(
            robots, 0.0, [UncertainObject("door", angles, np.array([0.5, 0.5]))]
        )
        none = np.log(np.exp(each).mean(axis=0))
        np.testing.assert_allclose(both, none, atol=1e-9)


def test_discarded_beams_are_no_part_of_a_view() -> None:
    scan = noisy_scan(2)
    view = Sensing(ROOM, BEAM_MODEL).view(scan)
    assert view.walls(ROBOT[None]).shape == (1, int(scan.valid.sum()))
    some = np.zeros(BEAMS, dtype=bool)
    some[10:20] = True
    chosen = Sensing(ROOM, BEAM_MODEL).view(scan, some)
    assert chosen.walls(ROBOT[None]).shape == (1, int((some & scan.valid).sum()))


@pytest.mark.parametrize("view", views(), ids=["level", "mesh"])
def test_taking_beams_keeps_the_order(view: ScanView) -> None:
    kept = np.random.default_rng(0).random(view.walls(ROBOT[None]).shape[1]) < 0.4
    np.testing.assert_allclose(
        view.take(kept).walls(ROBOT[None]), view.walls(ROBOT[None])[:, kept], atol=1e-6
    )


@pytest.mark.parametrize("kind", [0, 1])
def test_parts_of_a_part_are_parts_though_beams_were_discarded(kind: int) -> None:
    scan, rng = noisy_scan(2), np.random.default_rng(1)
    whole = both_views(scan, BEAM_MODEL)[kind]
    some = rng.random(int(scan.valid.sum())) < 0.6
    fewer = rng.random(int(some.sum())) < 0.6
    both = some.copy()
    both[some] = fewer
    part, robots = whole.take(some).take(fewer), near_robots(0)
    assert len(scan) > scan.valid.sum()
    np.testing.assert_allclose(
        part.pose_log_likelihood(robots, 0.0, []),
        whole.take(both).pose_log_likelihood(robots, 0.0, []),
    )
    np.testing.assert_allclose(part.walls(robots), whole.walls(robots)[:, both], atol=1e-6)


def test_tilted_lasers_and_hatches_are_cast_against_triangles() -> None:
    tilted = fan(30, mount=placed(0.0, 0.0, 0.3, (0.0, 0.1, 0.0)))
    scan = scan_of(np.ones(30), tilted)
    assert isinstance(Sensing(ROOM, BEAM_MODEL).view(scan), MeshView)
    level = scan_of(np.ones(30), fan(30))
    assert isinstance(Sensing(ROOM, BEAM_MODEL).view(level), LevelView)
