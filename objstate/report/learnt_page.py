"""What was learnt of a building, as a page: how far walls were off before and after, and doors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Building
from objstate.geometry import FloatArray
from objstate.report.document import page_head, section, whole_page
from objstate.report.markup import Cell, element, segments, table, text
from objstate.report.plan import framed, shape_of

COLOURS = ("#2c7bb6", "#00a6ca", "#90c14c", "#f9a03f", "#d7191c")  # from right to far off
LARGEST_M = 0.02  # m off from which on the last colour is used
EXPLAINED = (
    "Colours show by how much the drives find a piece of wall off the model, in the root of the "
    "mean square over the drives, while all others stay where they are. Grey walls were not seen."
)


@dataclass(frozen=True, eq=False)
class WallsOff:
    """Pieces of wall, and how far drives find them off."""

    segments: FloatArray  # (k, 4) m
    off: FloatArray  # (k,) m, NaN where none was seen


def learnt_page(
    building: Building,
    height: float,
    before: WallsOff,
    after: WallsOff,
    tables: Sequence[tuple[str, Sequence[str], Sequence[Sequence[str | Cell]]]],
    said: str,
) -> str:
    """The page; ``tables`` have a title, headings and rows of markup each."""
    shapes = [shape_of(item, height) for item in building.objects.values()]
    plans = [
        section(
            title,
            element("p", text(_summary(walls))),
            framed(building, shapes, np.zeros((0, 2)), height, _coloured(walls)),
        )
        for title, walls in (("Walls before", before), ("Walls after", after))
    ]
    parts = [section(title, table(headings, rows, "sortable")) for title, headings, rows in tables]
    body = "".join([element("p", EXPLAINED), _legend(), *plans, *parts])
    title = f"What was learnt of {building.name}"
    return whole_page(title, body, head=page_head(title, said))


def _coloured(walls: WallsOff) -> list[str]:
    """A path for each colour."""
    seen = np.isfinite(walls.off)
    number = np.floor(np.where(seen, walls.off, 0.0) / LARGEST_M * len(COLOURS)).astype(int)
    number = number.clip(max=len(COLOURS) - 1)
    return [
        element(
            "path",
            d=segments(walls.segments[chosen].reshape(-1, 2, 2)),
            style=f"fill:none;stroke:{colour};stroke-width:4px;vector-effect:non-scaling-stroke",
        )
        for k, colour in enumerate(COLOURS)
        if (chosen := seen & (number == k)).any()
    ]


def _summary(walls: WallsOff) -> str:
    off = walls.off[np.isfinite(walls.off)]
    if not len(off):
        return "No wall was seen."
    middle, most = 100.0 * np.quantile(off, [0.5, 0.95])
    return f"Off by {middle:.1f} cm in the median; 95 % of the pieces by less than {most:.1f} cm."


def _legend() -> str:
    step = 100.0 * LARGEST_M / len(COLOURS)
    names = [f"{step * k:.1f} to {step * (k + 1):.1f} cm" for k in range(len(COLOURS))]
    names[-1] = f"over {step * (len(COLOURS) - 1):.1f} cm"
    return element(
        "p",
        *(
            element("span", f"■ {name}&ensp;", style=f"color:{colour}")
            for name, colour in zip(names, COLOURS, strict=True)
        ),
    )
