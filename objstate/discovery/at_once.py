"""A building learnt from one log, for the estimate of the same log."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from objstate.building import load_building
from objstate.building.occupancy import is_map
from objstate.discovery.learning import Learnt, learn_doors
from objstate.discovery.refining import Refined, refine_building
from objstate.errors import SettingsError
from objstate.run import BuildingInput, RunOptions

FOUND, ADJUSTED = "found", "adjusted"  # folders of what is written
FINDING = 0.6  # of the whole work, on average

Report = Callable[[float, float], None]  # share of all done, seconds of the log done


@dataclass(frozen=True, eq=False)
class LearntAtOnce:
    """What was learnt of a log."""

    found: Learnt | None  # of a map
    adjusted: Refined
    building: BuildingInput  # from which the estimate of the same log starts

    @property
    def urdf(self) -> Path:
        """Of that building, within ``out``."""
        return Path(ADJUSTED) / self.adjusted.urdf.name

    def options(self, run: RunOptions) -> RunOptions:
        """Those of that estimate: with the lasers' mountings."""
        lasers = self.adjusted.lasers
        return replace(run, mounts={**run.mounts, **{e.frame: e.corrected_mount for e in lasers}})


def learn_at_once(
    logs: Sequence[str | Path],
    building: str | Path,
    out: str | Path,
    run: RunOptions | None = None,
    on_progress: Report | None = None,
) -> LearntAtOnce:
    """Find the doors of a map, if ``building`` is one; then adjust walls, doors and lasers.

    Writes ``found``, for a map, and ``adjusted`` to the folder ``out``, as ``learn_doors`` and
    ``refine_building`` do. The estimate of the same log starts from where things are then, but with
    the standard deviations from before: the log's evidence narrows them once. Raises BuildingError,
    SettingsError, LogError and ResultError.
    """
    if len(logs) != 1:
        raise SettingsError(
            "A building is learnt at once from one log file alone; "
            "for several, run `objstate building learn` first."
        )
    run, urdf, found, begun = run or RunOptions(), Path(building), None, 0.0
    if is_map(urdf):
        reported = None if on_progress is None else _share(on_progress, 0.0, FINDING)
        found = learn_doors(logs, urdf, Path(out) / FOUND, run, on_progress=reported)
        urdf, begun = found.urdf, FINDING

    def counted(share: float) -> None:
        if on_progress is not None:
            on_progress(begun + (1.0 - begun) * share, 0.0)

    adjusted = refine_building(logs, urdf, Path(out) / ADJUSTED, run, jobs=1, on_progress=counted)
    read = BuildingInput.read(adjusted.urdf)
    model = replace(read.model, error=load_building(urdf).error)
    return LearntAtOnce(found, adjusted, replace(read, model=model))


def _share(report: Report, begin: float, end: float) -> Report:
    """Progress of a part of the work."""
    return lambda share, seconds: report(begin + (end - begin) * share, seconds)
