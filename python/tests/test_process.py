"""Threads, signals, forks, pickles: how the package behaves in a process."""

import copy
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import ropewalk
from meshes import random_mesh, rays

rng = np.random.default_rng(29)
VERTICES, FACES = random_mesh(rng, 2000, 1.0)
SCENE = ropewalk.Scene(VERTICES, FACES)
ORIGINS, DIRECTIONS = rays(rng, 20_000, 1.0)
EXPECTED = SCENE.closest_hit(ORIGINS, DIRECTIONS, threads=2)

posix = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals and fork")


def python(code):
    """Runs a program; its output."""
    run = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=120
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.split()


@pytest.mark.parametrize("protocol", range(2, pickle.HIGHEST_PROTOCOL + 1))
def test_scenes_are_pickled(protocol):
    again = pickle.loads(pickle.dumps(SCENE, protocol))
    assert repr(again) == repr(SCENE)
    hits = again.closest_hit(ORIGINS, DIRECTIONS)
    np.testing.assert_array_equal(hits.t, EXPECTED.t)
    np.testing.assert_array_equal(hits.prim_id, EXPECTED.prim_id)


def test_scenes_of_meshes_and_shapes_are_pickled():
    meshes = [(VERTICES, FACES[:9]), ([], []), (VERTICES, FACES[9:])]
    scene = ropewalk.Scene.from_meshes(meshes, masks=[1, 2, 4], preset="fast")
    for scene in (scene, *map(ropewalk.load, ("spd:rings:1", "spd:teapot:1", "spd:gears:1"))):
        again = pickle.loads(pickle.dumps(scene))
        np.testing.assert_array_equal(again.masks, scene.masks)
        np.testing.assert_array_equal(again.mesh_sizes, scene.mesh_sizes)
        assert again.report.preset == scene.report.preset
        one, two = (s.all_hits(ORIGINS, DIRECTIONS, masks=5) for s in (scene, again))
        for name in ("offsets", "t", "prim_id", "geom_id", "normal", "position"):
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_hits_are_pickled_without_their_scene():
    for hits in (EXPECTED, SCENE.all_hits(ORIGINS, DIRECTIONS)):
        again = pickle.loads(pickle.dumps(hits))
        assert repr(again) == repr(hits)
        for name in ("t", "prim_id", "geom_id", "uv", "normal", "position"):
            np.testing.assert_array_equal(getattr(again, name), getattr(hits, name))
        assert again._core is None


def test_errors_are_pickled():
    with pytest.raises(ropewalk.ArgumentError) as caught:
        ropewalk.Scene(VERTICES, [[0, 1, 10**6]])
    again = pickle.loads(pickle.dumps(caught.value))
    assert (type(again), str(again)) == (type(caught.value), str(caught.value))
    assert (again.argument, again.index) == ("faces", 0)


def test_scenes_never_change_so_copies_are_themselves():
    assert copy.copy(SCENE) is SCENE and copy.deepcopy(SCENE) is SCENE


def ask(scene):
    return scene.closest_hit(ORIGINS, DIRECTIONS, threads=2).t


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_other_processes(method):
    """Of them, a fork finds the parent's pools without their threads."""
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"this system has no {method}")
    context = multiprocessing.get_context(method)
    with context.Pool(2) as pool:
        for t in pool.map_async(ask, [SCENE] * 3).get(timeout=120):
            np.testing.assert_array_equal(t, EXPECTED.t)


@posix
def test_a_fork_builds_and_asks():
    assert python("""
        import os, numpy as np, ropewalk
        from multiprocessing import get_context
        v = np.random.default_rng(0).normal(size=(9000, 3))
        f = np.arange(9000).reshape(-1, 3)
        scene = ropewalk.Scene(v, f, threads=2)
        o, d = np.zeros((50_000, 3)), np.random.default_rng(1).normal(size=(50_000, 3))
        expected = scene.closest_hit(o, d, threads=2).t
        def child():
            again = ropewalk.Scene(v, f, threads=2)
            for s in (scene, again):
                assert (s.closest_hit(o, d, threads=2).t == expected).all()
        process = get_context("fork").Process(target=child)
        process.start()
        process.join(60)
        assert process.exitcode == 0, process.exitcode
        assert (scene.closest_hit(o, d, threads=2).t == expected).all()
        print("ok")
    """) == ["ok"]


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="counts threads in /proc")
def test_import_starts_no_thread():
    before, after, scene, one = map(int, python("""
        import os, numpy as np
        count = lambda: len(os.listdir("/proc/self/task"))
        before = count()
        import ropewalk
        after = count()
        scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], threads=1)
        built = count()
        scene.closest_hit(np.zeros((99_999, 3)), [0, 0, 1], threads=1)
        print(before, after, built, count())
    """))
    assert before == after
    assert one == scene <= after + 1, "a build has a thread, a query of one thread has none"


def test_the_interpreter_runs_meanwhile():
    """A thread counts while another one asks: the GIL is released."""
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    start, ticks = time.monotonic(), 0
    while time.monotonic() - start < 0.5:
        before = counted[0]
        SCENE.all_hits(np.tile(ORIGINS, (20, 1)), np.tile(DIRECTIONS, (20, 1)), threads=1)
        ticks += counted[0] - before
    stop.set()
    thread.join()
    assert ticks > 20


def test_many_threads_share_a_scene():
    results = [None] * 6

    def work(i):
        results[i] = SCENE.closest_hit(ORIGINS, DIRECTIONS, threads=1 + i % 3).t

    threads = [threading.Thread(target=work, args=(i,)) for i in range(6)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    for t in results:
        np.testing.assert_array_equal(t, EXPECTED.t)


def test_many_threads_ask_for_the_same_at_once():
    """What is worked out when first asked for is the same for all, GIL or not."""
    scene = ropewalk.Scene(VERTICES, FACES)
    hits, lists = scene.closest_hit(ORIGINS, DIRECTIONS), scene.all_hits(ORIGINS[:2000], DIRECTIONS[:2000])
    start, results = threading.Barrier(6), [None] * 6

    def work(i):
        start.wait()
        results[i] = [
            hits.position, hits.normal, hits.uv, hits.cell, lists.position, lists.ray_id, scene.report.leaves,
            scene.winding_number(ORIGINS[:500]), scene.occluded(ORIGINS, DIRECTIONS, t_max=0.1, start=hits),
            ropewalk.Scene(VERTICES[:90], np.arange(90).reshape(30, 3), threads=1 + i).report.leaves,
        ]  # fmt: skip

    threads = [threading.Thread(target=work, args=(i,)) for i in range(6)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    for result in results:
        for found, expected in zip(result, results[0], strict=True):
            np.testing.assert_array_equal(found, expected)


def test_the_module_needs_no_gil():
    """On an interpreter that can do without, the import must not take it back."""
    import sysconfig

    if not sysconfig.get_config_var("Py_GIL_DISABLED"):
        pytest.skip("this interpreter has a GIL; free-threaded ones are tested where there is one")
    assert not sys._is_gil_enabled()


INTERRUPTED = """
    import os, signal, threading, time, numpy as np, ropewalk
    # A shell that starts tests in the background has them ignore it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    v = np.random.default_rng(0).normal(size=({triangles} * 3, 3))
    f = np.arange(len(v)).reshape(-1, 3)
    {prepare}
    sent = []
    def interrupt():
        time.sleep(0.3)
        # Of this process alone: how busy the machine is does not count.
        sent.append(time.process_time())
        os.kill(os.getpid(), signal.SIGINT)
    threading.Thread(target=interrupt).start()
    try:
        while True:
            {work}
    except KeyboardInterrupt:
        late = time.process_time() - sent[0]
    print(late)
    {after}
"""


@posix
@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c_stops_a_build(threads):
    (late,) = python(INTERRUPTED.format(
        triangles=400_000,
        prepare="",
        work=f"ropewalk.Scene(v, f, preset='best', threads={threads})",
        after="",
    ))
    assert float(late) < 5, "a build of many seconds"


@posix
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("query", ["closest_hit", "all_hits"])
def test_ctrl_c_stops_a_query(query, threads):
    late, hits = python(INTERRUPTED.format(
        triangles=2000,
        prepare="scene = ropewalk.Scene(v, f); o = np.zeros((10**6, 3), 'f4') + v.mean(0)"
        "; d = np.random.default_rng(1).normal(size=o.shape)",
        work=f"scene.{query}(o, d, threads={threads})",
        after="print(scene.occluded(o[:9], d[:9]).sum())",
    ))
    assert float(late) < 5
    assert hits == "9"


@posix
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("query", ["closest_point", "winding_number", "contains"])
def test_ctrl_c_stops_a_query_about_points(query, threads):
    late, near = python(INTERRUPTED.format(
        triangles=2000,
        prepare="scene = ropewalk.Scene(v, f); p = np.random.default_rng(1).normal(size=(10**6, 3))",
        work=f"scene.{query}(p, threads={threads})",
        after="print((scene.distance(v[f[:9]].mean(1)) < 1e-6).sum())",
    ))
    assert float(late) < 5
    assert near == "9"


SAVED = "scene = ropewalk.Scene(v, f, preset='fast'); scene.save(name)"
OBJ = "open(name, 'w').write('v 0.5 1.25 0\\nv 1 0 0\\nv 0 1 0\\nf -1 -2 -3\\n' * 200_000)"
NFF = "open(name, 'w').write('p 3\\n0 0 0\\n1 0 0\\n0 1 0\\n' * 200_000)"


@posix
@pytest.mark.parametrize(
    "name, prepare, work",
    [
        ("a.rope", SAVED, "scene.save(name)"),
        ("a.rope", SAVED, "ropewalk.Scene.open(name, verify=True)"),
        ("a.rope", SAVED, "ropewalk.Scene.open(name, copy=True, vertices=v, faces=f)"),
        ("a.obj", OBJ, "ropewalk.read_mesh(name)"),
        ("a.nff", NFF, "ropewalk.load(name)"),
    ],
)
def test_ctrl_c_stops_work_on_files(name, prepare, work, tmp_path):
    """That it stops in the middle is tested in Rust; here, that it is an exception and leaves nothing behind."""
    path = str(tmp_path / name)
    late, *there = python(INTERRUPTED.format(
        triangles=200_000,
        prepare=f"name = {path!r}; {prepare}",
        work=work,
        after="print(*os.listdir(os.path.dirname(name)))",
    ))
    assert float(late) < 5
    assert there == [name]
    if name == "a.rope":
        assert len(ropewalk.Scene.open(path, verify=True)) == 200_000


def test_progress_is_reported():
    shares = []
    ropewalk.Scene(*random_mesh(rng, 60_000, 1.0), preset="best", progress=shares.append)
    assert shares[-1] == 1.0 and shares == sorted(shares)
    assert all(0 <= share <= 1 for share in shares)
    assert ropewalk.load("spd:tetra:2", progress=shares.append) is not None


def test_what_progress_raises_stops_the_build():
    class Enough(Exception):
        pass

    def stop(share):
        raise Enough

    with pytest.raises(Enough):
        ropewalk.Scene(*random_mesh(rng, 60_000, 1.0), preset="best", progress=stop)


def test_progress_with_a_bar(capsys):
    pytest.importorskip("tqdm")
    ropewalk.Scene(*random_mesh(rng, 100, 1.0), progress=True)
    assert "100%" in capsys.readouterr().err


def test_progress_without_tqdm(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    assert len(ropewalk.Scene(VERTICES, FACES, progress=True)) == len(FACES)


def test_a_panic_becomes_an_exception():
    """Hits that the package never makes: whatever happens, it is an exception of ours."""
    from ropewalk._ropewalk import Rays

    zeros = np.zeros(3, np.float32)
    one = np.zeros(1, np.float32)
    with pytest.raises(ropewalk.RopewalkError):
        Rays(5, np.zeros(12, np.float32), zeros, one, one)
    with pytest.raises(ropewalk.RopewalkError):
        Rays(2**63, np.zeros(12, np.float32), zeros, one, one)
    core = Rays(5, zeros, zeros, one, one)
    short = np.zeros(2, np.int32)
    with pytest.raises(ropewalk.RopewalkError):
        SCENE._core.surface(["uv"], core, zeros, short, short, 1)
    _, lost = SCENE._core.surface(["uv"], core, zeros, *[np.full(3, 2**31 - 1, np.int32)] * 2, 1,
                                  np.array([0, -1, 2**62]))
    assert lost == 0


@posix
def test_results_too_large_are_refused():
    with pytest.raises(MemoryError):
        SCENE.closest_hit(np.broadcast_to(np.float32(0), (2**45, 3)), [0, 0, 1])
    assert signal.getsignal(signal.SIGINT) is not None
