"""The code blocks of the pages that newcomers read first: they run as they stand."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import load_script

import heat_igl
from heat_igl import shapes

DOCS = Path(__file__).resolve().parents[1] / "docs"
BLOCK = re.compile(r"^```python\n(.*?)```$", re.DOTALL | re.MULTILINE)


def blocks(page: str) -> list[str]:
    return BLOCK.findall((DOCS / page).read_text(encoding="utf8"))


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    heat_igl.write_mesh("bunny.ply", shapes.torus(40, 24))


def test_the_quick_start_runs_from_top_to_bottom(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("heat_igl.validation.samples.bunny_path", lambda: None)  # the smaller sample
    names: dict[str, Any] = {}
    for block in blocks("quickstart.md"):
        exec(compile(block, "quickstart.md", "exec"), names)
    assert Path("distance.png").read_bytes().startswith(b"\x89PNG")
    assert "<html" in Path("distance.html").read_text(encoding="utf8")
    assert heat_igl.read_attributes("distance.ply")["distance"][1234] == 0
    assert names["many"].shape == (3, names["mesh"].n_vertices)


@pytest.mark.parametrize("block", blocks("coming_from.md"), ids=lambda block: re.search(r"= (\w+)\.", block)[1])
def test_coming_from_another_library(block: str) -> None:
    library = re.search(r"= (\w+)\.", block)[1]
    if importlib.util.find_spec(library) is None:
        pytest.skip(f"needs {library}")
    peer = pytest.importorskip(library, exc_type=ImportError)

    class Scan:
        points = shapes.icosphere(3).V

    names: dict[str, Any] = {library: peer, "heat_igl": heat_igl, "np": np, "scan": Scan}
    exec(compile(block, "coming_from.md", "exec"), names)
    assert any(key in names for key in ("phi", "line"))


def test_the_drawn_strip_is_flat_and_true_to_length() -> None:
    figures = load_script("theory_figures")
    mesh = shapes.torus(14, 22, tube=0.5)
    path = heat_igl.geodesic_path(mesh, heat_igl.SurfacePoints([476, 546], [[0.2, 0.3, 0.5], [0.3, 0.4, 0.3]]))
    corners, way = figures.laid_out(mesh, path)
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    in_space = mesh.V[mesh.F[path.faces]]
    assert len(sides) > 10
    np.testing.assert_allclose(sides, np.linalg.norm(np.roll(in_space, -1, axis=1) - in_space, axis=2), rtol=1e-12)
    np.testing.assert_allclose(way[:, 1], 0, atol=1e-9)  # one straight line
    np.testing.assert_allclose(way[-1, 0], path.lengths(mesh).sum(), rtol=1e-12)
