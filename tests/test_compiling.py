"""Loops are compiled wherever objstate runs, and kept where that is possible."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numba
import pytest

from objstate import compiling
from objstate.cli.loops import EVERY_RUN, GROUPS, handed_out
from objstate.compiling import digest_of, njit
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
        [sys.executable, "-P", "-c", script],  # the package is imported as it is installed
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
    out: Path, log: Path, building: Path, installed: Path = ROOT, *, cores: int, to: int = 55
) -> tuple[bytes, int, int]:
    """What a log gives with so many cores, and how many loops it loaded and compiled.

    Loops are kept beside the package, which is ``installed`` in a folder.
    """
    given = [
        *("estimate", str(log), "--quiet", "--to", str(to)),
        *("--building", str(building), "--out", str(out)),
    ]
    script = (
        "from objstate import processes\nfrom objstate.cli.entry import main\n"
        f"processes.default_workers = lambda: {cores}\nmain({given!r})"
    )
    done = run(script, NUMBA_DEBUG_CACHE="1", PYTHONPATH=str(installed))
    loaded, compiled = (done.stdout.count(f"data {way} ") for way in ("loaded from", "saved to"))
    return (out / "estimates.parquet").read_bytes(), loaded, compiled


def test_loops_compiled_by_one_process_and_by_several_give_the_same_bytes(
    tmp_path: Path,
) -> None:
    told = run("from objstate.cli.entry import main\nmain(['compile'])")
    assert told.stdout.startswith("The inner loops are compiled")
    doors = ROOT / "logs/corridor.mcap", ROOT / "models/corridor/corridor.urdf"
    kept, loaded, compiled = estimated(tmp_path / "1", *doors, cores=1)
    assert (loaded, compiled) == (sum(map(len, GROUPS[:EVERY_RUN])), 0)
    # a copy of the package, with the loops that it keeps but for those of some groups
    shutil.copytree(ROOT / "objstate", tmp_path / "installed/objstate")
    some = [loop for group in GROUPS[6:8] for loop in group]
    for loop in some:
        name = f"{Path(loop.py_func.__code__.co_filename).stem}.{loop.__name__}-*.nb?"
        lost = list((tmp_path / "installed/objstate").rglob(name))
        assert len(lost) == 2
        for path in lost:
            path.unlink()
    shared, _, first = estimated(tmp_path / "2", *doors, tmp_path / "installed", cores=2)
    assert shared == kept
    assert 1 <= first < len(some)
    # these loops are used from the first scans on
    again = estimated(tmp_path / "3", *doors, tmp_path / "installed", cores=1, to=5)
    assert again[1] >= len(some)
    assert again[2] == 0
    simulate(ROOT / "benchmarks/scenes/room.scene.yaml", tmp_path / "room", seed=3)
    desks = tmp_path / "room/log.mcap", ROOT / "benchmarks/scenes/room.urdf"
    assert estimated(tmp_path / "4", *desks, cores=2, to=15)[2] == 0


def test_every_loop_of_the_package_is_compiled_beforehand() -> None:
    listed = {loop for group in GROUPS for loop in group}
    for path in (ROOT / "objstate").rglob("*.py"):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        if not re.search(r"^from objstate\.compiling import .*\bnjit\b", path.read_text(), re.M):
            continue
        for each in vars(importlib.import_module(name)).values():
            is_own = hasattr(each, "py_func") and each.py_func.__module__ == name
            if is_own and "forceinline" not in each.targetoptions:
                assert each in listed, f"{name}.{each.__name__}"


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
        "from objstate import processes\n"
        "loops.GROUPS, loops.EVERY_RUN = (loops.GROUPS[-1][1:],), 1\n"  # to be sooner done
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


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package in which one loop's module imports a constant from another."""
    folder = tmp_path / "objstate"
    folder.mkdir()
    (folder / "loops.py").write_text(
        "from objstate.constants import (\n    FIRST,\n    SECOND,\n)\n"
    )
    (folder / "constants.py").write_text("FIRST, SECOND = 1.0, 2.0\n")
    (folder / "others.py").write_text("THIRD = 3.0\n")
    monkeypatch.setattr(compiling, "__file__", str(folder / "compiling.py"))
    yield folder
    _forget()


def _forget() -> None:
    digest_of.cache_clear()
    compiling._source_of.cache_clear()


def test_a_digest_changes_with_every_module_that_a_loop_takes_something_from(package: Path) -> None:
    _forget()
    first = digest_of("objstate.loops")
    (package / "others.py").write_text("THIRD = 4.0\n")
    _forget()
    assert digest_of("objstate.loops") == first
    (package / "constants.py").write_text("FIRST, SECOND = 1.5, 2.0\n")
    _forget()
    assert digest_of("objstate.loops") != first


def test_a_stored_loop_is_compiled_anew_when_what_it_takes_in_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "loop.py"
    source.write_text("def twice(x):\n    return 2.0 * x\n")
    hits, loops = [], []
    for digest in ("before", "before", "after", "after"):
        monkeypatch.setattr(compiling, "digest_of", lambda _, digest=digest: digest)
        words: dict[str, Any] = {"__name__": "loop"}
        exec(compile(source.read_text(), str(source), "exec"), words)
        loop: Any = njit()(words["twice"])
        loops.append(loop)  # numba finds the module of a stored loop by those that live
        assert loop(2.0) == 4.0
        hits.append(sum(loop.stats.cache_hits.values()))
    assert hits == [0, 1, 0, 1]
