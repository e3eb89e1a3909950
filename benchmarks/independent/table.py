"""Tables of drives: a row per scenario, and differences of two versions paired by seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from benchmarks.independent.metrics import Durations, Value
from benchmarks.independent.results import Measured
from benchmarks.smoothing import Told

Column = tuple[str, Callable[[Sequence[Measured]], str]]


def finals(drives: Iterable[Measured]) -> list[Value]:
    """The final values of several drives."""
    return [value for drive in drives for value in drive.finals]


def after_ends(drives: Iterable[Measured]) -> list[Value]:
    """The values after ends of movements of several drives."""
    return [value for drive in drives for value in drive.after_ends]


def pooled(shares: Iterable[Durations | None]) -> Durations | None:
    """Several shares together; None where nothing was measured."""
    known = [share for share in shares if share is not None]
    return sum(known, Durations()) if known else None


def errors_text(values: Sequence[Value]) -> str:
    """``mean, median, 95 %, largest`` in degrees."""
    if not values:
        return "–"
    errors = np.array([value.error for value in values])
    figures = (errors.mean(), np.median(errors), np.quantile(errors, 0.95), errors.max())
    return ", ".join(f"{figure:.2f}" for figure in figures)


def held_text(values: Sequence[Value]) -> str:
    """How many intervals hold, and of how many: ``93 % of 57``."""
    return percent([value.inside for value in values]) + f" of {len(values)}"


def percent(flags: Sequence[bool]) -> str:
    """The share of flags that are set."""
    return f"{100 * np.mean(flags):.0f} %" if len(flags) else "–"


def share_text(share: Durations | None) -> str:
    """A share of time."""
    return "–" if share is None or share.whole == 0.0 else f"{100 * share.share:.2f} %"


def _robot(drives: Sequence[Measured]) -> str:
    errors = [drive.robot.error for drive in drives if np.isfinite(drive.robot.error)]
    return f"{100 * np.mean(errors):.1f}" if errors else "–"


def _movements(drives: Sequence[Measured]) -> str:
    told = [drive.movements for drive in drives if drive.movements is not None]
    return sum(told, Told()).cells.replace(" | ", "; ") if told else "–"


COLUMNS: list[Column] = [
    ("drives", lambda drives: str(len(drives))),
    ("final angles", lambda drives: str(len(finals(drives)))),
    ("error: mean, median, 95 %, largest (deg)", lambda drives: errors_text(finals(drives))),
    (
        "in 90 %: others",
        lambda drives: held_text([value for value in finals(drives) if not value.at_limit]),
    ),
    (
        "at a limit",
        lambda drives: held_text([value for value in finals(drives) if value.at_limit]),
    ),
    (
        "sure and wrong",
        lambda drives: share_text(pooled(drive.sure_and_wrong for drive in drives)),
    ),
    (
        "closed or not, wrong: all; ajar",
        lambda drives: "; ".join(
            share_text(pooled(shares))
            for shares in (
                [drive.misclassified for drive in drives],
                [drive.ajar_misclassified for drive in drives],
            )
        ),
    ),
    ("3 s after movements: number", lambda drives: str(len(after_ends(drives)))),
    ("error", lambda drives: errors_text(after_ends(drives))),
    ("in 90 %", lambda drives: percent([value.inside for value in after_ends(drives)])),
    ("movements: found; listed that are true", _movements),
    ("robot (cm)", _robot),
    (
        "localized",
        lambda drives: share_text(pooled(drive.robot.localized for drive in drives)),
    ),
    ("s per drive", lambda drives: f"{np.mean([drive.seconds for drive in drives]):.1f}"),
]


def row_name(drive: Measured) -> str:
    """The first column: scenario, and table where it isn't the usual one."""
    return drive.scenario if drive.table == "estimates" else f"{drive.scenario}, {drive.table}"


def grouped(drives: Iterable[Measured]) -> dict[str, list[Measured]]:
    """Drives by row, in the order in which rows first appear."""
    rows: dict[str, list[Measured]] = {}
    for drive in drives:
        rows.setdefault(row_name(drive), []).append(drive)
    return rows


def table(drives: Sequence[Measured]) -> str:
    """A Markdown table with a row for each scenario, and one for all together."""
    rows = grouped(drives)
    lines = [_line("scenario", [name for name, _ in COLUMNS]), _line("---", ["---"] * len(COLUMNS))]
    for name, group in rows.items():
        lines.append(_line(name, [text(group) for _, text in COLUMNS]))
    for kind in dict.fromkeys(drive.table for drive in drives):
        group = [drive for drive in drives if drive.table == kind]
        if len(grouped(group)) > 1:
            name = "all" if kind == "estimates" else f"all, {kind}"
            lines.append(_line(f"**{name}**", [text(group) for _, text in COLUMNS]))
    return "\n".join(lines)


def _line(name: str, fields: Iterable[str]) -> str:
    return "| " + " | ".join([name, *fields]) + " |"


def wrong_share(drive: Measured) -> float:
    """Share of a drive's time that is sure and wrong, in per cent."""
    return 100 * drive.sure_and_wrong.share


def held_share(drive: Measured, *, at_limit: bool) -> float:
    """Share of a drive's final truths in their intervals, in per cent."""
    inside = [value.inside for value in drive.finals if value.at_limit == at_limit]
    return 100 * float(np.mean(inside)) if inside else float("nan")


def mean_error(values: Sequence[Value]) -> float:
    """The mean error in degrees; NaN of none."""
    return float(np.mean([value.error for value in values])) if values else float("nan")


PAIRED: list[tuple[str, Callable[[Measured], float]]] = [
    ("final error (deg)", lambda drive: mean_error(drive.finals)),
    ("in 90 %: others (points)", lambda drive: held_share(drive, at_limit=False)),
    ("at a limit (points)", lambda drive: held_share(drive, at_limit=True)),
    ("sure and wrong (points)", wrong_share),
    ("3 s after movements (deg)", lambda drive: mean_error(drive.after_ends)),
    ("robot (cm)", lambda drive: 100 * drive.robot.error),
    ("localized (points)", lambda drive: 100 * drive.robot.localized.share),
    ("s per drive", lambda drive: drive.seconds),
]


def paired_difference(new: Sequence[float], old: Sequence[float]) -> tuple[float, float, int]:
    """Mean of new minus old, its standard error (NaN of one pair), and the number of pairs."""
    off = np.asarray(new, float) - np.asarray(old, float)
    off = off[np.isfinite(off)]
    if len(off) == 0:
        return float("nan"), float("nan"), 0
    error = float(off.std(ddof=1) / np.sqrt(len(off))) if len(off) > 1 else float("nan")
    return float(off.mean()), error, len(off)


def comparison(new: Sequence[Measured], old: Sequence[Measured]) -> str:
    """A Markdown table of new minus old, mean ± standard error over drives of the same seed."""
    before = {drive.key: drive for drive in old}
    pairs = [(drive, before[drive.key]) for drive in new if drive.key in before]
    names = ["pairs", *(name for name, _ in PAIRED)]
    lines = [_line("new minus old", names), _line("---", ["---"] * len(names))]
    rows = {name: [pair for pair in pairs if row_name(pair[0]) == name] for name in grouped(new)}
    if len(rows) > 1:
        rows["**all**"] = [pair for pair in pairs if pair[0].table == "estimates"]
    for name, group in rows.items():
        fields = [str(len(group))]
        for _, figure in PAIRED:
            mean, error, count = paired_difference(
                [figure(drive) for drive, _ in group], [figure(drive) for _, drive in group]
            )
            fields.append("–" if count == 0 else f"{mean:+.2f} ± {error:.2f}")
        lines.append(_line(name, fields))
    return "\n".join(lines)
