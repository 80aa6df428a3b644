"""``embreex.rtcore_scene``: the scene and its rays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._arrays import ArrayLike, as_array, as_float32, as_points
from ..._errors import ArgumentError, ArgumentTypeError
from .._lazy import LazyScene

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["EmbreeScene"]

#: What embreex takes for no end of a ray, and returns as the distance of a miss.
_FAR = np.float32(1e37)


class EmbreeScene:
    """A scene to which meshes are added (:mod:`~ropewalk.compat.embreex.mesh_construction`), and rays are asked of.

    Args:
        device: without effect.
        robust: without effect: no ray passes between two triangles that share an edge, whatever is said.

    The tree is built by the first :meth:`run`, and again by the first one after another mesh was added. Scenes
    can be pickled.

    >>> EmbreeScene().run(np.float32([[0, 0, 0]]), np.float32([[0, 0, 1]]))
    array([-1], dtype=int32)
    """

    def __init__(self, device: Any = None, robust: bool = True) -> None:
        self.device = device
        self._meshes = LazyScene()

    def run(
        self,
        vec_origins: ArrayLike,
        vec_directions: ArrayLike,
        dists: ArrayLike | None = None,
        query: str = "INTERSECT",
        output: Any = None,
    ) -> Any:
        """Casts rays.

        Args:
            vec_origins: shape (n, 3), rounded to float32.
            vec_directions: shape (n, 3), or (1, 3) for all rays, of any length.
            dists: where rays end, in lengths of their directions: a number, or (n,); 1e37 by default. Not
                written to.
            query: ``"INTERSECT"`` for the nearest triangle, ``"OCCLUDED"`` for any, ``"DISTANCE"`` for how far.
            output: whatever is true asks for all of a hit.

        Returns:
            ``"INTERSECT"``: int32 (n,), triangle within its mesh, -1 for a miss. ``"OCCLUDED"``: int32 (n,), **0 for
            a hit**, -1 for a miss. ``"DISTANCE"``: float32 (n,), in lengths of the direction, where the ray ends
            for a miss. With ``output`` a dict of the nearest hits, whatever the query: ``u`` and ``v`` (n,)
            float32, weights of vertices 1 and 2, ``Ng`` (n, 3) float32, the cross product of edges 0-1 and
            0-2, ``tfar`` (n,) float32 as of ``"DISTANCE"``, ``primID`` and ``geomID`` (n,) int32. Of a miss -1, and 0
            for ``u``, ``v`` and ``Ng``.

        Raises:
            ArgumentError: (ValueError) arrays of wrong shapes, unknown queries.
            ArgumentTypeError: (TypeError) arrays that are no real numbers.

        >>> from ropewalk.compat.embreex import TriangleMesh
        >>> scene = EmbreeScene()
        >>> mesh = TriangleMesh(scene, np.float32([[[0, 0, 0], [2, 0, 0], [0, 2, 0]]]))
        >>> scene.run([[0.5, 1, 4], [5, 5, 4]], [[0, 0, -2]], query="OCCLUDED")
        array([ 0, -1], dtype=int32)
        >>> hit = scene.run([[0.5, 1, 4]], [[0, 0, -2]], output=1)
        >>> hit["tfar"], hit["u"], hit["v"], hit["Ng"]
        (array([2.], dtype=float32), array([0.25], dtype=float32), array([0.5], dtype=float32), array([[0., 0., 4.]], dtype=float32))
        """
        if query not in ("INTERSECT", "OCCLUDED", "DISTANCE"):
            raise ArgumentError(
                f"Embree ray query type {query} not recognized.\n"
                "Accepted types are (INTERSECT,OCCLUDED,DISTANCE)",
                "query",
            )
        o = _rows(vec_origins, "vec_origins")
        d = _rows(vec_directions, "vec_directions")
        n = len(o)
        if len(d) not in (1, n):
            raise ArgumentError(
                f"vec_directions: expected 1 or {n} directions, found {len(d)}", "vec_directions"
            )
        far = _FAR if dists is None else as_float32(as_array(dists, "dists"))
        if np.shape(far) not in ((), (1,), (n,)):
            raise ArgumentError(
                f"dists: expected a number or shape ({n},), found {np.shape(far)}", "dists"
            )
        if n == 0:
            d = d[:0]
        scene = self._meshes.scene()
        if query == "OCCLUDED" and not output:
            return np.where(scene.occluded(o, d, t_max=far), 0, -1).astype(np.int32)
        hits = scene.closest_hit(o, d, t_max=far)
        hit = hits.hit
        if query == "INTERSECT" and not output:
            return hits.prim_id
        tfar = np.where(hit, hits.t, far)
        if not output:
            return tfar
        uv, normals = hits._look("uv", "cross")
        missed = ~hit
        uv[missed] = normals[missed] = 0
        return {
            "u": np.ascontiguousarray(uv[:, 0]),
            "v": np.ascontiguousarray(uv[:, 1]),
            "Ng": normals,
            "tfar": tfar,
            "primID": hits.prim_id,
            "geomID": hits.geom_id,
        }


def _rows(value: ArrayLike, argument: str) -> np.ndarray:
    """Shape (n, 3)."""
    array = np.asarray(as_points(value, argument))
    if array.ndim != 2:
        raise ArgumentError(f"{argument}: expected an array of shape (n, 3), found {array.shape}", argument)
    return array


def as_scene(scene: Any) -> LazyScene:
    """What a mesh is added to."""
    if not isinstance(scene, EmbreeScene):
        raise ArgumentTypeError(
            f"scene: expected an EmbreeScene of ropewalk.compat.embreex, found {type(scene).__name__}", "scene"
        )
    return scene._meshes
