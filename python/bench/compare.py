"""Rays per second of the package and its peers, in one process on the same rays.

Peers answer through their own Python calls. Rounds are interleaved and medians printed. With one
thread CPU time of the process counts, since machines are shared; with more the clock does.
"""

from __future__ import annotations

import argparse
import pathlib
import statistics
import subprocess
import sys
import time

import numpy as np

import ropewalk

SIDE = 512
CHORDS = 1 << 16
#: Points of a round.
POINTS = 1 << 16
#: Rays of a round of trimesh, which asks again behind each hit.
FEW_CHORDS = 1 << 12


def view(name, arguments, low, high):
    """Eye, point looked at and view angle."""
    if not (arguments.generated / f"{name}.cam").exists():
        center, diagonal = (low + high) / 2, np.linalg.norm(high - low)
        along = np.array([0.3, 0.4, 1.0])
        return center + along / np.linalg.norm(along) * 0.9 * diagonal, center, 45.0
    numbers = np.loadtxt(arguments.generated / f"{name}.cam")
    return numbers[:3], numbers[3:6], numbers[6]


def primary(eye, at, angle):
    """Rays of a picture in Morton order."""
    unit = lambda v: v / np.linalg.norm(v)  # noqa: E731
    forward = unit(at - eye)
    right = unit(np.cross(forward, [0, 1, 0]))
    up = np.cross(right, forward)
    code = np.arange(SIDE * SIDE)
    x = sum((code >> 2 * bit & 1) << bit for bit in range(10))
    y = sum((code >> 2 * bit + 1 & 1) << bit for bit in range(10))
    half = np.tan(np.radians(angle) / 2)
    u, v = half * ((2 * x + 1) / SIDE - 1), half * (1 - (2 * y + 1) / SIDE)
    directions = forward + u[:, None] * right + v[:, None] * up
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # In rows, as all engines want them: a broadcast array is copied column by column.
    origins = np.ascontiguousarray(np.broadcast_to(eye, directions.shape), np.float32)
    return origins, np.ascontiguousarray(directions, np.float32)


def by_rows(rays):
    """The rays of :func:`primary` row by row, as pictures in arrays have them."""
    code = np.arange(SIDE * SIDE)
    x = sum((code >> 2 * bit & 1) << bit for bit in range(10))
    y = sum((code >> 2 * bit + 1 & 1) << bit for bit in range(10))
    return rays[0], np.ascontiguousarray(rays[1][np.argsort(y * SIDE + x)])


def diffuse(scene, rays, rng):
    """One cosine-weighted bounce off each primary hit, shuffled, and the faces that they leave."""
    hits = scene.closest_hit(*rays)
    hit = hits.hit
    normals = hits.normal[hit].astype(np.float64)
    against = np.einsum("ij,ij->i", normals, rays[1][hit]) > 0
    normals[against] *= -1
    points = hits.position[hit] + 1e-5 * np.linalg.norm(np.diff(scene.bounds, axis=0)) * normals
    pick = rng.integers(0, len(points), SIDE * SIDE)
    sphere = rng.normal(size=(SIDE * SIDE, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    directions = normals[pick] + 0.999 * sphere
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.float32(points[pick]), np.float32(directions), hits.prim_id[hit][pick]


def chords(scene, rng):
    """Random chords of the bounding sphere."""
    low, high = scene.bounds.astype(np.float64)
    center, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    ends = rng.normal(size=(2, CHORDS, 3))
    ends /= np.linalg.norm(ends, axis=2, keepdims=True)
    directions = ends[1] - ends[0]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.float32(center + radius * ends[0]), np.float32(directions)


def in_order(rays, t, prim):
    """Hits of each ray in order of t."""
    order = np.lexsort((prim, t, rays))
    return rays[order], t[order], prim[order]


def engines(vertices, faces, scene, threads):
    """Functions of origins and directions: name, those for the closest hit, those for all."""
    made = {
        "ropewalk": (
            lambda o, d: scene.closest_hit(o, d, threads=threads).prim_id,
            lambda o, d: scene.all_hits(o, d, threads=threads).offsets,
        )
    }
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    for name, robust in (("embreex", False), ("embreex robust", True)):
        embree = rtcore_scene.EmbreeScene(robust=robust)
        TriangleMesh(embree, vertices[faces])
        made[name] = (lambda o, d, embree=embree: embree.run(o, d), None)
    try:
        import open3d
    except ImportError:
        pass
    else:
        core, device = open3d.core, open3d.t.geometry.RaycastingScene(nthreads=threads)
        device.add_triangles(core.Tensor(vertices), core.Tensor(np.uint32(faces)))

        def list_and_sort(o, d):
            found = device.list_intersections(np.hstack([o, d]), nthreads=threads)
            names = ("ray_ids", "t_hit", "primitive_ids")
            return in_order(*(found[name].numpy() for name in names))

        made["Open3D"] = (
            lambda o, d: device.cast_rays(np.hstack([o, d]), nthreads=threads)["primitive_ids"].numpy(),
            list_and_sort,
        )
    made |= mitsuba_engines(vertices, faces, threads)
    try:
        import trimesh
    except ImportError:
        pass
    else:
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        made["trimesh"] = (
            None,
            lambda o, d: mesh.ray.intersects_id(o, d, multiple_hits=True, max_hits=10_000),
        )
    return made


#: Ends well where Mitsuba's LLVM variant works: with some versions of LLVM it ends the process.
TRY_MITSUBA = """
import mitsuba as mi, numpy as np
mi.set_variant("llvm_ad_rgb")
np.array(mi.render(mi.load_dict(mi.cornell_box()), spp=1))
"""


def mitsuba_engines(vertices, faces, threads):
    """Mitsuba's two ways, with rays in its own arrays before the first round; none where it does not run."""
    if subprocess.run([sys.executable, "-c", TRY_MITSUBA], capture_output=True).returncode != 0:
        print("no Mitsuba with a working LLVM (DRJIT_LIBLLVM_PATH names one); its columns are missing", flush=True)
        return {}
    import drjit
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    # The thread that asks works too.
    drjit.set_thread_count(threads)
    mesh = mitsuba.Mesh("mesh", len(vertices), len(faces))
    parts = mitsuba.traverse(mesh)
    parts["vertex_positions"] = vertices.ravel()
    parts["faces"] = np.uint32(faces).ravel()
    parts.update()
    scene = mitsuba.load_dict({"type": "scene", "mesh": mesh})
    ready = {}

    def closest(o, d, coherent):
        if id(o) not in ready:
            # The arrays are kept, so that no other gets their ids.
            columns = [array.T.copy() for array in (o, d)]
            ray = mitsuba.Ray3f(mitsuba.Point3f(columns[0]), mitsuba.Vector3f(columns[1]))
            drjit.eval(ray)
            drjit.sync_thread()
            ready[id(o)] = ray, o
        found = scene.ray_intersect_preliminary(ready[id(o)][0], coherent=coherent)
        return np.array(found.prim_index)

    return {
        "Mitsuba": (lambda o, d: closest(o, d, False), None),
        "Mitsuba coherent": (lambda o, d: closest(o, d, True), None),
    }


def seconds(work, threads):
    """CPU seconds of this process for one thread, seconds by the clock for more."""
    clock = time.process_time if threads == 1 else time.perf_counter
    start = clock()
    work()
    return clock() - start


def rates(engines, which, rays, rounds, threads):
    """Median millions of rays a second by engine."""
    asked = {}
    for name, queries in engines.items():
        if queries[which] is not None:
            few = FEW_CHORDS if name == "trimesh" else len(rays[0])
            asked[name] = (queries[which], rays[0][:few].copy(), rays[1][:few].copy())
    times = {name: [] for name in asked}
    order = list(asked)
    for _ in range(rounds + 1):
        for name in order:
            query, o, d = asked[name]
            times[name].append(seconds(lambda: query(o, d), threads))
        order = order[1:] + order[:1]
    return {n: len(asked[n][1]) / statistics.median(times[n][1:]) / 1e6 for n in asked}


def point_engines(vertices, faces, scene, threads):
    """Functions of points: name, those that tell inside, distances and signed distances."""
    made = {
        "ropewalk": (
            lambda p: scene.contains(p, threads=threads),
            lambda p: scene.distance(p, threads=threads),
            lambda p: scene.signed_distance(p, threads=threads),
        ),
        "ropewalk winding": (
            lambda p: scene.contains(p, method="winding", threads=threads),
            None,
            None,
        ),
    }
    try:
        import open3d
    except ImportError:
        pass
    else:
        core, device = open3d.core, open3d.t.geometry.RaycastingScene(nthreads=threads)
        device.add_triangles(core.Tensor(vertices), core.Tensor(np.uint32(faces)))
        asks = ("compute_occupancy", "compute_distance", "compute_signed_distance")
        made["Open3D"] = tuple(
            lambda p, ask=getattr(device, ask): ask(p, nthreads=threads).numpy() for ask in asks
        )
    try:
        import trimesh
    except ImportError:
        pass
    else:
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        made["trimesh"] = (mesh.contains, None, None)
    return made


def compare_points(name, vertices, faces, scene, arguments, rng):
    """Millions of points a second, uniform in the box and near the surface."""
    made = point_engines(vertices, faces, scene, arguments.threads)
    low, high = scene.bounds.astype(np.float64)
    corners = vertices[faces[rng.integers(0, len(faces), POINTS)]].astype(np.float64)
    weights = rng.dirichlet([1, 1, 1], POINTS)
    on = np.einsum("ij,ijk->ik", weights, corners)
    shift = rng.normal(size=on.shape)
    shift *= 0.01 * np.linalg.norm(high - low) * rng.random((POINTS, 1)) / np.linalg.norm(
        shift, axis=1, keepdims=True
    )
    places = {"box": rng.uniform(low, high, (POINTS, 3)), "near": on + shift}
    for place, points in places.items():
        points = np.float32(points)
        for which, query in enumerate(("contains", "distance", "signed distance")):
            asked = {n: (q[which], points.copy()) for n, q in made.items() if q[which] is not None}
            times = {n: [] for n in asked}
            answers = {}
            for _ in range(arguments.rounds + 1):
                for engine, (ask, p) in asked.items():
                    start = time.process_time() if arguments.threads == 1 else time.perf_counter()
                    answers[engine] = np.asarray(ask(p))
                    now = time.process_time() if arguments.threads == 1 else time.perf_counter()
                    times[engine].append(now - start)
            found = {n: POINTS / statistics.median(t[1:]) / 1e6 for n, t in times.items()}
            row = ", ".join(f"{engine} {rate:.3g}" for engine, rate in found.items())
            ours = answers["ropewalk"]
            if which == 0:
                differ = {n: float(np.mean((a > 0.5) != ours)) for n, a in answers.items()}
            else:
                scale = np.linalg.norm(high - low)
                differ = {n: float(np.abs(a - ours).max() / scale) for n, a in answers.items()}
            off = ", ".join(f"{n} {x:.2g}" for n, x in differ.items() if n != "ropewalk")
            print(f"{name} {place} {query}: {row}; differ: {off}", flush=True)


def agree(engines, rays):
    """Checks answers against embreex's robust ones: share of rays on which primitives differ."""
    ours, theirs = (engines[n][0](*rays) for n in ("ropewalk", "embreex robust"))
    return float(np.mean(ours != theirs))


def overhead(scene, queries, rounds):
    """CPU time of the Python call over that of the engine by itself, one thread, medians."""
    from ropewalk._ropewalk import Rays

    rows = []
    for query, rays in queries.items():
        for count in (10_000, 100_000, len(rays[0])):
            o, d = (np.ascontiguousarray(array[:count]) for array in rays)
            ready = Rays(len(o), o.reshape(-1), d.reshape(-1), np.float32([0]), np.float32([np.inf]))
            python, engine = [], []
            for _ in range(3 * rounds):
                start = time.thread_time()
                getattr(scene, query)(o, d, threads=1)
                python.append(time.thread_time() - start)
                engine.append(scene._core.engine_seconds(query, ready))
            over = statistics.median(python) / statistics.median(engine) - 1
            rows.append(f"{query} {len(o):,} rays {over:+.1%}")
    return rows


def filters(scene, rays, left, rounds):
    """What masks that all match and faces to skip that are left cost: rates over that without."""
    kinds = {"plain": {}, "masks": {"masks": np.full(len(left), 1, np.uint32)}, "skip": {"skip": left}}
    asked = {
        name: (lambda o, d, k=k: scene.closest_hit(o, d, threads=1, **k), None)
        for name, k in kinds.items()
    }
    found = rates(asked, 0, rays, rounds, 1)
    return {name: rate / found["plain"] for name, rate in found.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--generated", type=pathlib.Path, required=True)
    parser.add_argument("--scenes", default="bunny,atrium,soup1m")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--points", action="store_true", help="points instead of rays")
    arguments = parser.parse_args()
    print(f"ropewalk {ropewalk.__version__}, {ropewalk.simd_level()}, {arguments.threads} threads, "
          f"medians of {arguments.rounds} rounds; millions of rays a second")
    for name in arguments.scenes.split(","):
        file = arguments.data / f"mesh/{name}.ply.gz"
        file = file if file.exists() else arguments.generated / f"{name}.ply"
        vertices, faces = ropewalk.read_mesh(file)
        vertices, faces = np.float32(vertices), np.int32(faces)
        scene = ropewalk.Scene(vertices, faces)
        rng = np.random.default_rng(1)
        if arguments.points:
            compare_points(name, vertices, faces, scene, arguments, rng)
            continue
        made = engines(vertices, faces, scene, arguments.threads)
        eye = primary(*view(name, arguments, *scene.bounds.astype(np.float64)))
        *bounced, left = diffuse(scene, eye, rng)
        work = {
            "primary": (0, eye),
            "primary by rows": (0, by_rows(eye)),
            "diffuse": (0, bounced),
            "all hits": (1, chords(scene, rng)),
        }
        for workload, (which, rays) in work.items():
            found = rates(made, which, rays, arguments.rounds, arguments.threads)
            best = max(rate for engine, rate in found.items() if engine != "ropewalk")
            row = ", ".join(f"{engine} {rate:.3g}" for engine, rate in found.items())
            differ = f", primitives differ {agree(made, rays):.2g}" if which == 0 else ""
            print(f"{name} {workload}: {row}; {found['ropewalk'] / best:.2f} times the best{differ}", flush=True)
        queries = {"closest_hit": bounced, "all_hits": work["all hits"][1]}
        shares = ", ".join(overhead(scene, queries, arguments.rounds))
        print(f"{name} Python layer over the engine: {shares}", flush=True)
        aimed = scene.closest_hit(*eye).prim_id[::-1]
        for workload, rays, skip in (("primary", eye, aimed), ("diffuse", bounced, left)):
            found = filters(scene, rays, skip, arguments.rounds)
            costs = ", ".join(f"{n} {r:.2f}" for n, r in found.items())
            print(f"{name} filters, {workload}, share of the plain rate: {costs}", flush=True)


if __name__ == "__main__":
    main()
