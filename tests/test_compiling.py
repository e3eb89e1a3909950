"""Loops are compiled wherever objstate runs, and kept where that is possible."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from objstate.compiling import njit

ROOT = Path(__file__).parents[1]
SCRIPT = """
import logging
import numpy as np
from objstate.sensing import section_kernels as kernels
logging.basicConfig(format="%(message)s")
print(kernels.cast(np.array([[0.0, 0.0, 1.0, 0.0]]), np.array([[2.0, -1.0, 2.0, 1.0]])))
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
    done = run(SCRIPT + "from objstate.sensing import kernels", **nowhere)
    assert done.stdout == "[2.]\n"
    assert done.stderr.count("set NUMBA_CACHE_DIR") == 1


def test_where_they_can_be_kept_they_are(tmp_path: Path) -> None:
    done = run(SCRIPT, NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.stdout, done.stderr) == ("[2.]\n", "")
    assert len(list(tmp_path.rglob("*.nbc"))) == 1


def test_loops_just_compiled_give_the_bytes_of_those_that_were_kept(tmp_path: Path) -> None:
    log, building = (
        str(ROOT / each) for each in ("logs/corridor.mcap", "models/corridor/corridor.urdf")
    )
    written = []
    for result in (tmp_path / "compiled", tmp_path / "kept"):
        given = ["estimate", log, "--building", building, "--to", "8", "--out", str(result)]
        kept = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "loops")}
        subprocess.run([sys.executable, ROOT / "cli.py", *given], env=kept, check=True)
        written.append((result / "estimates.parquet").read_bytes())
    assert written[0] == written[1]


def test_what_cant_be_compiled_is_an_error() -> None:
    with pytest.raises(numba.TypingError):
        njit()(lambda text: text.nonsense())("text")


def test_who_waits_for_the_compiler_is_told_once(tmp_path: Path) -> None:
    script = "from objstate.compiling import when_compiling\nwhen_compiling(lambda: print('now'))\n"
    first, again = (run(script + SCRIPT, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2))
    assert first.stdout == "now\n[2.]\n"
    assert again.stdout == "[2.]\n"
