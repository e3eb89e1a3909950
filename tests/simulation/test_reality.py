"""Model errors shift whole pieces, each by itself, by what the scene says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.simulation.reality import real_building, real_mount
from objstate.simulation.scene import ModelError, Mount


def test_pieces_of_wall_move_rigidly_and_apart(room: Path) -> None:
    model = load_building(room)
    real = real_building(model, ModelError(wall_sigma=0.02), np.random.default_rng(0))
    moved = (real.walls.vertices - model.walls.vertices)[model.walls.faces]  # (f, 3, 3)
    np.testing.assert_allclose(moved, moved[:, :1].repeat(3, axis=1), atol=1e-12)
    np.testing.assert_array_equal(moved[..., 2], 0.0)
    shifts = np.unique(np.round(moved[:, 0], 9), axis=0)
    assert len(shifts) == 4  # boxes
    assert 0.0 < np.abs(shifts).max() < 0.1


def test_hinges_move_and_furniture_does_not(room: Path) -> None:
    model = load_building(room)
    real = real_building(model, ModelError(hinge_sigma=0.02), np.random.default_rng(0))
    for name in ("door", "slider"):
        shift = real[name].origin - model[name].origin
        assert 0.0 < np.abs(shift[:2, 3]).max() < 0.1
        np.testing.assert_array_equal(shift[:3, :3], 0.0)
    np.testing.assert_array_equal(real["table"].origin, model["table"].origin)
    np.testing.assert_array_equal(real.walls.vertices, model.walls.vertices)


def test_lasers_sit_askew_by_what_is_set() -> None:
    mount = Mount(x=0.2, z=0.4, yaw=1.0)
    rng = np.random.default_rng(0)
    exact = real_mount(mount, ModelError(), rng)
    np.testing.assert_allclose(exact[:3, 3], [0.2, 0.0, 0.4])
    error = ModelError(laser_sigma=0.01, laser_yaw_sigma=0.05)
    many = np.array([real_mount(mount, error, rng) for _ in range(500)])
    yaws = np.arctan2(many[:, 1, 0], many[:, 0, 0])
    assert yaws.std() == pytest.approx(0.05, rel=0.15)
    assert many[:, 0, 3].std() == pytest.approx(0.01, rel=0.15)
    np.testing.assert_array_equal(many[:, 2, 3], 0.4)
