"""What ``objstate estimate`` does beside estimating: calibrate before, learn dynamics after."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.cli.console import print_warnings
from objstate.cli.progress import progress_bar
from objstate.errors import SettingsError

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.building.model import Building
    from objstate.calibration import Calibration
    from objstate.geometry import FloatArray
    from objstate.learning import LearntDynamics
    from objstate.run import RunOptions, RunResult


def calibration_from(
    file: Path | None, anew: bool
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
    learn: bool
    calibration: Calibration | None = None
    learnt: LearntDynamics | None = None

    def prepare(
        self, logs: Sequence[Path], building: Path, options: RunOptions, quiet: bool
    ) -> RunOptions:
        """The options of the run, with the calibration where it was asked for."""
        if not self.calibrate:
            return options
        from objstate.calibration import calibrate_log

        with progress_bar("Calibrating", quiet) as report:
            found = calibrate_log(logs, building, options, on_progress=report)
        print_warnings(found.warnings, quiet)
        self.calibration = found
        return replace(options, mounts=found.mounts, clock_offsets=found.clock_offsets)

    def write(
        self, folder: Path, building: Building, options: RunOptions, result: RunResult
    ) -> None:
        """Write what was asked for into the result's folder."""
        if self.calibration is not None:
            from objstate.calibration import CALIBRATION, write_calibration

            write_calibration(folder / CALIBRATION, self.calibration)
        if self.learn:
            from objstate.learning import DYNAMICS, learn_dynamics, write_dynamics
            from objstate.recording.tables import read_estimates

            estimates = read_estimates(folder)
            learnt = learn_dynamics(estimates, building, options.settings, result.lost_ns)
            write_dynamics(folder / DYNAMICS, learnt, options.settings)
            self.learnt = learnt

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
            from objstate.learning import summary_lines

            yield from (f"Learnt: {line}" for line in summary_lines(self.learnt))

    def _written(self) -> Iterator[str]:
        if self.calibration is not None:
            from objstate.calibration import CALIBRATION

            yield CALIBRATION
        if self.learnt is not None:
            from objstate.learning import DYNAMICS

            yield DYNAMICS
