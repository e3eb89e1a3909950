"""A footprint holds the object as often as it says."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Mesh
from objstate.errors import QueryError
from objstate.objects import ObjectBelief
from objstate.objects.footprint import footprint, motions, silhouette
from objstate.particles import Weights
from tests.rooms import block, door, sliding_door, standing, table
from tests.world.examples import at_angle

TABLE = table("table", 2.0, 1.0, yaw=0.5, size=(1.2, 0.6))


def samples(spread: float, seed: int = 0, count: int = 2000) -> ObjectBelief:
    rng = np.random.default_rng(seed)
    states = np.array([2.0, 1.0, 0.5]) + spread * rng.standard_normal((count, 3))
    return ObjectBelief(TABLE, states, Weights.uniform(count), np.zeros(3))


def inside(polygon: np.ndarray, item, states: np.ndarray) -> np.ndarray:
    """(n,) in which states the polygon holds the whole object."""
    corners = shapely.get_coordinates(silhouette(item))
    moved = motions(item, states)
    places = corners @ moved[:, :2, :2].swapaxes(1, 2) + moved[:, None, :2, 3]
    held = shapely.Polygon(polygon).buffer(1e-9)
    shapely.prepare(held)
    return shapely.covers(held, shapely.multipoints(places))


@settings(max_examples=20)
@given(st.floats(0.01, 0.3), st.floats(0.1, 0.99))
def test_it_holds_the_object_with_the_probability(spread: float, share: float) -> None:
    polygon = samples(spread).footprint(share)
    fresh = samples(spread, seed=1).states
    assert inside(polygon, TABLE, samples(spread).states).mean() >= share
    assert inside(polygon, TABLE, fresh).mean() >= share - 0.05


def test_more_probability_takes_more_room() -> None:
    areas = [shapely.Polygon(samples(0.1).footprint(p)).area for p in (0.1, 0.5, 0.9, 1.0)]
    assert areas == sorted(areas)
    assert areas[0] < 0.8 * areas[-1]


def test_of_a_certain_belief_it_is_the_object_itself() -> None:
    certain = ObjectBelief(TABLE, TABLE.home[None], Weights.uniform(1), np.zeros(3))
    polygon = shapely.Polygon(certain.footprint(0.95))
    assert polygon.area == pytest.approx(1.2 * 0.6)
    assert polygon.exterior.is_ccw
    assert polygon.centroid.coords[0] == pytest.approx((2.0, 1.0))


def test_of_a_door_it_is_the_swept_area() -> None:
    polygon = shapely.Polygon(at_angle(0.0, 0, std=2.0).footprint(1.0))
    quarter = [(0.9 * np.cos(a), 0.9 * np.sin(a)) for a in np.linspace(0, np.pi / 2, 50)]
    assert shapely.covers(polygon.buffer(1e-6), shapely.MultiPoint(quarter))
    assert polygon.area < 0.9 * 0.9


def test_a_probability_that_is_none_is_refused() -> None:
    for share in (0.0, -0.1, 1.1, float("nan")):
        with pytest.raises(QueryError, match="above 0 and at most 1"):
            samples(0.1).footprint(share)


def test_a_silhouette_keeps_its_hollows_and_its_sheets() -> None:
    angle = standing("angle", combined_blocks())
    assert silhouette(angle).area == pytest.approx(2 * 0.2 - 0.1 * 0.1, abs=1e-6)
    assert silhouette(sliding_door("s", 1.0, 0.0)).area == pytest.approx(0.9 * 0.04)
    assert len(footprint(door("d", 0, 0), np.array([[0.3]]))) == 4


def combined_blocks() -> Mesh:
    """Two blocks 2 m by 0.1 m at a right angle."""
    return Mesh.joined([block(1.0, 0.05, 2.0, 0.1), block(0.05, 1.0, 0.1, 2.0)])
