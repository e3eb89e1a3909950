"""A door as a two-state process in continuous time, observed at some moments only.

Looks that lie close together carry little more information than one, and looks far apart determine
the share of time open, but not how often the door was moved between them. The information of a look
about the door a time t later is its memory ``c(t)``: an open door is then open with the probability
``p + (1 - p) c(t)``, a closed one with ``p - p c(t)``, where ``p`` is the share of time open.

The memory of a door that opens and closes at constant rates is ``exp(-r t)`` (Kalbfleisch and
Lawless 1985, *The analysis of panel data under a Markov assumption*, JASA 80). Real doors stand
closed all night and are moved often by day, so that two such parts are mixed here, a slow and a
quick one: ``c(t) = w exp(-r1 t) + (1 - w) exp(-r2 t)``. The likelihood is that of neighbouring
looks (a composite likelihood; Varin, Reid and Firth 2011, Statistica Sinica 21).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.statistics.sampling import sample
from objstate.statistics.summed import Summed

# Times, s, after which a part of the memory may have faded: shorter than a minute nobody
# cares, and a season is more than most robots can tell.
SHORTEST_MEMORY, LONGEST_MEMORY = 60.0, 90 * 86400.0
ALONE = 1 / 3  # prior probability of constant rates; else the slow part is uniform in 0..1
LEAST = 1e-12  # no state is less likely than this
LEVEL = 0.9  # of all intervals


@dataclass(frozen=True)
class Interval:
    """A median and the central 90 %."""

    value: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Looks:
    """When a door was seen, and whether it was open."""

    stamps_ns: IntArray  # (n,) ascending
    open: BoolArray  # (n,)

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def summed(self) -> Summed:
        """The same by the minute."""
        return Summed.of(self.stamps_ns, self.open)


@dataclass(frozen=True, eq=False)
class Memory:
    """Samples of a door's parameters."""

    share: FloatArray  # (k,) of time open
    slow: FloatArray  # (k,) 1/s, rate at which the slow part of the memory fades
    quick: FloatArray  # (k,) 1/s, that of the quick part
    slow_part: FloatArray  # (k,) 0..1

    @property
    def open_spell(self) -> Interval:
        """Seconds that the door stays open, in the mean."""
        return interval_of(1 / (self._fading * (1 - self.share)))

    @property
    def closed_spell(self) -> Interval:
        """Seconds that the door stays closed, in the mean."""
        return interval_of(1 / (self._fading * self.share))

    def after(self, seconds: FloatArray) -> FloatArray:
        """(...) c(t), the mean over the samples."""
        times = np.append(0.0, np.geomspace(SHORTEST_MEMORY / 60, 100 * LONGEST_MEMORY, 300))
        slow = self.slow_part[:, None] * np.exp(-self.slow[:, None] * times)
        quick = (1 - self.slow_part[:, None]) * np.exp(-self.quick[:, None] * times)
        known = (slow + quick).mean(axis=0)
        return np.asarray(np.interp(np.log1p(seconds), np.log1p(times), known))

    @property
    def _fading(self) -> FloatArray:
        """(k,) 1/s, initial rate at which the memory fades; it gives the rate of moves."""
        return self.slow_part * self.slow + (1 - self.slow_part) * self.quick


def memory(looks: Summed, rng: np.random.Generator) -> Memory:
    """The posterior of a door's parameters by looks, at least one.

    The prior is Jeffreys' for the share, uniform in ``arcsin(sqrt(p))``. The slow rate is uniform
    in the logarithm between one over the longest and the shortest memory, the quick one between the
    slow one and the latter. With the probability ALONE there is only one part.
    """
    gaps, counts = looks.neighbours()
    first = bool(looks.first_open[0])
    return _memory(sample(lambda unit: _log_likelihood(_memory(unit), first, gaps, counts), 4, rng))


def _memory(unit: FloatArray) -> Memory:
    """The door for each point (k, 4) of the unit cube, on which the prior is uniform."""
    low, high = -np.log(LONGEST_MEMORY), -np.log(SHORTEST_MEMORY)
    slow = low + unit[:, 1] * (high - low)
    quick = slow + unit[:, 2] * (high - slow)
    share = np.clip(np.sin(unit[:, 0] * np.pi / 2) ** 2, LEAST, 1 - LEAST)
    part = np.minimum(unit[:, 3] / (1 - ALONE), 1.0)
    return Memory(share, np.exp(slow), np.exp(quick), part)


def _log_likelihood(door: Memory, first: bool, gaps: FloatArray, counts: IntArray) -> FloatArray:
    """(k,) of the first look and of each after its neighbour."""
    slow, quick = (np.expm1(-rate[:, None] * gaps) for rate in (door.slow, door.quick))
    faded = -(door.slow_part[:, None] * slow + (1 - door.slow_part[:, None]) * quick)  # 1 - c
    share = door.share[:, None]
    opened, closed = share * faded, (1 - share) * faded
    total = np.log(door.share if first else 1 - door.share)
    for count, chance in zip(counts.T, (1 - opened, opened, closed, 1 - closed), strict=True):
        total = total + np.log(np.maximum(chance, LEAST)) @ count
    return np.asarray(total)


def interval_of(values: FloatArray) -> Interval:
    """The median and the central 90 % of samples (k,)."""
    tail = (1 - LEVEL) / 2
    lower, median, upper = np.quantile(values, [tail, 0.5, 1 - tail])
    return Interval(float(median), float(lower), float(upper))
