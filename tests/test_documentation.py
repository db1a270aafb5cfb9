"""The documentation: every block of every page, every entry of the gallery and every docstring runs by itself."""

import ast
import doctest
import importlib
import importlib.util
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heat_igl
from heat_igl import shapes

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```python\n(.*?)```$", re.DOTALL | re.MULTILINE)
PARSER = doctest.DocTestParser()

# What a block or an example needs, by a text in it; dask_jobqueue is for machines with a queue.
NEEDS = {
    **{f"import {name}": name for name in ("trimesh", "pyvista", "open3d", "meshio", "torch", "polyscope")},
    "to_trimesh": "trimesh", "to_pyvista": "pyvista", "to_open3d": "open3d", "drawing": "matplotlib",
    "plots": "matplotlib", ".gii": "nibabel", ".vtu": "meshio", "cluster": "distributed", "xarray": "xarray",
    "SLURM": "dask_jobqueue", "write_distances_within": "zarr", "read_distances": "zarr",
}  # fmt: skip


def require(code: str) -> None:
    for text, module in NEEDS.items():
        if text in code:
            pytest.importorskip(module, exc_type=ImportError)


def blocks() -> Iterator[pytest.param]:
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        text = page.read_text(encoding="utf8")
        for found in BLOCK.finditer(text):
            line = text[: found.start()].count("\n") + 1
            yield pytest.param(found[1], id=f"{page.stem}:{line}")


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    """The files that the pages name, in the directory that the blocks run in."""
    monkeypatch.chdir(tmp_path)
    surface = shapes.torus(40, 24)
    Path("meshes").mkdir()
    for name in ("bunny.ply", "bunny.off", "meshes/bunny.obj"):
        heat_igl.write_mesh(name, surface)
    heat_igl.write_point_cloud("scan.ply", heat_igl.PointCloud(shapes.icosphere(4).V))
    if importlib.util.find_spec("meshio"):
        heat_igl.write_mesh("solid.mesh", shapes.box(4))
    if importlib.util.find_spec("nibabel"):
        heat_igl.write_mesh("lh.pial.surf.gii", surface)
    if importlib.util.find_spec("matplotlib"):
        monkeypatch.setattr("heat_igl.drawing.figure.DPI", 40)
    # The sample without the pymeshlab wheel, which has the fewer vertices of the two.
    monkeypatch.setattr("heat_igl.validation.shapes.bunny_path", lambda: None)


@pytest.mark.parametrize("block", list(blocks()))
def test_a_block_runs_as_it_is_copied(block, monkeypatch):
    require(block)
    if "polyscope" in block:  # without a display
        import polyscope

        initialize = polyscope.init
        monkeypatch.setattr(polyscope, "init", lambda: initialize("openGL_mock"))
    names = {"__name__": "__main__"}
    exec(compile(block, "block", "exec"), names)
    for name in ("phi", "d", "distance"):  # what the pages call a distance
        if isinstance(names.get(name), np.ndarray):
            assert not np.isnan(names[name]).any()
            assert np.isfinite(names[name]).any()


class Scene:
    """In place of a picture, which takes a second to draw."""

    n_drawn = 0

    def __init__(self, scene: Any, *_: Any) -> None:
        assert np.isfinite(scene.V).all()
        Scene.n_drawn += 1


@pytest.mark.slow
def test_every_entry_of_the_gallery_runs_as_it_is_shown(monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("heat_igl.drawing.plots.lay_out", Scene)
    monkeypatch.syspath_prepend(ROOT / "docs")
    gallery = importlib.import_module("gallery")
    for entry in gallery.ENTRIES:
        before = Scene.n_drawn
        names = {"__name__": "__main__"}
        exec(compile(gallery._body(entry), entry.__name__, "exec"), names)
        is_page = "page(" in gallery._body(entry)
        assert is_page or Scene.n_drawn == before + 1, entry.__name__


def examples() -> Iterator[pytest.param]:
    """The docstrings of the package that hold examples, by the names of their functions, classes and modules."""
    folder = Path(heat_igl.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                text = ast.get_docstring(node) or ""
                if ">>>" in text:
                    name = getattr(node, "name", path.parent.name if path.stem == "__init__" else path.stem)
                    # It starts processes, and gives up on a busy machine.
                    marks = [pytest.mark.slow] if name == "cluster" else []
                    yield pytest.param(text, marks=marks, id=f"{path.relative_to(folder).with_suffix('')}-{name}")


@pytest.mark.parametrize("text", list(examples()))
def test_an_example_runs_by_itself(text):
    require("".join(f">>> {example.source}" for example in PARSER.get_examples(text)))
    assert "+SKIP" not in text
    said = []
    # Names have to be imported by the example, so that it also runs where a reader pastes it.
    doctest.DocTestRunner(verbose=False).run(PARSER.get_doctest(text, {}, "example", None, None), out=said.append)
    assert "".join(said) == ""


@pytest.mark.parametrize("name", heat_igl.__all__)
def test_every_public_name_has_an_example(name):
    section = (inspect.getdoc(getattr(heat_igl, name)) or "").partition("\nExamples\n--------\n")[2]
    assert any(part.want for part in PARSER.get_examples(section)), f"{name} has no example that shows a result"
