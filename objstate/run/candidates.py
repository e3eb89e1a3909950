"""The candidates for objects, as a run reports them."""

from __future__ import annotations

from objstate.grid import Candidates
from objstate.recording.candidates import Found

DIGITS = 4  # of metres and radians


def found_of(candidates: Candidates) -> list[Found]:
    """The probable ones, the most probable first."""
    layout, found = candidates.layout, []
    for each in candidates.real:
        (x, y, yaw), sides = each.box(layout)
        outline = tuple((round(a, DIGITS), round(b, DIGITS)) for a, b in each.outline(layout))
        found.append(
            Found(
                name=each.name,
                probability=round(each.probability, DIGITS),
                looks=each.looks,
                x=round(float(x), DIGITS),
                y=round(float(y), DIGITS),
                yaw=round(float(yaw), DIGITS),
                length=round(sides[0], DIGITS),
                width=round(sides[1], DIGITS),
                first_ns=each.first_ns,
                last_ns=each.seen_ns,
                outline=outline,
            )
        )
    return found
