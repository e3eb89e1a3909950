"""Obstacles that stay in place and aren't in the building."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from objstate.recording.candidates import Found
from objstate.report.markup import Cell, element, polyline, table, text

HEADINGS = ("name", "x (m)", "y (m)", "size (m)", "probability", "looks", "seen (s)")


def candidates_table(found: Sequence[Found], begin_ns: int) -> str:
    """A row for each candidate, the most probable first; sortable."""
    return table(HEADINGS, [_row(each, begin_ns) for each in found], "sortable")


def candidate_outlines(found: Sequence[Found]) -> list[str]:
    """Outlines for the plan, each with its name."""
    return [
        element(
            "path",
            element("title", text(f"{each.name}, {each.probability:.0%}")),
            d=polyline(np.array(each.outline), closed=True),
            class_="candidate",
        )
        for each in found
    ]


def _row(each: Found, begin_ns: int) -> list[str | Cell]:
    first, last = ((stamp - begin_ns) / 1e9 for stamp in (each.first_ns, each.last_ns))
    return [
        text(each.name),
        f"{each.x:.2f}",
        f"{each.y:.2f}",
        Cell(f"{each.length:.2f} × {each.width:.2f}", each.length),
        f"{each.probability:.0%}",
        str(each.looks),
        Cell(f"{first:.0f} to {last:.0f}", first),
    ]
