"""The thesis' experiments as a folder of tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.errors import SettingsError
from objstate.experiments.darmstadt.accuracy import measure, validate
from objstate.experiments.darmstadt.coverage import cover
from objstate.experiments.darmstadt.runtime import measure_time
from objstate.experiments.darmstadt.search import compare
from objstate.experiments.darmstadt.tabling import accuracy_table, validity_table
from objstate.experiments.darmstadt.tabling_gaze import (
    coverage_table,
    runtime_table,
    search_table,
    staring_table,
)
from objstate.experiments.reproduction import DPI, TABLES, Progress, check_plotting
from objstate.experiments.tables import Table
from objstate.recording.results import result_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "Occupancy that ages, and active gaze (Darmstadt Dribblers)"
TIMES = "times.md"
ACCURACY_S = 30.0  # s of a recording

Drawing = Callable[[], "Figure"]


@dataclass(frozen=True)
class Part:
    """What came of one experiment."""

    tables: tuple[Table, ...]
    times: tuple[Table, ...] = ()  # differ from run to run
    pictures: tuple[tuple[str, Drawing], ...] = ()  # name of the file, and how it is drawn


@dataclass(frozen=True)
class Reproduction:
    """What came of all that were asked for."""

    parts: tuple[Part, ...]

    @property
    def tables(self) -> tuple[Table, ...]:
        """All of them."""
        return tuple(table for part in self.parts for table in (*part.tables, *part.times))


def reproduce(
    seeds: Sequence[int],
    *,
    out: str | Path | None = None,
    only: Sequence[str] = (),
    processes: int = 1,
    overwrite: bool = False,
    on_progress: Progress | None = None,
) -> Reproduction:
    """Experiments of chapter 7, all or those named, for every seed.

    A folder ``out`` gets ``tables.md``, pictures and, of run times, ``times.md``, whole or not at all.
    Same seeds: same bytes but of the times, by any number of processes. Raises ResultError, and
    SettingsError for an unknown experiment or where matplotlib is missing.
    """
    unknown = [name for name in only if name not in EXPERIMENTS]
    if unknown:
        raise SettingsError(
            f"There is no experiment '{unknown[0]}'; choose from {', '.join(EXPERIMENTS)}."
        )
    chosen = [name for name in EXPERIMENTS if name in only or not only]
    if out is None:
        return _reproduced(chosen, seeds, processes, on_progress)
    check_plotting()
    with result_folder(out, overwrite=overwrite) as folder:
        result = _reproduced(chosen, seeds, processes, on_progress)
        _write(result, folder)
    return result


def _reproduced(
    chosen: Sequence[str], seeds: Sequence[int], processes: int, on_progress: Progress | None
) -> Reproduction:
    parts = []
    for name in chosen:
        parts.append(EXPERIMENTS[name](seeds, processes))
        if on_progress is not None:
            on_progress(len(parts) / len(chosen), 0.0)
    return Reproduction(tuple(parts))


def _write(result: Reproduction, folder: Path) -> None:
    tables = [table.markdown() for part in result.parts for table in part.tables]
    pictures = [picture for part in result.parts for picture in part.pictures]
    links = [f"![{name.partition('.')[0]}]({name})" for name, _ in pictures]
    _write_text(folder / TABLES, [f"# {TITLE}\n", *tables, *links])
    times = [table.markdown() for part in result.parts for table in part.times]
    if times:
        _write_text(folder / TIMES, [f"# {TITLE}\n", *times])
    for name, draw in pictures:
        draw().savefig(folder / name, dpi=DPI, facecolor="white")


def _write_text(file: Path, lines: Sequence[str]) -> None:
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _time(seeds: Sequence[int], processes: int) -> Part:
    return Part((search_table(list(compare(seeds, processes))),), (runtime_table(measure_time()),))


def _accuracy(seeds: Sequence[int], processes: int) -> Part:
    from objstate.experiments.darmstadt.pictures import draw_models

    tables = (
        validity_table(list(validate(seeds, ACCURACY_S, processes))),
        accuracy_table(list(measure(seeds, ACCURACY_S, processes))),
    )
    draw = partial(draw_models, ACCURACY_S, seeds[0])
    return Part(tables, pictures=(("fig7_2_models.png", draw),))


def _coverage(seeds: Sequence[int], processes: int) -> Part:
    from objstate.experiments.darmstadt.pictures import draw_gazes

    found = [list(cover(walking, seeds, processes)) for walking in (False, True)]
    standing, walked = found
    tables = (
        coverage_table(standing, walking=False),
        coverage_table(walked, walking=True),
        staring_table([*standing, *walked]),
    )
    draw = partial(draw_gazes, standing)
    return Part(tables, pictures=(("fig7_5_gazes.png", draw),))


EXPERIMENTS: Mapping[str, Callable[[Sequence[int], int], Part]] = {
    "time": _time,
    "accuracy": _accuracy,
    "coverage": _coverage,
}
