"""Estimate which doors are open, how far, and where furniture stands, with probabilities.

The names below are the library: a building, a stream of records, and an estimator that is fed with
the records.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from objstate.building import load_building
    from objstate.building.model import Building, MovableObject
    from objstate.config import Settings, load_settings
    from objstate.errors import ObjstateError
    from objstate.estimator import Estimator
    from objstate.localization import PoseBelief
    from objstate.logs import open_log
    from objstate.objects import Distribution, ObjectBelief
    from objstate.records import Estimate, InitialPose, Odometry, Rays, Record, RobotBelief, Scan
    from objstate.run import RunOptions, estimate_log
    from objstate.world import Snapshot, World
    from objstate.world.store import open_store

_HOMES = {
    "Building": "objstate.building.model",
    "Distribution": "objstate.objects",
    "Estimate": "objstate.records",
    "Estimator": "objstate.estimator",
    "InitialPose": "objstate.records",
    "MovableObject": "objstate.building.model",
    "ObjectBelief": "objstate.objects",
    "ObjstateError": "objstate.errors",
    "Odometry": "objstate.records",
    "PoseBelief": "objstate.localization",
    "Rays": "objstate.records",
    "Record": "objstate.records",
    "RobotBelief": "objstate.records",
    "RunOptions": "objstate.run",
    "Scan": "objstate.records",
    "Settings": "objstate.config",
    "Snapshot": "objstate.world",
    "World": "objstate.world",
    "estimate_log": "objstate.run",
    "load_building": "objstate.building",
    "load_settings": "objstate.config",
    "open_log": "objstate.logs",
    "open_store": "objstate.world.store",
}

__all__ = [  # noqa: RUF022 - what is used first comes first
    "load_building",
    "open_log",
    "load_settings",
    "Settings",
    "Estimator",
    "estimate_log",
    "RunOptions",
    "open_store",
    "World",
    "Snapshot",
    "Building",
    "MovableObject",
    "ObjectBelief",
    "PoseBelief",
    "Distribution",
    "Record",
    "Odometry",
    "Scan",
    "Rays",
    "InitialPose",
    "RobotBelief",
    "Estimate",
    "ObjstateError",
]


def __getattr__(name: str) -> Any:
    """Import a name on first use, so that importing objstate costs nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'objstate' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
