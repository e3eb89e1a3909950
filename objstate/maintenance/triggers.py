"""Triggers of verification: predicates that combine (section 5.4, Table 1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase

from objstate.building.model import Kind
from objstate.errors import SettingsError
from objstate.gaze.entropy import belief_entropy
from objstate.objects import ObjectBelief

NANOSECONDS_PER_HOUR = 3600 * 10**9
VERBS = ("pass", "grab", "go to", "release")
ROBOT_WIDTH = 0.5  # m, where nothing else is said
SURE = 0.9  # probability from which on a passage counts as clear or as blocked


@dataclass(frozen=True)
class Plan:
    """What a planner is about to do with an object.

    Raises SettingsError for a verb that no plan has.
    """

    verb: str
    object: str

    def __post_init__(self) -> None:
        _check_verbs(self.verb)

    @staticmethod
    def parse(text: str) -> Plan:
        """From words such as ``pass door_07`` or ``go to desk_2``. Raises SettingsError."""
        for verb in VERBS:
            if text.startswith(f"{verb} ") and (name := text[len(verb) :].strip()):
                return Plan(verb, name)
        raise SettingsError(
            f"'{text}' is no plan; give one of {', '.join(VERBS)} and an object, as in 'pass "
            "door_07'."
        )

    def __str__(self) -> str:
        return f"{self.verb} {self.object}"


@dataclass(frozen=True, eq=False)
class Situation:
    """One object at one moment, and what is about to be done."""

    belief: ObjectBelief
    now_ns: int
    plan: Plan | None = None
    robot_width: float = ROBOT_WIDTH  # m, of the robot that passes doors

    @property
    def is_planned_with(self) -> bool:
        """Whether the plan is about this object."""
        return self.plan is not None and self.plan.object == self.belief.item.name


Trigger = Callable[[Situation], bool]


def any_of(*triggers: Trigger) -> Trigger:
    """Where one of the triggers fires."""
    return lambda situation: any(trigger(situation) for trigger in triggers)


def all_of(*triggers: Trigger) -> Trigger:
    """Where all of the triggers fire."""
    return lambda situation: all(trigger(situation) for trigger in triggers)


def unless(trigger: Trigger) -> Trigger:
    """Where a trigger doesn't fire."""
    return lambda situation: not trigger(situation)


def older_than(hours: float) -> Trigger:
    """Where an object was last seen longer ago, or never."""

    def fires(situation: Situation) -> bool:
        seen = situation.belief.last_observed_ns
        return seen is None or situation.now_ns - seen > hours * NANOSECONDS_PER_HOUR

    return fires


def entropy_above(nats: float) -> Trigger:
    """Where less is known of an object's state."""
    return lambda situation: belief_entropy(situation.belief) > nats


def passage_in_doubt(sure: float = SURE) -> Trigger:
    """Where a door is neither clear nor blocked with the probability ``sure``; furniture always.

    Raises SettingsError for a probability that isn't above a half and at most 1.
    """
    if not 0.5 < sure <= 1.0:
        raise SettingsError(f"A probability of {sure} must be above 0.5 and at most 1.")

    def fires(situation: Situation) -> bool:
        belief = situation.belief
        if belief.item.kind is Kind.PLANAR:
            return True
        return 1.0 - sure < belief.probability_clear(situation.robot_width) < sure

    return fires


def before(*verbs: str) -> Trigger:
    """Where a planner is about to do one of these things with the object.

    Raises SettingsError for a verb that no plan has.
    """
    _check_verbs(*verbs)
    return lambda s: s.plan is not None and s.is_planned_with and s.plan.verb in verbs


def _check_verbs(*verbs: str) -> None:
    unknown = [verb for verb in verbs if verb not in VERBS]
    if unknown:
        raise SettingsError(f"No plan says '{unknown[0]}'; plans say {', '.join(VERBS)}.")


def named(pattern: str) -> Trigger:
    """Where the object's name matches a pattern with * and ?."""
    return lambda situation: fnmatchcase(situation.belief.item.name, pattern)


# Table 1: grabbing an object and going to it ask for its position; releasing it doesn't.
# passing a door corresponds to grabbing a cup, while its passage is uncertain
TABLE_1 = any_of(before("grab", "go to"), all_of(before("pass"), passage_in_doubt()))
