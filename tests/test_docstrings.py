"""The examples in docstrings: each public name has one, and all of them run as they stand."""

from __future__ import annotations

import ast
import doctest
import inspect
from collections.abc import Iterator
from pathlib import Path

import pytest

import heat_igl

# Examples that need an extra.
NEEDS = {
    "BatchError": "distributed",
    "cluster": "distributed",
    "plots": "matplotlib",
    "read_distances": "zarr",
    "read_distances_within": "zarr",
    "to_open3d": "open3d",
    "to_pyvista": "pyvista",
    "to_trimesh": "trimesh",
    "write_distances_within": "zarr",
}
PARSER = doctest.DocTestParser()


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
                    yield pytest.param(name, text, marks=marks, id=f"{path.relative_to(folder).with_suffix('')}-{name}")


@pytest.mark.parametrize("name", heat_igl.__all__)
def test_every_public_name_has_an_example(name: str) -> None:
    section = (inspect.getdoc(getattr(heat_igl, name)) or "").partition("\nExamples\n--------\n")[2]
    assert any(part.want for part in PARSER.get_examples(section)), f"{name} has no example that shows a result"


@pytest.mark.parametrize(("name", "text"), list(examples()))
def test_examples_run(name: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    assert "+SKIP" not in text
    monkeypatch.chdir(tmp_path)
    said: list[str] = []
    # Names have to be imported by the example, so that it also runs where a reader pastes it.
    test = PARSER.get_doctest(text, {}, name, None, None)
    doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert "".join(said) == ""
