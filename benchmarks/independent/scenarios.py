"""The scenarios: what each has wrong. All of a seed share walls, doors and the robot's way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from benchmarks.independent.drive import OdometryErrors, Route
from benchmarks.independent.model import ModelErrors
from benchmarks.independent.world import WorldOptions

DEGREE = float(np.radians(1.0))


@dataclass(frozen=True)
class Plan:
    """All that a drive is made of, besides its seed."""

    errors: ModelErrors = field(default_factory=ModelErrors)
    world: WorldOptions = field(default_factory=WorldOptions)
    odometry: OdometryErrors = field(default_factory=OdometryErrors)
    route: Route = field(default_factory=Route)
    rig: str = "two"  # see `lasers.rig`
    clock: float = 0.0  # s that the lasers' stamps run ahead
    range_bias: float = 0.0  # m, standard deviation per laser


WALLS = ModelErrors(wall=0.02, wall_turn=0.3 * DEGREE)
ALL = ModelErrors(hinge=0.02, wall=0.02, wall_turn=0.3 * DEGREE, laser_yaw=0.7 * DEGREE)
SMALL = ModelErrors(hinge=0.01, wall=0.01, wall_turn=0.15 * DEGREE, laser_yaw=0.3 * DEGREE)
MILD = ModelErrors(
    hinge=0.01,
    bearing=0.5 * DEGREE,
    leaf_width_std=0.01,
    leaf_thickness=0.04,
    wall=0.01,
    wall_turn=0.15 * DEGREE,
    laser_yaw=0.3 * DEGREE,
    laser_shift=0.005,
)
OPEN = WorldOptions(angles=(40 * DEGREE, 90 * DEGREE), doorway_boxes=0.6)
NASTY = WorldOptions(
    walkers=3,
    standing=1,
    boxes=4,
    doorway_boxes=0.1,
    glass_doors=0.1,
    glass_walls=0.05,
    handles=True,
    frames=True,
    thickness=(0.02, 0.06),
)


def usual(seed: int) -> str:
    """Odd seeds have two lasers, even ones one of 270 degrees."""
    return "two" if seed % 2 else "wide"


def _wrong(errors: ModelErrors) -> Callable[[int], Plan]:
    """Only the model is wrong."""
    return lambda seed: Plan(errors=errors, rig=usual(seed))


def _everything(seed: int) -> Plan:
    rng = np.random.default_rng([seed, 51])
    return Plan(
        errors=MILD,
        world=NASTY,
        odometry=OdometryErrors(scale=0.02, turn_scale=0.03, bursts=2),
        rig=("two", "wide", "skewed")[seed % 3],
        clock=float(rng.choice([-0.04, 0.04])),
        range_bias=0.01,
    )


SCENARIOS: dict[str, Callable[[int], Plan]] = {
    "nothing": _wrong(ModelErrors()),
    "hinges-2cm": _wrong(ModelErrors(hinge=0.02)),
    "hinges-5cm": _wrong(ModelErrors(hinge=0.05)),
    "bearing-2deg": _wrong(ModelErrors(bearing=2.0 * DEGREE)),
    "leaf-5cm-wide": _wrong(ModelErrors(leaf_width=0.05)),
    "leaf-2cm-thick": _wrong(ModelErrors(leaf_thickness=0.02)),
    "leaf-6cm-thick": _wrong(ModelErrors(leaf_thickness=0.06)),
    "walls-2cm": _wrong(WALLS),
    "lasers-0.7deg": _wrong(ModelErrors(laser_yaw=0.7 * DEGREE)),
    "all": _wrong(ALL),
    "small": _wrong(SMALL),
    "turning": lambda _: Plan(errors=SMALL, rig="turning"),
    "doorway-boxes": lambda seed: Plan(errors=SMALL, world=OPEN, rig=usual(seed)),
    "automatic": lambda seed: Plan(
        errors=SMALL, world=WorldOptions(automatic=True), rig=usual(seed)
    ),
    "everything": _everything,
    "glass": lambda seed: Plan(
        world=WorldOptions(glass_doors=0.4, glass_walls=0.3), rig=usual(seed)
    ),
    "slip": lambda seed: Plan(
        odometry=OdometryErrors(scale=0.03, turn_scale=0.05, bursts=8), rig=usual(seed)
    ),
    "people": lambda seed: Plan(world=WorldOptions(walkers=6, standing=4), rig=usual(seed)),
    "clock": lambda seed: Plan(clock=0.08 if seed % 4 < 2 else -0.08, rig=usual(seed)),
    "skew": lambda _: Plan(rig="skewed"),
}
