"""The state of every object as numbers to plot, and in words; the truth beside it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from objstate.building.model import Kind
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.recording.messages import MAP, header, make
from objstate.recording.ros import ros2_types
from objstate.records import NANOSECONDS, TrueState

STATES = "objstate_msgs/msg/ObjectStates"
STATES_DEFINITION = """\
# What is believed of every object at a moment.
std_msgs/Header header
ObjectState[] states
================================================================================
MSG: objstate_msgs/ObjectState
# One coordinate of one object.
string name
string coordinate       # angle, offset, x, y, yaw
string unit             # deg or m, of the numbers that follow
float64 shown           # where the object stands in /tf and /joint_states
float64 mean            # of the posterior
float64 median
float64 lower           # bounds of its central 90 %
float64 upper
float64 truth           # nan where it isn't known
bool seen               # false: no scan has told of the object; it is shown at its prior's mode
float64 seconds_unseen  # since the last scan that did; nan if there was none
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
OK, STALE = 0, 3  # levels of diagnostic_msgs/DiagnosticStatus
ROTATIONS = ("angle", "yaw")  # coordinates in rad
AS_LIKELY = 1.0 - 1e-6  # of the largest weight: a weight as large is equal but for rounding


def shown_state(belief: ObjectBelief) -> FloatArray:
    """The state (d,) in which an object is shown: the median, or before it was ever seen the mode.

    The median of a door that could be open by any angle would be half open. Of equally likely
    states, the one nearest to that in which the model shows the object counts.
    """
    if belief.last_observed_ns is not None:
        return belief.median
    if belief.item.kind is Kind.PLANAR:
        return belief.mean  # which is the mode of its prior
    weights = belief.weights.values
    likely = belief.states[weights >= AS_LIKELY * weights.max()]
    return np.asarray(likely[np.abs(likely - belief.item.home)[:, 0].argmin()])


class Truth:
    """True states over time, of those coordinates of which any are known."""

    def __init__(self, rows: Iterable[TrueState] = ()) -> None:
        found: dict[tuple[str, str], list[TrueState]] = defaultdict(list)
        for row in rows:
            found[row.object, row.coordinate].append(row)
        self._courses = {
            key: (np.array([row.stamp_ns for row in group]), [row.value for row in group])
            for key, group in found.items()
        }

    def at(self, stamp_ns: int, name: str, coordinate: str) -> float:
        """A true value, rad or m, from the last stamp on that tells one; nan before the first."""
        if (name, coordinate) not in self._courses:
            return float("nan")
        stamps, values = self._courses[name, coordinate]
        number = int(np.searchsorted(stamps, stamp_ns, side="right"))
        return values[number - 1] if number else float("nan")

    def states(
        self, stamp_ns: int, beliefs: Mapping[str, ObjectBelief]
    ) -> Iterator[tuple[str, FloatArray]]:
        """The objects whose state (d,) is known at a moment."""
        for name, belief in beliefs.items():
            state = np.array([self.at(stamp_ns, name, c) for c in belief.item.coordinates])
            if np.isfinite(state).all():
                yield name, state


def states_message(stamp_ns: int, beliefs: Mapping[str, ObjectBelief], truth: Truth) -> bytes:
    """CDR bytes of ``STATES``."""
    types = ros2_types(STATES, STATES_DEFINITION)
    of_state = types.types["objstate_msgs/msg/ObjectState"]
    states = [
        of_state(**fields)
        for name, belief in beliefs.items()
        for fields in _states(stamp_ns, name, belief, truth)
    ]
    message = types.types[STATES](header=header(stamp_ns, MAP), states=states)
    return bytes(types.serialize_cdr(message, STATES, little_endian=True))


def diagnostics_message(stamp_ns: int, beliefs: Mapping[str, ObjectBelief], truth: Truth) -> Any:
    """The same in words, a status for each object: stale are those that were never seen."""
    statuses = []
    for name, belief in beliefs.items():
        states = list(_states(stamp_ns, name, belief, truth))
        told = [
            make("diagnostic_msgs/msg/KeyValue", key=each["coordinate"], value=_in_words(each))
            for each in states
        ]
        statuses.append(
            make(
                "diagnostic_msgs/msg/DiagnosticStatus",
                level=OK if states[0]["seen"] else STALE,
                name=name,
                message=_summary(states),
                hardware_id="objects",
                values=told,
            )
        )
    return make(DIAGNOSTICS, header=header(stamp_ns, MAP), status=statuses)


def _states(
    stamp_ns: int, name: str, belief: ObjectBelief, truth: Truth
) -> Iterator[dict[str, Any]]:
    """The fields of ``ObjectState``, for each coordinate."""
    shown, (lower, upper) = shown_state(belief), belief.interval()
    last = belief.last_observed_ns
    for k, coordinate in enumerate(belief.item.coordinates):
        is_angle = coordinate in ROTATIONS
        numbers = {
            "shown": shown[k],
            "mean": belief.mean[k],
            "median": belief.median[k],
            "lower": lower[k],
            "upper": upper[k],
            "truth": truth.at(stamp_ns, name, coordinate),
        }
        yield {
            "name": name,
            "coordinate": coordinate,
            "unit": "deg" if is_angle else "m",
            **{key: float(np.degrees(v) if is_angle else v) for key, v in numbers.items()},
            "seen": last is not None,
            "seconds_unseen": float("nan") if last is None else (stamp_ns - last) / NANOSECONDS,
        }


def _summary(states: list[dict[str, Any]]) -> str:
    """One line on an object."""
    told = ", ".join(f"{each['coordinate']} {each['shown']:.3g} {each['unit']}" for each in states)
    if not states[0]["seen"]:
        return f"never seen; shown at its prior's mode, {told}"
    return f"{told}; last seen {states[0]['seconds_unseen']:.1f} s ago"


def _in_words(state: dict[str, Any]) -> str:
    interval = f"{state['lower']:.3g} to {state['upper']:.3g} {state['unit']}"
    known = "" if np.isnan(state["truth"]) else f"; true {state['truth']:.3g}"
    return f"{state['median']:.3g}, 90 % within {interval}{known}"
