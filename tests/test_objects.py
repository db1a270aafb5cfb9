"""Meshes of other libraries: recognized by attributes, the same mesh back, taken by all that takes a mesh."""

import inspect
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

import heat_igl
from heat_igl import Mesh, MeshError, PolygonMesh, applications, as_mesh, plots, reference, shapes
from heat_igl.validation import metrics

SPHERE = shapes.icosphere(1)
SQUARES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0.0]])
TWO_QUADS = [[0, 1, 3, 2], [1, 4, 5, 3]]
TRIANGLE_AND_QUAD = [[0, 1, 2], [1, 4, 5, 3]]
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.0]])
TETRAHEDRA = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])


def padded(polygons: Any) -> np.ndarray:
    return np.concatenate([[len(polygon), *polygon] for polygon in polygons])


class Gifti:
    def __init__(self, V: np.ndarray, F: np.ndarray) -> None:
        self._arrays = {"pointset": V, "triangle": F}

    def agg_data(self, intents: tuple[str, ...]) -> tuple[np.ndarray, ...]:
        return tuple(self._arrays[intent] for intent in intents)


class MeshSet:
    def current_mesh(self) -> Any:
        return SimpleNamespace(vertex_matrix=lambda: SPHERE.V, face_matrix=lambda: SPHERE.F.astype(np.int32))


V, F = SPHERE.V, SPHERE.F
TRIANGLES = {
    "pair": (V, F),
    "lists": [V.tolist(), F.tolist()],
    "vertices and faces": SimpleNamespace(vertices=V, faces=F),
    "vertices and triangles": SimpleNamespace(vertices=V, triangles=F.astype(np.int32)),
    "points and padded faces": SimpleNamespace(points=V, faces=padded(F), n_points=len(V)),
    "points and blocks by name": SimpleNamespace(points=V, cells_dict={"line": F[:, :2], "triangle": F}),
    "points and blocks by number": SimpleNamespace(points=V, cells_dict={5: F}),
    "mesh set": MeshSet(),
    "GIFTI": Gifti(V, F),
    "coordinates and faces": SimpleNamespace(coordinates=V, faces=F),
    "wrapped": SimpleNamespace(VTKObject=SimpleNamespace(points=V, faces=padded(F), n_points=len(V))),
}


@pytest.mark.parametrize("given", TRIANGLES.values(), ids=TRIANGLES)
def test_triangles_come_as_they_are(given):
    mesh = as_mesh(given)
    assert isinstance(mesh, Mesh)
    np.testing.assert_array_equal(mesh.V, V)
    np.testing.assert_array_equal(mesh.F, F)


POLYGONS = {
    "vertices and faces": SimpleNamespace(vertices=SQUARES, faces=TWO_QUADS),
    "vertices and cells": SimpleNamespace(vertices=SQUARES, cells=TRIANGLE_AND_QUAD),
    "padded quads": SimpleNamespace(points=SQUARES, faces=padded(TWO_QUADS), n_points=6),
    "padded, of two degrees": SimpleNamespace(points=SQUARES, faces=padded(TRIANGLE_AND_QUAD), n_points=6),
    "blocks": SimpleNamespace(points=SQUARES, cells_dict={"triangle": [[0, 1, 2]], "quad": [[1, 4, 5, 3]]}),
}


@pytest.mark.parametrize("given", POLYGONS.values(), ids=POLYGONS)
def test_polygons_stay_polygons(given):
    mesh = as_mesh(given)
    assert isinstance(mesh, PolygonMesh)
    expected = TWO_QUADS if mesh.degree[0] == 4 else TRIANGLE_AND_QUAD
    assert [polygon.tolist() for polygon in mesh.polygons] == expected
    np.testing.assert_array_equal(mesh.V, SQUARES)


@pytest.mark.parametrize("kind", ["tetra", 10])
def test_tetrahedra_come_without_the_triangles_around_them(kind):
    cells = {"triangle": TETRAHEDRA[:, :3], kind: TETRAHEDRA, "line3": np.zeros((5, 3), int), "vertex": [[0]]}
    mesh = as_mesh(SimpleNamespace(points=CORNERS, cells_dict=cells))
    assert isinstance(mesh, Mesh)
    np.testing.assert_array_equal(mesh.F, TETRAHEDRA)


@pytest.mark.parametrize("library", ["trimesh", "pyvista", "meshio", "pymeshlab", "vedo", "nibabel"])
def test_meshes_of_the_libraries_themselves(library):
    module = pytest.importorskip(library)
    if library == "trimesh":
        made = module.Trimesh(V, F, process=False)
    elif library == "pyvista":
        made = module.PolyData.from_regular_faces(V, F)
    elif library == "meshio":
        made = module.Mesh(V, [("triangle", F)])
    elif library == "pymeshlab":
        made = module.Mesh(V, F)
    elif library == "vedo":
        made = module.Mesh([V, F])
    else:
        arrays = [
            module.gifti.GiftiDataArray(V.astype(np.float32), intent="NIFTI_INTENT_POINTSET"),
            module.gifti.GiftiDataArray(F.astype(np.int32), intent="NIFTI_INTENT_TRIANGLE"),
        ]
        made = module.gifti.GiftiImage(darrays=arrays)
    mesh = as_mesh(made)
    np.testing.assert_allclose(mesh.V, V, atol=1e-7)
    assert isinstance(mesh, Mesh)
    np.testing.assert_array_equal(mesh.F, F)


WRONG = {
    "a number": (3, "mesh is of type int, which is not understood: pass a Mesh, PolygonMesh or PointCloud, a pair"),
    "nothing": (None, "mesh is of type NoneType"),
    "an object": (SimpleNamespace(vertices=V), "mesh is a types.SimpleNamespace, which is not understood"),
    "positions alone": (V, "faces F are missing"),
    "no faces": (SimpleNamespace(vertices=V, faces=F[:0]), "the mesh has no faces"),
    "no file": ("missing.ply", "missing.ply: no such file"),
    "no surface": (Gifti(V, F[:0]), "holds no surface"),
    "faces out of range": (SimpleNamespace(vertices=V, faces=F + 1), "is no vertex"),
    "strips": (
        SimpleNamespace(points=V, faces=np.empty(0, int), n_points=len(V), n_strips=2),
        r"strips of triangles: pass mesh.triangulate\(\)",
    ),
    "lines": (SimpleNamespace(points=CORNERS, cells_dict={"line": F[:, :2]}), "the mesh has no faces"),
    # Beside tetrahedra, hexahedra that are left out would be a hole.
    **{
        f"cells of kind {kind}": (
            SimpleNamespace(points=CORNERS, cells_dict={"tetra": TETRAHEDRA, kind: np.zeros((5, 8), int)}),
            f"holds 5 cells of kind {name};.*convert the cells",
        )
        for kind, name in (("hexahedron", "hexahedron"), (12, "12 of VTK"), ("tetra10", "tetra10"))
    },
    # Several meshes, and what does not store its cells.
    **{
        name: (type(name, (), {})(), f"mesh is .*{name}.*: .*{remedy}")
        for name, remedy in (
            ("Scene", r"pass \.to_mesh\(\)"),
            ("MultiBlock", r"pass \.combine"),
            ("SurfaceImage", "mesh.parts"),
            ("StructuredGrid", r"pass .cast_to_unstructured_grid\(\).triangulate\(\)"),
        )
    },
    # On tetrahedra, the type of operators is a private one.
    **{
        f"operators of {len(mesh.F)} faces": (
            heat_igl.speed_operators(mesh, np.ones(mesh.n_faces)),
            r"\.Operators: GeodesicSolver and HeatMethodSolver take operators",
        )
        for mesh in (SPHERE, shapes.box(1))
    },
    "a solver": (heat_igl.HeatMethodSolver(SPHERE), "HeatMethodSolver: a solver is asked itself"),
}


@pytest.mark.parametrize(("given", "message"), WRONG.values(), ids=WRONG)
def test_what_is_not_understood_is_one_error(given, message):
    with pytest.raises(MeshError, match=message):
        as_mesh(given)


class PointCloud:
    """As those of trimesh and open3d."""

    def __init__(self, **attributes: Any) -> None:
        self.__dict__.update(attributes)


class Tensor:
    def __init__(self, array: np.ndarray) -> None:
        self._array = array

    def cpu(self):
        return self

    def numpy(self) -> np.ndarray:
        return self._array


CLOUDS = {
    "trimesh": (PointCloud(vertices=V), False),
    "open3d": (PointCloud(points=V.tolist(), normals=2 * V, has_normals=lambda: True), True),
    "open3d, without normals": (PointCloud(points=V, normals=V[:0], has_normals=lambda: False), False),
    "tensors of open3d": (PointCloud(point={"positions": Tensor(V), "normals": Tensor(V)}), True),
    "pyvista": (
        SimpleNamespace(points=V, faces=F[:0], n_points=42, point_data=SimpleNamespace(active_normals=V)),
        True,
    ),
    "normals that are all 0": (PointCloud(points=V, normals=0 * V, has_normals=lambda: True), False),
    "meshio": (SimpleNamespace(points=V, cells_dict={"vertex": np.arange(42)[:, None]}), False),
    "meshio, without cells": (SimpleNamespace(points=V, cells_dict={}), False),
}


@pytest.mark.parametrize(("given", "has_normals"), CLOUDS.values(), ids=CLOUDS)
def test_points_become_a_cloud(given, has_normals):
    cloud = as_mesh(given)
    assert isinstance(cloud, heat_igl.PointCloud)
    np.testing.assert_array_equal(cloud.P, V)
    if has_normals:
        np.testing.assert_allclose(cloud.normals, V, rtol=1e-15)
    else:
        assert cloud.normals is None


@pytest.mark.parametrize("library", ["trimesh", "pyvista", "meshio", "open3d"])
def test_points_of_the_libraries_themselves(library):
    module = pytest.importorskip(library)
    if library == "trimesh":
        made = module.PointCloud(V)
    elif library == "pyvista":
        made = module.PolyData(V)
    elif library == "meshio":
        made = module.Mesh(V, [])
    else:
        made = module.geometry.PointCloud(module.utility.Vector3dVector(V.copy()))
    np.testing.assert_allclose(as_mesh(made).P, V, atol=1e-7)


def test_two_arrays_are_a_mesh():
    np.testing.assert_array_equal(as_mesh(V, F).F, F)


@pytest.mark.parametrize("suffix", ["xyz", "ply", "obj", "npy"])
def test_a_path_gives_a_cloud_if_the_format_holds_points_only(tmp_path, suffix):
    cloud = heat_igl.PointCloud(np.random.default_rng(0).normal(size=(40, 3)))
    path = tmp_path / f"points.{suffix}"
    heat_igl.write_point_cloud(path, cloud)
    if suffix in ("ply", "obj"):  # formats of meshes: a file without faces may be a damaged one
        with pytest.raises(MeshError, match=rf"points.{suffix}: .* read_point_cloud, or --points on the command line"):
            heat_igl.as_mesh(str(path))
        return
    found = heat_igl.as_mesh(str(path))
    assert isinstance(found, heat_igl.PointCloud)
    np.testing.assert_allclose(found.P, cloud.P)


MESH = shapes.torus(16, 10)
OTHER = SimpleNamespace(vertices=MESH.V, faces=MESH.F)  # as trimesh has it
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
    "exp_map": lambda mesh: heat_igl.exp_map(mesh, 0, [[0.1, 0.2]]).barycentric,
    "farthest_cells": lambda mesh: heat_igl.farthest_cells(mesh, 4).labels,
    "farthest_points": lambda mesh: heat_igl.farthest_points(mesh, 4),
    "geodesic_bezier": lambda mesh: heat_igl.curves.geodesic_bezier(mesh, [0, 3, 21, 40], 4).positions(MESH),
    "geodesic_distance": lambda mesh: heat_igl.geodesic_distance(mesh, 0),
    "geodesic_errors": lambda mesh: heat_igl.geodesic_errors(mesh, [0, 5], [3, 5]),
    "geodesic_path": lambda mesh: heat_igl.geodesic_path(mesh, [0, 40]).positions(MESH),
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
IN_PROCESSES = {"measured", "meshlab", "meshlab_border", "meshlab_heat"}


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
        monkeypatch.setattr("heat_igl.drawing.plots._PIXELS", 100)
    found, expected = plain(CALLS[name](OTHER)), plain(CALLS[name](MESH))
    if isinstance(found, np.ndarray):
        np.testing.assert_array_equal(found, expected)
    else:
        assert found == expected
