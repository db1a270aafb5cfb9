"""The twelve tasks of the documentation: each of at most five lines, run from the page itself."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heat_igl
from heat_igl import Mesh, shapes

PAGE = Path(__file__).resolve().parents[1] / "docs" / "tasks.md"
BLOCK = re.compile(r"^## (.+?)\n\n```python\n(.*?)```$", re.DOTALL | re.MULTILINE)
TASKS = dict(BLOCK.findall(PAGE.read_text(encoding="utf8")))
LIBRARIES = ("trimesh", "pyvista", "meshio", "open3d", "potpourri3d", "polyscope", "nibabel")

Names = dict[str, Any]


def surface() -> Mesh:
    return shapes.torus(40, 24)


def exact() -> np.ndarray:
    return heat_igl.geodesic_distance(surface(), 0, method="exact")


def close(distance: object, percent: float = 0.1) -> bool:
    """Near the exact distance from vertex 0."""
    return bool(np.abs(np.asarray(distance) - exact()).mean() < percent / 100 * exact().mean())


def of_igl(names: Names) -> None:
    assert close(names["phi"])


def of_trimesh(names: Names) -> None:
    assert close(names["mesh"].vertex_attributes["distance"])


def of_pyvista(names: Names) -> None:
    assert close(names["mesh"]["distance"])


def of_meshio(names: Names) -> None:
    assert close(names["mesh"].point_data["distance"])
    assert close(heat_igl.read_attributes("distance.vtu")["distance"])


def of_potpourri3d(names: Names) -> None:
    exact_7 = heat_igl.geodesic_distance(surface(), 7, method="exact")
    assert np.abs(names["phi"] - exact_7).mean() < 0.03 * exact_7.mean()


def of_libigl(names: Names) -> None:
    assert np.allclose(names["exact"], exact())
    assert close(names["heat"], 5)


def of_landmarks(names: Names) -> None:
    found = np.load("distances.npy")
    assert (found.shape, found.dtype) == ((500, 960), np.dtype("float32"))
    assert (found[np.arange(500), names["landmarks"]] == 0).all()


def of_cells(names: Names) -> None:
    found = heat_igl.read_attributes("cells.ply")
    sites = np.loadtxt("sites.csv", dtype=int)
    assert np.array_equal(sites, names["cells"].sites)
    assert np.array_equal(found["cell"][sites], np.arange(20))
    assert not found["distance"][sites].any()


def of_isolines(names: Names) -> None:
    text = Path("lines.svg").read_text()
    assert text.count("<poly") == sum(map(len, names["lines"])) >= 3


def of_path(names: Names) -> None:
    length = names["path"].lengths(surface()).sum()
    assert length == pytest.approx(heat_igl.pair_distances(surface(), [[5, 40]])[0], rel=1e-3)
    assert names["polyscope"].get_curve_network("path").n_nodes() == len(names["path"]) + 1


def of_tetrahedra(names: Names) -> None:
    found = heat_igl.read_attributes("distance.vtu")["distance"]
    straight = np.linalg.norm(names["mesh"].V - names["mesh"].V[0], axis=1)
    assert np.abs(found - straight).mean() < 0.1 * straight.mean()


def of_cortex(names: Names) -> None:
    assert names["near"].shape == (960, 960)
    assert close(heat_igl.read_attributes("distance.surf.gii")["distance"])


CHECKS: dict[str, Callable[[Names], None]] = {
    "Arrays of libigl": of_igl,
    "A mesh of trimesh": of_trimesh,
    "A mesh of pyvista, and back": of_pyvista,
    "A mesh of open3d or meshio": of_meshio,
    "In the place of potpourri3d": of_potpourri3d,
    "In the place of libigl's distances": of_libigl,
    "Distances from 500 landmarks, in single precision": of_landmarks,
    "Farthest points and their Voronoi cells, as files": of_cells,
    "Isolines as SVG": of_isolines,
    "A shortest path in polyscope": of_path,
    "Tetrahedra": of_tetrahedra,
    "A cortex in GIFTI": of_cortex,
}


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The files that the page names, in the directory that the tasks run in."""
    monkeypatch.chdir(tmp_path)
    heat_igl.write_mesh("bunny.ply", surface())
    heat_igl.write_mesh("bunny.off", surface())
    heat_igl.write_mesh("solid.mesh", shapes.box(4))


def require(code: str) -> None:
    """Skip a task whose libraries are missing."""
    needed = [name for name in LIBRARIES if re.search(rf"^import {name}\b", code, re.MULTILINE)]
    needed += ["nibabel"] * (".gii" in code) + ["meshio"] * (".vtu" in code)
    for name in needed:
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"needs {name}")


@pytest.mark.parametrize("title", CHECKS)
def test_a_task_takes_five_lines(title: str, monkeypatch: pytest.MonkeyPatch) -> None:
    code = TASKS[title]
    assert len([line for line in code.splitlines() if line.strip()]) <= 5
    require(code)
    if "polyscope" in code:  # without a display
        import polyscope

        initialize = polyscope.init
        monkeypatch.setattr(polyscope, "init", lambda: initialize("openGL_mock"))
    if ".gii" in code:
        heat_igl.write_mesh("lh.pial.surf.gii", surface())
    names: Names = {}
    exec(compile(code, title, "exec"), names)
    CHECKS[title](names)


def test_open3d_in_the_place_of_meshio() -> None:
    open3d = pytest.importorskip("open3d", exc_type=ImportError)
    mesh = open3d.io.read_triangle_mesh("bunny.off")
    assert close(heat_igl.geodesic_distance(mesh, 0))


def test_every_task_of_the_page_is_run() -> None:
    assert list(TASKS) == list(CHECKS)
