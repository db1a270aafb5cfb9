"""Messages name the argument and the remedy."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import heat_igl
from heat_igl import (
    HeatMethodSolver,
    SourceError,
    SurfaceCurve,
    SurfacePoints,
    farthest_points,
    geodesic_distance,
    shapes,
    shortest_paths,
    voronoi_cells,
)
from heat_igl.intrinsic import TangentFrames

MESH = shapes.icosphere(2)
SOLVER = HeatMethodSolver(MESH)
PHI = SOLVER.distance(0)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (
            lambda: geodesic_distance(MESH, 0, cut_off=1.0),
            r"geodesic_distance\(\) .* 'cut_off'. Did you mean 'cutoff'\?",
        ),
        (lambda: geodesic_distance(MESH, source=0), r"'source'. Did you mean 'sources'\?"),
        (lambda: HeatMethodSolver(MESH, laplace="cotan"), r"HeatMethodSolver.*'laplace'. Did you mean 'laplacian'\?"),
        (lambda: SOLVER.distances([[0]], radius=1.0), r"It takes source_sets, out, progress, dtype, cutoff$"),
        (lambda: shortest_paths(MESH, target=3, sources=0), r"Did you mean 'targets'\?"),
    ],
)
def test_unknown_arguments_name_the_nearest_one(ask, message):
    with pytest.raises(TypeError, match=message):
        ask()


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: shortest_paths(MESH, 162, 0), r"targets\[0\] = 162 is no vertex"),
        (lambda: shortest_paths(MESH, [], 0), "targets is empty"),
        (
            lambda: shortest_paths(MESH, SurfacePoints([999], [1, 0, 0]), 0),
            r"targets: faces\[0\] = 999 is no face",
        ),
        (lambda: farthest_points(SOLVER, 3, start=162), r"start\[0\] = 162 is no vertex"),
        (lambda: farthest_points(MESH, 3, start=[0.5]), "start must be a vertex index.* not floats such as 0.5"),
        (lambda: voronoi_cells(SOLVER, [1, 162]), r"sites\[1\] = 162 is no vertex"),
    ],
)
def test_errors_name_the_argument_of_the_offender(ask, message):
    with pytest.raises(SourceError, match=f"^{message}"):
        ask()


HIDDEN = np.ma.masked_array([1, 2], mask=[True, False])


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: heat_igl.geodesic_path(MESH, [0, 1], closed="no"), "closed must be True or False, not 'no'"),
        (lambda: SurfaceCurve([0], [[1, 0, 0]], [[0, 1, 0]], 2), "is_closed must be True or False, not 2"),
        (lambda: SOLVER.distances([0], progress="bar"), "progress must be True or False, not 'bar'"),
        (lambda: geodesic_distance(MESH, HIDDEN), "sources has 1 masked entries: fill or remove them"),
        (lambda: SurfacePoints(HIDDEN, np.eye(3)[:2]), "faces has 1 masked entries"),
        (lambda: heat_igl.karcher_mean(MESH, [0, 1], HIDDEN), "weights has 1 masked entries"),
        (lambda: shapes.grid(np.inf), "n must be an integer of at least 1, not inf"),
        (lambda: shapes.icosphere(162), "subdivisions must be at most 12, not 162"),
        (lambda: heat_igl.exp_map(MESH, 0, np.empty((0, 2))), r"vectors must be one vector or more.* \(0, 2\)"),
        (lambda: TangentFrames.from_angles("1"), "angles must be real numbers, not '?"),
    ],
)
def test_arguments_that_numpy_would_take_for_something_else_are_refused(ask, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        ask()


def test_curves_are_written_from_lists_of_any_depth(tmp_path):
    levels = heat_igl.isolines(MESH, PHI, [0.5, 1, 1.5])
    flat = [curve for level in levels for curve in level]
    written = {}
    for name, curves in {"nested": levels, "flat": flat, "deep": [levels[:1], [[levels[1:]]]], "one": flat[0]}.items():
        heat_igl.write_curves(tmp_path / f"{name}.obj", MESH, curves)
        written[name] = (tmp_path / f"{name}.obj").read_text()
    assert written["nested"] == written["flat"] == written["deep"]
    assert written["flat"].count("\nl ") == len(flat)
    assert written["one"].count("\nl ") == 1
    heat_igl.write_curves(tmp_path / "named.obj", MESH, {"near": levels[:1], "far": levels[2]})
    assert "g near" in (tmp_path / "named.obj").read_text()
    for curves, message in (
        ([levels, [3]], r"curves\[1\]\[0\] must be a SurfaceCurve or a list of such, not int"),
        ({"a": PHI}, r"curves\['a'\] must be a SurfaceCurve or a list of such, not ndarray"),
    ):
        with pytest.raises(TypeError, match=message):
            heat_igl.write_curves(tmp_path / "wrong.obj", MESH, curves)
    assert not (tmp_path / "wrong.obj").exists()


def test_extras_and_libraries_in_messages_are_those_of_the_project():
    root = Path(heat_igl.__file__).parents[1]
    if not (root / "pyproject.toml").exists():
        pytest.skip("the project's files are not beside the package")
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    code = "\n".join(path.read_text() for path in (root / "heat_igl").rglob("*.py"))
    without_examples = re.sub(r"^ *(?:>>>|\.\.\. ).*$", "", code, flags=re.MULTILINE)
    calls = re.findall(
        r"MissingExtraError\.(?:of|guard|check)\(\s*f?(?:\"[^\"]*\"|'[^']*'),\s*[\"']([^\"']+)[\"'],\s*[\"'](\w+)[\"']",
        without_examples,
    )
    assert len(calls) > 10
    for packages, extra in calls:
        held = {re.split(r"[<>=\[;]", requirement)[0].strip().lower() for requirement in extras[extra]}
        assert set(packages.split(" and ")) <= held, (packages, extra)
