"""When an object is known worse than a task allows (section III-C of Elfring et al. 2012)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, radians
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, wrap
from objstate.objects import ObjectBelief, ObjectFilter
from objstate.objects.furniture import SampleFilter
from objstate.records import NANOSECONDS
from objstate.world.allowed import PRESENT, Task

if TYPE_CHECKING:
    from objstate.world.world import World

SECONDS_PER_HOUR = 3600.0
SOONEST = 1.0 / 30.0  # s, from which on a crossing is searched, in steps of twice the time
PRECISION = 1e-3  # relative, to which its moment is found
HALF_FURNITURE = 0.5  # of furniture that is moved, the share that is moved near by

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
    variances, found = variances_of(belief, world.filter_of(name)), []
    rested = 1.0 / task.most_per_second
    for key, most in allowed.items():
        of = _one(variances, coordinates.index(key))
        moment = _crossing(of, most, age, horizon_s)
        if moment is not None:
            seconds = max(moment, rested if past else 0.0) - age
            later = stamp_ns + max(round(seconds * NANOSECONDS), 0)
            found.append(Due(name, key, of(age), most, later))
    return found


def variances_of(belief: ObjectBelief, filter_: ObjectFilter) -> Variances:
    """Predicted variances (d + 1,) of a belief's coordinates and presence, by seconds from it on."""
    if isinstance(filter_, SampleFilter):
        return _of_furniture(belief, filter_)
    rng = np.random.default_rng(0)  # doors draw nothing

    def of_door(seconds: float) -> FloatArray:
        later = filter_.predict(belief, seconds, rng) if seconds > 0.0 else belief
        return np.append(later.std**2, 0.0)

    return of_door


def _one(variances: Variances, k: int) -> Callable[[float], float]:
    """One of several variances."""
    return lambda seconds: float(variances(seconds)[k])


def _of_furniture(belief: ObjectBelief, filter_: SampleFilter) -> Variances:
    """In closed form: of what drifts, what was moved near by, and what the prior has.

    As ``SampleFilter.predict`` moves samples, but that headings don't wrap.
    """
    s = filter_.settings
    drift = np.array([s.dynamics.drift_m, s.dynamics.drift_m, radians(s.dynamics.drift_deg)]) ** 2
    nudge = np.array([s.nudge_m, s.nudge_m, radians(s.nudge_deg)]) ** 2
    width = np.array([s.prior_std_m, s.prior_std_m, radians(s.prior_std_deg)]) ** 2
    prior = width if s.prior == "gaussian" else width / 3.0
    off = belief.item.symmetry.nearest(belief.mean[None], belief.item.home[2])[0] - belief.item.home
    off[2] = wrap(off[2])
    start, presence = belief.std**2, belief.presence

    def of_furniture(seconds: float) -> FloatArray:
        moved = 1.0 - exp(-s.dynamics.moves_per_hour * seconds / SECONDS_PER_HOUR)
        near, anew = HALF_FURNITURE * moved, (1.0 - HALF_FURNITURE) * moved
        rest = 1.0 - near - anew
        within = rest * (start + seconds * drift) + near * (start + nudge) + anew * prior
        between = (1.0 - anew) * anew * off**2
        there = presence + moved * (s.presence - presence)
        return np.append(within + between, there * (1.0 - there))

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
