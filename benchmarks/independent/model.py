"""The building's model that is handed to objstate: the true walls and doors with errors by choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.independent.world import Door, Piece, World

HEIGHT = 2.5  # m, of walls


@dataclass(frozen=True)
class ModelErrors:
    """What is wrong with a model. All but the two of leaves are standard deviations."""

    hinge: float = 0.0  # m, in x and in y, per door
    bearing: float = 0.0  # rad, of the closed leaf, per door
    leaf_width: float = 0.0  # m, all leaves are wider by this
    leaf_width_std: float = 0.0  # m, per door
    leaf_thickness: float | None = None  # m, what all leaves have in the model; None: the true
    wall: float = 0.0  # m, in x and in y, per piece
    wall_turn: float = 0.0  # rad, per piece
    laser_yaw: float = 0.0  # rad, per laser
    laser_shift: float = 0.0  # m, in x and in y, per laser


@dataclass(frozen=True)
class Model:
    """Walls and doors as the model has them."""

    walls: list[Piece]
    doors: list[Door]


def model_of(world: World, errors: ModelErrors, seed: int) -> Model:
    """A model with errors; the same seed errs in the same directions, whatever the sizes."""
    rng = np.random.default_rng([seed, 11])
    doors = [_door(door, rng.standard_normal(4), errors) for door in world.doors]
    walls = [moved_wall(wall, rng.standard_normal(3), errors) for wall in world.walls]
    return Model(walls, doors)


def _door(door: Door, unit: np.ndarray, errors: ModelErrors) -> Door:
    thickness = errors.leaf_thickness
    return replace(
        door,
        x=door.x + errors.hinge * unit[0],
        y=door.y + errors.hinge * unit[1],
        closed=door.closed + errors.bearing * unit[2],
        width=door.width + errors.leaf_width + errors.leaf_width_std * unit[3],
        thickness=door.thickness if thickness is None else thickness,
    )


def moved_wall(wall: Piece, unit: np.ndarray, errors: ModelErrors) -> Piece:
    """A wall piece as a model with errors has it; ``unit`` (3,) are standard normal draws."""
    return replace(
        wall,
        x=wall.x + errors.wall * unit[0],
        y=wall.y + errors.wall * unit[1],
        yaw=wall.yaw + errors.wall_turn * unit[2],
    )


def urdf(model: Model) -> str:
    """The model as URDF: a link of boxes, and a revolute joint for each door."""
    lines = ['<?xml version="1.0"?>', '<robot name="independent">', '  <link name="building">']
    lines += [box((w.x, w.y, HEIGHT / 2), w.yaw, (w.length, w.width, HEIGHT)) for w in model.walls]
    lines.append("  </link>")
    for door in model.doors:
        lines += _joint(door)
    return "\n".join([*lines, "</robot>", ""])


def box(centre: Sequence[float], yaw: float, size: Sequence[float]) -> str:
    """A cuboid as part of a link."""
    return (
        f'    <visual><origin xyz="{numbers(centre)}" rpy="0 0 {yaw:.6f}"/>'
        f'<geometry><box size="{numbers(size)}"/></geometry></visual>'
    )


def _joint(door: Door) -> list[str]:
    centre = (door.width / 2, -door.sense * door.thickness / 2, 1.01)
    return [
        f'  <link name="{door.name}_leaf">',
        box(centre, 0.0, (door.width, door.thickness, 2.0)),
        "  </link>",
        f'  <joint name="{door.name}" type="revolute">',
        f'    <parent link="building"/><child link="{door.name}_leaf"/>',
        f'    <origin xyz="{numbers((door.x, door.y, 0.0))}" rpy="0 0 {door.closed:.6f}"/>',
        f'    <axis xyz="0 0 {door.sense}"/>',
        f'    <limit lower="0" upper="{door.limit:.4f}" effort="0" velocity="0"/>',
        "  </joint>",
    ]


def numbers(values: Sequence[float]) -> str:
    """Numbers as URDF has them."""
    return " ".join(f"{value:.6f}" for value in values)
