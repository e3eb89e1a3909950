"""Loops are compiled wherever objstate runs, and kept where that is possible."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from objstate.cli.loops import EVERY_RUN, GROUPS, handed_out
from objstate.compiling import njit
from objstate.simulation import simulate

ROOT = Path(__file__).parents[1]
SCRIPT = """
import logging
import numpy as np
from objstate.sensing import segments
logging.basicConfig(format="%(message)s")
print(segments.cast(np.array([[0.0, 0.0, 1.0, 0.0]]), np.array([[2.0, -1.0, 2.0, 1.0]])))
"""


def run(script: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )


def test_where_nothing_can_be_kept_loops_are_compiled_all_the_same() -> None:
    nowhere = {"NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator", "NUMBA_CACHE_DIR": ""}
    done = run(SCRIPT + "from objstate.sensing import sweeps", **nowhere)
    assert done.stdout == "[2.]\n"
    assert done.stderr.count("set NUMBA_CACHE_DIR") == 1


def test_where_they_can_be_kept_they_are(tmp_path: Path) -> None:
    done = run(SCRIPT, NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.stdout, done.stderr) == ("[2.]\n", "")
    assert len(list(tmp_path.rglob("*.nbc"))) == 1


def estimated(
    out: Path, log: Path, building: Path, loops: Path | None, *, cores: int, until: int
) -> tuple[bytes, int]:
    """What a log gives up to a time, s, with so many cores, and how many loops it compiled.

    Loops are kept in a folder of their own, or beside the installed package.
    """
    given = [
        *("estimate", str(log), "--quiet", "--to", str(until)),
        *("--building", str(building), "--out", str(out)),
    ]
    script = (
        f"import sys\nsys.path.insert(0, {str(ROOT)!r})\n"
        "from objstate.experiments import processes\nfrom objstate.cli.entry import main\n"
        f"processes.default_workers = lambda: {cores}\nmain({given!r})"
    )
    kept = {} if loops is None else {"NUMBA_CACHE_DIR": str(loops)}
    done = run(script, **kept, NUMBA_DEBUG_CACHE="1")
    return (out / "estimates.parquet").read_bytes(), done.stdout.count("data saved to")


def test_loops_compiled_by_one_process_and_by_several_give_the_same_bytes(
    tmp_path: Path,
) -> None:
    doors = ROOT / "logs/corridor.mcap", ROOT / "models/corridor/corridor.urdf"
    several = tmp_path / "several"
    shared, first = estimated(tmp_path / "1", *doors, several, cores=2, until=60)
    many = len(list(several.rglob("*.nbc")))
    assert many == sum(map(len, GROUPS[:EVERY_RUN]))
    assert 1 <= first < many
    told = run("from objstate.cli.entry import main\nmain(['compile'])")
    assert told.stdout.startswith("The inner loops are compiled")
    kept, none = estimated(tmp_path / "2", *doors, None, cores=1, until=60)
    assert shared == kept
    assert none == 0
    simulate(ROOT / "benchmarks/scenes/room.scene.yaml", tmp_path / "room", seed=3)
    desks = tmp_path / "room/log.mcap", ROOT / "benchmarks/scenes/room.urdf"
    assert estimated(tmp_path / "3", *desks, None, cores=2, until=60)[1] == 0


def test_where_nothing_can_be_kept_there_is_nothing_to_compile_beforehand() -> None:
    script = "import sys\nfrom objstate.cli.entry import main\nsys.exit(main(['compile']))"
    nowhere = {"NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator", "NUMBA_CACHE_DIR": ""}
    with pytest.raises(subprocess.CalledProcessError) as refused:
        run(script, **nowhere)
    assert refused.value.returncode == 1
    assert "set NUMBA_CACHE_DIR" in refused.value.stderr


def test_processes_that_fail_to_compile_do_no_harm(tmp_path: Path) -> None:
    script = (
        "import sys\nfrom objstate.cli import loops, sharing\n"
        "from objstate.experiments import processes\n"
        "loops.GROUPS, loops.EVERY_RUN = (loops.GROUPS[-4],), 1\n"  # to be sooner done
        "processes.default_workers = lambda: 2\n"
        "sharing.share_out_compiling()\nsys.executable = {!r}\n"
    )
    for number, executable in enumerate(("/bin/false", str(tmp_path / "nowhere"))):
        loops = tmp_path / str(number)
        assert (
            run(script.format(executable) + SCRIPT, NUMBA_CACHE_DIR=str(loops)).stdout == "[2.]\n"
        )


def test_each_group_is_handed_out_once() -> None:
    queue, end = os.pipe()
    os.write(end, bytes(range(len(GROUPS))))
    os.close(end)
    one, other = handed_out(queue), handed_out(queue, os.getppid())
    by_turns = [next(one), next(other), next(one), next(other)]
    assert (*by_turns, *other) == GROUPS
    assert list(one) == list(handed_out(queue, os.getppid())) == []
    os.close(queue)


def test_a_process_that_compiles_takes_nothing_up_after_its_parent_has_ended(
    tmp_path: Path,
) -> None:
    queue, end = os.pipe()
    os.write(end, bytes(range(len(GROUPS))))
    os.close(end)
    command = [sys.executable, "-m", "objstate.cli.loops", "1"]  # the number of another process
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run(command, stdin=queue, env=environment, check=True)
    assert not list(tmp_path.rglob("*.nbc"))
    assert tuple(handed_out(queue)) == GROUPS
    os.close(queue)


def test_what_cant_be_compiled_is_an_error() -> None:
    with pytest.raises(numba.TypingError):
        njit()(lambda text: text.nonsense())("text")


def test_who_hardly_waits_is_not_told(tmp_path: Path) -> None:
    begin = "import time\nfrom objstate.compiling import when_compiling\n"
    watch = begin + "when_compiling(lambda: print('now'), after={})\n"
    for after, told in (("60", ""), ("0.01", "now\n")):
        done = run(watch.format(after) + SCRIPT, NUMBA_CACHE_DIR=str(tmp_path / after))
        assert done.stdout == told + "[2.]\n"


def test_who_waits_for_the_compiler_is_told_once(tmp_path: Path) -> None:
    script = "from objstate.compiling import when_compiling\nwhen_compiling(lambda: print('now'))\n"
    first, again = (run(script + SCRIPT, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2))
    assert first.stdout == "now\n[2.]\n"
    assert again.stdout == "[2.]\n"
