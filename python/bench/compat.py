"""What embreex, trimesh, Open3D and the drop-ins for them answer to the same rays and points, judged exactly.

The judge is brute force over all triangles: candidates by the distance of their spheres from the ray's line, then by
signed volumes in float64, and what these leave in doubt, with the parameters of all hits, in rational numbers. All
rays are judged, those on which two differ and the others. Numbers are float32 for all, so that nobody rounds them.

A closest hit is right if no triangle is met at a smaller parameter, rounded to float32, and a miss if none is
met. A number of hits is right if it is the number of places that differ: as float32 for what answers in float32,
by more than 2^-40 of the scene for trimesh and the drop-in for it. A side is right if the number of exact
hits along a ray that meets no edge says so. Of wrong answers those in brackets have lost something: they are a miss
where something is met, fewer hits than there are, outside where inside is right.
"""

from __future__ import annotations

import argparse
import pathlib
import statistics
import time
from fractions import Fraction

import numpy as np

import ropewalk
from ropewalk.compat import trimesh as ours_trimesh
from ropewalk.compat.embreex import rtcore_scene as ours_embreex
from ropewalk.compat.embreex.mesh_construction import TriangleMesh
from ropewalk.compat.open3d import RaycastingScene

#: Rays that the judge looks at in one product of matrices.
BLOCK = 64
#: Signed volumes below this share of their products are worked out in rational numbers.
DOUBT = 1e-12


class Judge:
    """All hits of a ray, in rational numbers."""

    def __init__(self, triangles):
        self.triangles = np.float64(triangles)
        self.centers = self.triangles.mean(axis=1)
        self.radii = np.linalg.norm(self.triangles - self.centers[:, None], axis=2).max(axis=1)
        self.squares = np.einsum("ij,ij->i", self.centers, self.centers)
        self.scale = float(np.abs(self.triangles).max())

    def hits(self, origins, directions):
        """For each ray a dict of triangles and exact parameters, and whether it meets an edge or a vertex."""
        o, d = np.float64(origins), np.float64(directions)
        found = []
        for start in range(0, len(o), BLOCK):
            part = slice(start, start + BLOCK)
            u = d[part] / np.linalg.norm(d[part], axis=1, keepdims=True)
            along = u @ self.centers.T - np.einsum("ij,ij->i", o[part], u)[:, None]
            apart = self.squares - 2 * (o[part] @ self.centers.T) + np.einsum("ij,ij->i", o[part], o[part])[:, None]
            apart -= along * along
            far = self.scale + np.abs(o[part]).max()
            near = apart <= (self.radii * (1 + 1e-9)) ** 2 + 1e-12 * far * far
            near &= along >= -self.radii - 1e-9 * far
            found += [self._one(o[start + i], d[start + i], np.flatnonzero(row)) for i, row in enumerate(near)]
        return found

    def _one(self, o, d, candidates):
        corners = self.triangles[candidates] - o
        inside, doubt = np.zeros((2, len(candidates)), bool)
        volumes, sizes = [], []
        for i in range(3):
            a, b = corners[:, i], corners[:, (i + 1) % 3]
            terms = np.stack([d[k] * a[:, (k + 1) % 3] * b[:, (k + 2) % 3] for k in range(3)], 1)
            other = np.stack([d[k] * a[:, (k + 2) % 3] * b[:, (k + 1) % 3] for k in range(3)], 1)
            volumes.append(terms.sum(1) - other.sum(1))
            sizes.append(np.abs(terms).sum(1) + np.abs(other).sum(1))
        volumes, sizes = np.array(volumes), np.array(sizes)
        small = DOUBT * sizes
        missed = (volumes < -small).any(0) & (volumes > small).any(0)
        hits, edge = {}, False
        for triangle in candidates[~missed]:
            t, touches = exact(o, d, self.triangles[triangle])
            if t is not None:
                hits[int(triangle)] = t
                edge |= touches
        return hits, edge


def exact(o, d, corners):
    """The parameter of a hit, or None, and whether it is on an edge."""
    o, d = [Fraction(float(x)) for x in o], [Fraction(float(x)) for x in d]
    a, b, c = ([Fraction(float(x)) - y for x, y in zip(corner, o)] for corner in corners)

    def volume(p, q):
        return (
            d[0] * (p[1] * q[2] - p[2] * q[1])
            + d[1] * (p[2] * q[0] - p[0] * q[2])
            + d[2] * (p[0] * q[1] - p[1] * q[0])
        )

    u, v, w = volume(b, c), volume(c, a), volume(a, b)
    if min(u, v, w) < 0 < max(u, v, w):
        return None, False
    total = u + v + w
    if total == 0:
        return None, False
    axis = max(range(3), key=lambda k: abs(d[k]))
    t = (u * a[axis] + v * b[axis] + w * c[axis]) / (total * d[axis])
    return (t, 0 in (u, v, w)) if t >= 0 else (None, False)


def places(hits, exactly, gap):
    """How many places a ray meets."""
    ts = sorted(hits.values())
    if not exactly:
        return len({np.float32(float(t)) for t in ts})
    return sum(1 for i, t in enumerate(ts) if i == 0 or float(t - ts[i - 1]) > gap)


def right_closest(hits, prim):
    """Whether a triangle, or -1, is a right answer."""
    if prim < 0 or not hits:
        return prim < 0 and not hits
    if prim not in hits:
        return False
    return np.float32(float(hits[prim])) == np.float32(float(min(hits.values())))


def workloads(vertices, faces, rng, count):
    """Random chords, rays at vertices and middles of edges, and rays along axes through vertices."""
    low, high = vertices.min(axis=0).astype(float), vertices.max(axis=0).astype(float)
    center, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    ends = rng.normal(size=(3, count, 3))
    ends /= np.linalg.norm(ends, axis=2, keepdims=True)
    chords = np.float32(center + radius * ends[0]), np.float32(radius * (ends[1] - ends[0]))
    chosen = faces[rng.integers(0, len(faces), count)]
    weights = rng.choice([0.0, 0.5, 1.0], (count, 1))
    targets = vertices[chosen[:, 0]] * weights + vertices[chosen[:, 1]] * (1 - weights)
    origins = np.float32(center + 1.5 * radius * ends[2])
    aimed = origins, np.float32(targets - origins)
    axis = rng.integers(0, 3, count)
    starts = vertices[chosen[:, 2]].copy()
    starts[np.arange(count), axis] = (low - radius)[axis]
    along = np.float32(starts), np.float32(np.eye(3)[axis])
    return {"chords": chords, "edges": aimed, "axes": along}


def engines(vertices, faces):
    """By peer: functions for closest hits and numbers of hits of the peer and of the drop-in."""
    made = {}

    def run(scene, mesh):
        mesh(scene, vertices, faces)
        return lambda o, d: scene.run(o.copy(), d.copy())

    shim = run(ours_embreex.EmbreeScene(), TriangleMesh)
    try:
        from embreex import mesh_construction, rtcore_scene
    except ImportError:
        pass
    else:
        for name, robust in (("embreex", True), ("embreex, robust=False", False)):
            theirs = run(rtcore_scene.EmbreeScene(robust=robust), mesh_construction.TriangleMesh)
            made[name] = ((theirs, shim), None)
    try:
        import trimesh
    except ImportError:
        pass
    else:
        mesh = trimesh.Trimesh(np.float64(vertices), faces, process=False)
        asked = []
        kinds = [ours_trimesh, trimesh.ray.ray_pyembree] if trimesh.ray.has_embree else [ours_trimesh]
        for kind in kinds:
            ray = kind.RayMeshIntersector(mesh)
            asked.append(
                (
                    lambda o, d, ray=ray: ray.intersects_first(o, d),
                    lambda o, d, ray=ray: np.bincount(ray.intersects_location(o, d)[1], minlength=len(o)),
                    lambda p, ray=ray: ray.contains_points(p),
                )
            )
        if len(asked) == 2:
            made["trimesh with embreex"] = tuple(zip(asked[1], asked[0]))
    try:
        import open3d
    except ImportError:
        pass
    else:
        asked = []
        for scene in (open3d.t.geometry.RaycastingScene(), RaycastingScene()):
            scene.add_triangles(vertices, np.uint32(faces))
            asked.append(
                (
                    lambda o, d, s=scene: s.cast_rays(np.hstack([o, d]))["primitive_ids"].numpy().astype(np.int32),
                    lambda o, d, s=scene: s.count_intersections(np.hstack([o, d])).numpy(),
                    lambda p, s=scene: s.compute_occupancy(p).numpy() > 0.5,
                )
            )
        made["Open3D"] = tuple(zip(*asked))
    return made


def closed(faces):
    """Whether each edge has two sides."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    ahead = edges[:, 0] << 32 | edges[:, 1]
    return np.array_equal(np.sort(ahead), np.sort(edges[:, 1] << 32 | edges[:, 0]))


class Table:
    """Lines of what two answered, where they differ and who is right, and their sums over the meshes."""

    HEAD = "asked | differ | both right | peer wrong (lost) | drop-in wrong (lost) |"

    def __init__(self):
        self.sums = {}
        print(f"| mesh | rays | answer | peer | {self.HEAD}\n|{' --- |' * 9}")

    def row(self, mesh, work, what, peer, answers, truth, lacks):
        """Prints a line; which answers of the drop-in are wrong."""
        right = np.array([[judged(answer) for judged, answer in zip(truth, given)] for given in answers])
        lack = ~right & np.array([lacks(np.asarray(given)) for given in answers])
        differ = np.asarray(answers[0]) != np.asarray(answers[1])
        numbers = [len(differ), differ.sum(), (differ & right.all(axis=0)).sum()]
        numbers += [n for r, m in zip(right, lack) for n in ((~r).sum(), m.sum())]
        print(f"| {mesh} | {work} | {what} | {peer} | {self.line(numbers)}", flush=True)
        self.sums[work, what, peer] = self.sums.get((work, what, peer), 0) + np.array(numbers)
        return np.flatnonzero(~right[1])

    @staticmethod
    def line(numbers):
        asked, differ, both, *wrong = (f"{n:,}" for n in numbers)
        return f"{asked} | {differ} | {both} | {wrong[0]} ({wrong[1]}) | {wrong[2]} ({wrong[3]}) |"

    def end(self):
        """Prints the sums."""
        print(f"\n| rays | answer | peer | {self.HEAD}\n|{' --- |' * 8}")
        for names, numbers in self.sums.items():
            print(f"| {' | '.join(names)} | {self.line(numbers)}")


def beside(judge, o, d, judged, answer, rng):
    """Whether an answer is right for another ray, of which the direction is off by 2^-52 of its components at most."""
    moved = np.float64(d) * (1 + rng.integers(-2, 3, (BLOCK, 3)) * 2.0**-53)
    return any(judged(hits, answer) for hits, _ in judge.hits(np.tile(np.float64(o), (BLOCK, 1)), moved))


def speed(vertices, faces, rng):
    """Prints millions of rays and points a second of CPU time of the peers that are installed and of the drop-ins."""
    low, high = vertices.min(axis=0).astype(float), vertices.max(axis=0).astype(float)
    center, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    ends = rng.normal(size=(2, 100_000, 3))
    ends /= np.linalg.norm(ends, axis=2, keepdims=True)
    o, d = center + radius * ends[0], radius * (ends[1] - ends[0])
    rays, points = np.float32(np.hstack([o, d])), rng.uniform(low, high, (50_000, 3))
    work = {}
    try:
        import trimesh

        mesh = trimesh.Trimesh(np.float64(vertices), faces, process=False)
        sides = [kind.RayMeshIntersector(mesh) for kind in (trimesh.ray.ray_pyembree, ours_trimesh)]
        for call in ("intersects_location", "intersects_id", "intersects_first", "intersects_any"):
            work[f"trimesh `{call}`"] = [lambda i=i, c=call: getattr(i, c)(o, d) for i in sides], len(o)
        work["trimesh `contains_points`"] = [lambda i=i: i.contains_points(points) for i in sides], len(points)
    except ImportError:
        pass
    try:
        from embreex import mesh_construction, rtcore_scene

        scenes = [rtcore_scene.EmbreeScene(), ours_embreex.EmbreeScene()]
        for scene, kind in zip(scenes, (mesh_construction.TriangleMesh, TriangleMesh)):
            kind(scene, vertices, faces)
        single = np.float32(o), np.float32(d)
        for call, more in (("run", {}), ("run(..., output=1)", {"output": 1})):
            work[f"embreex `{call}`"] = [lambda s=s, m=more: s.run(*single, **m) for s in scenes], len(o)
    except ImportError:
        pass
    try:
        import open3d

        scenes = [open3d.t.geometry.RaycastingScene(), RaycastingScene()]
        for scene in scenes:
            scene.add_triangles(vertices, np.uint32(faces))
        asks = {"cast_rays": rays, "test_occlusions": rays, "count_intersections": rays, "list_intersections": rays}
        for name in ("occupancy", "distance", "signed_distance", "closest_points"):
            asks[f"compute_{name}"] = np.float32(points)
        for call, what in asks.items():
            both = [lambda s=s, c=call, w=what: getattr(s, c)(w, nthreads=1) for s in scenes]
            work[f"Open3D `{call}`"] = both, len(what)
    except ImportError:
        pass
    print("| call | peer | drop-in | times |\n| --- | --- | --- | --- |")
    for call, (both, count) in work.items():
        times = [[], []]
        for _ in range(6):
            for ask, taken in zip(both, times):
                start = time.process_time()
                ask()
                taken.append(time.process_time() - start)
        peer, ours = (count / statistics.median(taken[1:]) / 1e6 for taken in times)
        print(f"| {call} | {peer:.3g} | {ours:.3g} | {ours / peer:.2f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--meshes", default="teapot_newell.ply.gz,spot.obj.gz,bunny.ply.gz,scallop.glb.gz,dragon.ply.gz")
    parser.add_argument("--rays", type=int, default=4096, help="of each kind")
    parser.add_argument("--speed", action="store_true", help="how fast, instead of how right")
    arguments = parser.parse_args()
    print(f"ropewalk {ropewalk.__version__}, {ropewalk.simd_level()}")
    table, wrong, explained = None if arguments.speed else Table(), 0, 0
    for file in arguments.meshes.split(","):
        vertices, faces = ropewalk.read_mesh(arguments.data / "mesh" / file)
        vertices, faces = np.float32(vertices), np.int32(faces)
        name = f"{file.split('.')[0]} ({len(faces):,})"
        if arguments.speed:
            print(name)
            speed(vertices, faces, np.random.default_rng(0))
            continue
        rng, judge, made = np.random.default_rng(1), Judge(vertices[faces]), engines(vertices, faces)
        for work, (o, d) in workloads(vertices, faces, rng, arguments.rays).items():
            found = [hits for hits, _ in judge.hits(o, d)]
            gaps = 2.0**-40 * (np.linalg.norm(o, axis=1) + 2 * judge.scale) / np.linalg.norm(d, axis=1)
            met = np.array([len(hits) > 0 for hits in found])
            lost = lambda prim, met=met: (prim < 0) & met  # noqa: E731
            closest = [lambda prim, hits=hits: right_closest(hits, prim) for hits in found]
            for peer, asked in made.items():
                answers = [ask(o, d) for ask in asked[0]]
                for i in table.row(name, work, "closest", peer, answers, closest, lost):
                    wrong, explained = wrong + 1, explained + beside(judge, o[i], d[i], right_closest, answers[1][i], rng)
                if asked[1] is None:
                    continue
                finely = peer.startswith("trimesh")
                numbers = np.array([places(hits, finely, gap) for hits, gap in zip(found, gaps)])
                counts = [lambda count, number=number: count == number for number in numbers]
                few = lambda count, numbers=numbers: count < numbers  # noqa: E731
                answers = [ask(o, d) for ask in asked[1]]
                for i in table.row(name, work, "hits", peer, answers, counts, few):
                    as_many = lambda hits, count, gap=gaps[i], finely=finely: places(hits, finely, gap) == count  # noqa: E731
                    wrong, explained = wrong + 1, explained + beside(judge, o[i], d[i], as_many, answers[1][i], rng)
        if not closed(faces):
            continue
        low, high = vertices.min(axis=0).astype(float), vertices.max(axis=0).astype(float)
        weights = rng.dirichlet([1, 1, 1], arguments.rays)
        on = np.einsum("ij,ijk->ik", weights, vertices[faces[rng.integers(0, len(faces), arguments.rays)]].astype(float))
        shift = 1e-5 * np.linalg.norm(high - low) * rng.normal(size=on.shape)
        for work, points in {"box": rng.uniform(low, high, on.shape), "near": on + shift}.items():
            points = np.float32(points)
            inside = np.zeros(len(points), bool)
            left = np.arange(len(points))
            while len(left):
                found = judge.hits(points[left], np.float32(rng.normal(size=(len(left), 3))))
                inside[left] = [len(hits) % 2 for hits, _ in found]
                left = left[[edge for _, edge in found]]
            sides = [lambda side, truth=truth: side == truth for truth in inside]
            for peer, asked in made.items():
                if len(asked) > 2:
                    table.row(name, f"{work} (points)", "inside", peer, [ask(points) for ask in asked[2]], sides, lambda side: ~side)
    if arguments.speed:
        return
    table.end()
    print(
        f"\nwrong answers of drop-ins about rays: {wrong}; of these right for a ray whose direction is off by 2^-52 at "
        f"most: {explained}"
    )


if __name__ == "__main__":
    main()
