"""COLLADA meshes are taken in the unit, and with the axis up, that their files state."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.building.mesh_files import load_mesh
from objstate.building.shapes import Box
from objstate.geometry import FloatArray

collada = pytest.importorskip(
    "collada", reason="pycollada is not installed (pip install 'objstate[collada]')"
)

SIZE = (1.0, 2.0, 3.0)  # m, with z up
# a vector with z up, in the axes of a file: COLLADA 1.5, <up_axis>
DRAWN = {
    "X_UP": lambda v: np.column_stack([v[:, 2], -v[:, 0], -v[:, 1]]),
    "Y_UP": lambda v: np.column_stack([v[:, 0], v[:, 2], -v[:, 1]]),
    "Z_UP": lambda v: v,
}


def save(path: Path, vertices: FloatArray, faces: FloatArray, up: str, unit: float) -> None:
    """A file of one mesh, placed 1 unit along its own x by a node of the scene."""
    mesh = collada.Collada()
    mesh.assetInfo.upaxis, mesh.assetInfo.unitname, mesh.assetInfo.unitmeter = up, "unit", unit
    source = collada.source.FloatSource("v", vertices.ravel(), ("X", "Y", "Z"))
    geometry = collada.geometry.Geometry(mesh, "g", "g", [source])
    inputs = collada.source.InputList()
    inputs.addInput(0, "VERTEX", "#v")
    geometry.primitives.append(geometry.createTriangleSet(faces.ravel(), inputs, "m"))
    mesh.geometries.append(geometry)
    move = collada.scene.TranslateTransform(1.0, 0.0, 0.0)
    inner = collada.scene.GeometryNode(geometry, [])
    scene = collada.scene.Scene("s", [collada.scene.Node("n", [inner], [move])])
    mesh.scenes.append(scene)
    mesh.scene = scene
    mesh.write(str(path))


@pytest.mark.parametrize("up", ["X_UP", "Y_UP", "Z_UP"])
def test_a_mesh_stands_as_it_was_drawn_in_metres(tmp_path: Path, up: str) -> None:
    box = Box(SIZE).mesh()
    drawn = DRAWN[up](box.vertices) * 100 - [1.0, 0.0, 0.0]  # which its node takes back
    save(tmp_path / "box.dae", drawn, box.faces, up, 0.01)
    found = load_mesh(tmp_path / "box.dae", "a test")
    corners = {tuple(np.round(v, 6) + 0.0) for v in found.vertices}
    assert corners == {tuple(v) for v in box.vertices}
    a, b, c = (found.vertices[found.faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    before = [box.vertices[box.faces[:, k]] for k in range(3)]
    assert volume == pytest.approx(
        np.einsum("ij,ij->i", before[0], np.cross(before[1], before[2])).sum() / 6
    )  # no axis is mirrored
