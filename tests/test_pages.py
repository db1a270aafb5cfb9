"""The code blocks of the documentation run as they stand, and the drawings of the theory are true."""

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

    heat_igl.write_point_cloud("scan.ply", heat_igl.PointCloud(shapes.icosphere(3).V))
    names: dict[str, Any] = {library: peer, "heat_igl": heat_igl, "np": np}
    exec(compile(block, "coming_from.md", "exec"), names)
    assert any(key in names for key in ("phi", "line"))


# Pages with tests of their own, and what single blocks of the others need.
TESTED_APART = ("quickstart.md", "coming_from.md", "tasks.md")
NEEDS = {
    "plot(": "matplotlib",
    "heat_igl.applications.torch": "torch",
    "cluster.": "distributed",
    "xarray": "xarray",
    "to_pyvista": "pyvista",
}
ELSEWHERE = ("SLURMCluster",)  # runs on such a machine only


def joined_cylinder() -> heat_igl.Mesh:
    """A tube whose vertices are numbered as the pages say.

    Edges join 3, 7, 12 and 40, and 3, 17 and 18. The loop from 3 by 40 and 900 back to 3 runs once around.
    """
    tube = shapes.cylinder(9, 150, length=40.0)
    number = np.arange(tube.n_vertices)
    for old, new in {90: 3, 91: 7, 92: 12, 93: 40, 99: 17, 108: 18, 96: 900}.items():
        at = np.flatnonzero(number == new)[0]
        number[[old, at]] = number[[at, old]]
    return heat_igl.Mesh(tube.V[np.argsort(number)], number[tube.F])


def given() -> dict[str, Any]:
    """What the pages take for granted: names of the reader's own things."""
    mesh = joined_cylinder()
    ball = shapes.icosphere(2)
    turn = np.linspace(0, 2 * np.pi, ball.n_vertices + 1)[:-1]
    around = np.stack([0.97 * np.cos(turn), 0.97 * np.sin(turn), 20 + np.sin(turn)], axis=1)
    surface = heat_igl.Mesh(0.3 * ball.V + 0.5, ball.F)
    inside = heat_igl.HeatMethodSolver(mesh).distance(600) < 2
    curve, other = (heat_igl.isolines(mesh, mesh.V[:, 2], level)[0][0] for level in (10.1, 30.1))
    samples = heat_igl.closest_points(mesh, around).points
    return {
        "__name__": "__main__", "heat_igl": heat_igl, "np": np, "mesh": mesh, "V": mesh.V, "F": mesh.F,
        "solver": heat_igl.HeatMethodSolver(mesh), "exact": heat_igl.geodesic_distance(mesh, 7) + 1, "sources": 7,
        "mask": inside, "is_inside": inside, "curve": curve, "other": other, "curves": [curve, other],
        "points": samples, "positions": around,
        "g": mesh.V[:, 0], "weights": np.ones(mesh.n_vertices), "vectors": np.ones((3, 2)) / 3,
        "speed": np.full(mesh.n_faces, 2.0), "metric": np.tile(np.eye(3), (mesh.n_faces, 1, 1)),
        "surface": surface, "P": surface.V, "normals": np.add(ball.V, [0, 0, 0.05]), "tetrahedra": shapes.box(6),
        "paths": ["meshes/bunny.obj"],
    }  # fmt: skip


PAGES = sorted(path.name for path in DOCS.glob("*.md") if "```python" in path.read_text(encoding="utf8"))


@pytest.mark.parametrize("page", ["../README.md", *(page for page in PAGES if page not in TESTED_APART)])
def test_the_blocks_of_a_page_run_from_top_to_bottom(page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(heat_igl, "sample_mesh", joined_cylinder)  # small, and the one that `given` refers to
    names = given()
    heat_igl.write_point_cloud("scan.ply", heat_igl.PointCloud(names["mesh"].V))
    Path("meshes").mkdir()
    heat_igl.write_mesh("meshes/bunny.obj", shapes.icosphere(3))
    ran = []
    for block in blocks(page):
        code = compile(block, page, "exec")
        lacking = [module for text, module in NEEDS.items() if text in block and not importlib.util.find_spec(module)]
        if not lacking and not any(text in block for text in ELSEWHERE):
            exec(code, names)
            ran.append(block)
    assert ran, "no block of the page could run here"
    for name in ("phi", "d", "distance"):  # what the pages call a distance
        if isinstance(names.get(name), np.ndarray):
            assert not np.isnan(names[name]).any(), name
            assert np.isfinite(names[name]).any(), name


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
