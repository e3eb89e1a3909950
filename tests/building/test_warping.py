"""Walls that are bent by displacements of their columns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Mesh
from objstate.building.outline import outline
from objstate.building.shapes import Box
from objstate.building.warping import PIECE, Columns
from objstate.geometry import FloatArray, rotation_about, transform

LENGTH = 5.0  # m


def wall(x: float, y: float, yaw: float, length: float) -> Mesh:
    return (
        Box((length, 0.12, 2.0))
        .mesh()
        .moved(transform(rotation_about((0.0, 0.0, 1.0), yaw), np.array([x, y, 1.0])))
    )


WALLS = Mesh.joined([wall(0.0, 0.0, 0.3, 7.3), wall(3.0, 2.0, 1.2, 1.0)])


def test_faces_are_cut_and_stay_where_they_are() -> None:
    columns = Columns.of(WALLS)
    _, distances = columns.edges
    assert distances.max() <= PIECE
    same = columns.warped(np.zeros((len(columns.places), 2)))
    np.testing.assert_allclose(ends(WALLS), ends(same), atol=1e-6)


def ends(mesh: Mesh) -> FloatArray:
    """The ends of an outline's segments, in order, whatever their directions."""
    pairs = [sorted(map(tuple, segment.round(7).tolist())) for segment in outline(mesh, 0.5)]
    return np.array(sorted(pairs))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.1, 1.9))
def test_faces_tell_where_the_warped_walls_are_cut(seed: int, height: float) -> None:
    columns = Columns.of(WALLS)
    moved = 0.05 * np.random.default_rng(seed).standard_normal((len(columns.places), 2))
    faces, after = columns.faces(height), Columns.of(columns.warped(moved)).faces(height)
    np.testing.assert_allclose(faces.shares.sum(axis=2), 1.0)
    ends = np.sum(faces.shares[..., None] * moved[faces.columns], axis=2).reshape(-1, 4)
    expected = faces.segments + ends
    assert len(after.segments) >= len(expected)  # longer pieces may be cut once more
    corners = after.segments.reshape(-1, 2)
    for corner in expected.reshape(-1, 2):
        assert np.hypot(*(corners - corner).T).min() < 1e-6


@given(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(-0.01, 0.01))
def test_the_motion_of_walls_about_a_place_is_found(x: float, y: float, turn: float) -> None:
    columns, place = Columns.of(WALLS), np.array([1.0, -2.0])
    off = columns.places - place
    moved = np.array([x, y]) + turn * np.column_stack([-off[:, 1], off[:, 0]])
    shift, turned = columns.motion(moved, place)
    np.testing.assert_allclose(shift, [x, y], atol=1e-9)
    assert turned == pytest.approx(turn, abs=1e-9)


def test_walls_move_as_far_as_they_may_and_ends_of_long_ones_apart() -> None:
    columns = Columns.of(WALLS)
    covariance = np.linalg.inv(columns.precision(LENGTH).toarray())
    std = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(std, std)
    distance = np.hypot(*(columns.places[:, None] - columns.places[None]).transpose(2, 0, 1))
    of_short = np.hypot(*(columns.places - [3.0, 2.0]).T) < 0.6
    assert correlation[np.ix_(of_short, of_short)].min() > 0.8
    assert np.abs(correlation[np.ix_(of_short, ~of_short)]).max() < 1e-9
    far = distance > 7.0
    assert far.any()
    assert correlation[far].max() < 0.6
    assert std.min() > 0.9
    assert std.max() < 3.0
