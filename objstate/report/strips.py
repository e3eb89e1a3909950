"""The posterior of one coordinate over time, as a heat map with truth and observations."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation.lost import Stretches
from objstate.evaluation.states import TrueCourse
from objstate.evaluation.summary import ROTATIONS
from objstate.evaluation.units import UNITS
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.recording.posteriors import WHOLE
from objstate.report.markup import element, text

if TYPE_CHECKING:
    import polars as pl

MOST_COLUMNS = 720
COLUMN = 1.0  # s, of a log that is short enough
HELD_OPACITY = 0.5  # of a posterior that no scan was near to renew
COLOUR = (74, 134, 206)  # readable on white and on black
EXPONENT = 1 / 3  # opacity grows so with the share, that an even posterior stays visible
MOST_TICKS = 6
LAST_MARK = 0.95  # of the time; marks from there on end at their moment
TICK_STEPS = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 18000)  # s


@dataclass(frozen=True)
class Axis:
    """The columns of a strip."""

    begin_ns: int
    duration: float  # s

    @property
    def columns(self) -> int:
        return max(1, min(MOST_COLUMNS, int(np.ceil(self.duration / COLUMN))))

    def column(self, stamps_ns: IntArray) -> IntArray:
        """The columns (n,) in which stamps (n,) lie."""
        share = (np.asarray(stamps_ns) - self.begin_ns) / 1e9 / max(self.duration, 1e-9)
        return (share * self.columns).astype(np.int64).clip(0, self.columns - 1)


@dataclass(frozen=True, eq=False)
class HeatMap:
    """The posterior in every column."""

    shares: FloatArray  # (b, c) of the posterior in each bin, from the lowest bin up
    known: np.ndarray  # (c,) whether there is a posterior
    fresh: np.ndarray  # (c,) whether it was renewed in this column
    lower: float  # rad or m
    upper: float


def heat_map(rows: pl.DataFrame, axis: Axis) -> HeatMap:
    """From the rows of ``posteriors.parquet`` of one coordinate, at least one.

    A column shows the last posterior in it; a column without one holds what was last
    believed. Rows whose bins lie differently share one lattice.
    """
    masses = np.array(rows["masses"].to_list(), dtype=float) / WHOLE  # (n, b)
    lowers, bins = rows["lower"].to_numpy(), masses.shape[1]
    width = float(rows["upper"][0] - rows["lower"][0]) / bins
    first = np.rint((lowers - lowers.min()) / width).astype(np.int64)
    lattice = np.zeros((len(masses), first.max() + bins))
    np.put_along_axis(lattice, first[:, None] + np.arange(bins), masses, axis=1)
    columns = axis.column(rows["stamp"].to_numpy())
    latest = np.full(axis.columns, -1)
    latest[columns] = np.arange(len(columns))
    held = np.maximum.accumulate(latest)
    shares = np.where(held >= 0, lattice[held].T, 0.0)
    lower = float(lowers.min())
    return HeatMap(shares, held >= 0, latest >= 0, lower, lower + width * lattice.shape[1])


def picture(heat: HeatMap) -> str:
    """A heat map as a PNG in a data URI: one colour, the more opaque the more probable."""
    from PIL import Image

    opacity = heat.shares**EXPONENT * np.where(heat.fresh, 1.0, HELD_OPACITY)
    levels = np.rint(255 * opacity[::-1].clip(0.0, 1.0)).astype(np.uint8)
    image = Image.fromarray(levels)
    image.putpalette(COLOUR * 256)
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True, transparency=bytes(range(256)))
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode("ascii")


def strip(
    coordinate: str,
    posteriors: pl.DataFrame,
    estimates: pl.DataFrame,
    truth: TrueCourse | None,
    axis: Axis,
    name: str = "",
    lost: Stretches = (),
    moved: Stretches = (),
) -> str:
    """The strip of one coordinate of one object as HTML, from its posteriors and observations.

    Intervals in which the robot was ``lost`` are hatched, those in which the object was ``moved``
    are bracketed.
    """
    if not len(posteriors):
        return element("p", "never in view", class_="never")
    heat = heat_map(posteriors, axis)
    seen = estimates.filter("observed")["stamp"].to_numpy()
    return element(
        "div",
        _values(coordinate, heat, name),
        element(
            "div",
            element(
                "svg",
                element(
                    "image",
                    href=picture(heat),
                    width=axis.columns,
                    height=100,
                    preserveAspectRatio="none",
                ),
                *_lines(coordinate, estimates, truth, heat, axis),
                viewBox=f"0 0 {axis.columns} 100",
                preserveAspectRatio="none",
                class_="lines",
            ),
            _shades(lost, axis, "lost", "the robot was lost"),
            _shades(moved, axis, "moved", "moved in this time"),
            element("i", class_="cursor"),
            class_="map",
        ),
        _moments(axis.column(seen), axis.columns),
        class_="strip",
    )


def time_axis(axis: Axis) -> str:
    """The time below a strip, in seconds or minutes."""
    fitting = (step for step in TICK_STEPS if step * MOST_TICKS >= axis.duration)
    step = next(fitting, TICK_STEPS[-1])
    marks = [
        element(
            "span",
            f"{mark // 60} min" if step >= 60 else f"{mark} s",
            style=f"left:{100 * mark / max(axis.duration, 1e-9):.2f}%",
            class_="last" if mark > LAST_MARK * axis.duration else None,
        )
        for mark in range(0, int(axis.duration) + 1, step)
    ]
    return element("div", *marks, class_="times")


def _values(coordinate: str, heat: HeatMap, name: str) -> str:
    """The values at the strip's upper and lower edges, and its content."""
    unit, factor, _ = UNITS[coordinate]
    decimals, sign = (0, "°") if unit == "deg" else (2, " m")
    top, bottom = (f"{factor * value:z.{decimals}f}{sign}" for value in (heat.upper, heat.lower))
    told = (element("span", text(each)) for each in (top, name, bottom))
    return element("div", *told, class_="values")


def _lines(
    coordinate: str,
    estimates: pl.DataFrame,
    truth: TrueCourse | None,
    heat: HeatMap,
    axis: Axis,
) -> Iterator[str]:
    """Interval, median and truth, drawn over the heat map."""
    rows = _shown(estimates, axis)
    held = np.maximum.accumulate(rows)
    known, fresh = np.flatnonzero(held >= 0), np.flatnonzero(rows >= 0)
    for bound in ("lower", "upper"):
        heights = _height(coordinate, estimates[bound].to_numpy()[held[known]], heat)
        yield element("path", d=_broken_line(known, heights), class_="edge")
    heights = _height(coordinate, estimates["median"].to_numpy()[rows[fresh]], heat)
    yield element("path", d=_broken_line(fresh, heights), class_="median")
    if truth is not None:
        at = axis.begin_ns + (np.arange(axis.columns) + 0.5) * axis.duration * 1e9 / axis.columns
        period = truth.period(at.astype(np.int64))
        told = np.flatnonzero(period >= 0)
        values = _height(coordinate, truth.values[period[told]], heat)
        yield element("path", d=_broken_line(told, values), class_="truth")


def _shown(estimates: pl.DataFrame, axis: Axis) -> IntArray:
    """The row (c,) that each column shows, its last one; -1 for none."""
    shown = np.full(axis.columns, -1)
    shown[axis.column(estimates["stamp"].to_numpy())] = np.arange(len(estimates))
    return shown


def _shades(spans: Stretches, axis: Axis, class_: str, said: str) -> str:
    """What marks stretches of time."""
    ends = axis.column(np.array(spans, dtype=np.int64).reshape(-1, 2)) / axis.columns
    return "".join(
        element(
            "b",
            class_=class_,
            title=said,
            style=f"left:{100 * begin:.2f}%;width:{max(100 * (end - begin), 0.3):.2f}%",
        )
        for begin, end in ends
    )


def _height(coordinate: str, values: FloatArray, heat: HeatMap) -> FloatArray:
    """Percent from the top of the strip."""
    if coordinate in ROTATIONS and heat.upper - heat.lower > 2 * np.pi - 1e-9:
        values = wrap(values)
    return np.asarray(100.0 * (heat.upper - values) / (heat.upper - heat.lower)).clip(0.0, 100.0)


def _broken_line(columns: IntArray, heights: FloatArray) -> str:
    """A line through neighbouring columns, with gaps where columns are missing.

    Points within a level stretch are left out.
    """
    if not len(columns):
        return ""
    level = np.round(heights, 1)
    begins = np.diff(columns, prepend=-2) != 1
    ends = np.append(begins[1:], True)
    same = np.append(False, level[1:] == level[:-1])
    kept = begins | ends | ~same | ~np.append(same[1:], False)
    parts = []
    for column, height, is_first in zip(
        columns[kept].tolist(), level[kept].tolist(), begins[kept].tolist(), strict=True
    ):
        parts.append(f"{'M' if is_first else 'L'}{column + 0.5},{height:.1f}")
        if is_first:
            parts.append("h.01")  # so that a column alone shows as a point
    return "".join(parts)


def _moments(columns: IntArray, count: int) -> str:
    """The columns in which a scan reached the object, as ticks."""
    occupied = np.zeros(count + 2, dtype=bool)
    occupied[columns + 1] = True
    begins = np.flatnonzero(occupied[1:] & ~occupied[:-1])
    ends = np.flatnonzero(~occupied[1:] & occupied[:-1])
    ticks = "".join(f"M{a},0H{b}V1H{a}Z" for a, b in zip(begins, ends, strict=True))
    return element(
        "svg",
        element("title", "when a scan reached it"),
        element("path", d=ticks),
        viewBox=f"0 0 {count} 1",
        preserveAspectRatio="none",
        class_="seen",
    )
