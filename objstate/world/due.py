"""When an object is known worse than a task allows (section III-C of Elfring et al. 2012)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, wrap
from objstate.objects import ObjectBelief
from objstate.objects.furniture import SampleFilter
from objstate.records import NANOSECONDS
from objstate.world.allowed import PRESENT, Task
from objstate.world.moving import moves_by

if TYPE_CHECKING:
    from objstate.world.world import World

SOONEST = 1.0 / 30.0  # s, from which on a crossing is searched, in steps of twice the time
PRECISION = 1e-3  # relative, to which its moment is found

Variances = Callable[[float], FloatArray]  # seconds from a belief to variances (d,)


@dataclass(frozen=True)
class Due:
    """A coordinate that has to be verified, and when."""

    object: str
    coordinate: str  # or "present"
    variance: float  # rad^2, m^2, or p (1 - p), at the moment of asking
    allowed: float
    due_ns: int  # when it is larger than allowed; the moment of asking, if it is already


def due(world: World, task: Task, horizon_s: float, stamp_ns: int) -> tuple[Due, ...]:
    """What of a world a task wants verified within ``horizon_s`` from a moment, the soonest first."""
    found = [
        each for name in world.objects for each in _due_of(world, task, name, horizon_s, stamp_ns)
    ]
    return tuple(sorted(found, key=lambda each: (each.due_ns, each.object)))


def _due_of(world: World, task: Task, name: str, horizon_s: float, stamp_ns: int) -> list[Due]:
    coordinates = (*world.objects[name].coordinates, PRESENT)
    allowed = {key: most for key, most in task.allowed(name).items() if key in coordinates}
    if not allowed:
        return []
    past = world.history_until(name, stamp_ns)
    belief = past[-1] if past else world.belief(name, stamp_ns)
    assert belief.stamp_ns is not None  # a world has none such
    age = (stamp_ns - belief.stamp_ns) / NANOSECONDS
    variances, found = variances_of(world, belief), []
    rested = 1.0 / task.most_per_second
    for key, most in allowed.items():
        of = _one(variances, coordinates.index(key))
        moment = _crossing(of, most, age, horizon_s)
        if moment is not None:
            seconds = max(moment, rested if past else 0.0) - age
            later = stamp_ns + max(round(seconds * NANOSECONDS), 0)
            found.append(Due(name, key, of(age), most, later))
    return found


def variances_of(world: World, belief: ObjectBelief) -> Variances:
    """Predicted variances (d + 1,) of a belief's coordinates and presence, by seconds from it on."""
    filter_ = world.filter_of(belief.item.name)
    assert belief.stamp_ns is not None
    begin_ns = belief.stamp_ns
    if isinstance(filter_, SampleFilter):
        return _of_furniture(world, belief, filter_)

    def of_door(seconds: float) -> FloatArray:
        later = world.later(belief, begin_ns + round(seconds * NANOSECONDS))
        return np.append(later.std**2, 0.0)

    return of_door


def _one(variances: Variances, k: int) -> Callable[[float], float]:
    """One of several variances."""
    return lambda seconds: float(variances(seconds)[k])


def _of_furniture(world: World, belief: ObjectBelief, filter_: SampleFilter) -> Variances:
    """In closed form: of what drifts, and of where it goes when it is moved.

    As ``World.at`` moves samples, but that headings don't wrap.
    """
    dynamics, start, presence = filter_.settings.dynamics, belief.std**2, belief.presence
    drift = np.array([dynamics.drift_m, dynamics.drift_m, radians(dynamics.drift_deg)]) ** 2
    moved, goes = moves_by(world, filter_, belief)
    shares = goes.weights / goes.weights.sum()
    nearest = belief.item.symmetry.nearest
    off = np.stack([nearest(m[None], float(belief.mean[2]))[0] for m in goes.middles]) - belief.mean
    off[:, 2] = wrap(off[:, 2])
    middle = shares @ off
    spread = shares @ (goes.variances + (off - middle) ** 2)

    def of_furniture(seconds: float) -> FloatArray:
        left = moved(seconds)
        stays, came = (1.0 - left) * presence, left * (1.0 - goes.away)
        there = stays + came
        anew = came / there if there > 0.0 else 0.0
        within = (1.0 - anew) * (start + seconds * drift) + anew * spread
        return np.append(within + (1.0 - anew) * anew * middle**2, there * (1.0 - there))

    return of_furniture


def _crossing(
    variance: Callable[[float], float], most: float, start: float, horizon_s: float
) -> float | None:
    """The first second, from ``start`` on, at which a variance exceeds ``most``; None without one.

    Found by doubling and bisection: an excess shorter than half of the time since ``start`` may be
    missed.
    """
    if variance(start) > most:
        return start
    early, late = 0.0, min(SOONEST, horizon_s)
    while variance(start + late) <= most:
        if late >= horizon_s:
            return None
        early, late = late, min(2.0 * late, horizon_s)
    while late - early > PRECISION * late:
        middle = (early + late) / 2.0
        early, late = (early, middle) if variance(start + middle) > most else (middle, late)
    return start + late
