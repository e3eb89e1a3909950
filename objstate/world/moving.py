"""Furniture by its habits: what beliefs tell of it, and what they tell of a piece that nobody sees."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.building import PieceHabits
from objstate.habits.piece import PieceSite, Places, Sighting, beside, shared
from objstate.objects import ObjectBelief
from objstate.objects.furniture import SampleFilter
from objstate.records import NANOSECONDS
from objstate.world.looks import ends_of_looks

if TYPE_CHECKING:
    from objstate.world.world import World


# Deviations of x, y, yaw up to which a look tells where a piece stands, m, m, rad
PLACED = np.array([0.15, 0.15, math.radians(15.0)])
THERE, AWAY = 0.5, 0.1  # probability of presence from which it stands there; up to which it is away


def has_moves(filter_: object) -> TypeGuard[SampleFilter]:
    """Whether habits are learnt of what a filter estimates: furniture.

    Settings that say how often a piece is moved are taken at their word.
    """
    return isinstance(filter_, SampleFilter) and "dynamics" not in filter_.settings.model_fields_set


def form_of(filter_: SampleFilter) -> str:
    """Pieces of one size learn more from each other than from others, and change places."""
    corners = filter_.item.upright_mesh.vertices
    return " by ".join(f"{size:.2f}" for size in np.ptp(corners, axis=0))


def sightings(beliefs: Iterable[ObjectBelief]) -> list[Sighting]:
    """What beliefs at the ends of looks tell of where a piece stands, in their order.

    Beliefs are in time order. Looks that didn't decide it are left out, and so are beliefs from
    within a look: while it is being moved, it stands nowhere.
    """
    found = []
    for belief in ends_of_looks(beliefs):
        assert belief.stamp_ns is not None  # it was observed
        if belief.presence <= AWAY:
            found.append(Sighting(belief.stamp_ns, None, np.zeros(3)))
        elif belief.presence > THERE and (belief.std < PLACED).all():
            found.append(Sighting(belief.stamp_ns, belief.mean, belief.std**2))
    return found


def elsewhere(filter_: SampleFilter) -> Callable[[FloatArray | None], Places]:
    """Where the settings have a piece go that stood at (3,), or was away: as ``SampleFilter.predict``."""
    s = filter_.settings
    width = np.array([s.prior_std_m, s.prior_std_m, math.radians(s.prior_std_deg)])
    prior = width**2 if s.prior == "gaussian" else width**2 / 3.0
    nudge = np.array([s.nudge_m, s.nudge_m, math.radians(s.nudge_deg)]) ** 2

    def of(state: FloatArray | None) -> Places:
        there, home = s.presence, filter_.item.home
        if state is None:
            return Places(np.array([there]), home[None], prior[None], 1.0 - there)
        weights = np.array([there / 2.0, there / 2.0])
        return Places(weights, np.stack([state, home]), np.stack([nudge, prior]), 1.0 - there)

    return of


def goes_to(habits: PieceHabits, filter_: SampleFilter, state: FloatArray) -> Places:
    """Where a piece that stood at (3,) goes when it is moved."""
    name = filter_.item.name
    like, unlike = list[PieceSite](), list[PieceSite]()
    for other, form in habits.classes.items():
        if other != name:
            (like if form == habits.classes[name] else unlike).append(habits.sites[other])
    new = beside(unlike, elsewhere(filter_)(state))
    return habits.sites[name].next(shared(like, new))


def moves_by(
    world: World, filter_: SampleFilter, belief: ObjectBelief
) -> tuple[Callable[[float], float], Places]:
    """How probably a piece was moved within seconds after a belief, and where it went then."""
    begin_ns, state = belief.stamp_ns or 0, belief.mean
    if (habits := world.moves_of(filter_.item.name)) is None:
        return filter_.settings.dynamics.moved, elsewhere(filter_)(state)
    forecast = habits.forecast(filter_.item.name)

    def moved(seconds: float) -> float:
        return 1.0 - forecast.stays(begin_ns, begin_ns + round(seconds * NANOSECONDS))

    return moved, goes_to(habits, filter_, state)


def moved_on(
    habits: PieceHabits,
    filter_: SampleFilter,
    belief: ObjectBelief,
    begin_ns: int,
    end_ns: int,
    rng: np.random.Generator,
) -> ObjectBelief:
    """A belief as it is after a time in which nobody looked."""
    stays = habits.forecast(filter_.item.name).stays(begin_ns, end_ns)
    goes = goes_to(habits, filter_, belief.mean)
    came = (1.0 - stays) * (1.0 - goes.away)
    presence = stays * belief.presence + came
    share = came / presence if presence > 0.0 else 0.0
    seconds = (end_ns - begin_ns) / NANOSECONDS
    return filter_.carried(belief, seconds, share, goes.drawn, presence, rng)
