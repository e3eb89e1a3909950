"""Door errors where the model's hinges are off: ``python benchmarks/hinges.py SCENE CM SEED...``

Drives are simulated in a scene's building and estimated in one whose hinges all are CM
centimetres aside, each in a direction of its own. Prints, for each seed and over all, the
doors' final errors in degrees, the share of truths inside the 90 % intervals, how many
estimates are sure (an interval of less than 10 degrees) and wrong (by more than 5), and how
many doors were found to hang elsewhere.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from objstate.config import BuildingErrorSettings, Settings
from objstate.evaluation import latest_states
from objstate.geometry import transform
from objstate.recording.tables import read_estimates, read_truth
from objstate.run import RunOptions, estimate_log
from objstate.run.inputs import BuildingInput
from objstate.simulation import simulate
from objstate.simulation.scene import load_scene

HEADER = (
    "| seed | doors | mean error | median | largest | within 5 deg | in 90 % interval "
    "| sure and wrong | found |"
)
SURE = 10.0  # deg, an interval narrower than this
WRONG = 5.0  # deg


@dataclass(frozen=True)
class Row:
    """What one drive came to, or several."""

    errors: np.ndarray  # (n,) deg, without their signs
    inside: np.ndarray  # (n,) whether the 90 % intervals hold
    widths: np.ndarray  # (n,) deg, of these intervals
    found: int  # doors that were found to hang elsewhere

    def line(self, name: str) -> str:
        """A row of the table."""
        sure_and_wrong = np.count_nonzero((self.widths < SURE) & (self.errors > WRONG))
        return (
            f"| {name} | {len(self.errors)} | {self.errors.mean():.2f} | "
            f"{np.median(self.errors):.2f} | {self.errors.max():.1f} | "
            f"{100 * np.mean(self.errors <= WRONG):.0f} % | {100 * self.inside.mean():.0f} % | "
            f"{sure_and_wrong} | {self.found} |"
        )


def aside(building: BuildingInput, distance: float, seed: int) -> BuildingInput:
    """The building with every hinge moved by a distance, m."""
    rng, model = np.random.default_rng([seed, 99]), building.model
    for name in sorted(model.objects):
        way = rng.uniform(-np.pi, np.pi)
        shift = transform(np.eye(3), [distance * np.cos(way), distance * np.sin(way), 0.0])
        item = model[name]
        model = model.with_object(replace(item, origin=shift @ item.origin))
    return replace(building, model=model)


def drive(scene: Path, distance: float, seed: int, settings: Settings) -> Row:
    """One simulated drive, estimated with hinges that are off."""
    with tempfile.TemporaryDirectory() as folder:
        simulated = simulate(scene, Path(folder) / "drive", seed=seed)
        truth = read_truth(simulated.folder / "truth.csv")
        building = aside(BuildingInput.read(load_scene(scene).building), distance, seed)
        result = estimate_log(
            [simulated.log], building, Path(folder) / "result", RunOptions(settings)
        )
        states = [
            each
            for each in latest_states(read_estimates(result.folder), truth, result.lost_ns)
            if each.error is not None and each.estimate.observed
        ]
    bounds = np.array([[each.estimate.lower, each.estimate.upper] for each in states])
    truths = np.array([each.truth for each in states])
    return Row(
        errors=np.degrees([abs(each.error) for each in states]),
        inside=(bounds[:, 0] <= truths) & (truths <= bounds[:, 1]),
        widths=np.degrees(np.ptp(bounds, axis=1)),
        found=sum(warning.count("of its place in the model") for warning in result.warnings),
    )


def study(scene: Path, distance: float, seeds: list[int], settings: Settings) -> None:
    """A Markdown table of a drive for each seed, and of all."""
    print(HEADER + "\n|" + " --- |" * HEADER.count(" | ") + " --- |")
    rows = []
    for seed in seeds:
        rows.append(drive(scene, distance, seed, settings))
        print(rows[-1].line(str(seed)), flush=True)
    errors, inside, widths = (
        np.concatenate([getattr(row, name) for row in rows])
        for name in ("errors", "inside", "widths")
    )
    print(Row(errors, inside, widths, sum(row.found for row in rows)).line("all"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Door errors where the model's hinges are off.")
    parser.add_argument("scene", type=Path)
    parser.add_argument("cm", type=float)
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument(
        "--stated", type=float, metavar="M", help="hinge_std_m; default: as built in"
    )
    given = parser.parse_args()
    error = {} if given.stated is None else {"hinge_std_m": given.stated}
    settings = Settings(building_error=BuildingErrorSettings(**error))
    study(given.scene, given.cm / 100.0, given.seeds, settings)
