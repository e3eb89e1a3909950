"""Whether the robot is where it thinks it is, kept apart from whether the world has changed."""

from __future__ import annotations

from enum import Enum

import numpy as np

from objstate.config import Settings
from objstate.geometry import FloatArray, compose
from objstate.localization import APART, Hypotheses, apart
from objstate.records import NANOSECONDS

AGAIN = 0.25  # of the usual time between searches, after one by which the track is wrong
TIED = 0.1  # probability from which a place isn't excluded
NARROW = 1e-9  # the width, as in `apart`, of a track that means one place


class Verdict(Enum):
    """What searches say of the track."""

    OPEN = "open"
    HERE = "here"  # no place explains the last scans better
    NOT_HERE = "not here"  # others do, but which of them?
    ELSEWHERE = "elsewhere"  # one place does, surely


class Doubt:
    """The record of a robot's being lost: since when, how often before, when to search next.

    Each time that nothing better than the track is found doubles the wait until it may be doubted
    again: then it is the world that has changed, or the laser that sees through glass.
    """

    def __init__(self, settings: Settings) -> None:
        self._lost, self._search = settings.localization, settings.search
        self._past: list[tuple[int, int]] = []
        self._fitted_ns: int | None = None  # the last moment at which the track surely fitted
        self._fitted_since_ns: int | None = None  # without a break
        self._trusted_ns = 0
        self._search_from_ns = 0
        self._wait = self._search.every_s
        self._winner: FloatArray | None = None  # (3,) of the last search, driven on
        self._wins = 0  # searches in a row that agreed on it
        self._denials = 0  # searches in a row by which the track is wrong, whatever else is right
        self._width = NARROW  # of the places that the track may mean, as in `apart`
        self.is_lost = False
        self.is_new = True  # no search has told whether the track is right from its start on

    def stretches(self, now_ns: int) -> tuple[tuple[int, int], ...]:
        """(from, to) ns of each time that the robot was lost, the present one up to now."""
        return (*self._past, *([(self._since(now_ns), now_ns)] if self.is_lost else []))

    def may_search(self, now_ns: int) -> bool:
        """Whether a search isn't pointless so soon after the last."""
        return now_ns >= self._search_from_ns

    def rise(self, now_ns: int) -> None:
        """The track doesn't fit any more."""
        self.is_lost = True
        self._fitted_ns = self._since(now_ns)
        self._forget_winner()
        self._search_from_ns = now_ns

    def dispel(self, now_ns: int) -> bool:
        """The track fits; whether what was learnt until now may be trusted from now on."""
        if self._fitted_since_ns is None:
            self._fitted_since_ns = now_ns
        self._fitted_ns = now_ns
        self._forget_winner()
        if now_ns - self._fitted_since_ns >= self._lost.doubt_after * NANOSECONDS:
            self._search_from_ns, self._wait = 0, self._search.every_s
        if now_ns - self._trusted_ns < 2.0 * self._lost.fit_after * NANOSECONDS:
            return False
        self._trusted_ns = now_ns
        return True

    def blur(self, std: float) -> None:
        """The track has become wide, by ``std`` m: it isn't the one that was followed, wherever it settles."""
        self.is_new = True
        self._width = max(self._width, std / APART[0])

    def weigh(self, found: Hypotheses, track: FloatArray | None, now_ns: int) -> Verdict:
        """What a search says, and those before it, of the track (3,): who is it that wins?"""
        wait = self._search.every_s if self.is_lost else self._wait
        self._search_from_ns = now_ns + int(wait * NANOSECONDS)
        self._fitted_since_ns = None
        shares = self._favoured(found, track)
        best, sure = found.poses[int(np.argmax(shares))], self._search.sure
        agrees = self._winner is not None and apart(self._winner, best) <= 1.0
        self._wins = (self._wins if agrees else 0) + 1 if shares.max() >= sure else 0
        self._winner = best if self._wins else None
        if self._wins >= self._search.confirmed:
            return Verdict.ELSEWHERE if track is None or apart(track, best) > 1.0 else Verdict.HERE
        if track is None or self.is_lost:
            return Verdict.OPEN
        share = float(shares[apart(found.poses, track) <= 1.0].sum())
        is_vague, is_late = self._width > NARROW, found.looks > self._search.confirmed
        is_denied = share < (sure if is_vague and is_late else 1.0 - sure)
        self._denials = self._denials + 1 if is_denied else 0
        if self._denials >= self._search.confirmed:
            return Verdict.NOT_HERE
        if self._denials > 0:
            self._search_from_ns = now_ns + int(AGAIN * self._search.every_s * NANOSECONDS)
            return Verdict.OPEN
        is_as_good = (is_late and share >= TIED) or apart(track, best) <= 1.0
        return Verdict.HERE if is_as_good and not is_vague else Verdict.OPEN

    def _favoured(self, found: Hypotheses, track: FloatArray | None) -> FloatArray:
        """The hypotheses' probabilities (h,), the track's favoured by what was known before.

        So are places about one that was wide, by Student's distribution: it was wide where nothing told how wide.
        """
        if track is None or self.is_lost:
            return found.shares
        away = np.maximum(apart(found.poses, track) - 1.0, 0.0) / self._width
        shares = (1.0 + (self._search.track_odds - 1.0) / (1.0 + away**2) ** 2) * found.shares
        return np.asarray(shares / shares.sum())

    def drive(self, step: FloatArray) -> None:
        """The robot has moved by a step (3,) of odometry."""
        if self._winner is not None:
            self._winner = compose(self._winner, step)

    def found(self, now_ns: int) -> None:
        """The robot was found in another place."""
        self._end(now_ns)
        self._confirm()
        self._fitted_ns, self._wait = now_ns, self._search.every_s

    def start_anew(self, now_ns: int) -> None:
        """Somebody says where the robot is: a start like the first, which no search has confirmed."""
        self._end(now_ns)
        self.is_new, self._width = True, NARROW
        if self._fitted_ns is not None:  # else it is the first start
            self._fitted_ns = now_ns
        self._fitted_since_ns = None
        self._search_from_ns, self._wait = 0, self._search.every_s

    def settle(self, now_ns: int) -> None:
        """No place fits better: the robot is where it thought, and the world has changed.

        If it was said to be lost, it was, as far as objects go: what it learnt of them was taken back.
        """
        self._end(now_ns)
        if not self.is_new:  # else the start was confirmed, and no doubt turned out to be vain
            self._wait *= 2.0
        self._confirm()
        self._fitted_ns = now_ns
        self._search_from_ns = now_ns + int(self._wait * NANOSECONDS)

    def _end(self, now_ns: int) -> None:
        """The robot isn't lost any more, if it was, and what searches said of it is settled."""
        if self.is_lost:
            self._past.append((self._since(now_ns), now_ns))
        self.is_lost = False
        self._forget_winner()

    def _confirm(self) -> None:
        """A search has told where the robot is."""
        self.is_new, self._width = False, NARROW

    def _since(self, now_ns: int) -> int:
        return now_ns if self._fitted_ns is None else self._fitted_ns

    def _forget_winner(self) -> None:
        self._winner, self._wins, self._denials = None, 0, 0
