"""The forward pass over looks with its derivatives, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from objstate.compiling import called_with, inner, njit, record
from objstate.geometry import FloatArray, IntArray
from objstate.habits.calendar import CELL_S

CLOSE = 1e-5  # eigenvalues times seconds that differ by less count as equal
LEAST = 1e-300  # probability

_compile = njit(nogil=True, error_model="numpy")
_inner = inner(nogil=True, error_model="numpy")
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy")


@record("process", "f2 f3 f3 f4 i2 i2 f2")
class Process(NamedTuple):
    """A Markov process by the key of a cell (k), and what its local parameters (u) depend on."""

    rates: FloatArray  # (k, s) 1/s, eigenvalues of the generator
    right: FloatArray  # (k, s, s) its right eigenvectors
    left: FloatArray  # (k, s, s) the inverse of those
    local_slopes: FloatArray  # (k, u, s, s) derivatives by local parameters, in its eigenvectors
    which: IntArray  # (k, a) parameters that matter
    to: IntArray  # (k, a) the local one of each
    by: FloatArray  # (k, a) by how much


@_inner
def _transitions(right: FloatArray, left: FloatArray, kept: FloatArray, passes: FloatArray) -> None:
    """Let ``passes`` (s, s) be the transition probabilities over a time in which modes keep ``kept`` (s,)."""
    s = kept.shape[0]
    for m in range(s):
        for j in range(s):
            x = 0.0
            for r in range(s):
                x += right[m, r] * kept[r] * left[r, j]
            passes[m, j] = x


@_maker
def _moved(
    state: FloatArray,
    rates: FloatArray,
    right: FloatArray,
    left: FloatArray,
    local_slopes: FloatArray,
    kept: FloatArray,
    seconds: float,
    moved: FloatArray,
) -> None:
    """Let ``moved`` (u, s) be the derivatives of the next state by the local parameters (Daleckii and Krein)."""
    s = state.shape[0]
    begin, gain = np.empty(s), np.empty((s, s))
    for m in range(s):
        begin[m] = 0.0
        for r in range(s):
            begin[m] += state[r] * right[r, m]
        for j in range(s):
            apart = rates[m] - rates[j]
            if abs(apart) * seconds < CLOSE:
                gain[m, j] = seconds * np.exp(0.5 * (rates[m] + rates[j]) * seconds)
            else:
                gain[m, j] = (kept[m] - kept[j]) / apart
    for u in range(moved.shape[0]):
        for j in range(s):
            moved[u, j] = 0.0
        for j in range(s):
            mixed = 0.0
            for m in range(s):
                mixed += begin[m] * local_slopes[u, m, j] * gain[m, j]
            for r in range(s):
                moved[u, r] += mixed * left[j, r]


@_inner
def _onward(values: FloatArray, passes: FloatArray, out: FloatArray) -> None:
    """Let ``out`` (s, n) be values (s, n) after a transition."""
    for j in range(out.shape[0]):
        for c in range(out.shape[1]):
            out[j, c] = 0.0
        for m in range(out.shape[0]):
            passed = passes[m, j]
            for c in range(out.shape[1]):
                out[j, c] += values[m, c] * passed


@_inner
def _inform(
    state: FloatArray,
    slope: FloatArray,
    look: FloatArray,
    told: FloatArray,
    information: FloatArray,
) -> None:
    """Add Fisher's information of a look that is as sure as this one, ahead of it."""
    regions, weight = look.shape[0], 0.0
    for r in range(regions):
        weight += look[r]
    error = 1.0 - 1.0 / weight
    off = error / (regions - 1)
    on = 1.0 - error - off
    for r in range(regions):
        seen = max(off + on * (state[2 * r] + state[2 * r + 1]), LEAST)
        gain = on / np.sqrt(seen)
        for c in range(told.shape[0]):
            told[c] = gain * (slope[2 * r, c] + slope[2 * r + 1, c])
        for c in range(told.shape[0]):
            for d in range(c + 1):
                information[c, d] += told[c] * told[d]


@_maker
def _condition(state: FloatArray, slope: FloatArray, look: FloatArray, score: FloatArray) -> float:
    """Take a look in; the probability of it."""
    s, chance = state.shape[0], 0.0
    for j in range(s):
        chance += state[j] * look[j // 2]
    chance = max(chance, LEAST)
    change = np.zeros(slope.shape[1])
    for j in range(s):
        gain = look[j // 2] / chance
        state[j] *= gain
        for c in range(slope.shape[1]):
            slope[j, c] *= gain
            change[c] += slope[j, c]
    for c in range(slope.shape[1]):
        score[c] += change[c]
    for j in range(s):
        for c in range(slope.shape[1]):
            slope[j, c] -= state[j] * change[c]
    return chance


@_maker
def _pass(
    process: Process,
    k: int,
    seconds: float,
    state: FloatArray,
    slope: FloatArray,
    moved_on: FloatArray,
) -> None:
    """Let some seconds pass in a cell of the key k: ``state`` (s,) is changed.

    Its derivatives are ``slope`` (s, p) before, and ``moved_on`` (s, p) are set to those after.
    """
    s, rates, right, left = state.shape[0], process.rates[k], process.right[k], process.left[k]
    local_slopes, which, to = process.local_slopes[k], process.which[k], process.to[k]
    kept, passes, before = np.empty(s), np.empty((s, s)), np.empty((s, 1))
    moved = np.empty((local_slopes.shape[0], s))
    for j in range(s):
        kept[j] = np.exp(rates[j] * seconds)
        before[j, 0] = state[j]
    _transitions(right, left, kept, passes)
    _moved(state, rates, right, left, local_slopes, kept, seconds, moved)
    _onward(slope, passes, moved_on)
    _onward(before, passes, state.reshape(s, 1))
    for j in range(s):
        state[j] = max(state[j], 0.0)
    for m in range(which.shape[0]):
        for j in range(s):
            moved_on[j, which[m]] += process.by[k, m] * moved[to[m], j]


@called_with("i1 i process f3 f4")
@_compile
def whole_days(
    kinds: IntArray,
    per_day: int,
    process: Process,
    passes: FloatArray,
    slopes: FloatArray,
) -> None:
    """Set the transition probabilities over whole days of some ``kinds`` (d,), and their derivatives.

    ``passes`` is (k, s, s) and ``slopes`` (k, s, s, p), of all kinds. A day has the cells of so many
    keys.
    """
    s, p = passes.shape[1], slopes.shape[3]
    state, slope, moved_on = np.empty(s), np.empty((s, p)), np.empty((s, p))
    for kind in kinds:
        for begin in range(s):
            state[:], slope[:] = 0.0, 0.0
            state[begin] = 1.0
            for k in range(kind * per_day, (kind + 1) * per_day):
                _pass(process, k, CELL_S, state, slope, moved_on)
                slope, moved_on = moved_on, slope
            for j in range(s):
                passes[kind, begin, j] = state[j]
                for c in range(p):
                    slopes[kind, begin, j, c] = slope[j, c]


@called_with("f1 i1 f1 i1 f2 process f3 f4 f1 f2")
@_compile
def forward(
    state: FloatArray,
    keys: IntArray,
    seconds: FloatArray,
    looks: IntArray,
    likelihood: FloatArray,
    process: Process,
    over_days: FloatArray,
    day_slopes: FloatArray,
    score: FloatArray,
    information: FloatArray,
) -> float:
    """Log-likelihood of looks; ``score`` (p,) and ``information`` (p, p) are written to.

    ``state`` (s,), known before the first step, is brought to after the last. Step i lets
    ``seconds[i]`` pass in the cell of the key ``keys[i]``, and then takes look ``looks[i]`` in, if
    that isn't -1. Keys past those of all cells are whole days, as ``whole_days`` has them.
    ``likelihood`` (n, r) is scaled to 1 at its largest. The information is Fisher's, expected over
    what the door might have shown, of looks as sure as each was.
    """
    s, p, cells = state.shape[0], score.shape[0], process.rates.shape[0]
    told, before = np.empty(p), np.empty((s, 1))
    slope, moved_on = np.zeros((s, p)), np.empty((s, p))  # derivatives of the state
    total = 0.0
    information[:] = 0.0
    score[:] = 0.0
    for i in range(keys.shape[0]):
        k, t = keys[i], seconds[i]
        if k >= cells:
            passes, day = over_days[k - cells], day_slopes[k - cells]
            before[:, 0] = state
            _onward(slope, passes, moved_on)
            _onward(before, passes, state.reshape(s, 1))
            for j in range(s):
                for m in range(s):
                    for c in range(p):
                        moved_on[j, c] += before[m, 0] * day[m, j, c]
            slope, moved_on = moved_on, slope
        elif t > 0.0:
            _pass(process, k, t, state, slope, moved_on)
            slope, moved_on = moved_on, slope
        if looks[i] >= 0:
            look = likelihood[looks[i]]
            _inform(state, slope, look, told, information)
            total += np.log(_condition(state, slope, look, score))
    for c in range(p):
        for d in range(c):
            information[d, c] = information[c, d]
    return total


@_maker
def _over(
    rates: FloatArray, right: FloatArray, left: FloatArray, seconds: float, passes: FloatArray
) -> FloatArray:
    """The transition probabilities (s, s) over some seconds, written to ``passes``."""
    _transitions(right, left, np.exp(rates * seconds), passes)
    for m in range(rates.shape[0]):
        for j in range(rates.shape[0]):
            passes[m, j] = max(passes[m, j], 0.0)
    return passes


@called_with("f2 f3 f3 i1 f1 i1 f2 f1 f2 i1")
@_compile
def sampled(
    rates: FloatArray,
    right: FloatArray,
    left: FloatArray,
    keys: IntArray,
    seconds: FloatArray,
    looks: IntArray,
    likelihood: FloatArray,
    dice: FloatArray,
    filtered: FloatArray,
    out: IntArray,
) -> None:
    """A path of states ``out`` (m,) at the ends of steps, by filtering forward and sampling backward.

    Rates (k, s) and eigenvectors (k, s, s) are those of a process by key. Steps have keys (m,),
    seconds (m,) and looks (m,), numbers of likelihoods (n, s), or -1. ``dice`` (m,) are uniform.
    ``filtered`` (m + 1, s) begins with the state before the first step.
    """
    count, states = keys.shape[0], rates.shape[1]
    part, whole = np.empty((states, states)), np.empty(right.shape)  # over a cell, by key
    for k in range(rates.shape[0]):
        _over(rates[k], right[k], left[k], CELL_S, whole[k])
    for i in range(count):
        k, passes = keys[i], whole[keys[i]]
        if seconds[i] != CELL_S:
            passes = _over(rates[k], right[k], left[k], seconds[i], part)
        total = 0.0
        for j in range(states):
            x = 0.0
            for m in range(states):
                x += filtered[i, m] * passes[m, j]
            filtered[i + 1, j] = x * likelihood[looks[i], j] if looks[i] >= 0 else x
            total += filtered[i + 1, j]
        for j in range(states):
            filtered[i + 1, j] = filtered[i + 1, j] / total if total > 0.0 else filtered[i, j]
    chance = filtered[count].copy()
    for i in range(count - 1, -1, -1):
        rest, state = dice[i] * chance.sum(), 0
        while state < states - 1 and rest >= chance[state]:
            rest -= chance[state]
            state += 1
        out[i] = state
        k, passes = keys[i], whole[keys[i]]
        if seconds[i] != CELL_S:
            passes = _over(rates[k], right[k], left[k], seconds[i], part)
        for j in range(states):
            chance[j] = filtered[i, j] * passes[j, state]
