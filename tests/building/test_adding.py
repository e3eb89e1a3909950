"""Furniture added to a URDF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.building.adding import with_box
from objstate.building.model import Kind
from objstate.errors import BuildingError

CORRIDOR = Path(__file__).parents[2] / "models/corridor/corridor.urdf"
POSE, SIZE = np.array([3.0, -0.5, 0.7]), (0.6, 0.4, 1.2)


def test_the_box_stands_there_and_all_else_stays(tmp_path: Path) -> None:
    text = CORRIDOR.read_text(encoding="utf-8")
    (tmp_path / "grown.urdf").write_text(with_box(text, "cabinet", POSE, SIZE))
    before, grown = load_building(CORRIDOR), load_building(tmp_path / "grown.urdf")
    assert set(grown.objects) == set(before.objects) | {"cabinet"}
    assert np.array_equal(grown.walls.vertices, before.walls.vertices)
    cabinet = grown["cabinet"]
    assert cabinet.kind is Kind.PLANAR
    assert cabinet.home == pytest.approx(POSE, abs=1e-6)
    low, high = cabinet.mesh.vertices.min(axis=0), cabinet.mesh.vertices.max(axis=0)
    assert low == pytest.approx([-0.3, -0.2, 0.0])
    assert high == pytest.approx([0.3, 0.2, 1.2])


def test_comments_and_order_are_kept() -> None:
    text = "<robot name='r'>\n  <!-- by hand -->\n  <link name='walls'/>\n</robot>\n<!-- end -->\n"
    grown = with_box(text, "box", POSE, SIZE)
    assert grown.startswith("<robot name='r'>\n  <!-- by hand -->\n  <link name='walls'/>\n")
    assert grown.endswith("</robot>\n<!-- end -->\n")
    assert '<parent link="walls"/>' in grown


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot", "no URDF"),
        ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="w"/></robot>', "xacro"),
        ("<robot><link name='w'/><joint name='box'/></robot>", "another name"),
        ("<robot><link name='box_body'/></robot>", "another name"),
    ],
)
def test_what_cannot_be_added_to_is_refused(text: str, message: str) -> None:
    with pytest.raises(BuildingError, match=message):
        with_box(text, "box", POSE, SIZE)
