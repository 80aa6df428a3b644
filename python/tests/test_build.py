"""Build controls: cost models and samples of rays."""

import pickle

import numpy as np
import pytest

import ropewalk
from ropewalk import ArgumentError, ArgumentTypeError, InvalidRayWarning

MODELS = (
    "surface_area",
    "termination",
    "termination_projection",
    "termination_lines",
    "havran_printed",
    "havran_printed_crossed",
)


def soup(count=2000, seed=1, offset=0.0):
    random = np.random.default_rng(seed)
    centers = random.random((count, 1, 3))
    vertices = centers + 0.03 * random.standard_normal((count, 3, 3)) + offset
    return vertices.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def rays(count=4000, seed=2, offset=0.0):
    """Down through a corner of the soup."""
    random = np.random.default_rng(seed)
    origins = np.c_[0.3 * random.random((count, 2)), np.full(count, 2.0)] + offset
    directions = np.c_[0.1 * random.random((count, 2)) - 0.05, np.full(count, -1.0)]
    return origins, directions


def answers(scene, sample):
    hits = scene.all_hits(*sample)
    return [hits.offsets, hits.t, hits.prim_id]


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("preset", ["fast", "balanced", "best", "compact"])
def test_no_answer_depends_on_rays_or_models(precision, preset):
    mesh, asked = soup(), rays(300)
    plain = ropewalk.Scene(*mesh, precision=precision, preset=preset)
    assert (plain.report.cost_model, plain.report.sample_rays) == ("surface_area", 0)
    expected = answers(plain, asked)
    for model in MODELS:
        scene = ropewalk.Scene(*mesh, precision=precision, preset=preset, cost_model=model)
        assert scene.report.cost_model == model
        for a, b in zip(answers(scene, asked), expected):
            np.testing.assert_array_equal(a, b)
    samples = [
        (4000, rays()),
        (4000, (*rays(), 1.5)),
        (4000, (rays()[0], [0, 0, -1])),
        (1, [[0.1, 0.1, 2], [0, 0, -1]]),
    ]
    for count, sample in samples:
        scene = ropewalk.Scene(*mesh, precision=precision, preset=preset, rays=sample)
        assert scene.report.sample_rays == count
        for a, b in zip(answers(scene, asked), expected):
            np.testing.assert_array_equal(a, b)


def test_models_and_rays_make_trees_of_their_own():
    mesh = soup(5000)
    figures = {model: ropewalk.Scene(*mesh, cost_model=model).report.references for model in MODELS}
    assert len(set(figures.values())) == len(MODELS), figures
    steered = ropewalk.Scene(*mesh, rays=rays())
    assert steered.report.references != figures["surface_area"]
    for threads in (1, 2, 3):
        other = ropewalk.Scene(*mesh, rays=rays(), threads=threads)
        assert other.report.references == steered.report.references
    # An empty sample is none.
    for none in (np.zeros((0, 3)), np.zeros((0, 3))), None:
        scene = ropewalk.Scene(*mesh, rays=none)
        assert scene.report.references == figures["surface_area"]
        assert scene.report.sample_rays == 0


def test_everything_that_builds_takes_them():
    mesh = soup(300)
    scene = ropewalk.Scene.from_meshes([mesh, mesh], cost_model="termination")
    assert scene.report.cost_model == "termination"
    assert ropewalk.Scene.from_meshes([mesh, mesh], rays=rays()).report.sample_rays == 4000
    for name in MODELS:
        assert ropewalk.load("spd:balls:2", cost_model=name).report.cost_model == name
    assert ropewalk.load("spd:balls:2", rays=rays()).report.sample_rays == 4000


def test_loaded_meshes_take_them(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    path = tmp_path / "a.obj"
    assert ropewalk.load(path, cost_model="termination").report.cost_model == "termination"
    assert ropewalk.load(path, rays=rays(10)).report.sample_rays == 10


@pytest.mark.parametrize("precision", ["single", "double"])
def test_pickles_keep_the_model_but_no_rays(precision):
    mesh = soup(1000)
    scene = ropewalk.Scene(*mesh, precision=precision, cost_model="termination_projection")
    again = pickle.loads(pickle.dumps(scene))
    assert again.report.cost_model == "termination_projection"
    assert again.report.references == scene.report.references
    steered = pickle.loads(pickle.dumps(ropewalk.Scene(*mesh, precision=precision, rays=rays())))
    assert steered.report.sample_rays == 0
    for a, b in zip(answers(steered, rays(100)), answers(scene, rays(100))):
        np.testing.assert_array_equal(a, b)


def test_of_a_saved_scene_the_model_is_not_known(tmp_path):
    scene = ropewalk.Scene(*soup(300), rays=rays())
    scene.save(tmp_path / "a.rope")
    report = ropewalk.Scene.open(tmp_path / "a.rope").report
    assert (report.cost_model, report.sample_rays) == (None, 0)
    assert report.references == scene.report.references


def test_reports_say_what_steered_the_build():
    assert "termination" in str(ropewalk.Scene(*soup(50), cost_model="termination").report)
    assert "4,000 rays" in str(ropewalk.Scene(*soup(50), rays=rays()).report)


def refused(kind, argument, match, **options):
    with pytest.raises(kind, match=match) as caught:
        ropewalk.Scene(*soup(20), **options)
    assert caught.value.argument == argument


@pytest.mark.parametrize("precision", ["single", "double"])
def test_bad_controls(precision):
    def bad(kind, argument, match, **options):
        refused(kind, argument, match, precision=precision, **options)

    bad(ArgumentError, "cost_model", "sah.*surface_area, termination", cost_model="sah")
    bad(ArgumentTypeError, "cost_model", "expected a string, found int", cost_model=3)
    bad(ArgumentError, "rays", "surface area", cost_model="termination", rays=rays())
    bad(ArgumentTypeError, "rays", "found ndarray", rays=rays()[0])
    bad(ArgumentTypeError, "rays", "found 1 of them", rays=(rays()[0],))
    bad(ArgumentError, "rays[0]", r"\(4,\)", rays=([1, 2, 3, 4], [0, 0, 1]))
    bad(ArgumentError, "rays", "fit", rays=(np.zeros((3, 3)), np.ones((4, 3))))
    bad(ArgumentError, "rays[2]", "shape", rays=(np.zeros((3, 3)), np.ones(3), np.ones(4)))
    bad(ArgumentTypeError, "rays[1]", "real numbers|dtype", rays=(np.zeros((3, 3)), "down"))


@pytest.mark.parametrize("precision", ["single", "double"])
def test_rays_that_can_hit_nothing_are_left_out(precision):
    origins, directions = rays(100)
    origins[7] = np.nan
    directions[9] = 0
    with pytest.warns(InvalidRayWarning, match="2 rays.*left out.*first is ray 7"):
        scene = ropewalk.Scene(*soup(200), precision=precision, rays=(origins, directions))
    assert scene.report.sample_rays == 98
    # Those that end before they start are left out without a word, as in queries.
    ends = np.where(np.arange(100) < 50, -1.0, np.inf)
    scene = ropewalk.Scene(*soup(200), precision=precision, rays=(*rays(100), ends))
    assert scene.report.sample_rays == 50


def test_large_samples_and_hostile_ones():
    mesh = soup(3000)
    assert ropewalk.Scene(*mesh, rays=rays(1_000_000)).report.sample_rays == 65_536
    same = np.tile([0.5, 0.5, 2.0], (100_000, 1)), [0.001, 0, -1]
    aside = np.tile([9.0, 9.0, 9.0], (100_000, 1)), [1, 0, 0]
    plain = ropewalk.Scene(*mesh).report
    assert ropewalk.Scene(*mesh, rays=same).report.references < 2 * plain.references
    assert ropewalk.Scene(*mesh, rays=aside).report.references == plain.references


def test_memory_limits_count_rays():
    limit = 2_000_000
    assert ropewalk.Scene(*soup(5000), memory_limit=limit, precision="single")
    with pytest.raises(ropewalk.OutOfMemoryError, match="memory_limit"):
        ropewalk.Scene(*soup(5000), memory_limit=limit, precision="single", rays=rays(60_000))


def test_rays_work_far_from_the_origin():
    mesh, sample = soup(1000, offset=1e7), rays(1000, offset=1e7)
    plain, steered = ropewalk.Scene(*mesh), ropewalk.Scene(*mesh, rays=sample)
    assert steered.precision == "double" and steered.report.sample_rays == 1000
    assert plain.report.references != steered.report.references
