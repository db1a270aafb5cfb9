"""Meshes of other libraries: recognized by attributes, the same mesh back, one clear error for everything else."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import heat_igl
from heat_igl import Mesh, MeshError, PolygonMesh, as_mesh, shapes

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


@pytest.mark.parametrize(
    ("name", "remedy"),
    [("Scene", r"pass \.to_mesh\(\)"), ("MultiBlock", r"pass \.combine"), ("SurfaceImage", "mesh.parts")],
)
def test_what_holds_several_meshes_is_refused_by_name(name, remedy):
    with pytest.raises(MeshError, match=rf"mesh is .*{name}.*: .*{remedy}"):
        as_mesh(type(name, (), {})())
    with pytest.raises(MeshError, match=r"strips of triangles: pass mesh.triangulate\(\)"):
        as_mesh(SimpleNamespace(points=V, faces=np.empty(0, int), n_points=len(V), n_strips=2))


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
    cells = {"triangle": TETRAHEDRA[:, :3], kind: TETRAHEDRA}
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


def test_cells_of_other_kinds_are_refused():
    """Beside tetrahedra, hexahedra that are left out would be a hole."""
    for kind, name in (("hexahedron", "hexahedron"), (12, "12 of VTK"), ("tetra10", "tetra10")):
        cells = {"tetra": TETRAHEDRA, kind: np.zeros((5, 8), int)}
        with pytest.raises(MeshError, match=f"holds 5 cells of kind {name};.*convert the cells"):
            as_mesh(SimpleNamespace(points=CORNERS, cells_dict=cells))
    cells = {"tetra": TETRAHEDRA, "line3": np.zeros((5, 3), int), "vertex": np.zeros((5, 1), int)}
    assert as_mesh(SimpleNamespace(points=CORNERS, cells_dict=cells)).is_tetrahedral
    with pytest.raises(MeshError, match="the mesh has no faces"):
        as_mesh(SimpleNamespace(points=CORNERS, cells_dict={"line": F[:, :2]}))


def test_operators_and_solvers_are_refused_by_name():
    with pytest.raises(MeshError, match=r"Operators: GeodesicSolver and HeatMethodSolver take operators"):
        as_mesh(heat_igl.speed_operators(SPHERE, np.ones(len(F))))
    with pytest.raises(MeshError, match=r"HeatMethodSolver: a solver is asked itself"):
        as_mesh(heat_igl.HeatMethodSolver(SPHERE))


def test_grids_of_pyvista_name_the_way_to_cells():
    class StructuredGrid:
        """As that of pyvista, whose cells are not stored."""

    with pytest.raises(MeshError, match=r"StructuredGrid: pass .cast_to_unstructured_grid\(\).triangulate\(\)"):
        as_mesh(StructuredGrid())


def test_faces_beside_a_mesh_are_refused():
    np.testing.assert_array_equal(as_mesh(V, F).F, F)
    with pytest.raises(MeshError, match="F is given beside a Mesh"):
        as_mesh(SPHERE, F)


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
