"""An object that may stand off its place: the average over shifts."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Mesh, MovableObject
from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray
from objstate.particles import Weights
from objstate.records import Scan
from objstate.sensing import BeamModel, Comparison, ExpectedRanges, ScanView, Sensing
from objstate.sensing.mesh_view import MeshView
from tests.rooms import building, door, enclosure, fan, observed, scan_of

ROOM = building(Mesh.joined([enclosure(9.0, 7.0)]), door("door", -0.5, 2.0))
EXPECTED = ExpectedRanges(ROOM)
ROBOT = np.array([0.1, 0.3, 1.4])
RAYS = fan(241, 1.2 * np.pi)
NEARLY_GAUSSIAN = BeamModelSettings(z_hit=1.0, z_short=0.0, z_max=1e-9, z_rand=0.001)
ANGLES = np.radians([[0.0], [8.0], [20.0]])
STD = 0.02  # m of the shifts
TEMPERING = 0.4


def scan_of_door(angle: float, off: float = 0.0, noise: float = 0.02) -> Scan:
    """What is read of a leaf at ``angle`` rad whose hinge is ``off`` m along y."""
    moved = building(ROOM.walls, door("door", -0.5, 2.0 + off))
    rng = np.random.default_rng(0)
    state = {"door": np.array([angle])}
    return observed(ExpectedRanges(moved), state, ROBOT, RAYS, rng, noise)


def both_views(scan: Scan, settings: BeamModelSettings = NEARLY_GAUSSIAN) -> list[ScanView]:
    model = BeamModel(settings)
    chosen = scan.rays.take(scan.valid)
    mesh = MeshView(EXPECTED, chosen, scan.ranges[scan.valid], model, scan.range_max)
    return [Sensing(ROOM, model).view(scan), mesh]


def normals_of(angles: FloatArray) -> FloatArray:
    """(s, 2) across the leaf; closed, it lies along x."""
    return np.column_stack([-np.sin(angles[:, 0]), np.cos(angles[:, 0])])


def shifted(item: MovableObject, by: FloatArray) -> MovableObject:
    """The object with its hinge moved by (2,) m."""
    x, y = item.origin[:2, 3] + by
    return door(item.name, float(x), float(y))


def integrated(scan: Scan, settings: BeamModelSettings, std: float) -> FloatArray:
    """Log of the mean tempered likelihood (s,) over Gaussian shifts, by many casts."""
    steps = np.linspace(-4.0, 4.0, 81)
    weights = Weights.of(np.exp(-0.5 * steps**2)).log
    out = []
    for angle, normal in zip(ANGLES, normals_of(ANGLES), strict=True):
        logs = []
        for step in steps:
            room = building(ROOM.walls, shifted(ROOM["door"], step * std * normal))
            view = Sensing(room, BeamModel(settings)).view(scan)
            told = Comparison(view.walls(ROBOT[None]), TEMPERING)
            change, _ = view.object_log_likelihood("door", angle[None], ROBOT[None], told)
            logs.append(change[0, 0])
        out.append(np.logaddexp.reduce(weights + np.array(logs)))
    return np.array(out)


def averaged(view: ScanView, poses: FloatArray = ROBOT[None], **said: object) -> FloatArray:
    told = Comparison(
        view.walls(poses), TEMPERING, shift_std=STD, normals=normals_of(ANGLES), **said
    )
    change, _ = view.object_log_likelihood("door", ANGLES, poses, told)
    return change


@pytest.mark.parametrize(("angle", "off"), [(8.0, 0.0), (8.0, 0.02), (10.0, -0.03)])
def test_the_closed_form_is_the_integral_over_shifts(angle: float, off: float) -> None:
    """But for the jambs of the doorway, which a shift uncovers: beams there are few."""
    scan = scan_of_door(np.radians(angle), off)
    exact = integrated(scan, NEARLY_GAUSSIAN, STD)
    for view in both_views(scan):
        found = averaged(view)[0]
        assert found[1] == pytest.approx(exact[1], abs=1.0)
        assert found[1] - found[2] == pytest.approx(exact[1] - exact[2], rel=0.25, abs=1.0)


def test_both_views_average_alike() -> None:
    poses = ROBOT + np.random.default_rng(0).normal(0.0, 0.02, (5, 3))
    for settings in (NEARLY_GAUSSIAN, BeamModelSettings()):
        level, mesh = both_views(scan_of_door(0.15, 0.02), settings)
        np.testing.assert_allclose(averaged(level, poses), averaged(mesh, poses), atol=0.05)


def test_a_shift_of_nothing_changes_nothing() -> None:
    for view in both_views(scan_of_door(0.15)):
        background = view.walls(ROBOT[None])
        plain = Comparison(background, TEMPERING)
        still = Comparison(background, TEMPERING, shift_std=0.0, normals=normals_of(ANGLES))
        one, two = (
            view.object_log_likelihood("door", ANGLES, ROBOT[None], each)[0]
            for each in (plain, still)
        )
        np.testing.assert_array_equal(one, two)


def test_beams_along_the_surface_say_nothing_of_a_shift() -> None:
    """The closed leaf is seen from its end: the average is the likelihood itself, and a number."""
    pose = np.array([-2.0, 2.0, 0.0])
    scan = scan_of(np.array([1.5]), fan(1, 0.0))
    for view in both_views(scan):
        background = view.walls(pose[None])
        plain = Comparison(background, TEMPERING)
        across = Comparison(background, TEMPERING, STD, np.array([[0.0, 1.0]]))
        one, two = (
            view.object_log_likelihood("door", ANGLES[:1], pose[None], each)[0]
            for each in (plain, across)
        )
        assert (one != 0.0).all()
        np.testing.assert_allclose(one, two, atol=1e-9)


def test_where_the_hinge_may_be_off_other_angles_stay_likelier() -> None:
    """A leaf that reads 2 cm off speaks less against its neighbours' angles."""
    view = both_views(scan_of_door(np.radians(8.0), 0.02))[0]
    plain = Comparison(view.walls(ROBOT[None]), TEMPERING)
    known, _ = view.object_log_likelihood("door", ANGLES, ROBOT[None], plain)
    unknown = averaged(view)
    assert np.ptp(unknown) < np.ptp(known)
