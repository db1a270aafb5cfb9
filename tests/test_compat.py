"""The drop-in modules: the same calls as those of libigl and potpourri3d, and the same meaning of what they return."""

from __future__ import annotations

import importlib.util
import inspect
import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import igl
import numpy as np
import pytest

import heat_igl
from heat_igl import Mesh, MeshError, SourceError, shapes
from heat_igl.compat import igl as drop_in
from heat_igl.compat import potpourri3d as pp3d

ROOT = Path(__file__).resolve().parents[1]
needs_potpourri3d = pytest.mark.skipif(importlib.util.find_spec("potpourri3d") is None, reason="needs potpourri3d")


@pytest.fixture(scope="module")
def sphere() -> Mesh:
    return shapes.icosphere(3)


@pytest.fixture(scope="module")
def torus() -> Mesh:
    return shapes.torus(24, 16)


@pytest.fixture
def peer() -> Any:
    return pytest.importorskip("potpourri3d")


def lengths(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


# --- libigl -----------------------------------------------------------------------------------------------------------


def test_every_other_name_is_libigl_s() -> None:
    assert drop_in.cotmatrix is igl.cotmatrix
    assert {"grad", "exact_geodesic", "heat_geodesic"} <= set(dir(drop_in))
    with pytest.raises(AttributeError, match="cotmatrx"):
        _ = drop_in.cotmatrx


@pytest.mark.parametrize(
    ("VS", "FS", "VT", "FT"),
    [
        ([0], [], [1, 5, 0], []),
        ([3, 17], [8, 8], [0, 40, 7], [8, 9, 60]),
        ([], [11], [], [11, 12, 100]),
        ([], [5, 90], [2], []),
    ],
)
def test_exact_geodesic_agrees_with_libigl(
    torus: Mesh, VS: list[int], FS: list[int], VT: list[int], FT: list[int]
) -> None:
    given = {name: np.array(found, np.int64) for name, found in (("VS", VS), ("FS", FS), ("VT", VT), ("FT", FT))}
    found = drop_in.exact_geodesic(torus.V, torus.F, **given)
    assert np.allclose(found, igl.exact_geodesic(torus.V, torus.F, **given), rtol=1e-9, atol=1e-9)
    in_order = drop_in.exact_geodesic(torus.V, torus.F, VS, FS, VT, FT)
    assert np.array_equal(found, in_order)


def test_exact_geodesic_without_targets_is_empty(torus: Mesh) -> None:
    assert drop_in.exact_geodesic(torus.V, torus.F, [0]).shape == (0,)


def test_exact_geodesic_refuses_wrong_indices(torus: Mesh) -> None:
    with pytest.raises(ValueError, match=r"FT\[1\] = 768 is out of range: indices run from 0 to 767"):
        drop_in.exact_geodesic(torus.V, torus.F, VS=[0], FT=[3, 768])
    with pytest.raises(ValueError, match=r"VT must be indices \(k,\), not float64"):
        drop_in.exact_geodesic(torus.V, torus.F, VS=[0], VT=[0.5])
    with pytest.raises(SourceError, match="empty"):
        drop_in.exact_geodesic(torus.V, torus.F, VT=[0])


def test_heat_geodesics_take_data_in_three_ways(sphere: Mesh) -> None:
    expected = heat_igl.HeatMethodSolver(sphere, t=0.01).distance([4, 9])
    for arguments, named in (((0.01,), {}), ((), {"t": 0.01})):
        data = drop_in.HeatGeodesicsData()
        data.use_intrinsic_delaunay = True
        if named:
            drop_in.heat_geodesics_precompute(sphere.V, sphere.F, data=data, **named)
        else:
            drop_in.heat_geodesics_precompute(sphere.V, sphere.F, *arguments, data)
        assert np.array_equal(drop_in.heat_geodesics_solve(data, np.array([4, 9])), expected)
    assert np.array_equal(drop_in.heat_geodesic(sphere.V, sphere.F, 0.01, np.array([4, 9])), expected)
    data = drop_in.HeatGeodesicsData()
    drop_in.heat_geodesics_precompute(sphere.V, sphere.F, data)
    assert np.array_equal(
        drop_in.heat_geodesics_solve(data, [4, 9]), heat_igl.HeatMethodSolver(sphere).distance([4, 9])
    )


def test_heat_geodesics_are_nearer_to_the_exact_ones_than_libigl_s(sphere: Mesh) -> None:
    exact = heat_igl.geodesic_distance(sphere, 0, method="exact")
    errors = []
    for module in (drop_in, igl):
        data = module.HeatGeodesicsData()
        module.heat_geodesics_precompute(np.array(sphere.V), np.array(sphere.F), data)
        errors.append(np.abs(module.heat_geodesics_solve(data, np.array([0])) - exact).mean())
    assert errors[0] < errors[1] < 0.1


def test_heat_geodesics_without_data(sphere: Mesh) -> None:
    with pytest.raises(TypeError, match="data is missing: pass a HeatGeodesicsData"):
        drop_in.heat_geodesics_precompute(sphere.V, sphere.F, 0.01)
    with pytest.raises(ValueError, match="data is empty: pass it to heat_geodesics_precompute first"):
        drop_in.heat_geodesics_solve(drop_in.HeatGeodesicsData(), [0])


# --- potpourri3d: names and arguments ---------------------------------------------------------------------------------


def public(module: Any) -> dict[str, Any]:
    """Functions and classes of potpourri3d, without its own checks."""
    return {
        name: value
        for name, value in vars(module).items()
        if inspect.isroutine(value) or inspect.isclass(value)
        if not name.startswith(("_", "validate"))
    }


def methods(kind: type) -> set[str]:
    return {name for name in dir(kind) if not name.startswith("_") and callable(getattr(kind, name))}


def test_what_is_absent_is_documented(peer: Any) -> None:
    page = (ROOT / "docs" / "compat.md").read_text(encoding="utf8")
    absent = set(re.findall(r"^\| `([\w.]+)` \| absent", page, re.MULTILINE))
    theirs = public(peer)
    missing = {name for name in theirs if name not in pp3d.__all__}
    for name in pp3d.__all__:
        if inspect.isclass(theirs[name]):
            missing |= {f"{name}.{method}" for method in methods(theirs[name]) - methods(getattr(pp3d, name))}
    assert missing == absent


@pytest.mark.parametrize("name", pp3d.__all__)
def test_arguments_and_defaults_are_theirs(peer: Any, name: str) -> None:
    ours, theirs = getattr(pp3d, name), getattr(peer, name)
    pairs = [(ours, theirs)]
    if inspect.isclass(ours):
        pairs += [(getattr(ours, method), getattr(theirs, method)) for method in methods(ours)]
    for one, other in pairs:
        given, expected = (
            [(p.name, p.default) for p in inspect.signature(function).parameters.values()] for function in (one, other)
        )
        if name == "write_mesh":  # texture coordinates are not written
            expected = expected[:3]
        assert given == expected, one


# --- potpourri3d: results ---------------------------------------------------------------------------------------------


@needs_potpourri3d
def test_distances_agree_within_the_error_of_heat(peer: Any, sphere: Mesh) -> None:
    for sources in ([5], [5, 100, 333]):
        exact = np.arccos(np.clip(sphere.V @ sphere.V[sources].T, -1, 1)).min(axis=1)
        ours, theirs = (
            np.abs(module.compute_distance_multisource(np.array(sphere.V), np.array(sphere.F), sources) - exact).mean()
            for module in (pp3d, peer)
        )
        assert ours < theirs < 0.05
    one = pp3d.MeshHeatMethodDistanceSolver(sphere.V, sphere.F)
    assert np.array_equal(one.compute_distance(5), one.compute_distance_multisource([5]))
    assert np.array_equal(one.compute_distance(5), pp3d.compute_distance(sphere.V, sphere.F, 5))


def test_a_larger_time_step_is_larger_in_proportion(sphere: Mesh) -> None:
    standard = heat_igl.HeatMethodSolver(sphere)
    wide = pp3d.MeshHeatMethodDistanceSolver(sphere.V, sphere.F, t_coef=4.0)
    assert wide._solver.t == pytest.approx(4 * standard.t)
    assert pp3d.MeshHeatMethodDistanceSolver(sphere.V, sphere.F)._solver.t == standard.t


def test_faces_that_repeat_a_vertex_are_left_out(sphere: Mesh) -> None:
    faces = np.concatenate([sphere.F, [[3, 3, 8]]])
    assert np.array_equal(pp3d.compute_distance(sphere.V, faces, 5), pp3d.compute_distance(sphere.V, sphere.F, 5))
    with pytest.raises(MeshError, match="repeats a vertex"):
        pp3d.GeodesicTracer(sphere.V, faces)


@needs_potpourri3d
def test_transport_agrees_in_space(peer: Any, sphere: Mesh) -> None:
    """Components differ with the frames, vectors in space do not."""
    V, F = np.array(sphere.V), np.array(sphere.F)
    found = []
    for module in (pp3d, peer):
        solver = module.MeshVectorHeatSolver(V, F)
        x, y, normal = solver.get_tangent_frames()
        assert np.allclose(np.cross(x, y), normal, atol=1e-9)
        given = np.array([x[7] @ [0, 0, 1], y[7] @ [0, 0, 1]])
        carried = solver.transport_tangent_vector(7, given)
        found.append(carried[:, :1] * x + carried[:, 1:] * y)
    near = np.linalg.norm(V - V[7], axis=1) < 1.2
    assert np.linalg.norm(found[0] - found[1], axis=1)[near].max() < 0.05


@needs_potpourri3d
def test_log_maps_agree_in_space(peer: Any, sphere: Mesh) -> None:
    V, F = np.array(sphere.V), np.array(sphere.F)
    found = []
    for module in (pp3d, peer):
        solver = module.MeshVectorHeatSolver(V, F)
        x, y, _ = solver.get_tangent_frames()
        plane = solver.compute_log_map(7, "VectorHeat")
        found.append(plane[:, :1] * x[7] + plane[:, 1:] * y[7])
    near = np.linalg.norm(V - V[7], axis=1) < 1.2
    assert np.linalg.norm(found[0] - found[1], axis=1)[near].mean() < 0.1
    with pytest.raises(ValueError, match="strategy must be one of 'VectorHeat', 'AffineLocal', 'AffineAdaptive'"):
        pp3d.MeshVectorHeatSolver(V, F).compute_log_map(7, "Affine")


@pytest.mark.parametrize("intrinsic", [False, True])
def test_connection_laplacian_is_positive(intrinsic: bool) -> None:
    sphere = shapes.icosphere(2)
    L = pp3d.MeshVectorHeatSolver(sphere.V, sphere.F, use_intrinsic_delaunay=intrinsic).get_connection_laplacian()
    assert L.format == "csc"
    assert abs(L - L.conj().T).max() < 1e-12
    assert np.linalg.eigvalsh(L.toarray()).min() > 0


def test_scalars_are_extended(sphere: Mesh) -> None:
    found = pp3d.MeshVectorHeatSolver(sphere.V, sphere.F).extend_scalar([1, 22], [0.0, 6.0])
    assert (found.min(), found.max()) >= (0.0, 5.9)
    with pytest.raises(ValueError, match="values must have shape"):
        pp3d.MeshVectorHeatSolver(sphere.V, sphere.F).extend_scalar([1, 22], [0.0])


@needs_potpourri3d
def test_paths_are_no_longer_than_theirs(peer: Any, torus: Mesh) -> None:
    V, F = np.array(torus.V), np.array(torus.F)
    ours, theirs = pp3d.EdgeFlipGeodesicSolver(V, F), peer.EdgeFlipGeodesicSolver(V, F)
    for start, end in pairwise([0, 97, 200, 13, 301]):
        path = ours.find_geodesic_path(v_start=start, v_end=end)
        assert np.allclose(path[[0, -1]], V[[start, end]])
        assert lengths(path) <= lengths(theirs.find_geodesic_path(start, end)) * (1 + 1e-9)
    with pytest.raises(ValueError, match="v_start and v_end are the same vertex, 4"):
        ours.find_geodesic_path(4, 4)


@needs_potpourri3d
def test_traced_geodesics_end_where_theirs_do(peer: Any, torus: Mesh) -> None:
    V, F = np.array(torus.V), np.array(torus.F)
    ours, theirs = pp3d.GeodesicTracer(V, F), peer.GeodesicTracer(V, F)
    direction = np.array([0.3, 0.5, 0.4])
    for face in (0, 31, 200):
        given = (face, np.array([0.1, 0.4, 0.5]), direction)
        assert np.allclose(ours.trace_geodesic_from_face(*given)[-1], theirs.trace_geodesic_from_face(*given)[-1])
    for vertex in (0, 22, 97):
        one, other = (tracer.trace_geodesic_from_vertex(vertex, direction) for tracer in (ours, theirs))
        assert np.allclose(one[0], other[0])
        assert abs(lengths(one) - lengths(other)) < 0.03 * lengths(other)
        assert np.linalg.norm(one[-1] - other[-1]) < 0.1 * lengths(other)
    assert len(ours.trace_geodesic_from_vertex(22, 9 * direction, max_iterations=2)) == 3


def test_a_direction_along_the_normal_leads_nowhere(torus: Mesh) -> None:
    tracer = pp3d.GeodesicTracer(torus.V, torus.F)
    assert np.array_equal(tracer.trace_geodesic_from_vertex(5, [0.0, 0.0, 0.0]), torus.V[[5]])


@needs_potpourri3d
def test_isolines_have_the_length_of_theirs(peer: Any, torus: Mesh) -> None:
    V, F, u = np.array(torus.V), np.array(torus.F), np.array(torus.V[:, 2])
    total = 0.0
    for curve in pp3d.marching_triangles(V, F, u, 0.03):
        points = np.array([np.array(weights) @ V[F[face]] for face, weights in curve])
        assert np.allclose(points[:, 2], 0.03)
        total += lengths(points)
    edges = peer.edges(V, F)
    theirs = 0.0
    for curve in peer.marching_triangles(V, F, u, 0.03):
        at = [V[edges[edge]] for edge, _ in curve]
        theirs += lengths(np.array([(1 - t) * a + t * b for (a, b), (_, (t,)) in zip(at, curve, strict=True)]))
    assert total == pytest.approx(theirs)


@needs_potpourri3d
def test_matrices_and_areas_are_theirs(peer: Any, torus: Mesh) -> None:
    V, F = np.array(torus.V), np.array(torus.F)
    for epsilon in (0.0, 0.01):
        difference = pp3d.cotan_laplacian(V, F, epsilon) - peer.cotan_laplacian(V, F, epsilon)
        assert abs(difference).max() < 1e-12
    assert np.allclose(pp3d.face_areas(V, F), peer.face_areas(V, F))
    assert np.allclose(pp3d.vertex_areas(V, F), peer.vertex_areas(V, F))
    assert {tuple(edge) for edge in pp3d.edges(V, F)} == {tuple(sorted(edge)) for edge in peer.edges(V, F)}


def test_polygons() -> None:
    V, F = igl.quad_grid(6, 6)[:2]
    V = np.hstack([V, np.zeros((len(V), 3 - V.shape[1]))])
    phi = pp3d.PolygonMeshHeatSolver(V, F).compute_distance([0])
    assert np.abs(phi - np.linalg.norm(V - V[0], axis=1)).max() < 0.15


def test_point_clouds(sphere: Mesh) -> None:
    solver = pp3d.PointCloudHeatSolver(sphere.V)
    exact = np.arccos(np.clip(sphere.V @ sphere.V[7], -1, 1))
    assert np.abs(solver.compute_distance(7) - exact).mean() < 0.05
    assert np.array_equal(solver.compute_distance(7), solver.compute_distance_multisource([7]))
    x, y, normal = solver.get_tangent_frames()
    assert np.allclose(np.abs(np.einsum("nx,nx->n", normal, sphere.V)), 1, atol=0.01)
    plane = solver.compute_log_map(7)
    assert np.abs(np.linalg.norm(plane, axis=1) - exact).mean() < 0.05
    assert np.abs(plane @ [x[7], y[7]] @ sphere.V[7]).max() < 0.1
    carried = solver.transport_tangent_vectors([7], [[2.0, 0.0]])
    assert np.allclose(np.linalg.norm(carried, axis=1).max(), 2)


def test_files(tmp_path: Path, torus: Mesh) -> None:
    pp3d.write_mesh(torus.V, torus.F, str(tmp_path / "a.obj"))
    V, F = pp3d.read_mesh(str(tmp_path / "a.obj"))
    assert np.array_equal(V, torus.V)
    assert np.array_equal(F, torus.F)
    V, polygons = pp3d.read_polygon_mesh(str(tmp_path / "a.obj"))
    assert polygons == torus.F.tolist()
    pp3d.write_point_cloud(torus.V, str(tmp_path / "b.ply"))
    assert np.array_equal(pp3d.read_point_cloud(str(tmp_path / "b.ply")), torus.V)


def test_the_peers_own_tests_are_run_with_the_drop_in(tmp_path: Path) -> None:
    """The script reports a failure that it does not know, and says of each test what happened."""
    (tmp_path / "test_theirs.py").write_text(
        "import igl\nimport pytest\n"
        "def test_exact_geodesic(): assert igl.exact_geodesic.__module__ == 'heat_igl.compat.igl'\n"
        "def test_other(): assert 0, 'wrong'\n"
        "def test_of_something_else(): assert 0\n"
    )
    run = [sys.executable, str(ROOT / "scripts" / "peer_tests.py"), f"igl={tmp_path / 'test_theirs.py'}"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [*run, "--only", "geodesic", "wrong"], capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 1
    assert "| igl | 1 | 0 | 1 |" in done.stdout
    assert "| igl | test_other | not known: AssertionError: wrong" in done.stdout
