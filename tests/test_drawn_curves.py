"""Forms that people guess: curves through clicked places, their length and points, and meshes for other libraries."""

import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import heat_igl
from heat_igl import Mesh, MeshError, SurfaceCurve, SurfacePoints, curve_through, shapes


def test_a_curve_passes_positions_vertices_and_points():
    mesh = shapes.grid(10)
    corners = np.array([[0.15, 0.2, 0], [0.7, 0.2, 0], [0.7, 0.8, 0]])
    around = np.linalg.norm(np.diff(corners[[0, 1, 2, 0]], axis=0), axis=1)
    points = heat_igl.closest_points(mesh, corners).points
    for places in (corners, corners.tolist(), points):
        assert curve_through(mesh, places).length == pytest.approx(around[:2].sum(), rel=1e-12)
        closed = curve_through(mesh, places, closed=True)
        assert closed.is_closed
        assert closed.length == pytest.approx(around.sum(), rel=1e-12)
        for corner in corners:
            assert np.linalg.norm(closed.points - corner, axis=1).min() < 1e-12
    assert curve_through(mesh, [0, 10, 120]).length == pytest.approx(2)
    mixed = curve_through(mesh, [0, SurfacePoints(points.faces[:1], points.barycentric[:1])])
    assert mixed.length == pytest.approx(0.25)


def test_a_curve_knows_its_length_points_and_direction():
    mesh = shapes.grid(10)
    curve = curve_through(mesh, [0, 60, 10])
    np.testing.assert_array_equal(curve.points, curve.positions(mesh))
    back = curve.reversed()
    np.testing.assert_allclose(back.points, curve.points[::-1], atol=1e-15)
    assert len(back) == len(curve)
    assert back.length == pytest.approx(curve.length)
    turned = Mesh(2 * mesh.V, mesh.F)
    assert curve.lengths(turned).sum() == pytest.approx(2 * curve.length)
    with pytest.raises(ValueError, match=r"does not know its mesh: name it, as in curve.positions\(mesh\)"):
        _ = SurfaceCurve(curve.faces, curve.start, curve.end).length
    assert SurfaceCurve(curve.faces, curve.start, curve.end, mesh=mesh).length == curve.length


def test_all_makers_of_curves_say_on_which_mesh():
    mesh = shapes.torus(24, 16)
    phi = mesh.V[:, 2]
    curves = [
        heat_igl.edge_curve(mesh, mesh.edges[0]),
        heat_igl.curve_on(mesh, mesh.V[mesh.edges[5]]),
        heat_igl.isolines(mesh, phi, 1)[0][0],
        heat_igl.geodesic_path(mesh, [0, 50]),
        heat_igl.mesh.region_boundary(mesh, vertices=phi > 0)[0],
        heat_igl.curves.geodesic_bezier(mesh, [0, 40, 80], 4),
        heat_igl.trace_geodesic(mesh, 0, [1.0, 0.0], 0.5),
    ]
    for curve in curves:
        assert curve.mesh is mesh
        assert curve.length == pytest.approx(curve.lengths(mesh).sum())


def test_a_number_of_isolines():
    mesh = shapes.grid(20)
    lines = heat_igl.isolines(mesh, 3 * mesh.V[:, 0], 10)
    levels = [float(3 * curve.points[0, 0]) for (curve,) in lines]
    np.testing.assert_allclose(levels, 3 * np.arange(1, 11) / 11)
    (one,) = heat_igl.isolines(mesh, 3 * mesh.V[:, 0], 1.0)
    assert one[0].points[0, 0] == pytest.approx(1 / 3)


def test_arrays_that_other_libraries_may_write():
    mesh = shapes.grid(2)
    assert mesh.vertices.flags.writeable
    assert mesh.faces.flags.writeable
    mesh.vertices[:] = 7
    mesh.faces[:] = 0
    np.testing.assert_array_equal(mesh.vertices, mesh.V)
    np.testing.assert_array_equal(mesh.faces, mesh.F)


@pytest.mark.parametrize("name", ["to_trimesh", "to_pyvista", "to_open3d"])
def test_there_and_back(name):
    pytest.importorskip(name.removeprefix("to_"))
    mesh = shapes.icosphere(2)
    phi, area = heat_igl.geodesic_distance(mesh, 0), mesh.measures
    there = getattr(heat_igl, name)(mesh, distance=phi, area=area, position=mesh.V)
    back = heat_igl.as_mesh(there)
    np.testing.assert_array_equal(back.V, mesh.V)
    np.testing.assert_array_equal(back.F, mesh.F)
    if name == "to_trimesh":
        values = there.vertex_attributes["distance"], there.face_attributes["area"]
    elif name == "to_pyvista":
        values = there.point_data["distance"], there.cell_data["area"]
    else:
        values = there.vertex["distance"].numpy()[:, 0], there.triangle["area"].numpy()[:, 0]
    np.testing.assert_array_equal(values[0], phi)
    np.testing.assert_array_equal(values[1], area)


def test_values_are_sorted_by_their_length(monkeypatch):
    """The same without the library: what its constructor gets."""
    fake = ModuleType("trimesh")
    fake.Trimesh = lambda *arrays, **named: SimpleNamespace(arrays=arrays, **named)
    monkeypatch.setitem(sys.modules, "trimesh", fake)
    mesh = shapes.grid(3)
    there = heat_igl.to_trimesh(mesh, a=np.arange(16), b=np.zeros((18, 3)))
    assert list(there.vertex_attributes) == ["a"]
    assert list(there.face_attributes) == ["b"]
    assert not there.process
    with pytest.raises(ValueError, match="a must have a row for each of 16 vertices or 18 faces, not shape"):
        heat_igl.to_trimesh(mesh, a=np.arange(5))
    with pytest.raises(MeshError, match="need triangles, but the mesh is tetrahedral"):
        heat_igl.to_trimesh(Mesh(np.eye(4)[:, :3], [[0, 1, 2, 3]]))
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(ImportError, match="trimesh"):
        heat_igl.to_trimesh(mesh)
