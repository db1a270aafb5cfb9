"""Everything that takes a mesh takes meshes of other libraries: each public function is called with one."""

import inspect
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

import heat_igl
from heat_igl import Mesh, applications, plots, reference, shapes
from heat_igl.validation import metrics

MESH = shapes.torus(16, 10)
OTHER = SimpleNamespace(vertices=MESH.V, faces=MESH.F)  # as trimesh has it
BOX = Mesh(4 * shapes.box(6).V - 2, shapes.box(6).F)
PHI = heat_igl.geodesic_distance(MESH, 0)
SOLVER = heat_igl.HeatMethodSolver(MESH)
LOOPS = heat_igl.isolines(MESH, MESH.V[:, 0], 0.1)[0]
CELLS = heat_igl.voronoi_cells(MESH, np.arange(0, MESH.n_vertices, 5))
PATH = heat_igl.edge_curve(MESH, MESH.edges[7])
LABELS = np.arange(MESH.n_vertices) % 3

Call = Callable[[Any], Any]

CALLS: dict[str, Call] = {
    "GeodesicSolver": lambda mesh: heat_igl.GeodesicSolver(mesh).distance(0),
    "GeodesicPathSolver": lambda mesh: heat_igl.curves.GeodesicPathSolver(mesh).path([0, 40]).positions(MESH),
    "HeatMethodSolver": lambda mesh: heat_igl.HeatMethodSolver(mesh).distance(0),
    "SignedHeatSolver": lambda mesh: heat_igl.SignedHeatSolver(mesh).distance(LOOPS),
    "VectorHeatSolver": lambda mesh: heat_igl.VectorHeatSolver(mesh).extend([0, 40], [1, 2]),
    "as_mesh": lambda mesh: heat_igl.as_mesh(mesh).V,
    "centroidal_voronoi": lambda mesh: heat_igl.centroidal_voronoi(mesh, [0, 40, 80], rounds=2).labels,
    "closest_points": lambda mesh: heat_igl.closest_points(mesh, [[1, 0, 0]]).points.barycentric,
    "connection_laplacian": heat_igl.operators.connection_laplacian,
    "curve_on": lambda mesh: heat_igl.curve_on(mesh, MESH.V[MESH.F[3]]).positions(MESH),
    "curve_through": lambda mesh: heat_igl.curve_through(mesh, [0, 40]).positions(MESH),
    "cut": lambda mesh: heat_igl.cut(mesh, LOOPS).mesh.V,
    "diameter": heat_igl.diameter,
    "distance_matrix": lambda mesh: heat_igl.distance_matrix(mesh, [0, 5]),
    "distances_within": lambda mesh: heat_igl.distances_within(mesh, 0.5),
    "dual_triangulation": lambda mesh: heat_igl.sampling.dual_triangulation(mesh, CELLS).V,
    "edge_curve": lambda mesh: heat_igl.edge_curve(mesh, MESH.edges[7]).positions(MESH),
    "enclosed_areas": lambda mesh: heat_igl.curves.enclosed_areas(mesh, PHI, 0.3),
    "exp_map": lambda mesh: heat_igl.exp_map(mesh, 0, [[0.1, 0.2]]).barycentric,
    "farthest_cells": lambda mesh: heat_igl.farthest_cells(mesh, 4).labels,
    "farthest_points": lambda mesh: heat_igl.farthest_points(mesh, 4),
    "geodesic_bezier": lambda mesh: heat_igl.curves.geodesic_bezier(mesh, [0, 3, 21, 40], 4).positions(MESH),
    "geodesic_distance": lambda mesh: heat_igl.geodesic_distance(mesh, 0),
    "geodesic_errors": lambda mesh: heat_igl.geodesic_errors(mesh, [0, 5], [3, 5]),
    "geodesic_path": lambda mesh: heat_igl.geodesic_path(mesh, [0, 40]).positions(MESH),
    "handle_loops": lambda mesh: [len(loop) for loop in heat_igl.curves.handle_loops(mesh)],
    "isolines": lambda mesh: heat_igl.isolines(mesh, PHI, 0.3)[0][0].positions(MESH),
    "karcher_mean": lambda mesh: heat_igl.karcher_mean(mesh, [0, 3, 21]).barycentric,
    "log_map": lambda mesh: heat_igl.log_map(mesh, 0),
    "log_maps_within": lambda mesh: heat_igl.log_maps_within(mesh, 0.3).departure,
    "metric_operators": lambda mesh: heat_igl.metric_operators(mesh, np.tile(np.eye(3), (MESH.n_faces, 1, 1))).L,
    "nearest_vertices": lambda mesh: heat_igl.nearest_vertices(mesh, 3)[1],
    "offset_curves": lambda mesh: heat_igl.curves.offset_curves(mesh, SOLVER, 0, 0.3)[0].positions(MESH),
    "pair_distances": lambda mesh: heat_igl.pair_distances(mesh, [[0, 7], [3, 9]]),
    "parcel_distances": lambda mesh: heat_igl.parcel_distances(mesh, LABELS, statistic="min"),
    "region_boundary": lambda mesh: heat_igl.mesh.region_boundary(mesh, vertices=LABELS < 1)[0].positions(MESH),
    "shortest_path": lambda mesh: heat_igl.shortest_path(mesh, 0, 40).points,
    "shortest_paths": lambda mesh: heat_igl.shortest_paths(mesh, 40, 0)[0].positions(MESH),
    "signed_distance": lambda mesh: heat_igl.signed_distance(mesh, LOOPS),
    "smooth": lambda mesh: heat_igl.smooth(mesh, PHI, 0.3),
    "speed_operators": lambda mesh: heat_igl.speed_operators(mesh, np.ones(MESH.n_faces)).L,
    "activation_times": lambda mesh: heat_igl.activation_times(mesh, np.eye(3), 0),
    "straighten": lambda mesh: heat_igl.straighten(mesh, PATH).positions(MESH),
    "sublevel_areas": lambda mesh: heat_igl.curves.sublevel_areas(mesh, PHI, [0.1, 0.3]),
    "tangent_frames": lambda mesh: heat_igl.tangent_frames(mesh).x,
    "trace_geodesic": lambda mesh: heat_igl.trace_geodesic(mesh, 0, [0, 0, 1], 0.3).positions(MESH),
    "validate": lambda mesh: heat_igl.validate(mesh, [0], methods=("heat",)).distances["heat"],
    "volume_signed_distance": lambda mesh: heat_igl.volume_signed_distance(BOX, mesh),
    "voronoi_cells": lambda mesh: heat_igl.voronoi_cells(mesh, [0, 40]).labels,
    "write_curves": lambda mesh: written(lambda path: heat_igl.write_curves(path, mesh, LOOPS), "a.obj"),
    "write_distances_within": lambda mesh: written(
        lambda path: heat_igl.write_distances_within(path, mesh, 0.3), "a.zarr"
    ),
    "write_mesh": lambda mesh: written(lambda path: heat_igl.write_mesh(path, mesh), "a.obj"),
    "plots.page": lambda mesh: plots.page(mesh, PHI).html,
    "plots.plot": lambda mesh: plots.plot(mesh, PHI),
    "plots.plot_field": lambda mesh: plots.plot_field(mesh, PHI, label="phi"),
    "plots.plot_labels": lambda mesh: plots.plot_labels(mesh, LABELS),
    "plots.write_line_drawing": lambda mesh: written(lambda path: plots.write_line_drawing(path, mesh, LOOPS), "a.svg"),
    "applications.EdgeSearch": lambda mesh: applications.EdgeSearch(mesh).path(0, 40).vertices,
    "reference.edge_paths": lambda mesh: reference.edge_paths(mesh, 0),
    "reference.exact": lambda mesh: reference.exact(mesh, 0),
    "reference.straight_lines": lambda mesh: reference.straight_lines(mesh, 0),
    "metrics.bound_violations": lambda mesh: metrics.bound_violations(mesh, PHI, 0).n_above,
    "metrics.eikonal_residual": lambda mesh: metrics.eikonal_residual(mesh, PHI),
    "metrics.error_summary": lambda mesh: metrics.error_summary(mesh, PHI[None], PHI[None] + 0.1, [0]).mean,
}
# Results that hold a mesh, and functions that call programs of others in processes of their own.
NOT_CALLED = {"CutMesh", "ImageDomain", "MeshPiece", "SurfaceCurve", "Terrain", "ValidationReport"}
# Called in the tests of curves, with stand-ins for the libraries.
NOT_CALLED |= {"to_open3d", "to_pyvista", "to_trimesh"}
IN_PROCESSES = {"igl_heat", "measured", "meshlab", "meshlab_border", "meshlab_heat", "potpourri3d_heat"}


def written(write: Callable[[Path], Any], name: str) -> str:
    """What is written, or that it is; the directory is the temporary one of the test."""
    if Path(name).exists():
        Path(name).rename(f"of another library, {name}")
    write(Path(name))
    return Path(name).read_text(encoding="utf8") if name.endswith((".obj", ".svg")) else str(Path(name).exists())


class Drawn:
    """In place of a picture, which takes a second to draw: the scene."""

    def __init__(self, seen: Any, *_: Any) -> None:
        self.content = f"{seen.V.tolist()} {seen.F.tolist()} {seen.values.tolist()}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Drawn) and self.content == other.content

    __hash__ = None

    def save(self, path: Path) -> None:
        path.write_text(self.content)


def takes_a_mesh(value: Any) -> bool:
    try:
        parameters = inspect.signature(value).parameters.values()
    except (TypeError, ValueError):
        return False
    return any(
        parameter.name == "mesh" or ("MeshLike" in str(parameter.annotation) and parameter.name != "meshes")
        for parameter in parameters
    )


def public(module: Any) -> set[str]:
    return {name for name in module.__all__ if takes_a_mesh(getattr(module, name)) if name not in NOT_CALLED}


def test_every_function_with_a_mesh_is_called():
    found = public(heat_igl) | {f"plots.{name}" for name in public(plots)}
    found |= {f"reference.{name}" for name in public(reference) - IN_PROCESSES}
    found |= {f"metrics.{name}" for name in public(metrics)}
    found |= {f"applications.{name}" for name in public(applications) - public(heat_igl)}
    assert found <= set(CALLS)


def plain(value: Any) -> Any:
    return value.toarray() if sp.issparse(value) else value


@pytest.mark.parametrize("name", CALLS)
def test_a_mesh_of_another_library_gives_the_same(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if name.startswith("plots."):
        pytest.importorskip("matplotlib")
        monkeypatch.setattr("heat_igl.drawing.plots.lay_out", Drawn)
        monkeypatch.setattr("heat_igl.drawing.line_drawing._PIXELS", 100)
    found, expected = plain(CALLS[name](OTHER)), plain(CALLS[name](MESH))
    if isinstance(found, np.ndarray):
        np.testing.assert_array_equal(found, expected)
    else:
        assert found == expected
