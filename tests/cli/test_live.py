"""The doors in view, as the terminal shows them."""

from __future__ import annotations

import os
import sys

import numpy as np
import pytest
from rich.console import Console

from objstate.cli.live import BAR, LiveView, bar
from objstate.estimator import Estimator
from objstate.records import Estimate, Odometry
from objstate.simulation import simulate
from tests.cli.conftest import Run
from tests.cli.test_commands import ROOM, ROOT, SCENE, stderr_of_a_terminal
from tests.rooms import building, door, enclosure, table


def estimate(stamp: float, name: str, lower: float, mean: float, upper: float) -> Estimate:
    return Estimate(int(stamp * 1e9), name, "angle", mean, 0.1, lower, upper, True)


@pytest.mark.parametrize(
    ("lower", "mean", "upper", "drawn"),
    [
        (0.0, 0.5, 1.0, "━" * 18 + "●" + "━" * 17),
        (0.0, 0.0, 0.0, "●" + "─" * 35),
        (1.0, 1.0, 1.0, "─" * 35 + "●"),
        (-0.2, 0.25, 0.5, "━" * 9 + "●" + "━" * 9 + "─" * 17),
    ],
)
def test_a_bar_reaches_from_limit_to_limit(
    lower: float, mean: float, upper: float, drawn: str
) -> None:
    leaf = door("d", 0.0, 0.0, limits=(0.0, 1.0))
    text = bar(leaf, estimate(0, "d", lower, mean, upper)).plain
    assert text == drawn
    assert len(text) == BAR


def test_only_doors_that_were_seen_lately_are_shown() -> None:
    room = building(enclosure(9.0, 9.0), door("b", 0, 0), door("a", 1, 1), table("desk", 2, 2))
    estimator, view = Estimator(room), LiveView()
    for stamp, name in ((1.0, "a"), (2.5, "b"), (3.5, "desk")):
        record = Odometry(int(stamp * 1e9), np.zeros(3))
        view.note(record, estimator, [estimate(stamp, name, 0.1, 0.5, 0.9)])
    view.report(0.25, 3.5)
    console = Console(width=100, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    console.print(view)
    shown = console.export_text()
    assert "25% of the log" in shown
    assert [line.split()[0] for line in shown.splitlines() if "●" in line] == ["b"]
    assert "28.6 deg" in shown
    assert "5.7 to 51.6" in shown


@pytest.fixture(scope="module")
def arguments(tmp_path_factory: pytest.TempPathFactory) -> list[object]:
    folder = tmp_path_factory.mktemp("live")
    (folder / "room.urdf").write_text(ROOM)
    (folder / "room.scene.yaml").write_text(SCENE)
    log = simulate(folder / "room.scene.yaml", folder / "log").log
    return [
        "estimate", log, "--building", folder / "room.urdf",
        "--out", folder / "out", "--live", "--overwrite",
    ]  # fmt: skip


def test_a_terminal_sees_bars_while_it_runs(arguments: list[object]) -> None:
    shown = stderr_of_a_terminal([sys.executable, ROOT / "cli.py", *arguments]).decode()
    assert "office_door" in shown
    assert "●" in shown


def test_without_a_terminal_it_is_refused(run: Run, arguments: list[object]) -> None:
    done = run(*arguments)
    assert done.code == 1
    assert "--live shows its bars on a terminal" in done.err
