"""Settings for a drive: how often objects are moved while it lasts, and where doors rest, by their habits."""

from __future__ import annotations

import glob
import math

import numpy as np

from objstate.config import Dynamics, ObjectRule, Rest, Settings
from objstate.objects import ObjectFilter
from objstate.objects.doors import LatticeFilter
from objstate.records import NANOSECONDS
from objstate.units import SECONDS_PER_HOUR
from objstate.world.world import World

AGAIN_S = 600.0  # after which a robot comes back to a door; a single rate serves one such time
LEAST_RATE, MOST_RATE = 0.01, 60.0  # moves an hour
MOST_MOVED, MOST_CLOSED = 0.95, 0.999999  # probabilities


def drive_settings(world: World, stamp_ns: int) -> Settings:
    """The world's settings with a rule for each object whose habits are known, at a moment.

    Within a drive a door is moved at one rate, and rests after one distribution, both such
    that it leaves its region within ten minutes as often as its habits say. Furniture is moved as
    often as within the first ten minutes.
    """
    rules, later_ns = list[ObjectRule](), stamp_ns + round(AGAIN_S * NANOSECONDS)
    for name in world.objects:
        filter_ = world.filter_of(name)
        if (moves := world.moves_of(name)) is not None:
            stays = moves.forecast(name).stays(stamp_ns, later_ns)
            rules.append(_rule(filter_, 1.0 - stays))
        elif (habits := world.habits_of(name)) is not None and isinstance(filter_, LatticeFilter):
            forecast = habits.forecast(name)
            state = forecast.marginal(stamp_ns)
            kept = state * forecast.kept(stamp_ns, later_ns)
            shares = forecast.regions(state)
            differs = float(np.sum(shares * (1.0 - shares)))
            moved = float(1.0 - kept.sum(axis=1).mean()) / max(differs, 1e-9)
            rules.append(_rule(filter_, moved, rest=_rest(filter_, float(shares[0]))))
    return world.settings.model_copy(update={"objects": (*world.settings.objects, *rules)})


def _rule(filter_: ObjectFilter, moved: float, **also: Rest) -> ObjectRule:
    """A rule for an object that is moved within ten minutes with a probability."""
    rate = -math.log1p(-min(moved, MOST_MOVED)) / AGAIN_S * SECONDS_PER_HOUR
    drift = _drift(filter_.settings.dynamics)
    dynamics = Dynamics(moves_per_hour=min(max(rate, LEAST_RATE), MOST_RATE), **drift)
    return ObjectRule(match=glob.escape(filter_.item.name), dynamics=dynamics, **also)


def _drift(dynamics: Dynamics) -> dict[str, float]:
    return {"drift_deg": dynamics.drift_deg, "drift_m": dynamics.drift_m}


def _rest(filter_: LatticeFilter, closed: float) -> Rest:
    """What the settings say of rests, with the share of closed ones that habits say, unless it was set."""
    rest = filter_.settings.rest
    if "rest" in filter_.settings.model_fields_set:
        return rest
    closed = min(closed, MOST_CLOSED)
    return Rest(closed=closed, open=(1.0 - closed) * rest.open / (1.0 - rest.closed))
