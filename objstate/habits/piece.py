"""The habits of a piece of furniture: how often it is moved (``moves``), and to which places.

The places where it stood are a mixture. A piece that is moved goes to one of them as often as it went
there before, or somewhere new: a Chinese restaurant process. New to it are places where others of
its form stand, too, so that pieces that change places are expected to (the same process for the
building; Teh et al. 2006, *Hierarchical Dirichlet processes*, JASA 101), and those of its settings.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from objstate.geometry import FloatArray, wrap
from objstate.habits.calendar import Calendar
from objstate.habits.factor import Factor, told
from objstate.habits.model import Gaussian, fit_to, mode, prior
from objstate.habits.moves import MoveDesign, Moves, Spans

NEW = 1.0  # arrivals that a place where it never stood counts for
# Deviations of x, y, yaw by which a piece seems to stand elsewhere on another drive, m, m, rad
REPEATED = np.array([0.03, 0.03, math.radians(2.0)])
SPREAD = np.array([0.15, 0.15, math.radians(15.0)])  # of a place, before any arrival
SPREAD_COUNTS = 2.0  # arrivals that this counts for
SUREST = 1e6  # odds of a look
TURN = 2.0 * math.pi

Nearest = Callable[[FloatArray, float], FloatArray]  # of equal states (n, 3), those nearest a yaw


@dataclass(frozen=True, eq=False)
class Sighting:
    """Where a piece was seen."""

    stamp_ns: int
    state: FloatArray | None  # (3,) x, y, yaw; None: it wasn't there
    variance: FloatArray = field(repr=False)  # (3,)


@dataclass(frozen=True, eq=False)
class Places:
    """Where a piece goes when it is moved: normal distributions, or away."""

    weights: FloatArray  # (k,); with ``away`` they sum to one
    middles: FloatArray  # (k, 3)
    variances: FloatArray  # (k, 3)
    away: float

    @staticmethod
    def none(away: float = 0.0) -> Places:
        """Nowhere, or away."""
        return Places(np.empty(0), np.empty((0, 3)), np.empty((0, 3)), away)

    @staticmethod
    def mixed(parts: Sequence[tuple[float, Places]]) -> Places:
        """Several, each with a share of the whole."""
        total = sum(share for share, _ in parts)
        return Places(
            np.concatenate([share / total * each.weights for share, each in parts]),
            np.concatenate([each.middles for _, each in parts]),
            np.concatenate([each.variances for _, each in parts]),
            sum(share / total * each.away for share, each in parts),
        )

    def densities(self, seen: Sighting, nearest: Nearest) -> FloatArray:
        """(k,) of what was seen, given each place."""
        assert seen.state is not None
        return _density(_off(seen.state, self.middles, nearest), self.variances + seen.variance)

    def density(self, seen: Sighting, nearest: Nearest) -> float:
        """Of what was seen after a move."""
        if seen.state is None:
            return self.away
        return float(self.weights @ self.densities(seen, nearest))

    def drawn(self, count: int, rng: np.random.Generator) -> FloatArray:
        """(count, 3) where it is after a move, if it isn't away."""
        chosen = rng.choice(len(self.weights), count, p=self.weights / self.weights.sum())
        spread = np.sqrt(self.variances[chosen]) * rng.standard_normal((count, 3))
        states = self.middles[chosen] + spread
        states[:, 2] = wrap(states[:, 2])
        return np.asarray(states)


@dataclass(frozen=True, eq=False)
class PieceSite(Factor[Moves]):
    """What looks at one piece told: of the rate of its moves, and of places."""

    middles: FloatArray  # (k, 3) of places, in the order in which it first stood there
    squares: FloatArray  # (k, 3) summed squared distances of arrivals from them
    arrivals: FloatArray  # (k,) how often it came there, or stood there at first
    taken: float = 0.0  # how often it was taken away
    last: Sighting | None = None  # where it stands by all looks since it came, at the latest

    @staticmethod
    def empty(seasons: bool = False) -> PieceSite:
        """Of a piece that nobody has looked at."""
        p, nowhere = len(MoveDesign(seasons).mean), np.empty((0, 3))
        return PieceSite(
            np.zeros(p), np.zeros((0, p)), nowhere, nowhere, np.empty(0), seasons=seasons
        )

    @property
    def design(self) -> MoveDesign:
        return MoveDesign(self.seasons)

    def forecast(self, calendar: Calendar, after: Gaussian) -> Moves:
        return Moves(self.design, calendar, after)

    @property
    def stood(self) -> Places:
        """Where it came to stand, as often as that was."""
        total = max(self.arrivals.sum() + self.taken, 1.0)
        variances = (SPREAD_COUNTS * SPREAD**2 + self.squares) / (
            SPREAD_COUNTS + self.arrivals[:, None]
        )
        return Places(self.arrivals / total, self.middles, variances, self.taken / total)

    def next(self, elsewhere: Places) -> Places:
        """Where it goes when it is moved: to places that it knows, or ``elsewhere``."""
        known = float(self.arrivals.sum()) + self.taken
        return Places.mixed([(known, self.stood), (NEW, elsewhere)])

    def with_looks(
        self,
        calendar: Calendar,
        seen: Sequence[Sighting],
        elsewhere: Callable[[FloatArray | None], Places],
        nearest: Nearest,
    ) -> PieceSite:
        """The site that has taken further looks in, in time order.

        Looks before the last one tell nothing of moves. ``elsewhere`` are the places that its settings
        have for a piece that stood at (3,), or was away.
        """
        before = self.posterior(prior(self.design))
        site, spans = self._walked(calendar, seen, elsewhere, nearest, before.mean)
        if len(spans.odds):
            site = replace(site, **self.also(mode(spans.evidence, before)))
        return site

    @staticmethod
    def fitted_to(
        calendar: Calendar,
        seen: Sequence[Sighting],
        elsewhere: Callable[[FloatArray | None], Places],
        nearest: Nearest,
    ) -> PieceSite:
        """The site of all looks together."""
        empty = PieceSite.empty(calendar.seasons)
        before = prior(empty.design)
        theta = empty.with_looks(calendar, seen, elsewhere, nearest).posterior(before).mean
        site, spans = empty._walked(calendar, seen, elsewhere, nearest, theta)
        if len(spans.odds):
            after, _ = fit_to(spans.evidence, before)
            site = replace(site, **told(before, after, empty.design))
        return replace(site, fitted=site.looks)

    def _walked(
        self,
        calendar: Calendar,
        seen: Sequence[Sighting],
        elsewhere: Callable[[FloatArray | None], Places],
        nearest: Nearest,
        theta: FloatArray,
    ) -> tuple[PieceSite, Spans]:
        """The places after looks, and what these tell of moves, where rates are about those of ``theta``."""
        site, seconds, odds = self, list[FloatArray](), list[float]()
        rates = self.design.rates(theta)
        for each in seen:
            last = site.last
            if last is not None and each.stamp_ns < last.stamp_ns:
                site = replace(site, looks=site.looks + 1)
                continue
            moved = last is None
            if last is not None:
                goes = site.next(elsewhere(last.state))
                ratio = goes.density(each, nearest) / max(_stayed(last, each, nearest), 1e-300)
                odds.append(min(max(ratio, 1.0 / SUREST), SUREST))
                seconds.append(calendar.seconds_by_key(last.stamp_ns, each.stamp_ns))
                expected = float(rates @ seconds[-1])
                moved = odds[-1] * -math.expm1(-expected) > math.exp(-expected)
            if moved:
                stood = None if last is None else last.state
                site = site._arrived(each, elsewhere(stood), nearest)
            else:
                site = site._seen_again(each, nearest)
            first = each.stamp_ns if site.first_ns is None else min(each.stamp_ns, site.first_ns)
            site = replace(site, looks=site.looks + 1, first_ns=first)
        return site, Spans(self.design, np.array(seconds), np.array(odds))

    def _arrived(self, seen: Sighting, elsewhere: Places, nearest: Nearest) -> PieceSite:
        """The site whose piece came to where it is seen: to the most probable place, or to a new one."""
        if seen.state is None:
            return replace(self, taken=self.taken + 1.0, last=seen)
        new = NEW * elsewhere.density(seen, nearest)
        known = self.arrivals * self.stood.densities(seen, nearest)
        if not len(known) or known.max() < new:
            return replace(
                self,
                middles=np.vstack([self.middles, seen.state]),
                squares=np.vstack([self.squares, np.zeros(3)]),
                arrivals=np.append(self.arrivals, 1.0),
                last=seen,
            )
        k = int(np.argmax(known))
        middles, squares, arrivals = self.middles.copy(), self.squares.copy(), self.arrivals.copy()
        off = _off(seen.state, middles[k : k + 1], nearest)[0]
        arrivals[k] += 1.0
        squares[k] += off**2 * (1.0 - 1.0 / arrivals[k])
        middles[k] += off / arrivals[k]
        middles[k, 2] = wrap(middles[k, 2])
        return replace(self, middles=middles, squares=squares, arrivals=arrivals, last=seen)

    def _seen_again(self, seen: Sighting, nearest: Nearest) -> PieceSite:
        """The site whose piece is seen where it has stood since it came, which is known better then."""
        last = self.last
        assert last is not None
        if last.state is None or seen.state is None:
            return replace(self, last=replace(last, stamp_ns=seen.stamp_ns))
        gain = last.variance / (last.variance + seen.variance + REPEATED**2)
        change = gain * _off(seen.state, last.state[None], nearest)[0]
        state = last.state + change
        state[2] = wrap(state[2])
        k = int(np.argmax(self.arrivals * self.stood.densities(last, nearest)))
        middles, squares = self.middles.copy(), self.squares.copy()
        off = _off(last.state, middles[k : k + 1], nearest)[0]
        middles[k] += change / self.arrivals[k]
        middles[k, 2] = wrap(middles[k, 2])
        squares[k] += change * (2.0 * off + change * (1.0 - 1.0 / self.arrivals[k]))
        known = Sighting(seen.stamp_ns, state, (1.0 - gain) * last.variance)
        return replace(self, middles=middles, squares=squares, last=known)


def shared(others: Sequence[PieceSite], settings: Places) -> Places:
    """Places that are new to a piece: those where others of its form came to stand, and its settings'."""
    return Places.mixed(
        [*((float(each.arrivals.sum()), each.stood) for each in others), (NEW, settings)]
    )


def beside(others: Sequence[PieceSite], settings: Places) -> Places:
    """Places that are new to a form: as often where other forms came to stand as its settings have it."""
    came = [(float(each.arrivals.sum()), each.stood) for each in others if len(each.arrivals)]
    return Places.mixed([(NEW, Places.mixed(came)), (NEW, settings)]) if came else settings


def _stayed(last: Sighting, seen: Sighting, nearest: Nearest) -> float:
    """Density of what is seen of a piece that nobody moved since."""
    if last.state is None or seen.state is None:
        return float(last.state is None and seen.state is None)
    variance = last.variance + seen.variance + REPEATED**2
    return float(_density(_off(seen.state, last.state[None], nearest), variance)[0])


def _off(state: FloatArray, middles: FloatArray, nearest: Nearest) -> FloatArray:
    """(k, 3) from middles (k, 3) to a state (3,), of its equal ones to the nearest."""
    out = np.empty_like(middles)
    for k, middle in enumerate(middles):
        out[k] = nearest(state[None], float(middle[2]))[0] - middle
    out[:, 2] = wrap(out[:, 2])
    return out


def _density(off: FloatArray, variance: FloatArray) -> FloatArray:
    """(k,) of a normal distribution at distances (k, 3) from its mean."""
    scaled = -0.5 * (off**2 / variance + np.log(TURN * variance))
    return np.asarray(np.exp(scaled.sum(axis=1)))
