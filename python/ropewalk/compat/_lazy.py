"""Scenes that are built when they are first asked, and places where a ray meets several faces."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arrays import as_faces, as_float32, as_rows
from .._errors import ArgumentError
from .._scene import Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .._hits import HitLists

#: Hits of a ray in float64 that differ by less than this share of the distance from its origin to the farthest
#: corner of the scene's box are one place. The parameter of a triangle that is met at an angle of at least 2^-9 is
#: off by no more than 2^-41 of the distance of its corners: eight roundings of 2^-53, over the angle.
SAME_PLACE = 2.0**-40


_Mesh = tuple["NDArray[np.float32]", "NDArray[np.uint32]"]


class LazyScene:
    """Meshes in float32, and the scene of them, built when it is first asked for and again after more were added."""

    def __init__(self, threads: int = 0) -> None:
        self._threads = threads
        self._meshes: tuple[_Mesh, ...] = ()
        # What was made of which meshes. Two threads may make it at once, with the same outcome.
        self._scene: tuple[tuple[_Mesh, ...], Scene] | None = None
        self._corners: tuple[tuple[_Mesh, ...], NDArray[np.float32]] | None = None
        # Held for an assignment alone, so that a process may fork while another thread builds.
        self._lock = threading.Lock()

    def add(self, vertices: Any, faces: Any, names: tuple[str, str]) -> int:
        """Adds a mesh, of which the arrays are copied; its number. ``names`` are those of the arguments."""
        given = as_rows(vertices, names[0])
        corners = as_faces(faces, names[1], len(given))
        points = np.array(as_float32(np.asarray(given)))
        # What is wrong with vertices, and what rounding does to them, is said now and not by the first query.
        try:
            Scene(given, corners[:1], precision="single", threads=1)
        except ArgumentError as error:
            message = str(error).replace("vertices", names[0], 1)
            raise ArgumentError(message, names[0], error.index) from None
        mesh = points, np.array(corners)
        with self._lock:
            self._meshes = (*self._meshes, mesh)
            return len(self._meshes) - 1

    def scene(self) -> Scene:
        """The scene of all meshes so far."""
        built, meshes = self._scene, self._meshes
        if built is None or built[0] is not meshes:
            scene = Scene.from_meshes(meshes, precision="single", threads=self._threads)
            built = self._scene = meshes, scene
        return built[1]

    def triangles(self, geom: NDArray[Any], prim: NDArray[Any]) -> NDArray[np.float64]:
        """Corners of triangles that queries named, shape (..., 3, 3)."""
        made, meshes = self._corners, self._meshes
        if made is None or made[0] is not meshes:
            parts = [points[faces] for points, faces in meshes]
            made = self._corners = meshes, np.concatenate([*parts, np.empty((0, 3, 3), np.float32)])
        starts = np.cumsum([0, *(len(faces) for _, faces in meshes)])
        return np.asarray(made[1][starts[geom] + prim], np.float64)

    def first_of_places(
        self, hits: HitLists, origins: NDArray[Any], directions: NDArray[Any]
    ) -> NDArray[np.bool_]:
        """True for each hit that begins a place: of hits of one ray and mesh at one parameter the first.

        Parameters are equal in float32, or next to each other and equal in float64: where the true one lies in the
        middle of two float32 the faces of an edge may be rounded to either.
        """
        count, ray = len(hits.t), hits.ray_id
        order = np.lexsort((hits.t, hits.geom_id, ray)) if len(self._meshes) > 1 else np.arange(count)
        t = hits.t[order]
        same = (np.diff(ray[order]) == 0) & (np.diff(hits.geom_id[order]) == 0)
        ties = same & (t[1:] == np.nextafter(t[:-1], np.float32(np.inf)))
        same &= np.diff(t) == 0
        (at,) = np.nonzero(ties)
        if len(at):
            pair = order[np.stack([at, at + 1])]
            o = origins.reshape(-1, 3)[ray[pair]].astype(np.float64)
            d = directions.reshape(-1, 3)[ray[pair]].astype(np.float64)
            corners = self.triangles(hits.geom_id[pair], hits.prim_id[pair])
            normal = np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :])
            with np.errstate(all="ignore"):
                exact = np.sum(normal * (corners[..., 0, :] - o), -1) / np.sum(normal * d, -1)
                far = np.linalg.norm(corners - o[..., None, :], axis=-1).max(axis=(0, -1))
                slack = SAME_PLACE * far / np.linalg.norm(d[0], axis=-1)
                same[at] = np.abs(exact[1] - exact[0]) <= slack
        first = np.ones(count, bool)
        first[order[1:]] = ~same
        return first

    def __getstate__(self) -> dict[str, Any]:
        return {"_threads": self._threads, "_meshes": self._meshes}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["_threads"])  # type: ignore[misc]
        self._meshes = state["_meshes"]


def first_of_places(hits: HitLists, slack: NDArray[np.float64]) -> NDArray[np.bool_]:
    """True for each hit that begins a place: a run of hits of one ray at the same parameter.

    Faces that share an edge are met at one place by a ray through it; so are coincident ones. ``slack`` is by how
    much parameters of one place may differ from one to the next, a number a ray.
    """
    first = np.ones(len(hits.t), bool)
    if len(first) > 1:
        first[1:] = np.diff(hits.t) > slack[hits.ray_id[1:]]
        starts = hits.offsets[:-1][np.diff(hits.offsets) > 0]
        first[starts] = True
    return first
