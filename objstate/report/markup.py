"""HTML and SVG as text, with everything that comes from outside escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], class_: str = "") -> str:
    """A table of cells that are markup; the first column names the row."""
    head = element("tr", *(element("th", text(each), scope="col") for each in headings))
    body = [
        element(
            "tr",
            element("th", first, scope="row"),
            *(element("td", cell) for cell in cells),
        )
        for first, *cells in rows
    ]
    inner = element("table", element("thead", head), element("tbody", *body), class_=class_ or None)
    return element("div", inner, class_="wide")


def polyline(points: FloatArray, closed: bool = False) -> str:
    """The ``d`` of a path through points (n, 2) m, to the centimetre."""
    steps = " ".join(f"{x:.2f},{y:.2f}" for x, y in np.asarray(points))
    return f"M{steps}{'Z' if closed else ''}" if steps else ""


def segments(ends: FloatArray) -> str:
    """The ``d`` of a path of separate segments (k, 2, 2) m, to the centimetre."""
    return "".join(f"M{a:.2f},{b:.2f}L{c:.2f},{d:.2f}" for (a, b), (c, d) in np.asarray(ends))
