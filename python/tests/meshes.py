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
