"""Furniture stands neither in walls nor in other furniture."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from objstate.building.model import Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.config import FurnitureSettings
from objstate.geometry import FloatArray
from objstate.objects.furniture_mixture import NEVER, NOTHING, About, FurnitureMixture, Piece
from objstate.objects.ground import Floor, bodies, collision
from objstate.objects.shape import static_of
from tests.rooms import block, placed, standing, table

WALL = np.array([[-3.0, 2.0, 3.0, 2.0]])  # along x, 2 m up
SMALL = table("chest", 0.0, 0.0, size=(0.6, 0.4))


def among(walls: FloatArray, item: MovableObject = SMALL) -> Piece:
    floor = Floor.of(walls)
    return Piece(item, FurnitureSettings(), lambda: floor)


def possible(
    piece: Piece, places: FloatArray, std: float = 0.02, spread: float = 0.0, others: object = None
) -> FloatArray:
    covariances = np.zeros((len(places), 8, 8))
    covariances[:, [4, 5], [4, 5]] = spread**2
    about = About(np.zeros(3), std, np.empty((0, 6)) if others is None else np.asarray(others))
    return piece.possible(np.asarray(places), covariances, about)


@settings(max_examples=40, deadline=None)
@given(st.floats(-0.5, 0.13), st.floats(-1.0, 1.0))
def test_how_far_a_wall_reaches_in_is_how_improbable_a_place_is(deep: float, x: float) -> None:
    piece = among(WALL)
    (found,) = possible(piece, np.array([[x, 1.8 + deep, 0.0]]))
    least, most = (2.0 * norm.cdf(-max(deep + off, 0.0) / 0.02) for off in (0.006, -0.006))
    assert least - 1e-9 <= found <= most + 1e-9  # in cells of 1 cm


def test_a_wide_component_is_possible_as_far_as_its_gaussian_is() -> None:
    piece, place = among(WALL), np.array([[0.0, 1.75, 0.0]])
    (found,) = possible(piece, place, spread=0.05)
    draws = place + np.random.default_rng(0).standard_normal((20000, 3)) * [0.05, 0.05, 0.0]
    assert found == pytest.approx(possible(piece, draws).mean(), abs=0.1)  # of three points


def test_the_far_side_of_a_turned_piece_may_reach_into_a_wall() -> None:
    along, across = possible(among(WALL), np.array([[0.0, 1.79, 0.0], [0.0, 1.79, np.pi / 2]]))
    assert along > 0.99
    assert across < 1e-3


def test_walls_that_are_drawn_where_a_piece_should_stand_do_not_keep_it_from_there() -> None:
    drawn = np.array([[-0.2, 0.0, 0.2, 0.0]])
    piece = among(np.concatenate([WALL, drawn]))
    assert possible(piece, piece.item.home[None]) == pytest.approx(1.0)
    assert possible(piece, np.array([[0.0, 1.95, 0.0]])) < 1e-3


def test_what_arrives_or_is_unknown_is_where_the_piece_can_stand() -> None:
    item = table("chest", 0.0, 1.75, size=(0.6, 0.4))
    mixture = FurnitureMixture.unknown(among(WALL, item))
    later = mixture.later(1e6, np.eye(3), np.zeros((3, 3)), np.zeros((3, 3)))
    for each in (mixture, later):
        inside = each.places[1:, 1] > 1.95
        assert each.weights[1:][inside].sum() < 0.05  # 0.10 without walls
        assert each.presence == pytest.approx(FurnitureSettings().presence)


def test_nothing_is_proposed_where_the_mixture_has_next_to_nothing() -> None:
    mixture = FurnitureMixture.unknown(among(WALL))
    after = mixture.proposing(np.array([[0.1, 0.1, 0.0], [40.0, 0.0, 0.0]]), 1e-6 * np.eye(3))
    assert len(after.weights) == len(mixture.weights) + 1
    assert after.weights.min() >= NEVER


# --- other furniture ----------------------------------------------------------------


def legged(name: str, width: float, top: float) -> MovableObject:
    """A plate on four legs; its upper side is ``top`` m high."""
    at, tall = width / 2 - 0.02, top - 0.04
    legs = [
        Box((0.04, 0.04, tall)).mesh().moved(placed(x * at, y * at, tall / 2))
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    plate = Box((width, width, 0.04)).mesh().moved(placed(0.0, 0.0, tall + 0.02))
    return standing(name, Mesh.joined([*legs, plate]))


def test_a_chair_stands_under_a_table_but_not_in_a_chair() -> None:
    chair, desk = legged("chair", 0.42, 0.46), legged("desk", 1.2, 0.75)
    assert collision(chair, desk) is not None  # their legs
    piece, here = among(np.empty((0, 4)), chair), np.array([[0.02, 0.0, 0.4]])
    under = bodies(chair, [(desk, np.zeros(3), 1.0)])
    within = bodies(chair, [(legged("other", 0.44, 0.46), np.zeros(3), 0.9)])
    assert possible(piece, here, others=under) == pytest.approx(1.0)
    assert possible(piece, here, others=within) == pytest.approx(0.1, abs=0.01)
    assert possible(piece, here + np.array([0.5, 0.0, 0.0]), others=within) == pytest.approx(1.0)


# --- outlines -----------------------------------------------------------------------


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000))
def test_an_outline_whose_parts_are_off_is_seen_elsewhere_by_as_much_as_stated(seed: int) -> None:
    rng = np.random.default_rng(seed)
    middles = rng.uniform(-0.7, 0.7, (4, 2))
    pillars = Mesh.joined([block(x, y, 0.05, 0.05) for x, y in middles])
    shape = Piece(standing("rack", pillars), FurnitureSettings()).shape(0.3)
    off = 0.01 * rng.standard_normal((4000, 4, 2))
    about = middles - middles.mean(axis=0)
    turned = (about[:, 0] * off[..., 1] - about[:, 1] * off[..., 0]).sum(axis=1)
    turned /= (about**2).sum()
    fitted = np.column_stack([off.mean(axis=1), turned])
    np.testing.assert_allclose(static_of(shape, 0.01), fitted.var(axis=0), rtol=0.15)


def test_a_single_part_has_no_error_of_its_heading() -> None:
    of_x, of_y, of_yaw = static_of(Piece(SMALL, FurnitureSettings()).shape(0.3), 0.01)
    assert of_x == of_y == pytest.approx(0.01**2)
    assert of_yaw == 0.0
    assert NOTHING.static.sum() == 0.0
