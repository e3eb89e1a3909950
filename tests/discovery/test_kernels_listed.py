"""``objstate compile`` compiles the loops of learning as they are called."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.floors import make_drives
from objstate.calibration import survey_kernels
from objstate.cli.loops import GROUPS, compile_groups
from objstate.discovery import kernels, learn_doors, refine_building, surfaces
from tests.discovery.test_finding import floor


def test_after_compiling_no_building_that_is_learnt_compiles_anything(tmp_path: Path) -> None:
    own = {loop for module in (kernels, surfaces, survey_kernels) for loop in _loops(module)}
    groups = [group for group in GROUPS if own & set(group)]
    assert own <= {loop for group in groups for loop in group}
    compile_groups(groups)
    before = {loop.__name__: list(loop.signatures) for loop in own}
    made = make_drives(floor(), tmp_path / "floor", seed=5, count=1, moved=1.0)
    found = learn_doors(made.logs, made.map, tmp_path / "found", jobs=1)
    refine_building(made.logs, found.urdf, tmp_path / "better", jobs=1)
    assert {loop.__name__: list(loop.signatures) for loop in own} == before


def _loops(module: Any) -> list[Any]:
    """The loops of a module that others call, and not only loops."""
    compiled = [
        each
        for each in vars(module).values()
        if hasattr(each, "py_func") and each.py_func.__module__ == module.__name__
    ]
    return [each for each in compiled if "forceinline" not in each.targetoptions]
