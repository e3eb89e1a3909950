"""A building's walls, bent by displacements of the vertical lines in which their faces meet.

A wall that was built or mapped off its place is so on all its height. So all vertices above each
other are one *column*, which is displaced as a whole; faces between columns follow, and stay joined
to their neighbours. Faces are cut, so that columns are at most ``PIECE`` apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Mesh
from objstate.building.outline import crossings
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import lazy

if TYPE_CHECKING:
    from scipy.sparse import csc_array

PIECE = 2.0  # m, largest distance of columns along a wall
SAME = 1e-5  # m: vertices so near to each other, seen from above, are of one column
UPRIGHT = 1e-3  # largest vertical component of the normal of a wall's face
ABOUT = 2.0  # m about a place that its walls are
SHORTEST = 0.01  # m: shorter distances of columns count as this one


@dataclass(frozen=True, eq=False)
class Faces:
    """What a level plane shows of walls: a segment for each triangle."""

    segments: FloatArray  # (k, 4) m, both ends
    columns: IntArray  # (k, 2, 2) two columns for each end
    shares: FloatArray  # (k, 2, 2) of their displacements that the end has


@dataclass(frozen=True, eq=False)
class Columns:
    """Walls in pieces, and the columns between them."""

    mesh: Mesh  # the same walls, their faces cut
    of_vertex: IntArray  # (v,) the column of each vertex
    places: FloatArray  # (c, 2) m

    @staticmethod
    def of(walls: Mesh) -> Columns:
        """The columns of some walls."""
        mesh = _cut(walls)
        snapped = np.round(mesh.vertices[:, :2] / SAME).astype(np.int64)
        _, first, of_vertex = np.unique(snapped, axis=0, return_index=True, return_inverse=True)
        return Columns(mesh, of_vertex.reshape(-1), mesh.vertices[first, :2])

    def faces(self, height: float) -> Faces:
        """What the plane at a ``height``, m, shows."""
        tips, others, shares = crossings(self.mesh, height)
        start, end = self.mesh.vertices[tips, None, :2], self.mesh.vertices[others, :2]
        segments = (start + shares[..., None] * (end - start)).reshape(-1, 4)
        seen = np.hypot(*(segments[:, 2:] - segments[:, :2]).T) > SAME
        tips = np.broadcast_to(tips[:, None], others.shape)
        return Faces(
            segments[seen],
            self.of_vertex[np.stack([tips, others], axis=-1)][seen],
            np.stack([1.0 - shares, shares], axis=-1)[seen],
        )

    def warped(self, displacements: FloatArray) -> Mesh:
        """The walls after ``displacements`` (c, 2) m of their columns."""
        vertices = self.mesh.vertices.copy()
        vertices[:, :2] += displacements[self.of_vertex]
        return Mesh(vertices, self.mesh.faces)

    def displaced(self, displacements: FloatArray) -> Columns:
        """The same columns, where ``displacements`` (c, 2) m take them."""
        return Columns(self.warped(displacements), self.of_vertex, self.places + displacements)

    def motion(self, displacements: FloatArray, place: FloatArray) -> tuple[FloatArray, float]:
        """The rigid motion of the walls about a place (2,): its shift (2,) m, and its turn in rad.

        By least squares over the ``displacements`` (c, 2) m of columns, weighted by distance.
        """
        x, y = (self.places - place).T
        weights = np.exp(-0.5 * np.hypot(x, y) / ABOUT)
        by_x = np.column_stack([np.ones(len(x)), np.zeros(len(x)), -y])
        by_y = np.column_stack([np.zeros(len(x)), np.ones(len(x)), x])
        over = np.concatenate([by_x, by_y]) * np.tile(weights, 2)[:, None]
        off = (displacements * weights[:, None]).T.ravel()
        shift_x, shift_y, turn = np.linalg.lstsq(over, off, rcond=None)[0].tolist()
        return np.array([shift_x, shift_y]), turn

    @lazy
    def edges(self) -> tuple[IntArray, FloatArray]:
        """Pairs (e, 2) of columns that walls join, and their distances (e,) m."""
        edges = self.mesh.faces[_upright(self.mesh)][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        pairs = np.unique(np.sort(self.of_vertex[edges], axis=1), axis=0)
        pairs = pairs[pairs[:, 0] != pairs[:, 1]]
        return pairs, np.hypot(*(self.places[pairs[:, 1]] - self.places[pairs[:, 0]]).T)

    def precision(self, length: float) -> csc_array:
        """(c, c) of each coordinate of displacements whose variance is one.

        Along a wall, displacements are an Ornstein-Uhlenbeck process with the decorrelation
        ``length``, m, here by linear finite elements (Lindgren, Rue and Lindstrom 2011). Walls that
        are joined and shorter than this move as one. A column that is in no wall stays where it is.
        """
        from scipy.sparse import coo_array, diags_array
        from scipy.sparse.csgraph import connected_components

        (first, second), distances = self.edges[0].T, self.edges[1].clip(min=SHORTEST)
        count, stiff = len(self.places), length / 2.0 / distances
        both, twice = np.append(first, second), np.append(second, first)
        joined = coo_array((-np.append(stiff, stiff), (both, twice)), shape=(count, count))
        mass = np.bincount(both, np.append(distances, distances), count) / (4.0 * length)
        part = connected_components(joined, directed=False)[1]
        whole = np.bincount(part, mass)
        mass *= (1.0 / whole.clip(1e-9, 1.0))[part]
        mass[mass == 0.0] = SHORTEST**-2.0
        return (
            diags_array(mass + np.bincount(both, np.append(stiff, stiff), count)) + joined
        ).tocsc()


def _upright(mesh: Mesh) -> BoolArray:
    """(f,) whether faces are upright, and no mere lines."""
    first, second, third = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(second - first, third - first)
    size = np.linalg.norm(normals, axis=1)
    return np.asarray((np.abs(normals[:, 2]) <= UPRIGHT * size) & (size > 0.0))


def _cut(mesh: Mesh) -> Mesh:
    """The same walls, with edges of upright faces halved until they are short enough.

    Each edge is halved in all triangles that share it, so that faces stay joined.
    """
    vertices, vertex = np.unique(mesh.vertices, axis=0, return_inverse=True)
    faces = vertex.reshape(-1)[mesh.faces]
    while True:
        upright = _upright(Mesh(vertices, faces))
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)  # (f, 3, 2)
        along = vertices[edges[..., 1], :2] - vertices[edges[..., 0], :2]
        long = (np.hypot(along[..., 0], along[..., 1]) > PIECE) & upright[:, None]
        halved = np.unique(edges[long], axis=0)
        if not len(halved):
            return Mesh(vertices, faces)
        codes = halved[:, 0] * len(vertices) + halved[:, 1]
        middles = len(vertices) + np.arange(len(halved))
        vertices = np.concatenate([vertices, vertices[halved].mean(axis=1)])
        faces = _split(faces, edges[..., 0] * (middles[0]) + edges[..., 1], codes, middles)


def _split(faces: IntArray, edges: IntArray, halved: IntArray, middles: IntArray) -> IntArray:
    """Triangles (f, 3) with the edges that are ``halved`` (h,) split at new vertices (h,).

    ``edges`` (f, 3) are codes, of the edge after each corner; ``halved`` are ascending.
    """
    place = np.searchsorted(halved, edges).clip(max=len(halved) - 1)
    middle = np.where(halved[place] == edges, middles[place], -1)  # (f, 3)
    count = np.count_nonzero(middle >= 0, axis=1)
    # turned so that an edge that is split, or the one that alone isn't, comes first
    lone = np.where(count == 2, np.argmax(middle < 0, axis=1), np.argmax(middle >= 0, axis=1))
    turn = (lone[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, turn, axis=1).T
    ab, bc, ca = np.take_along_axis(middle, turn, axis=1).T
    parts = [
        np.column_stack([a, b, c])[count == 0],
        *(np.column_stack(each)[count == 1] for each in ((a, ab, c), (ab, b, c))),
        *(np.column_stack(each)[count == 2] for each in ((a, b, bc), (a, bc, ca), (ca, bc, c))),
        *(
            np.column_stack(each)[count == 3]
            for each in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        ),
    ]
    return np.concatenate(parts)
