"""Objects as the plan draws and moves them."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Kind, Mesh, MovableObject
from objstate.geometry import FloatArray
from objstate.report.plan import Shape, shape_of
from tests.rooms import block, door, placed, sliding_door, standing, table


def moved(shape: Shape, points: FloatArray, state: FloatArray) -> FloatArray:
    """What the page's script does with a shape; state in m and rad."""
    motion = shape.motion
    if motion["kind"] == "slide":
        return points + state[0] * np.array(motion["along"])
    pivot = np.array(motion.get("pivot", (0.0, 0.0)))
    angle = motion["sense"] * state[0] if motion["kind"] == "turn" else state[2]
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shift = state[:2] if motion["kind"] == "free" else pivot
    return (points - pivot) @ turn.T + shift


DOWN = MovableObject(
    "down", Kind.HINGED, placed(1.0, -2.0, 0.0, (0.0, 0.0, 2.0)), np.array([0.0, 0.0, -1.0]),
    0.0, 1.5, block(0.45, 0.0, 0.9, 0.04),
)  # fmt: skip


@pytest.mark.parametrize(
    ("item", "state"),
    [
        (door("d", 3.0, 1.0, 0.7), [0.9]),
        (DOWN, [1.1]),
        (sliding_door("s", -1.0, 2.0, 1.3), [0.4]),
        (table("t", 5.0, 5.0, 0.4), [4.0, 6.0, -2.5]),
    ],
    ids=lambda value: value.name if isinstance(value, MovableObject) else "",
)
def test_shapes_move_as_the_objects_do(item: MovableObject, state: list[float]) -> None:
    shape = shape_of(item, 0.3)
    here = moved(shape, np.concatenate(shape.hull), np.array(state))
    corners = item.mesh.moved(item.transforms(np.array([state]))[0]).vertices[:, :2]
    assert here.min(axis=0) == pytest.approx(corners.min(axis=0), abs=1e-3)
    assert here.max(axis=0) == pytest.approx(corners.max(axis=0), abs=1e-3)
    assert len(shape.cut)


def test_a_flap_on_a_level_hinge_stays_as_the_model_shows_it() -> None:
    flap = MovableObject(
        "flap", Kind.HINGED, placed(2.0, 3.0), np.array([1.0, 0.0, 0.0]), 0.0, 1.0,
        block(0.0, 0.0, 1.0, 0.5),
    )  # fmt: skip
    shape = shape_of(flap, 0.3)
    assert shape.motion == {"kind": "still"}
    assert np.concatenate(shape.hull).mean(axis=0) == pytest.approx([2.0, 3.0], abs=0.3)


def test_a_hollow_object_keeps_its_shape() -> None:
    sides = [block(0.0, 0.5, 1.0, 0.1), block(0.45, 0.0, 0.1, 1.1), block(0.0, -0.5, 1.0, 0.1)]
    (ring,) = shape_of(standing("u", Mesh.joined(sides)), 0.3).hull
    x, y = ring.T
    area = 0.5 * abs(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1]))
    assert area == pytest.approx(2 * 1.0 * 0.1 + 0.1 * 0.9, abs=0.02)
