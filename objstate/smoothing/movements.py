"""The movements of an object: spans in which it didn't rest in one place, given the whole log."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.smoothing.chain import Chain
from objstate.smoothing.furniture import Places

STANDS_NS = 1_000_000_000  # ns; least time at rest between two movements
LIKELY = 0.5  # probability from which a movement is listed
TAIL = 0.05  # probability that it began before its span, and that it ended after it
MOVING = -1  # in place of the component, for an object that moves


class Rests(Protocol):
    """The resting places of an object, given the whole log."""

    @property
    def stamps_ns(self) -> IntArray:
        """(n,) moments."""

    @property
    def places(self) -> IntArray:
        """(n,) the component in which it most probably rests, or ``MOVING``."""

    @property
    def shares(self) -> FloatArray:
        """(n,) probability of the component in which it most probably rests."""

    def since(self, first: int, last: int) -> FloatArray:
        """(last - first + 1,) probability of resting in one place from ``first`` to each moment."""

    def until(self, first: int, last: int) -> FloatArray:
        """(last - first + 1,) probability of resting in one place from each moment to ``last``."""


@dataclass(frozen=True, eq=False)
class DoorRests:
    """Rests of a door, by its chains under each prior of its static errors.

    Of a leaf that no beam meets, with a probability of 1 - ``presence``, no movement is known.
    """

    cases: Sequence[tuple[float, Chain]]
    presence: float = 1.0

    @property
    def stamps_ns(self) -> IntArray:
        return self.cases[0][1].stamps_ns

    @property
    def places(self) -> IntArray:
        moving = sum(share * chain.moving.sum(axis=1) for share, chain in self.cases)
        return np.where(moving > 0.5, MOVING, np.argmax(self._resting, axis=1))

    @property
    def shares(self) -> FloatArray:
        return np.asarray(np.max(self._resting, axis=1))

    @property
    def _resting(self) -> FloatArray:
        """(n, c)"""
        return np.asarray(sum(share * chain.resting for share, chain in self.cases))

    def since(self, first: int, last: int) -> FloatArray:
        out = np.zeros(last - first + 1)
        for share, chain in self.cases:
            stays, rests = np.cumprod(chain.stays[first:last], axis=0), chain.resting[first]
            out += share * np.concatenate([[rests.sum()], stays @ rests])
        return self._if_met(out)

    def until(self, first: int, last: int) -> FloatArray:
        out = np.zeros(last - first + 1)
        for share, chain in self.cases:
            stayed = np.cumprod(chain.stayed[first:last][::-1], axis=0)[::-1]
            rests = chain.resting[last]
            out += share * np.concatenate([stayed @ rests, [rests.sum()]])
        return self._if_met(out)

    def _if_met(self, rests: FloatArray) -> FloatArray:
        """(m,) probabilities of rest, by those given that beams meet the leaf."""
        return np.asarray(self.presence * rests + 1.0 - self.presence)


@dataclass(frozen=True, eq=False)
class FurnitureRests:
    """Rests of a piece of furniture, which moves from one place to another at once."""

    stamps_ns: IntArray  # (n,)
    mixtures: Sequence[Places]  # (n)
    # (n - 1) of each component of the next moment: the object was there before
    stays: Sequence[FloatArray]

    @property
    def places(self) -> IntArray:
        return np.array([each.names[int(np.argmax(each.weights))] for each in self.mixtures])

    @property
    def shares(self) -> FloatArray:
        return np.array([each.weights.max() for each in self.mixtures])

    def since(self, first: int, last: int) -> FloatArray:
        until = self.until(first, last)
        return np.asarray(1.0 - (until - until[0]))

    def until(self, first: int, last: int) -> FloatArray:
        rests = self.mixtures[last].weights
        out = [1.0]
        for k in range(last - 1, first - 1, -1):
            rests = rests * self.stays[k]
            out.append(float(rests.sum()))
            before, after = self.mixtures[k].names, self.mixtures[k + 1].names
            kept = np.zeros(len(before))
            _, own, other = np.intersect1d(before, after, return_indices=True)
            kept[own] = rests[other]
            rests = kept
        return np.array(out[::-1])


class Movement(NamedTuple):
    """An object was moved."""

    from_ns: int  # 5 % quantile of its beginning
    to_ns: int  # 95 % quantile of its end
    before: int  # index of a moment at which it stood in its former place
    after: int  # index of one at which it stood in its new place
    probability: float  # that it didn't rest in one place between these moments


class _Spell(NamedTuple):
    """Moments, first to last, at which an object most probably rests in one component."""

    first: int
    last: int


def movements(rests: Rests, differs: Callable[[int, int], float] | None = None) -> list[Movement]:
    """The movements of an object.

    ``differs(first, last)`` is the largest probability, at any moment from the first to the last,
    that its state is another than at the first; without it all movements changed something.

    Candidates lie between two spells in which it most probably rests in one component each: from
    the most certain moment of one spell to that of the next. With S(t) the probability that it
    rests from the first moment to t, and R(t) that it rests from t to the last one, it was moved
    with 1 - S(last). It had begun to move by t with (1 - S(t)) / (1 - S(last)), and had come to
    rest by t with (R(t) - R(first)) / (1 - R(first)). All of these follow from the chain without
    approximation. An improbable movement joins its two spells, as does one that changed nothing.
    """
    shares, out = rests.shares, list[Movement]()
    current, *others = _spells(rests) or [_Spell(0, 0)]
    for following in others:
        movement = _between(rests, _surest(shares, current), _surest(shares, following))
        if movement.probability >= LIKELY and (
            differs is None or differs(movement.before, movement.after) >= LIKELY
        ):
            out.append(movement)
            current = following
        else:
            current = _Spell(current.first, following.last)
    return out


def _between(rests: Rests, first: int, last: int) -> Movement:
    """The movement between two moments."""
    stamps = rests.stamps_ns[first : last + 1].astype(float)
    since, until = rests.since(first, last), rests.until(first, last)
    moved = max(1.0 - float(since[-1]), np.finfo(float).tiny)
    began, ended = (1.0 - since) / moved, (until - until[0]) / moved
    begin, end = np.interp(TAIL, began, stamps), np.interp(1.0 - TAIL, ended, stamps)
    return Movement(round(begin), max(round(end), round(begin)), first, last, min(moved, 1.0))


def _spells(rests: Rests) -> list[_Spell]:
    """The spells of an object that are separated by at least ``STANDS_NS``."""
    stamps, places = rests.stamps_ns, rests.places
    cuts = np.flatnonzero(np.diff(places)) + 1
    bounds = zip([0, *cuts.tolist()], [*cuts.tolist(), len(places)], strict=True)
    spells = [_Spell(first, past - 1) for first, past in bounds if places[first] != MOVING]
    return [spell for spell in spells if _may_last(stamps, spell) >= STANDS_NS]


def _may_last(stamps: IntArray, spell: _Spell) -> float:
    """ns from the moment before a spell to the one after it."""
    if spell.first == 0 or spell.last == len(stamps) - 1:
        return np.inf
    return float(stamps[spell.last + 1] - stamps[spell.first - 1])


def _surest(shares: FloatArray, spell: _Spell) -> int:
    """The moment of a spell at which the object most probably rests in one component."""
    return spell.first + int(np.argmax(shares[spell.first : spell.last + 1]))
