"""Doors by their habits: what beliefs tell of them, and what they tell of a door that nobody sees."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeGuard

import numpy as np

from objstate.building.model import Kind
from objstate.geometry import FloatArray
from objstate.habits.building import DoorHabits
from objstate.habits.forecast import Forecast
from objstate.habits.levels import fit_levels, without
from objstate.habits.looks import RegionLooks
from objstate.habits.model import evidence_of
from objstate.habits.regions import (
    CLOSED_M,
    CLOSED_RAD,
    LEAST_STD_M,
    LEAST_STD_RAD,
    region_bounds,
    region_of,
)
from objstate.habits.site import RESTS, Site
from objstate.objects import ObjectBelief
from objstate.objects.doors import LatticeFilter
from objstate.records import NANOSECONDS

RESTS_AT_FIRST = 5.0  # looks that the settings' places of rest count for
LEAST = 1e-12  # probability
DRAWS = 64  # of habits, for figures
MOST_LOOKS, LATEST_NS = 1000, 42 * 86400 * NANOSECONDS  # whose likelihood figures are told by


def has_habits(filter_: object) -> TypeGuard[LatticeFilter]:
    """Whether habits are learnt of what a filter estimates: doors with two limits.

    Settings that say how often an object is moved are taken at their word.
    """
    return (
        isinstance(filter_, LatticeFilter)
        and not filter_.item.wraps
        and "dynamics" not in filter_.settings.model_fields_set
    )


def class_of(filter_: LatticeFilter) -> str:
    """Doors of one class learn more from each other than from others."""
    return filter_.item.kind.value


def first_bounds(filter_: LatticeFilter) -> tuple[float, ...]:
    """The regions of a door of which little is known."""
    return (CLOSED_RAD if filter_.item.kind is Kind.HINGED else CLOSED_M,)


def found_bounds(filter_: LatticeFilter, beliefs: Iterable[ObjectBelief]) -> tuple[float, ...]:
    """The regions that the places have where a door stood."""
    least = LEAST_STD_RAD if filter_.item.kind is Kind.HINGED else LEAST_STD_M
    places = [
        abs(belief.mean[0] - filter_.item.home[0]) for belief in beliefs if belief.std[0] < least
    ]
    return region_bounds(np.array(places), first_bounds(filter_)[0], least)


def region_looks(
    filter_: LatticeFilter, bounds: tuple[float, ...], beliefs: Sequence[ObjectBelief]
) -> tuple[RegionLooks, FloatArray]:
    """What beliefs at the ends of looks tell of a door's region, and (RESTS,) where it stood.

    The likelihood of a region is its probability over the prior one.
    """
    region = region_of(filter_.distances, bounds)
    before = _shares(filter_.prior(np.random.default_rng(0)).weights.values, region, bounds)
    share = filter_.distances / filter_.distances.max() * RESTS
    bins = np.minimum(share.astype(int), RESTS - 1)
    seen = [belief for belief in beliefs if belief.last_observed_ns == belief.stamp_ns]
    likelihood = np.empty((len(seen), len(bounds) + 1))
    rests = np.zeros(RESTS)
    for row, belief in zip(likelihood, seen, strict=True):
        weights = belief.weights.values
        row[:] = _shares(weights, region, bounds) / np.maximum(before, LEAST)
        rests += np.bincount(bins, weights=weights, minlength=RESTS)
    stamps = np.array([belief.stamp_ns for belief in seen], dtype=np.int64)
    return RegionLooks.of(stamps, likelihood), rests


def of_moves(
    habits: DoorHabits, filter_: LatticeFilter, beliefs: Sequence[ObjectBelief]
) -> Forecast:
    """A door's habits by a mixture over how often it is moved, for the intervals of that.

    Those of the Gaussian that predicts are too narrow (``objstate.habits.levels``). Older looks count
    by the Gaussian that they left.
    """
    name, calendar = filter_.item.name, habits.calendar
    site = habits.sites[name]
    looks, _ = region_looks(filter_, site.bounds, beliefs)
    if not len(looks):
        return habits.forecast(name)
    latest = looks.part(slice(-MOST_LOOKS, None))
    since = np.searchsorted(latest.stamps_ns, latest.stamps_ns[-1] - LATEST_NS)
    latest = latest.part(slice(int(since), None))
    before = habits.before(site.design, habits.classes[name], but=name)
    if len(latest) < site.looks:
        told = evidence_of(site.design, calendar, latest)
        before = without(told, site.posterior(before), before)
    known = fit_levels(site.design, calendar, latest, before)
    return Forecast(site.design, calendar, known, DRAWS)


def carried(
    habits: DoorHabits, filter_: LatticeFilter, belief: ObjectBelief, begin_ns: int, end_ns: int
) -> ObjectBelief:
    """A belief as it is after a time in which nobody looked."""
    name = filter_.item.name
    site, forecast = habits.sites[name], habits.forecast(name)
    region = region_of(filter_.distances, site.bounds)
    shares = _shares(belief.weights.values, region, site.bounds)
    state = state_of(habits, filter_, belief, begin_ns)
    stays = state * forecast.kept(begin_ns, end_ns)
    stays = (stays[:, 0::2] + stays[:, 1::2]).mean(axis=0)
    later = forecast.regions(forecast.later(state, begin_ns, end_ns))
    came = np.maximum(later - stays, LEAST)
    kept = np.clip(stays / np.maximum(shares, LEAST), 0.0, 1.0)
    places = _places(filter_, site)
    within = _shares(places, region, site.bounds)
    rest = places * (came / np.maximum(within, LEAST))[region]
    seconds = (end_ns - begin_ns) / NANOSECONDS
    return filter_.carried(belief, kept[region], rest / rest.sum(), seconds)


def state_of(
    habits: DoorHabits, filter_: LatticeFilter, belief: ObjectBelief, stamp_ns: int
) -> FloatArray:
    """(d, s) the state of a door's habits where this is believed of it."""
    site, forecast = habits.sites[filter_.item.name], habits.forecast(filter_.item.name)
    region = region_of(filter_.distances, site.bounds)
    shares = _shares(belief.weights.values, region, site.bounds)
    return forecast.with_shares(forecast.marginal(stamp_ns), shares)


def _places(filter_: LatticeFilter, site: Site) -> FloatArray:
    """(n,) where the door comes to rest, by settings and by where it stood."""
    share = filter_.distances / filter_.distances.max() * RESTS - 0.5
    stood = np.interp(share, np.arange(RESTS), site.rests)
    total = site.rests.sum()
    learnt = stood / stood.sum() if stood.sum() > 0.0 else filter_.rests
    known = total / (total + RESTS_AT_FIRST)
    return np.asarray((1.0 - known) * filter_.rests + known * learnt)


def _shares(weights: FloatArray, region: np.ndarray, bounds: tuple[float, ...]) -> FloatArray:
    """(r,) the weight of each region."""
    return np.asarray(np.bincount(region, weights, len(bounds) + 1), dtype=float)
