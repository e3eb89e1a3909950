"""Small charts as SVG, whose colours the page's style sheet decides."""

from __future__ import annotations

import numpy as np

from objstate.geometry import FloatArray
from objstate.report.coverage import Coverage
from objstate.report.markup import element, polyline, text

WIDTH, DEPTH = 320, 220  # px of the whole chart
LEFT, RIGHT, TOP, BOTTOM = 44, 20, 12, 40  # px around the field
BARS = 31
TAIL = 0.99  # the share of errors that the histogram shows one by one; the outer ones join its ends


def calibration_chart(coverage: Coverage) -> str:
    """Claimed against held shares; on the diagonal, intervals are as wide as they should be."""
    places = np.column_stack([coverage.claimed, coverage.held])
    line = _in_field(places, (0.0, 1.0), (0.0, 1.0))
    diagonal = _in_field(np.array([[0.0, 0.0], [1.0, 1.0]]), (0.0, 1.0), (0.0, 1.0))
    marks = [0.0, 0.25, 0.5, 0.75, 1.0]
    labels = [f"{mark:.0%}" for mark in marks]
    return _chart(
        element("path", d=polyline(diagonal), class_="diagonal"),
        element("path", d=polyline(line), class_="curve"),
        *(element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=2.5, class_="dot") for x, y in line),
        *_horizontal_axis(marks, labels, (0.0, 1.0), "the interval claims"),
        *_vertical_axis(marks, labels, (0.0, 1.0)),
        title=f"Share of true {coverage.kind} inside intervals against what they claim",
    )


def error_chart(coverage: Coverage) -> str:
    """How many updates were how far off."""
    factor, unit = (180 / np.pi, "deg") if coverage.kind == "angles" else (100.0, "cm")
    errors = factor * coverage.errors
    widest = max(float(np.quantile(np.abs(errors), TAIL)), 0.1)
    counts, edges = np.histogram(errors.clip(-widest, widest), BARS, (-widest, widest))
    span, top = (-widest, widest), float(counts.max())
    bars = []
    for count, low, high in zip(counts, edges, edges[1:], strict=False):
        (x0, y0), (x1, y1) = _in_field(np.array([[low, 0.0], [high, count]]), span, (0.0, top))
        bars.append(
            element("rect", x=f"{x0:.1f}", y=f"{y1:.1f}", width=f"{max(x1 - x0 - 1, 0.5):.1f}",
                    height=f"{y0 - y1:.1f}", class_="bar")
        )  # fmt: skip
    marks = [-widest, -widest / 2, 0.0, widest / 2, widest]
    return _chart(
        *bars,
        *_horizontal_axis(marks, [f"{mark:z.2g}" for mark in marks], span, f"error ({unit})"),
        *_vertical_axis([0.0, top], ["0", f"{top:.0f}"], (0.0, top)),
        title=f"Errors of {coverage.kind} at all updates that observed",
    )


def _chart(*content: str, title: str) -> str:
    return element(
        "svg",
        element("title", text(title)),
        *content,
        viewBox=f"0 0 {WIDTH} {DEPTH}",
        class_="chart",
        role="img",
    )


def _in_field(
    points: FloatArray, x_span: tuple[float, float], y_span: tuple[float, float]
) -> FloatArray:
    """Points (n, 2) as pixels."""
    x = (points[:, 0] - x_span[0]) / (x_span[1] - x_span[0])
    y = (points[:, 1] - y_span[0]) / (y_span[1] - y_span[0])
    return np.column_stack(
        [LEFT + x * (WIDTH - LEFT - RIGHT), DEPTH - BOTTOM - y * (DEPTH - TOP - BOTTOM)]
    )


def _horizontal_axis(
    marks: list[float], labels: list[str], span: tuple[float, float], name: str
) -> list[str]:
    floor = DEPTH - BOTTOM
    places = _in_field(np.column_stack([marks, np.zeros(len(marks))]), span, (0.0, 1.0))
    return [
        element("path", d=f"M{LEFT},{floor}H{WIDTH - RIGHT}", class_="axis"),
        *(
            element("text", text(label), x=f"{x:.1f}", y=floor + 14, class_="mark middle")
            for (x, _), label in zip(places, labels, strict=True)
        ),
        element("text", text(name), x=(LEFT + WIDTH - RIGHT) / 2, y=DEPTH - 6, class_="middle"),
    ]


def _vertical_axis(marks: list[float], labels: list[str], span: tuple[float, float]) -> list[str]:
    places = _in_field(np.column_stack([np.zeros(len(marks)), marks]), (0.0, 1.0), span)
    return [
        element("path", d=f"M{LEFT},{TOP}V{DEPTH - BOTTOM}", class_="axis"),
        *(
            element("text", text(label), x=LEFT - 6, y=f"{y + 4:.1f}", class_="mark end")
            for (_, y), label in zip(places, labels, strict=True)
        ),
    ]
