"""Where a camera that pans and tilts looks: particles, and the best of all views."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.errors import GridError, SettingsError
from objstate.gaze.field import FocusGazer, PanTilt
from objstate.grid import Layout

LAYOUT = Layout(0.05, 120, 120, np.array([-3.0, -3.0, 0.0]))
CAMERA = PanTilt(0.5, math.radians(60.0), math.radians(45.0), reach=2.5)
ROBOT = np.array([0.3, -0.2, 0.7])
AHEAD = np.array([1.0, 0.4])


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random(LAYOUT.shape, dtype=np.float32)


def blob(place: np.ndarray, radius: float = 0.3) -> np.ndarray:
    off = LAYOUT.centres() - place
    return (np.hypot(off[..., 0], off[..., 1]) < radius).astype(np.float32)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@given(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0))
def test_weights_are_shares_alike_to_both_sides(x: float, y: float) -> None:
    focus = np.array([1.0, 0.0])
    points = np.array([[x, y], [x, -y]])
    left, right = CAMERA.weights(points, focus)
    assert 0.0 <= left <= 1.0
    assert left == pytest.approx(right, abs=1e-12)
    if math.hypot(x, y) >= CAMERA.reach:
        assert left == 0.0


def test_a_view_that_knows_nothing_has_a_third_of_a_bit() -> None:
    """The mean over a disc of 1 less the distance to its middle is 1/3."""
    gazer = FocusGazer(LAYOUT, CAMERA)
    cells = gazer.cells(np.array([[1.0, 0.3], [-0.6, 0.5]]))
    means = gazer.views(np.ones(LAYOUT.shape, np.float32), ROBOT, cells)
    assert means == pytest.approx([1.0 / 3.0] * 2, rel=0.05)


@pytest.mark.parametrize("method", ["by_particles", "by_windows"])
def test_it_looks_at_what_is_unknown(method: str) -> None:
    gazer, place = FocusGazer(LAYOUT, CAMERA), np.array([0.9, 0.9])
    bits = blob(place)
    if method == "by_particles":
        best = gazer.by_particles(bits, ROBOT, AHEAD, rng())[0]
    else:
        best = gazer.by_windows(bits, ROBOT, AHEAD)[0]
    assert np.hypot(*(best.place - place)) < 0.35
    turned = math.atan2(*(best.place - ROBOT[:2])[::-1]) - ROBOT[2]
    assert best.pan == pytest.approx(turned, abs=0.05)
    away = math.hypot(*(best.place - ROBOT[:2]))
    assert best.tilt == pytest.approx(math.atan2(0.5, away), abs=0.05)


def test_windows_find_more_than_particles_and_nearly_the_most() -> None:
    gazer = FocusGazer(LAYOUT, CAMERA, particles=5)
    allowed = np.flatnonzero(gazer.weights(ROBOT, AHEAD) > 0.0).astype(np.int32)
    found = []
    for seed in range(6):
        smooth = sum(blob(3.0 * np.random.default_rng([seed, k]).random(2) - 1.5) for k in range(5))
        bits = np.minimum(np.asarray(smooth), 1.0).astype(np.float32)
        chosen = [
            gazer.by_particles(bits, ROBOT, AHEAD, rng())[0].place,
            gazer.by_windows(bits, ROBOT, AHEAD)[0].place,
        ]
        found.append(gazer.views(bits, ROBOT, gazer.cells(np.array(chosen))))
        found[-1] /= gazer.views(bits, ROBOT, allowed).max()
    particles, windows = np.mean(found, axis=0)
    assert windows > 0.7
    assert windows > particles + 0.05


def test_one_particle_without_views_is_the_best_cell() -> None:
    gazer = FocusGazer(LAYOUT, CAMERA, particles=1, apart=0.0)
    for seed in range(3):
        bits = noise(seed)
        best = gazer.by_particles(bits, ROBOT, AHEAD, rng(), views=False)[0]
        worth = bits.reshape(-1) * gazer.weights(ROBOT, AHEAD)
        assert best.bits == pytest.approx(worth.max())
        assert gazer.cells(best.place[None])[0] == worth.argmax()


def test_seeds_are_candidates_whatever_they_show() -> None:
    gazer = FocusGazer(LAYOUT, CAMERA, particles=3)
    seed = np.array([-1.0, 0.5])
    found = gazer.by_particles(blob(AHEAD), ROBOT, AHEAD, rng(), [seed])
    assert len(found) == 4
    assert min(np.hypot(*(each.place - seed)) for each in found) < LAYOUT.resolution
    assert [each.bits for each in found] == sorted((each.bits for each in found), reverse=True)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(SettingsError, match="height -1"):
        PanTilt(-1.0, 1.0, 1.0)
    with pytest.raises(SettingsError, match="wide nan"):
        PanTilt(1.0, math.nan, 1.0)
    with pytest.raises(GridError, match="0 particles"):
        FocusGazer(LAYOUT, CAMERA, particles=0)
    gazer = FocusGazer(LAYOUT, CAMERA)
    for bits in (np.ones((3, 3), np.float32), np.full(LAYOUT.shape, np.nan, np.float32)):
        with pytest.raises(GridError, match="finite bits"):
            gazer.by_windows(bits, ROBOT, AHEAD)
