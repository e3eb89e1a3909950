"""HTML and SVG as text, with everything that comes from outside escaped."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from objstate.geometry import FloatArray


def text(value: object) -> str:
    """A value as text of a page."""
    return escape(str(value), quote=False)


def element(name: str, *content: str, **attributes: object) -> str:
    """An element; ``content`` is markup, attributes are text.

    An underscore at the end of an attribute's name is left out (``class_``), others
    become hyphens; attributes that are None are left out.
    """
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    return f"<{name}{written}>{''.join(content)}</{name}>"


@dataclass(frozen=True)
class Cell:
    """A cell of a table: markup, its sort key, and its style."""

    markup: str
    value: float | str | None = None  # None: the cell's own text, or a number that it begins with
    class_: str | None = None


@dataclass(frozen=True)
class Row:
    """A row of a table, with attributes of its own."""

    cells: Sequence[str | Cell]  # markup, or more; the first one names the row
    attributes: Mapping[str, object] = field(default_factory=dict)


def table(
    headings: Sequence[str],
    rows: Iterable[Sequence[str | Cell] | Row],
    class_: str = "",
    name: str | None = None,
) -> str:
    """A table; the first column names the row. One of the class ``sortable`` can be sorted."""
    head = element("tr", *(element("th", text(each), scope="col") for each in headings))
    body = (_row(row if isinstance(row, Row) else Row(row)) for row in rows)
    inner = element(
        "table", element("thead", head), element("tbody", *body), class_=class_ or None, id=name
    )
    return element("div", inner, class_="wide")


def _row(row: Row) -> str:
    cells = [cell if isinstance(cell, Cell) else Cell(cell) for cell in row.cells]
    written = (
        element(
            "td" if column else "th",
            cell.markup,
            scope=None if column else "row",
            class_=cell.class_,
            data_value=cell.value,
        )
        for column, cell in enumerate(cells)
    )
    return element("tr", *written, **row.attributes)


def polyline(points: FloatArray, closed: bool = False) -> str:
    """The ``d`` of a path through points (n, 2) m, to the centimetre."""
    steps = " ".join(f"{x:.2f},{y:.2f}" for x, y in np.asarray(points))
    return f"M{steps}{'Z' if closed else ''}" if steps else ""


def segments(ends: FloatArray) -> str:
    """The ``d`` of a path of separate segments (k, 2, 2) m, to the centimetre."""
    return "".join(f"M{a:.2f},{b:.2f}L{c:.2f},{d:.2f}" for (a, b), (c, d) in np.asarray(ends))
