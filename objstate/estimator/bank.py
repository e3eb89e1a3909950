"""Hypotheses about the robot's place, and their probabilities.

One place is followed. It competes with other places in the building that a search has found, and
with places that the map doesn't show. The advantage of the followed place for a scan is the
log-likelihood from there, minus the log of the mean likelihood from places all over the building. A
map that lacks something lowers both alike.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from objstate.config import Settings
from objstate.geometry import FloatArray, between, compose
from objstate.localization import Hypotheses, Odds, apart
from objstate.localization.anywhere import Chance
from objstate.localization.search import INDEPENDENCE
from objstate.particles.weights import NEVER
from objstate.records import NANOSECONDS, Scan
from objstate.units import SECONDS_PER_HOUR

START_WRONG = 0.01  # probability that a given start pose is wrong
UNMAPPED_PER_HOUR = 20.0  # rate of coming to a part of the building that the map lacks
UNMAPPED_S = 10.0  # mean duration of that
VISIT_S = 30.0  # mean duration of a visit to a room that the map lacks
THROUGH = 0.7  # share of these that it comes to through a wall, such as a door that was closed
APART = 10.0  # m between walls that odometry leads through after the robot was carried elsewhere
EXTENT = 5.0  # m, deviation of how far such a part reaches
ALIKE = 5.0  # m2 seen, by which such a part looks e times less like a place of the map
# probability of other places, not searched yet, from which on they are searched
WORTH_SEARCHING = 0.01
MISSED = 0.5  # probability that a search by one keyframe doesn't find the robot's place
REPLACED = 0.95  # probability from which another place is followed instead
PLACES, PLACES_NEAR = 4e5, 150.0  # cells of 25 cm and 4 degrees in 300 m^2, and within a slip
USUALLY = 20.0  # keyframes over which the usual advantage is averaged
HALF = 0.5
RETURNED = 2.0  # units of ``apart``, from where odometry led while another place was followed

MOMENTS = 100  # number that are kept

Kept = TypeVar("Kept")


@dataclass(frozen=True, eq=False)
class Moment(Generic[Kept]):
    """A scan that is compared with the map, and the beliefs before it."""

    scan: Scan
    odometry: FloatArray  # (3,)
    followed: FloatArray  # (3,) the pose
    kept: Kept

    @property
    def stamp_ns(self) -> int:
        """When it was taken."""
        return self.scan.stamp_ns


class Departure(NamedTuple, Generic[Kept]):
    """Where the robot was followed to, when another place won, and what was believed before."""

    since_ns: int  # from when on the other place was favoured
    odometry: FloatArray  # (3,)
    followed: FloatArray  # (3,) the pose
    kept: Kept


class Alike(NamedTuple):
    """Odds, relative to another place, of a part that the map lacks and that looks like it.

    The robot went there from the followed place, as odometry has it.
    """

    now: float  # it is still there
    before: float  # it has come back to where the map is right


class Seen(NamedTuple):
    """What the robot has seen up to each moment (m,) in a part that the map may lack."""

    seconds: FloatArray  # (m,) s since the first
    far: FloatArray  # (m,) m from where the map was right, the farthest so far
    areas: FloatArray  # (m,) m2 of the floor
    is_through: bool  # whether odometry led through a wall of the map


class Bank(Generic[Kept]):
    """Probabilities of the followed place, of other places, and of places not on the map.

    At the followed place, the map either explains an unknown share of the scan, or for a while
    nothing. At a wrong place, and where the robot is not on the map, advantages are distributed as
    those of random places up to the best of them. These are the three states of a Markov chain.
    ``Kept`` is what is restored if the robot had left the followed place some time ago.
    """

    def __init__(self, settings: Settings, now: Kept) -> None:
        s = settings.localization
        self._kidnaps, self._slips = (
            s.kidnaps_per_hour / SECONDS_PER_HOUR,
            s.slips_per_hour / SECONDS_PER_HOUR,
        )
        self._wide = settings.object_updates.max_position_std
        self._past: list[tuple[int, int]] = []
        self._probabilities: list[float] = []  # of having been lost, in each of these intervals
        self._p_lost = 0.0  # the largest since the robot has been lost
        self.lost_since_ns: int | None = None  # beginning of the present interval of being lost
        self._sought_ns: int | None = None  # when the last search was made
        self.before = now  # beliefs when the robot may have left the followed place
        self.near = 1.0  # probability of the published pose, if the followed place is right
        self._usual: float | None = None  # advantage, averaged over ``_averaged`` keyframes
        self._averaged = 1.0  # the first is that of a place which explains all
        self.moments: deque[Moment[Kept]] = deque(maxlen=MOMENTS)
        self._departures: list[Departure[Kept]] = []
        self.start(now)

    def start(self, now: Kept) -> None:
        """Follow a given place."""
        self.before = now
        self._departures.clear()
        unmapped = UNMAPPED_PER_HOUR / SECONDS_PER_HOUR * UNMAPPED_S
        self._states = np.array([1.0 - unmapped, unmapped, START_WRONG])
        self._others = (
            0.0  # odds of the places that the last search found, relative to the followed one
        )
        # of the followed one and what looks like others near it, relative to what the map shows there
        self._followed = 1.0
        self._elsewhere = Odds(HALF * START_WRONG, HALF * START_WRONG)  # not searched for yet
        self._since_keyframe = Odds()

    @property
    def p_followed(self) -> float:
        """Probability that the robot is at the followed place."""
        explained, unmapped, outside = self._states.tolist()
        here = explained + unmapped
        return float(here / (here * (1.0 + self._others) + outside))

    @property
    def is_unmapped(self) -> bool:
        """Whether the map probably lacks what is about the followed place."""
        explained, unmapped, _ = self._states.tolist()
        return bool(unmapped > explained)

    @property
    def p_localized(self) -> float:
        """Probability of the published pose, within 0.75 m and 20 degrees."""
        return self.p_followed * self.near

    @property
    def is_lost(self) -> bool:
        """Whether ``p_localized`` is below one half."""
        return self.p_localized < HALF

    def stretches(self, now_ns: int) -> tuple[tuple[int, int], ...]:
        """(from, to) ns of each interval in which the robot was probably lost, up to now.

        Intervals don't hold their end: one that goes on ends just after now. One that began later,
        with a start that was told since, has no length yet.
        """
        since_ns = self.lost_since_ns
        return (*self._past, *([] if since_ns is None else [(since_ns, max(since_ns, now_ns + 1))]))

    @property
    def probabilities(self) -> tuple[float, ...]:
        """The largest probability of being lost in each of these intervals."""
        now = () if self.lost_since_ns is None else (self._p_lost,)
        return (*self._probabilities, *now)

    def publish(self, near: float, now_ns: int) -> None:
        """Update the intervals; ``near`` is the probability of the pose at the followed place.

        Between two intervals that both last longer, the robot was taken for localized where it
        wasn't.
        """
        self.near = near
        if self.lost_since_ns is not None and self._past:
            begun, ended = self._past[-1]
            if self.lost_since_ns - ended < min(ended - begun, now_ns - self.lost_since_ns):
                self.lose(begun)
        if self.is_lost and self.lost_since_ns is None:
            self.lost_since_ns = now_ns
        elif not self.is_lost and self.lost_since_ns is not None:
            if self.lost_since_ns < now_ns:  # else another place won with this very scan
                self._past.append((self.lost_since_ns, now_ns))
                self._probabilities.append(self._p_lost)
            self.lost_since_ns, self._p_lost = None, 0.0
        if self.lost_since_ns is not None:
            self._p_lost = max(self._p_lost, 1.0 - self.p_localized)

    def take(self, moment: Moment[Kept], log_likelihood: float, chance: Chance) -> None:
        """Update by a scan's tempered log-likelihood from the followed place."""
        most = max(chance.most - chance.mean, 1.0)
        advantage = min(log_likelihood - chance.mean, most)
        since = self.moments[-1].stamp_ns if self.moments else moment.stamp_ns
        seconds = (moment.stamp_ns - since) / NANOSECONDS
        self.moments.append(moment)
        self._predict(seconds)
        middle, spread = (0.5 * (chance.best + chance.usual), 0.5 * (chance.best - chance.usual))
        wrong = _gaussian(advantage, middle, max(spread, 1.0))
        explained = 1.0 / most if advantage >= 0.0 else wrong / most
        self._states *= (explained, wrong, wrong)
        self._states /= self._states.sum()
        if self._usual is None:
            self._usual = most
        gain = math.exp(min(INDEPENDENCE * (self._usual - advantage), 500.0))
        came = Odds(self._kidnaps * seconds, self._slips * seconds)
        before = self._elsewhere
        if came.kidnapped + came.slipped > gain * (before.kidnapped + before.slipped):
            self.before = moment.kept
        kidnapped, slipped = (
            min(gain * odds, 1.0 / NEVER) for odds in (before.kidnapped, before.slipped)
        )
        self._elsewhere = Odds(kidnapped, slipped, before.width).plus(came)
        self._since_keyframe = self._since_keyframe.plus(came)
        if not self.is_lost:
            self._averaged = min(self._averaged + 1.0, USUALLY)
            self._usual += (advantage - self._usual) / self._averaged

    def widen(self, std: float) -> None:
        """Note that the belief is wide, by ``std`` m, and may narrow to a wrong place."""
        wide = Odds(width=std)
        self._elsewhere, self._since_keyframe = (
            odds.plus(wide) for odds in (self._elsewhere, self._since_keyframe)
        )

    @property
    def odds(self) -> tuple[Odds, Odds]:
        """Odds of being elsewhere at the last keyframe already, and of having left since."""
        return self._elsewhere, self._since_keyframe

    def keyframe_kept(self) -> None:
        """Note that a keyframe was kept."""
        self._since_keyframe = Odds()

    def may_search(self, now_ns: int, every_s: float) -> bool:
        """Whether other places are probable enough for a search, and the last one is old enough."""
        if self._sought_ns is not None and now_ns - self._sought_ns < every_s * NANOSECONDS:
            return False
        odds = self._elsewhere
        unsearched = odds.kidnapped / PLACES + odds.slipped / PLACES_NEAR
        is_likely = max(unsearched, self._others) > WORTH_SEARCHING or odds.width > self._wide
        return is_likely or self.p_followed < REPLACED

    def weigh(self, found: Hypotheses, best: int, alike: Alike, now_ns: int) -> bool:
        """Update by a search whose best other place has a number; whether that place wins.

        A part that the map lacks may look ``alike``. By few keyframes, a search may miss the place
        where the robot is.
        """
        self._sought_ns = now_ns
        odds = np.where(found.is_followed, 0.0, np.exp(np.minimum(found.log_odds, 500.0)))
        self._followed = 1.0 + float(odds[best]) * alike.before
        odds /= self._followed
        self._others = float(odds.sum())
        self._elsewhere = self._elsewhere.times(MISSED**found.keyframes)
        outside = math.exp(min(found.outside, 500.0)) / self._followed
        rest = max(self._odds_outside, outside) + float(odds[best]) * alike.now
        return bool(odds[best] / (1.0 + self._others + rest) >= REPLACED)

    def begins(self, moments: Sequence[Moment[Kept]], areas: FloatArray, gained: FloatArray) -> int:
        """At which of some moments (m,) a part that the map lacks began most probably.

        Each favours another place by ``gained`` and not the followed one. ``areas`` in m2 have been
        seen since then.
        """
        seconds = seconds_of(moments)
        cost = np.append(0.0, np.cumsum(gained)[:-1])
        return int(np.argmax(seconds / VISIT_S - areas / ALIKE - cost))

    def alike(self, seen: Seen, since: FloatArray) -> Alike:
        """How probable it is that a part which the map lacks looks like a place.

        The robot came there, or was carried to the place, before the first of some moments (m,). If
        it left again, it did after one of them. The followed place has gained ``since`` before the
        first and after that one.
        """
        rate, log_apart = UNMAPPED_PER_HOUR, -seen.far[-1] / APART  # of no wall in the way
        if seen.is_through:
            rate *= THROUGH
            log_apart = math.log(-math.expm1(log_apart)) if log_apart < 0.0 else 0.0
        else:
            rate *= 1.0 - THROUGH
        log = math.log(rate / (self._kidnaps * SECONDS_PER_HOUR)) - log_apart
        log -= seen.seconds / VISIT_S
        log -= seen.areas / ALIKE + 0.5 * np.square(seen.far / EXTENT)
        waits = np.diff(seen.seconds).clip(min=NEVER) / VISIT_S
        log += since
        left = log[:-1] + np.log(waits)
        return Alike(
            math.exp(min(float(log[-1]), 500.0)), float(np.exp(left.clip(max=500.0)).sum())
        )

    @property
    def _odds_outside(self) -> float:
        """Odds of a place that the map doesn't show, relative to the followed place."""
        return float(self._states[2]) / max(float(self._states[:2].sum()), NEVER)

    def begin(self, found: Hypotheses) -> bool:
        """Whether one of the places, all equally probable a priori, is followed from now on."""
        odds = np.exp(np.minimum(found.log_odds, 500.0))
        if odds.max() / (odds.sum() + math.exp(found.outside)) < REPLACED:
            return False
        self._turn_to(found, 0, float(odds.sum()), 0.0)
        return True

    def follow(self, found: Hypotheses, chosen: int, kept: Kept, since_ns: int) -> None:
        """Follow another place, to which the robot came at a stamp, with the beliefs ``kept``."""
        self.lose(since_ns)
        every = self._followed * (1.0 + self._others)
        self._turn_to(found, chosen, every, self._odds_outside)
        self.before = kept
        last = self.moments[-1]
        self._departures = [each for each in self._departures if each.since_ns < since_ns]
        self._departures.append(Departure(since_ns, last.odometry, last.followed, kept))
        earlier = [each for each in self.moments if each.stamp_ns < since_ns]
        self.moments = deque(earlier, maxlen=MOMENTS)

    def departure(self, place: FloatArray) -> Departure[Kept] | None:
        """Since when the robot seemed elsewhere, if a place (3,) is where odometry led since then.

        It was carried nowhere then: that it was carried to another place, and back to here, has the
        square of the probability of the first, and it could have been carried back to anywhere.
        """
        now = self.moments[-1].odometry
        for each in self._departures:
            if apart(place, compose(each.followed, between(each.odometry, now))) <= RETURNED:
                return each
        return None

    def _turn_to(self, found: Hypotheses, chosen: int, every: float, outside: float) -> None:
        """Follow a found place, by the odds of ``every`` place on the map and ``outside`` of it."""
        odds = math.exp(min(found.log_odds[chosen], 500.0))
        outside = max(outside, math.exp(min(found.outside, 500.0))) / odds
        self._states = np.array([1.0, 0.0, outside]) / (1.0 + outside)
        self._others = max(every / odds - 1.0, 0.0)
        self._elsewhere = Odds()

    def lose(self, since_ns: int) -> None:
        """Note that the robot has probably been lost since a stamp."""
        while self._past and self._past[-1][1] >= since_ns:
            begun, _ = self._past.pop()
            since_ns = min(since_ns, begun)
            self._p_lost = max(self._p_lost, self._probabilities.pop())
        known = since_ns if self.lost_since_ns is None else self.lost_since_ns
        self.lost_since_ns = min(known, since_ns)
        self._p_lost = max(self._p_lost, 1.0 - self.p_localized)

    def _predict(self, seconds: float) -> None:
        """Predict the states of the chain."""
        begins, ends = UNMAPPED_PER_HOUR / SECONDS_PER_HOUR, 1.0 / UNMAPPED_S
        explained, unmapped, outside = self._states.tolist()
        share = (explained + unmapped) * begins / (begins + ends)
        unmapped = share + (unmapped - share) * math.exp(-(begins + ends) * seconds)
        explained = 1.0 - outside - unmapped
        # to places that the map doesn't show, and back
        taken = -math.expm1(-self._kidnaps * seconds)
        kept = 1.0 - taken
        self._states = np.array(
            [
                kept * explained,
                kept * unmapped + taken * outside,
                kept * outside + taken * (explained + unmapped),
            ]
        )


def seconds_of(moments: Sequence[Moment[Kept]]) -> FloatArray:
    """(m,) s of some moments since the first."""
    return np.array([each.stamp_ns - moments[0].stamp_ns for each in moments]) / NANOSECONDS


def _gaussian(value: float, mean: float, std: float) -> float:
    return math.exp(-0.5 * ((value - mean) / std) ** 2) / (std * math.sqrt(2.0 * math.pi))
