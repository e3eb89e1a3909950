"""A recorded log is smoothed: a whole run in which a door is moved behind the robot's back."""

from __future__ import annotations

import math
from pathlib import Path

import polars as pl
import pytest

from objstate.building import load_building
from objstate.estimator import Estimator
from objstate.evaluation import evaluate
from objstate.logs import open_log
from objstate.recording.events import read_events
from objstate.recording.tables import ESTIMATES, SMOOTHED, read_estimates, read_states
from objstate.run import RunResult, estimate_log
from objstate.simulation import simulate
from objstate.smoothing import smoothed

CORRIDOR = Path(__file__).parents[2] / "models" / "corridor" / "corridor.urdf"
FORMER, LATTER = 0.35, 1.2  # rad
BEGUN_S, ENDED_S = 10.5, 12.5
SEEN_S = 21.5  # when the leaf is in view again: until then it is seen edge-on
SCENE = f"""
building: {CORRIDOR}
seed: 3
route:
  speed: 1.0
  waypoints: [{{x: 1.5, y: 0.0, pause: 1.0}}, {{x: 13.0, y: 0.0}}, {{x: 1.5, y: 0.0, pause: 1.0}}]
objects:
  - {{name: door_02, initial: {FORMER}, changes: [{{at: {BEGUN_S}, to: {LATTER}, duration: 2.0}}]}}
  - {{name: "*", initial: 0.7}}
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("smoothing")
    (folder / "scene.yaml").write_text(SCENE)
    return simulate(folder / "scene.yaml", folder / "drive").log


@pytest.fixture(scope="module")
def result(log: Path) -> RunResult:
    return estimate_log([log], CORRIDOR, log.parent.with_name("smoothed"))


def of_door_02(table: pl.DataFrame, begin_ns: int) -> pl.DataFrame:
    own = table.filter(object="door_02", observed=True)
    return own.with_columns(seconds=(pl.col("stamp") - begin_ns) / 1e9)


def test_smoothed_states_are_those_of_the_whole_log(result: RunResult) -> None:
    smoothed = read_states(result.folder)
    own = of_door_02(smoothed, result.begin_ns)
    before, after = own.filter(pl.col("seconds") < BEGUN_S), own.filter(pl.col("seconds") > SEEN_S)
    assert len(before) > 10
    assert len(after) > 10
    for part, truth in ((before, FORMER), (after, LATTER)):
        assert part["mean"].to_list() == pytest.approx([truth] * len(part), abs=math.radians(2.0))
        assert ((part["mean"] - truth).abs() < 2.0 * part["std"]).all()
    filtered = of_door_02(read_states(result.folder, filtered=True), result.begin_ns)
    truth = pl.when(pl.col("seconds") < BEGUN_S).then(FORMER).otherwise(LATTER)
    errors = [part.select((pl.col("mean") - truth).abs().mean()).item() for part in (own, filtered)]
    assert errors[0] < 0.6 * errors[1]


def test_smoothed_rows_stand_beside_the_estimates(result: RunResult) -> None:
    kept = ["stamp", "object", "coordinate", "observed", "fit", "lost"]
    smoothed, estimates = read_states(result.folder), read_estimates(result.folder)
    assert smoothed.select(kept).equals(estimates.select(kept))
    assert not smoothed["mean"].equals(estimates["mean"])


def test_the_movement_is_an_event_and_nothing_else_is(result: RunResult) -> None:
    (event,) = read_events(result.folder)
    assert (event.object, event.kind, event.coordinate) == ("door_02", "moved", "angle")
    assert (event.from_ns - result.begin_ns) / 1e9 < BEGUN_S
    assert (event.to_ns - result.begin_ns) / 1e9 > ENDED_S
    assert event.from_state == pytest.approx(FORMER, abs=math.radians(1.0))
    assert event.to_state == pytest.approx(LATTER, abs=math.radians(1.0))
    assert max(event.from_std, event.to_std) < math.radians(2.5)
    assert event.probability > 0.99


def test_the_movement_is_found_by_the_truth(result: RunResult, log: Path) -> None:
    door, both = evaluate(result.folder, log.with_name("truth.csv")).movements
    assert (door.object, both.object) == ("door_02", None)
    assert (both.count, both.found, both.false) == (1, 1, 0)
    assert evaluate(result.folder, log.with_name("truth.csv"), filtered=True).movements == ()


def test_the_same_log_gives_the_same_bytes(log: Path, result: RunResult, tmp_path: Path) -> None:
    again = estimate_log([log], CORRIDOR, tmp_path / "again").folder
    for name in (ESTIMATES, SMOOTHED, "events.parquet"):
        assert (again / name).read_bytes() == (result.folder / name).read_bytes()


def test_a_result_of_an_earlier_version_has_the_filtered_states(
    result: RunResult, tmp_path: Path
) -> None:
    (tmp_path / ESTIMATES).write_bytes((result.folder / ESTIMATES).read_bytes())
    assert read_states(tmp_path).equals(read_estimates(result.folder))
    assert read_events(tmp_path) == []


def test_live_use_keeps_no_history() -> None:
    assert Estimator(load_building(CORRIDOR)).histories == {}


def test_a_library_that_keeps_a_history_smooths_as_a_run_does(log: Path, result: RunResult) -> None:
    estimator = Estimator(load_building(CORRIDOR), history=True)
    for record in open_log([log]):
        estimator.feed(record)
    door = smoothed(estimator.histories["door_02"])
    (movement,) = door.movements
    (event,) = read_events(result.folder)
    assert (movement.from_ns, movement.to_ns) == (event.from_ns, event.to_ns)
    assert float(door.beliefs[movement.after].mean[0]) == event.to_state
