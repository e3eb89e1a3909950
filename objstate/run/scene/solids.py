"""A mesh as boxes: the one shape that a URDF holds in itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Mesh
from objstate.building.outline import outline
from objstate.geometry import FloatArray, rotation_about, transform

THICKNESS = 0.02  # m, of the sheets that stand for surfaces that are no box
SAME = 1e-3  # a solid fills its box when their volumes differ by no more than this share
LEAST = 1e-3  # m: no box is thinner
WELD = 6  # decimals of a metre
UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Solid:
    """An upright box."""

    size: FloatArray  # (3,) m
    place: FloatArray  # (4, 4) of its middle


def solids(mesh: Mesh) -> list[Solid]:
    """Boxes that look like a mesh from the side and from above.

    A connected piece that is an upright box is that box. What is left becomes sheets
    as high as each piece of it, along the outline at half its height.
    """
    found, rest = [], []
    for piece in _pieces(mesh):
        box = _box_around(piece)
        if _fills(piece, box):
            found.append(box)
        else:
            rest.append(piece)
    for piece in _pieces(_welded(Mesh.joined(rest))):
        box = _box_around(piece)
        found += [box] if _fills(piece, box) else _sheets(piece)
    return found


def _fills(piece: Mesh, box: Solid) -> bool:
    volume = float(np.prod(box.size))
    return abs(_volume(piece) - volume) <= SAME * volume


def _sheets(piece: Mesh) -> Iterator[Solid]:
    low, high = (float(value) for value in (piece.vertices[:, 2].min(), piece.vertices[:, 2].max()))
    for start, end in outline(piece, (low + high) / 2):
        length, middle = float(np.hypot(*(end - start))), (start + end) / 2
        turn = rotation_about(UP, np.arctan2(*(end - start)[::-1]))
        place = transform(turn, (*middle, (low + high) / 2))
        yield Solid(np.array([length, THICKNESS, max(high - low, LEAST)]), place)


def _welded(mesh: Mesh) -> Mesh:
    """The same triangles with one corner wherever several lie; files often tell each apart."""
    if not len(mesh.faces):
        return mesh
    corners, same = np.unique(mesh.vertices.round(WELD), axis=0, return_inverse=True)
    return Mesh(corners, np.asarray(same).reshape(-1)[mesh.faces])


def _pieces(mesh: Mesh) -> list[Mesh]:
    """The pieces of a mesh that share corners."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not len(mesh.faces):
        return []
    ends = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]]])
    graph = coo_array((np.ones(len(ends)), ends.T), shape=(len(mesh.vertices),) * 2)
    _, piece = connected_components(graph, directed=False)
    groups = _groups(mesh.faces, piece[mesh.faces[:, 0]])
    return [Mesh(mesh.vertices[np.unique(own)], _renumbered(own)) for own in groups]


def _groups(faces: np.ndarray, of_face: np.ndarray) -> list[np.ndarray]:
    order = np.argsort(of_face, kind="stable")
    return np.split(faces[order], np.flatnonzero(np.diff(of_face[order])) + 1)


def _renumbered(faces: np.ndarray) -> np.ndarray:
    """Indices into the corners that the faces use."""
    _, index = np.unique(faces, return_inverse=True)
    return np.asarray(index).reshape(-1, 3)


def _box_around(piece: Mesh) -> Solid:
    """The smallest upright box around a piece."""
    import shapely

    points = shapely.multipoints(piece.vertices[:, :2])
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(points))
    low, high = piece.vertices[:, 2].min(), piece.vertices[:, 2].max()
    along = corners[1] - corners[0] if len(corners) > 1 else np.array([1.0, 0.0])
    turn = rotation_about(UP, np.arctan2(along[1], along[0]))
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    inside = (corners - middle) @ turn[:2, :2]
    size = np.array([*np.ptp(inside, axis=0), high - low]).clip(min=LEAST)
    return Solid(size, transform(turn, (*middle, (low + high) / 2)))


def _volume(mesh: Mesh) -> float:
    """Volume of a closed mesh, m^3; near zero of an open one."""
    about = mesh.vertices - mesh.vertices.mean(axis=0)
    a, b, c = (about[mesh.faces[:, k]] for k in range(3))
    return abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6.0
