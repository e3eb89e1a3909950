"""A paper's experiments, run over many seeds: tables, figures and every final estimate."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.errors import SettingsError
from objstate.experiments.tables import Table
from objstate.experiments.trial import Final, Run, Trial, run_trial
from objstate.processes import default_workers, in_order
from objstate.recording.results import result_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLES, FINALS = "tables.md", "finals.csv"
DPI = 110

Progress = Callable[[float, float], None]  # share done from 0 to 1, seconds of logs done


@dataclass(frozen=True)
class Experiment:
    """One experiment: what is driven, and what is made of the runs."""

    trial: Callable[[int], Trial]  # for a seed
    tables: Callable[[Sequence[Run]], tuple[Table, ...]]
    draw: Callable[[Trial, Sequence[Run]], Figure]  # the runs of one trial
    picture: str  # name of the file


@dataclass(frozen=True)
class Reproduction:
    """What was written."""

    folder: Path
    tables: tuple[Table, ...]


def reproduce(
    experiments: Mapping[str, Experiment],
    title: str,
    out: str | Path,
    seeds: Sequence[int],
    *,
    workers: int | None = None,
    overwrite: bool = False,
    on_progress: Progress | None = None,
) -> Reproduction:
    """Run experiments for every seed, and write the folder ``out``, whole or not at all.

    The folder gets ``tables.md``, ``finals.csv`` with every final estimate, and a
    picture of each experiment with the first seed. Same seeds: same bytes, by however
    many ``workers`` (processes; default: one for each core). Raises ResultError, and
    SettingsError where matplotlib is missing.
    """
    check_plotting()
    with result_folder(out, overwrite=overwrite) as folder:
        trials = {
            name: [experiment.trial(seed) for seed in seeds]
            for name, experiment in experiments.items()
        }
        runs = _all_runs(trials, workers or default_workers(), on_progress)
        tables = tuple(
            table
            for name, experiment in experiments.items()
            for table in experiment.tables(list(chain(*runs[name])))
        )
        _write_tables(folder / TABLES, title, tables, experiments)
        _write_finals(folder / FINALS, runs)
        for name, experiment in experiments.items():
            drawn = experiment.draw(trials[name][0], runs[name][0])
            drawn.savefig(folder / experiment.picture, dpi=DPI, facecolor="white")
    return Reproduction(Path(out), tables)


def check_plotting() -> None:
    """Raise SettingsError where matplotlib is missing, before hours are spent."""
    if find_spec("matplotlib") is None:
        raise SettingsError(
            "Pictures need matplotlib, which is not installed; `pip install objstate[docs]`."
        )


def _all_runs(
    trials: Mapping[str, Sequence[Trial]], workers: int, on_progress: Progress | None
) -> dict[str, list[tuple[Run, ...]]]:
    """The runs of every trial, by experiment and in the trials' order."""
    tasks = [(name, trial) for name, own in trials.items() for trial in own]
    runs: dict[str, list[tuple[Run, ...]]] = {name: [] for name in trials}
    results = in_order(run_trial, [trial for _, trial in tasks], workers)
    seconds = 0.0
    for done, ((name, _), result) in enumerate(zip(tasks, results, strict=True), start=1):
        runs[name].append(result)
        seconds += sum(run.seconds for run in result)
        if on_progress is not None:
            on_progress(done / len(tasks), seconds)
    return runs


def _write_tables(
    file: Path, title: str, tables: Sequence[Table], experiments: Mapping[str, Experiment]
) -> None:
    pictures = (f"![{name}]({experiment.picture})" for name, experiment in experiments.items())
    parts = (f"# {title}\n", *(table.markdown() for table in tables), *pictures)
    file.write_text("\n".join(parts) + "\n", encoding="utf-8")


def _write_finals(file: Path, runs: Mapping[str, Sequence[Sequence[Run]]]) -> None:
    """Every final estimate: rad and m, times in ns."""
    names = [field.name for field in fields(Final)]
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["experiment", "setting", "seed", *names])
        for experiment, trials in runs.items():
            for run in chain(*trials):
                for final in run.finals:
                    values = [getattr(final, name) for name in names]
                    writer.writerow([experiment, run.setting, run.seed, *values])
