"""What instances cost beside the same triangles in one scene: ``instances.py MESH [RAYS]``.

One thread; placing and building by the clock, medians of five; rays by CPU time, medians of three.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import ropewalk


def places(rng, count, diagonal):
    """Rotations about random axes, spread so that boxes overlap a little."""
    matrices = np.zeros((count, 3, 4))
    for matrix in matrices:
        matrix[:, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        matrix[:, 3] = rng.uniform(-1, 1, 3) * diagonal * count ** (1 / 3) * 0.7
    return matrices


def timed(work, rounds, clock):
    """Median seconds and the last result."""
    seconds = []
    for _ in range(rounds):
        start = clock()
        result = work()
        seconds.append(clock() - start)
    return float(np.median(seconds)), result


def main():
    path, count = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 200_000
    vertices, faces = ropewalk.read_mesh(path)
    diagonal = float(np.linalg.norm(vertices.max(axis=0) - vertices.min(axis=0)))
    kind = {"precision": "double", "threads": 1}
    build, scene = timed(lambda: ropewalk.Scene(vertices, faces, **kind), 5, time.perf_counter)
    print(f"{path}: {len(faces):,} triangles, built in {build * 1e3:.0f} ms")
    rng = np.random.default_rng(0)
    for n in (1, 10, 100, 1000, 10_000):
        matrices = places(rng, n, diagonal)

        def place():
            return ropewalk.Scene.from_instances([(scene, m) for m in matrices], threads=1)

        seconds, placed = timed(place, 5, time.perf_counter)
        low, high = placed.bounds
        around = rng.normal(size=(count, 3))
        around /= np.linalg.norm(around, axis=1)[:, None]
        origins = (low + high) / 2 + around * np.linalg.norm(high - low) / 2
        directions = rng.uniform(low, high, (count, 3)) - origins

        def cast(target):
            return target.closest_hit(origins, directions, threads=1)

        ray, hits = timed(lambda: cast(placed), 3, time.process_time)
        print(
            f"{n:6} instances, {len(placed):13,} triangles: placed in {seconds * 1e3:7.1f} ms, "
            f"{ray / count * 1e9:6.0f} ns a ray, {hits.hit.mean():.2f} hit, "
            f"trees {placed.report.tree_bytes / 2**20:.1f} MiB"
        )
        if n > 100:
            continue
        joined = np.concatenate([vertices @ m[:, :3].T + m[:, 3] for m in matrices])
        all_faces = np.concatenate([faces + i * len(vertices) for i in range(n)])
        seconds, one = timed(lambda: ropewalk.Scene(joined, all_faces, **kind), 1, time.perf_counter)
        ray, same = timed(lambda: cast(one), 3, time.process_time)
        differ = int((hits.hit != same.hit).sum())
        print(
            f"       as one scene: built in {seconds * 1e3:.0f} ms, {ray / count * 1e9:.0f} ns a ray, "
            f"tree {one.report.tree_bytes / 2**20:.1f} MiB; {differ} of {count:,} rays differ"
        )


if __name__ == "__main__":
    main()
