"""The recipes of docs/recipes: each page is a script that checks itself."""

import pathlib
import re

import pytest

PAGES = pathlib.Path(__file__).parents[2] / "docs" / "recipes"
RECIPES = [
    "ambient-occlusion",
    "lidar",
    "line-of-sight",
    "photon-transport",
    "point-in-solid",
    "view-factors",
    "x-ray",
]
DRAWN = [recipe for recipe in RECIPES if "matplotlib" in (PAGES / f"{recipe}.md").read_text()]


def run(recipe, pictures):
    """Runs the code of a page as its user would: in one namespace, with nothing prepared."""
    page = PAGES / f"{recipe}.md"
    names = {"__name__": "__main__"}
    for block in re.finditer(r"^```python\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE):
        if pictures or "matplotlib" not in block[1]:
            # Failures name the line of the page.
            above = "\n" * page.read_text()[: block.start(1)].count("\n")
            exec(compile(above + block[1], page, "exec"), names)


def test_every_recipe_is_tested_and_listed():
    assert sorted(page.stem for page in PAGES.glob("*.md") if page.stem != "README") == RECIPES
    listed = re.findall(r"\]\(([a-z-]+)\.md\)", (PAGES / "README.md").read_text())
    assert sorted(listed) == RECIPES


@pytest.mark.parametrize("recipe", RECIPES)
def test_recipe(recipe, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = (PAGES / f"{recipe}.md").read_text()
    assert text.count("\nassert ") + text.count("\n    assert ") >= 2
    run(recipe, pictures=False)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("recipe", DRAWN)
def test_picture(recipe, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    run(recipe, pictures=True)
    assert f"(../images/{recipe}.png)" in (PAGES / f"{recipe}.md").read_text()
    assert (PAGES.parent / "images" / f"{recipe}.png").exists()
    assert (tmp_path / f"{recipe}.png").stat().st_size > 2000
