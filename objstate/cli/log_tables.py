"""What is in a log, for people."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from objstate.cli.tables import new_table, percent, significant

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.logs import LaserSummary, LogSummary

MOUNTING = ("x (m)", "y (m)", "z (m)", "roll (deg)", "pitch (deg)", "yaw (deg)")


def describe_log(summary: LogSummary) -> Iterator[str | Table]:
    """The parts of the description, text and tables, in the order of reading."""
    yield ", ".join(summary.paths)
    yield f"{summary.duration_s:.1f} s, from {_date(summary.start_ns)} to {_date(summary.end_ns)}"
    yield _topic_table(summary)
    yield _mounting_table(summary.lasers)
    yield _scan_table(summary.lasers)
    yield f"Odometry: {summary.odometry or 'none'}"
    yield f"Frames: {', '.join(summary.frames) or 'none'}"
    yield "Records: " + (", ".join(f"{n} {kind}" for kind, n in summary.records.items()) or "none")


def _topic_table(summary: LogSummary) -> Table:
    table = new_table("Topics", ("topic", "type"), ("messages", "rate (Hz)"))
    for topic in summary.topics:
        rate = "-" if topic.rate_hz is None else f"{topic.rate_hz:.1f}"
        table.add_row(topic.name, topic.type, str(topic.count), rate)
    return table


def _mounting_table(lasers: Sequence[LaserSummary]) -> Table:
    table = new_table("Where the lasers are mounted, in base_link", ("frame",), MOUNTING)
    for laser in lasers:
        table.add_row(laser.frame, *_mounting(laser))
    return table


def _mounting(laser: LaserSummary) -> list[str]:
    if laser.xyz is None or laser.rpy_deg is None:
        return ["?"] * len(MOUNTING)
    lengths = [f"{value:z.3f}" for value in laser.xyz]
    return lengths + [f"{value:z.1f}" for value in laser.rpy_deg]


def _scan_table(lasers: Sequence[LaserSummary]) -> Table:
    numbers = ("beams", "field (deg)", "range (m)", "returns (%)", "discarded (%)")
    table = new_table("What they measure", ("frame",), numbers)
    for laser in lasers:
        table.add_row(
            laser.frame,
            _beams(laser.beams),
            f"{laser.angle_min_deg:.0f} to {laser.angle_max_deg:.0f}",
            f"{significant(laser.range_min, 2)} to {significant(laser.range_max, 4)}",
            percent(laser.returns),
            percent(laser.discarded),
        )
    return table


def _beams(counts: Sequence[int]) -> str:
    """How many beams its scans have; a range where they differ."""
    least, most = min(counts), max(counts)
    return str(most) if least == most else f"{least} to {most}"


def _date(stamp_ns: int) -> str:
    return datetime.fromtimestamp(stamp_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
