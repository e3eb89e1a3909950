"""Verification tasks and their outcomes (sections 5.4 and 6, Elfring et al. 2014)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from objstate.building.model import Kind
from objstate.errors import SettingsError
from objstate.gaze.floor import Floor
from objstate.geometry import FloatArray, wrap
from objstate.maintenance.coordinator import Action, Coordinator
from objstate.maintenance.triggers import TABLE_1, Plan, Situation, Trigger
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from objstate.world import Due

REGION = 0.95  # of the belief lies in the region to look in
BY_TRIGGER = "the trigger asks for it"  # without a plan
MAJORITY = 0.5  # of the belief, that decides whether an object is where it was thought to be


@dataclass(frozen=True, eq=False)
class Expectation:
    """Where an object is believed to be: the region to look in."""

    object: str
    lower: FloatArray  # (d,) the region that holds 95 % of each coordinate
    upper: FloatArray  # (d,)

    @staticmethod
    def of(belief: ObjectBelief) -> Expectation:
        """Before a look at an object, from what is believed of it."""
        return Expectation(belief.item.name, *belief.interval(REGION))

    def share_inside(self, belief: ObjectBelief) -> float:
        """The probability that the object is in the region."""
        middle, half = (self.lower + self.upper) / 2.0, (self.upper - self.lower) / 2.0
        off = belief.states - middle
        if belief.item.kind is Kind.PLANAR:
            off = belief.item.symmetry.nearest(belief.states, middle[2]) - middle
        off = np.where(belief.wraps, wrap(off), off)
        inside = (np.abs(off) <= half + belief.cell / 2.0).all(axis=1)
        return float(belief.weights.values[inside].sum())


@dataclass(frozen=True, eq=False)
class VerificationTask:
    """Look for an object where it is believed to be."""

    action: Action
    expected: Expectation
    reason: str


class Outcome(Enum):
    """What became of a verification."""

    CONFIRMED = "confirmed"  # it is where it was believed to be
    MOVED = "moved"  # it is somewhere else
    LOST = "lost"  # it isn't at its believed place, and its place is unknown
    ABSENT = "absent"  # it probably isn't there any more
    HIDDEN = "hidden"  # it couldn't be seen: nothing was learnt


def next_tasks(
    coordinator: Coordinator,
    ranked: Sequence[Action],
    beliefs: Mapping[str, ObjectBelief],
    now_ns: int,
    *,
    plans: Sequence[Plan] = (),
    trigger: Trigger = TABLE_1,
    due: Sequence[Due] = (),
) -> list[VerificationTask]:
    """What to verify now: required objects first, then the best of the ranked actions.

    The set V of eqs. (11) and (12). First come objects that something is planned with, in the
    plans' order, then what a task requires by now (``World.due``), then objects for which the
    trigger fires without a plan, the most useful first; of the last two, objects that no action
    updates are left out. Required actions are done whatever their gain, by the most useful of them.

    Raises SettingsError for a plan with an unknown object, or with one that no action updates,
    since it would seem verified.
    """
    width = coordinator.robot_width
    first = {action.object: action for action in reversed(ranked)}
    found = []
    for plan in plans:
        if plan.object not in beliefs:
            known = ", ".join(sorted(beliefs)) or "none"
            raise SettingsError(f"'{plan}': there is no such object; there are {known}.")
        belief = beliefs[plan.object]
        if trigger(Situation(belief, now_ns, plan, width)):
            if plan.object not in first:
                raise SettingsError(
                    f"'{plan}': the robot can see '{plan.object}' from no place that it "
                    "reaches; bring it nearer, or plan without looking."
                )
            reason = f"before: {plan}{_in_doubt(plan, belief, width)}"
            found.append(VerificationTask(first[plan.object], Expectation.of(belief), reason))
    planned = {plan.object for plan in plans}
    for each in due:
        if each.due_ns <= now_ns and each.object not in planned and each.object in first:
            planned.add(each.object)
            expected = Expectation.of(beliefs[each.object])
            found.append(VerificationTask(first[each.object], expected, _too_uncertain(each)))
    for name in dict.fromkeys(action.object for action in ranked):
        belief = beliefs[name]
        if name not in planned and trigger(Situation(belief, now_ns, robot_width=width)):
            found.append(VerificationTask(first[name], Expectation.of(belief), BY_TRIGGER))
    useful = coordinator.best(ranked)
    if useful is not None:
        expected = Expectation.of(beliefs[useful.object])
        found.append(VerificationTask(useful, expected, why(useful)))
    return found


def _too_uncertain(due: Due) -> str:
    """What a task allows, and what is believed, in words."""
    return f"variance of {due.coordinate} {due.variance:.2g}, allowed {due.allowed:.2g}"


def _in_doubt(plan: Plan, belief: ObjectBelief, width: float) -> str:
    """The probability of the passage, in words."""
    if plan.verb != "pass" or belief.item.kind is Kind.PLANAR:
        return ""
    return f", clear with probability {belief.probability_clear(width):.2f}"


def why(action: Action) -> str:
    """The expected gain of an action, in words."""
    others = sorted(action.gains.items(), key=lambda item: -item[1])
    others = [(name, gain) for name, gain in others if name != action.object]
    own = f"{action.gains.get(action.object, 0.0):.1f} nats of {action.object}"
    if not others:
        return own
    return f"{own}, {sum(gain for _, gain in others):.1f} of {len(others)} others on the way"


def outcome(expected: Expectation, before: ObjectBelief, after: ObjectBelief) -> Outcome:
    """What the readings between two beliefs made of what was expected.

    Raises ValueError for beliefs of another object.
    """
    if {before.item.name, after.item.name} != {expected.object}:
        raise ValueError(f"'{expected.object}' was expected")
    if after.last_observed_ns is None or after.last_observed_ns == before.last_observed_ns:
        return Outcome.HIDDEN
    if after.presence < MAJORITY:
        return Outcome.ABSENT
    if expected.share_inside(after) >= MAJORITY:
        return Outcome.CONFIRMED
    return Outcome.MOVED if after.is_certain else Outcome.LOST


def scattered(belief: ObjectBelief, floor: Floor, rng: np.random.Generator) -> ObjectBelief:
    """The belief of a lost object: uniform over where it could be (section 6).

    Doors can be anywhere between their limits, furniture anywhere on the free floor. It
    keeps its name, so that it is the same object when it is seen again.
    """
    count = len(belief.states)
    if belief.item.kind is not Kind.PLANAR:
        return belief.with_weights(Weights.uniform(count))
    places = floor.places[np.flatnonzero(floor.free.reshape(-1))]
    chosen = places[rng.integers(len(places), size=count)]
    jitter = rng.uniform(-0.5, 0.5, (count, 2)) * floor.settings.resolution
    states = np.column_stack([chosen + jitter, rng.uniform(-np.pi, np.pi, count)])
    return belief.with_samples(states, Weights.uniform(count))
