"""What can be tested of an installed package with NumPy alone: `python smoke.py`.

Runs every example of the docstrings, calls what they leave out, and fails if any public function, method or
property was not called, or if the package asks for more than it says. Prints one line.
"""

import copy
import doctest
import importlib
import importlib.metadata
import inspect
import os
import pathlib
import pickle
import pkgutil
import re
import shutil
import sys
import sysconfig
import tempfile
import threading
import types

import numpy as np

import ropewalk

#: What only shows pictures, for which there is no library here.
NOT_CALLED = {"Scene.plot"}


def code_of(member):
    """The code of what a class or module has, None if it has none in Python."""
    member = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
    return member.__code__ if isinstance(member, types.FunctionType) else None


def public_calls():
    """Code of all public functions, methods and properties, with their names."""
    calls = {}
    for name in ropewalk.__all__:
        value = getattr(ropewalk, name)
        if not inspect.isclass(value):
            calls[code_of(value)] = name
        elif not issubclass(value, (Exception, Warning)):
            for kind in value.__mro__:
                for attribute, member in vars(kind).items():
                    special = attribute in ("__init__", "__len__", "__repr__", "_repr_html_")
                    if special or not attribute.startswith("_"):
                        calls[code_of(member)] = f"{name}.{attribute}"
    calls.pop(None, None)
    return calls


def examples():
    """Runs the examples of all modules; how many there are."""
    count = 0
    for info in pkgutil.walk_packages(ropewalk.__path__, "ropewalk."):
        if info.name != "ropewalk._ropewalk":
            result = doctest.testmod(importlib.import_module(info.name))
            assert result.failed == 0, info.name
            count += result.attempted
    assert count > 50
    return count


def surface(n):
    """A torus of 2 n^2 triangles."""
    u, v = np.meshgrid(*[np.arange(n) * 2 * np.pi / n] * 2, indexing="ij")
    ring = 1 + 0.4 * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], axis=-1).reshape(-1, 3)
    at = lambda i, j: (i % n) * n + j % n  # noqa: E731
    i, j = (x.reshape(-1) for x in np.indices((n, n)))
    one = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1)], axis=1)
    two = np.stack([at(i, j), at(i + 1, j + 1), at(i, j + 1)], axis=1)
    return vertices, np.concatenate([one, two])


def calls():
    """What the examples leave out, and answers that are known."""
    vertices, faces = surface(40)
    scene = ropewalk.Scene(vertices, faces, threads=2)
    assert len(scene) == len(faces) and scene.report.primitives == len(faces)
    draw = np.random.default_rng(0)
    origins, directions = draw.normal(size=(2, 5000, 3))
    hits, lists = (query(origins, directions) for query in (scene.closest_hit, scene.all_hits))
    assert hits.shape == (5000,) and len(hits) == 5000 and hits.hit.any() and len(lists) == lists.counts.sum()
    assert (scene.count_hits(origins, directions) == lists.counts).all()
    assert (scene.occluded(origins, directions, start=hits) == hits.hit).all()
    first = scene.first_hits(origins, directions, 1)
    assert (first.t == hits.t[hits.hit]).all() and (first.ray_id == np.flatnonzero(hits.hit)).all()
    for of in (hits, first):
        assert of.uv.shape[-1] == 2 and of.normal.shape == of.position.shape and repr(of)
    assert (hits.cell >= 0).any()
    # An odd number of crossings leads out of a closed surface.
    inside = scene.contains(origins)
    assert (inside == (lists.counts % 2 == 1)).all() and inside.any()
    assert (inside == (scene.winding_number(origins) > 0.5)).all()
    assert (inside == (scene.signed_distance(origins) < 0)).all()
    nearest = scene.closest_point(origins)
    assert np.allclose(nearest.distance, scene.distance(origins)) and repr(nearest)
    cells = scene.cells(scene.locate(origins))
    assert all(len(array) == 5000 for array in cells) and repr(cells)

    walker = ropewalk.Walker(scene, origins)
    walker.positions = origins
    before, events = len(walker), walker.run(np.arange(5001), directions, 1.0)
    assert before == 5000 and len(events.particle_id) == len(events) == events.counts.sum()
    assert not walker.stopped.any() and (walker.cell >= -1).all() and repr(walker) and repr(events)

    balls = ropewalk.Spheres(vertices[:9], 0.1)
    sticks = [ropewalk.Cones(vertices[:9], vertices[9:18], 0.1, 0), ropewalk.Cylinders(vertices[:9], vertices[9:18], 0.1)]
    mixed = ropewalk.Scene.from_meshes([(vertices, faces), balls, *sticks])
    assert mixed.mesh_sizes.tolist() == [len(faces), 9, 9, 9] and len(balls) == 9 and repr(sticks[0]) and repr(balls)
    assert (balls.centers == sticks[0].base).all() and (balls.radii == sticks[1].apex_radius).all()
    assert (sticks[0].apex == sticks[1].apex).all() and (sticks[0].base_radius > 0).all()
    assert (mixed.occluded(origins, directions) >= hits.hit).all()
    quads = ropewalk.Scene(vertices, np.concatenate([faces[: len(faces) // 2], faces[len(faces) // 2 :, 2:]], axis=1))
    assert (quads.closest_hit(origins, directions).t == hits.t).all() and len(quads) == len(faces) // 2

    placed = ropewalk.Scene.from_instances([(ropewalk.Scene(vertices, faces, precision="double"), None)])
    assert (placed.occluded(origins, directions) == hits.hit).all()
    for shown in (repr(scene), repr(placed), scene._repr_html_(), repr(scene.report), str(scene.report)):
        assert shown
    assert scene.report._repr_html_() and scene.report.bytes_per_primitive > 0
    assert scene.bounds.shape == (2, 3) and scene.precision == "single" and placed.precision == "double"
    assert scene.mesh_sizes.sum() == len(faces) and scene.masks.tolist() == [2**32 - 1]
    assert ropewalk.default_threads() >= 1 and ropewalk.simd_level() in ("scalar", "avx2", "avx512")

    with tempfile.TemporaryDirectory() as folder:
        saved, text = os.path.join(folder, "a.rope"), os.path.join(folder, "a.off")
        scene.save(saved)
        rows = ["OFF", f"{len(vertices)} {len(faces)} 0"]
        rows += [" ".join(map(repr, v)) for v in vertices.tolist()]
        rows += ["3 " + " ".join(map(str, f)) for f in faces.tolist()]
        pathlib.Path(text).write_text("\n".join(rows))
        assert (ropewalk.read_mesh(text)[1] == faces).all()
        assert len(ropewalk.read_instances(text).meshes) == 1 and len(ropewalk.load(text, instances=True)) == len(faces)
        assert len(ropewalk.read_mesh(text, merge=True)[0]) <= len(vertices)
        opened = ropewalk.Scene.open(saved, verify=True, vertices=vertices, faces=faces)
        others = [opened, ropewalk.load(text), pickle.loads(pickle.dumps(scene)), copy.copy(scene)]
        results = [None] * 4

        def ask(i):
            results[i] = others[i].closest_hit(origins, directions, threads=1 + i % 2).t

        threads = [threading.Thread(target=ask, args=(i,)) for i in range(4)]
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
        assert all((t == hits.t).all() for t in results)
        del opened
        others.clear()
    try:
        ropewalk.Scene(vertices, faces + len(vertices))
    except ropewalk.ArgumentError as error:
        assert error.argument == "faces"
    else:
        raise AssertionError("faces that name no vertex")


def installed():
    """The package lies in this environment, asks for NumPy alone and needs no toolchain."""
    assert pathlib.Path(ropewalk.__file__).is_relative_to(sysconfig.get_path("platlib")), ropewalk.__file__
    needs = [need for need in importlib.metadata.requires("ropewalk") if "extra ==" not in need]
    assert [re.match(r"\w+", need)[0] for need in needs] == ["numpy"], needs
    there = {d.metadata["Name"].lower() for d in importlib.metadata.distributions()}
    assert there <= {"numpy", "ropewalk", "pip", "setuptools", "wheel"}, there
    assert not any(map(shutil.which, ("cargo", "rustc", "cc"))), "a toolchain is on PATH"


def main():
    installed()
    free = not getattr(sys, "_is_gil_enabled", lambda: True)()
    assert free == bool(sysconfig.get_config_var("Py_GIL_DISABLED")), "the import took the GIL back"
    missing, called = public_calls(), set()
    sys.setprofile(lambda frame, event, _: called.add(frame.f_code))
    calls()
    count = examples()
    sys.setprofile(None)
    left = {name for code, name in missing.items() if code not in called} - NOT_CALLED
    assert not left, f"not called: {sorted(left)}"
    tags = importlib.metadata.distribution("ropewalk").read_text("WHEEL")
    tag = re.search(r"^Tag: (.*)$", tags, re.MULTILINE)[1]
    print(
        f"smoke: Python {sys.version.split()[0]}{' free-threaded' if free else ''}, NumPy {np.__version__}, "
        f"{tag}: {len(missing) - len(NOT_CALLED)} calls, {count} examples"
    )


main()
