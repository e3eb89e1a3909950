"""The URDF of a scene says the same as the building that it was made of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.run.scene.urdf import link_of, self_contained_urdf
from tests.rooms import building, door, enclosure, sliding_door, table


def test_it_is_read_again_with_the_same_objects(tmp_path: Path) -> None:
    objects = [
        door("hinged & odd", 2.0, 1.0, 0.4),
        door("round", -2.0, 1.0, limits=(-np.pi, np.pi), wraps=True),
        sliding_door("sliding", 0.0, -1.0, 0.2),
        table("desk", 1.0, 0.5, 0.7),
    ]
    original = building(enclosure(8.0, 5.0), *objects)
    path = tmp_path / "again.urdf"
    path.write_text(self_contained_urdf(original), encoding="utf-8")
    again = load_building(path)
    assert sorted(again.objects) == sorted(original.objects)
    for name, item in original.objects.items():
        other = again[name]
        assert other.kind is item.kind
        assert other.wraps == item.wraps
        state = np.full((1, len(item.coordinates)), 0.3)
        assert other.transforms(state) == pytest.approx(item.transforms(state), abs=1e-4)
        assert bounds(other.mesh.vertices) == pytest.approx(bounds(item.mesh.vertices), abs=1e-4)
    assert bounds(again.walls.vertices) == pytest.approx(bounds(original.walls.vertices), abs=1e-4)


def bounds(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def test_links_are_named_after_their_objects() -> None:
    text = self_contained_urdf(building(enclosure(4.0, 4.0), table("desk", 0.0, 0.0)))
    assert f'<link name="{link_of("desk")}">' in text
    assert "filename" not in text
