"""How the real building and robot differ from the model that is given away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.building.model import Building, Kind, Mesh
from objstate.geometry import FloatArray, IntArray, rotation_from_rpy, transform
from objstate.simulation.scene import ModelError, Mount

SAME_PLACE = 1e-6  # m; vertices closer together belong to one piece of wall


def real_building(model: Building, error: ModelError, rng: np.random.Generator) -> Building:
    """The building as it stands: each piece of wall and each hinge a little off."""
    objects = dict(model.objects)
    for name in sorted(objects):
        shift = rng.normal(0.0, error.hinge_sigma, size=2)
        if objects[name].kind is not Kind.PLANAR:  # furniture has no place in the model to be off
            origin = transform(np.eye(3), [*shift, 0.0]) @ objects[name].origin
            objects[name] = replace(objects[name], origin=origin)
    return replace(model, walls=_shifted(model.walls, error.wall_sigma, rng), objects=objects)


def real_mount(mount: Mount, error: ModelError, rng: np.random.Generator) -> FloatArray:
    """(4, 4) where a laser really sits on ``base_link``."""
    shift = rng.normal(0.0, error.laser_sigma, size=2)
    askew = mount.yaw + rng.normal(0.0, error.laser_yaw_sigma)
    place = [mount.x + shift[0], mount.y + shift[1], mount.z]
    return transform(rotation_from_rpy(mount.roll, mount.pitch, askew), place)


def _shifted(walls: Mesh, sigma: float, rng: np.random.Generator) -> Mesh:
    if sigma == 0.0 or not len(walls.faces):
        return walls
    piece = _pieces(walls)
    shifts = rng.normal(0.0, sigma, size=(piece.max() + 1, 3)) * [1.0, 1.0, 0.0]
    return Mesh(walls.vertices + shifts[piece], walls.faces)


def _pieces(mesh: Mesh) -> IntArray:
    """(v,) the number of the connected piece that each vertex belongs to."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    cells = np.round(mesh.vertices / SAME_PLACE).astype(np.int64)
    places, place_of = np.unique(cells, axis=0, return_inverse=True)
    corners = place_of.reshape(-1)[mesh.faces]
    edges = np.concatenate([corners[:, :2], corners[:, 1:]])
    count = len(places)
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    _, piece_of_place = connected_components(graph, directed=False)
    return np.asarray(piece_of_place[place_of.reshape(-1)], dtype=np.int64)
