"""What a level laser sees of a mesh is what its outline shows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building import outline
from objstate.building.model import Mesh
from objstate.building.shapes import Box, Cylinder, Sphere
from objstate.geometry import FloatArray, rotation_from_rpy, transform
from objstate.sensing.embree import EmbreeCaster

TOLERANCE = 1e-4  # m

metres = st.floats(-20.0, 20.0)
sizes = st.floats(0.05, 5.0)
turns = st.floats(-np.pi, np.pi)


def cast_to_segments(segments: FloatArray, origin: FloatArray, bearings: FloatArray) -> FloatArray:
    """Distance along each bearing to the nearest segment: Cramer's rule, ray by ray."""
    nearest = np.full(len(bearings), np.inf)
    for index, bearing in enumerate(bearings):
        d = np.array([np.cos(bearing), np.sin(bearing)])
        for start, end in segments:
            e, w = end - start, start - origin
            cross = d[0] * e[1] - d[1] * e[0]
            if abs(cross) < 1e-12:
                continue
            along = (w[0] * e[1] - w[1] * e[0]) / cross
            on = (w[0] * d[1] - w[1] * d[0]) / cross
            if along >= 0 and -1e-9 <= on <= 1 + 1e-9:
                nearest[index] = min(nearest[index], along)
    return nearest


def level_casts(mesh: Mesh, height: float, origin: FloatArray, bearings: FloatArray) -> FloatArray:
    directions = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))])
    origins = np.tile(np.append(origin, height), (len(bearings), 1))
    return EmbreeCaster(mesh).distances(origins, directions)


def assert_same_ranges(
    mesh: Mesh, height: float, segments: FloatArray, seed: int, beams: int = 60
) -> None:
    """Equal within 0.1 mm, but for beams that graze: there a neighbour decides otherwise."""
    rng = np.random.default_rng(seed)
    origin, bearings = rng.uniform(-8, 8, 2), rng.uniform(-np.pi, np.pi, beams)
    exact = level_casts(mesh, height, origin, bearings)
    sides = [level_casts(mesh, height, origin, bearings + turn) for turn in (-1e-6, 1e-6)]
    drawn = cast_to_segments(segments, origin, bearings)
    with np.errstate(invalid="ignore"):
        steady = (np.isinf(exact) & np.isinf(sides[0]) & np.isinf(sides[1])) | (
            (np.abs(sides[0] - exact) < 1e-3) & (np.abs(sides[1] - exact) < 1e-3)
        )
    np.testing.assert_allclose(drawn[steady], exact[steady], rtol=0, atol=TOLERANCE)
    assert steady.mean() > 0.5


@settings(max_examples=40)
@given(st.tuples(sizes, sizes, sizes), st.tuples(metres, metres), st.tuples(turns, turns, turns))
def test_casting_the_outline_of_a_tilted_box_equals_casting_the_box(
    size: tuple[float, ...], place: tuple[float, float], rpy: tuple[float, float, float]
) -> None:
    matrix = transform(rotation_from_rpy(*rpy), np.array([place[0] / 4, place[1] / 4, 0.013]))
    box = Box(size).mesh()
    assert_same_ranges(box.moved(matrix), 0.0, outline(box, 0.0, matrix), seed=1)


@pytest.mark.parametrize("seed", range(4))
def test_casting_the_outline_of_a_furnished_room_equals_casting_its_mesh(seed: int) -> None:
    rng = np.random.default_rng(seed)
    parts = [Box((16.0, 0.2, 2.5)).mesh().moved(_pose(0, side, 1.25, 0)) for side in (-5, 5)]
    for _ in range(6):
        x, y, yaw = rng.uniform([-6, -4, -3], [6, 4, 3])
        shape = rng.choice(np.array(["box", "cylinder", "sphere"]))
        made = {
            "box": Box((0.8, 0.5, 1.0)),
            "cylinder": Cylinder(0.3, 1.0),
            "sphere": Sphere(0.6),
        }[str(shape)]
        parts.append(made.mesh().moved(_pose(x, y, 0.4, yaw)))
    room = Mesh.joined(parts)
    assert_same_ranges(room, 0.3, outline(room, 0.3), seed=seed, beams=90)


@given(st.tuples(sizes, sizes, sizes), metres, metres, turns)
@settings(max_examples=60)
def test_an_upright_box_has_four_sides_of_its_own_lengths(
    size: tuple[float, float, float], x: float, y: float, yaw: float
) -> None:
    sides = outline(Box(size).mesh(), 0.1 * size[2], _pose(x, y, 0, yaw))
    lengths = np.sort(np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1))
    np.testing.assert_allclose(lengths, np.sort([*size[:2], *size[:2]]), atol=1e-9)


@given(turns, turns)
@settings(max_examples=60)
def test_a_plane_through_the_very_top_still_cuts_the_whole_box(yaw: float, shift: float) -> None:
    sides = outline(Box((0.9, 0.04, 0.6)).mesh(), 0.3, _pose(shift, 1.0, 0.0, yaw))
    assert np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1).sum() == pytest.approx(1.88)


def test_a_plane_through_the_very_bottom_or_beside_cuts_nothing() -> None:
    box = Box((1.0, 1.0, 1.0)).mesh()
    assert outline(box, -0.5).shape == (0, 2, 2)
    assert outline(box, 0.6).shape == (0, 2, 2)
    assert outline(Mesh.empty(), 0.0).shape == (0, 2, 2)


def test_walls_that_touch_end_to_end_become_one_and_shared_faces_count_once() -> None:
    left = Box((2.0, 0.2, 2.0)).mesh().moved(_pose(0, 0, 0, 0))
    right = Box((2.0, 0.2, 2.0)).mesh().moved(_pose(2, 0, 0, 0))
    joined = outline(Mesh.joined([left, right]), 0.0)
    assert len(joined) == 5  # two long sides, two ends, and the face they share
    again = outline(Mesh.joined([left, right, left]), 0.0)
    np.testing.assert_allclose(np.sort(again.ravel()), np.sort(joined.ravel()), atol=1e-9)


def test_a_round_column_is_as_round_as_a_laser_can_tell() -> None:
    ring = outline(Cylinder(0.5, 2.0).mesh(), 0.0)
    middles = ring.mean(axis=1)
    assert np.linalg.norm(middles, axis=1).min() > 0.499
    assert np.linalg.norm(ring, axis=2).max() < 0.5 + 1e-9


def _pose(x: float, y: float, z: float, yaw: float) -> FloatArray:
    return transform(rotation_from_rpy(0, 0, yaw), np.array([x, y, z]))
