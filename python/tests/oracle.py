"""Brute force in NumPy, in float64, over what was rounded to ``dtype``, float32 unless said otherwise.

The triangle test is that of docs/numerics.md, written down a second time. Where it depends on how
products are rounded (a ray through an edge, a triangle seen edge-on) a ray is left undecided.
"""

from __future__ import annotations

import numpy as np

#: Edge functions below this share of their products may be rounding alone.
UNSURE = 1e-12
#: Below this share of the products the engine computes edge functions again, without rounding.
FILTER = 2.0**-11


class Oracle:
    """All crossings of all rays and triangles."""

    def __init__(self, triangles, origins, directions, t_min=0.0, t_max=np.inf, dtype=np.float32):
        tri = np.asarray(triangles, dtype).astype(np.float64)
        o = np.asarray(origins, dtype)
        d = np.asarray(directions, dtype)
        n, rows = len(o), np.arange(len(o))
        kz = np.abs(d[:, 1]) > np.abs(d[:, 0])
        kz = np.where(np.abs(d[:, 2]) > np.abs(d[rows, kz.astype(int)]), 2, kz.astype(int))
        down = (d[rows, kz] < 0).astype(int)
        kx, ky = (kz + 1 + down) % 3, (kz + 2 - down) % 3
        o, d = o.astype(np.float64), d.astype(np.float64)
        with np.errstate(all="ignore"):
            dz = d[rows, kz]
            sx, sy, sz = d[rows, kx] / dz, d[rows, ky] / dz, 1.0 / dz

            def corner(i):
                z = tri[None, :, i, :][0][:, kz].T - o[rows, kz][:, None]
                x = tri[:, i, :][:, kx].T - o[rows, kx][:, None]
                y = tri[:, i, :][:, ky].T - o[rows, ky][:, None]
                return x - sx[:, None] * z, y - sy[:, None] * z, z

            a, b, c = corner(0), corner(1), corner(2)

            def edge(p, q):
                return p[0] * q[1] - p[1] * q[0], np.abs(p[0] * q[1]) + np.abs(p[1] * q[0])

            (u, pu), (v, pv), (w, pw) = edge(c, b), edge(a, c), edge(b, a)
            products = pu + pv + pw
            mixed = ((u < 0) | (v < 0) | (w < 0)) & ((u > 0) | (v > 0) | (w > 0))
            small = UNSURE * products
            clearly = ((u < -small) | (v < -small) | (w < -small)) & (
                (u > small) | (v > small) | (w > small)
            )
            det = u + v + w
            depth = (u * a[2] + v * b[2] + w * c[2]) / det
            low = np.minimum(np.minimum(a[2], b[2]), c[2])
            high = np.maximum(np.maximum(a[2], b[2]), c[2])
            t = (sz[:, None] * np.clip(depth, low, high)).astype(dtype)
            degenerate = ~np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0]).any(axis=1)
            touching = np.minimum(np.minimum(np.abs(u), np.abs(v)), np.abs(w)) <= small
            unsure = ~clearly & (touching | (np.abs(det) < FILTER * products)) & ~degenerate
            in_range = (t >= dtype(t_min)) & (t <= dtype(t_max)) & np.isfinite(t)
            valid = np.isfinite(o).all(1) & np.isfinite(d).all(1) & d.any(1)
        #: True for each ray and triangle that meet.
        self.hit = ~mixed & in_range & ~degenerate & valid[:, None]
        self.t = np.where(self.hit, t, np.inf)
        with np.errstate(all="ignore"):
            self.uv = np.stack([v / det, w / det], -1).astype(dtype)
        #: Rays that meet every triangle clearly or not at all.
        self.sure = ~(unsure & valid[:, None]).any(axis=1)
        assert self.t.shape == (n, len(tri))

    def only(self, allowed):
        """The same, with crossings of some rays and triangles alone."""
        self.hit = self.hit & allowed
        self.t = np.where(self.hit, self.t, np.inf)
        return self

    def closest(self):
        """t and triangle of the first hits; inf and -1."""
        prim = self.t.argmin(axis=1)
        t = self.t[np.arange(len(prim)), prim]
        return t, np.where(np.isfinite(t), prim, -1)

    def lists(self, k=None):
        """For each ray the hits (t, triangle) in order, or the first k."""
        order = np.argsort(self.t, axis=1, kind="stable")
        return [
            [(self.t[i, j], j) for j in order[i] if self.hit[i, j]][:k] for i in range(len(order))
        ]
