"""Laws of furniture: equal headings, and states through readings."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Building, Mesh, MovableObject
from objstate.building.shapes import Box, Cylinder
from objstate.building.symmetry import ROUND, symmetry_of
from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray, between, compose, wrap
from objstate.objects import ObjectBelief
from objstate.objects.proposals import TracedOutline
from objstate.particles import Weights
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.rooms import block, building, enclosure, fan, observed, placed, scan_of, table

SQUARE = table("table", 0.0, 0.0, size=(0.8, 0.8))


def legs(width: float, depth: float) -> Mesh:
    """Four table legs."""
    return Mesh.joined([block(i * width / 2, j * depth / 2, 0.06, 0.06)
                        for i in (-1, 1) for j in (-1, 1)])  # fmt: skip


def prism(count: int, radii: FloatArray) -> Mesh:
    """An upright body of ``count`` sides, its corners at distances (count,) from its middle."""
    turns = 2 * np.pi * np.arange(count) / count
    ring = radii[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    vertices = np.concatenate([np.insert(ring, 2, z, axis=1) for z in (0.0, 0.7)])
    here, after = np.arange(count), (np.arange(count) + 1) % count
    sides = [[here, after, after + count], [here, after + count, here + count]]
    return Mesh(vertices, np.concatenate([np.column_stack(side) for side in sides]))


def room(item: MovableObject) -> Building:
    return building(enclosure(6.0, 6.0), item)


# --- symmetry -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mesh", "order"),
    [
        (legs(0.8, 0.8), 4),
        (legs(1.6, 0.8), 2),
        (Box((1.2, 0.6, 0.7)).mesh(), 2),
        (Mesh.joined([block(0.0, 0.0, 0.4, 0.01), block(0.2, 0.2, 0.01, 0.4)]), 1),
        (Mesh.empty(), 1),
        (prism(6, np.full(6, 0.3)), 6),
        (prism(90, 0.3 + 0.02 * np.cos(4 * np.pi * np.arange(90) / 90)), 2),  # an oval
        (Cylinder(0.25, 0.9).mesh(), ROUND),
        (Mesh.joined([Cylinder(radius, 0.7).mesh().moved(placed(0.0, 0.0, z=z))
                      for radius, z in ((0.5, 1.0), (0.06, 0.4), (0.3, 0.2))]), ROUND),  # of three parts
    ],
)  # fmt: skip
def test_a_shape_looks_the_same_after_as_many_turns_as_it_has_equal_sides(
    mesh: Mesh, order: int
) -> None:
    assert symmetry_of(mesh).order == order
    assert symmetry_of(mesh.moved(placed(0.5, -0.2, 0.0, (0.0, 0.0, 0.3)))).order == order


@settings(max_examples=25)
@given(st.floats(-2, 2), st.floats(-3.1, 3.1), st.floats(-1, 1), st.floats(-3.1, 3.1))
def test_equal_states_put_the_same_shape_at_the_same_place(
    x: float, yaw: float, aside: float, towards: float
) -> None:
    symmetry = symmetry_of(legs(0.8, 0.8).moved(placed(aside, 0.3)))
    state = np.array([[x, 0.5, yaw]])
    corners = np.array([[aside + i, 0.3 + j, 0.0] for i in (-0.4, 0.4) for j in (-0.4, 0.4)])
    near = symmetry.nearest(state, towards)
    assert abs(wrap(near[0, 2] - towards)) <= np.pi / 4 + 1e-6
    for equal in (near[0], *symmetry.equals(state)[:, 0]):
        off = compose(equal, corners)[:, None, :2] - compose(state[0], corners)[None, :, :2]
        np.testing.assert_allclose(np.hypot(*np.moveaxis(off, 2, 0)).min(axis=0), 0.0, atol=1e-3)


def test_a_belief_spread_over_equal_headings_is_sure_of_the_one_nearest_to_home() -> None:
    rng = np.random.default_rng(0)
    yaws = 0.1 + np.pi / 2 * rng.integers(4, size=400) + rng.normal(0.0, 0.02, 400)
    states = np.column_stack([rng.normal(0.0, 0.01, (400, 2)), wrap(yaws)])
    belief = ObjectBelief(SQUARE, states, Weights.uniform(400), cell=np.zeros(3))
    assert belief.mean[2] == pytest.approx(0.1, abs=0.01)
    assert belief.std[2] == pytest.approx(0.02, rel=0.2)
    lower, upper = belief.interval()
    assert lower[2] < 0.1 < upper[2] < 0.2
    whole = belief.unfolded()
    for heading in 0.1 + np.pi / 2 * np.arange(4):
        near = np.abs(wrap(whole.states[:, 2] - heading)) < 0.2
        assert whole.weights.values[near].sum() == pytest.approx(0.25)


def test_a_heading_between_two_equal_ones_is_not_torn_apart() -> None:
    yaws = np.pi / 4 + np.linspace(-0.05, 0.05, 101)
    folded = SQUARE.symmetry.nearest(np.column_stack([np.zeros((101, 2)), yaws]), 0.0)
    belief = ObjectBelief(SQUARE, folded, Weights.uniform(101), cell=np.zeros(3))
    assert belief.std[2] == pytest.approx(0.03, rel=0.05)
    assert abs(wrap(4.0 * (belief.mean[2] - np.pi / 4))) < 1e-6


# --- where readings show it ---------------------------------------------------------


@settings(max_examples=20)
@given(st.floats(-2, 2), st.floats(-3, 3), st.integers(0, 1000))
def test_states_through_readings_of_an_object_come_near_its_state(
    x: float, yaw: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    side = np.array([[[-0.4, -0.2], [0.4, -0.2]], [[0.4, -0.2], [0.4, 0.2]]])
    traced = TracedOutline.of(side)
    assert traced is not None
    true = np.array([x, 0.3, yaw])
    on = traced.points[rng.integers(len(traced.points), size=30)]
    ends = compose(true, np.column_stack([on, np.zeros(30)]))[:, :2]
    states, explained = traced.states_through(ends + rng.normal(0, 0.01, ends.shape), 400, rng)
    best = states[np.argmax(explained)]
    assert explained.max() == 30
    assert np.hypot(*(best - true)[:2]) < 0.12
    assert abs(wrap(best[2] - yaw)) < 0.35


def test_a_view_says_where_something_stopped_its_beams() -> None:
    place, pose = room(SQUARE), np.array([-2.0, 0.3, 0.4])
    state = {SQUARE.name: np.array([0.5, 0.2, 0.3])}
    level, tilted = (
        fan(181, 2 * np.pi, mount=placed(0.0, 0.0, 0.3, (0.0, tilt, 0.0))) for tilt in (0.0, 1e-4)
    )
    scan = observed(ExpectedRanges(place), state, pose, level)
    for rays in (level, tilted):
        view = Sensing(place, BeamModel(BeamModelSettings())).view(scan_of(scan.ranges, rays))
        ends = view.stopped_short(pose, view.walls(pose[None])[0])
        own = between(state[SQUARE.name], np.column_stack([ends[:, :2], np.zeros(len(ends))]))
        assert len(ends) > 5
        np.testing.assert_allclose(np.abs(own[:, :2]).max(axis=1), 0.4, atol=1e-3)
        np.testing.assert_allclose(ends[:, 2], 0.3, atol=1e-3)
