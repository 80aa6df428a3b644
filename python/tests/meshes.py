"""Meshes and rays for tests."""

from __future__ import annotations

import numpy as np


def random_mesh(rng, count, scale):
    """Triangles in a cube of edge ``scale`` around the origin."""
    centers = rng.uniform(-0.5, 0.5, (count, 1, 3))
    corners = centers + rng.normal(0, 0.15, (count, 3, 3))
    return (scale * corners).astype(np.float32).reshape(-1, 3), faces(count)


def degenerate_mesh(rng, count, scale):
    """Random triangles, every fourth twice, every fifth without area, every sixth a sliver."""
    vertices, indices = random_mesh(rng, count, scale)
    triangles = vertices.reshape(count, 3, 3)
    triangles[3::4] = triangles[2::4][: len(triangles[3::4])]
    triangles[4::5, 2] = triangles[4::5, 1]
    along = triangles[5::6, 1] - triangles[5::6, 0]
    triangles[5::6, 2] = triangles[5::6, 0] + 0.5 * along + np.float32(1e-3 * scale)
    return triangles.reshape(-1, 3), indices


def grid_mesh(rng, count, scale):
    """Corners on a coarse grid: exact ties, shared planes, triangles without area."""
    corners = rng.integers(-3, 4, (count, 3, 3)) * (scale / 4)
    return corners.astype(np.float32).reshape(-1, 3), faces(count)


def faces(count):
    return np.arange(3 * count, dtype=np.uint32).reshape(count, 3)


def rays(rng, count, scale):
    """Rays from in and around the cube, directions of many lengths."""
    origins = (scale * rng.uniform(-1, 1, (count, 3))).astype(np.float32)
    directions = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 3, (count, 1))
    return origins, directions.astype(np.float32)


def box(low=(0, 0, 0), high=(1, 1, 1), dtype=np.float64):
    """A closed box of twelve triangles that turn counter-clockwise as seen from outside."""
    low, high = np.array(low, dtype), np.array(high, dtype)
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    indices = [[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)]
    return np.where(corners == 1, high, low), np.array(indices)


def subdivide(vertices, indices):
    """Four triangles for each one, by the middles of edges; vertices are not shared."""
    a, b, c = np.moveaxis(vertices[indices], 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = np.stack([a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca], axis=1)
    return parts.reshape(-1, 3), np.arange(12 * len(indices)).reshape(-1, 3)


def sphere(subdivisions, radius=1.0):
    """A closed sphere of triangles, an octahedron that is subdivided."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    indices = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    indices = np.array(indices)
    for _ in range(subdivisions):
        vertices, indices = subdivide(vertices, indices)
    vertices, same = np.unique(vertices.round(12), axis=0, return_inverse=True)
    vertices *= radius / np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, same.reshape(-1)[indices]
