"""What ``objstate estimate`` does beside estimating: learn before, and learn dynamics after."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from objstate.cli.console import print_warnings
from objstate.cli.progress import progress_bar
from objstate.errors import SettingsError

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.building.model import Building
    from objstate.calibration import Calibration
    from objstate.discovery import LearntAtOnce
    from objstate.geometry import FloatArray
    from objstate.learning import LearntDynamics
    from objstate.run import BuildingInput, RunOptions, RunResult

BUILDING = "building"  # folder of a result that holds what was learnt of one


def calibration_from(
    file: Path | None, anew: bool = False
) -> tuple[dict[str, FloatArray], dict[str, float]]:
    """Mountings and clock offsets of ``--calibration``. Raises SettingsError."""
    if file is None:
        return {}, {}
    if anew:
        raise SettingsError("--calibration and --calibrate exclude each other; give one.")
    from objstate.calibration import read_calibration

    return read_calibration(file)


@dataclass
class Extras:
    """The additional outputs of one run."""

    calibrate: bool
    learn_dynamics: bool
    learn_building: bool
    calibration: Calibration | None = None
    dynamics: LearntDynamics | None = None
    learnt: LearntAtOnce | None = None
    _scratch: TemporaryDirectory[str] | None = field(default=None, repr=False)  # of what is learnt

    def prepare(
        self, logs: Sequence[Path], building: Path, out: Path, options: RunOptions, quiet: bool
    ) -> tuple[Path | BuildingInput, RunOptions]:
        """The building and the options of the run, with what was asked to be learnt."""
        if self.calibrate and self.learn_building:
            raise SettingsError("--learn-building calibrates as well; leave --calibrate out.")
        if self.calibrate:
            from objstate.run.calibrating import calibrate_log

            with progress_bar("Calibrating", quiet) as report:
                found = calibrate_log(logs, building, options, on_progress=report)
            print_warnings(found.warnings, quiet)
            self.calibration = found
            options = replace(options, mounts=found.mounts, clock_offsets=found.clock_offsets)
        if not self.learn_building:
            return building, options
        from objstate.discovery import learn_at_once

        self._scratch = TemporaryDirectory()
        with progress_bar("Learning the building", quiet) as report:
            self.learnt = learn_at_once(logs, building, self._scratch.name, options, report)
        read, place = self.learnt.building, out / BUILDING / self.learnt.urdf
        described = {**read.description, "path": str(place)}
        return replace(read, description=described), self.learnt.options(options)

    def write(
        self, folder: Path, building: Building, options: RunOptions, result: RunResult
    ) -> None:
        """Write what was asked for into the result's folder."""
        if self.calibration is not None:
            from objstate.calibration import CALIBRATION, write_calibration

            write_calibration(folder / CALIBRATION, self.calibration)
        if self._scratch is not None:
            shutil.copytree(self._scratch.name, folder / BUILDING)
        if self.learn_dynamics:
            from objstate.learning import DYNAMICS, learn_dynamics, write_dynamics
            from objstate.recording.tables import read_estimates

            estimates = read_estimates(folder)
            learnt = learn_dynamics(estimates, building, options.settings, result.lost_ns)
            write_dynamics(folder / DYNAMICS, learnt, options.settings)
            self.dynamics = learnt

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files written."""
        return tuple(self._written())

    def describe(self) -> Iterator[str | Table]:
        """The results, in the order of printing."""
        if self.calibration is not None:
            from objstate.cli.calibration_table import describe_calibration

            yield from describe_calibration(self.calibration)
        if self.learnt is not None:
            from objstate.cli.learnt_tables import describe_found, describe_refined

            if self.learnt.found is not None:
                yield from describe_found(self.learnt.found)
            yield from describe_refined(self.learnt.adjusted)
        if self.dynamics is not None:
            from objstate.learning import summary_lines

            yield from (f"Learnt: {line}" for line in summary_lines(self.dynamics))

    def _written(self) -> Iterator[str]:
        if self.calibration is not None:
            from objstate.calibration import CALIBRATION

            yield CALIBRATION
        if self.learnt is not None:
            yield str(Path(BUILDING) / self.learnt.urdf)
        if self.dynamics is not None:
            from objstate.learning import DYNAMICS

            yield DYNAMICS
