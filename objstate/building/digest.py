"""Digests by which a building is known again."""

from __future__ import annotations

import hashlib

import numpy as np

from objstate.building.model import Building, Mesh


def geometry_digest(building: Building) -> str:
    """SHA-256 of the walls and, by name, of every object's mesh and origin."""
    digest = hashlib.sha256()
    for array in _mesh_arrays(building.walls):
        digest.update(array.tobytes())
    for name, item in sorted(building.objects.items()):
        digest.update(name.encode())
        for array in (item.origin, *_mesh_arrays(item.mesh)):
            digest.update(array.tobytes())
    return digest.hexdigest()


def model_digest(building: Building) -> str:
    """SHA-256 of the geometry and of how every object moves: its kind, axis and limits."""
    digest = hashlib.sha256(geometry_digest(building).encode())
    for name, item in sorted(building.objects.items()):
        words = (name, item.kind.value, item.axis.tolist(), item.lower, item.upper, item.wraps)
        digest.update(repr(words).encode())
    return digest.hexdigest()


def _mesh_arrays(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(mesh.vertices, dtype="<f8"), np.asarray(mesh.faces, dtype="<i8")
