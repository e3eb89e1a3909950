"""The true states of the objects over time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.errors import SettingsError
from objstate.geometry import FloatArray, interpolate_pose, wrap
from objstate.records import TrueState
from objstate.simulation.scene import ObjectRule, PlanarState, Value


@dataclass(frozen=True, eq=False)
class Swing:
    """One movement of an object."""

    start: float  # s
    duration: float  # s
    target: FloatArray  # (d,)


@dataclass(frozen=True, eq=False)
class StateHistory:
    """The state of one object at any time."""

    object: MovableObject
    initial: FloatArray  # (d,)
    swings: tuple[Swing, ...] = ()

    def at(self, time: float) -> FloatArray:
        """The state (d,) at ``time`` s."""
        state = self.initial
        for swing in self.swings:
            if time < swing.start:
                break
            state = self._between(state, swing.target, _progress(time, swing))
        return state

    def change_times(self, step: float) -> FloatArray:
        """Times (n,) s at which the state is recorded: 0, and while it moves."""
        moving = [
            swing.start + np.append(np.arange(0.0, swing.duration, step), swing.duration)
            for swing in self.swings
        ]
        return np.unique(np.concatenate([[0.0], *moving]))

    def _between(self, a: FloatArray, b: FloatArray, share: float) -> FloatArray:
        if share >= 1.0:
            return b
        if self.object.kind is Kind.PLANAR:
            return interpolate_pose(a, b, share)
        if self.object.wraps:
            return wrap(a + share * wrap(b - a))
        return a + share * (b - a)


def histories(
    building: Building, rules: tuple[ObjectRule, ...], rng: np.random.Generator
) -> dict[str, StateHistory]:
    """The history of every object of a building, by name.

    Raises SettingsError for a rule that matches nothing or a state that an object can't take.
    """
    matched: dict[int, list[str]] = {index: [] for index in range(len(rules))}
    for name in sorted(building.objects):
        fitting = [i for i, rule in enumerate(rules) if fnmatchcase(name, rule.name)]
        if fitting:
            matched[fitting[0]].append(name)
    found = {name: StateHistory(item, item.home) for name, item in building.objects.items()}
    for index, names in matched.items():
        if not names:
            raise SettingsError(
                f"objects.{index}: '{rules[index].name}' matches no object that an earlier rule "
                f"left; the building has {', '.join(sorted(building.objects)) or 'none'}."
            )
        shares = (rng.permutation(len(names)) + rng.random(len(names))) / len(names)
        for name, share in zip(names, shares, strict=True):
            found[name] = _history(building[name], rules[index], float(share), rng)
    return found


def true_states(
    history: Mapping[str, StateHistory], start_ns: int, step: float
) -> Iterator[TrueState]:
    """Rows of truth for all objects, in time order; each holds from its stamp on."""
    moments = sorted(
        (start_ns + round(time * 1e9), name, time)
        for name, item in history.items()
        for time in item.change_times(step).tolist()
    )
    for stamp, name, time in moments:
        item = history[name]
        for coordinate, value in zip(item.object.coordinates, item.at(time), strict=True):
            yield TrueState(stamp, name, coordinate, round(float(value), 9))


def _progress(time: float, swing: Swing) -> float:
    """How far a movement has come: starting and ending gently, as half a cosine."""
    if time >= swing.start + swing.duration:
        return 1.0
    return float(0.5 - 0.5 * np.cos(np.pi * (time - swing.start) / swing.duration))


def _history(
    item: MovableObject, rule: ObjectRule, share: float, rng: np.random.Generator
) -> StateHistory:
    if rule.initial == "home":
        initial = item.home
    elif rule.initial == "spread" and item.kind is not Kind.PLANAR:
        initial = np.array([item.lower + share * (item.upper - item.lower)])
    else:
        initial = _state(item, rule.initial, rule, rng)
    swings = tuple(
        Swing(change.at, change.duration, _state(item, change.to, rule, rng))
        for change in rule.changes
    )
    return StateHistory(item, initial, swings)


def _state(
    item: MovableObject, value: Value | str, rule: ObjectRule, rng: np.random.Generator
) -> FloatArray:
    """A given state as an array, or a random one."""
    if isinstance(value, str):
        return _random_state(item, rule, rng)
    if isinstance(value, PlanarState):
        if item.kind is not Kind.PLANAR:
            raise SettingsError(f"'{item.name}' is {item.kind.value}; give its state as a number.")
        return np.array([value.x, value.y, value.yaw])
    if item.kind is Kind.PLANAR:
        raise SettingsError(f"'{item.name}' stands on the floor; give its state as {{x, y, yaw}}.")
    if not item.lower <= value <= item.upper:
        raise SettingsError(
            f"'{item.name}' can't be at {value}: its limits are {item.lower} and {item.upper}."
        )
    return np.array([value])


def _random_state(item: MovableObject, rule: ObjectRule, rng: np.random.Generator) -> FloatArray:
    if item.kind is Kind.PLANAR:
        reach = np.array([rule.spread_xy, rule.spread_xy, rule.spread_yaw])
        return item.home + rng.uniform(-reach, reach)
    return np.array([rng.uniform(item.lower, item.upper)])
