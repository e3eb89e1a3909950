"""Which states are wrong, as far as the truth tells, and what they come to all together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
        """What a reader should make of it."""
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

    ``wrong``: not small, and its 90 % interval doesn't hold the truth. ``unsure``: large, but the interval,
    which is wide then, does. ``outside``: small, but not in the interval.
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


def headline(states: Sequence[tuple[str, Judged]]) -> list[str]:
    """What labelled states come to: the worst of each kind, and the share in the intervals."""
    facts = []
    for kind, coordinates in (("angle", ROTATIONS), ("place", {"offset", "x", "y"})):
        own = [each for each in states if each[1].state.estimate.coordinate in coordinates]
        if not own:
            continue
        name, worst = max(own, key=lambda each: each[1].error)
        wrong = sum(each.verdict == "wrong" for _, each in own)
        coordinate = worst.state.estimate.coordinate
        said = f"{kind} off at worst, {name}"
        if len(own) > 1:
            middle = figure(coordinate, float(np.median([each.error for _, each in own])))
            said += f"; median {middle}"
        if wrong:
            said += f"; {wrong} wrong"
        facts.append(
            fact(figure(coordinate, worst.error), said, "wrong" if wrong else worst.verdict)
        )
    if states:
        held = sum(each.inside for _, each in states)
        share = f"{held / len(states):.0%}"
        facts.append(fact(share, f"of {len(states)} true states in 90 % intervals"))
    return facts
