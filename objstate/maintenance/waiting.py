"""When the next look will be worth it, and how probably something has moved meanwhile."""

from __future__ import annotations

from objstate.geometry import FloatArray
from objstate.maintenance.coordinator import Coordinator
from objstate.records import NANOSECONDS
from objstate.world import World

SOONEST, HORIZON = 60.0, 24.0 * 3600.0  # s
PRECISION = 0.05  # relative, to which the moment is found


def seconds_until_worthwhile(
    coordinator: Coordinator,
    world: World,
    now_ns: int,
    at: FloatArray,
    *,
    may_drive: bool = True,
    horizon_s: float = HORIZON,
) -> float | None:
    """Time, s, until an action of a robot that waits at (3,) is worthwhile, without looks.

    0 where one is now, None where none will be within ``horizon_s``. Beliefs are predicted by the
    world; the moment is found by doubling and bisection, to 5 %.
    """

    def is_worthwhile(seconds: float) -> bool:
        beliefs = world.at(now_ns + round(seconds * NANOSECONDS)).beliefs
        if may_drive:
            return coordinator.choose(beliefs, at) is not None
        return coordinator.best(coordinator.actions(beliefs, at, may_drive=False)) is not None

    if is_worthwhile(0.0):
        return 0.0
    early, late = 0.0, min(SOONEST, horizon_s)
    while not is_worthwhile(late):
        if late >= horizon_s:
            return None
        early, late = late, min(2.0 * late, horizon_s)
    while late - early > PRECISION * late:
        middle = (early + late) / 2.0
        early, late = (early, middle) if is_worthwhile(middle) else (middle, late)
    return late
