"""Particles moved segment by segment, beside embreex: ``walker.py [--rounds N] [--robust]``; prints the table of
docs/python.md.

A bumpy torus and particles from random points of its box, each with segments in random directions and of
exponential lengths. The walker reports all crossings; loops over embreex ask for the nearest hit within each
segment only and move the particles, all of them a step or one a call; below the table are its calls alone,
with arrays made beforehand. One thread, CPU time, rounds interleaved, medians.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

import ropewalk

SIDE = 225
PARTICLES, SEGMENTS = 4000, 64


def bumpy_torus(side):
    """A closed surface of 2 side^2 triangles."""
    u, v = np.meshgrid(*[np.arange(side) * 2 * np.pi / side] * 2, indexing="ij")
    tube = 0.4 + 0.05 * np.sin(9 * u) * np.cos(7 * v)
    ring = 1 + tube * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)], axis=-1)
    i, j = (x.reshape(-1) for x in np.indices((side, side)))
    at = lambda i, j: i % side * side + j % side  # noqa: E731
    corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
    faces = np.concatenate([np.stack([corners[k] for k in of], axis=1) for of in ([0, 1, 2], [0, 2, 3])])
    return np.float32(vertices.reshape(-1, 3)), np.int32(faces)


def walks(rng, low, high, share):
    """First points, directions, and lengths of mean ``share`` of the box's diagonal."""
    points = np.float32(rng.uniform(low, high, (PARTICLES, 3)))
    directions = rng.normal(size=(PARTICLES, SEGMENTS, 3))
    directions = np.float32(directions / np.linalg.norm(directions, axis=2, keepdims=True))
    mean = share * np.linalg.norm(high - low)
    lengths = np.float32(rng.exponential(mean, (PARTICLES, SEGMENTS)))
    return points, directions, lengths


def ways(scene, embree, starts, directions, lengths):
    """Functions that walk all segments once and say how many crossings, or segments with one, they found."""
    rows = np.arange(PARTICLES + 1) * SEGMENTS
    flat = directions.reshape(-1, 3), lengths.reshape(-1)
    # As calls take them without a copy: a contiguous array a step.
    steps = [tuple(np.ascontiguousarray(a[:, s]) for a in (directions, lengths)) for s in range(SEGMENTS)]
    begins = [starts]
    for d, t in steps:
        begins.append(begins[-1] + d * t[:, None])
    singles = [(o[i : i + 1], d[i : i + 1], t[i : i + 1])
               for o, (d, t) in zip(begins, steps) for i in range(PARTICLES)]  # fmt: skip

    def run():
        return len(ropewalk.Walker(scene, starts, threads=1).run(rows, *flat))

    def advance():
        walker = ropewalk.Walker(scene, starts, threads=1)
        return sum(len(walker.advance(d, t)) for d, t in steps)

    def vectorised():
        points, found = starts, 0
        for d, t in steps:
            found += np.count_nonzero(embree.run(points, d, dists=t) >= 0)
            points = points + d * t[:, None]
        return found

    def single():
        found = 0
        for i in range(PARTICLES):
            point = starts[i : i + 1]
            for d, t in zip(directions[i, :, None], lengths[i, :, None]):
                found += embree.run(point, d, dists=t)[0] >= 0
                point = point + d * t
        return found

    def vectorised_calls():
        return sum(np.count_nonzero(embree.run(o, d, dists=t) >= 0) for o, (d, t) in zip(begins, steps))

    def single_calls():
        return sum(embree.run(*line, dists=t)[0] >= 0 for *line, t in singles)

    calls = {"embreex calls": vectorised_calls, "single calls": single_calls}
    return {"run": run, "advance": advance, "embreex": vectorised, "single": single, **calls}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--robust", action="store_true", help="embreex with its robust flag")
    arguments = parser.parse_args()
    rounds = arguments.rounds
    vertices, faces = bumpy_torus(SIDE)
    scene = ropewalk.Scene(vertices, faces)
    embree = rtcore_scene.EmbreeScene(robust=arguments.robust)
    TriangleMesh(embree, vertices[faces])
    count = PARTICLES * SEGMENTS
    print(f"{len(faces):,} triangles, {PARTICLES:,} particles, {SEGMENTS} segments each; {ropewalk.simd_level()}, "
          f"one thread, medians of {rounds} rounds; ns a segment\n")
    print(f"| mean length | `run` | `advance`, {SEGMENTS} calls | embreex, {SEGMENTS} calls | embreex, a call a segment |")
    print("| --- | --- | --- | --- | --- |")
    notes = []
    for share in (0.01, 0.002):
        rng = np.random.default_rng(1)
        asked = ways(scene, embree, *walks(rng, vertices.min(axis=0), vertices.max(axis=0), share))
        times, found = {name: [] for name in asked}, {}
        for _ in range(rounds + 1):
            for name, walk in asked.items():
                start = time.process_time()
                found[name] = int(walk())
                times[name].append((time.process_time() - start) / count * 1e9)
        assert found["run"] == found["advance"] >= found["embreex"], found
        ns = {name: statistics.median(all[1:]) for name, all in times.items()}
        row = " | ".join(f"{ns[name]:,.0f}" for name in list(asked)[:4])
        print(f"| {share * 100:g} % of the diagonal | {row} |", flush=True)
        times = ", ".join(f"{name} {ns[name] / ns['run']:.1f}" for name in list(asked)[1:])
        alone = f"{ns['embreex calls']:,.0f} and {ns['single calls']:,.0f} ns"
        notes.append(
            f"{share * 100:g} %: over the time of run: {times}; embreex's calls alone {alone}; "
            f"{found['run']:,} crossings, {found['embreex']:,} segments with a hit"
        )
    print("\n" + "\n".join(notes))


if __name__ == "__main__":
    main()
