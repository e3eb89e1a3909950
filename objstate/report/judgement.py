"""Judgement of states by the truth, and their summary."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from objstate.evaluation import LatestState
from objstate.evaluation.states import inside_interval
from objstate.evaluation.summary import FAR_M, FAR_RAD, NEAR_M, NEAR_RAD, ROTATIONS
from objstate.report.markup import element, text
from objstate.report.reading import figure

Verdict = Literal["right", "outside", "unsure", "wrong"]
SEVERITY: dict[Verdict, int] = {"right": 0, "outside": 1, "unsure": 2, "wrong": 3}


@dataclass(frozen=True)
class Judged:
    """A last state beside its truth."""

    state: LatestState
    inside: bool  # the truth lies in the 90 % interval

    @property
    def error(self) -> float:
        """How far off, m or rad."""
        return abs(self.state.error or 0.0)

    @property
    def verdict(self) -> Verdict:
        """The label of a judged state."""
        return verdict(self.state.estimate.coordinate, self.error, self.inside)

    @property
    def rank(self) -> tuple[int, float]:
        """The larger the worse: by verdict, then by error."""
        return (SEVERITY[self.verdict], self.badness)

    @property
    def badness(self) -> float:
        """The error in tolerances, so that angles and places compare."""
        near, _ = tolerances(self.state.estimate.coordinate)
        return self.error / near


def tolerances(coordinate: str) -> tuple[float, float]:
    """Up to where an error is small, and from where on it is large."""
    return (NEAR_RAD, FAR_RAD) if coordinate in ROTATIONS else (NEAR_M, FAR_M)


def verdict(coordinate: str, error: float, inside: bool) -> Verdict:
    """What to call an error (m or rad, not negative) of a state.

    ``wrong``: not small, and its 90 % interval doesn't hold the truth. ``unsure``: large, but the
    interval, which is wide then, does. ``outside``: small, but not in the interval.
    """
    near, far = tolerances(coordinate)
    if not inside:
        return "wrong" if error > near else "outside"
    return "unsure" if error > far else "right"


def judged(
    latest: Sequence[LatestState], symmetry: Mapping[str, int] | None = None
) -> list[Judged]:
    """The states that were observed and whose truth is known, judged."""
    return [
        Judged(state, _inside(state, (symmetry or {}).get(state.estimate.object, 1)))
        for state in latest
        if state.error is not None and state.estimate.observed
    ]


def _inside(state: LatestState, symmetry: int) -> bool:
    estimate = state.estimate
    true, lower, upper = (
        np.array([value]) for value in (state.truth, estimate.lower, estimate.upper)
    )
    return bool(inside_interval(estimate.coordinate, true, lower, upper, symmetry)[0])


def fact(value: object, label: str, class_: str = "") -> str:
    """A figure of the headline."""
    return element("div", element("b", text(value)), text(label), class_=class_ or None)


@dataclass(eq=False)
class Tally:
    """The summary of judged states of one kind, without the states themselves."""

    errors: list[float] = field(default_factory=list)  # m or rad
    inside: int = 0  # whose truth lies in the 90 % interval
    wrong: int = 0
    worst: tuple[str, Judged] | None = None  # by the error, with its label

    def add(self, label: str, each: Judged) -> None:
        """Count a state in."""
        self.errors.append(each.error)
        self.inside += each.inside
        self.wrong += each.verdict == "wrong"
        if self.worst is None or each.error > self.worst[1].error:
            self.worst = (label, each)


def tallied(states: Iterable[tuple[str, Judged]]) -> dict[str, Tally]:
    """The tallies of labelled states, of angles and of places."""
    found: dict[str, Tally] = {}
    for label, each in states:
        found.setdefault(kind_of(each), Tally()).add(label, each)
    return found


def kind_of(each: Judged) -> str:
    """Whether a state is an angle or a place."""
    return "angle" if each.state.estimate.coordinate in ROTATIONS else "place"


def headline(tallies: Mapping[str, Tally]) -> list[str]:
    """The summary of states: the worst of each kind, and the share in the intervals."""
    facts = []
    for kind in ("angle", "place"):
        own = tallies.get(kind)
        if own is None or own.worst is None:
            continue
        name, worst = own.worst
        coordinate = worst.state.estimate.coordinate
        said = f"{kind} off at worst, {name}"
        if len(own.errors) > 1:
            middle = figure(coordinate, float(np.median(own.errors)))
            said += f"; median {middle}"
        if own.wrong:
            said += f"; {own.wrong} wrong"
        facts.append(
            fact(figure(coordinate, worst.error), said, "wrong" if own.wrong else worst.verdict)
        )
    count = sum(len(own.errors) for own in tallies.values())
    if count:
        share = f"{sum(own.inside for own in tallies.values()) / count:.0%}"
        facts.append(fact(share, f"of {count} true states in 90 % intervals"))
    return facts
