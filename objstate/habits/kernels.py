"""The forward pass over looks with its derivatives, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.habits.calendar import CELL_S

CLOSE = 1e-5  # eigenvalues times seconds that differ by less count as equal
FORGOTTEN = 1e-9  # a derivative of the state that is smaller is none
LEAST = 1e-300  # probability

_compile = njit(nogil=True, error_model="numpy")
_inner = inner(nogil=True, error_model="numpy")


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


@_inner
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
    for u in range(moved.shape[0]):
        for j in range(s):
            moved[u, j] = 0.0
        for j in range(s):
            mixed = 0.0
            for m in range(s):
                a = 0.0
                for r in range(s):
                    a += state[r] * right[r, m]
                apart = rates[m] - rates[j]
                if abs(apart) * seconds < CLOSE:
                    gain = seconds * np.exp(0.5 * (rates[m] + rates[j]) * seconds)
                else:
                    gain = (kept[m] - kept[j]) / apart
                mixed += a * local_slopes[u, m, j] * gain
            for r in range(s):
                moved[u, r] += mixed * left[j, r]


@_inner
def _onward(rows: FloatArray, which: IntArray, count: int, passes: FloatArray) -> None:
    """Take the first ``count`` of ``which`` rows (p, s) through a transition."""
    s = passes.shape[0]
    out = np.empty(s)
    for c in range(count):
        q = which[c]
        for j in range(s):
            out[j] = 0.0
            for m in range(s):
                out[j] += rows[q, m] * passes[m, j]
        for j in range(s):
            rows[q, j] = out[j]


@_inner
def _inform(
    state: FloatArray,
    slope: FloatArray,
    live: IntArray,
    count: int,
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
        for c in range(count):
            change = slope[live[c], 2 * r] + slope[live[c], 2 * r + 1]
            told[c, r] = on * change / np.sqrt(seen)
    for c in range(count):
        for d in range(c + 1):
            x = 0.0
            for r in range(regions):
                x += told[c, r] * told[d, r]
            information[live[c], live[d]] += x
            if c != d:
                information[live[d], live[c]] += x


@_inner
def _condition(
    state: FloatArray,
    slope: FloatArray,
    live: IntArray,
    is_live: BoolArray,
    count: int,
    look: FloatArray,
    score: FloatArray,
) -> tuple[float, int]:
    """Take a look in; the probability of it, and how many parameters still matter."""
    s, chance = state.shape[0], 0.0
    for j in range(s):
        chance += state[j] * look[j // 2]
    chance = max(chance, LEAST)
    for j in range(s):
        state[j] *= look[j // 2] / chance
    left_over = 0
    for c in range(count):
        q, change, most = live[c], 0.0, 0.0
        for j in range(s):
            slope[q, j] *= look[j // 2] / chance
            change += slope[q, j]
        score[q] += change
        for j in range(s):
            slope[q, j] -= state[j] * change
            most = max(most, abs(slope[q, j]))
        if most > FORGOTTEN:
            live[left_over] = q
            left_over += 1
        else:
            slope[q], is_live[q] = 0.0, False
    return chance, left_over


@_inner
def _largest(values: FloatArray) -> Any:
    """The largest magnitude of values (s,)."""
    largest = 0.0
    for j in range(values.shape[0]):
        largest = max(largest, abs(values[j]))
    return largest


@called_with("f1 f2 i1 f1 i1 f2 f2 f3 f3 f4 i2 i2 f2 f1 f2")
@_compile
def forward(
    state: FloatArray,
    slope: FloatArray,
    keys: IntArray,
    seconds: FloatArray,
    looks: IntArray,
    likelihood: FloatArray,
    rates: FloatArray,
    right: FloatArray,
    left: FloatArray,
    local_slopes: FloatArray,
    which: IntArray,
    to: IntArray,
    by: FloatArray,
    score: FloatArray,
    information: FloatArray,
) -> float:
    """Log-likelihood of looks; ``score`` (p,) and ``information`` (p, p) are added to.

    ``state`` (s,) and its derivatives ``slope`` (p, s) are brought from before the first step to after
    the last. Step i lets ``seconds[i]`` pass in the cell of the key ``keys[i]``, and then takes look
    ``looks[i]`` in, if that isn't -1. ``likelihood`` (n, r) is scaled to 1 at its largest. The information
    is Fisher's, expected over what the door might have shown, of looks as sure as each was.
    """
    s, p = state.shape[0], slope.shape[0]
    live, is_live, count = np.empty(p, dtype=np.int64), np.zeros(p, dtype=np.bool_), 0
    for q in range(p):  # parameters that the state depends on yet
        if _largest(slope[q]) > FORGOTTEN:
            live[count], is_live[q] = q, True
            count += 1
    kept, passes, one = np.empty(s), np.empty((s, s)), np.zeros(1, dtype=np.int64)
    moved, told, states = (
        np.empty((local_slopes.shape[1], s)),
        np.empty((p, s // 2)),
        np.empty((1, s)),
    )
    total = 0.0
    for i in range(keys.shape[0]):
        k, t = keys[i], seconds[i]
        if t > 0.0:
            for j in range(s):
                kept[j] = np.exp(rates[k, j] * t)
            _transitions(right[k], left[k], kept, passes)
            _moved(state, rates[k], right[k], left[k], local_slopes[k], kept, t, moved)
            _onward(slope, live, count, passes)
            for j in range(s):  # assigning a whole row takes seconds to compile
                states[0, j] = state[j]
            _onward(states, one, 1, passes)
            for j in range(s):
                state[j] = max(states[0, j], 0.0)
            for m in range(which.shape[1]):
                q = which[k, m]
                if by[k, m] != 0.0:
                    if not is_live[q]:
                        live[count], is_live[q] = q, True
                        count += 1
                    for j in range(s):
                        slope[q, j] += by[k, m] * moved[to[k, m], j]
        if looks[i] >= 0:
            look = likelihood[looks[i]]
            _inform(state, slope, live, count, look, told, information)
            chance, count = _condition(state, slope, live, is_live, count, look, score)
            total += np.log(chance)
    return total


@_inner
def _over(
    rates: FloatArray, right: FloatArray, left: FloatArray, seconds: float, passes: FloatArray
) -> FloatArray:
    """The transition probabilities (s, s) over some seconds, written to ``passes``."""
    _transitions(right, left, np.exp(rates * seconds), passes)
    for m in range(rates.shape[0]):
        for j in range(rates.shape[0]):
            passes[m, j] = max(passes[m, j], 0.0)
    return passes


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
