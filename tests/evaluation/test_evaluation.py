"""A result folder against its truth, from file to file."""

import json
from pathlib import Path

import numpy as np
import pytest

from objstate.errors import ResultError, TruthError
from objstate.evaluation import evaluate
from objstate.recording.summary import write_summary
from objstate.recording.tables import EstimateWriter, write_truth
from objstate.recording.tum import TRAJECTORY, write_tum
from objstate.records import Estimate, TrueState
from objstate.records import Path as RobotPath

RUN: dict[str, object] = {"lost_ns": [], "objects": ["door", "door_07", "gate"]}


@pytest.fixture
def result(tmp_path: Path) -> Path:
    """A result with one door, 0.1 rad beside its truth, and a path 0.5 m beside the true one."""
    stamps = np.array([0, 400_000_000, 800_000_000])
    with EstimateWriter(tmp_path) as writer:
        writer.write(Estimate(int(t), "door", "angle", 0.6, 0.1, 0.4, 0.8, True) for t in stamps)
    write_truth(tmp_path / "truth.csv", [TrueState(0, "door", "angle", 0.5)])
    write_summary(tmp_path, RUN)
    write_tum(tmp_path / TRAJECTORY, RobotPath(stamps, np.array([[0.0, 0.5, 0.0]] * 3)))
    write_tum(tmp_path / "true.tum", RobotPath(stamps, np.zeros((3, 3))))
    return tmp_path


def test_names_that_the_building_lacks_are_told_with_those_that_were_meant(result: Path) -> None:
    names = "door", "door7", "gate", "window"
    write_truth(result / "t.csv", [TrueState(0, name, "angle", 0.5) for name in names])
    (told,) = evaluate(result, result / "t.csv").notes
    assert "2 of the truth's 4 objects" in told
    assert "'door7' (did you mean 'door_07'?), 'window'." in told
    assert evaluate(result, result / "truth.csv").notes == ()


def test_a_result_is_evaluated_from_its_files(result: Path) -> None:
    evaluation = evaluate(result, result / "truth.csv", result / "true.tum")
    (door,) = evaluation.objects
    assert door.updates is not None
    assert door.updates.mean == pytest.approx(0.1)
    assert door.updates.coverage == 1.0
    assert evaluation.robot is not None
    assert evaluation.robot.position.mean == pytest.approx(0.5)


@pytest.mark.parametrize("unit", [1, 10**3, 10**6])
def test_stamps_of_the_truth_in_another_unit_are_told(result: Path, unit: int) -> None:
    calendar = 1_600_000_000
    with EstimateWriter(result) as writer:
        writer.write(
            Estimate(calendar * 10**9 + t, "door", "angle", 0.6, 0.1, 0.4, 0.8, True)
            for t in (0, 10**9)
        )
    write_truth(result / "wrong.csv", [TrueState(calendar * unit, "door", "angle", 0.5)])
    with pytest.raises(TruthError, match=f"given in .*write {calendar * 10**9}"):
        evaluate(result, result / "wrong.csv")
    for stamp in (0, 5, (calendar - 3600) * 10**9):  # true from before the log on
        write_truth(result / "right.csv", [TrueState(stamp, "door", "angle", 0.5)])
        assert evaluate(result, result / "right.csv").overall[0].updates is not None


def test_of_a_clock_that_starts_at_zero_one_small_stamp_is_no_second(result: Path) -> None:
    with EstimateWriter(result) as writer:
        writer.write(
            Estimate(t * 10**9, "door", "angle", 0.6, 0.1, 0.4, 0.8, True) for t in range(60)
        )
    write_truth(result / "some.csv", [TrueState(1, "door", "angle", 0.5)])
    assert evaluate(result, result / "some.csv").overall[0].updates is not None
    rows = [TrueState(1, "door", "angle", 0.5), TrueState(20, "door", "angle", 0.6)]
    write_truth(result / "some.csv", rows)
    with pytest.raises(TruthError, match="given in seconds"):
        evaluate(result, result / "some.csv")


def test_a_path_needs_no_truth_of_objects(result: Path) -> None:
    evaluation = evaluate(result, path=result / "true.tum")
    assert evaluation.objects == evaluation.overall == ()
    assert evaluation.robot is not None
    assert evaluation.robot.position.rms == pytest.approx(0.5)
    (result / TRAJECTORY).unlink()
    with pytest.raises(ResultError, match=r"holds no trajectory\.tum"):
        evaluate(result, path=result / "true.tum")


def test_without_a_path_the_robot_is_not_evaluated(result: Path) -> None:
    assert evaluate(result, result / "truth.csv").robot is None


def test_an_evaluation_is_json(result: Path) -> None:
    evaluation = evaluate(result, result / "truth.csv", result / "true.tum")
    text = json.dumps(evaluation.to_dict(), allow_nan=False)
    assert json.loads(text)["objects"][0]["final"]["count"] == 1


def test_what_was_taken_back_is_never_final(result: Path) -> None:
    write_summary(result, RUN | {"lost_ns": [[400_000_000, 800_000_001]]})
    (door,) = evaluate(result, result / "truth.csv").objects
    assert door.updates is not None
    assert door.final is not None
    assert (door.updates.count, door.final.count) == (3, 1)
    write_summary(result, RUN | {"lost_ns": [[0, 800_000_001]]})
    (door,) = evaluate(result, result / "truth.csv").objects
    assert door.final is None


def test_a_result_that_does_not_say_when_it_was_lost_is_refused(result: Path) -> None:
    write_summary(result, {})
    with pytest.raises(ResultError, match="lost_ns"):
        evaluate(result, result / "truth.csv")


def test_a_folder_without_estimates_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match=r"estimates\.parquet"):
        evaluate(tmp_path, tmp_path / "truth.csv")


def test_a_missing_truth_is_refused_by_name(result: Path) -> None:
    with pytest.raises(TruthError, match=r"nowhere\.csv"):
        evaluate(result, result / "nowhere.csv")
