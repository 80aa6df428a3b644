"""The stubs and the docstrings say what there is."""

import ast
import doctest
import importlib
import inspect
import pathlib
import re
import sys
import xml.etree.ElementTree

import numpy as np
import pytest

import ropewalk
from meshes import random_mesh, rays
from ropewalk import _ropewalk

STUB = pathlib.Path(ropewalk.__file__).with_name("_ropewalk.pyi")


def names(namespace):
    return {name for name in vars(namespace) if not name.startswith("_")}


def parameters(function):
    """Names of a stub's parameters and which have defaults."""
    args = function.args
    assert not args.kwonlyargs and not args.posonlyargs
    plain = [a.arg for a in args.args]
    required = len(plain) - len(args.defaults)
    return [(name, i >= required) for i, name in enumerate(plain) if name not in ("self", "cls")]


def real_parameters(function):
    signature = inspect.signature(function)
    return [
        (p.name, p.default is not p.empty)
        for p in signature.parameters.values()
        if p.name not in ("self", "cls")
    ]


def test_the_stub_is_the_module():
    tree = ast.parse(STUB.read_text())
    functions = {n.name: n for n in tree.body if isinstance(n, ast.FunctionDef)}
    classes = {n.name: n for n in tree.body if isinstance(n, ast.ClassDef)}
    assert set(functions) | set(classes) == names(_ropewalk)
    for name, stub in functions.items():
        assert parameters(stub) == real_parameters(getattr(_ropewalk, name))
    for name, stub in classes.items():
        real = getattr(_ropewalk, name)
        methods = {n.name: n for n in stub.body if isinstance(n, ast.FunctionDef)}
        assert {n for n in methods if not n.startswith("_")} == names(real), name
        for method, node in methods.items():
            kinds = [d.id for d in node.decorator_list if isinstance(d, ast.Name)]
            found = inspect.getattr_static(real, method)
            if "property" in kinds:
                assert inspect.isgetsetdescriptor(found), method
            elif method == "__new__":
                assert parameters(node) == real_parameters(real)
            else:
                assert parameters(node) == real_parameters(getattr(real, method)), method
                assert ("staticmethod" in kinds) == isinstance(found, staticmethod), method


def test_everything_public_is_exported_and_documented():
    assert sorted(ropewalk.__all__) == ropewalk.__all__
    for name in ropewalk.__all__:
        value = getattr(ropewalk, name)
        assert inspect.getdoc(value), name
        if not inspect.isclass(value) or issubclass(value, Exception):
            continue
        for attribute, member in vars(value).items():
            if attribute.startswith("_") or not (callable(member) or isinstance(member, (property, classmethod))):
                continue
            assert inspect.getdoc(getattr(value, attribute)), f"{name}.{attribute}"
    assert pathlib.Path(ropewalk.__file__).with_name("py.typed").exists()


MODULES = ["ropewalk"] + [
    f"ropewalk._{name}"
    for name in ("file", "hits", "mesh", "points", "rays", "report", "scene", "shapes", "walker")
]
MODULES += ["ropewalk.compat"] + [
    f"ropewalk.compat.{name}"
    for name in ("embreex", "embreex.mesh_construction", "embreex.rtcore", "embreex.rtcore_scene", "open3d", "trimesh")
]


@pytest.mark.parametrize("module", MODULES)
def test_examples(module):
    result = doctest.testmod(importlib.import_module(module))
    assert result.attempted > 0 and result.failed == 0


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/python.md", "docs/coming-from.md"])
def test_code_of_the_pages(page, tmp_path, monkeypatch):
    # Some of it writes files.
    text = pathlib.Path(__file__).parents[2].joinpath(page).read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert blocks
    vertices, faces = random_mesh(np.random.default_rng(0), 50, 1.0)
    origins, directions = rays(np.random.default_rng(1), 500, 1.0)
    names = dict(vertices=vertices, faces=faces, origins=origins, directions=directions)
    names["light"] = np.float32([0, 0, 9])
    monkeypatch.chdir(tmp_path)
    for block in blocks:
        exec(compile(block, page, "exec"), names)


RAY_QUERIES = ["closest_hit", "occluded", "all_hits", "first_hits", "count_hits"]
POINT_QUERIES = [
    "closest_point",
    "distance",
    "signed_distance",
    "contains",
    "winding_number",
    "locate",
    "cells",
]


@pytest.mark.parametrize("query", RAY_QUERIES + POINT_QUERIES)
def test_queries_have_an_example(query):
    assert ">>>" in getattr(ropewalk.Scene, query).__doc__


def test_pictures(tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    vertices, faces = random_mesh(np.random.default_rng(0), 3000, 1.0)
    scene = ropewalk.Scene(vertices, faces)
    report = scene.report
    figure = scene.plot()
    left, right = figure.axes
    assert sum(bar.get_height() for bar in left.patches) == report.leaves
    tests = sum(bar.get_height() for bar in right.patches)
    assert abs(tests - report.predicted_tests) < 1e-3 * tests
    figure.savefig(tmp_path / "a.png")
    others = [ropewalk.load("spd:balls:2"), ropewalk.Scene([], []), ropewalk.Scene(vertices[:3], [[0, 1, 2]])]
    for other in others:
        other.plot().savefig(tmp_path / "b.png")


def test_pictures_without_matplotlib(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(ImportError, match=r"ropewalk\[plot\]"):
        ropewalk.Scene([], []).plot()


def test_reports_show_themselves():
    scene = ropewalk.load("spd:gears:1")
    report = scene.report
    assert report.bytes_per_primitive == report.tree_bytes / report.primitives
    assert report.duplication >= 1 and report.predicted_steps > 1 and report.predicted_tests > 1
    assert sum(report.leaf_sizes) == report.leaves
    assert "duplication" in str(report) and "<table>" in report._repr_html_()
    assert report._repr_html_().count("<rect") >= 9
    xml.etree.ElementTree.fromstring(f"<div>{scene._repr_html_()}</div>")
    assert "table" in ropewalk.Scene([], [])._repr_html_()
    assert "<table>" in scene._repr_html_() and "primitives" in repr(scene)
    assert ropewalk.simd_level() in ("scalar", "avx2", "avx512")
    assert ropewalk.default_threads() >= 1 and ropewalk.__version__
